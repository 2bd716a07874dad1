"""The kernels of joint control: stiffness correction, friction observer, impedance, and the cascade.

All their parameters are inputs, so they know no hand. Matrices are of four joints: fewer joints take the first ones,
and the others get numbers that keep to themselves, such as those of a unit matrix.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import N, Unit, kg, m, one, rad, s

laws: Family[None] = Family()

JOINTS, TENDONS = 4, 8
TORQUE, MOMENTUM = N * m, N * m * s
STIFFNESS, DAMPING, INERTIA = N * m / rad, N * m * s / rad, kg * m**2


def joint_laws() -> list[Kernel]:
    """All kernels of joint control."""
    return laws.kernels("", Parameterless(), "control", {}, PORTS, None)


def matrix(unit: Unit, low: float, high: float, beside: float) -> Port:
    """A matrix over the joints with entries from low to high on its diagonal, and up to `beside` next to it."""
    on = [i == j for i in range(JOINTS) for j in range(JOINTS)]
    lows, highs = (tuple(end if here else other for here in on) for end, other in ((low, -beside), (high, beside)))
    return Port((JOINTS, JOINTS), unit, lows, highs)


def vector(unit: Unit, limit: float) -> Port:
    """A number for every joint."""
    return Port((JOINTS,), unit, -limit, limit)


PORTS = {
    # stiffnesses: every matrix in these ranges has a dominant diagonal, and so has their difference
    "K_eff": matrix(STIFFNESS, 0.2, 2.0, 0.05),
    "K_mech": matrix(STIFFNESS, 4.0, 20.0, 0.5),
    "k_eff": Port((), STIFFNESS, 0.05, 3.0),
    "k_mech": Port((), STIFFNESS, 3.5, 20.0),
    # one motor and its tendon
    "momentum": Port((), MOMENTUM, -0.05, 0.05),
    "u": Port((), TORQUE, -3.0, 3.0),
    "tau": Port((), TORQUE, -3.0, 3.0),
    "theta": Port((), rad, -10.0, 10.0),
    "theta_des": Port((), rad, -10.0, 10.0),
    "thd": Port((), rad / s, -20.0, 20.0),
    "B": Port((), INERTIA, 1e-4, 1e-2),
    "gain": Port((), one / s, 1.0, 10000.0),
    "period": Port((), s, 1e-4, 1e-2),
    "friction": Port((), TORQUE, -2.0, 2.0),
    "r": Port((), m, 0.002, 0.02),
    "motor_kp": Port((), STIFFNESS, 0.01, 100.0),
    "motor_kd": Port((), DAMPING, 0.001, 1.0),
    "f": Port((), N, 0.0, 120.0),
    "f_des": Port((), N, 0.0, 120.0),
    "fd_des": Port((), N / s, -5000.0, 5000.0),
    "fdd_des": Port((), N / s**2, -1e6, 1e6),
    "xd": Port((), m / s, -0.2, 0.2),
    "hdd": Port((), m / s**2, -20.0, 20.0),
    "stiffness": Port((), N / m, 1000.0, 50000.0),
    "slope": Port((), one / m, 0.0, 1000.0),
    "force_kp": Port((), s**-2, 100.0, 1e6),
    "force_kd": Port((), s**-1, 10.0, 1e4),
    # the joints of a finger
    "M": matrix(INERTIA, 1e-7, 1e-4, 1e-4),
    "C": matrix(DAMPING, -1e-3, 1e-3, 1e-3),
    "gravity": vector(TORQUE, 0.1),
    "q": vector(rad, 2.0),
    "qd": vector(rad / s, 20.0),
    "q_des": vector(rad, 2.0),
    "qd_des": vector(rad / s, 20.0),
    "qdd_des": vector(rad / s**2, 2000.0),
    "K": matrix(STIFFNESS, 0.0, 20.0, 2.0),
    "D": matrix(DAMPING, 0.001, 0.1, 0.02),
    "P": Port((TENDONS, JOINTS), m / rad, -0.03, 0.03),
    "kp": Port((TENDONS,), s**-2, 100.0, 1e6),
    "kd": Port((TENDONS,), s**-1, 10.0, 1e4),
    "weight": Port((), m / (N * s), 1e-3, 1.0),
    "omega": Port((), rad / s, 10.0, 1000.0),
}


def positive(*things: str) -> tuple[str, ...]:
    """Guards in words."""
    return tuple(f"{thing} is positive" for thing in things)


def pivots(of: str) -> tuple[str, ...]:
    """The guards that make a matrix positive definite."""
    return positive(*(f"pivot {joint} of {of}" for joint in range(JOINTS)))


# -- chapter 8 ----------------------------------------------------------------------------------------------


@laws(
    lambda _: {"K_imp": Port((JOINTS, JOINTS), STIFFNESS)},
    "eq. 8.1, with the condition of section 8.2 mended",
    subject="stiffness_correction",
    guards=pivots("K_eff") + pivots("K_mech - K_eff"),
)
def stiffness_correction(_: Any, K_eff: Any, K_mech: Any) -> Any:
    """Controller stiffness that, behind tendons of stiffness K_mech, makes the joints feel like K_eff.

    Both are symmetric, their lower triangles are read. The tendons must be stiffer than what is to be felt in every
    direction; where they are not, no positive definite controller exists. Stiffer by a factor eps, as eq. 8.2 has it,
    gives eps / (eps - 1) K_eff.
    """


@laws(
    lambda _: {"k_imp": Port((), STIFFNESS), "sensitivity": Port((), STIFFNESS / STIFFNESS)},
    "eq. 8.1",
    subject="stiffness_correction",
    guards=positive("k_eff", "k_mech - k_eff"),
)
def stiffness_correction_scalar(_: Any, k_eff: Any, k_mech: Any) -> Any:
    """The same for one joint, and by how much k_imp changes with k_mech: what a poor guess of the tendons costs."""


# -- chapter 9 ----------------------------------------------------------------------------------------------


@laws(
    lambda _: {"momentum_next": Port((), MOMENTUM), "friction": Port((), TORQUE)},
    "eq. 9.1, 9.2, mended, over one sample",
    subject="friction_observer",
    guards=positive("the motor's inertia", "the gain", "the period"),
)
def friction_observer(_: Any, momentum: Any, u: Any, tau: Any, thd: Any, B: Any, gain: Any, period: Any) -> Any:
    """Friction torque of a motor that turned under the torque u against the load tau in the sample that just ended.

    thd is the velocity at the end of that sample. The momentum is the observer's memory: begin with that of the motor
    at rest, zero, and pass on what is returned. Stable for all gains and periods.
    """


# -- chapter 11 ---------------------------------------------------------------------------------------------


@laws(lambda _: {"tau": Port((JOINTS,), TORQUE)}, "eq. 11.4, 11.10, mended", subject="impedance")
def joint_impedance(
    _: Any, M: Any, C: Any, gravity: Any, q: Any, qd: Any, q_des: Any, qd_des: Any, qdd_des: Any, K: Any, D: Any
) -> Any:
    """Joint torques that make the joints feel like a spring K and a damper D about the desired motion.

    M, C and gravity are those of the joints where they are; C must make dM/dt - 2 C skew-symmetric. It acts on the
    desired velocity: so the joints stay passive.
    """


@laws(
    lambda _: {"tau": Port((), TORQUE)},
    "eq. 11.3, mended",
    subject="impedance",
    guards=positive("the pulley's radius", "the proportional gain", "the derivative gain"),
)
def motor_impedance(
    _: Any, theta: Any, thd: Any, theta_des: Any, f_des: Any, friction: Any, r: Any, motor_kp: Any, motor_kd: Any
) -> Any:
    """Motor torque that brings a motor to the angle at which its tendon pulls with f_des; a spring and a damper hold it.

    For joints that are slow against it: the law of the two time scales. friction is the torque to compensate.
    """


@laws(
    lambda _: {"tau": Port((), TORQUE)},
    "eq. 11.16, mended",
    subject="impedance",
    guards=positive(
        "the tendon's stiffness", "the pulley's radius", "the motor's inertia", "the gain kp", "the gain kd"
    ),
)
def cascade(
    _: Any, f: Any, xd: Any, stiffness: Any, slope: Any, hdd: Any, f_des: Any, fd_des: Any, fdd_des: Any, friction: Any,
    r: Any, B: Any, force_kp: Any, force_kd: Any,
) -> Any:  # fmt: skip
    """Motor torque that makes the error of a tendon's force die out as e'' + kd e' + kp e = 0, whatever the joints do.

    The tendon has the stiffness k, with the slope dk/df, and is stretched at the rate xd; hdd is the acceleration of
    its path, by which the joints stretch it.
    """


@laws(
    lambda _: {
        "margin": Port((), one),
        "S": Port((TENDONS, 3), (m / N, m * s / N, m * s**2 / N) * TENDONS),
    },
    "eq. 11.17 to 11.21, mended",
    subject="cascade_certificate",
    guards=positive("the weight", "the frequency omega"),
)
def cascade_certificate(_: Any, D: Any, P: Any, kp: Any, kd: Any, weight: Any, omega: Any) -> Any:
    """Whether joint damping D and force loops kp, kd make a stable cascade: proved where the margin is positive.

    The proof is the energy qd' M qd / 2 + q' K q / 2 + sum (S11 e^2 + 2 S12 e e' + S22 e'^2), which falls. weight and
    omega choose it: force errors cost weight (e^2 + e'^2 / omega^2). A heavier weight proves more, and bounds less.
    """
