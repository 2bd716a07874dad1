"""The command line: ``awiwi-gen`` and ``python -m awiwi_gen``; each command a few lines.

Exit codes: 0 done, 1 verification failed or out of date, 2 bad input.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial, wraps
from pathlib import Path
from typing import Annotated, Any

from awiwi_gen import exits, extras, terminal
from awiwi_gen.errors import AwiwiError, InputError, printable
from awiwi_gen.extras import GENERATE, HAND
from awiwi_gen.patterns import matches
from awiwi_gen.resources import DEFAULT_HAND
from awiwi_gen.tables import fitted, print_table

if absent := extras.missing("awiwi-gen", *extras.COMMAND_LINE):
    exits.leave(exits.SYSTEM, f'{absent}; Python alone has awiwi_gen.load("generated")')

import typer

from awiwi_gen.arguments import (
    GENERATED,
    PAGE,
    HandFile,
    Json,
    KernelName,
    Math,
    MathOption,
    Only,
    Output,
    Params,
    ParamsOption,
    Scalar,
    ScalarOption,
    Version,
)
from awiwi_gen.diff.command import diff
from awiwi_gen.editing import init, schema, set_
from awiwi_gen.explain import explain
from awiwi_gen.identify.command import identify
from awiwi_gen.interchange.command import export, import_
from awiwi_gen.show import show
from awiwi_gen.study.command import study
from awiwi_gen.tick.command import replay, tick
from awiwi_gen.tune.command import tune

app = typer.Typer(
    help="From the CAD numbers of a tendon-driven hand to verified real-time C.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback()
def options(version: Version = False) -> None:
    """What holds for all commands."""


def command(*needs: str, **settings: Any) -> Callable[[Callable[..., int | None]], Callable[..., None]]:
    """Register a command that needs some modules, with settings of its parser.

    An error becomes one message and an exit code, in JSON with --json.
    """

    def register(function: Callable[..., int | None]) -> Callable[..., None]:
        name = function.__name__.removesuffix("_")

        @wraps(function)
        def run(**options: Any) -> None:
            try:
                with exits.system_errors():
                    extras.require(name, *needs)
                    code = function(**options)
            except AwiwiError as known:
                if options.get("as_json"):
                    from awiwi_gen.report import error_entry, print_json

                    print_json(error_entry(known))
                else:
                    print(fitted(printable(str(known)), sys.stderr), file=sys.stderr)
                code = known.exit_code
            raise typer.Exit(code or 0)

        app.command(name, context_settings=settings)(run)
        return run

    return register


def make_job(
    hand: Path | None,
    scalar: Scalar = Scalar.f64,
    params: Params = Params.baked,
    only: str = "*",
    math: Math = Math.own,
) -> Any:
    """A job from options and a hand file. Raises InputError for a bad file, and where the pattern matches no kernel."""
    from awiwi_gen.cache import Cache
    from awiwi_gen.emit.options import Options
    from awiwi_gen.facts import facts
    from awiwi_gen.pipeline import Job
    from awiwi_gen.report import Progress

    store, options = Cache(), Options(scalar.value, params.value, math.value)
    known = facts(hand, store)
    job = Job(cache(partial(terminal.load_hand, hand)), options, only, store, progress=Progress(), facts=known)
    if not any(matches(name, only) for name in known.kernels):
        why = terminal.why_absent(known.left_out, only) or f"no kernel has such a name; see {terminal.listing(hand)}"
        raise InputError(f"--only {only}: {why}")
    return job


@command(*GENERATE)
def generate(
    hand: HandFile = None, output: Output = GENERATED, scalar: ScalarOption = Scalar.f64,
    params: ParamsOption = Params.baked, math: MathOption = Math.own, only: Only = "*", as_json: Json = False,
    verify: Annotated[bool, typer.Option("--verify", help="Verify what was generated.")] = False,
    accept_cost: Annotated[bool, typer.Option("--accept-cost", help="Let kernels exceed their budget.")] = False,
) -> int:  # fmt: skip
    """Derive, compare the witnesses, optimise and write the C."""
    from awiwi_gen.pipeline import generate
    from awiwi_gen.report import print_json

    job = replace(make_job(hand, scalar, params, only, math), accept_cost=accept_cost)
    if verify:
        from awiwi_gen.compiler import compiler

        compiler()  # without one nothing can be verified: an error before anything is replaced
    if job.facts.certificate:
        from awiwi_gen.certificates import kept_certificate

        beside = (hand or DEFAULT_HAND).parent
        if kept_certificate(job.facts.certificate, job.store, beside) is None:
            extras.require("the check of the hand's gains", "scipy")
            from awiwi_gen.tune.hand_gains import require_running_gains

            require_running_gains(job.hand, job.store, beside)
    changed = generate(job, output)
    if verify:
        return terminal.prove(job, hand, output, as_json)
    if as_json:
        print_json({"directory": str(output), "changed": changed, "digest": job.facts.digest})
    else:
        print(f"{output}: {'generated' if changed else 'already up to date'}")
    return 0


@command(*GENERATE)
def check(
    hand: HandFile = None, output: Output = GENERATED, scalar: ScalarOption = Scalar.f64,
    params: ParamsOption = Params.baked, math: MathOption = Math.own, only: Only = "*", as_json: Json = False,
) -> int:  # fmt: skip
    """Check the hand file, and whether the generated C is fresh and unedited."""
    from awiwi_gen.certificates import certificate_lines
    from awiwi_gen.pipeline import state
    from awiwi_gen.report import counted, print_json, print_left_out, state_lines

    job = make_job(hand, scalar, params, only, math)
    known, found = job.facts, state(job, output)
    if as_json:
        extra = {"warnings": [each.as_dict() for each in known.warnings], "tick": known.tick, "estimates": known.estimates,
                 "left_out": [{"name": name, "reason": reason} for name, reason in known.left_out.items()]}  # fmt: skip
        print_json({"hand": known.name, "fresh": found.fresh, **vars(found), **extra})
    else:
        more = f", {counted(len(known.warnings), 'warning')}" if known.warnings else ""
        print(printable(f"{hand or 'hand.toml'}: {counted(known.fingers, 'finger')}, no faults{more}"))
        print("".join(fitted(f"warning: {each}\n", sys.stdout) for each in known.warnings), end="")
        print_left_out(known.left_out)
        lines = (*known.lines, *certificate_lines(known.certificate, job.store, (hand or DEFAULT_HAND).parent))
        print(printable("".join(f"{line}\n" for line in lines)), end="")
        print("\n".join(state_lines(found, str(output), terminal.fix(job, hand, output))))
    return 0 if found.fresh or (found.missing and not found.foreign) else 1


@command()
def amalgamate(
    directory: Annotated[Path, typer.Argument()] = GENERATED, output: Output = Path("build/one"), as_json: Json = False
) -> None:
    """Write all C of the directory as one header and one C file, awiwi.h and awiwi.c in the output directory."""
    from awiwi_gen.amalgamate import run

    run(directory, output, as_json)


@command(*GENERATE)
def wheel(
    hand: HandFile = None, scalar: ScalarOption = Scalar.f64, params: ParamsOption = Params.baked,
    math: MathOption = Math.own, only: Only = "*", as_json: Json = False,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the wheel.")] = Path("dist"),
) -> None:  # fmt: skip
    """Write a wheel with the compiled hand: Python loads it without a compiler."""
    from awiwi_gen.wheel import run

    run(make_job(hand, scalar, params, only, math), output, as_json)


@command()
def build(hand: HandFile = None, output: Output = GENERATED, as_json: Json = False) -> int:
    """Compile a generated directory and load it, as Python does."""
    from awiwi_gen.build import load
    from awiwi_gen.report import print_json

    terminal.require(output, hand)
    library = load(output)
    summary = {"kernels": len(library), "digest": library.digest, "scalar": library.manifest["c_type"]}
    if as_json:
        print_json(summary)
    else:
        print(f"{output}: {summary['kernels']} kernels compiled and loaded, model {library.digest[:12]}")
    return 0


@command(*GENERATE)
def verify(
    hand: HandFile = None, output: Output = GENERATED, scalar: ScalarOption = Scalar.f64,
    params: ParamsOption = Params.baked, math: MathOption = Math.own, only: Only = "*", as_json: Json = False,
) -> int:  # fmt: skip
    """Compile the generated C as it stands and compare every kernel with its reference."""
    terminal.require(output, hand)
    return terminal.prove(make_job(hand, scalar, params, only, math), hand, output, as_json)


@command()
def list_(
    hand: HandFile = None, as_json: Json = False,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="List what was generated there.")] = None,
    assumed: Annotated[bool, typer.Option("--assumed", help="The hand's numbers without a source.")] = False,
) -> int:  # fmt: skip
    """List the kernels of the hand with their ports and costs, or its numbers that are assumed."""
    from awiwi_gen.report import list_kernels, print_json, print_kernels

    if output is not None and hand is None and not assumed:
        (print_json if as_json else print_kernels)(terminal.require(output)["kernels"])
        return 0
    if hand is None and not assumed and (carried := terminal.carried_hand(*HAND)):
        (print_json if as_json else print_kernels)(carried["manifest"]["kernels"])
        return 0
    extras.require("list without -o", *HAND)
    from awiwi_gen.hand import Hand

    if assumed:
        guesses = {path: str(quantity) for path, quantity in Hand.load(hand).assumed().items()}
        if as_json:
            print_json([{"path": path, "value": value} for path, value in guesses.items()])
        else:
            print_table(("number", "assumed value"), list(guesses.items()))
        return 0
    list_kernels(Hand.load(hand), output or GENERATED, as_json)
    return 0


@command()
def call(
    kernel: KernelName,
    inputs: Annotated[list[str] | None, typer.Argument(help="Inputs such as q=0.1,0.2,0.3,0.4")] = None,
    hand: HandFile = None, as_json: Json = False,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Call what was generated there.")] = None,
) -> int:  # fmt: skip
    """Evaluate a compiled kernel. With --json, inputs come as one JSON object from standard input."""
    import numpy as np

    from awiwi_gen.report import print_json

    function = terminal.find_kernel(kernel, hand, output)
    given = terminal.parse_inputs(inputs or [], function) if inputs or not as_json else terminal.read_json_inputs()
    result = function(**given)
    values = result._asdict() if hasattr(result, "_asdict") else {function.outputs[0]["name"]: result}
    if as_json:
        print_json({name: value.tolist() for name, value in values.items()})
        return 0
    for port in function.outputs:
        print(f"{port['name']} [{port['unit']}]")
        print(np.array2string(values[port["name"]], precision=9, suppress_small=False, max_line_width=100))
    if "status" in values:
        print(f"status {values['status']}")
    return 0


@command(*GENERATE)
def params(
    hand: HandFile = None, as_json: Json = False,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write for the C.")] = None,
    generated: Annotated[Path, typer.Option("--generated", help="Directory that reads the file.")] = GENERATED,
) -> int:  # fmt: skip
    """Write the numbers of a hand to a file that C of --params runtime loads, or list them."""
    from awiwi_gen.hand import Hand
    from awiwi_gen.parameters import numbers_file
    from awiwi_gen.report import print_json, print_numbers

    found = numbers_file(Hand.load(hand), terminal.require(generated, hand), str(generated))
    if output is not None:
        found.write(output)
    if as_json:
        print_json({"file": output and str(output), "bytes": len(found.data), "numbers": found.rows})
    else:
        print_numbers(found.rows, output, len(found.data))
    return 0


@command("matplotlib", "scipy", *GENERATE)
def report(
    hand: HandFile = None, as_json: Json = False,
    page: Annotated[Path, typer.Option("--page", "-o", help="HTML file to write.")] = PAGE,
) -> int:  # fmt: skip
    """Write a page: the hand, which moves, with its numbers and proofs; of the packaged hand the source's figures."""
    from awiwi_gen.compare import comparison
    from awiwi_gen.report import print_json
    from awiwi_gen.reproduce import publish, summary, verdict

    results = publish(make_job(hand), page, comparison)
    if as_json:
        print_json(results.as_dict())
    else:
        print("\n".join(f"figure {figure.number}: the claim {verdict(figure)}" for figure in results.figures))
        print(f"{page}: {summary(results)}")
        print(results.hand.lacking, end="\n" if results.hand.lacking else "")
    return 0 if results.proof.passed else 1


@command("scipy", *GENERATE)
def simulate(
    law: Annotated[str, typer.Argument(help="A law; all of them if left out.")] = "",
    gains: Annotated[str, typer.Option("--gains", help="Gains such as K_p=0.5,K_d=0.003.")] = "",
    scenario: Annotated[str, typer.Option("--scenario", help="Show one run: step, load or sine.")] = "",
    force: Annotated[float, typer.Option("--force", help="Pretension of that run [N].")] = 10.0,
    plant: Annotated[str, typer.Option("--plant", help="Plant of that run.")] = "as known",
    joint: Annotated[str, typer.Option("--joint", help="A joint such as index_pip, or all.")] = "index_pip",
    sensing: Annotated[str, typer.Option("--sensing", help="Of that run: force sensor, or lever.")] = "force sensor",
    finger: Annotated[str, typer.Option("--finger", help="A whole finger under a law of the tick, or all.")] = "",
    tries: Annotated[int, typer.Option("--tries", help="Search the gains of each law first, by so many tries.")] = 0,
    plot: Annotated[Path | None, typer.Option("--plot", help="PNG or SVG file for a plot of that run.")] = None,
    hand: HandFile = None, as_json: Json = False,
) -> int:  # fmt: skip
    """Simulate control laws on a joint between two tendons, at the hand's clock rate, and compare the results."""
    from awiwi_gen.compare import simulated

    simulated(hand, law, gains, scenario, force, plant, joint, sensing, finger, tries, plot).show(as_json)
    return 0


command(*GENERATE)(explain)
command(*HAND)(show)
command("scipy", *GENERATE)(tune)
command("matplotlib", "scipy", *GENERATE)(study)
command(*GENERATE)(diff)
command()(init)
command(*HAND, ignore_unknown_options=True)(set_)  # "-5 deg" is a value
command(*HAND)(schema)
command("scipy", *HAND)(identify)
command(*HAND)(import_)
command(*HAND)(export)
command()(tick)
command()(replay)


def main() -> None:
    """Entry point of ``awiwi-gen``."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: its threads would wait for each other
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a terminal that cannot show a letter shows its number
    exits.run(command_line)


def command_line() -> None:
    """Parse the arguments and run a command; an unreadable command line is one sentence, or JSON with ``--json``."""
    try:
        code = app(standalone_mode=False) or 0
    except Exception as error:
        if not hasattr(error, "format_message"):  # what typer raises for a command line that it cannot read
            raise
        code = 2
        if "--json" in sys.argv:
            print(json.dumps({"error": "UsageError", "message": error.format_message()}))
        else:
            error.show()  # type: ignore[attr-defined]
    sys.exit(code)


if __name__ == "__main__":
    main()
