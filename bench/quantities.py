"""What is compared: the quantities of one finger with four joints and eight tendons, and the layout of their arrays.

Every kernel is called with one input record and one output record, the ports below one after another. Both
environments import this file, so it needs the standard library alone.
"""

from __future__ import annotations

from dataclasses import dataclass

JOINTS, TENDONS = 4, 8
SIZES = {"q": JOINTS, "qd": JOINTS, "qdd": JOINTS, "tau": JOINTS, "g": 3, "f": TENDONS, "k": TENDONS}


@dataclass(frozen=True)
class Goal:
    """What this project has set itself: operations besides sincos (at most, and the aim), ratios of best peer to ours."""

    operations: int | None
    aim: int | None
    instructions: float
    time: float


@dataclass(frozen=True)
class Quantity:
    """One thing to compute: a title, input ports by name, output ports with their sizes, and the goal."""

    name: str
    title: str
    inputs: tuple[str, ...]
    outputs: dict[str, int]
    goal: Goal

    @property
    def input_size(self) -> int:
        """Doubles of one input record."""
        return sum(SIZES[name] for name in self.inputs)

    @property
    def output_size(self) -> int:
        """Doubles of one output record."""
        return sum(self.outputs.values())

    def input_offsets(self) -> dict[str, int]:
        """Where each input port begins in its record."""
        return _offsets({name: SIZES[name] for name in self.inputs})

    def output_offsets(self) -> dict[str, int]:
        """Where each output port begins in its record."""
        return _offsets(self.outputs)


def _offsets(sizes: dict[str, int]) -> dict[str, int]:
    places, place = {}, 0
    for name, size in sizes.items():
        places[name] = place
        place += size
    return places


N, NN = JOINTS, JOINTS * JOINTS
QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("mass_matrix", "mass matrix", ("q",), {"M": NN}, Goal(66, 60, 3, 2.0)),
        Quantity("inverse_dynamics", "inverse dynamics", ("q", "qd", "qdd", "g"), {"tau": N}, Goal(201, 180, 4, 2.5)),
        Quantity("bias", "bias C qd + gravity", ("q", "qd", "g"), {"bias": N}, Goal(138, 125, 4, 2.7)),
        Quantity("forward_dynamics", "forward dynamics", ("q", "qd", "tau", "g"), {"qdd": N}, Goal(235, 215, 4, 2.7)),
        Quantity("pose_jacobian", "pose and 6x4 Jacobian", ("q",), {"T": 16, "J": 6 * N}, Goal(28, None, 3, 3.0)),
        Quantity(
            "dynamics", "M, C, gravity", ("q", "qd", "g"), {"M": NN, "C": NN, "gravity": N}, Goal(170, None, 3, 2.4)
        ),
        Quantity("tendons", "tendon torque, stiffness", ("q", "f", "k"), {"tau": N, "K": NN}, Goal(None, None, 5, 2.5)),
    )
}
