"""Tendon forces for a torque and a stiffness: demands whose optimal forces are known, and these at 256 bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import Balls, Floats
from awiwi_gen.ir.graph import Graph, prune
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.verify.distribution_answer import System, demanded
from awiwi_gen.verify.nearest_forces import Demands, minima
from awiwi_gen.verify.other_minima import Found
from awiwi_gen.verify.problem import Problem
from awiwi_gen.verify.reference import Reference, reference

Array = np.ndarray[Any, Any]
Limits = tuple[float, float]  # limits of every force [N]

INFEASIBLE = 4  # AWIWI_INFEASIBLE
SHARE_AT_LIMITS = 0.3  # probability of a tendon to be at a limit, in demands of that kind
LEAST_AUTHORITY = 0.05  # smallest singular value of the free tendons' coupling, relative to the largest of all
UNREACHABLE = 0.05  # distance of a stiffness from what the tendons can do, relative to its largest entry
UNREACHABLE_TORQUE = 0.2  # [N m]
HALVINGS = 12  # of the distance to an unreachable stiffness, until its answer is unique
MARGIN = 1e-3  # other stiffnesses must be farther by this share of the distance; else the demand is not well posed
ROUNDING = 1e-7  # distance relative to the stiffness that counts as zero, after a search in floats
LEAST_GAIN = 1e-6  # a shorter distance by this share is another minimum, or the answer is none
SAME_STIFFNESS = 0.1  # of the distance: stiffnesses that differ by less are those of one minimum
SAME_FORCES = 1e-2  # of the upper limit: forces that differ by less are those of one minimum
DETERMINED = 1e-4  # smallest effect of a pattern of forces, relative to the largest, that still determines forces
ROUNDS = 8  # of Newton's method with a derivative in floats, at most: each gains ten digits at least
SAME_DISTANCE = 1e-9  # of the demand: distances that differ by less are those of one minimum
FARTHER = 0.02  # share of the samples that may end at a minimum which is not the nearest known
LAST_STEP = 1e-40  # largest step [N] after which the next would change nothing that two doubles show


@dataclass(frozen=True)
class Answer:
    """The optimal forces f (m,) [N] for one demand, of which K (n, n) [N m/rad] is the stiffness.

    `beyond` are the torque (n,) [N m] and the stiffness (n, n) that the demand has and these forces have not.
    `held` (m,) is -1 for a tendon at the lower limit, 1 at the upper one, 0 between them. The torque cannot be reached
    unless `feasible`; other forces do the same unless `unique`.
    """

    f: Array
    held: Array
    K: Array
    beyond: tuple[Array, Array]
    feasible: bool
    unique: bool


@dataclass(frozen=True)
class _Draft:
    """Random numbers for one demand: its kind, forces as shares of their range, tendons held at limits, a torque and a
    stiffness that are out of reach."""

    kind: int
    share: Array
    held: Array
    torque_excess: Array
    miss: Array


@dataclass(frozen=True)
class _State:
    """Forces (m,), their joint stiffness (n, n), and its derivatives by the forces (m, n, n)."""

    f: Array
    K: Array
    growth: Array


@dataclass(frozen=True)
class Distribution(Problem):
    """Demands made from their answers: forces first, then a torque and a stiffness for which they are optimal.

    The sample's number modulo 4 decides the kind: 0: forces inside the limits that give exactly the demand; 1: the same
    with some forces at limits; 2: a stiffness out of reach, in a direction that no change of the forces reduces; 3: a
    torque out of reach. A search from many starts confirms that no other forces come as near.

    Some fingers have no unique answer: two equal pairs over one joint, or three tendons over one joint, can change
    their forces without a change of torque or stiffness. There torque and stiffness are compared, not the forces.
    """

    _cached: dict[bytes, list[Answer]] = field(default_factory=dict, init=False, compare=False)
    _curves: dict[tuple[str, ...], Graph] = field(default_factory=dict, init=False, compare=False)

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Poses and limits as drawn, with demands for them."""
        dtype, (low, high) = drawn["q"].dtype, (drawn[end][:, 0] for end in ("f_min", "f_max"))
        answers = self.answers(drawn["q"], low, high)
        held, forces = (np.array([getattr(answer, name) for answer in answers]).T for name in ("held", "f"))
        f = [[arb(x) for x in row] for row in forces.tolist()]
        (k,) = self.curve(f, "k", algebra=Balls(len(low)))
        beyond, coupling = [answer.beyond for answer in answers], self._coupling(drawn["q"])
        tau, K = demanded(f, k, *coupling, beyond, held.T == 0)
        return {"q": drawn["q"], "tau": tau.astype(dtype), "K": K.astype(dtype), "f_min": low, "f_max": high}

    # -- demands ----------------------------------------------------------------------------------------------

    def answers(self, q: Array, low: Array, high: Array) -> list[Answer]:
        """One answer for every sample; cached, since the demand and its solution both need it."""
        given = b"".join(each.tobytes() for each in (q, low, high))
        if given not in self._cached:
            self._cached[given] = self._answers(q, low, high)
        return self._cached[given]

    def _answers(self, q: Array, low: Array, high: Array) -> list[Answer]:
        """Forces, and demands for which they are optimal.

        The distance of the stiffness is not convex in the forces: if the demand is too far out of reach, other forces
        come nearer, or as near. So it is halved until none do; at distance zero none can.
        """
        samples = len(q)
        random = np.random.default_rng(samples)
        P, dP = self.tendons(q)
        drafts = [_draft(s % 4, P[s], random) for s in range(samples)]
        limits = [(float(low[s]), float(high[s])) for s in range(samples)]
        first = [_forces(draft.share, draft.held, each) for draft, each in zip(drafts, limits, strict=True)]
        k, slope = self.curve(np.array(first).T, "k", "slope")
        states = [_state(first[s], k[:, s], slope[:, s], P[s], dP[s]) for s in range(samples)]
        answers: dict[int, Answer] = {}
        for part in (*0.5 ** np.arange(HALVINGS), 0.0):
            pending = np.array([s for s in range(samples) if s not in answers], int)
            if len(pending) == 0:
                break
            tried = [
                self._answer(drafts[s], states[s], P[s], dP[s], limits[s], part * (drafts[s].kind > 1)) for s in pending
            ]
            nearest, alone = self._compared(tried, P[pending], dP[pending], low[pending], high[pending])
            for i, s in enumerate(pending):
                if nearest[i] or part == 0:
                    answers[int(s)] = replace(tried[i], unique=tried[i].unique and bool(alone[i]))
        return [answers[s] for s in range(samples)]

    def _answer(self, draft: _Draft, state: _State, P: Array, dP: Array, limits: Limits, part: float) -> Answer:
        """Forces, and a demand out of reach by a part of the draft's miss for which they are stationary."""
        reached, at, excess = self._out_of_reach(draft, state, P, dP, limits, part)
        feasible, beyond = not draft.torque_excess.any(), (draft.torque_excess, -excess)
        return Answer(reached.f, at, reached.K - excess, beyond, feasible, _is_unique(P, reached.growth))

    def _out_of_reach(
        self, draft: _Draft, state: _State, P: Array, dP: Array, limits: Limits, part: float
    ) -> tuple[_State, Array, Array]:
        """Forces, which of them are held at a limit, and a stiffness error that no small change of forces reduces."""
        held, miss = draft.held, draft.miss * part * np.abs(state.K).max()
        for _ in range(2):  # the sign of the stiffness error decides which limit holds a tendon
            excess = _out_of_reach(P, state.growth, held, miss)
            multipliers = np.where(held != 0, _multipliers(P, state.growth, held, excess), 0)
            if draft.torque_excess.any() or not np.any(held * multipliers > 0):
                return state, held, excess
            held = -np.sign(multipliers).astype(int)
            f = _forces(draft.share, held, limits)
            k, slope = (each[:, 0] for each in self.curve(f[:, None], "k", "slope"))
            state = _state(f, k, slope, P, dP)
        return state, held, excess * 0

    def _compared(self, answers: list[Answer], P: Array, dP: Array, low: Array, high: Array) -> tuple[Array, Array]:
        """Whether each answer's stiffness is the nearest by a margin, and whether no other forces give a stiffness as near.

        Pairs need no search: their stiffness is linear in sums that grow with the forces.
        """
        group = [int(i) for i in self.solver.strings["searched"].split(",") if i]
        if not group:
            return np.ones(len(answers), bool), np.ones(len(answers), bool)
        f, K = (np.array([getattr(answer, name) for answer in answers]) for name in ("f", "K"))
        torque_limits = np.array([(answer.held != 0) & (not answer.feasible) for answer in answers])
        demands = Demands(f, K, P, dP, low, high, torque_limits, group)
        others = minima(demands, self.curve)
        here, there = (demands.stiffness(each, self._stiffnesses(each)) for each in (f[:, None], others))
        nearest, distances = (np.linalg.norm(each - K[:, None], axis=(2, 3)) for each in (here, there))
        as_near = distances < nearest * (1 + MARGIN) + ROUNDING * np.linalg.norm(K, axis=(1, 2))[:, None]
        differ = np.linalg.norm(there - here, axis=(2, 3)) > SAME_STIFFNESS * nearest
        differ |= distances < nearest * (1 - LEAST_GAIN)
        away = np.abs(others - f[:, None]).max(axis=2) > SAME_FORCES * high[:, None]
        exact = nearest[:, 0] <= ROUNDING * np.linalg.norm(K, axis=(1, 2))
        return exact | ~(as_near & differ).any(axis=1), ~(as_near & away).any(axis=1)

    def _stiffnesses(self, f: Array) -> Array:
        """Stiffnesses of the tendons (..., m) at forces (..., m)."""
        return np.asarray(self.curve(f.reshape(-1, f.shape[-1]).T, "k")[0].T.reshape(f.shape))

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

    def curve(self, f: Any, *names: str, algebra: Any = None) -> Any:
        """The requested ones of "k", "slope" and "curvature" (m, samples) at forces f (m, samples), in an algebra."""
        if names not in self._curves:
            whole = self.graphs["tendon_stiffness"]
            outputs = tuple(output for output in whole.outputs if output.name in names)
            self._curves[names] = prune(Graph(whole.nodes, outputs))
        found = evaluate(self._curves[names], algebra or Floats(), lambda node: f[node[2]])
        columns = (found[name] for name in names)
        return columns if algebra else [np.stack([np.broadcast_to(c, f.shape[1]) for c in each]) for each in columns]

    # -- answers at 256 bits ----------------------------------------------------------------------------------

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """Forces whose free components are stationary under changes that keep the torque; the others stay at limits."""
        return self._exact(inputs, self.answers(inputs["q"], inputs["f_min"], inputs["f_max"]))

    def other_reference(
        self, inputs: Mapping[str, Array], found: Any, reference: Reference
    ) -> tuple[Reference, list[str]]:
        """The same, where the search ended at another minimum: its own exact forces.

        The distance is not convex, and no bounded search is sure to end at the least of its minima. Another one counts
        as found if it is a minimum; too many that are farther than the nearest known are a fault.
        """
        answers = self.answers(inputs["q"], inputs["f_min"], inputs["f_max"])
        limits = [inputs[end].astype(np.float64) for end in ("f_min", "f_max")]
        (P, dP), curves = self.tendons(inputs["q"]), ("k", "slope", "curvature")
        f, symmetric = found.f.astype(np.float64), (inputs["K"] + np.swapaxes(inputs["K"], 1, 2)).astype(np.float64) / 2
        known = np.array([answer.f for answer in answers])
        reached = np.array([answer.feasible for answer in answers])[:, None]
        ends, nearest = (
            [Found(*each) for each in zip(forces, P, dP, *(c.T for c in self.curve(forces.T, *curves)), symmetric, *limits,
                                          np.where(reached, 0, inputs["tau"] + np.einsum("sia,si->sa", P, forces)),
                                          strict=True)]
            for forces in (f, known)
        )  # fmt: skip
        farther = 0
        for s, (end, best) in enumerate(zip(ends, nearest, strict=True)):
            if found.status[s] == (0 if answers[s].feasible else INFEASIBLE) and end.is_minimum():
                away = end.distance - best.distance
                if abs(away) > SAME_DISTANCE * float(np.abs(end.K).max()):
                    farther += away > 0
                    answers[s] = replace(answers[s], f=end.f, held=end.held)
        reasons = [f"it ends at a minimum that is not the nearest at {farther} samples"]
        return self._exact(inputs, answers), reasons if farther > FARTHER * len(answers) else []

    def _coupling(self, q: Array) -> tuple[list[list[arb]], list[list[arb]]]:
        """P and its derivatives, row by row, at all samples."""
        balls, given = Balls(len(q)), [[arb(float(x)) for x in column] for column in q.T]
        P = evaluate(self.graphs["coupling"], balls, lambda node: given[node[2]])["P"]
        if "coupling_derivative" not in self.graphs:
            return P, [[arb(0)] * len(q)] * (len(P) * q.shape[1])
        return P, evaluate(self.graphs["coupling_derivative"], balls, lambda node: given[node[2]])["dP"]

    def _exact(self, inputs: Mapping[str, Array], answers: list[Answer]) -> Reference:
        """The answers at 256 bits."""
        q, samples = inputs["q"], len(inputs["q"])
        balls, (P, dP) = Balls(samples), self._coupling(q)
        f = [[arb(float(a.f[i])) for a in answers] for i in range(len(self.solver.equations))]
        for i, row in enumerate(f):
            for s, answer in enumerate(answers):
                if answer.held[i]:
                    row[s] = arb(float(inputs["f_min" if answer.held[i] < 0 else "f_max"][s]))
        floats = self.tendons(q)
        curves = self.curve(np.array([a.f for a in answers]).T, "k", "slope", "curvature")
        systems = [
            System(answer.f, answer.held, inputs["tau"][s], inputs["K"][s], [c[s] for c in P], [c[s] for c in dP],
                   (floats[0][s], floats[1][s]), [each[:, s] for each in curves])
            for s, answer in enumerate(answers)
        ]  # fmt: skip
        for _ in range(ROUNDS):
            k, slope = (list(each) for each in self.curve(f, "k", "slope", algebra=balls))
            steps = [0.0]
            for s, system in enumerate(systems):
                here = system.improved([row[s] for row in f], [c[s] for c in k], [c[s] for c in slope])
                steps += [float(abs(force - row[s])) for row, force in zip(f, here, strict=True)]
                for row, force in zip(f, here, strict=True):
                    row[s] = force
            if max(steps) < LAST_STEP:
                break
        status = [[arb(0 if answer.feasible else INFEASIBLE) for answer in answers]]
        if all(answer.unique for answer in answers):
            return reference({"f": f, "status": status})
        (k,) = self.curve(f, "k", algebra=balls)
        effects = [
            [*system.torque(forces), *system.stiffness(forces, [c[s] for c in k])]
            for s, (system, forces) in enumerate(zip(systems, map(list, zip(*f, strict=True)), strict=True))
        ]
        columns, n = [list(column) for column in zip(*effects, strict=True)], q.shape[1]
        outside = [[arb(0)] * samples] * len(f)
        return reference({"torque": columns[:n], "stiffness": columns[n:], "outside": outside, "status": status})

    def observed(self, inputs: Mapping[str, Array], found: Any) -> Mapping[str, Array]:
        """The forces found, their torque and stiffness, and how far they lie outside their limits."""
        P, dP = self.tendons(inputs["q"])
        f = found.f.astype(np.float64)
        low, high = (inputs[end][:, None].astype(np.float64) for end in ("f_min", "f_max"))
        k = self.curve(f.T, "k")[0].T
        stiffness = np.einsum("si,sia,sib->sab", k, P, P) + np.einsum("si,siab->sab", f, dP)
        outside = np.maximum(0, np.maximum(low - f, f - high))
        return {
            "f": found.f, "torque": -np.einsum("sia,si->sa", P, f), "stiffness": stiffness, "outside": outside,
        }  # fmt: skip


def _draft(kind: int, P: Array, random: Any) -> _Draft:
    held, torque_excess = np.zeros(len(P), int), np.zeros(P.shape[1])
    share = random.uniform(size=len(P))
    if kind in (1, 2):
        held = _some_held(P, random)
    elif kind == 3:
        torque_excess = _torque_excess(P, random)
        held = -np.sign(np.where(np.abs(P @ torque_excess) > 1e-9, P @ torque_excess, 0)).astype(int)
    miss = random.normal(size=(P.shape[1], P.shape[1]))
    return _Draft(kind, share, held, torque_excess, (miss + miss.T) * UNREACHABLE)


def _state(f: Array, k: Array, slope: Array, P: Array, dP: Array) -> _State:
    pairs = np.einsum("ia,ib->iab", P, P)
    K = np.tensordot(k, pairs, 1) + np.tensordot(f, dP, 1)
    return _State(f, K, slope[:, None, None] * pairs + dP)


def _forces(share: Array, held: Array, limits: Limits) -> Array:
    low, high = limits
    return np.where(held < 0, low, np.where(held > 0, high, low + share * (high - low)))


def _some_held(P: Array, random: Any) -> Array:
    """Some tendons at a limit; the others must still control every torque."""
    held, sizes = np.zeros(len(P), int), np.linalg.svd(P, compute_uv=False)
    rank, weak = int(np.sum(sizes > 1e-9 * sizes[0])), LEAST_AUTHORITY * sizes[0]
    for i in random.permutation(len(P)):
        rest = [k for k in range(len(P)) if k != i and not held[k]]
        if random.uniform() < SHARE_AT_LIMITS and np.linalg.matrix_rank(P[rest], tol=weak) == rank:
            held[i] = random.choice((-1, 1))
    return held


def _torque_excess(P: Array, random: Any) -> Array:
    """A torque beyond reach for the joints of one or more groups of tendons."""
    left, torque_excess = set(np.flatnonzero(np.abs(P).any(axis=0))), np.zeros(P.shape[1])
    while left:
        joints = {left.pop()}
        while (more := set(np.flatnonzero(np.abs(P[np.abs(P[:, list(joints)]).any(axis=1)]).any(axis=0)))) - joints:
            joints |= more
        left -= joints
        if (not left and not torque_excess.any()) or random.uniform() < 0.5:
            torque_excess[list(joints)] = random.normal(size=len(joints)) * UNREACHABLE_TORQUE
    return torque_excess


def _null_space(P: Array) -> Array:
    """Orthonormal changes of the forces (tendons, ...) that give no torque."""
    u, sizes, _ = np.linalg.svd(P)
    return u[:, int(np.sum(sizes > 1e-9 * sizes[0])) :] if len(P) else np.zeros((0, 0))


def _out_of_reach(P: Array, growth: Array, held: Array, miss: Array) -> Array:
    """The part of a stiffness error that the free tendons cannot reduce without a torque."""
    free = held == 0
    moves = np.tensordot(_null_space(P[free]).T, growth[free], 1).reshape(-1, miss.size)
    part: Array = moves.T @ np.linalg.lstsq(moves.T, miss.ravel(), rcond=None)[0] if len(moves) else np.zeros(miss.size)
    return miss - part.reshape(miss.shape)


def _multipliers(P: Array, growth: Array, held: Array, excess: Array) -> Array:
    """Reduced gradient of the cost by each force; negative where a larger force would lower the cost."""
    slopes, free = np.einsum("iab,ab->i", growth, excess), held == 0
    multipliers: Array = slopes + P @ np.linalg.lstsq(P[free], -slopes[free], rcond=None)[0]
    return multipliers


def _is_unique(P: Array, growth: Array) -> bool:
    """Whether every pattern of forces changes the torque or the stiffness."""
    effects = np.concatenate([P / np.abs(P).max(), growth.reshape(len(P), -1) / np.abs(growth).max()], axis=1)
    sizes = np.linalg.svd(effects, compute_uv=False)
    return bool(len(sizes) == len(P) and sizes[-1] > DETERMINED * sizes[0])
