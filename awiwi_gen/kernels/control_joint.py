"""The kernels of joint control: stiffness correction, friction observer, impedance, and the cascade.

All their parameters are inputs, so they read no number of a hand. Matrices are for four joints. With fewer joints use the
first rows and columns, and fill the others so that they do not interact, for example with the identity matrix.
"""

from __future__ import annotations

from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.hand.lever import Lever
from awiwi_gen.hand.parts import Transmission
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import N, Unit, kg, m, one, rad, s

laws: Family[None] = Family()

JOINTS, TENDONS = 4, 8
TORQUE, MOMENTUM = N * m, N * m * s
STIFFNESS, DAMPING, INERTIA = N * m / rad, N * m * s / rad, kg * m**2


def joint_laws(hand: Hand) -> list[Kernel]:
    """All kernels of joint control."""
    ports = PORTS | stiffness_ports(*joint_stiffness(hand))
    return laws.kernels("", Parameterless(), "control", {}, ports, None)


def joint_stiffness(hand: Hand) -> tuple[float, float]:
    """Least and largest stiffness [N m/rad] that tendons with constant arms give a joint, rounded to include both."""
    low, high = float(hand.limits.tendon_stiffness_low), float(hand.limits.tendon_stiffness_high)
    if hand.spring:
        levers = [Lever(spring) for spring in (hand.spring, *hand.spring.calibrated.values())]
        low = min(lever.at(lever.slack).stiffness for lever in levers)
        high = max(lever.at(lever.taut).stiffness for lever in levers)
        if fibre := hand.tendon:  # in series with the spring
            own = float(fibre.modulus) * float(fibre.section) / float(fibre.length)
            low, high = (1 / (1 / end + 1 / own) for end in (low, high))
    squares = [
        float(pulley.radius) ** 2 * sum(_turns(each, pulley.joint) ** 2 for each in finger.transmissions)
        for finger in hand.fingers.values()
        for pulley in finger.pulleys
    ]
    squares += [
        sum(_arm(each, joint) ** 2 for each in finger.transmissions)
        for finger in hand.fingers.values()
        for joint in finger.joints
        if joint not in finger.sliding
    ]
    found = [square for square in squares if square > 0] or [1.0]
    # Two digits; 5 % is the most that rounding can lose.
    return float(f"{low * min(found) / 1.05:.2g}"), float(f"{high * max(found) * 1.05:.2g}")


def _turns(transmission: Transmission, joint: str) -> float:
    """How often a motor's tendons run over a joint's pulley, with their senses and shares."""
    senses = [(f"+{joint}" in tendon.over) - (f"-{joint}" in tendon.over) for tendon in transmission.tendons]
    return sum(weight * sense for weight, sense in zip(transmission.weights, senses, strict=True))


def _arm(transmission: Transmission, joint: str) -> float:
    """The arm [m/rad] that a motor's tendons have of their own at a joint, with their shares."""
    arms = [float(tendon.arms.get(joint, 0)) for tendon in transmission.tendons]
    return sum(weight * arm for weight, arm in zip(transmission.weights, arms, strict=True))


def stiffness_ports(low: float, high: float) -> dict[str, Port]:
    """Stiffnesses of joints between low and high, and softer ones that a controller makes of them.

    All matrices in these ranges are diagonally dominant, and so is the difference of two.
    """
    return {
        "K_eff": matrix(STIFFNESS, low / 20, low / 2, low / 80),
        "K_mech": matrix(STIFFNESS, low, high, low / 8),
        "k_eff": Port((), STIFFNESS, low / 80, low * 3 / 4),
        "k_mech": Port((), STIFFNESS, low * 7 / 8, high),
    }


def matrix(unit: Unit, low: float, high: float, beside: float) -> Port:
    """A matrix over the joints: diagonal entries from low to high, other entries up to `beside` in magnitude."""
    diagonal = [i == j for i in range(JOINTS) for j in range(JOINTS)]
    lows, highs = (
        tuple(end if here else other for here in diagonal) for end, other in ((low, -beside), (high, beside))
    )
    return Port((JOINTS, JOINTS), unit, lows, highs)


def vector(unit: Unit, limit: float) -> Port:
    """One number per joint."""
    return Port((JOINTS,), unit, -limit, limit)


PORTS = {
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
    """Controller stiffness K_imp that, in series with the tendons' joint stiffness K_mech, gives the stiffness K_eff.

    K_eff and K_mech are symmetric; only their lower triangles are read. K_mech must exceed K_eff in every direction,
    otherwise no positive definite K_imp exists. For K_mech = eps K_eff (eq. 8.2), K_imp is eps / (eps - 1) K_eff.
    """


@laws(
    lambda _: {"k_imp": Port((), STIFFNESS), "sensitivity": Port((), STIFFNESS / STIFFNESS)},
    "eq. 8.1",
    subject="stiffness_correction",
    guards=positive("k_eff", "k_mech - k_eff"),
)
def stiffness_correction_scalar(_: Any, k_eff: Any, k_mech: Any) -> Any:
    """Controller stiffness k_imp of one joint, and its sensitivity dk_imp/dk_mech to errors of the tendons' stiffness."""


# -- chapter 9 ----------------------------------------------------------------------------------------------


@laws(
    lambda _: {"momentum_next": Port((), MOMENTUM), "friction": Port((), TORQUE)},
    "eq. 9.1, 9.2, mended, over one sample",
    subject="friction_observer",
    guards=positive("the motor's inertia", "the gain", "the period"),
)
def friction_observer(_: Any, momentum: Any, u: Any, tau: Any, thd: Any, B: Any, gain: Any, period: Any) -> Any:
    """Friction torque of a motor under the torque u and the load tau during the sample that just ended.

    thd is the velocity at the end of that sample. momentum is the observer's memory: start with zero for a motor at
    rest, then pass the last momentum_next. The observer is stable for all gains and periods.
    """


# -- chapter 11 ---------------------------------------------------------------------------------------------


@laws(lambda _: {"tau": Port((JOINTS,), TORQUE)}, "eq. 11.4, 11.10, mended", subject="impedance")
def joint_impedance(
    _: Any, M: Any, C: Any, gravity: Any, q: Any, qd: Any, q_des: Any, qd_des: Any, qdd_des: Any, K: Any, D: Any
) -> Any:
    """Joint torques that make the joints behave as a spring K and a damper D about the desired motion.

    M, C and gravity are those at the measured q and qd; dM/dt - 2 C must be skew-symmetric. C multiplies the desired
    velocity, so that the controlled joints are passive.
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
    """Motor torque that moves a motor to the angle theta_des of the tendon force f_des, as a spring and a damper would.

    This is the fast loop of two time scales: the joints must be slow against it. friction is the torque to compensate.
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
    """Motor torque that makes the force error of a tendon decay as e'' + kd e' + kp e = 0, for any motion of the joints.

    The tendon has the stiffness k with the slope dk/df, and its elongation has the rate xd. hdd is the second
    derivative of its path length, by which the joints stretch it. kp and kd are force_kp and force_kd.
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
    """Stability of the cascade with joint damping D and force loops kp, kd: proved if the margin is positive.

    The proof is the falling energy qd' M qd / 2 + q' K q / 2 + sum (S11 e^2 + 2 S12 e e' + S22 e'^2). weight and omega
    choose it: force errors lose weight (e^2 + e'^2 / omega^2). A larger weight proves more, with a looser bound.
    """
