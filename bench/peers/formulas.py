"""The compared quantities from the recursions: outputs by name, each a flat list, matrices row by row."""

from __future__ import annotations

from typing import Any

from bench.peers import recursion as r
from bench.peers.recursion import Algebra, Link, Scalar, Table, Vector


def outputs(quantity: str, finger: dict[str, Any], x: dict[str, Vector], algebra: Algebra) -> dict[str, Vector]:
    """The outputs of a quantity for inputs ``x``."""
    if quantity == "tendons":
        return tendons(finger, x["f"], x["k"])
    links = r.links_of(finger, x["q"], algebra)
    none = [0] * len(links)
    if quantity == "mass_matrix":
        return {"M": flat(r.mass_matrix(links))}
    if quantity == "inverse_dynamics":
        return {"tau": r.torques(links, x["qd"], x["qdd"], x["g"])}
    if quantity == "bias":
        return {"bias": r.torques(links, x["qd"], none, x["g"])}
    if quantity == "forward_dynamics":
        bias = r.torques(links, x["qd"], none, x["g"])
        load = [a - b for a, b in zip(x["tau"], bias, strict=True)]
        return {"qdd": r.solve(r.mass_matrix(links), load, algebra.name)}
    if quantity == "pose_jacobian":
        return pose_jacobian(links)
    if quantity == "dynamics":
        if algebra.partial is None:
            m, c = mass_and_coriolis(links, x["qd"])
        else:
            m = r.mass_matrix(links)
            c = christoffel([algebra.partial(flat(m), q) for q in x["q"]], x["qd"])
        return {"M": flat(m), "C": flat(c), "gravity": gravity(links, x["g"])}
    raise KeyError(quantity)


def flat(table: Table) -> Vector:
    """Row by row."""
    return [entry for row in table for entry in row]


def tendons(finger: dict[str, Any], f: Vector, k: Vector) -> dict[str, Vector]:
    """-P' f and P' diag(k) P, products of constants folded."""
    p = finger["coupling"]
    n, rows = len(p[0]), range(len(p))

    def weighed(factors: list[float], values: Vector) -> Scalar:
        used = [r.plain(c) * v for c, v in zip(factors, values, strict=True) if c]
        return sum(used[1:], used[0]) if used else 0

    torque = [weighed([-p[t][i] for t in rows], f) for i in range(n)]
    stiffness = [[weighed([p[t][i] * p[t][j] for t in rows], k) for j in range(n)] for i in range(n)]
    return {"tau": torque, "K": flat(stiffness)}


def pose_jacobian(links: list[Link]) -> dict[str, Vector]:
    """Pose of the tip and its Jacobian in base axes, velocity above angular velocity."""
    axes, origin = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, 0]
    seats = []
    for link in links:
        c, s = link.cosine, link.sine
        axes = r.matmul(r.matmul(axes, link.turn), [[c, -s, 0], [s, c, 0], [0, 0, 1]])
        seats.append(([row[2] for row in axes], origin))
        origin = r.plus(origin, r.product(axes, link.offset))
    levers = [(z, [a - b for a, b in zip(origin, seat, strict=True)]) for z, seat in seats]
    columns = [r.cross(z, lever) + z for z, lever in levers]
    pose = [*axes[0], origin[0], *axes[1], origin[1], *axes[2], origin[2], 0, 0, 0, 1]
    return {"T": pose, "J": flat(r.transposed(columns))}


def gravity(links: list[Link], g: Vector) -> Vector:
    """Torques that hold the finger still: composite first moments times g."""
    downs, down = [], g
    for link in links:
        down = link.forth(down)
        downs.append(down)
    result: Vector = []
    mass, first = 0.0, [0, 0, 0]
    for link, down in reversed(list(zip(links, downs, strict=True))):
        first = r.plus(r.plus(link.first, [mass * x for x in link.offset]), first)
        mass += link.mass
        result.insert(0, first[1] * down[0] - first[0] * down[1])
        first = link.back(first)
    return result


def christoffel(slopes: list[Vector], qd: Vector) -> Table:
    """C from the partial derivatives of M: what costs least where the tool differentiates."""
    n = len(qd)

    def entry(i: int, j: int) -> Scalar:
        terms = [(slopes[k][i * n + j] + slopes[j][i * n + k] - slopes[i][j * n + k]) * qd[k] for k in range(n)]
        return 0.5 * sum(terms[1:], terms[0])

    return [[entry(i, j) for j in range(n)] for i in range(n)]


def mass_and_coriolis(links: list[Link], qd: Vector) -> tuple[Table, Table]:
    """M and C by composite bodies in one sweep (the algorithm of Echeandia and Wensing, 2021).

    A body adds its momentum p = int r' dm and the moment Q = int r' r^T dm, with velocities r' and levers r about the
    joint; B of that paper is [[tr(Q) - Q, 0], [-[p], 0]] then.
    """
    n = len(links)
    spins, speeds, w, v, offset = [], [], [0, 0, 0], [0, 0, 0], [0, 0, 0]
    for link, rate in zip(links, qd, strict=True):
        v = link.forth(r.plus(v, r.cross(w, offset)))
        w, offset = r.plus(link.forth(w), [0, 0, rate]), link.offset
        spins.append(w)
        speeds.append(v)
    m: Table = [[0] * n for _ in range(n)]
    c: Table = [[0] * n for _ in range(n)]
    bodies = r.NOTHING
    momentum, swirl = [0, 0, 0], [[0] * 3 for _ in range(3)]
    for j in reversed(range(n)):
        link, w, v = links[j], spins[j], speeds[j]
        bodies = bodies.beyond(link)
        turning = r.transposed([r.cross(w, column) for column in link.second])
        swirl = r.added(r.outer(v, link.first), turning, swirl, r.outer(momentum, link.offset))
        momentum = link.named(r.plus([link.mass * x for x in v], r.cross(w, link.first), momentum))
        f1, n1, f2, n2, n3 = _column(bodies, momentum, swirl, w, v)
        for i in reversed(range(j + 1)):
            if i < j:
                f1, n1, f2, n2, n3 = (links[i + 1].back(x) for x in (f1, n1, f2, n2, n3))
                n1, n2 = r.plus(n1, r.cross(links[i].offset, f1)), r.plus(n2, r.cross(links[i].offset, f2))
            m[i][j] = m[j][i] = n2[2]
            c[i][j] = n1[2]
            if i < j:
                (x, y, _), (vx, vy, _) = spins[i], speeds[i]
                c[j][i] = n3[2] + (y * n2[0] - x * n2[1]) + (vy * f2[0] - vx * f2[1])
        bodies = bodies.back(link)
        swirl, momentum = [link.named(row) for row in link.back_matrix(swirl)], link.back(momentum)
    return m, c


def _column(bodies: r.Composite, momentum: Vector, swirl: Table, w: Vector, v: Vector) -> tuple[Vector, ...]:
    """Forces and moments of a joint that turns a composite body: I s' + B s, I s and B' s, s its unit motion."""
    turn, slide = [w[1], -w[0], 0], [v[1], -v[0], 0]  # the rate of s: w x z, v x z
    trace = swirl[0][0] + swirl[1][1]
    force, moment = bodies.unit_load
    f1 = r.plus([bodies.mass * x for x in slide], r.cross(turn, bodies.first), [-momentum[1], momentum[0], 0])
    n1 = r.plus(bodies.resist(turn), r.cross(bodies.first, slide), [-swirl[0][2], -swirl[1][2], trace])
    return f1, n1, force, moment, [-swirl[2][0], -swirl[2][1], trace]
