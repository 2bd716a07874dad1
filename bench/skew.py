"""Operations of M, inverse and forward dynamics of fingers whose joints have axes in any direction, beside CasADi's.

python bench/skew.py              fingers of 2, 4 and 8 joints
python bench/skew.py 2 4          these

CasADi gets the recursions of bench/peers and its own `cse`. Exit code 1 if we need more operations than it does.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import casadi as ca

from awiwi_gen.hand import Hand
from awiwi_gen.interchange.export import rpy_matrix
from bench.counts import Count, count
from bench.hands import FINGER, LIMITS, SEED, spec
from bench.peers.casadi import ALGEBRA, program
from bench.peers.formulas import outputs
from bench.peers.kit import BEGIN, END
from bench.quantities import QUANTITIES

KERNELS = ("mass_matrix", "inverse_dynamics", "forward_dynamics")


def skew_hand(joints: int) -> str:
    """A hand file of one finger without tendons: rotations, offsets, masses and inertias are drawn."""
    draw = random.Random(SEED + joints)  # noqa: S311 - a hand, no secret
    lines = [LIMITS]
    for number in range(joints):
        rpy, offset, com = (
            ", ".join(f'"{draw.choice((-1, 1)) * draw.uniform(low, high):.2f} {unit}"' for _ in range(3))
            for low, high, unit in ((10, 80, "deg"), (3, 40, "mm"), (1, 20, "mm"))
        )
        a, b, c = (draw.uniform(200, 2000) for _ in range(3))  # second moments: any inertia made of them is possible
        entries = {"xx": b + c, "yy": a + c, "zz": a + b} | {k: draw.uniform(-60, 60) for k in ("xy", "xz", "yz")}
        inertia = ", ".join(f'{name} = "{value:.2f} g mm^2"' for name, value in entries.items())
        lines += [
            f"[[fingers.{FINGER}.links]]",
            f'joint = "joint{number}"\nrpy = [{rpy}]\nlow = "-30 deg"\nhigh = "60 deg"',
            f'offset = [{offset}]\nmass = "{draw.uniform(2, 20):.2f} g"\ncom = [{com}]',
            f'inertia = {{ {inertia} }}\nsource = "assumed"',
        ]
    return "\n".join(lines) + "\n"


def ours(text: str) -> dict[str, dict[str, int]]:
    """Kernel -> its cost, from a fresh generated directory."""
    with tempfile.TemporaryDirectory() as scratch:
        file, made = Path(scratch) / "hand.toml", Path(scratch) / "made"
        file.write_text(text, encoding="utf-8")
        for kernel in KERNELS:
            command = [sys.executable, "-m", "awiwi_gen", "generate", "--hand", str(file), "-o", f"{made}_{kernel}",
                       "--only", f"{FINGER}_{kernel}"]  # fmt: skip
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        manifests = [json.loads(Path(f"{made}_{k}", "manifest.json").read_text(encoding="utf-8")) for k in KERNELS]
    return {k: manifest["kernels"][0]["cost"] for k, manifest in zip(KERNELS, manifests, strict=True)}


def plain_finger(hand: Hand) -> dict[str, Any]:
    """The finger as plain data for peers, with its rotations."""
    finger: dict[str, Any] = spec(hand)
    for table, link in zip(finger["links"], hand.fingers[FINGER].links, strict=True):
        table["turn"] = rpy_matrix(link.rpy).tolist()
    return finger


def casadis(hand: Hand) -> dict[str, Count]:
    """The same of the C that CasADi generates."""
    finger = plain_finger(hand)
    joints, found = len(finger["links"]), {}
    for kernel in KERNELS:
        quantity = QUANTITIES[kernel]
        inputs = {port: ca.SX.sym(port, 3 if port == "g" else joints) for port in quantity.inputs}
        x = {port: ca.vertsplit(symbol) for port, symbol in inputs.items()}
        results = [ca.vertcat(*map(ca.SX, entries)) for entries in outputs(kernel, finger, x, ALGEBRA).values()]
        dense = [ca.densify(entries) for entries in ca.cse(results)]
        text, _ = program(ca.Function(f"casadi_{kernel}_program", [*inputs.values()], dense), quantity)
        found[kernel] = count(text.split(BEGIN)[1].split(END)[0])
    return found


def main() -> int:
    """Print a row for each finger and kernel."""
    worse = False
    print(f"{'joints':>6}  {'kernel':18}{'ours':>8}{'CasADi':>8}{'ratio':>8}  sincos, ours and CasADi's")
    for joints in map(int, sys.argv[1:] or ("2", "4", "8")):
        text = skew_hand(joints)
        mine, theirs = ours(text), casadis(Hand.parse(text))
        for kernel in KERNELS:
            own, other = sum(mine[kernel].get(kind, 0) for kind in ("add", "mul", "div")), theirs[kernel]
            ratio = other.operations / own
            worse = worse or ratio < 1
            tail = f"{mine[kernel].get('sincos', 0)} and {other.sincos}"
            print(f"{joints:6}  {kernel:18}{own:8}{other.operations:8}{ratio:8.2f}  {tail}", flush=True)
    return int(worse)


if __name__ == "__main__":
    sys.exit(main())
