"""The kernels of the linear laws: tendon force, pole placement, optimal and state-dependent gains.

All their parameters are inputs, so that the units of a hand share one kernel. Gains K are those of u = -K x.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.control import pole_placement as placed
from awiwi_gen.control import pole_placement_ackermann as ackermann
from awiwi_gen.control import tendon_force, tendon_force_energy
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import N, kg, m, one, rad, s

laws: Family[None] = Family()


def linear_laws() -> list[Kernel]:
    """All kernels of the linear laws."""
    return laws.kernels("", Parameterless(), "control", {}, PORTS, None)


TORQUE = Port((), N * m)
STATE = (rad, rad / s) * 2
GAINS = (N * m / rad, N * m * s / rad) * 2


def positive(*things: str) -> tuple[str, ...]:
    """Guards in words."""
    return tuple(f"{thing} is positive" for thing in things)


PORTS = {
    # a tendon and its motor
    "f": Port((), N, 0.0, 120.0),
    "fd": Port((), N / s, -5000.0, 5000.0),
    "f_des": Port((), N, 0.0, 120.0),
    "fd_des": Port((), N / s, -5000.0, 5000.0),
    "f_hat": Port((), N, 0.0, 120.0),
    "friction": Port((), N * m, -2.0, 2.0),
    "r": Port((), m, 0.002, 0.02),
    "B": Port((), kg * m**2, 1e-4, 1e-2),
    "kp": Port((), m, 1e-4, 1.0),
    "kd": Port((), m * s, 1e-6, 1e-1),
    "stiffness": Port((), N / m, 1000.0, 50000.0),
    "stiffness_rate": Port((), N / (m * s), -1e4, 1e4),
    "omega0": Port((), rad / s, 50.0, 500.0),
    "xi0": Port((), one, 0.2, 2.0),
    # a joint with a spring between motor and link
    "m": Port((), kg * m**2, 1e-7, 1e-4),
    "b": Port((), kg * m**2, 1e-4, 1e-2),
    "k": Port((), N * m / rad, 0.05, 20.0),
    "dq": Port((), N * m * s / rad, 0.0, 5e-3),
    "dtheta": Port((), N * m * s / rad, 0.0, 0.1),
    "omega": Port((2,), rad / s, 5.0, 500.0),
    "xi": Port((2,), one, 0.2, 2.0),
    "K": Port((4,), GAINS, (-1e4, -1e2) * 2, (1e4, 1e2) * 2),
    "x": Port((4,), STATE, (-3.0, -50.0) * 2, (3.0, 50.0) * 2),
    "x_des": Port((4,), STATE, (-3.0, -50.0) * 2, (3.0, 50.0) * 2),
    "u_des": Port((), N * m, -3.0, 3.0),
}


# -- tendon force -----------------------------------------------------------------------------------------


@laws(
    lambda _: {"tau": TORQUE},
    "eq. 10.2, with the signs mended",
    witness=tendon_force_energy.tendon_force_pd,
    guards=positive("the pulley's radius", "the proportional gain", "the derivative gain"),
)
def tendon_force_pd(
    _: Any, f: Any, fd: Any, f_des: Any, fd_des: Any, f_hat: Any, friction: Any, r: Any, kp: Any, kd: Any
) -> Any:
    """Motor torque that brings the tendon force f to f_des: kp and kd on its error, estimates cancel the rest.

    f_hat is the force whose torque is fed forward: the measured one cancels it, the desired one adds no feedback.
    """
    return tendon_force.tendon_force_pd(_, f, fd, f_des, fd_des, f_hat, friction, r, kp, kd)


@laws(
    lambda _: {"tau": TORQUE, "gains": Port((2,), (m, m * s))},
    "eq. 10.8 to 10.12, mended",
    witness=tendon_force_energy.tendon_force_scheduled,
    guards=positive(
        "the pulley's radius", "the motor's inertia", "the tendon's stiffness", "the target's frequency",
        "the target's damping ratio", "the proportional gain",
    ),
)  # fmt: skip
def tendon_force_scheduled(
    _: Any, f: Any, fd: Any, f_des: Any, fd_des: Any, f_hat: Any, friction: Any,
    r: Any, B: Any, stiffness: Any, stiffness_rate: Any, omega0: Any, xi0: Any,
) -> Any:  # fmt: skip
    """Motor torque that brings the tendon force to f_des as a motor of inertia B does on a spring of omega0 and xi0.

    The gains (kp, kd) follow from the tendon's stiffness at the desired force and from its rate, which is zero where
    the desired force rests.
    """
    return tendon_force.tendon_force_scheduled(
        _, f, fd, f_des, fd_des, f_hat, friction, r, B, stiffness, stiffness_rate, omega0, xi0
    )


# -- poles --------------------------------------------------------------------------------------------------


@laws(
    lambda _: {"K": Port((2,), GAINS[:2])},
    "eq. 12.7",
    witness=ackermann.pole_placement_motor,
    guards=positive("the motor's inertia", "the target's frequency", "the target's damping ratio"),
)
def pole_placement_motor(_: Any, b: Any, dtheta: Any, k: Any, omega0: Any, xi0: Any) -> Any:
    """Gains of a motor that pulls against a grounded spring k: poles of frequency omega0 and damping ratio xi0."""
    return placed.pole_placement_motor(_, b, dtheta, k, omega0, xi0)


@laws(
    lambda _: {"K": Port((4,), GAINS)},
    "eq. 12.13 to 12.16, mended",
    witness=ackermann.pole_placement,
    guards=positive(
        "the link's inertia", "the motor's inertia", "the stiffness", "the first frequency", "the second frequency",
        "the first damping ratio", "the second damping ratio",
    ),
)  # fmt: skip
def pole_placement(_: Any, m: Any, b: Any, k: Any, dq: Any, dtheta: Any, omega: Any, xi: Any) -> Any:
    """Gains on (q, dq/dt, theta, dtheta/dt) that make a joint with a spring k two oscillators omega and xi."""
    return placed.pole_placement(_, m, b, k, dq, dtheta, omega, xi)


@laws(lambda _: {"u": TORQUE}, "eq. 12.2, 13.3, 14.12", witness=ackermann.state_feedback)
def pole_placement_law(_: Any, K: Any, x: Any, x_des: Any, u_des: Any) -> Any:
    """Motor torque u_des - K (x - x_des), where u_des holds the desired state; for optimal gains just as well."""
    return placed.state_feedback(_, K, x, x_des, u_des)
