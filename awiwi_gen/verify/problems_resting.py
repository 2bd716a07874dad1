"""Joint angles of fingers whose springs give the equations that tendon lengths do not: exact solutions.

Samples are made from answers: under tendon forces that are drawn, a finger comes to rest where its energy is least within
the stops; the lengths there are the input. Answers at which a joint touches a stop with no force, or is about to, are
replaced by others: there the angles have no derivative by the lengths.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_mat

from awiwi_gen.errors import InputError
from awiwi_gen.ir.algebras import NUMPY_NAMES, Balls, Floats, ball
from awiwi_gen.ir.graph import Node
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.verify.problem import Problem
from awiwi_gen.verify.reference import Reference, reference
from awiwi_gen.verify.samples import rounded

Array = np.ndarray[Any, Any]

DESCENTS = 60  # Newton steps of a descent in doubles, at most
MULTIPLIERS = 30  # rounds of the method of multipliers, each of which gains two digits
STIFF = 100.0  # how much stiffer than the springs tendons are that lengths are found with
LONGEST = 0.2  # rad or m, of a step
MARGIN = (
    1e-3  # distance of a free joint from its stops, as a share of the range, and force on a stop, beside all others
)
LEAST_CURVATURE = 1e-3  # of the energy along motions that keep all lengths, relative to the largest
ROUNDS = 12  # of Newton's method at 256 bits
LAST_STEP = 1e-40  # rad; a shorter one changes no result of two doubles


class _Quick(Floats):
    """Doubles, with NumPy's functions: for answers that 256 bits make exact later."""

    def call(self, operation: str, *args: Any) -> Any:
        return getattr(np, NUMPY_NAMES.get(operation, operation))(*args)


@dataclass(frozen=True)
class State:
    """Fingers (samples s) at angles under tendon forces: lengths h (s, m), coupling P (s, m, n), balance (s, n), slope."""

    h: Array
    P: Array
    balance: Array
    slope: Array


@dataclass(frozen=True)
class Resting(Problem):
    """Joint angles where the springs hold the least energy that lengths and stops allow."""

    @property
    def sizes(self) -> tuple[int, int]:
        """Joints and tendons."""
        n = len(self.solver.arrays["low"])
        return n, len(self.solver.unknowns) - n

    @property
    def joints(self) -> list[int]:
        """The resting joints."""
        return list(self.solver.resting[0])

    @property
    def tendons(self) -> list[int]:
        """The tendons over them."""
        return list(self.solver.resting[1])

    @property
    def known(self) -> tuple[list[int], list[int]]:
        """The joints whose angles lengths tell by themselves, and the tendons for them."""
        n, m = self.sizes
        taken = {*self.joints, *self.solver.held}
        return [j for j in range(n) if j not in taken], [i for i in range(m) if i not in self.tendons]

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Measured lengths ``h`` of fingers at rest, and starts near them."""
        start, random = drawn["start"], np.random.default_rng(len(drawn["start"]))
        low, high = self._limits(start.dtype)
        pose, f = start.astype(np.float64), np.zeros((len(start), self.sizes[1]))
        state, held = self._state(pose, f), [*self.solver.held]
        if self.tendons:
            arms = state.P[:, self.tendons][:, :, self.joints]
            f[:, self.tendons] = np.abs(np.einsum("sij,sj->si", np.linalg.pinv(arms.swapaxes(1, 2)),
                                                  -state.balance[:, self.joints]))  # fmt: skip
        f = rounded(f * random.uniform(0.5, 1.5, (len(start), 1)))
        pose = rounded(self._descend(pose, f, low, high))
        good = np.flatnonzero(self._well_posed(pose, f, low, high))
        if not len(good):
            raise InputError("found no pose of the finger in which lengths and springs tell its angles, rather than stops; "
                             "leave its joint_estimate out with --only")  # fmt: skip
        chosen = [s if s in good else good[s % len(good)] for s in range(len(start))]
        pose = pose[chosen]
        pose[:, held] = pose[:, held].astype(start.dtype)
        lengths, near = self._state(pose, f).h, np.array(self.solver.near)
        nearby = np.clip(pose + random.uniform(-near, near, pose.shape), low, high)
        found = {"h": rounded(lengths).astype(start.dtype), "start": nearby.astype(start.dtype)}
        return found | ({"measured": pose[:, held].astype(start.dtype)} if held else {})

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """Angles at which energy and lengths are balanced at 256 bits; which joints are at stops, doubles tell."""
        low, high = self._limits(inputs["start"].dtype)
        h, q = inputs["h"].astype(np.float64), inputs["start"].astype(np.float64)
        if self.solver.held:
            q[:, [*self.solver.held]] = inputs["measured"]
        q, f = self._find(q, h, low, high)
        return reference({"q": self._polish(q, f, h, low, high)})

    def _limits(self, dtype: Any) -> tuple[Array, Array]:
        """Lower and upper limits of the angles, as the C has them."""
        low, high = (np.array(self.solver.arrays[end], dtype).astype(np.float64) for end in ("low", "high"))
        return low, high

    def _state(self, q: Array, f: Array) -> State:
        """The fingers in doubles."""
        columns, floats = {"q": q.T, "f": f.T}, _Quick(np.float64)

        def leaf(node: Node) -> Any:
            return floats.const(self.values[node[1]]) if node[0] == "param" else columns[node[1]][node[2]]

        (n, m), samples = self.sizes, len(q)
        with np.errstate(all="ignore"):
            found = [np.stack([np.broadcast_to(np.asarray(x, float), samples) for x in each], axis=1)
                     if len(each) else np.zeros((samples, 0)) for each in self._all(floats, leaf)]  # fmt: skip
        h, P, balance, slope = found
        return State(h, P.reshape(samples, m, n), balance, slope.reshape(samples, n, n))

    def _all(self, algebra: Any, leaf: Any) -> tuple[Any, Any, Any, Any]:
        rest = evaluate(self.graphs["resting_balance"], algebra, leaf)
        h = evaluate(self.graphs["tendon_lengths"], algebra, leaf)["h"]
        return h, evaluate(self.graphs["coupling"], algebra, leaf)["P"], rest["balance"], rest["slope"]

    def _descend(
        self, q: Array, f: Array, low: Array, high: Array, target: Array | None = None, stiff: float = 0.0
    ) -> Array:
        """The resting joints at the least energy within the stops, under forces f; with lengths that are held by stiff
        tendons, if a target is given. By Newton's method, made convex, in the free joints.
        """
        joints, tendons = self.joints, self.tendons
        q, (lower, upper) = np.array(q), (low[joints], high[joints])

        def pulled() -> State:
            state = self._state(q, f)
            if target is None:
                return state
            pulls = np.zeros_like(f)
            pulls[:, tendons] = stiff * (state.h - target)[:, tendons]
            return self._state(q, f + pulls)

        for _ in range(DESCENTS):
            state = pulled()
            arms = state.P[:, tendons][:, :, joints]
            hessian = state.slope[:, joints][:, :, joints] + stiff * arms.swapaxes(1, 2) @ arms
            slope, here = state.balance[:, joints], q[:, joints]
            free = ~(((here <= lower) & (slope > 0)) | ((here >= upper) & (slope < 0)))
            for _ in joints:  # one that would leave through its stop is held, too
                step = _newton(hessian, slope, free)
                free &= ~(((here <= lower) & (step < 0)) | ((here >= upper) & (step > 0)))
            room = np.where(step < 0, lower - here, upper - here)
            share = np.min(
                np.where(free & (step != 0), room / np.where(step == 0, 1, step), np.inf), axis=1, keepdims=True
            )
            step *= np.minimum(share, np.minimum(1.0, LONGEST / (np.abs(step).max(axis=1, keepdims=True) + 1e-300)))
            q[:, joints] = np.clip(here + step, lower, upper)
            before, after = (
                np.sum(each * step, axis=1, keepdims=True) for each in (slope, pulled().balance[:, joints])
            )
            # Where a string becomes taut on the way, the energy rises again: back to where it would be level.
            level = np.clip(before / np.minimum(before - after, -1e-300), 0.0, 1.0)
            q[:, joints] = np.where(after > 0, here + step * level, q[:, joints])
            if np.abs(q[:, joints] - here).max() < 1e-14:
                break
        return q

    def _find(self, q: Array, h: Array, low: Array, high: Array) -> tuple[Array, Array]:
        """Angles and tendon forces for lengths h (s, m): the method of multipliers, from a start."""
        known, others = self.known
        f = np.zeros((len(q), self.sizes[1]))
        for _ in range(DESCENTS if known else 0):
            state = self._state(q, f)
            inverse = np.linalg.pinv(state.P[:, others][:, :, known])
            step = np.einsum("sji,si->sj", inverse, (h - state.h)[:, others])
            q[:, known] = np.clip(q[:, known] + step, low[known], high[known])
            if np.abs(step).max() < 1e-14:
                break
        state, tendons = self._state(q, f), self.tendons
        stiff = STIFF * np.abs(state.slope).max() / max(np.abs(state.P[:, tendons]).max(initial=0.0), 1e-300) ** 2
        for _ in range(MULTIPLIERS if tendons else 1):
            q = self._descend(q, f, low, high, h, stiff if tendons else 0.0)
            missing = (self._state(q, f).h - h)[:, tendons]
            f[:, tendons] += stiff * missing
            if np.abs(missing).max(initial=0.0) < 1e-13:
                break
        return q, f

    def _polish(self, q: Array, f: Array, h: Array, low: Array, high: Array) -> list[list[arb]]:
        """The angles at 256 bits, with those joints at stops that are there; not a number where a stop would pull."""
        joints, tendons, (known, others), (n, m), samples = self.joints, self.tendons, self.known, self.sizes, len(q)
        width = (high - low) * 1e-9
        at_low, at_high = q <= low + width, q >= high - width
        q = np.where(at_low, low, np.where(at_high, high, q))
        balance = self._state(q, f).balance
        pulls: Any = ((at_low & (balance < 0)) | (at_high & (balance > 0)))[:, joints].any(axis=1)
        free = [[j for j in joints if not (at_low[s, j] or at_high[s, j])] for s in range(samples)]
        angles = [[arb(x) for x in column] for column in q.T.tolist()]
        forces = [[arb(x) for x in column] for column in f.T.tolist()]

        def leaf(node: Node) -> list[arb]:
            if node[0] == "param":
                return [ball(self.values[node[1]])] * samples
            return {"q": angles, "f": forces}[node[1]][node[2]]

        for _ in range(ROUNDS):
            found, P, rest, slope = self._all(Balls(samples), leaf)
            longest = 0.0
            for s in range(samples):
                away = [arb(float(h[s, i])) - found[i][s].mid() for i in range(m)]
                if known:
                    arms = arb_mat([[P[i * n + j][s].mid() for j in known] for i in others])
                    right = arms.transpose() * arb_mat([[away[i]] for i in others])
                    _move(angles, known, s, (arms.transpose() * arms).solve(right).entries())
                if not free[s]:
                    continue
                rows = [[slope[j * n + k][s].mid() for k in free[s]] + [P[i * n + j][s].mid() for i in tendons]
                        for j in free[s]]  # fmt: skip
                rows += [[P[i * n + j][s].mid() for j in free[s]] + [arb(0)] * len(tendons) for i in tendons]
                steps = (
                    arb_mat(rows)
                    .solve(arb_mat([[-rest[j][s].mid()] for j in free[s]] + [[away[i]] for i in tendons]))
                    .entries()
                )
                _move(angles, free[s], s, steps[: len(free[s])])
                _move(forces, tendons, s, steps[len(free[s]) :])
                longest = max([longest, *(abs(float(x)) for x in steps[: len(free[s])])])
            if longest < LAST_STEP:
                break
        return [[arb("nan") if pulls[s] else x for s, x in enumerate(column)] for column in angles]

    def _well_posed(self, q: Array, f: Array, low: Array, high: Array) -> Array:
        """Whether angles follow from lengths with a derivative: no joint between free and held, and enough free ones."""
        state, joints, tendons = self._state(q, f), self.joints, self.tendons
        margin, good = MARGIN * (high - low), list[bool]()
        inside: Any = np.minimum(q - low, high - q) > margin
        for s in range(len(q)):
            free, size = [j for j in joints if inside[s, j]], np.abs(state.slope[s]).max()
            held = [j for j in joints if not inside[s, j]]
            arms, scale = state.P[s][np.ix_(tendons, free)], np.abs(state.P[s, tendons]).max(initial=0.0)
            well = len(free) >= len(tendons)
            well &= all(q[s, j] in (low[j], high[j]) and abs(state.balance[s, j]) > MARGIN * size for j in held)
            well &= bool(np.abs(state.balance[s, free]).max(initial=0.0) < 1e-9 * size)
            if well and tendons:
                well = bool(np.linalg.matrix_rank(arms, LEAST_CURVATURE * scale) == len(tendons))
            if well and free:
                kept = np.linalg.svd(arms)[2][len(tendons) :] if tendons else np.eye(len(free))
                curvature = np.linalg.eigvalsh(kept @ state.slope[s][np.ix_(free, free)] @ kept.T)
                well = bool(curvature.min(initial=size) > LEAST_CURVATURE * size)
            good.append(well)
        return np.array(good)


def _newton(hessian: Array, slope: Array, free: Array) -> Array:
    """Newton's steps (s, n) in the free unknowns, as if the energy curved up by as much where it curves down."""
    kept = hessian * (free[:, :, None] & free[:, None, :])
    values, axes = np.linalg.eigh(kept)
    values = np.maximum(np.abs(values), 1e-6 * np.abs(values).max(axis=1, keepdims=True) + 1e-300)
    step: Array = -np.einsum("sij,sj,skj,sk->si", axes, 1 / values, axes, slope * free) * free
    return step


def _move(columns: list[list[arb]], chosen: list[int], sample: int, steps: Any) -> None:
    """Add steps to some unknowns of one sample."""
    for index, step in zip(chosen, steps, strict=True):
        columns[index][sample] = (columns[index][sample] + step).mid()
