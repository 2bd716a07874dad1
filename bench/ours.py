"""This project's kernels for a hand, as contenders: fresh from the generator, with either sine."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from awiwi_gen.emit.options import Options
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, generate
from awiwi_gen.resources import CSRC
from bench.counts import count
from bench.hands import FINGER
from bench.quantities import QUANTITIES

# Kernels that give a quantity, the first line whose kernels all exist: one combined kernel, or several called in turn.
KERNELS = {
    "pose_jacobian": (("pose_and_jacobian",), ("fingertip_pose", "jacobian")),
    "tendons": (("joint_torque_and_stiffness",), ("joint_torque", "joint_stiffness")),
}


def contenders(hand: Hand, directory: Path) -> list[dict[str, Any]]:
    """`ours` with the C library's sine and with our own."""
    return [_contender(hand, directory / f"ours-{trig}", trig) for trig in ("libm", "own")]


def kernels_of(quantity: str, present: set[str]) -> list[str]:
    """The kernels that give a quantity, of those that are present."""
    choices = [[f"{FINGER}_{kernel}" for kernel in names] for names in KERNELS.get(quantity, ((quantity,),))]
    return next(names for names in choices if all(name in present for name in names))


def _contender(hand: Hand, directory: Path, trig: Any) -> dict[str, Any]:
    generated = directory / "generated"
    directory.mkdir(parents=True, exist_ok=True)
    generate(Job(hand, Options(math=trig), only=f"{FINGER}_*"), generated)
    manifest = json.loads((generated / "manifest.json").read_text(encoding="utf-8"))
    entries = {entry["name"]: entry for entry in manifest["kernels"]}
    kernels = {}
    for quantity in QUANTITIES.values():
        chosen = kernels_of(quantity.name, set(entries))
        calls = []
        for name in chosen:
            inputs, outputs = ([port["name"] for port in entries[name][side]] for side in ("inputs", "outputs"))
            calls.append([f"{hand.prefix}_{name}", inputs, outputs])
        sources = [str((generated / f"{name}.c").resolve()) for name in chosen]
        kernels[quantity.name] = {"sources": sources, "calls": calls, "text": [f"{name}.c" for name in chosen]}
    return {
        "name": f"ours-{trig}",
        "version": "this checkout",
        "language": "c",
        "directory": str(directory),
        "flags": [f"-I{generated.resolve()}", f"-I{CSRC}"],
        "libraries": [],
        "kernels": kernels,
        "support": [CSRC / "sincos.c"],
        "note": "sine and cosine of the C library" if trig == "libm" else "own sine and cosine, inlined",
    }


def operations(contender: dict[str, Any], quantity: str) -> dict[str, int]:
    """Operations of a quantity, counted in the generated C; sines that are not the library's are not in the text."""
    folder = Path(contender["directory"]) / "generated"
    counts = [
        count(_body((folder / name).read_text(encoding="utf-8"))) for name in contender["kernels"][quantity]["text"]
    ]
    return {
        "operations": sum(c.operations for c in counts),
        "add": sum(c.add for c in counts),
        "mul": sum(c.mul for c in counts),
        "div": sum(c.div for c in counts),
        "sincos": sum(c.sincos for c in counts),
    }


def _body(text: str) -> str:
    """The function's body: what follows the first brace at the beginning of a line."""
    return text[text.index("\n{") :]
