"""The plants of control laws (chapters 10 to 15), as the rates of their states, which a simulation integrates.

All their parameters are inputs. A plant also returns the quantities that sensors measure. The springs of an antagonistic
joint, as a law models them, are a kernel of the same kind.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import N, Unit, kg, m, rad, s


def plant_kernels() -> list[Kernel]:
    """All plants; they read no number of a hand."""
    return [
        kernel
        for family, ports in ((of_tendon, TENDON), (of_joint, JOINT), (of_pair, PAIR), (of_finger, FINGER))
        for kernel in family.kernels("", Parameterless(), "plants", {}, ports, None)
    ]


of_tendon: Family[None] = Family("plants")
of_joint: Family[None] = Family("plants")
of_pair: Family[None] = Family("plants")
of_finger: Family[None] = Family("plants")

TORQUE, INERTIA, STIFFNESS, DAMPING = N * m, kg * m**2, N * m / rad, N * m * s / rad
MOTION, RATES = (rad, rad / s), (rad / s, rad / s**2)


def box(units: tuple[Unit, ...], low: tuple[float, ...], high: tuple[float, ...], rows: int = 1) -> Port:
    """A port of mixed units; several rows have the same units and ranges."""
    return Port((rows, len(units)) if rows > 1 else (len(units),), units * rows, low * rows, high * rows)


def state(bodies: int) -> Port:
    """Angle and speed of each body."""
    return Port((2 * bodies,), MOTION * bodies, (-3.0, -50.0) * bodies, (3.0, 50.0) * bodies)


def rates(bodies: int) -> Port:
    """Rates of the angle and speed of each body."""
    return Port((2 * bodies,), RATES * bodies)


FRICTION = {"friction": box((s / rad, TORQUE, DAMPING), (0.1, 0.0, 0.0), (100.0, 2.0, 0.2))}
TENDON = FRICTION | {
    "x": state(1),
    "u": Port((), TORQUE, -3.0, 3.0),
    "path": Port((), m, -0.03, 0.03),
    "motor": box((INERTIA, m), (1e-4, 0.002), (1e-2, 0.02)),
    "line": box((N / m, N / m**2, N / m**3), (1e3, 0.0, 0.0), (2e4, 1e6, 1e8)),
}
JOINT = {
    "x": state(2),
    "u": Port((), TORQUE, -3.0, 3.0),
    "load": Port((), TORQUE, -1.0, 1.0),
    "plant": box((INERTIA, INERTIA, STIFFNESS), (5e-7, 1e-4, 0.05), (1e-3, 1e-2, 50.0)),
    "bodies": box((INERTIA, INERTIA), (5e-7, 1e-4), (1e-3, 1e-2)),
    "curve": box((STIFFNESS, TORQUE / rad**3), (0.05, 0.0), (50.0, 100.0)),
    "damping": box((DAMPING, DAMPING), (0.0, 0.0), (5e-3, 0.1)),
}
SPRING = (STIFFNESS, TORQUE / rad**2, TORQUE / rad**3)
PAIR = FRICTION | {
    "x": state(3),
    "u": Port((2,), TORQUE, -5.0, 5.0),
    "load": JOINT["load"],
    "inertias": box((INERTIA,) * 3, (5e-7, 1e-4, 1e-4), (1e-3, 1e-2, 1e-2)),
    "tendons": box(SPRING, (0.05, 0.0, 0.0), (2.0, 2.0, 10.0), rows=2),
    "damping": Port((), DAMPING, 0.0, 5e-3),
    "stretches": Port((2,), rad, -1.0, 2.0),
    "speeds": Port((2,), rad / s, -50.0, 50.0),
}
JOINTS, TENDONS = 4, 8  # of the finger of the last plant
FINGER = FRICTION | {
    **{name: TENDON[name] for name in ("motor", "line")},
    "thetas": Port((TENDONS,), rad, -5.0, 5.0),
    "path": Port((TENDONS,), m, -0.03, 0.03),
    "slack": Port((TENDONS,), m, -0.03, 0.03),
    "qd": Port((JOINTS,), rad / s, -50.0, 50.0),
    "qdd": Port((JOINTS,), rad / s**2, -1e4, 1e4),
    "thds": Port((TENDONS,), rad / s, -50.0, 50.0),
    "f": Port((TENDONS,), N, 0.0, 120.0),
    "u": Port((TENDONS,), TORQUE, -3.0, 3.0),
}
FINGER_RATES = (rad / s,) * JOINTS + (rad / s**2,) * JOINTS + (rad / s,) * TENDONS + (rad / s**2,) * TENDONS
TORQUES, LOCAL = (TORQUE, TORQUE / s), (STIFFNESS, TORQUE / rad**2)


@of_tendon(lambda _: {"xd": rates(1), "f": Port((), N)}, "eq. 10.1, mended; eq. 3.8")
def plant_tendon(_: Any, x: Any, u: Any, path: Any, motor: Any, line: Any, friction: Any) -> Any:
    """A motor that winds up a tendon with a spring, at a fixed joint: rates of x = (theta, theta'), and the force f.

    path is the tendon's path length at the joint. motor is (inertia, pulley's radius), friction is (steepness, level,
    viscosity). line is (k1, k2, k3) of the spring's force f = k1 p + k2 p^2 + k3 p^3 for elongations p > 0.
    """


@of_joint(
    lambda _: {"xd": rates(2), "tau": Port((2,), TORQUES)},
    "eq. 15.11, 15.12",
)
def plant_joint_linear(_: Any, x: Any, u: Any, load: Any, plant: Any, damping: Any) -> Any:
    """A link behind a linear spring: rates of x = (q, q', theta, theta'), and the spring's torque tau with its rate.

    plant is (link's inertia, motor's inertia, stiffness), damping is that of link and motor.
    """


@of_joint(
    lambda _: {"xd": rates(2), "tau": Port((2,), TORQUES), "spring": Port((2,), LOCAL)},
    "eq. 15.71",
)
def plant_joint_nonlinear(_: Any, x: Any, u: Any, load: Any, bodies: Any, curve: Any, damping: Any) -> Any:
    """A link behind a spring phi(d) = k1 d + k3 d^3 with curve = (k1, k3); spring is (phi', phi'')."""


@of_pair(
    lambda _: {"xd": rates(3), "stretches": Port((2,), rad), "tau": Port((2,), TORQUE)},
    "eq. 15.82, with friction and springs that only pull",
)
def plant_antagonistic(
    _: Any, x: Any, u: Any, load: Any, inertias: Any, tendons: Any, damping: Any, friction: Any
) -> Any:
    """A link between two tendons: rates of (q, q', theta1, theta1', theta2, theta2'), elongations and spring torques.

    inertias are (link, motor 1, motor 2), a row of tendons is (k1, k2, k3) of phi = k1 p + k2 p^2 + k3 p^3, where p is
    the elongation theta1 - q or theta2 + q if positive. friction of each motor is (steepness, level, viscosity).
    """


@of_pair(
    lambda _: {"torques": Port((2, 2), TORQUES * 2), "springs": Port((2, 2), LOCAL * 2)},
    "eq. 15.71, 15.82",
)
def antagonistic_springs(_: Any, stretches: Any, speeds: Any, tendons: Any) -> Any:
    """Torque and rate (tau, tau'), slope and curvature (phi', phi'') of both springs of an antagonistic joint."""


@of_finger(lambda _: {"f": Port((TENDONS,), N)}, "section 5.1, eq. 10.1")
def plant_finger_forces(_: Any, thetas: Any, path: Any, slack: Any, motor: Any, line: Any) -> Any:
    """Forces of a finger's tendons: path is their length at the joints, slack the total length at which each gets taut.

    This is the first half of a finger's plant. Joint torques and accelerations follow from the finger's own kernels.
    """


@of_finger(lambda _: {"xd": Port((len(FINGER_RATES),), FINGER_RATES)}, "eq. 10.1, mended")
def plant_finger(_: Any, qd: Any, qdd: Any, thds: Any, f: Any, u: Any, motor: Any, friction: Any) -> Any:
    """Second half of a finger's plant: rates of (q, q', theta, theta') of four joints with accelerations qdd, 8 motors."""
