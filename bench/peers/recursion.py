"""The finger by the textbook's recursions, over any kind of scalar: what the symbolic peers are given.

Newton and Euler for torques, composite bodies for the mass matrix and the Coriolis matrix of Christoffel symbols,
all in link axes, with the links' numbers folded beforehand (first moment h = m c, inertia about the joint). Vectors and
matrices are lists; a zero or a one is an int, so that every tool drops it. These are the routes that gave the peers
their best counts; Lagrange's equations written out cost them four to seven times as much.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Scalar = Any
Vector = list[Scalar]
Table = list[list[Scalar]]


@dataclass(frozen=True)
class Algebra:
    """What a tool brings: cosine, sine, partial derivatives of a list where it has them, names for subexpressions."""

    cos: Callable[[Scalar], Scalar]
    sin: Callable[[Scalar], Scalar]
    partial: Callable[[Vector, Scalar], Vector] | None = None
    name: Callable[[Scalar], Scalar] = lambda x: x


@dataclass
class Link:
    """A link's numbers: fixed turn (3 x 3), offset to the next joint, mass, first moment, inertia about its joint."""

    turn: Table
    offset: Vector
    mass: float
    first: Vector
    inertia: Table
    cosine: Scalar
    sine: Scalar
    name: Callable[[Scalar], Scalar]

    @property
    def second(self) -> Table:
        """Integral of r r' dm, from the inertia."""
        half = sum(self.inertia[i][i] for i in range(3)) / 2
        return [[(half if i == j else 0) - self.inertia[i][j] for j in range(3)] for i in range(3)]

    def named(self, v: Vector) -> Vector:
        """A vector by names, for tools that keep expressions as trees."""
        return [self.name(x) for x in v]

    def forth(self, v: Vector) -> Vector:
        """Axes of the link before into these."""
        x, y, z = product(transposed(self.turn), v)
        return self.named([self.cosine * x + self.sine * y, self.cosine * y - self.sine * x, z])

    def back(self, v: Vector) -> Vector:
        """These axes into those of the link before."""
        x, y, z = v
        turned = self.named([self.cosine * x - self.sine * y, self.sine * x + self.cosine * y, z])
        return product(self.turn, turned)

    def back_symmetric(self, a: Table) -> Table:
        """A symmetric matrix in the axes of the link before."""
        c, s = self.cosine, self.sine
        cc, ss, cs = c * c, s * s, c * s
        xx = self.name(cc * a[0][0] - 2 * (cs * a[0][1]) + ss * a[1][1])
        xy = self.name(cs * (a[0][0] - a[1][1]) + (cc - ss) * a[0][1])
        xz, yz, _ = self.named([c * a[0][2] - s * a[1][2], s * a[0][2] + c * a[1][2], 0])
        turned = [[xx, xy, xz], [xy, a[0][0] + a[1][1] - xx, yz], [xz, yz, a[2][2]]]
        return matmul(matmul(self.turn, turned), transposed(self.turn))

    def back_matrix(self, a: Table) -> Table:
        """Any matrix in the axes of the link before."""
        rows = transposed([self.back(column) for column in transposed(a)])
        return [self.back(row) for row in rows]


def links_of(finger: dict[str, Any], q: Vector, algebra: Algebra) -> list[Link]:
    """The links of a finger (see `bench/hands.py`) at joint angles q."""
    made = []
    for link, angle in zip(finger["links"], q, strict=True):
        mass, com = link["mass"], link["com"]
        square = sum(x * x for x in com)
        inertia = [
            [plain(link["inertia"][i][j] + mass * ((square if i == j else 0.0) - com[i] * com[j])) for j in range(3)]
            for i in range(3)
        ]
        first, offset = [plain(mass * x) for x in com], [plain(x) for x in link["offset"]]
        turned = (algebra.name(algebra.cos(angle)), algebra.name(algebra.sin(angle)))
        made.append(Link(link["turn"], offset, mass, first, inertia, *turned, algebra.name))
    return made


def plain(x: float) -> float | int:
    """Exact 0 and 1 as ints."""
    return int(x) if x in (0.0, 1.0, -1.0) else x


def dot(a: Vector, b: Vector) -> Scalar:
    """Inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def plus(*vectors: Vector) -> Vector:
    """Sum of vectors."""
    return [sum(xs[1:], xs[0]) for xs in zip(*vectors, strict=True)]


def transposed(a: Table) -> Table:
    """Rows as columns."""
    return [list(row) for row in zip(*a, strict=True)]


def product(a: Table, v: Vector) -> Vector:
    """Matrix times vector."""
    return [dot(row, v) for row in a]


def matmul(a: Table, b: Table) -> Table:
    """Matrix times matrix."""
    return transposed([product(a, column) for column in transposed(b)])


def added(*tables: Table) -> Table:
    """Sum of matrices."""
    return [plus(*rows) for rows in zip(*tables, strict=True)]


def outer(a: Vector, b: Vector) -> Table:
    """a b'."""
    return [[x * y for y in b] for x in a]


def gradient(w: Vector, wd: Vector) -> Table:
    """[wd] + [w][w]: takes a point of a turning body to its acceleration."""
    x, y, z = w
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return [
        [-(yy + zz), xy - wd[2], xz + wd[1]],
        [xy + wd[2], -(xx + zz), yz - wd[0]],
        [xz - wd[1], yz + wd[0], -(xx + yy)],
    ]


def torques(links: list[Link], qd: Vector, qdd: Vector, g: Vector) -> Vector:
    """Joint torques by Newton and Euler, the base accelerated by -g."""
    w, wd, a = [0, 0, 0], [0, 0, 0], [-x for x in g]
    loads, motion, offset = [], None, None
    for link, rate, acceleration in zip(links, qd, qdd, strict=True):
        if motion is not None:
            a = plus(a, product(motion, offset))
        a, carried = link.forth(a), link.forth(w)
        wd = plus(link.forth(wd), [carried[1] * rate, -carried[0] * rate, acceleration])
        w, wd = link.named(plus(carried, [0, 0, rate])), link.named(wd)
        motion, offset = [link.named(row) for row in gradient(w, wd)], link.offset
        force = plus([link.mass * x for x in a], product(motion, link.first))
        spun = cross(w, product(link.inertia, w))
        loads.append((force, plus(product(link.inertia, wd), spun, cross(link.first, a))))
    result: Vector = []
    force, moment = [0, 0, 0], [0, 0, 0]
    for place in reversed(range(len(links))):
        own_force, own_moment = loads[place]
        moment = links[place].named(plus(own_moment, moment, cross(links[place].offset, force)))
        force = links[place].named(plus(own_force, force))
        result.insert(0, moment[2])
        force, moment = links[place].back(force), links[place].back(moment)
    return result


@dataclass
class Composite:
    """The bodies from a link outwards as one: mass, first moment, second moments int r r' dm, about the link's joint."""

    mass: float
    first: Vector
    second: Table

    def beyond(self, link: Link) -> Composite:
        """With the link's body, in its axes; constants first, so that they fold."""
        o, h, m = link.offset, self.first, self.mass
        fixed = [[link.second[i][j] + m * (o[i] * o[j]) for j in range(3)] for i in range(3)]
        moved = [[h[i] * o[j] + o[i] * h[j] + self.second[i][j] for j in range(3)] for i in range(3)]
        first = plus(plus(link.first, [m * x for x in o]), h)
        second = [link.named(row) for row in added(fixed, moved)]
        return Composite(m + link.mass, link.named(first), second)

    def back(self, link: Link) -> Composite:
        """In the axes of the link before."""
        return Composite(self.mass, link.back(self.first), link.back_symmetric(self.second))

    @property
    def unit_load(self) -> tuple[Vector, Vector]:
        """Force and moment of a unit acceleration about z."""
        s = self.second
        return [-self.first[1], self.first[0], 0], [-s[0][2], -s[1][2], s[0][0] + s[1][1]]

    def resist(self, w: Vector) -> Vector:
        """Inertia times w."""
        s = self.second
        inertia = [
            [s[1][1] + s[2][2], -s[0][1], -s[0][2]],
            [-s[0][1], s[0][0] + s[2][2], -s[1][2]],
            [-s[0][2], -s[1][2], s[0][0] + s[1][1]],
        ]
        return product(inertia, w)


NOTHING = Composite(0.0, [0, 0, 0], [[0] * 3 for _ in range(3)])


def mass_matrix(links: list[Link]) -> Table:
    """M by composite bodies."""
    n = len(links)
    result: Table = [[0] * n for _ in range(n)]
    bodies = NOTHING
    for j in reversed(range(n)):
        bodies = bodies.beyond(links[j])
        force, moment = bodies.unit_load
        for i in reversed(range(j + 1)):
            if i < j:
                force, moment = links[i + 1].back(force), links[i + 1].back(moment)
                moment = plus(moment, cross(links[i].offset, force))
            result[i][j] = result[j][i] = moment[2]
        bodies = bodies.back(links[j])
    return result


def solve(a: Table, b: Vector, name: Callable[[Scalar], Scalar]) -> Vector:
    """a^-1 b of a symmetric positive definite a, by L D L'."""
    n, lower, pivots, inverse = len(b), [[0] * len(b) for _ in b], [], []
    for j in range(n):
        scaled = [lower[j][k] * pivots[k] for k in range(j)]
        pivot = a[j][j]
        for k in range(j):
            pivot = pivot - lower[j][k] * scaled[k]
        pivots.append(name(pivot))
        inverse.append(name(1 / pivots[j]))
        for i in range(j + 1, n):
            rest = a[i][j]
            for k in range(j):
                rest = rest - lower[i][k] * scaled[k]
            lower[i][j] = name(rest * inverse[j])
    x = list(b)
    for i in range(n):
        for k in range(i):
            x[i] = name(x[i] - lower[i][k] * x[k])
    x = [value * reciprocal for value, reciprocal in zip(x, inverse, strict=True)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = name(x[i] - lower[k][i] * x[k])
    return x
