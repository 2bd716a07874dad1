"""Updates of tendon forces from the last ones: the demands of `problems_distribution`, met step by step."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.verify.problems_distribution import Array, Distribution

UPDATES = 8  # from the last forces to the answer, at most
LAST = 0.05  # of the range of forces: how far the last forces may be from the answer


@dataclass(frozen=True)
class DistributionUpdate(Distribution):
    """The same demands, with last forces that are farther from the answer than a tick's demands move it."""

    def sample(self, drawn: dict[str, Array]) -> dict[str, Array]:
        """Poses and limits as drawn, with demands for them, and forces near the answers."""
        demands = super().sample(drawn)
        low, high = (demands[end][:, None].astype(np.float64) for end in ("f_min", "f_max"))
        answers = np.array([answer.f for answer in self.answers(demands["q"], demands["f_min"], demands["f_max"])])
        moved = np.random.default_rng(len(answers)).uniform(-LAST, LAST, answers.shape) * (high - low)
        return demands | {"f_last": np.clip(answers + moved, low, high).astype(drawn["f_last"].dtype)}

    def run(self, call: Callable[..., Any], inputs: Mapping[str, Array]) -> Any:
        """Some updates, each on from the forces of the one before: they end at the answer, and then stay."""
        found = call(**inputs)
        for _ in range(UPDATES - 1):
            found = call(**{**inputs, "f_last": found.f})
        return found
