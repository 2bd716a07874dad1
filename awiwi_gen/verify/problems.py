"""Estimation of joint angles from tendon lengths, and the table of all problems that solvers of csrc solve."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, arb_mat

from awiwi_gen.ir.algebras import Balls, Floats, ball
from awiwi_gen.ir.graph import Graph, Node
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.kernel import Solver
from awiwi_gen.verify.problem import Problem
from awiwi_gen.verify.problems_distribution import Distribution
from awiwi_gen.verify.problems_gains import GainMatching
from awiwi_gen.verify.problems_resting import Resting
from awiwi_gen.verify.problems_riccati import JointRegulator, Riccati
from awiwi_gen.verify.problems_update import DistributionUpdate
from awiwi_gen.verify.reference import Reference, reference
from awiwi_gen.verify.samples import rounded

Array = np.ndarray[Any, Any]

NOISE = 2.5e-4  # error of a measured length [m]
ROUNDS = 100  # of Gauss-Newton at 256 bits, at most: the residual is small, so a round gains a digit or more
LEAST_EIGENVALUE = 0.01  # of P'P at any pose, relative to the largest at all: below it spans do not determine joints
SAME_COST = arb(2) ** -200  # a rise of the cost by this share is rounding
LAST_STEP = 1e-40  # largest step [rad] after which another would not change the result as two doubles


class Descent:
    """One sample on its way to a minimum within limits: angles reached, the next to try, and the step between them."""

    def __init__(self, start: list[arb], low: list[arb], high: list[arb]) -> None:
        self.low, self.high = low, high
        self.reached = self.trial = start
        self.step = [arb(0)] * len(start)
        self.cost: arb | None = None

    @property
    def length(self) -> float:
        """The largest change of an angle [rad] by the next step."""
        return max(abs(float(a - b)) for a, b in zip(self.trial, self.reached, strict=True))

    def move(self, residual: list[arb], coupling: list[arb]) -> None:
        """Choose the next trial from lengths (m) [m] that are missing at this one, and the coupling (m n) [m]."""
        cost = sum((x * x for x in residual), arb(0)).mid()
        if self.cost is None or cost <= self.cost * (1 + SAME_COST):
            self.reached, self.cost = self.trial, cost
            self.step = self._newton(
                arb_mat(len(residual), len(self.low), coupling), arb_mat(len(residual), 1, residual)
            )
        else:
            self.step = [(x / 2).mid() for x in self.step]
        ends = zip(self.reached, self.step, self.low, self.high, strict=True)
        self.trial = [min(max((x + step).mid(), low), high) for x, step, low, high in ends]

    def _newton(self, jacobian: arb_mat, residual: arb_mat) -> list[arb]:
        """The step of Gauss and Newton; zero for unknowns at a limit that the slope pushes against it."""
        q, low, high, step = self.reached, self.low, self.high, [arb(0)] * len(self.low)
        downhill = (jacobian.transpose() * residual).entries()
        free = [
            j for j in range(len(q))
            if not (q[j] <= low[j] and downhill[j] <= 0) and not (q[j] >= high[j] and downhill[j] >= 0)
        ]  # fmt: skip
        if free:
            columns = arb_mat([[jacobian[i, j] for j in free] for i in range(jacobian.nrows())])
            found = (columns.transpose() * columns).solve(columns.transpose() * residual).entries()
            for j, change in zip(free, found, strict=True):
                step[j] = change.mid()
        return step


@dataclass(frozen=True)
class LeastSquares(Problem):
    """Joint angles whose tendon lengths are nearest to the measured ones (eq. 5.14, 5.24).

    Half of the samples are exact lengths of poses in the whole range, limits included; the others carry noise, on
    poses in the middle of the range. Angles of joints that are held are exactly those of the pose.
    """

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Measured lengths ``h`` of poses, and starts near them."""
        start = drawn["start"]
        low, high = start.min(axis=0), start.max(axis=0)
        middle, noisy = (low + high) / 2, np.arange(len(start)) % 2 == 1
        random, near = np.random.default_rng(len(start)), np.array(self.solver.near)
        pose = np.where(noisy[:, None], middle + 0.7 * (start - middle), start)
        lengths, _ = self.model(pose.astype(np.float64))
        lengths = lengths + np.where(noisy[:, None], random.uniform(-NOISE, NOISE, lengths.shape), 0)
        nearby = np.clip(pose + random.uniform(-near, near, pose.shape), low, high)
        found = {"h": rounded(lengths).astype(start.dtype), "start": nearby.astype(start.dtype)}
        held = [*self.solver.held]
        return found | ({"measured": pose[:, held].astype(start.dtype)} if held else {})

    def model(self, q: Array, own: bool = False) -> tuple[Array, Array]:
        """Lengths (samples, m) and coupling (samples, m, n) at q (samples, n), in the precision of q, bit for bit as C."""
        floats = Floats(q.dtype.type, own)
        at_rest = np.zeros(len(q), q.dtype)

        def leaf(node: Node) -> Any:
            return floats.const(self.values[node[1]]) if node[0] == "param" else self._angle(node, q.T, at_rest)

        h, P = (
            np.stack([np.broadcast_to(c, len(q)) for c in columns], axis=1).astype(q.dtype)
            for columns in self._evaluate(floats, leaf)
        )
        return h, P.reshape(len(q), h.shape[1], q.shape[1])

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """The minima near the starts, by Gauss-Newton at 256 bits, with steps halved until they lower the cost.

        An unknown pushed against a limit stays: a noisy length leads past a limit where the joint's range is narrow.
        """
        samples, n = inputs["start"].shape
        q = [[arb(x) for x in column] for column in inputs["start"].T.astype(np.float64).tolist()]
        measured = [[arb(x) for x in column] for column in inputs["h"].T.astype(np.float64).tolist()]
        low, high = ([[arb(float(x))] * samples for x in end] for end in self.limits(inputs["start"].dtype))
        for index, column in zip(self.solver.held, inputs.get("measured", np.empty((0, 0))).T, strict=True):
            q[index] = low[index] = high[index] = [arb(float(x)) for x in column]
        at_rest = [arb(0)] * samples
        minima = [Descent(*([column[s] for column in each] for each in (q, low, high))) for s in range(samples)]
        for _ in range(ROUNDS):

            def leaf(node: Node, q: Any = q) -> list[arb]:
                return [ball(self.values[node[1]])] * samples if node[0] == "param" else self._angle(node, q, at_rest)

            h, P = self._evaluate(Balls(samples), leaf)
            for s, minimum in enumerate(minima):
                residual = [(a[s] - b[s]).mid() for a, b in zip(measured, h, strict=True)]
                minimum.move(residual, [column[s].mid() for column in P])
            q = [[minimum.trial[j] for minimum in minima] for j in range(n)]
            if max(minimum.length for minimum in minima) < LAST_STEP:
                break
        return reference({"q": q})

    def limits(self, dtype: Any) -> tuple[Array, Array]:
        """Lower and upper limits of the unknowns, as the C has them."""
        low, high = (np.array(self.solver.arrays[end], dtype) for end in ("low", "high"))
        return low, high

    def _angle(self, node: Node, q: Any, at_rest: Any) -> Any:
        """A joint angle for the kernels used: one of the unknowns q (n, samples), or the angle of a joint at rest."""
        unknowns = self.solver.unknowns
        return q[unknowns.index(node[2])] if node[2] in unknowns else at_rest

    def _evaluate(self, algebra: Any, leaf: Any) -> tuple[list[Any], list[Any]]:
        """The lengths in the problem's equations, and the coupling by its unknowns, row by row."""
        h = evaluate(self.graphs["tendon_lengths"], algebra, leaf)["h"]
        P = evaluate(self.graphs["coupling"], algebra, leaf)["P"]
        rows, columns, width = self.solver.equations, self.solver.unknowns, len(P) // len(h)
        return [h[i] for i in rows], [P[i * width + j] for i in rows for j in columns]


class GradientSearch(LeastSquares):
    """The same problem by the corrected algorithm 1, whose arithmetic is repeated here operation by operation.

    It makes a fixed number of trials, so it reaches the minimum only where the spans determine the joints well. On
    other fingers the algorithm stops up to a radian away. There its result must still match its mirror in every bit,
    which fixes it completely, and end no farther from the measured lengths than it started.
    """

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """The minima near the starts; where the trials need not reach these, no increase of the cost."""
        if self.converges(inputs["start"]):
            return super().solve(inputs)
        return reference({"increase": [[arb(0)] * len(inputs["start"])]})

    def converges(self, q: Array) -> bool:
        """Whether the spans determine the joints at all poses q, and a descent gets there within its trials.

        A trial of the length 2 / trace(P'P) times the gradient leaves 1 - 2 lambda / trace of the error along an
        eigenvector of P'P with the eigenvalue lambda; of a single unknown it turns the sign of the error and no more.
        Where an eigenvalue vanishes inside the range, two poses have the same lengths. The step is chosen at the start,
        so the least eigenvalue of any pose counts against the greatest trace, and half of the trials may be lost.
        """
        _, P = self.model(q.astype(np.float64))
        values = np.linalg.eigvalsh(np.swapaxes(P, 1, 2) @ P)
        if not values.min() > LEAST_EIGENVALUE * values.max():
            return False
        traces, least = values.sum(axis=1), min(self.solver.tolerance.values())
        left = np.abs(1 - 2 * values / traces[:, None]) ** self.solver.iterations
        slowest = (1 - 2 * values.min() / traces.max()) ** (self.solver.iterations // 2)
        return bool(max(left.max(), slowest) < least)

    def observed(self, inputs: Mapping[str, Array], found: Any) -> Mapping[str, Array]:
        """The angles found, and the increase of the cost from the start, relative to the cost of all lengths."""
        start, h = (inputs[name].astype(np.float64) for name in ("start", "h"))
        before, after = (self._cost(q.astype(np.float64), h, False)[0] for q in (start, found.q))
        return {"q": found.q, "increase": np.maximum(0, after - before) / (h * h).sum(axis=1)}

    def mirror(self, inputs: Mapping[str, Array], own: bool) -> Mapping[str, Array]:
        """The result after all trials, in the order of operations of csrc."""
        start, measured = inputs["start"], inputs["h"]
        low, high = self.limits(start.dtype)
        q = _clamped(start, low, high)
        best, gradient, curvature = self._cost(q, measured, own)
        step = 1 / curvature
        for _ in range(1, self.solver.iterations):
            trial = _clamped(q - 2 * step[:, None] * gradient, low, high)
            found, trial_gradient, _ = self._cost(trial, measured, own)
            better = found < best
            q, gradient = (np.where(better[:, None], a, b) for a, b in ((trial, q), (trial_gradient, gradient)))
            best, step = np.where(better, found, best), np.where(better, step, step / 2)
        return {"q": q}

    def _cost(self, q: Array, measured: Array, own: bool) -> tuple[Array, Array, Array]:
        """Half the squared residual, its gradient, and the trace of P'P, summed in the order of the tendons."""
        h, P = self.model(q, own)
        residual = h - measured
        total, trace = np.zeros_like(q[:, 0]), np.zeros_like(q[:, 0])
        gradient, squares = np.zeros_like(q), np.zeros_like(q)
        for i in range(h.shape[1]):
            total = total + residual[:, i] * residual[:, i]
            gradient = gradient + P[:, i] * residual[:, i, None]
            squares = squares + P[:, i] * P[:, i]
        for j in range(q.shape[1]):
            trace = trace + squares[:, j]
        return total / 2, gradient, trace


def _clamped(x: Array, low: Array, high: Array) -> Array:
    return np.where(x < low, low, np.where(x > high, high, x))


PROBLEMS: Mapping[str, Callable[[Solver, Mapping[str, Graph], Mapping[str, Fraction]], Problem]] = {
    "least squares": LeastSquares,
    "gradient search": GradientSearch,
    "resting": Resting,
    "distribution": Distribution,
    "distribution update": DistributionUpdate,
    "riccati": Riccati,
    "joint regulator": JointRegulator,
    "gain matching": GainMatching,
}
