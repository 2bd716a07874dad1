"""The problems that solvers of csrc solve: well-posed inputs, and exact solutions to hold the results against."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, arb_mat

from awiwi_gen.ir.algebras import Balls, Floats, ball
from awiwi_gen.ir.graph import Graph, Node
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.verify.reference import Reference, reference

Array = np.ndarray[Any, Any]
Graphs = Mapping[str, Graph]
Values = Mapping[str, Fraction]

NOISE = 2.5e-4  # error of a measured length [m]; keeps the estimate inside the limits it starts in
ROUNDS = 30  # of Gauss-Newton at 256 bits: the residual is small, each round gains a digit at least


class LeastSquares:
    """Joint angles whose tendon lengths are nearest to the measured ones (eq. 5.14, 5.24).

    Half of the samples are exact lengths of poses in the whole range, limits included; the others carry noise
    on poses away from the limits, for there the exact solution is a stationary point.
    """

    def sample(self, drawn: dict[str, Array], graphs: Graphs, values: Values) -> dict[str, Array]:
        """Measured lengths ``h`` of poses, and starts up to 0.2 rad away from them."""
        start = drawn["start"]
        low, high = start.min(axis=0), start.max(axis=0)
        middle, noisy = (low + high) / 2, np.arange(len(start)) % 2 == 1
        random = np.random.default_rng(len(start))
        pose = np.where(noisy[:, None], middle + 0.7 * (start - middle), start)
        lengths = self._lengths(graphs["tendon_lengths"], pose, values)
        lengths = lengths + np.where(noisy[:, None], random.uniform(-NOISE, NOISE, lengths.shape), 0)
        begun = np.clip(pose + random.uniform(-0.2, 0.2, pose.shape), low, high)
        return {"h": lengths.astype(start.dtype), "start": begun.astype(start.dtype)}

    def _lengths(self, graph: Graph, q: Array, values: Values) -> Array:
        def leaf(node: Node) -> Any:
            return Floats().const(values[node[1]]) if node[0] == "param" else q[:, node[2]].astype(np.float64)

        columns = evaluate(graph, Floats(), leaf)["h"]
        return np.stack([np.broadcast_to(c, (len(q),)) for c in columns], axis=1)

    def solve(self, inputs: Mapping[str, Array], graphs: Graphs, values: Values) -> Reference:
        """The stationary points near the starts, by undamped Gauss-Newton at 256 bits."""
        samples, n = inputs["start"].shape
        q = [[arb(x) for x in column] for column in inputs["start"].T.astype(np.float64).tolist()]
        measured = [[arb(x) for x in column] for column in inputs["h"].T.astype(np.float64).tolist()]
        for _ in range(ROUNDS):

            def leaf(node: Node, q: Any = q) -> list[arb]:
                return [ball(values[node[1]])] * samples if node[0] == "param" else q[node[2]]

            h = evaluate(graphs["tendon_lengths"], Balls(samples), leaf)["h"]
            P = evaluate(graphs["coupling"], Balls(samples), leaf)["P"]
            for s in range(samples):
                jacobian = arb_mat(len(h), n, [column[s] for column in P])
                residual = arb_mat(len(h), 1, [(a[s] - b[s]).mid() for a, b in zip(measured, h, strict=True)])
                turned = jacobian.transpose()
                step = (turned * jacobian).solve(turned * residual)
                for j in range(n):
                    q[j][s] = (q[j][s] + step[j, 0]).mid()
        return reference({"q": q})


PROBLEMS = {"least squares": LeastSquares()}
