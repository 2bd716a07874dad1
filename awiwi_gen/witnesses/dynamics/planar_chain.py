"""Dynamics of a finger whose last joints are parallel and turn with one joint before them: a planar chain in a plane
that turns about an axis in it. Every usual finger is one (abduction, then flexions); so is a chain in a fixed plane.

Bodies have no mass but moments (`assembly`), so a place r from the turning axis enters only through first moments. In
the plane a vector is (rho, zeta): away from the turning axis, and so that a turn of the joints leads from rho to zeta.
All that the turning of the plane does to the chain is in M00 = integral of rho^2 dm and its derivatives by the absolute
angles, -2 kappa: the centrifugal torques of the chain and the Coriolis torque of the turn are these same numbers. The
rest is a planar chain, whose absolute angles need no sums of velocities.
"""

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from awiwi_gen.witnesses.dynamics.assembly import Assembly, Joint

_Z = SX([0, 0, 1])


Vector = tuple[SX, SX]


@dataclass(frozen=True)
class _Body:
    """A body of the chain and its joint, whose distance from the turning axis is `r` [m].

    In its own axes: `arm` [m] to the next joint, `first` moment [kg m], second moments (xx, xy, yy) and, with w along
    the joints' axes, (xw, yw) [kg m^2]. These axes stand at the angle with cosine and sine `spin` in the plane.
    """

    r: SX
    spin: Vector
    arm: Vector
    first: Vector
    second: tuple[SX, SX, SX]
    along: Vector

    def turned(self, vector: Vector) -> Vector:
        """A vector given in the body's own axes, in the plane."""
        return _product(vector, self.spin)

    @property
    def slope(self) -> SX:
        """c times it is the integral of rho^2, s times it that of rho zeta, but for constants."""
        xx, xy, yy = self.second
        return (xx - yy) * self.spin[0] - 2 * xy * self.spin[1]

    @property
    def inertia(self) -> SX:
        """About the joint."""
        return self.second[0] + self.second[2]


class TurningPlane:
    """A chain in a turning plane at one pose. Joints have speeds of their own, the turning one's first."""

    def __init__(self, assembly: Assembly) -> None:
        lead = assembly.joints[0] if assembly.joints[0].turn is not None else None
        self.assembly, self.lead, self.start = assembly, lead, 1 if lead else 0
        # Without a turn of the plane any direction in it will do.
        self.axis = lead.axis if lead else SX([0, -1, 0])
        self.rho = ca.cross(_Z, self.axis)
        self.bodies: list[_Body] = []
        r = ca.dot(self.rho, lead.offset) if lead else SX(0)
        for joint in assembly.joints[self.start :]:
            self.bodies.append(self._body(joint, r))
            r = r + self.bodies[-1].turned(self.bodies[-1].arm)[0]
        self.arms = [body.turned(body.arm) for body in self.bodies]
        self.own = [body.turned(body.first) for body in self.bodies]
        self.first = [(SX(0), SX(0))]  # first moments of all bodies from each joint on, and of none
        for moment in reversed(self.own):
            self.first.insert(0, _sum(self.first[0], moment))

    def _body(self, joint: Joint, r: SX) -> _Body:
        rho, zeta, first, second = self.rho, -self.axis, joint.own_body.first, joint.own_body.second
        return _Body(
            r,
            spin=joint.spin,
            arm=(ca.dot(rho, joint.own_offset), ca.dot(zeta, joint.own_offset)),
            first=(ca.dot(rho, first), ca.dot(zeta, first)),
            second=(_form(rho, second, rho), _form(rho, second, zeta), _form(zeta, second, zeta)),
            along=(_form(rho, second, _Z), _form(zeta, second, _Z)),
        )

    # -- what the turn of the plane sees --------------------------------------------------------------------

    def turning_inertia(self) -> SX:
        """M00 [kg m^2]: about the turning axis."""
        if self.lead is None:
            return SX(0)
        total = self.lead.body.trace - _form(self.axis, self.lead.body.second, self.axis)
        for body, (u, _) in zip(self.bodies, self.first[1:], strict=True):
            (c, s), (along, across) = body.spin, body.arm
            total += body.second[2] + c * (body.slope + along * u + along * u) - 2 * across * (s * u)
        return total + 2 * self.bodies[0].r * self.first[0][0]

    def kappas(self) -> list[SX]:
        """-1/2 dM00/d(absolute angle) [kg m^2], for each joint of the chain."""
        kappas = []
        for body, own, (u, _) in zip(self.bodies, self.own, self.first[1:], strict=True):
            (c, s), (along, across) = body.spin, body.arm
            kappas.append(body.r * own[1] + body.second[1] + s * (body.slope + along * u) + across * (c * u))
        return kappas

    def _gravity(self, g: SX) -> tuple[Vector, SX]:
        """Gravity g (3), given in base axes: in the plane, and along the joints' axes."""
        down = self.assembly.turn @ g
        down = self.lead.forth(down) if self.lead else down
        return (ca.dot(self.rho, down), -ca.dot(self.axis, down)), down[2]

    def _turning_weight(self, down: Vector, along: SX) -> SX:
        if self.lead is None:
            return SX(0)
        first = self.lead.body.first
        return first[2] * down[0] - along * (ca.dot(self.rho, first) + self.first[0][0])

    # -- quantities -----------------------------------------------------------------------------------------

    def mass(self, alone: bool) -> SX:
        """M of the joints [kg m^2]; unless it is computed alone, from the sums of first moments others need as well."""
        count, start = len(self.bodies), self.start
        mass = SX.zeros(count + start, count + start)
        for j in reversed(range(count)):
            body, own, product = self.bodies[j], j + start, SX(0)
            for k in reversed(range(j + 1, count)):
                product = _dot(self.arms[j], self.own[k]) + product if alone else _dot(self.arms[j], self.first[k])
                mass[own, k + start] = mass[k + start, own] = mass[own + 1, k + start] + product
                if k == j + 1:
                    mass[own, own] = mass[own, own + 1] + product
            mass[own, own] += body.inertia
            if self.lead:
                beyond = mass[0, own + 1] if j + 1 < count else SX(0)
                mass[0, own] = mass[own, 0] = body.turned(body.along)[1] + beyond
        if self.lead:
            mass[0, 0] = self.turning_inertia()
        return mass

    def absolute_mass(self) -> SX:
        """M of the absolute angles, the turning one first: that of each body is constant [kg m^2]."""
        start = self.start
        mass = ca.diagcat(SX(start, start), *(body.inertia for body in self.bodies))
        for j, body in enumerate(self.bodies):
            for k in range(j + 1, len(self.bodies)):
                mass[j + start, k + start] = mass[k + start, j + start] = _dot(self.arms[j], self.own[k])
            if self.lead:
                mass[0, j + 1] = mass[j + 1, 0] = body.turned(body.along)[1]
        if self.lead:
            mass[0, 0] = self.turning_inertia()
        return mass

    def coriolis(self, speeds: list[SX]) -> SX:
        """C of the joints by Christoffel symbols [N m s]."""
        count, start = len(self.bodies), self.start
        spins = _running(speeds[start:])
        result = SX.zeros(count + start, count + start)
        for i in reversed(range(count)):
            areas = {j: _cross(self.arms[i], self.first[j]) for j in range(i + 1, count)}
            moved = SX(0)
            for j in reversed(areas):
                moved += (areas[j] - areas.get(j + 1, SX(0))) * spins[j]
                result[i + start, j + start] = result[i + 1 + start, j + start] - moved
            if i + 1 < count:
                result[i + start, i + start] = result[i + start, i + 1 + start] + areas[i + 1] * spins[i]
            for j in areas:
                result[j + start, i + start] = result[j + start, i + 1 + start] + areas[j] * spins[i]
        if self.lead:
            kappas, kappa, whirl = self.kappas(), SX(0), SX(0)
            for j in reversed(range(count)):
                body = self.bodies[j]
                kappa, whirl = kappas[j] + kappa, body.turned(body.along)[0] * spins[j] + whirl
                result[j + 1, 0] = speeds[0] * kappa
                result[0, j + 1] = whirl - speeds[0] * kappa
                result[0, 0] -= speeds[j + 1] * kappa
        return result

    def kinetic_energy(self, speeds: list[SX]) -> SX:
        """Of the moving finger [J]: of each body about its joint, and its momentum there with the joint's velocity."""
        spins, velocity, total = _running(speeds[self.start :]), (SX(0), SX(0)), SX(0)
        for body, arm, own, spin in zip(self.bodies, self.arms, self.own, spins, strict=True):
            total += spin * (_dot(own, velocity) + body.inertia / 2 * spin)
            velocity = velocity[0] + spin * arm[0], velocity[1] + spin * arm[1]
        if self.lead:
            along = sum((b.turned(b.along)[1] * spin for b, spin in zip(self.bodies, spins, strict=True)), SX(0))
            total += speeds[0] * (along + speeds[0] * (self.turning_inertia() / 2))
        return total

    def gravity(self, g: SX) -> list[SX]:
        """Torques of the joints that hold the finger still in gravity g (3) [N m]."""
        down, along = self._gravity(g)
        chain = [-_cross(first, down) for first in self.first[:-1]]
        return [self._turning_weight(down, along), *chain] if self.lead else chain

    def torques(self, speeds: list[SX], rates: list[SX], g: SX, absolute: bool = False, once: bool = True) -> list[SX]:
        """Torques of the joints for their speeds [rad/s], rates of these [rad/s^2] and gravity g (3) [N m].

        With `absolute`, those that belong to the absolute angles, of the bodies alone. A body's motion is turned `once`
        for all its vectors, or each of these by itself, which is longer but has shorter derivatives.
        """
        spins, turnings = _running(speeds[self.start :]), _running(rates[self.start :])
        down, along = self._gravity(g)
        kappas = self.kappas() if self.lead else []
        acceleration, torques, forces, swing = (-down[0], -down[1]), [], [], SX(0)
        # Without rates the last two bodies pull each other along one line, which is shorter than to pass it on.
        pair = len(self.bodies) - 2 if all(rate.is_zero() for rate in turnings) else -1
        for j, body in enumerate(self.bodies):
            torque = _cross(self.own[j], acceleration) + body.inertia * turnings[j]
            if self.lead:
                torque += speeds[0] ** 2 * kappas[j] + rates[0] * body.turned(body.along)[1]
            torques.append(torque)
            gradient = (-(spins[j] ** 2), turnings[j])  # takes a vector of the body to its second derivative
            if once and not turnings[j].is_zero():
                steps = [_product(one, _product(gradient, body.spin)) for one in (body.arm, body.first, body.along)]
            else:
                steps = [_product(gradient, body.turned(one)) for one in (body.arm, body.first, body.along)]
            if j != pair:
                acceleration = _sum(acceleration, steps[0])
            forces.append(steps[1])
            swing -= steps[2][0]
        if pair >= 0:
            area = _cross(self.arms[pair], self.own[-1])
            torques[-1] += spins[-2] ** 2 * area
            torques[-2] -= spins[-1] ** 2 * area
        result, force = [SX(0)], (SX(0), SX(0))
        for j in reversed(range(len(self.bodies))):
            carried = _cross(self.arms[j], force) if j != pair else SX(0)
            result.insert(0, torques[j] + (SX(0) if absolute else result[0]) + carried)
            force = _sum(forces[j], force)
        result.pop()
        if self.lead:
            drift = sum((spin * kappa for spin, kappa in zip(spins, kappas, strict=True)), SX(0))
            turned = rates[0] * self.turning_inertia() - 2 * speeds[0] * drift
            result.insert(0, turned + swing + self._turning_weight(down, along))
        return result


def turning_plane(assembly: Assembly) -> TurningPlane | None:
    """The assembly as a chain in a turning plane, or None if it is none."""
    first, *others = assembly.joints
    if any(joint.turn is not None for joint in others):
        return None
    if first.turn is not None and not first.axis[2].is_zero():
        return None
    return TurningPlane(assembly)


def _form(a: SX, matrix: SX, b: SX) -> SX:
    return ca.dot(a, matrix @ b)


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1]


def _dot(a: Vector, b: Vector) -> SX:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Vector, b: Vector) -> SX:
    return a[0] * b[1] - a[1] * b[0]


def _product(a: Vector, b: Vector) -> Vector:
    """As complex numbers."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _running(values: list[SX]) -> list[SX]:
    """Sums of the values up to each."""
    sums: list[SX] = []
    for value in values:
        sums.append(sums[-1] + value if sums else value)
    return sums
