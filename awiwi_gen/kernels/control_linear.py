"""The kernels of the linear laws: tendon force, pole placement, optimal and state-dependent gains.

All their parameters are inputs, so that all joints and tendons of a hand share one kernel. Gains K are those of u = -K x.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.kernel import Kernel, Port, Solver
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import N, kg, m, one, rad, s

of_tendon: Family[None] = Family()
of_joint: Family[None] = Family()
of_plant: Family[None] = Family()


def linear_laws() -> list[Kernel]:
    """All kernels of the linear laws."""
    families = ((of_tendon, TENDON), (of_joint, JOINT), (of_plant, PLANT))
    return [k for family, ports in families for k in family.kernels("", Parameterless(), "control", {}, ports, None)]


TORQUE = Port((), N * m)
STATE = (rad, rad / s) * 2
GAINS = (N * m / rad, N * m * s / rad) * 2
WEIGHTS = (one / rad**2, s**2 / rad**2) * 2
SPRING = (N * m / rad, N * m / rad**2, N * m / rad**3)


def positive(*things: str) -> tuple[str, ...]:
    """Guards in words."""
    return tuple(f"{thing} is positive" for thing in things)


MOTOR = {
    "b": Port((), kg * m**2, 1e-4, 1e-2),
    "dtheta": Port((), N * m * s / rad, 0.0, 0.1),
    "k": Port((), N * m / rad, 0.05, 20.0),
    "omega0": Port((), rad / s, 50.0, 500.0),
    "xi0": Port((), one, 0.2, 2.0),
    "R": Port((), one / (N * m) ** 2, 1e-6, 1.0),
}
TENDON = {
    **MOTOR,
    "f": Port((), N, 0.0, 120.0),
    "fd": Port((), N / s, -5000.0, 5000.0),
    "f_des": Port((), N, 0.0, 120.0),
    "fd_des": Port((), N / s, -5000.0, 5000.0),
    "f_hat": Port((), N, 0.0, 120.0),
    "friction": Port((), N * m, -2.0, 2.0),
    "r": Port((), m, 0.002, 0.02),
    "kp": Port((), m, 1e-4, 1.0),
    "kd": Port((), m * s, 1e-6, 1e-1),
    "stiffness": Port((), N / m, 1000.0, 50000.0),
    "stiffness_rate": Port((), N / (m * s), -1e4, 1e4),
    "theta": Port((), rad, 0.0, 3.0),
    "thd": Port((), rad / s, -20.0, 20.0),
    "theta_des": Port((), rad, 0.0, 3.0),
    "spring": Port((3,), SPRING, (0.01, 0.0, 0.0), (1.0, 1.0, 1.0)),
    "weights": Port((2,), WEIGHTS[:2], (0.1, 1e-5), (100.0, 1.0)),
}
JOINT = {
    **MOTOR,
    "m": Port((), kg * m**2, 3e-7, 1e-4),
    "dq": Port((), N * m * s / rad, 1e-5, 5e-3),
    "omega": Port((2,), rad / s, 5.0, 500.0),
    "xi": Port((2,), one, 0.2, 2.0),
    "spring": Port((3,), SPRING, (0.1, -50.0, 0.0), (5.0, 50.0, 50.0)),
    "weights": Port((4,), WEIGHTS, (1.0, 1e-3, 0.1, 1e-3), (100.0, 1.0, 10.0, 1.0)),
    "R": Port((), one / (N * m) ** 2, 1e-4, 1.0),
    "deflexion": Port((), rad, -1.0, 1.0),
    "deflexion_des": Port((), rad, -1.0, 1.0),
    "K": Port((4,), GAINS, (-1e4, -1e2) * 2, (1e4, 1e2) * 2),
    "K_last": Port((4,), GAINS, (-1e4, -1e2) * 2, (1e4, 1e2) * 2),
    "x": Port((4,), STATE, (-3.0, -50.0) * 2, (3.0, 50.0) * 2),
    "x_des": Port((4,), STATE, (-3.0, -50.0) * 2, (3.0, 50.0) * 2),
    "u_des": Port((), N * m, -3.0, 3.0),
}
PLANT = {
    "A": Port((4, 4), one, -1e7, 1e7),
    "B": Port((4,), one, -1e4, 1e4),
    "Q": Port((4, 4), one, -1e6, 1e6),
    "R": Port((), one, 1e-6, 1e3),
}


# -- tendon force -----------------------------------------------------------------------------------------


@of_tendon(
    lambda _: {"tau": TORQUE},
    "eq. 10.2, with the signs mended",
    subject="tendon_force",
    guards=positive("the pulley's radius", "the proportional gain", "the derivative gain"),
)
def tendon_force_pd(
    _: Any, f: Any, fd: Any, f_des: Any, fd_des: Any, f_hat: Any, friction: Any, r: Any, kp: Any, kd: Any
) -> Any:
    """Motor torque that controls the tendon force f to f_des with gains kp and kd; friction and force are compensated.

    f_hat is the force whose torque is fed forward: the measured force, or the desired one, which adds no feedback.
    """


@of_tendon(
    lambda _: {"tau": TORQUE, "gains": Port((2,), (m, m * s))},
    "eq. 10.8 to 10.12, mended",
    subject="tendon_force",
    guards=positive(
        "the pulley's radius", "the motor's inertia", "the tendon's stiffness", "the target's frequency",
        "the target's damping ratio", "the proportional gain",
    ),
)  # fmt: skip
def tendon_force_scheduled(
    _: Any, f: Any, fd: Any, f_des: Any, fd_des: Any, f_hat: Any, friction: Any,
    r: Any, b: Any, stiffness: Any, stiffness_rate: Any, omega0: Any, xi0: Any,
) -> Any:  # fmt: skip
    """Motor torque that controls the tendon force to f_des with the frequency omega0 and the damping ratio xi0.

    The gains (kp, kd) follow from the motor's inertia b, the tendon's stiffness at the desired force and the rate of
    that stiffness, which is zero for a constant desired force.
    """


# -- poles --------------------------------------------------------------------------------------------------


@of_tendon(
    lambda _: {"K": Port((2,), GAINS[:2])},
    "eq. 12.7",
    subject="pole_placement",
    guards=positive("the motor's inertia", "the target's frequency", "the target's damping ratio"),
)
def pole_placement_motor(_: Any, b: Any, dtheta: Any, k: Any, omega0: Any, xi0: Any) -> Any:
    """Gains of a motor on a grounded spring k for poles of frequency omega0 and damping ratio xi0."""


@of_joint(
    lambda _: {"K": Port((4,), GAINS)},
    "eq. 12.13 to 12.16, mended",
    subject="pole_placement",
    guards=positive(
        "the link's inertia", "the motor's inertia", "the stiffness", "the first frequency", "the second frequency",
        "the first damping ratio", "the second damping ratio",
    ),
)  # fmt: skip
def pole_placement(_: Any, m: Any, b: Any, k: Any, dq: Any, dtheta: Any, omega: Any, xi: Any) -> Any:
    """Gains on (q, dq/dt, theta, dtheta/dt) of a joint with a spring k for two pole pairs of omega and xi."""


@of_joint(lambda _: {"u": TORQUE}, "eq. 12.2, 13.3, 14.12", subject="pole_placement")
def pole_placement_law(_: Any, K: Any, x: Any, x_des: Any, u_des: Any) -> Any:
    """Motor torque u_des - K (x - x_des), where u_des holds the desired state; for placed and optimal gains."""


# -- optima -------------------------------------------------------------------------------------------------


def doubling(_: Any, doublings: int = 32) -> Solver:
    """The solver of the Riccati equation of any plant with one input."""
    return Solver(
        template="lqr.c.j2",
        problem="riccati",
        uses=(),
        equations=(),
        unknowns=(),
        arrays={},
        strings={"doublings": str(doublings)},
        iterations=0,
        tolerance={"f64": 1e-15, "f32": 5e-7},
    )


def descent(_: Any, steps: int = 32) -> Solver:
    """The solver for the optimal gains of a joint with a spring."""
    return Solver(
        template="sdre_joint.c.j2",
        problem="joint regulator",
        uses=("secant_stiffness", "pole_placement_law"),
        equations=(),
        unknowns=(),
        arrays={},
        strings={"steps": str(steps)},
        iterations=1,
        tolerance={"f64": 1e-13, "f32": 1e-4},
    )


@of_plant(
    lambda _: {"K": Port((4,), one), "S": Port((4, 4), one), "residual": Port((), one)},
    "eq. 13.1 to 13.5",
    solver=doubling,
)
def lqr(_: Any, A: Any, B: Any, Q: Any, R: Any) -> Any:
    """Gains of u = -K x that minimise the integral of x'Q x + R u^2, and the least cost x'S x; in coherent units.

    The residual is that of the Riccati equation for S, relative to its terms. An error status is returned for a plant
    that B cannot stabilise, a cost that is negative for some motion, and a motion without cost that does not decay.
    """


@of_joint(
    lambda _: {"k": Port((), N * m / rad), "torque": TORQUE},
    "eq. 14.10, with the secant",
    subject="state_dependent",
)
def secant_stiffness(_: Any, spring: Any, deflexion: Any, deflexion_des: Any) -> Any:
    """Secant stiffness of a cubic spring between two deflexions, and its torque at the second."""


@of_tendon(
    lambda _: {"K": Port((2,), GAINS[:2]), "u": TORQUE},
    "eq. 14.4 to 14.9, mended",
    subject="state_dependent",
    guards=positive("the motor's inertia", "the torque's weight", "the angle's weight", "the speed's weight"),
)
def sdre_tendon(
    _: Any, theta: Any, thd: Any, theta_des: Any, b: Any, dtheta: Any, spring: Any, weights: Any, R: Any
) -> Any:
    """Optimal gains and torque of a motor on a tendon, by the secant between theta and theta_des, in closed form.

    The tendon's torque is spring . (theta, theta^2, theta^3).
    """


@of_joint(lambda _: {"K": Port((4,), GAINS), "u": TORQUE}, "eq. 14.10 to 14.12, mended", solver=descent)
def sdre_joint(
    _: Any, m: Any, b: Any, dq: Any, dtheta: Any, spring: Any, weights: Any, R: Any, K_last: Any, x: Any, x_des: Any
) -> Any:
    """Optimal gains and torque of a joint with a spring, by its secant between the state and the desired state.

    K_last are the gains of the last tick: the initial guess, and the result if there is no solution.
    """
