"""The tendons of the whole hand (eq. 5.1), finger by finger: each depends on the joints of its finger, and on the wrist.

`hand.blocks` has the rows (tendons) and columns (joints) of the hand's arrays that belong to each finger. Everything
outside these blocks is exactly zero, so no operation is spent on it.
"""

from collections.abc import Callable, Iterable
from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions import tendons
from awiwi_gen.definitions import wrist as wrists
from awiwi_gen.definitions.domain import wraps_hold

Hand = Any


def tendon_lengths(hand: Hand, q: Matrix, wrist: Matrix | None = None) -> Any:
    """Path lengths (m) [m] in the fingers and, if the hand has one, in the wrist at its angles (2); then its guards."""
    fingers = Matrix.vstack(*_blocks(hand, tendons.tendon_lengths, q))
    if wrist is None:
        return _guarded(hand, q, fingers)
    in_wrist, guards = wrists.tendon_lengths(hand.wrist, wrist[:1], wrist[1:])
    return _guarded(hand, q, fingers + in_wrist, guards)


def coupling(hand: Hand, q: Matrix) -> Any:
    """P = dh/dq (m x n) [m/rad] (eq. 5.6)."""
    return _guarded(hand, q, sympy.diag(*_blocks(hand, tendons.coupling, q)))


def joint_torque(hand: Hand, q: Matrix, f: Matrix) -> Any:
    """Joint torques (n) [N m] of the tendon forces f (m) [N] (eq. 5.8)."""
    return _guarded(hand, q, Matrix.vstack(*_blocks(hand, tendons.joint_torque, q, f)))


def joint_stiffness(hand: Hand, q: Matrix, f: Matrix, k: Matrix) -> Any:
    """-d tau/dq (n x n) [N m/rad] through tendons of stiffness k (m) [N/m] (eq. 5.12, 5.23)."""
    return _guarded(hand, q, sympy.diag(*_blocks(hand, tendons.joint_stiffness, q, f, k)))


def motor_lengths(hand: Hand, q: Matrix) -> Any:
    """Lengths (motors) [m] of all that each motor pulls: a constant matrix times those of the tendons."""
    return _guarded(hand, q, _shares(hand) * Matrix.vstack(*_blocks(hand, tendons.tendon_lengths, q)))


def motor_coupling(hand: Hand, q: Matrix) -> Any:
    """The same matrix times P (motors x n) [m/rad]."""
    return _guarded(hand, q, _shares(hand) * sympy.diag(*_blocks(hand, tendons.coupling, q)))


def motor_joint_torque(hand: Hand, q: Matrix, f: Matrix) -> Any:
    """Joint torques (n) [N m]: every tendon has the force of its motor, f (motors) [N]."""
    return _guarded(hand, q, Matrix.vstack(*_blocks(hand, tendons.joint_torque, q, _shares(hand).T * f)))


def motor_joint_stiffness(hand: Hand, q: Matrix, f: Matrix, k: Matrix) -> Any:
    """-d tau/dq (n x n) [N m/rad] through motors of stiffness k (motors) [N/m]: blocks by forces, and P' diag(k) P."""
    still = _shares(hand).T * f
    blocks = _blocks(hand, tendons.joint_stiffness, q, still, sympy.zeros(len(still), 1))
    P = _shares(hand) * sympy.diag(*_blocks(hand, tendons.coupling, q))
    return _guarded(hand, q, sympy.diag(*blocks) + P.T * sympy.diag(*k) * P)


def _shares(hand: Hand) -> Matrix:
    """The tendons (motors x m) of each motor: 1 where it pulls one."""
    count = sum(map(len, hand.motors))
    return Matrix(len(hand.motors), count, lambda motor, place: int(place in hand.motors[motor]))


def _guarded(hand: Hand, q: Matrix, result: Matrix, guards: Iterable[Expr] = ()) -> Any:
    """A result with its guards, and those of tendons that wrap round bodies; the result alone if there are none."""
    wraps = (wraps_hold(hand.fingers[name], _column(q[joints])) for name, (_, joints) in hand.blocks.items())
    found = [*guards, *(guard for of_finger in wraps for guard in of_finger)]
    return (result, found) if found else result


def _blocks(hand: Hand, of_finger: Callable[..., Matrix], q: Matrix, *by_tendon: Matrix) -> list[Matrix]:
    """A quantity of each finger, from its rows of the joint angles and of the arrays over tendons."""
    return [
        of_finger(hand.fingers[name], _column(q[joints]), *(_column(array[rows]) for array in by_tendon))
        for name, (rows, joints) in hand.blocks.items()
    ]


def _column(elements: list[Expr]) -> Matrix:
    """A column, also of no elements, which SymPy would give no columns."""
    return Matrix(len(elements), 1, elements)
