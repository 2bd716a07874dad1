"""Tendon forces for a torque and a stiffness: demands whose best answer is known, and that answer at 256 bits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import Balls, Floats
from awiwi_gen.ir.graph import Graph
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.kernel import Solver
from awiwi_gen.verify.reference import Reference, reference

Array = np.ndarray[Any, Any]

INFEASIBLE = 4  # AWIWI_INFEASIBLE
HELD = 0.3  # share of the tendons that are at a limit, in the demands that have such
IN_HAND = 0.05  # least torque of free tendons by unit forces, in parts of the largest
UNREACHABLE = 0.05  # how far a stiffness is from what the tendons can do, in parts of its largest entry
UNREACHABLE_TORQUE = 0.2  # [N m]
ROUNDS = 8  # of Newton's method with a derivative in floats: each gains ten digits at least


@dataclass(frozen=True)
class Answer:
    """The best forces for one demand: which tendons are at the lower (-1) or upper (1) limit, and which torques fail."""

    f: Array
    held: Array
    tau: Array
    K: Array
    feasible: bool


@dataclass(frozen=True)
class Distribution:
    """Demands made from their answers: forces first, then a torque and a stiffness for which nothing is better.

    By the sample's number modulo 4: forces inside the limits that give just what is asked for; the same with some at
    their limits; a stiffness out of reach, in a direction in which no move of the forces helps; a torque out of reach.
    """

    solver: Solver
    graphs: Mapping[str, Graph]
    values: Mapping[str, Fraction]

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Poses and limits as drawn, with demands for them."""
        dtype, (low, high) = drawn["q"].dtype, (drawn[end][:, 0] for end in ("f_min", "f_max"))
        answers = list(self.answers(drawn["q"], low, high))
        tau, K = (np.array([getattr(a, name) for a in answers]).astype(dtype) for name in ("tau", "K"))
        return {"q": drawn["q"], "tau": tau, "K": K, "f_min": low, "f_max": high}

    def mirror(self, inputs: Mapping[str, Array], own_trig: bool) -> Mapping[str, Array]:
        """No bits are known."""
        return {}

    # -- demands ----------------------------------------------------------------------------------------------

    def answers(self, q: Array, low: Array, high: Array) -> Iterator[Answer]:
        """One for every sample; the same for the same arguments."""
        samples, m = len(q), len(self.solver.equations)
        random = np.random.default_rng(samples)
        P, dP = self.tendons(q)
        for s in range(samples):
            ends = (float(low[s]), float(high[s]))
            held, push = np.zeros(m, int), np.zeros(P.shape[2])
            share = random.uniform(size=m)
            if s % 4 in (1, 2):
                held = _some_held(P[s], random)
            elif s % 4 == 3:
                push = _push(P[s], random)
                held = -np.sign(np.where(np.abs(P[s] @ push) > 1e-9, P[s] @ push, 0)).astype(int)
            f = _forces(share, held, ends)
            miss = random.normal(size=(dP.shape[2],) * 2) * (UNREACHABLE if s % 4 > 1 else 0)
            for _ in range(2):  # which limit a held tendon is at depends on where the stiffness is out of reach
                k, slope, _ = self.curve(f[:, None])
                stiffness = np.einsum("i,ia,ib->ab", k[:, 0], P[s], P[s]) + np.tensordot(f, dP[s], 1)
                growth = slope[:, 0, None, None] * np.einsum("ia,ib->iab", P[s], P[s]) + dP[s]
                excess = _out_of_reach(P[s], growth, held, (miss + miss.T) * np.abs(stiffness).max())
                prices = np.where(held != 0, _prices(P[s], growth, held, excess), 0)
                settled = bool(push.any()) or not np.any(held * prices > 0)
                if settled:
                    break
                held = -np.sign(prices).astype(int)
                f = _forces(share, held, ends)
            yield Answer(f, held, push - P[s].T @ f, stiffness - excess * settled, not push.any())

    def tendons(self, q: Array) -> tuple[Array, Array]:
        """Coupling (samples, m, n) and its derivatives (samples, m, n, n) in floats."""
        samples, m, n = len(q), len(self.solver.equations), len(self.solver.unknowns)
        found = []
        for family, output, shape in (("coupling", "P", (m, n)), ("coupling_derivative", "dP", (m, n, n))):
            if family not in self.graphs:
                found.append(np.zeros((samples, *shape)))
                continue
            columns = evaluate(self.graphs[family], Floats(), lambda node: q[:, node[2]].astype(np.float64))[output]
            stacked = np.stack([np.broadcast_to(column, samples) for column in columns], axis=1)
            found.append(stacked.reshape(samples, *shape))
        return found[0], found[1]

    def curve(self, f: Any, algebra: Any = None) -> Any:
        """Stiffness, slope and curvature (m, samples) of forces f (m, samples), in an algebra."""
        found = evaluate(self.graphs["tendon_stiffness"], algebra or Floats(), lambda node: f[node[2]])
        columns = (found[name] for name in ("k", "slope", "curvature"))
        return columns if algebra else [np.stack([np.broadcast_to(c, f.shape[1]) for c in each]) for each in columns]

    # -- answers at 256 bits ----------------------------------------------------------------------------------

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """Where the free forces leave no slope along the moves that keep the torque; those at limits stay there."""
        q, samples = inputs["q"], len(inputs["q"])
        answers = list(self.answers(q, inputs["f_min"], inputs["f_max"]))
        balls = Balls(samples)
        given = [[arb(float(x)) for x in column] for column in q.T]
        P = evaluate(self.graphs["coupling"], balls, lambda node: given[node[2]])["P"]
        dP = [[arb(0)] * samples] * (len(P) * q.shape[1])
        if "coupling_derivative" in self.graphs:
            dP = evaluate(self.graphs["coupling_derivative"], balls, lambda node: given[node[2]])["dP"]
        f = [[arb(float(a.f[i])) for a in answers] for i in range(len(self.solver.equations))]
        for i, row in enumerate(f):
            for s, answer in enumerate(answers):
                if answer.held[i]:
                    row[s] = arb(float(inputs["f_min" if answer.held[i] < 0 else "f_max"][s]))
        floats = self.tendons(q)
        systems = [
            _System(answer, inputs["tau"][s], inputs["K"][s], [c[s] for c in P], [c[s] for c in dP],
                    (floats[0][s], floats[1][s]), self.curve(answer.f[:, None]))
            for s, answer in enumerate(answers)
        ]  # fmt: skip
        for _ in range(ROUNDS):
            curves = [list(each) for each in self.curve(f, balls)]
            for s, system in enumerate(systems):
                here = system.improved([row[s] for row in f], [c[s] for c in curves[0]], [c[s] for c in curves[1]])
                for row, force in zip(f, here, strict=True):
                    row[s] = force
        status = [[arb(0 if answer.feasible else INFEASIBLE) for answer in answers]]
        return reference({"f": f, "status": status})


class _System:
    """The equations of one sample: no slope of the free forces beyond what the torques' prices explain, and the torque."""

    def __init__(
        self, answer: Answer, tau: Array, K: Array, P: list[arb], dP: list[arb], floats: tuple[Array, Array], curve: Any
    ) -> None:
        n = len(tau)
        self.free, self.n = np.flatnonzero(answer.held == 0).tolist(), n
        self.P = [P[i * n : i * n + n] for i in range(len(answer.f))]
        self.dP = [dP[i * n * n : (i + 1) * n * n] for i in range(len(answer.f))]
        self.tau = [arb(float(x)) for x in tau]
        self.K = [arb(float(x)) for x in (K.astype(np.float64) + K.T.astype(np.float64)).flat]
        coupling, bend = floats
        self.rows = _independent(coupling[self.free])
        k, slope, curvature = (each[:, 0] for each in curve)
        pp = np.einsum("ia,ib->iab", coupling, coupling)
        growth = slope[:, None, None] * pp + bend
        excess = np.tensordot(k, pp, 1) + np.tensordot(answer.f, bend, 1) - (K + K.T) / 2
        hessian = np.einsum("iab,lab->il", growth, growth)
        hessian += np.diag(curvature * np.einsum("iab,ab->i", pp, excess))
        count, rank = len(self.free), len(self.rows)
        matrix = np.zeros((count + rank, count + rank))
        matrix[:count, :count] = hessian[np.ix_(self.free, self.free)]
        matrix[:count, count:] = coupling[np.ix_(self.free, self.rows)]
        matrix[count:, :count] = matrix[:count, count:].T
        self.inverse = np.linalg.inv(matrix)
        self.prices = [arb(0)] * rank

    def improved(self, f: list[arb], k: list[arb], slope: list[arb]) -> list[arb]:
        """One step with the derivative that is known in floats."""
        n = range(self.n)
        excess = [
            sum((k[i] * self.P[i][a] * self.P[i][b] + f[i] * self.dP[i][a * self.n + b] for i in range(len(f))),
                -self.K[a * self.n + b] / 2)
            for a in n for b in n
        ]  # fmt: skip
        misses = [
            sum((excess[a * self.n + b] * (slope[i] * self.P[i][a] * self.P[i][b] + self.dP[i][a * self.n + b])
                 for a in n for b in n), arb(0))
            + sum((self.P[i][j] * price for j, price in zip(self.rows, self.prices, strict=True)), arb(0))
            for i in self.free
        ]  # fmt: skip
        misses += [self.tau[j] + sum((self.P[i][j] * f[i] for i in range(len(f))), arb(0)) for j in self.rows]
        steps = [
            sum((arb(float(x)) * miss for x, miss in zip(row, misses, strict=True)), arb(0)) for row in self.inverse
        ]
        self.prices = [(price - step).mid() for price, step in zip(self.prices, steps[len(self.free) :], strict=True)]
        moved = dict(zip(self.free, steps, strict=False))
        return [(force - moved[i]).mid() if i in moved else force for i, force in enumerate(f)]


def _forces(share: Array, held: Array, ends: tuple[float, float]) -> Array:
    low, high = ends
    return np.where(held < 0, low, np.where(held > 0, high, low + share * (high - low)))


def _some_held(P: Array, random: Any) -> Array:
    """Some tendons at a limit; the others must have every torque well in hand."""
    held, sizes = np.zeros(len(P), int), np.linalg.svd(P, compute_uv=False)
    rank, weak = int(np.sum(sizes > 1e-9 * sizes[0])), IN_HAND * sizes[0]
    for i in random.permutation(len(P)):
        rest = [k for k in range(len(P)) if k != i and not held[k]]
        if random.uniform() < HELD and np.linalg.matrix_rank(P[rest], tol=weak) == rank:
            held[i] = random.choice((-1, 1))
    return held


def _push(P: Array, random: Any) -> Array:
    """A torque beyond reach for the joints of one or more groups of tendons."""
    left, push = set(np.flatnonzero(np.abs(P).any(axis=0))), np.zeros(P.shape[1])
    while left:
        joints = {left.pop()}
        while (more := set(np.flatnonzero(np.abs(P[np.abs(P[:, list(joints)]).any(axis=1)]).any(axis=0)))) - joints:
            joints |= more
        left -= joints
        if (not left and not push.any()) or random.uniform() < 0.5:
            push[list(joints)] = random.normal(size=len(joints)) * UNREACHABLE_TORQUE
    return push


def _null_space(P: Array) -> Array:
    """Orthonormal moves (tendons, ...) that give no torque."""
    u, sizes, _ = np.linalg.svd(P)
    return u[:, int(np.sum(sizes > 1e-9 * sizes[0])) :] if len(P) else np.zeros((0, 0))


def _out_of_reach(P: Array, growth: Array, held: Array, miss: Array) -> Array:
    """What is left of a miss of the stiffness when the free tendons have done what they can without a torque."""
    free = held == 0
    moves = np.tensordot(_null_space(P[free]).T, growth[free], 1).reshape(-1, miss.size)
    part: Array = moves.T @ np.linalg.lstsq(moves.T, miss.ravel(), rcond=None)[0] if len(moves) else np.zeros(miss.size)
    return miss - part.reshape(miss.shape)


def _prices(P: Array, growth: Array, held: Array, excess: Array) -> Array:
    """Slopes of the cost by each force, less what the torque's prices explain; negative: it would gain by growing."""
    slopes, free = np.einsum("iab,ab->i", growth, excess), held == 0
    prices: Array = slopes + P @ np.linalg.lstsq(P[free], -slopes[free], rcond=None)[0]
    return prices


def _independent(P: Array) -> list[int]:
    """Joints whose torques by these tendons are independent, as many as there are."""
    found: list[int] = []
    for j in range(P.shape[1]):
        if len(P) and np.linalg.matrix_rank(P[:, [*found, j]], tol=1e-9) > len(found):
            found.append(j)
    return found
