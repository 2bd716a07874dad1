"""Tendons of a finger by automatic differentiation: torques and stiffnesses are derivatives of an energy.

The lengths are written down, with points of straight lines from the recursion along the chain. The coupling of a path
from point to point needs no derivative: a tight string pulls its ends by unit forces, and presses on the bodies that it
wraps round; the moments of these forces about the joints' axes are its arms. What a motor with several tendons does is
their work, by its force.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.structure import Finger, coordinates, leaders, link_number, radius, rolls, sense
from awiwi_gen.witnesses.inside_wraps import InsideWrap
from awiwi_gen.witnesses.joints import followed, passive_springs
from awiwi_gen.witnesses.kinematics import point_before_joint, point_of_link
from awiwi_gen.witnesses.wraps import Wrap

Tendon = Any


def tendon_lengths(finger: Finger, q: SX) -> SX:
    """Path lengths h (m) [m] (eq. 5.5, 5.20, 5.22)."""
    return _of_motors(finger, _column(_lengths(finger, finger.pulled, q)))


def _of_motors(finger: Finger, tendons: SX) -> SX:
    """What each motor has (m x ...) of a quantity of every pulled tendon: the work per force of the motor."""
    if not any(transmission.ratios for transmission in finger.transmissions):
        return tendons
    forces = SX.sym("motor", len(finger.transmissions))
    pulls = SX.zeros(tendons.size1())
    for force, transmission in zip(ca.vertsplit(forces), finger.transmissions, strict=True):
        for member, ratio in zip(transmission.members, transmission.ratios or [1], strict=True):
            pulls[member] = ratio * force
    work = (ca.gradient(ca.dot(pulls, tendons[:, column]), forces) for column in range(tendons.size2()))
    return ca.horzcat(*work)


def _lengths(finger: Finger, tendons: Iterable[Tendon], q: SX, paths: bool = True) -> list[SX]:
    """Lengths [m] of some tendons, with or without their paths from point to point."""
    position, follows = coordinates(finger), leaders(finger)

    def angle(joint: str) -> SX:
        return followed(finger, joint, q[position[joint]])[0]

    lengths = []
    for tendon in tendons:
        length = SX(tendon.rest)
        for over in tendon.over:
            sign, joint = sense(over)
            if rolls(
                finger, joint
            ):  # the coupling tendon makes the arcs on the follower's and the leader's pulley equal
                length += sign * radius(finger, follows[joint]) * q[position[joint]]
            else:
                length += sign * radius(finger, joint) * angle(joint)
        length += sum(arm * angle(joint) for joint, arm in tendon.arms.items())
        if tendon.span is not None:
            end = point_before_joint(finger, q, tendon.span.joint, ca.vertcat(*tendon.span.to))
            length += ca.norm_2(end - ca.vertcat(*tendon.span.from_))
        if paths:
            length += sum(run.counted(ca.norm_2(line)) for run, line, _ in _lines(finger, tendon, q))
            length += sum(run.counted(wrap.length()) for run, wrap in _wraps(finger, tendon, q))
        lengths.append(length)
    return lengths


def coupling(finger: Finger, q: SX) -> SX:
    """P = dh/dq (m x n) [m/rad] (eq. 5.6): a derivative, and moments of unit vectors for paths from point to point."""
    rows = [_arms(finger, tendon, q) for tendon in finger.pulled]
    slopes = ca.densify(ca.jacobian(_column(_lengths(finger, finger.pulled, q, paths=False)), q))
    return _of_motors(finger, slopes + ca.vertcat(*rows))


def return_torque(finger: Finger, q: SX) -> tuple[SX, SX]:
    """Joint torques (n) [N m] of the elastic return strings and their energy [J].

    The torque is the gradient of the work of the strings' forces, which are held.
    """
    h = _column(_lengths(finger, finger.strings, q))
    stiffness = _column([string.spring.stiffness for string in finger.strings])
    rest = _column([string.spring.rest for string in finger.strings])
    stretch = (h - rest + ca.fabs(h - rest)) / 2
    held = SX.sym("force", h.numel())
    tau = ca.substitute(-ca.gradient(ca.dot(held, h), q), held, stiffness * stretch)
    return ca.densify(tau), ca.dot(stiffness, stretch**2) / 2


def resting_balance(finger: Finger, q: SX, f: SX) -> tuple[SX, SX]:
    """What the torques (n) [N m] of springs, strings and tendons miss to balance, and its derivatives (n x n) [N m/rad]."""
    missing = passive_springs(finger, q) - return_torque(finger, q)[0] - joint_torque(finger, q, f)
    return ca.densify(missing), ca.densify(ca.horzcat(*(ca.jacobian(missing, q[i]) for i in range(q.numel()))))


def _lines(finger: Finger, tendon: Tendon, q: SX) -> Iterator[tuple[Any, SX, SX]]:
    """The straight runs of a path: the vector (3) [m] from a point to the next one, and its rates (3 x n) [m/rad]."""
    for run in tendon.runs:
        if run.body is not None:
            continue
        one, other = (link_number(finger, point.link) for point in (run.start, run.end))
        start, end = (ca.vertcat(*point.at) for point in (run.start, run.end))
        if one == other:
            yield run, end - start, SX.zeros(3, q.numel())
        else:
            (start, start_rates), (end, end_rates) = (
                point_of_link(finger, q, link, at) for link, at in ((one, start), (other, end))
            )
            yield run, end - start, end_rates - start_rates


def _wraps(finger: Finger, tendon: Tendon, q: SX) -> Iterator[tuple[Any, Wrap]]:
    """The runs of a path round bodies."""
    for run in tendon.runs:
        if run.body is not None:
            yield run, (InsideWrap if run.body.inside else Wrap).of(finger, run, q)


def _arms(finger: Finger, tendon: Tendon, q: SX) -> SX:
    """Arms (1 x n) [m/rad] of a tendon's path: moments of the unit vectors along its lines about the joints' axes."""
    arms = SX.zeros(1, q.numel())
    for run, line, rates in _lines(finger, tendon, q):
        arms += run.counted((line / ca.norm_2(line)).T @ rates)
    for run, wrap in _wraps(finger, tendon, q):
        arms += run.counted(wrap.arms())
    return arms


def _column(elements: list[SX]) -> SX:
    """A column of scalars, also of none."""
    return ca.vertcat(*elements) if elements else SX.zeros(0, 1)


def coupling_derivative(finger: Finger, q: SX) -> list[SX]:
    """d2h/dq2: one symmetric matrix (n x n) [m/rad^2] per tendon."""
    return [ca.densify(_hessian(finger, length, q)) for length in ca.vertsplit(tendon_lengths(finger, q))]


def _hessian(finger: Finger, scalar: SX, q: SX) -> SX:
    """Second derivatives (n x n) by joint angles.

    CasADi computes several columns as one sum where it can tell them apart afterwards: not where units differ.
    """
    if not any(link.slides for link in finger.links):
        return ca.hessian(scalar, q)[0]
    gradient = ca.gradient(scalar, q)
    return ca.horzcat(*(ca.jacobian(gradient, q[i]) for i in range(q.numel())))


def joint_torque(finger: Finger, q: SX, f: SX) -> SX:
    """Joint torques (n) [N m] of tendon forces f (m) [N]: gradient of the tendons' work -f h (eq. 5.8)."""
    return -ca.densify(ca.gradient(ca.dot(f, tendon_lengths(finger, q)), q))


def joint_stiffness(finger: Finger, q: SX, f: SX, k: SX) -> SX:
    """-d tau/dq (n x n) [N m/rad] (eq. 5.12, 5.23): Hessian of the energy in tendons of stiffnesses k (m) [N/m]."""
    h = tendon_lengths(finger, q)
    fixed = SX.sym("fixed", h.numel())
    stretch = h - fixed
    energy = ca.dot(f, stretch) + ca.dot(k, stretch**2) / 2
    stiffness = ca.substitute(_hessian(finger, energy, q), fixed, h)
    # The stretch is zero now; CasADi simplifies it only when the expression is evaluated again after cse.
    arguments = ca.symvar(stiffness)
    return ca.densify(ca.Function("stiffness", arguments, [ca.cse(stiffness)])(*arguments))


def joint_torque_and_stiffness(finger: Finger, q: SX, f: SX, k: SX) -> tuple[SX, SX]:
    """Joint torques (n) [N m] and stiffness (n x n) [N m/rad]: gradient and Hessian of the same energy."""
    return joint_torque(finger, q, f), joint_stiffness(finger, q, f, k)
