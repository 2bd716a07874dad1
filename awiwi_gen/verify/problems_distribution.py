"""Tendon forces for a torque and a stiffness: demands whose best answer is known, and that answer at 256 bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from flint import arb

from awiwi_gen.ir.algebras import Balls, Floats
from awiwi_gen.ir.graph import Graph, prune
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.verify.distribution_answer import System
from awiwi_gen.verify.problem import Problem
from awiwi_gen.verify.reference import Reference, reference

Array = np.ndarray[Any, Any]
Ends = tuple[float, float]  # limits of every force [N]

INFEASIBLE = 4  # AWIWI_INFEASIBLE
HELD = 0.3  # share of the tendons that are at a limit, in the demands that have such
IN_HAND = 0.05  # least torque of free tendons by unit forces, in parts of the largest
UNREACHABLE = 0.05  # how far a stiffness is from what the tendons can do, in parts of its largest entry
UNREACHABLE_TORQUE = 0.2  # [N m]
MILDEST = 12  # halvings of a miss
RAYS, POINTS = 48, 24  # along which it is looked for forces that are as near, and how many on each
DETERMINED = 1e-4  # effect of a pattern of forces, in parts of the largest, by which they are found again
ROUNDS = 8  # of Newton's method with a derivative in floats, at most: each gains ten digits at least
LAST_STEP = 1e-40  # largest step [N] after which the next would change nothing that two doubles show


@dataclass(frozen=True)
class Answer:
    """The best forces for one demand: which tendons are at the lower (-1) or upper (1) limit, and which torques fail."""

    f: Array
    held: Array
    tau: Array
    K: Array
    feasible: bool
    unique: bool


@dataclass(frozen=True)
class _Wish:
    """What a demand of some kind is made from: forces as shares of their range, tendons at limits, torque, stiffness."""

    kind: int
    share: Array
    held: Array
    push: Array
    miss: Array


@dataclass(frozen=True)
class _Pull:
    """Forces (m,), the joint stiffness (n, n) that they give, and how it grows with each of them (m, n, n)."""

    f: Array
    K: Array
    growth: Array


@dataclass(frozen=True)
class Distribution(Problem):
    """Demands made from their answers: forces first, then a torque and a stiffness for which nothing is better.

    By the sample's number modulo 4: forces inside the limits that give just what is asked for; the same with some at
    their limits; a stiffness out of reach, in a direction in which no move of the forces helps; a torque out of reach.
    A search along rays makes sure that no other forces are as near, so that the answer is unique. Some fingers have
    no unique answer: two equal pairs over one joint, or three tendons over one joint, can change their forces so that
    neither torque nor stiffness changes. There the torque and the stiffness of the forces are compared, not the forces.
    """

    _known: dict[bytes, list[Answer]] = field(default_factory=dict, init=False, compare=False)
    _curves: dict[tuple[str, ...], Graph] = field(default_factory=dict, init=False, compare=False)

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Poses and limits as drawn, with demands for them."""
        dtype, (low, high) = drawn["q"].dtype, (drawn[end][:, 0] for end in ("f_min", "f_max"))
        answers = self.answers(drawn["q"], low, high)
        tau, K = (np.array([getattr(a, name) for a in answers]).astype(dtype) for name in ("tau", "K"))
        return {"q": drawn["q"], "tau": tau, "K": K, "f_min": low, "f_max": high}

    # -- demands ----------------------------------------------------------------------------------------------

    def answers(self, q: Array, low: Array, high: Array) -> list[Answer]:
        """One for every sample; the same for the same arguments, and then looked for once."""
        given = b"".join(each.tobytes() for each in (q, low, high))
        if given not in self._known:
            random = np.random.default_rng(len(q))
            P, dP = self.tendons(q)
            wishes = [_wish(s % 4, P[s], random) for s in range(len(q))]
            ends = [(float(low[s]), float(high[s])) for s in range(len(q))]
            first = [_forces(wish.share, wish.held, each) for wish, each in zip(wishes, ends, strict=True)]
            k, slope = self.curve(np.array(first).T, "k", "slope")
            pulls = [_pull(first[s], k[:, s], slope[:, s], P[s], dP[s]) for s in range(len(q))]
            self._known[given] = [self._answer(wishes[s], pulls[s], P[s], dP[s], ends[s]) for s in range(len(q))]
        return self._known[given]

    def _answer(self, wish: _Wish, pull: _Pull, P: Array, dP: Array, ends: Ends) -> Answer:
        """Forces, and the demand that they answer best.

        The stiffness is moved out of reach as far as nothing else comes as near: the distance is not convex in the
        forces, so that beyond some miss others are nearer.
        """
        pushed = bool(wish.push.any())
        for milder in 0.5 ** np.arange(MILDEST) * (wish.kind > 1):
            pulled, at, excess = self._out_of_reach(wish, pull, P, dP, ends, milder)
            tau = wish.push - P.T @ pulled.f
            answer = Answer(pulled.f, at, tau, pulled.K - excess, not pushed, _is_unique(P, pulled.growth))
            if self._is_nearest(answer, P, dP, ends):
                return answer
        raise ValueError("no demand is answered best by the forces it was made from")

    def _out_of_reach(
        self, wish: _Wish, pull: _Pull, P: Array, dP: Array, ends: Ends, milder: float
    ) -> tuple[_Pull, Array, Array]:
        """Forces, which of them are at a limit, and a miss of the stiffness that no small move makes less."""
        held, miss = wish.held, wish.miss * milder * np.abs(pull.K).max()
        for _ in range(2):  # which limit a held tendon is at depends on where the stiffness is out of reach
            excess = _out_of_reach(P, pull.growth, held, miss)
            prices = np.where(held != 0, _prices(P, pull.growth, held, excess), 0)
            if wish.push.any() or not np.any(held * prices > 0):
                return pull, held, excess
            held = -np.sign(prices).astype(int)
            f = _forces(wish.share, held, ends)
            k, slope = (each[:, 0] for each in self.curve(f[:, None], "k", "slope"))
            pull = _pull(f, k, slope, P, dP)
        return pull, held, excess * 0

    def _is_nearest(self, answer: Answer, P: Array, dP: Array, ends: Ends) -> bool:
        """Whether no forces along rays from the answer, through all that gives the same torque, are as near.

        Of pairs this is known: their stiffness is linear in sums that grow with the forces. Where the answer is not
        unique, others are as near and none may be nearer.
        """
        group = [int(i) for i in self.solver.strings["searched"].split(",") if i]
        if not group:
            return True
        rays = _rays(P[group])
        room = np.where(rays > 0, ends[1] - answer.f[group], ends[0] - answer.f[group])
        with np.errstate(divide="ignore", invalid="ignore"):
            length = np.where(np.abs(rays) > 1e-12, room / rays, np.inf).min(axis=1)
        away = np.outer(length, np.arange(1, POINTS + 1) / POINTS)[..., None] * rays[:, None]
        f = np.broadcast_to(answer.f, (*away.shape[:2], len(P))).copy()
        f[..., group] = np.clip(f[..., group] + away, *ends)
        distance = ((self._stiffness(f, P, dP) - answer.K) ** 2).sum(axis=(-2, -1))
        moved = np.abs(f - answer.f).max(axis=-1) > 1e-6 * ends[1]
        here = ((self._stiffness(answer.f, P, dP) - answer.K) ** 2).sum()
        if answer.unique:
            return not np.any(distance[moved] <= here)
        rounding = (1e-12 * np.abs(answer.K).max()) ** 2
        return not np.any(distance[moved] < here * (1 - 1e-9) - rounding)

    def _stiffness(self, f: Array, P: Array, dP: Array) -> Array:
        """Joint stiffness (..., n, n) of forces (..., m)."""
        k = self.curve(f.reshape(-1, len(P)).T, "k")[0].T.reshape(f.shape)
        return np.asarray(np.einsum("...i,ia,ib->...ab", k, P, P) + np.tensordot(f, dP, 1))

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
        """Of "k", "slope" and "curvature" (m, samples) of forces f (m, samples) those asked for, in an algebra."""
        if names not in self._curves:
            whole = self.graphs["tendon_stiffness"]
            outputs = tuple(output for output in whole.outputs if output.name in names)
            self._curves[names] = prune(Graph(whole.nodes, outputs))
        found = evaluate(self._curves[names], algebra or Floats(), lambda node: f[node[2]])
        columns = (found[name] for name in names)
        return columns if algebra else [np.stack([np.broadcast_to(c, f.shape[1]) for c in each]) for each in columns]

    # -- answers at 256 bits ----------------------------------------------------------------------------------

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """Where the free forces leave no slope along the moves that keep the torque; those at limits stay there."""
        q, samples = inputs["q"], len(inputs["q"])
        answers = self.answers(q, inputs["f_min"], inputs["f_max"])
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


def _wish(kind: int, P: Array, random: Any) -> _Wish:
    held, push = np.zeros(len(P), int), np.zeros(P.shape[1])
    share = random.uniform(size=len(P))
    if kind in (1, 2):
        held = _some_held(P, random)
    elif kind == 3:
        push = _push(P, random)
        held = -np.sign(np.where(np.abs(P @ push) > 1e-9, P @ push, 0)).astype(int)
    miss = random.normal(size=(P.shape[1], P.shape[1]))
    return _Wish(kind, share, held, push, (miss + miss.T) * UNREACHABLE)


def _pull(f: Array, k: Array, slope: Array, P: Array, dP: Array) -> _Pull:
    pairs = np.einsum("ia,ib->iab", P, P)
    K = np.tensordot(k, pairs, 1) + np.tensordot(f, dP, 1)
    return _Pull(f, K, slope[:, None, None] * pairs + dP)


def _forces(share: Array, held: Array, ends: Ends) -> Array:
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


def _rays(P: Array) -> Array:
    """Directions (rays, tendons) all around in which forces change and the torque does not."""
    moves = _null_space(P)
    if moves.shape[1] == 1:
        return np.concatenate([moves.T, -moves.T])
    around = np.random.default_rng(RAYS).normal(size=(RAYS, moves.shape[1]))
    if moves.shape[1] == 2:
        turn = 2 * np.pi * np.arange(RAYS) / RAYS
        around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.asarray(around @ moves.T)


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


def _is_unique(P: Array, growth: Array) -> bool:
    """Whether every pattern of forces changes the torque or the stiffness."""
    effects = np.concatenate([P / np.abs(P).max(), growth.reshape(len(P), -1) / np.abs(growth).max()], axis=1)
    sizes = np.linalg.svd(effects, compute_uv=False)
    return bool(len(sizes) == len(P) and sizes[-1] > DETERMINED * sizes[0])
