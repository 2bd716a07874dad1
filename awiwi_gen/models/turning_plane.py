"""Dynamics of a finger whose last joints are parallel and turn with one joint before them: a planar chain in a plane
that turns about an axis in it. Every usual finger is one (abduction, then flexions); so is a chain in a fixed plane.

Bodies have no mass but moments (`assembly`), so a place r from the turning axis enters only through first moments. In
the plane a vector is (rho, zeta): away from the turning axis, and so that a turn of the joints leads from rho to zeta.
All that the turning of the plane does to the chain is in M00 = integral of rho^2 dm and its derivatives by the absolute
angles, -2 kappa: the centrifugal torques of the chain and the Coriolis torque of the turn are these same numbers. The
rest is a planar chain, whose absolute angles need no sums of velocities.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
from casadi import SX

from awiwi_gen.models.assembly import Assembly, Joint

_Z = SX([0, 0, 1])


@dataclass(frozen=True)
class _Body:
    """A body of the chain: its place on the turning axis' side is `r` [m], its joint's.

    First moment (u, v) [kg m] and offset to the next joint (l, k) [m]; rr, rz: integrals of rho^2 and rho zeta about the
    joint, m, n: of w rho and w zeta with w along the joints' axes; `inertia` about the joint [kg m^2].
    """

    joint: Joint
    r: SX
    u: SX
    v: SX
    l: SX  # noqa: E741
    k: SX
    rr: SX
    rz: SX
    m: SX
    n: SX
    inertia: SX


@dataclass(frozen=True)
class Gravity:
    """The acceleration of free fall [m/s^2] in the plane, (rho, zeta), and along the joints' axes, w."""

    rho: SX
    zeta: SX
    w: SX


class TurningPlane:
    """A chain in a turning plane at one pose; methods take velocities and accelerations of the coordinates."""

    def __init__(self, assembly: Assembly) -> None:
        lead = assembly.joints[0] if assembly.joints[0].turn is not None else None
        chain = assembly.joints[1:] if lead else assembly.joints
        self.assembly, self.lead = assembly, lead
        # Without a turn of the plane any direction in it will do.
        self.axis = lead.axis if lead else SX([0, -1, 0])
        self.rho = ca.cross(_Z, self.axis)
        self.bodies: list[_Body] = []
        r = ca.dot(self.rho, lead.offset) if lead else SX(0)
        for joint in chain:
            body = self._body(joint, r)
            self.bodies.append(body)
            r = r + body.l
        self.first = [SX.zeros(2)]  # of all bodies from each joint on: Z[j], with Z[len] = 0
        for body in reversed(self.bodies):
            self.first.insert(0, self.first[0] + ca.vertcat(body.u, body.v))

    def _body(self, joint: Joint, r: SX) -> _Body:
        rho, zeta, first, second = self.rho, -self.axis, joint.body.first, joint.body.second
        return _Body(
            joint,
            r,
            u=ca.dot(rho, first),
            v=ca.dot(zeta, first),
            l=ca.dot(rho, joint.offset),
            k=ca.dot(zeta, joint.offset),
            rr=_form(rho, second, rho),
            rz=_form(rho, second, zeta),
            m=_form(rho, second, _Z),
            n=_form(zeta, second, _Z),
            inertia=joint.body.trace,
        )

    # -- what the turn of the plane sees --------------------------------------------------------------------

    def turning_inertia(self) -> SX:
        """M00 [kg m^2]: about the turning axis."""
        total = self.lead.body.trace - _form(self.axis, self.lead.body.second, self.axis)
        for body, (u, _) in zip(self.bodies, self._beyond(), strict=True):
            total += body.rr + 2 * body.l * u
        return total + 2 * self.bodies[0].r * self.first[0][0]

    def kappas(self) -> list[SX]:
        """-1/2 dM00/d(absolute angle) [kg m^2], for each joint of the chain."""
        return [
            body.r * body.v + body.rz + body.k * u for body, (u, _) in zip(self.bodies, self._beyond(), strict=True)
        ]

    def _beyond(self) -> list[tuple[SX, SX]]:
        """First moments of all bodies beyond each body."""
        return [(z[0], z[1]) for z in self.first[1:]]

    def gravity_in_plane(self, g: SX) -> Gravity:
        """Gravity g (3), given in base axes."""
        down = self.assembly.turn @ g
        down = self.lead.forth(down) if self.lead else down
        return Gravity(ca.dot(self.rho, down), -ca.dot(self.axis, down), down[2])

    def _turning_gravity(self, g: Gravity) -> SX:
        first = self.lead.body.first
        return first[2] * g.rho - g.w * (ca.dot(self.rho, first) + self.first[0][0])

    # -- quantities -----------------------------------------------------------------------------------------

    def mass(self) -> SX:
        """M of the joints (not yet of the coordinates), the turning one first [kg m^2]."""
        count, start = len(self.bodies), 1 if self.lead else 0
        mass = SX.zeros(count + start, count + start)
        for j in reversed(range(count)):
            body, own = self.bodies[j], j + start
            for k in range(j + 1, count):
                u, v = self.first[k][0], self.first[k][1]
                product = body.l * u + body.k * v
                mass[own, k + start] = mass[k + start, own] = mass[own + 1, k + start] + product
                if k == j + 1:
                    mass[own, own] = mass[own, own + 1] + product
            mass[own, own] += body.inertia
            if self.lead:
                mass[0, own] = mass[own, 0] = body.n + (mass[0, own + 1] if j + 1 < count else SX(0))
        if self.lead:
            mass[0, 0] = self.turning_inertia()
        return mass

    def coriolis(self, speeds: list[SX]) -> SX:
        """C of the joints by Christoffel symbols; `speeds` are the joints' own, the turning one first [N m s]."""
        count, start = len(self.bodies), 1 if self.lead else 0
        absolute = _running(speeds[start:])
        result = SX.zeros(count + start, count + start)
        for i in reversed(range(count)):
            body, areas = self.bodies[i], {}
            for j in range(i + 1, count):
                u, v = self.first[j][0], self.first[j][1]
                areas[j] = body.l * v - body.k * u
            moved = SX(0)
            for j in reversed(range(i + 1, count)):
                moved += (areas[j] - areas.get(j + 1, SX(0))) * absolute[j]
                result[i + start, j + start] = result[i + 1 + start, j + start] - moved
            if i + 1 < count:
                result[i + start, i + start] = result[i + start, i + 1 + start] + areas[i + 1] * absolute[i]
            for k in range(i + 1, count):
                result[k + start, i + start] = result[k + start, i + 1 + start] + areas[k] * absolute[i]
        if self.lead:
            turn, kappa, whirl = speeds[0], SX(0), SX(0)
            kappas = self.kappas()
            for j in reversed(range(count)):
                kappa, whirl = kappas[j] + kappa, self.bodies[j].m * absolute[j] + whirl
                result[j + 1, 0] = turn * kappa
                result[0, j + 1] = whirl - turn * kappa
                result[0, 0] -= speeds[j + 1] * kappa
        return result

    def gravity(self, g: SX) -> list[SX]:
        """Torques of the joints that hold the finger still [N m]."""
        down = self.gravity_in_plane(g)
        chain = [z[1] * down.rho - z[0] * down.zeta for z in self.first[:-1]]
        return [self._turning_gravity(down), *chain] if self.lead else chain

    def torques(self, speeds: list[SX], rates: list[SX], g: SX, absolute: bool = False) -> list[SX]:
        """Torques of the joints for their speeds [rad/s], rates of these [rad/s^2] and gravity g (3) [N m].

        With `absolute`, the torques that belong to the absolute angles: those of the bodies alone.
        """
        start = 1 if self.lead else 0
        spins, turnings = _running(speeds[start:]), _running(rates[start:])
        squares = [spin**2 for spin in spins]
        down, kappas = self.gravity_in_plane(g), self.kappas() if self.lead else []
        rho, zeta, own, forces = -down.rho, -down.zeta, [], []
        for j, body in enumerate(self.bodies):
            moment = body.u * zeta - body.v * rho + body.inertia * turnings[j]
            if self.lead:
                moment += speeds[0] ** 2 * kappas[j] + rates[0] * body.n
            own.append(moment)
            forces.append(_swung(body.u, body.v, turnings[j], squares[j]))
            step = _swung(body.l, body.k, turnings[j], squares[j])
            rho, zeta = rho + step[0], zeta + step[1]
        result, force = [SX(0)], (SX(0), SX(0))
        for body, moment, one in reversed(list(zip(self.bodies, own, forces, strict=True))):
            result.insert(0, moment + (SX(0) if absolute else result[0]) + body.l * force[1] - body.k * force[0])
            force = (force[0] + one[0], force[1] + one[1])
        result.pop()
        if self.lead:
            drift, turning = SX(0), self._turning_gravity(down)
            for body, kappa, spin, rate, square in zip(self.bodies, kappas, spins, turnings, squares, strict=True):
                drift += spin * kappa
                turning += rate * body.n + square * body.m
            turning += rates[0] * self.turning_inertia() - 2 * speeds[0] * drift
            result.insert(0, turning)
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


def _running(values: list[SX]) -> list[SX]:
    """Sums of the values up to each."""
    sums: list[Any] = []
    for value in values:
        sums.append(sums[-1] + value if sums else value)
    return sums


def _swung(rho: SX, zeta: SX, turning: SX, square: SX) -> tuple[SX, SX]:
    """Acceleration of a vector's end as it turns in the plane."""
    return -zeta * turning - rho * square, rho * turning - zeta * square
