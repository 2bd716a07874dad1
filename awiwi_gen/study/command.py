"""The command ``study``."""

from __future__ import annotations

from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from awiwi_gen.arguments import HandFile, Json
from awiwi_gen.errors import InputError

if TYPE_CHECKING:
    from awiwi_gen.study.base import Report


class Kind(StrEnum):
    """What is studied."""

    tolerance = "tolerance"
    workspace = "workspace"
    stiffness = "stiffness"
    gains = "gains"


MODULES = {"tolerance": "tolerances", "workspace": "workspace", "stiffness": "stiffness", "gains": "gains"}
TAKES = {  # options that only some kinds take
    "spread": ("tolerance",), "goal": ("tolerance",), "force": ("tolerance", "gains"), "joint": ("gains",),
    "law": ("gains",), "finger": ("tolerance", "workspace", "stiffness"),
}  # fmt: skip
MOST = 10**9
FORCE = 20.0  # N


def study(
    kind: Annotated[Kind, typer.Argument(help="What is studied.")],
    hand: HandFile = None,
    finger: Annotated[str, typer.Option("--finger", help="Finger; index, or the first, if left out.")] = "",
    samples: Annotated[int, typer.Option("--samples", help="So many at least; by kind if left out.")] = 0,
    seed: Annotated[int, typer.Option("--seed", help="The same seed gives the same samples.")] = 0,
    spread: Annotated[
        list[str] | None, typer.Option("--spread", help="How well numbers are known, as 'pulleys*=0.05 mm'.")
    ] = None,
    goal: Annotated[
        list[str] | None, typer.Option("--goal", help="Largest permitted error, as 'fingertip=1 mm' or 'stiffness=5 %'.")
    ] = None,
    force: Annotated[float, typer.Option("--force", help="Force of every tendon [N].")] = FORCE,
    joint: Annotated[str, typer.Option("--joint", help="Joint such as index_pip.")] = "",
    law: Annotated[str, typer.Option("--law", help="Law, see simulate.")] = "",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder; build/study/KIND if left out.")] = None,
    scheduler: Annotated[str, typer.Option("--scheduler", help="Address of a Dask scheduler, as tcp://host:8786.")] = "",
    workers: Annotated[int | None, typer.Option("--workers", help="Local processes; one a core if left out.")] = None,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Study a finger by millions of samples: tolerances of its numbers, workspace, stiffness, or gains of a joint."""
    from awiwi_gen import extras
    from awiwi_gen.hand import Hand
    from awiwi_gen.report import Progress, print_json
    from awiwi_gen.study.folder import claim, write_results
    from awiwi_gen.study.plot import draw_to
    from awiwi_gen.study.prepare import Request, require_finger
    from awiwi_gen.study.run import Place
    from awiwi_gen.tables import print_table

    asked = {"spread": bool(spread), "goal": bool(goal), "force": force != FORCE, "joint": bool(joint), "law": bool(law),
             "finger": bool(finger)}  # fmt: skip
    for name, kinds in TAKES.items():
        if asked[name] and kind not in kinds:
            raise InputError(f"study {kind} takes no --{name}; {' and '.join(kinds)} does")
    if not 0 <= samples <= MOST or seed < 0 or not 0 < force < 1e6 or (workers is not None and not 0 < workers <= 1024):
        raise InputError(
            f"--samples {samples}, --seed {seed}, --force {force:g}, --workers {workers}: expected at most {MOST} samples, "
            "a seed of 0 or more, a force above 0, and 1 to 1024 workers"
        )
    if scheduler and workers is not None:
        raise InputError(
            "--workers are local processes; with --scheduler its own workers compute: leave one of them out"
        )
    if scheduler:
        extras.require("study --scheduler", "distributed")
    read, folder = Hand.load(hand), output or Path("build/study") / kind
    module: Any = import_module(f"awiwi_gen.study.{MODULES[kind]}")
    request = Request(
        read, require_finger(read, finger), samples or module.SAMPLES, seed, Place(folder, scheduler, workers), Progress(),
        tuple(spread or ()), tuple(goal or ()), force, joint, law,
    )  # fmt: skip
    described = {"kind": str(kind), "hand": read.digest(), "finger": request.finger, "seed": seed, "spread": spread or [],
                 "goal": goal or [], "force": force, "joint": joint, "law": law}  # fmt: skip
    claim(folder, described)
    report: Report = module.conduct(request)
    write_results(folder, {**described, "name": read.name, "samples": request.samples}, report)
    draw_to(folder / "plot.svg", report)
    if as_json:
        print_json({"folder": str(folder), **report.data})
    else:
        print_table(report.columns, report.rows)
        print("\n".join([*report.lines, f"{folder}: result.npz, result.json, plot.svg"]))
    return 0
