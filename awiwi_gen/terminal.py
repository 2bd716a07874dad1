"""What the commands share: their inputs and the advice in their messages."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from awiwi_gen import extras
from awiwi_gen.errors import InputError, unknown
from awiwi_gen.patterns import matches


def fix(job: Any, hand: Path | None, output: Path) -> str:
    """The command that brings a generated directory up to date."""
    usual, chosen = vars(type(job.options)()), vars(job.options) | {"only": job.only}
    words = ["awiwi-gen", "generate", *(["--hand", str(hand)] if hand else []), "-o", str(output)]
    words += [word for key, value in chosen.items() if value != usual.get(key, "*") for word in (f"--{key}", value)]
    return shlex.join(words)


def require(output: Path, hand: Path | None = None) -> dict[str, Any]:
    """The manifest of a generated directory. Raises InputError if there is none."""
    from awiwi_gen.emit.tree import read_manifest

    manifest = read_manifest(output)
    if manifest is None:
        words = ["awiwi-gen", "generate", *(["--hand", str(hand)] if hand else []), "-o", str(output)]
        raise InputError(f"{output}: nothing generated here; run {shlex.join(words)}")
    return manifest


def listing(hand: Path | None) -> str:
    """The command that lists the kernels of a hand."""
    return shlex.join(["awiwi-gen", "list", *(["--hand", str(hand)] if hand else [])])


def load_hand(file: Path | None) -> Any:
    """The hand of a file, or the packaged one."""
    from awiwi_gen.hand import Hand

    return Hand.load(file)


def why_absent(left_out: Mapping[str, str], pattern: str) -> str:
    """Why a hand does not have the kernels of a pattern, if its tendons make them impossible."""
    return next((f"{name} is left out: {why}" for name, why in left_out.items() if matches(name, pattern)), "")


def no_kernel(hand: Any, file: Path | None, name: str, known: Any) -> InputError:
    """The exception for a kernel that a hand does not have."""
    from awiwi_gen.hand.capability import left_out_names

    reason = why_absent(left_out_names(hand), name)
    return InputError(reason) if reason else unknown("kernel", name, known, f"see {listing(file)}")


def carried_hand(*needs: str) -> Any:
    """The record of the hand that this package carries compiled, for installs without some modules; else None."""
    from awiwi_gen.shipped import default_record

    return default_record() if extras.missing("", *needs) else None


def find_kernel(name: str, file: Path | None, output: Path | None) -> Any:
    """A compiled kernel of a hand file, or of a generated directory. Raises InputError where it does not exist."""
    import awiwi_gen

    if output is None and file is None and carried_hand(*extras.GENERATE):
        library = awiwi_gen.load()
        if name not in library:
            raise unknown("kernel", name, library, "see awiwi-gen list")
    elif output is None:
        extras.require("call without -o", *extras.GENERATE)
        hand = awiwi_gen.Hand.load(file)
        library = awiwi_gen.build(hand)
        if name not in library:
            raise no_kernel(hand, file, name, library)
    elif file is None:
        require(output)
        library = awiwi_gen.load(output)
        if name not in library:
            raise unknown("kernel", name, library, f"see awiwi-gen list -o {output}")
    else:
        raise InputError("call: --hand and -o name two sources of one kernel; leave one of them out")
    return library[name]


def parse_inputs(texts: list[str], function: Any) -> dict[str, Any]:
    """``q=0.1,0.2`` as named arrays; as many numbers as an input has elements take its shape."""
    import numpy as np

    shapes = {port["name"]: port["shape"] for port in function.inputs}
    parsed: dict[str, Any] = {}
    for text in texts:
        name, equals, numbers = text.partition("=")
        try:
            given = np.array([float(number) for number in numbers.split(",")])
        except ValueError:
            equals = ""
        if not equals:
            raise InputError(f"{text!r} is not an input; expected name=number,number,... such as q=0.1,0.2,0.3,0.4")
        shape = shapes.get(name, given.shape)
        parsed[name] = given.reshape(shape) if given.size == np.prod(shape) else given
    return parsed


def read_json_inputs() -> dict[str, Any]:
    """One JSON object from standard input."""
    try:
        given = json.load(sys.stdin)
    except ValueError as error:
        raise InputError(f"standard input is not JSON: {error}") from None
    if not isinstance(given, dict):
        raise InputError('standard input must be one JSON object such as {"q": [0.1, 0.2, 0.3, 0.4]}')
    return {name: _with_nan(value) for name, value in given.items()}


def _with_nan(value: Any) -> Any:
    """JSON's null as NaN, which is what `print_json` writes it for."""
    return [*map(_with_nan, value)] if isinstance(value, list) else float("nan") if value is None else value


def prove(job: Any, hand: Path | None, output: Path, as_json: bool) -> int:
    """Verify a directory, print the proof sheet, return the exit code."""
    from awiwi_gen.pipeline import state
    from awiwi_gen.pipeline import verify as examine
    from awiwi_gen.report import print_json, print_proof, state_lines

    found = state(job, output)
    if found.stale or found.lost:
        lines = state_lines(found, str(output), fix(job, hand, output))
        if as_json:
            print_json({"error": "stale", "message": "\n".join(lines), **vars(found)})
        else:
            print("\n".join(lines), file=sys.stderr)
        return 1
    proof = examine(job, output)
    if as_json:
        print_json([verdict.as_dict() for verdict in proof.verdicts])
    else:
        print_proof(proof, require(output))
    return 0 if proof.passed else 1
