"""What only some fingers have: armature, damping, friction and springs in their joints, motors with several tendons, and
a place in the palm."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.hand.parts import Finger
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family
from awiwi_gen.kernels.fingers import guarded, input_ports
from awiwi_gen.kernels.sizes import POSE, Size, torque
from awiwi_gen.units import m, s

per_passive: Family[Size] = Family("joints")
per_placed: Family[Size] = Family("palm")

# What kernels of all fingers contain where joints have such numbers, by family.
ARMATURE = {
    "mass_matrix": "Its diagonal has the joints' armature.",
    "dynamics": "The diagonal of M has the joints' armature.",
    "inverse_dynamics": "The diagonal of M has the joints' armature.",
    "forward_dynamics": "The diagonal of M has the joints' armature.",
    "energy": "The kinetic energy has that of the rotors, by the joints' armature.",
}
PASSIVE = {
    "bias": "Torques of damping, friction and springs (passive_torque) are added.",
    "inverse_dynamics": "Torques of damping, friction and springs (passive_torque) are added.",
    "inverse_dynamics_derivatives": "Those of damping, friction and springs (passive_torque) are added.",
    "forward_dynamics": "Torques of damping, friction and springs (passive_torque) are overcome first.",
    "dynamics": "Torques of damping, friction and springs are in passive_torque alone.",
    "energy": "The potential energy has that of the joints' springs.",
}

SHARED = {
    "tendon_lengths": "Tendons of one motor count as one, whose length is the sum of ratio times length.",
    "coupling": "Tendons of one motor count as one, whose length is the sum of ratio times length.",
    "joint_torque": "A motor of several tendons pulls each with ratio times its force.",
    "joint_stiffness": "Those of a motor of several tendons are on the side of the motor.",
    "joint_torque_and_stiffness": "Those of a motor of several tendons are on the side of the motor.",
    "tendon_distribution": "A motor of several tendons has one force.",
}

SENSED = {
    "joint_estimate": "Angles of joints with a sensor are inputs, and outputs as they are; their start is not read.",
    "joint_estimate_error": "Joints with a sensor have no error here.",
}


def documented(finger: Finger, kernels: list[Kernel]) -> list[Kernel]:
    """The kernels of a finger; what their joints and motors add is told in their documentation, and which joints slide."""
    shared = any(transmission.ratios for transmission in finger.transmissions)
    for notes, has in (
        (ARMATURE, finger.has_armature),
        (PASSIVE, finger.passive),
        (SHARED, shared),
        (SENSED, finger.measured),
    ):
        if has:
            kernels = [replace(k, doc=f"{k.doc}\n{notes[k.family]}") if k.family in notes else k for k in kernels]
    slides = [f"{index} ({joint})" for index, joint in enumerate(finger.joints) if joint in finger.sliding]
    return with_slides(kernels, slides)


def with_slides(kernels: list[Kernel], slides: list[str]) -> list[Kernel]:
    """Kernels whose documentation says which elements of arrays over the joints belong to slides, if any do."""
    if not slides:
        return kernels
    which = f"elements {', '.join(slides)} are of slides" if len(slides) > 1 else f"element {slides[0]} is of a slide"
    note = f"In arrays over the joints, {which}: in m for rad, and N for N m."
    over_joints = [{"q", "start"} & k.inputs.keys() for k in kernels]
    return [replace(k, doc=f"{k.doc}\n{note}") if has else k for k, has in zip(kernels, over_joints, strict=True)]


def optional_kernels(hand: Hand, name: str, finger: Finger) -> list[Kernel]:
    """The kernels of a finger with passive torques in its joints, and those of a finger with a base in the palm."""
    size = Size.of(finger)
    ports = input_ports(hand, finger, size)
    ports["g_palm"] = ports["g"]
    families = [family for family, has in ((per_passive, finger.passive), (per_placed, finger.base)) if has]
    return [
        kernel
        for family in families
        for kernel in guarded(finger, family.kernels(name, finger, f"fingers.{name}", finger.structure(), ports, size))
    ]


@per_passive(lambda z: {"passive": torque(z)}, "eq. 3.8")
def passive_torque(finger: Any, q: Any, qd: Any) -> Any:
    """Joint torques that damping, dry friction and springs of the joints take up.

    They stand beside C qd and gravity in the equation of motion: tau = M qdd + C qd + gravity + passive.
    """


@per_placed(lambda z: {"T": Port((4, 4), POSE)}, "eq. 5.2, 5.3")
def palm_pose(finger: Any, q: Any) -> Any:
    """Pose of the fingertip: maps fingertip coordinates into the palm's frame."""


@per_placed(lambda z: {"g": Port((3,), m / s**2)}, "eq. 5.2")
def palm_gravity(finger: Any, g_palm: Any) -> Any:
    """Gravity in the axes of the finger's base, from gravity in the palm's: the input g of the finger's dynamics.

    So one sensor in the palm serves all fingers.
    """
