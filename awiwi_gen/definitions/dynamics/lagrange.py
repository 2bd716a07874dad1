"""Dynamics of a finger by its definition: Lagrange's equation, from the two energies (eq. 2.16, 2.17, 5.4).

The kinetic energy is that of the links' centres of mass plus that of their rotation (inertia tensors about the
centres of mass) and of the rotors at the joints. The potential energy is that of gravity and of the joints' springs;
damping and friction enter by Rayleigh's dissipation function. g (3) is the acceleration of free fall [m/s^2] in the
finger's base axes.
"""

from dataclasses import dataclass
from typing import Any

import sympy
from sympy import Expr, Matrix

from awiwi_gen.definitions.joints import dissipation, rotor_energy, spring_energy
from awiwi_gen.definitions.kinematics import axial, frames
from awiwi_gen.definitions.naming import Derivation, jacobian
from awiwi_gen.definitions.symmetric_matrix import factors, solve_lower
from awiwi_gen.structure import Finger

_NO_GRAVITY = sympy.zeros(3, 1)


def energy(finger: Finger, q: Matrix, qd: Matrix, g: Matrix) -> tuple[Expr, Expr]:
    """Kinetic and potential energy [J] (eq. 5.4); the potential of a mass at the base frame's origin is zero."""
    lagrangian = _lagrangian(finger, q, qd, g)
    return lagrangian.kinetic, lagrangian.weight + lagrangian.elastic


def mass_matrix(finger: Finger, q: Matrix) -> Matrix:
    """M (n x n) [kg m^2]: Hessian of the kinetic energy with respect to the joint velocities."""
    return _lagrangian(finger, q, _velocities(q), _NO_GRAVITY).mass_matrix()


def coriolis_matrix(finger: Finger, q: Matrix, qd: Matrix) -> Matrix:
    """C (n x n) [N m s]: Christoffel symbols of the first kind of M, times the joint velocities (eq. 2.17)."""
    return dynamics(finger, q, qd, _NO_GRAVITY)[1]


def gravity(finger: Finger, q: Matrix, g: Matrix) -> Matrix:
    """Joint torques (n) [N m] that hold the finger's weight: gradient of its potential energy."""
    return _lagrangian(finger, q, _velocities(q), g).gravity()


def dynamics(finger: Finger, q: Matrix, qd: Matrix, g: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """M (n x n) [kg m^2], C (n x n) [N m s] and the gravity torques (n) [N m] of eq. 2.17."""
    lagrangian = _lagrangian(finger, q, qd, g)
    mass, n = lagrangian.mass_matrix(), len(q)
    slopes = [mass.applyfunc(lambda entry, angle=angle: lagrangian.derive.partial(entry, angle)) for angle in q]

    def christoffel(i: int, j: int) -> Expr:
        return sympy.Add(*((slopes[k][i, j] + slopes[j][i, k] - slopes[i][j, k]) / 2 * qd[k] for k in range(n)))

    return mass, Matrix(n, n, christoffel), lagrangian.gravity()


def dynamics_and_torque(
    finger: Finger, q: Matrix, qd: Matrix, qdd: Matrix, g: Matrix
) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """M, C and the gravity torques, and the torques of the inverse dynamics by Lagrange's equation."""
    return *dynamics(finger, q, qd, g), inverse_dynamics(finger, q, qd, qdd, g)


def inverse_dynamics(finger: Finger, q: Matrix, qd: Matrix, qdd: Matrix, g: Matrix) -> Matrix:
    """Joint torques (n) [N m] of a motion: d/dt (dL/dqd) - dL/dq + dD/dqd with L = T - V (eq. 2.16)."""
    return _lagrangian(finger, q, qd, g).torques(qdd)


def inverse_dynamics_derivatives(
    finger: Finger, q: Matrix, qd: Matrix, qdd: Matrix, g: Matrix
) -> tuple[Matrix, Matrix]:
    """Partial derivatives (n x n each) of the inverse dynamics by q [N m/rad] and by qd [N m s/rad]."""
    tau = inverse_dynamics(finger, q, qd, qdd, g)
    return jacobian(tau, q), jacobian(tau, qd)


def bias(finger: Finger, q: Matrix, qd: Matrix, g: Matrix) -> Matrix:
    """Joint torques (n) [N m] of a motion without acceleration: C qd + gravity + passive torques."""
    return _lagrangian(finger, q, qd, g).torques(sympy.zeros(len(q), 1))


def forward_dynamics(finger: Finger, q: Matrix, qd: Matrix, tau: Matrix, g: Matrix) -> Matrix:
    """Joint accelerations (n) [rad/s^2] that torques tau cause: M qdd = tau - bias (eq. 2.1), by M = L diag(d) L'."""
    lagrangian, last = _lagrangian(finger, q, qd, g), len(q) - 1
    derive = lagrangian.derive
    lower, pivots = factors(lagrangian.mass_matrix(), derive)
    free = solve_lower(lower, tau - lagrangian.torques(sympy.zeros(len(q), 1)), derive)
    scaled = Matrix([derive.name(each / pivot) for each, pivot in zip(free, pivots, strict=True)])
    # L' with its rows and columns in reverse order is a lower triangle, too.
    reverse = list(range(last, -1, -1))
    return solve_lower(lower.T.extract(reverse, reverse), scaled.extract(reverse, [0]), derive).extract(reverse, [0])


@dataclass(frozen=True)
class _Lagrangian:
    """A finger that moves with qd at q, and the derivation that its names belong to.

    Energies [J]: kinetic, of its weight, and elastic, of the joints' springs; dissipation is Rayleigh's function [W].
    """

    kinetic: Expr
    weight: Expr
    elastic: Expr
    dissipation: Expr
    q: Matrix
    qd: Matrix
    derive: Derivation

    def momenta(self) -> list[Expr]:
        """dT/dqd (n) [N m s]."""
        return [self.derive.partial(self.kinetic, velocity) for velocity in self.qd]

    def mass_matrix(self) -> Matrix:
        """The Hessian by qd (n x n), with named entries."""
        p, n = self.momenta(), len(self.qd)
        return Matrix(n, n, lambda i, j: self.derive.name(self.derive.partial(p[min(i, j)], self.qd[max(i, j)])))

    def gravity(self) -> Matrix:
        """The gradient of the weight's potential energy (n)."""
        return Matrix([self.derive.partial(self.weight, angle) for angle in self.q])

    def torques(self, qdd: Matrix) -> Matrix:
        """The left side of Lagrange's equation (n)."""
        motion = dict(zip(self.q, self.qd, strict=True)) | dict(zip(self.qd, qdd, strict=True))
        difference = self.kinetic - self.weight - self.elastic
        return Matrix(
            [
                self.derive.along(momentum, motion)
                - self.derive.partial(difference, angle)
                + self.derive.partial(self.dissipation, velocity)
                for momentum, angle, velocity in zip(self.momenta(), self.q, self.qd, strict=True)
            ]
        )


def _lagrangian(finger: Finger, q: Matrix, qd: Matrix, g: Matrix) -> _Lagrangian:
    derive = Derivation()
    motion = dict(zip(q, qd, strict=True))
    kinetic, weight = rotor_energy(finger, q, qd), sympy.S.Zero
    for link, frame in zip(finger.links, frames(finger, q, derive)[1:-1], strict=True):
        if link.mass is None:
            continue
        centre = derive.name_all(frame.point(Matrix(link.com)))
        velocity = centre.applyfunc(lambda x: derive.along(x, motion))
        skew = frame.axes.T * frame.axes.applyfunc(lambda x: derive.along(x, motion))
        spin = derive.name_all(Matrix(axial(skew)))
        kinetic += (link.mass * velocity.dot(velocity) + spin.dot(_tensor(link.inertia) * spin)) / 2
        weight -= link.mass * g.dot(centre)
    return _Lagrangian(kinetic, weight, spring_energy(finger, q), dissipation(finger, q, qd), q, qd, derive)


def _velocities(q: Matrix) -> Matrix:
    return Matrix([sympy.Dummy(f"qd{i}", real=True) for i in range(len(q))])


def _tensor(inertia: Any) -> Matrix:
    """The inertia tensor (3 x 3) [kg m^2] about the centre of mass, in link axes."""
    return Matrix(
        [
            [inertia.xx, inertia.xy, inertia.xz],
            [inertia.xy, inertia.yy, inertia.yz],
            [inertia.xz, inertia.yz, inertia.zz],
        ]
    )
