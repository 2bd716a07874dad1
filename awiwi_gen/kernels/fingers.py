"""The kernels of every finger, declared once for all fingers."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.hand.lever import Lever
from awiwi_gen.hand.parts import Finger, PathPoint, Tendon, Transmission
from awiwi_gen.hand.pose import polynomial
from awiwi_gen.kernel import Kernel, Port, Solver
from awiwi_gen.kernels.declare import Family, within
from awiwi_gen.kernels.estimates import joint_limits, nonlinear_estimate
from awiwi_gen.kernels.resting import resting_estimate
from awiwi_gen.kernels.routing import least_forces, wraps_hold
from awiwi_gen.kernels.sizes import (
    POSE,
    Size,
    arms,
    arms_derivative,
    coriolis,
    covariance,
    inertia,
    jacobian_port,
    motion,
    stiffness,
    torque,
)
from awiwi_gen.structure import link_number, rests_in_a_bend, rolls
from awiwi_gen.units import J, N, Unit, m, one, s

per_finger: Family[Size] = Family()

STIFFEST = 50.0  # [N m/rad]; more than the tendons of a hand give a joint


def finger_kernels(hand: Hand, name: str, finger: Finger) -> list[Kernel]:
    """All kernels of one finger."""
    size = Size.of(finger)
    ports = input_ports(hand, finger, size)
    return guarded(finger, per_finger.kernels(name, finger, f"fingers.{name}", finger.structure(), ports, size))


def guarded(finger: Finger, kernels: list[Kernel]) -> list[Kernel]:
    """The kernels of a finger; they return a status if they depend on four-bars, or on tendons round bodies."""
    loops = tuple(f"the four-bar of {link.joint} closes" for link in finger.links if link.four_bar)
    held = wraps_hold(finger)
    needless = {"return_torque"} if not finger.strings else set()
    needless |= {"resting_balance"} if not rests_in_a_bend(finger) else set()
    kernels = [kernel for kernel in kernels if kernel.family not in needless]
    kernels = [within(k, "domain", "loops_close", loops) if loops and moves_the_chain(k) else k for k in kernels]
    return [within(k, "domain", "wraps_hold", held) if held and moves_tendons(k) else k for k in kernels]


def moves_tendons(kernel: Kernel) -> bool:
    """Whether a kernel depends on the paths of tendons."""
    rooms = (".tendons", ".joint_estimate")
    return "q" in kernel.inputs and any(route.module.endswith(rooms) for route in kernel.routes.values())


def moves_the_chain(kernel: Kernel) -> bool:
    """Whether a kernel depends on where the links are; tendons only depend on angles."""
    rooms = (".kinematics", ".dynamics", ".palm")
    return "q" in kernel.inputs and any(route.module.endswith(rooms) for route in kernel.routes.values())


def input_ports(hand: Hand, finger: Finger, size: Size) -> dict[str, Port]:
    """The input ports by argument name, with the ranges of this hand."""
    limits = hand.limits
    low, high = joint_limits(finger)
    slack, taut = force_range(hand)
    least = least_forces(finger, limits)
    lengths = [motor_range(finger, transmission) for transmission in finger.transmissions]

    def symmetric(shape: tuple[int, ...], unit: Unit, limit: Any) -> Port:
        return Port(shape, unit, -float(limit), float(limit))

    def of_joints(port: Port, hinge: Any, slide: Any) -> Port:
        most = size.choose(float(hinge), float(slide or 0))
        return replace(port, low=tuple(-each for each in most) if isinstance(most, tuple) else -most, high=most)

    q = replace(motion(size), low=low, high=high)
    measured = {"measured": q.subset(finger.measured)} if finger.measured else {}
    return measured | {
        "q": q,
        "qd": of_joints(motion(size, one / s), limits.joint_velocity, limits.slide_velocity),
        "qdd": of_joints(motion(size, one / s**2), limits.joint_acceleration, limits.slide_acceleration),
        "tau": of_joints(torque(size), limits.joint_torque, limits.slide_force),
        "f": Port((size.tendons,), N, least if any(least) else 0.0, float(limits.tendon_force)),
        "k": Port((size.tendons,), N / m, float(limits.tendon_stiffness_low), float(limits.tendon_stiffness_high)),
        "h": Port((size.tendons,), m, tuple(low for low, _ in lengths), tuple(high for _, high in lengths)),
        "start": replace(motion(size), low=low, high=high),
        "noise": Port((), m, 0.0, 1e-3),
        "g": symmetric((3,), m / s**2, limits.gravity),
        "K": replace(stiffness(size), low=-STIFFEST, high=STIFFEST),
        "f_min": Port((), N, slack, slack + (taut - slack) / 4),
        "f_max": Port((), N, taut - (taut - slack) / 4, taut),
        "f_last": Port((size.tendons,), N, slack, taut),
    }


def force_range(hand: Hand) -> tuple[float, float]:
    """Range of tendon forces [N] that every spring's curve covers; without springs, from zero to the hand's limit."""
    if hand.spring is None:
        return 0.0, float(hand.limits.tendon_force)
    levers = [Lever(spring) for spring in (hand.spring, *hand.spring.calibrated.values())]
    ends = [(lever.at(lever.slack).force, lever.at(lever.taut).force) for lever in levers]
    return max(slack for slack, _ in ends), min(taut for _, taut in ends)


def motor_range(finger: Finger, transmission: Transmission) -> tuple[float, float]:
    """Bounds of the length of what a motor pulls [m]."""
    ranges = [length_range(finger, tendon) for tendon in transmission.tendons]
    ends = [sorted((weight * low, weight * high))
            for weight, (low, high) in zip(transmission.weights, ranges, strict=True)]  # fmt: skip
    return sum(low for low, _ in ends), sum(high for _, high in ends)


def length_range(finger: Finger, tendon: Tendon) -> tuple[float, float]:
    """Bounds of a tendon's length over all poses [m]: joints at their limits, lines from zero to their longest."""
    rest, reach = float(tendon.rest), 0.0
    limits = limits_of(finger)
    for over in tendon.over:
        joint = over[1:]
        leader = finger.leaders.get(joint, joint)
        if rolls(finger, joint):  # the arcs on the pulleys of follower and leader are equal
            reach += float(finger.radii[leader]) * max(map(abs, limits[leader]))
        else:
            reach += float(finger.radii[joint]) * farthest(finger, joint)
    reach += sum(abs(float(arm)) * farthest(finger, joint) for joint, arm in tendon.arms.items())
    low, high = rest - reach, rest + reach
    for run in tendon.runs:
        if run.body is None:
            most = longest(finger, run.start, run.end)
        else:
            most = longest(finger, run.start, run.body) + longest(finger, run.body, run.end)
            most += 2 * math.pi * float(run.body.radius or 0)
        high += most / float(run.divisor or 1)
    if tendon.span is None:
        return low, high
    points = (tendon.span.from_, tendon.span.to, *(link.offset for link in finger.links))
    high += sum(farthest(finger, link.joint) + abs(float(link.reference or 0)) for link in finger.links if link.slides)
    return low, high + sum(sum(float(x) ** 2 for x in point) ** 0.5 for point in points)


def limits_of(finger: Finger) -> dict[str, tuple[float, float]]:
    """Lower and upper limit of each independent joint [rad], or [m] of slides."""
    return dict(zip(finger.joints, zip(*joint_limits(finger), strict=True), strict=True))


def farthest(finger: Finger, joint: str) -> float:
    """Bound of the size of a joint's angle [rad], or of a slide's position [m], over all poses."""
    coefficients, ends = finger.motion(joint), limits_of(finger)[finger.leaders.get(joint, joint)]
    if len(coefficients) > 2:  # the terms of a curve may cancel at both ends
        return polynomial([abs(each) for each in coefficients], max(map(abs, ends)))
    return max(abs(polynomial(coefficients, end)) for end in ends)


def longest(finger: Finger, a: PathPoint, b: PathPoint) -> float:
    """Bound of a line's length over all poses [m]: both points away from their origins, and all offsets between, in line."""
    first, last = sorted(link_number(finger, point.link) for point in (a, b))
    between = finger.links[max(first, 0) : max(last, 0)]
    vectors = [a.at, b.at, *(link.offset for link in between)]
    moved = finger.links[first + 1 : last + 1]
    cranks = [float(link.four_bar.crank) for link in moved if link.four_bar]
    travels = [farthest(finger, link.joint) + abs(float(link.reference or 0)) for link in moved if link.slides]
    return sum(math.hypot(*map(float, vector)) for vector in vectors) + sum(cranks) + sum(travels)


# -- kinematics -------------------------------------------------------------------------------------------


@per_finger(lambda z: {"T": Port((4, 4), POSE)}, "eq. 5.2, 5.3, table 5.1", subject="kinematics")
def fingertip_pose(finger: Any, q: Any) -> Any:
    """Pose of the fingertip: maps fingertip coordinates into the finger's base frame."""


@per_finger(lambda z: {"T": Port((z.links, 4, 4), POSE * z.links)}, "eq. 5.2", subject="kinematics")
def link_poses(finger: Any, q: Any) -> Any:
    """Pose of every link frame (origin at its joint, fixed to the link) in the finger's base frame."""


@per_finger(lambda z: {"J": jacobian_port(z)}, "eq. 5.3, differentiated", subject="kinematics")
def jacobian(finger: Any, q: Any) -> Any:
    """Fingertip Jacobian in base axes: velocity of the tip (rows 0-2) and angular velocity (rows 3-5)."""


@per_finger(
    lambda z: {"T": Port((4, 4), POSE), "J": jacobian_port(z)},
    "eq. 5.2, 5.3, table 5.1, differentiated",
    subject="kinematics",
)
def pose_and_jacobian(finger: Any, q: Any) -> Any:
    """Pose of the fingertip and its Jacobian, both in base axes, in one call with fewer operations."""


# -- dynamics ---------------------------------------------------------------------------------------------


@per_finger(lambda z: {"M": inertia(z)}, "eq. 2.17, 5.4", subject="dynamics")
def mass_matrix(finger: Any, q: Any) -> Any:
    """Mass matrix: the kinetic energy is half qd' M qd."""


@per_finger(lambda z: {"C": coriolis(z)}, "eq. 2.17", subject="dynamics")
def coriolis_matrix(finger: Any, q: Any, qd: Any) -> Any:
    """Coriolis matrix by Christoffel symbols, so that dM/dt - 2 C is skew-symmetric."""


@per_finger(lambda z: {"gravity": torque(z)}, "eq. 2.17, 5.4", subject="dynamics")
def gravity(finger: Any, q: Any, g: Any) -> Any:
    """Joint torques that hold the finger at rest against gravity g (in base axes)."""


@per_finger(lambda z: {"bias": torque(z)}, "eq. 2.17", subject="dynamics")
def bias(finger: Any, q: Any, qd: Any, g: Any) -> Any:
    """Coriolis, centrifugal and gravity torques together: C qd + gravity."""


@per_finger(lambda z: {"tau": torque(z)}, "eq. 2.4 to 2.15, 2.17", subject="dynamics")
def inverse_dynamics(finger: Any, q: Any, qd: Any, qdd: Any, g: Any) -> Any:
    """Joint torques that produce the accelerations qdd: M qdd + C qd + gravity."""


@per_finger(
    lambda z: {"dtau_dq": stiffness(z), "dtau_dqd": coriolis(z)}, "eq. 2.17, differentiated", subject="dynamics"
)
def inverse_dynamics_derivatives(finger: Any, q: Any, qd: Any, qdd: Any, g: Any) -> Any:
    """Partial derivatives of the inverse dynamics with respect to the positions and the velocities."""


@per_finger(lambda z: {"qdd": motion(z, one / s**2)}, "eq. 2.1, solved for qdd", subject="dynamics")
def forward_dynamics(finger: Any, q: Any, qd: Any, tau: Any, g: Any) -> Any:
    """Joint accelerations under the joint torques tau."""


@per_finger(lambda z: {"M": inertia(z), "C": coriolis(z), "gravity": torque(z)}, "eq. 2.17", subject="dynamics")
def dynamics(finger: Any, q: Any, qd: Any, g: Any) -> Any:
    """Mass matrix, Coriolis matrix and gravity torques in one call with fewer operations."""


@per_finger(
    lambda z: {"M": inertia(z), "C": coriolis(z), "gravity": torque(z), "tau": torque(z)},
    "eq. 2.4 to 2.15, 2.17",
    subject="dynamics",
)
def dynamics_and_torque(finger: Any, q: Any, qd: Any, qdd: Any, g: Any) -> Any:
    """All of `dynamics`, and the torques of `inverse_dynamics`, in one call with fewer operations."""


@per_finger(lambda z: {"kinetic": Port((), J), "potential": Port((), J)}, "eq. 2.16, 5.4", subject="dynamics")
def energy(finger: Any, q: Any, qd: Any, g: Any) -> Any:
    """Kinetic energy and potential energy in the gravity field g (zero at the base frame's origin)."""


# -- tendons ----------------------------------------------------------------------------------------------


@per_finger(lambda z: {"h": Port((z.tendons,), m)}, "eq. 5.5, 5.18, 5.22", subject="tendons")
def tendon_lengths(finger: Any, q: Any) -> Any:
    """Path length of every tendon in the finger, by its routing."""


@per_finger(lambda z: {"P": arms(z)}, "eq. 5.6, 5.9, 5.21", subject="tendons")
def coupling(finger: Any, q: Any) -> Any:
    """Coupling matrix P = dh/dq: tendon velocities are P qd."""


@per_finger(
    lambda z: {"dP": arms_derivative(z)},
    "eq. 5.11",
    subject="tendons",
)
def coupling_derivative(finger: Any, q: Any) -> Any:
    """Second derivatives of the tendon lengths: dP[i, j, k] = d2 h_i / dq_j dq_k."""


@per_finger(lambda z: {"tau": torque(z)}, "eq. 5.8", subject="tendons")
def joint_torque(finger: Any, q: Any, f: Any) -> Any:
    """Joint torques -P' f of the tendon forces f."""


@per_finger(lambda z: {"K": stiffness(z)}, "eq. 5.12, 5.23", subject="tendons")
def joint_stiffness(finger: Any, q: Any, f: Any, k: Any) -> Any:
    """Joint stiffness -d tau/dq of tendons with the stiffnesses k and the forces f."""


@per_finger(
    lambda z: {"tau": torque(z), "K": stiffness(z)},
    "eq. 5.8, 5.12, 5.23",
    subject="tendons",
)
def joint_torque_and_stiffness(finger: Any, q: Any, f: Any, k: Any) -> Any:
    """Joint torques and joint stiffness of the tendons in one call with fewer operations."""


@per_finger(lambda z: {"tau": torque(z), "energy": Port((), J)}, "eq. 5.8, with strings for tendons", subject="tendons")
def return_torque(finger: Any, q: Any) -> Any:
    """Joint torques of the elastic return strings, and the energy in them.

    A string pulls with its stiffness times its length beyond its rest; one that is shorter is slack and does not pull.
    """


# -- joint angles from tendon lengths ---------------------------------------------------------------------


@per_finger(
    lambda z: {"balance": torque(z), "slope": stiffness(z)},
    "eq. 5.8, 5.14, with springs of joints and strings",
    subject="tendons",
)
def resting_balance(finger: Any, q: Any, f: Any) -> Any:
    """Joint torques that a finger misses to rest under tendon forces f, and their derivatives by the joint angles.

    Those of springs of joints and of return strings, plus P' f; without gravity, friction and contact. Zero where the
    finger rests.
    """


def estimate_solver(finger: Finger) -> Solver | None:
    """What finds the joint angles of a finger; None where they have a closed form."""
    return resting_estimate(finger) if rests_in_a_bend(finger) else nonlinear_estimate(finger)


@per_finger(
    lambda z: {"q": motion(z)},
    "eq. 5.14, 5.15, 5.24",
    subject="joint_estimate",
    solver=estimate_solver,
)
def joint_estimate(finger: Any, h: Any, start: Any, measured: Any = None) -> Any:
    """Joint angles whose tendon lengths are nearest to the measured h (least squares); start is the last estimate.

    Where the coupling is constant the estimate is linear, and not limited: lengths that no pose has give angles beyond the
    joint limits. Otherwise it is within them.

    Where tendons are too few, the springs of the finger tell the rest: of all angles with these lengths, those are found
    where the springs hold the least energy. So the finger must rest without contact, its tendons must be taut, and
    weight and friction small beside the springs. Linear estimates do not know the stops of joints, others do.
    """


@per_finger(
    lambda z: {"covariance": covariance(z), "worst": motion(z)},
    "eq. 5.14, linearised",
    subject="joint_estimate",
)
def joint_estimate_error(finger: Any, q: Any, noise: Any) -> Any:
    """Errors of the joint estimate: covariance for lengths with standard deviation noise, worst for errors up to noise.

    Where springs tell the rest, the finger rests at q, and no joint is at a stop: one that is has no error there.
    """
