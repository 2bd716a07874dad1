"""The tendons of the whole hand by automatic differentiation of one vector of lengths, whose sparsity gives the blocks."""

from collections.abc import Iterable
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses import tendons
from awiwi_gen.witnesses import wrist as wrists
from awiwi_gen.witnesses.domain import wraps_hold

Hand = Any


def tendon_lengths(hand: Hand, q: SX, wrist: SX | None = None) -> Any:
    """Path lengths (m) [m] in the fingers and, if the hand has one, in the wrist at its angles (2); then its guards."""
    if wrist is None:
        return _guarded(hand, q, _lengths(hand, q))
    in_wrist, guards = wrists.tendon_lengths(hand.wrist, wrist[0], wrist[1])
    return _guarded(hand, q, _lengths(hand, q) + in_wrist, guards)


def coupling(hand: Hand, q: SX) -> Any:
    """P = dh/dq (m x n) [m/rad] (eq. 5.6)."""
    return _guarded(hand, q, ca.densify(ca.jacobian(_lengths(hand, q), q)))


def joint_torque(hand: Hand, q: SX, f: SX) -> Any:
    """Joint torques (n) [N m]: gradient of the tendons' work -f h (eq. 5.8)."""
    return _guarded(hand, q, -ca.densify(ca.gradient(ca.dot(f, _lengths(hand, q)), q)))


def joint_stiffness(hand: Hand, q: SX, f: SX, k: SX) -> Any:
    """-d tau/dq (n x n) [N m/rad] (eq. 5.12, 5.23): coupling' diag(k) coupling plus the change of the coupling."""
    h = _lengths(hand, q)
    coupling = ca.jacobian(h, q)
    geometric = ca.jacobian(ca.gradient(ca.dot(f, h), q), q)
    elastic = coupling.T @ (ca.repmat(k, 1, coupling.size2()) * coupling)
    return _guarded(hand, q, ca.densify(elastic + geometric))


def motor_lengths(hand: Hand, q: SX) -> Any:
    """Lengths (motors) [m] of all that each motor pulls: its work per force."""
    return _guarded(hand, q, _of_motors(hand, q))


def motor_coupling(hand: Hand, q: SX) -> Any:
    """P = dh/dq (motors x n) [m/rad]."""
    return _guarded(hand, q, ca.densify(ca.jacobian(_of_motors(hand, q), q)))


def motor_joint_torque(hand: Hand, q: SX, f: SX) -> Any:
    """Joint torques (n) [N m]: gradient of the motors' work -f h."""
    return _guarded(hand, q, -ca.densify(ca.gradient(ca.dot(f, _of_motors(hand, q)), q)))


def motor_joint_stiffness(hand: Hand, q: SX, f: SX, k: SX) -> Any:
    """-d tau/dq (n x n) [N m/rad]: what forces on all tendons of a motor add up to where these give way together."""
    h = _of_motors(hand, q)
    coupling, pulls = ca.jacobian(h, q), SX.sym("pull", h.numel())
    torque = ca.gradient(ca.dot(pulls, h), q)
    held = ca.substitute(ca.jacobian(torque, q), pulls, f)
    return _guarded(hand, q, ca.densify(held + ca.jacobian(torque, pulls) @ (ca.repmat(k, 1, q.numel()) * coupling)))


def _of_motors(hand: Hand, q: SX) -> SX:
    lengths, forces = _lengths(hand, q), SX.sym("motor", len(hand.motors))
    each = SX.zeros(lengths.numel())
    for motor, places in enumerate(hand.motors):
        each[list(places)] = forces[motor]
    return ca.densify(ca.gradient(ca.dot(each, lengths), forces))


def _guarded(hand: Hand, q: SX, result: SX, guards: Iterable[SX] = ()) -> Any:
    """A result with its guards, and those of tendons that wrap round bodies; the result alone if there are none."""
    wraps = (wraps_hold(hand.fingers[name], q[joints]) for name, (_, joints) in hand.blocks.items())
    found = [*guards, *(guard for of_finger in wraps for guard in of_finger)]
    return (result, found) if found else result


def _lengths(hand: Hand, q: SX) -> SX:
    """Path lengths (m) [m] in the fingers."""
    fingers = [tendons.tendon_lengths(hand.fingers[name], q[joints]) for name, (_, joints) in hand.blocks.items()]
    return ca.vertcat(*fingers)
