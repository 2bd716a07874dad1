"""Gains of the impedance law from its feedback gains (eq. 16.4): reachable feedback gains, and solutions at 256 bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_mat

from awiwi_gen.ir.algebras import Balls, Floats
from awiwi_gen.ir.graph import Node
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.verify.problem import Problem
from awiwi_gen.verify.reference import Reference, reference

Array = np.ndarray[Any, Any]

ROUNDS = 30  # of Newton's method, which converges quadratically
AWAY = 0.05  # relative distance of starts from the gains: several gains can have the same feedback gains


@dataclass(frozen=True)
class GainMatching(Problem):
    """Joints of all sizes, with gains whose terms in the closed loop are of similar size, so that all are observable."""

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Feedback gains of known gains, and start values near these."""
        plant, samples, dtype = drawn["plant"], len(drawn["plant"]), drawn["plant"].dtype
        random = np.random.default_rng(samples)
        m, _, k = plant.T.astype(np.float64)
        stiffness = k * random.uniform(0.2, 2, samples)
        pace = np.sqrt(stiffness / m)
        damping = m * pace * random.uniform(0.4, 1.0, samples)
        fast, slow = pace * random.uniform(1.0, 2.0, samples), pace * random.uniform(0.1, 0.4, samples)
        weight = random.uniform(2.0, 8.0, samples) / stiffness
        inertia = weight / (fast * slow) / random.uniform(0.2, 1.0, samples)
        inputs = {
            "plant": plant,
            "weights": np.stack([weight, inertia], axis=1).astype(dtype),
            "start": np.stack([stiffness, damping, fast, slow], axis=1),
        }

        def leaf(node: Node) -> Any:
            return inputs["start" if node[1] == "gains" else node[1]][:, node[2]].astype(np.float64)

        feedback = evaluate(self.graphs["backstepping_state_gains"], Floats(), leaf)["K_cancelled"]
        nearby = inputs["start"] * random.uniform(1 - AWAY, 1 + AWAY, (samples, 4))
        return {"K_opt": np.stack(feedback, axis=1).astype(dtype), **inputs, "start": nearby.astype(dtype)}

    def solve(self, inputs: Mapping[str, Array]) -> Reference:
        """The gains near the starts, by Newton's method."""
        samples = len(inputs["start"])
        columns = {name: [[arb(x) for x in c] for c in a.T.astype(np.float64).tolist()] for name, a in inputs.items()}
        gains = columns["start"]

        def leaf(node: Node) -> list[arb]:
            return (gains if node[1] == "gains" else columns[node[1]])[node[2]]

        for _ in range(ROUNDS):
            K = evaluate(self.graphs["backstepping_state_gains"], Balls(samples), leaf)["K_cancelled"]
            dK = evaluate(self.graphs["backstepping_state_gains_derivatives"], Balls(samples), leaf)["dK"]
            for s in range(samples):
                missing = arb_mat(4, 1, [(columns["K_opt"][i][s] - K[i][s]).mid() for i in range(4)])
                step = arb_mat(4, 4, [slope[s].mid() for slope in dK]).solve(missing)
                for j in range(4):
                    gains[j][s] = (gains[j][s] + step[j, 0]).mid()
        return reference({"impedance": gains[:2], "rates": gains[2:]})
