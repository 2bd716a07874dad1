"""Dynamics of a finger by its definition: Lagrange's equation from the energies (eq. 2.16, 2.17, 5.4).

The kinetic energy is that of the links' centres of mass plus that of their rotation (inertia tensors about the centres of mass), the
potential energy that of gravity; `gravity` arguments g are the gravitational acceleration [m/s^2] in the finger's base axes.
"""

from dataclasses import dataclass

import sympy
from sympy import Expr, Matrix

from awiwi_gen.models.chain import axial, frames
from awiwi_gen.models.naming import Derivation
from awiwi_gen.models.tree import Finger


@dataclass(frozen=True)
class _Lagrangian:
    """Both energies [J] of a moving finger, and the derivation their names belong to."""

    kinetic: Expr
    potential: Expr
    derivation: Derivation


def energy(finger: Finger, q: Matrix, qd: Matrix, g: Matrix) -> tuple[Expr, Expr]:
    """Kinetic and potential energy [J] (eq. 5.4); the potential is zero for masses at the height of the base's origin."""
    lagrangian = _lagrangian(finger, q, qd, g)
    return lagrangian.kinetic, lagrangian.potential


def mass_matrix(finger: Finger, q: Matrix) -> Matrix:
    """M (n x n) [kg m^2]: Hessian of the kinetic energy with respect to the joint velocities."""
    qd = _rates(q)
    return _hessian(_lagrangian(finger, q, qd, sympy.zeros(3, 1)), qd)


def coriolis_matrix(finger: Finger, q: Matrix, qd: Matrix) -> Matrix:
    """C (n x n) [N m s]: the Christoffel symbols of the first kind of M, times the joint velocities (eq. 2.17)."""
    return dynamics(finger, q, qd, sympy.zeros(3, 1))[1]


def gravity(finger: Finger, q: Matrix, g: Matrix) -> Matrix:
    """Joint torques (n) [N m] that hold the finger still: the gradient of the potential energy."""
    return _gradient(_lagrangian(finger, q, _rates(q), g), q)


def dynamics(finger: Finger, q: Matrix, qd: Matrix, g: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """M (n x n) [kg m^2], C (n x n) [N m s] and the gravity torques (n) [N m] of eq. 2.17."""
    lagrangian = _lagrangian(finger, q, qd, g)
    mass = _hessian(lagrangian, qd)
    slope = [mass.applyfunc(lambda entry: lagrangian.derivation.partial(entry, angle)) for angle in q]
    n = range(len(q))
    coriolis = Matrix(len(q), len(q), lambda i, j: sympy.Add(
        *((slope[k][i, j] + slope[j][i, k] - slope[i][j, k]) * qd[k] / 2 for k in n)))
    return mass, coriolis, _gradient(lagrangian, q)


def inverse_dynamics(finger: Finger, q: Matrix, qd: Matrix, qdd: Matrix, g: Matrix) -> Matrix:
    """Joint torques (n) [N m] of a motion: d/dt (dL/dqd) - dL/dq, with L = T - V (eq. 2.16)."""
    lagrangian = _lagrangian(finger, q, qd, g)
    derive = lagrangian.derivation
    motion = dict(zip(q, qd)) | dict(zip(qd, qdd))
    momentum = [derive.partial(lagrangian.kinetic, rate) for rate in qd]
    return Matrix([derive.along(p, motion) - derive.partial(lagrangian.kinetic - lagrangian.potential, angle)
                   for p, angle in zip(momentum, q)])


def bias(finger: Finger, q: Matrix, qd: Matrix, g: Matrix) -> Matrix:
    """Joint torques (n) [N m] of a motion without acceleration: C qd + gravity."""
    return inverse_dynamics(finger, q, qd, sympy.zeros(len(q), 1), g)


def forward_dynamics(finger: Finger, q: Matrix, qd: Matrix, tau: Matrix, g: Matrix) -> Matrix:
    """Joint accelerations (n) [rad/s^2] that joint torques tau cause: M qdd = tau - bias, by Cramer's rule."""
    derivation = Derivation("f")
    mass = derivation.name_all(mass_matrix(finger, q))
    torque = derivation.name_all(tau - bias(finger, q, qd, g))
    cofactors = derivation.name_all(_cofactors(mass, derivation))
    determinant = derivation.name((mass.row(0) * cofactors.row(0).T)[0])
    return cofactors.T * torque / determinant


def _rates(q: Matrix) -> Matrix:
    return Matrix([sympy.Dummy(f"rate{i}", real=True) for i in range(len(q))])


def _lagrangian(finger: Finger, q: Matrix, qd: Matrix, g: Matrix) -> _Lagrangian:
    derivation = Derivation("l")
    motion = dict(zip(q, qd))
    kinetic = potential = sympy.S.Zero
    for link, frame in zip(finger.links, frames(finger, q, derivation)[1:-1]):
        centre = derivation.name_all(frame.point(Matrix(link.com)))
        velocity = Matrix([derivation.along(x, motion) for x in centre])
        turning = frame.axes.T * frame.axes.applyfunc(lambda entry: derivation.along(entry, motion))
        spin = derivation.name_all(Matrix(axial(turning)))
        kinetic += (link.mass * velocity.dot(velocity) + spin.dot(_tensor(link.inertia) * spin)) / 2
        potential -= link.mass * g.dot(centre)
    return _Lagrangian(kinetic, potential, derivation)


def _tensor(inertia: sympy.Basic) -> Matrix:
    """The inertia tensor (3 x 3) [kg m^2] about the centre of mass, in link axes."""
    return Matrix([[inertia.xx, inertia.xy, inertia.xz],
                   [inertia.xy, inertia.yy, inertia.yz],
                   [inertia.xz, inertia.yz, inertia.zz]])


def _hessian(lagrangian: _Lagrangian, qd: Matrix) -> Matrix:
    derive = lagrangian.derivation
    momentum = [derive.partial(lagrangian.kinetic, rate) for rate in qd]
    return Matrix(len(qd), len(qd), lambda i, j: derive.name(derive.partial(momentum[min(i, j)], qd[max(i, j)])))


def _gradient(lagrangian: _Lagrangian, q: Matrix) -> Matrix:
    return Matrix([lagrangian.derivation.partial(lagrangian.potential, angle) for angle in q])


def _cofactors(matrix: Matrix, derivation: Derivation) -> Matrix:
    """The cofactors (n x n) of a symmetric matrix; each minor is expanded along its first row, once."""
    known: dict[tuple[tuple[int, ...], tuple[int, ...]], Expr] = {}

    def minor(rows: tuple[int, ...], columns: tuple[int, ...]) -> Expr:
        if not rows:
            return sympy.S.One
        if (rows, columns) not in known:
            known[rows, columns] = derivation.name(sympy.Add(*(
                (-1) ** k * matrix[rows[0], column] * minor(rows[1:], columns[:k] + columns[k + 1:])
                for k, column in enumerate(columns))))
        return known[rows, columns]

    n = matrix.rows
    def without(i: int) -> tuple[int, ...]:
        return tuple(k for k in range(n) if k != i)

    return Matrix(n, n, lambda i, j: (-1) ** (i + j) * minor(without(min(i, j)), without(max(i, j))))
