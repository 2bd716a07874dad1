"""Dynamics of a finger whose last joints are parallel: a planar chain in a plane that rotates about an axis in it.

Every usual finger is such a chain: one abduction joint rotates the plane in which the flexion joints move. A chain in a
fixed plane is the same without the first joint.

The bodies have no mass, only moments (`assembly`), so the distance r from the axis of rotation enters only through
first moments. A vector in the plane is (rho, zeta): rho points away from the axis, and a positive rotation of the
joints leads from rho to zeta. The rotation of the plane acts on the chain only through M00 = integral of rho^2 dm and
its derivatives by the absolute angles, -2 kappa. The centrifugal torques of the chain and the Coriolis torque of the
plane share these numbers. The rest is a planar chain, whose absolute angles need no sums of velocities.
"""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.dynamics.assembly import Assembly, Joint

_Z = SX([0, 0, 1])


Vector = tuple[SX, SX]


@dataclass(frozen=True)
class _Body:
    """A body of the chain and its joint, which lies at the distance `r` [m] from the plane's axis of rotation.

    In the body's own axes: `arm` [m] to the next joint, `first` moment [kg m], `second` moments (xx, xy, yy) [kg m^2]
    and, with w along the joints' axes, the `mixed` moments (xw, yw) [kg m^2]. `cos_sin` are the cosine and the sine of
    the body's absolute angle in the plane.
    """

    r: SX
    cos_sin: Vector
    arm: Vector
    first: Vector
    second: tuple[SX, SX, SX]
    mixed: Vector

    def in_plane(self, vector: Vector) -> Vector:
        """A vector given in the body's own axes, in the plane's."""
        return _product(vector, self.cos_sin)

    @property
    def difference(self) -> SX:
        """D = (xx - yy) cos - 2 xy sin [kg m^2]: D cos and D sin are the integrals of rho^2 and rho zeta, but for
        constants."""
        xx, xy, yy = self.second
        return (xx - yy) * self.cos_sin[0] - 2 * xy * self.cos_sin[1]

    @property
    def inertia(self) -> SX:
        """Moment of inertia about the joint [kg m^2]."""
        return self.second[0] + self.second[2]

    def second_derivatives(self, spin: SX, acceleration: SX) -> list[Vector]:
        """Second time derivatives of arm, first and mixed moments, in the plane, by one rotation for all three."""
        if acceleration.is_zero():
            return self.separate_second_derivatives(spin, acceleration)
        rotation = _product((-(spin**2), acceleration), self.cos_sin)
        return [_product(vector, rotation) for vector in (self.arm, self.first, self.mixed)]

    def separate_second_derivatives(self, spin: SX, acceleration: SX) -> list[Vector]:
        """The same by a rotation for each vector: more operations, but shorter derivatives by the angle."""
        factor = (-(spin**2), acceleration)
        return [_product(factor, self.in_plane(vector)) for vector in (self.arm, self.first, self.mixed)]


class RotatingPlane:
    """A planar chain in a rotating plane at one pose.

    Arrays over the joints begin with the joint that rotates the plane, if there is one. Joint velocities are relative;
    absolute ones, called spins here, are those of the bodies in the plane.
    """

    def __init__(self, assembly: Assembly) -> None:
        plane_joint = assembly.joints[0] if assembly.joints[0].next_rotation is not None else None
        self.assembly, self.plane_joint, self.start = assembly, plane_joint, 1 if plane_joint else 0
        # Any axis in a plane that does not rotate will do.
        self.axis = plane_joint.axis if plane_joint else SX([0, -1, 0])
        self.rho = ca.cross(_Z, self.axis)
        self.bodies: list[_Body] = []
        r = ca.dot(self.rho, plane_joint.offset) if plane_joint else SX(0)
        for joint in assembly.joints[self.start :]:
            self.bodies.append(self._body(joint, r))
            r = r + self.bodies[-1].in_plane(self.bodies[-1].arm)[0]
        self.arms = [body.in_plane(body.arm) for body in self.bodies]
        self.firsts = [body.in_plane(body.first) for body in self.bodies]
        self.firsts_beyond = [(SX(0), SX(0))]  # of all bodies from each joint on; the last entry is that of none
        for first in reversed(self.firsts):
            self.firsts_beyond.insert(0, _sum(self.firsts_beyond[0], first))

    def _body(self, joint: Joint, r: SX) -> _Body:
        rho, zeta, first, second = self.rho, -self.axis, joint.link_body.first, joint.link_body.second
        return _Body(
            r,
            cos_sin=joint.cos_sin,
            arm=(ca.dot(rho, joint.link_offset), ca.dot(zeta, joint.link_offset)),
            first=(ca.dot(rho, first), ca.dot(zeta, first)),
            second=(_form(rho, second, rho), _form(rho, second, zeta), _form(zeta, second, zeta)),
            mixed=(_form(rho, second, _Z), _form(zeta, second, _Z)),
        )

    # -- what the rotation of the plane acts on -------------------------------------------------------------

    def plane_inertia(self) -> SX:
        """M00 [kg m^2]: moment of inertia about the plane's axis of rotation."""
        if self.plane_joint is None:
            return SX(0)
        total = self.plane_joint.body.trace - _form(self.axis, self.plane_joint.body.second, self.axis)
        for body, (u, _) in zip(self.bodies, self.firsts_beyond[1:], strict=True):
            (c, s), (along, across) = body.cos_sin, body.arm
            total += body.second[2] + c * (body.difference + along * u + along * u) - 2 * across * (s * u)
        return total + 2 * self.bodies[0].r * self.firsts_beyond[0][0]

    def kappas(self) -> list[SX]:
        """-1/2 dM00/d(absolute angle) [kg m^2] of each body."""
        kappas = []
        for body, first, (u, _) in zip(self.bodies, self.firsts, self.firsts_beyond[1:], strict=True):
            (c, s), (along, across) = body.cos_sin, body.arm
            kappas.append(body.r * first[1] + body.second[1] + s * (body.difference + along * u) + across * (c * u))
        return kappas

    def _gravity(self, g: SX) -> tuple[Vector, SX]:
        """Gravity g (3), given in base axes: its part in the plane, and its part along the joints' axes."""
        down = self.assembly.base_rotation @ g
        down = self.plane_joint.outward(down) if self.plane_joint else down
        return (ca.dot(self.rho, down), -ca.dot(self.axis, down)), down[2]

    def _plane_weight(self, down: Vector, along: SX) -> SX:
        if self.plane_joint is None:
            return SX(0)
        first = self.plane_joint.body.first
        return first[2] * down[0] - along * (ca.dot(self.rho, first) + self.firsts_beyond[0][0])

    # -- mass matrix and Coriolis matrix --------------------------------------------------------------------

    def mass(self) -> SX:
        """M of the joints [kg m^2]."""
        return self._mass([_from_tip([_dot(arm, h) for h in self.firsts[j + 1 :]]) for j, arm in enumerate(self.arms)])

    def mass_beside_coriolis(self) -> SX:
        """The same M from the sums of first moments that `coriolis` needs as well."""
        return self._mass([[_dot(arm, h) for h in self.firsts_beyond[j + 1 : -1]] for j, arm in enumerate(self.arms)])

    def _mass(self, products: list[list[SX]]) -> SX:
        """M from the products of each arm with the first moments of all bodies from each later joint on."""
        count, start = len(self.bodies), self.start
        mass = SX.zeros(count + start, count + start)
        for j in reversed(range(start, count + start)):
            body = self.bodies[j - start]
            for k in reversed(range(j + 1, count + start)):
                mass[j, k] = mass[k, j] = mass[j + 1, k] + products[j - start][k - j - 1]
            if j + 1 < count + start:
                mass[j, j] = mass[j, j + 1] + products[j - start][0]
            mass[j, j] += body.inertia
            if self.plane_joint:
                beyond = mass[0, j + 1] if j < count else SX(0)
                mass[0, j] = mass[j, 0] = body.in_plane(body.mixed)[1] + beyond
        if self.plane_joint:
            mass[0, 0] = self.plane_inertia()
        return mass

    def absolute_mass(self) -> SX:
        """M [kg m^2] for absolute angles; the moment of inertia of each body is constant."""
        start = self.start
        mass = ca.diagcat(SX(start, start), *(body.inertia for body in self.bodies))
        for j, body in enumerate(self.bodies):
            for k in range(j + 1, len(self.bodies)):
                mass[j + start, k + start] = mass[k + start, j + start] = _dot(self.arms[j], self.firsts[k])
            if self.plane_joint:
                mass[0, j + 1] = mass[j + 1, 0] = body.in_plane(body.mixed)[1]
        if self.plane_joint:
            mass[0, 0] = self.plane_inertia()
        return mass

    def coriolis(self, speeds: list[SX]) -> SX:
        """C of the joints by Christoffel symbols [N m s]."""
        count, start = len(self.bodies), self.start
        spins = _from_base(speeds[start:])
        result = SX.zeros(count + start, count + start)
        for i in reversed(range(count)):
            areas = {j: _cross(self.arms[i], self.firsts_beyond[j]) for j in range(i + 1, count)}
            total = SX(0)
            for j in reversed(areas):
                total += (areas[j] - areas.get(j + 1, SX(0))) * spins[j]
                result[i + start, j + start] = result[i + 1 + start, j + start] - total
            if i + 1 < count:
                result[i + start, i + start] = result[i + start, i + 1 + start] + areas[i + 1] * spins[i]
            for j in areas:
                result[j + start, i + start] = result[j + start, i + 1 + start] + areas[j] * spins[i]
        if self.plane_joint:
            kappas, kappa, mixed_rate = self.kappas(), SX(0), SX(0)
            for j in reversed(range(count)):
                body = self.bodies[j]
                kappa, mixed_rate = kappas[j] + kappa, body.in_plane(body.mixed)[0] * spins[j] + mixed_rate
                result[j + 1, 0] = speeds[0] * kappa
                result[0, j + 1] = mixed_rate - speeds[0] * kappa
                result[0, 0] -= speeds[j + 1] * kappa
        return result

    # -- energy and torques ---------------------------------------------------------------------------------

    def kinetic_energy(self, speeds: list[SX]) -> SX:
        """Kinetic energy [J]: that of each body about its joint, and its momentum there times the joint's velocity."""
        spins, velocity, total = _from_base(speeds[self.start :]), (SX(0), SX(0)), SX(0)
        for body, arm, first, spin in zip(self.bodies, self.arms, self.firsts, spins, strict=True):
            total += spin * (_dot(first, velocity) + body.inertia / 2 * spin)
            velocity = velocity[0] + spin * arm[0], velocity[1] + spin * arm[1]
        if self.plane_joint:
            mixed = sum((b.in_plane(b.mixed)[1] * spin for b, spin in zip(self.bodies, spins, strict=True)), SX(0))
            total += speeds[0] * (mixed + speeds[0] * (self.plane_inertia() / 2))
        return total

    def gravity(self, g: SX) -> list[SX]:
        """Torques of the joints [N m] that hold the finger at rest in gravity g (3) [m/s^2]."""
        down, along = self._gravity(g)
        chain = [-_cross(first, down) for first in self.firsts_beyond[:-1]]
        return [self._plane_weight(down, along), *chain] if self.plane_joint else chain

    def torques(self, speeds: list[SX], accelerations: list[SX], g: SX) -> list[SX]:
        """Torques of the joints [N m] for velocities [rad/s], accelerations [rad/s^2] and gravity g (3) [m/s^2]."""
        if all(acceleration.is_zero() for acceleration in accelerations):
            return self._of_joints(self.absolute_bias(speeds, g))
        return self._of_joints(self._absolute_torques(speeds, accelerations, g, _Body.second_derivatives))

    def torques_to_differentiate(self, speeds: list[SX], accelerations: list[SX], g: SX) -> list[SX]:
        """The same torques in a form that is longer, but has shorter derivatives."""
        return self._of_joints(self._absolute_torques(speeds, accelerations, g, _Body.separate_second_derivatives))

    def absolute_bias(self, speeds: list[SX], g: SX) -> list[SX]:
        """Torques [N m] without accelerations that belong to the absolute angles."""
        count, squares = len(self.bodies), [spin**2 for spin in _from_base(speeds[self.start :])]
        down, _ = self._gravity(g)
        acceleration, force, torques, mixed = (-down[0], -down[1]), (SX(0), SX(0)), [], SX(0)
        # The last two bodies act on each other through the area of one arm and one moment: computed once, at the end.
        passed_on = [j != count - 2 for j in range(count)]
        for j, body in enumerate(self.bodies):
            torques.append(_cross(self.firsts[j], acceleration))
            if passed_on[j]:
                acceleration = _sum(acceleration, _scaled(-squares[j], self.arms[j]))
            mixed += squares[j] * body.in_plane(body.mixed)[0]
        for j in reversed(range(count)):
            if passed_on[j]:
                torques[j] += _cross(self.arms[j], force)
            force = _sum(_scaled(-squares[j], self.firsts[j]), force)
        if count > 1:
            area = _cross(self.arms[-2], self.firsts[-1])
            torques[-1] += squares[-2] * area
            torques[-2] -= squares[-1] * area
        return self._with_plane(torques, mixed, speeds, g)

    def _absolute_torques(
        self,
        speeds: list[SX],
        accelerations: list[SX],
        g: SX,
        second_derivatives: Callable[[_Body, SX, SX], list[Vector]],
    ) -> list[SX]:
        """Torques [N m] that belong to the absolute angles: accelerations from base to tip, forces from tip to base."""
        spins, rates = _from_base(speeds[self.start :]), _from_base(accelerations[self.start :])
        down, _ = self._gravity(g)
        acceleration, force, torques = (-down[0], -down[1]), (SX(0), SX(0)), []
        steps = [second_derivatives(*one) for one in zip(self.bodies, spins, rates, strict=True)]
        for body, first, rate, (arm_dd, _, _) in zip(self.bodies, self.firsts, rates, steps, strict=True):
            torques.append(_cross(first, acceleration) + body.inertia * rate)
            acceleration = _sum(acceleration, arm_dd)
        for j in reversed(range(len(self.bodies))):
            torques[j] += _cross(self.arms[j], force)
            force = _sum(steps[j][1], force)
        mixed = -sum((mixed_dd[0] for _, _, mixed_dd in steps), SX(0))
        if self.plane_joint:
            mixed += accelerations[0] * self.plane_inertia()
            torques = [
                torque + accelerations[0] * body.in_plane(body.mixed)[1]
                for torque, body in zip(torques, self.bodies, strict=True)
            ]
        return self._with_plane(torques, mixed, speeds, g)

    def _with_plane(self, chain: list[SX], plane: SX, speeds: list[SX], g: SX) -> list[SX]:
        """Torques of the plane and of the chain, with those of the plane's rotation and of its weight added."""
        if self.plane_joint is None:
            return chain
        kappas = self.kappas()
        drift = sum((s * kappa for s, kappa in zip(_from_base(speeds[1:]), kappas, strict=True)), SX(0))
        plane = plane - 2 * speeds[0] * drift + self._plane_weight(*self._gravity(g))
        return [plane, *(torque + speeds[0] ** 2 * kappa for torque, kappa in zip(chain, kappas, strict=True))]

    def _of_joints(self, absolute: list[SX]) -> list[SX]:
        """Torques of the joints: each carries what belongs to the absolute angles of all bodies beyond it."""
        return [*absolute[: self.start], *_from_tip(absolute[self.start :])]


def rotating_plane(assembly: Assembly) -> RotatingPlane | None:
    """The assembly as a chain in a rotating plane, or None if it is not such a chain."""
    first, *others = assembly.joints
    if any(joint.next_rotation is not None for joint in others) or any(joint.slides for joint in assembly.joints):
        return None
    if first.next_rotation is not None and not first.axis[2].is_zero():
        return None
    return RotatingPlane(assembly)


def _form(a: SX, matrix: SX, b: SX) -> SX:
    return ca.dot(a, matrix @ b)


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1]


def _scaled(factor: SX, vector: Vector) -> Vector:
    return factor * vector[0], factor * vector[1]


def _dot(a: Vector, b: Vector) -> SX:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Vector, b: Vector) -> SX:
    return a[0] * b[1] - a[1] * b[0]


def _product(a: Vector, b: Vector) -> Vector:
    """The product of complex numbers: a rotated by the angle of b and scaled by its length."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _from_base(values: list[SX]) -> list[SX]:
    """Sums of the values from the first up to each."""
    sums: list[SX] = []
    for value in values:
        sums.append(sums[-1] + value if sums else value)
    return sums


def _from_tip(values: list[SX]) -> list[SX]:
    """Sums of the values from each up to the last."""
    return _from_base(values[::-1])[::-1]
