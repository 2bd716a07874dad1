"""The two hands the comparison runs on: the packaged one's index, and a finger of random geometry from a fixed seed.

The random one is written as a hand file and read like any other, so that nothing can be tuned to either. Peers get the
same numbers as plain data: `spec`.
"""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.structure import quarter_turns, sense

SEED = 20
FINGER = "index"
TURNS = ("x+90", "x-90", "y+90", "y-90", "none")


def packaged() -> Hand:
    """The hand that comes with the package."""
    return Hand.load()


def random_hand(path: Path) -> Hand:
    """Write a hand of one finger with random rotations, offsets, masses, full inertias, pulleys and tendons; read it."""
    draw = random.Random(SEED)  # noqa: S311 - a hand, no secret
    joints = ["first", "second", "third", "fourth"]

    def lengths(low: float, high: float) -> str:
        return "[" + ", ".join(f'"{draw.choice((-1, 1)) * draw.uniform(low, high):.2f} mm"' for _ in range(3)) + "]"

    radii = ", ".join(
        f'{{ joint = "{j}", radius = "{draw.uniform(4, 10):.2f} mm", source = "assumed" }}' for j in joints
    )
    lines = [LIMITS, f"[fingers.{FINGER}]", f"pulleys = [{radii}]", "tendons = ["]
    for number in range(8):  # two pull each joint in both directions, and also pass some of the joints before it
        own = number // 2
        passed = [f"{draw.choice('+-')}{joint}" for joint in joints[:own] if draw.random() < 0.6]
        over = ", ".join(f'"{joint}"' for joint in [*passed, f"{'+-'[number % 2]}{joints[own]}"])
        lines.append(f'    {{ rest = "0 mm", over = [{over}], source = "assumed" }},')
    lines.append("]")
    for number, joint in enumerate(joints):
        # One joint is parallel to the one before, as in any finger; which one, and all other axes, are drawn.
        turn = "none" if number == PARALLEL else draw.choice(TURNS[:4])
        com, mass = lengths(1, 20), draw.uniform(2, 20)
        a, b, c = (draw.uniform(200, 2000) for _ in range(3))  # second moments: any inertia made of them is possible
        xy, xz, yz = (draw.uniform(-60, 60) for _ in range(3))
        entries = {"xx": b + c, "yy": a + c, "zz": a + b, "xy": xy, "xz": xz, "yz": yz}
        inertia = ", ".join(f'{name} = "{value:.2f} g mm^2"' for name, value in entries.items())
        low, high = draw.uniform(-60, -10), draw.uniform(20, 90)
        lines += [
            f"[[fingers.{FINGER}.links]]",
            f'joint = "{joint}"\nturn = "{turn}"\nlow = "{low:.1f} deg"\nhigh = "{high:.1f} deg"',
            f'offset = {lengths(3, 40)}\nmass = "{mass:.2f} g"\ncom = {com}',
            f'inertia = {{ {inertia} }}\nsource = "assumed"',
        ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Hand.load(path)


PARALLEL = random.Random(SEED).randrange(1, 4)  # noqa: S311
LIMITS = """prefix = "drawn"
name = "Random finger"

[limits]
joint_velocity = "20 rad/s"
joint_acceleration = "2000 rad/s^2"
joint_torque = "1 N m"
tendon_force = "100 N"
tendon_stiffness_low = "1000 N/m"
tendon_stiffness_high = "50000 N/m"
gravity = "9.81 m/s^2"
source = "assumed"
"""


def spec(hand: Hand) -> dict[str, Any]:
    """The finger as plain data: links (turn, offset, mass, com, inertia about it, limits), coupling P, input ranges."""
    finger, limits = hand.fingers[FINGER], hand.limits
    links = []
    for link in finger.links:
        i = {name: float(getattr(link.inertia, name)) for name in ("xx", "yy", "zz", "xy", "xz", "yz")}
        links.append(
            {
                "joint": link.joint,
                "turn": _turn(link.turn),
                "offset": [float(x) for x in link.offset],
                "mass": float(link.mass),
                "com": [float(x) for x in link.com],
                "inertia": [[i["xx"], i["xy"], i["xz"]], [i["xy"], i["yy"], i["yz"]], [i["xz"], i["yz"], i["zz"]]],
            }
        )
    radius = {joint: float(r) for joint, r in finger.radii.items()}
    signs = [{joint: sign for sign, joint in map(sense, tendon.over)} for tendon in finger.tendons]
    coupling = [[sign.get(joint, 0) * radius[joint] for joint in finger.joints] for sign in signs]
    wide = {"qd": limits.joint_velocity, "qdd": limits.joint_acceleration, "tau": limits.joint_torque}
    ranges = {name: [-float(limit), float(limit)] for name, limit in (wide | {"g": limits.gravity}).items()}
    ranges["f"] = [0.0, float(limits.tendon_force)]
    ranges["k"] = [float(limits.tendon_stiffness_low), float(limits.tendon_stiffness_high)]
    bounds = [[float(k.low or 0) for k in finger.links], [float(k.high or 0) for k in finger.links]]
    return {"links": links, "coupling": coupling, "ranges": {**ranges, "q": bounds}}


def _turn(turn: str) -> list[list[int]]:
    """A fixed rotation as a matrix of 0 and +-1."""
    axis, quarters = quarter_turns(turn)
    cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarters % 4]
    matrix = [[int(i == j) for j in range(3)] for i in range(3)]
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix[a][a] = matrix[b][b] = cosine
    matrix[b][a], matrix[a][b] = sine, -sine
    return matrix
