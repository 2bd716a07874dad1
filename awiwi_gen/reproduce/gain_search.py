"""Algorithm 3, corrected: random gains of the impedance law, the best by their feedback gains (section 16.3).

The printed algorithm stores the feedback gains of the best draw instead of the draw itself, and draws each gain from
(0, 1), which contains no useful K_3 or K_4. Its cost is the distance of two vectors whose elements differ in their units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.loops.joint import UNIT_WEIGHTS, Plant
from awiwi_gen.simulate import Array

Box = tuple[tuple[float, float, float, float], tuple[float, float, float, float]]

PRINTED_BOX: Box = ((0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0))  # rand(1, 4)
USEFUL_BOX: Box = ((1e-3, 1e-6, 1.0, 1.0), (1e2, 1e-1, 1e4, 1e4))  # K_p, K_d, K_3, K_4


@dataclass(frozen=True)
class Found:
    """The best draw (K_p, K_d, K_3, K_4) and its cost."""

    gains: Array
    cost: float


def draw(box: Box, samples: int, seed: int) -> Array:
    """Gains (samples, 4) inside a box: uniform if it begins at zero, else uniform in their logarithms."""
    random, (low, high) = np.random.default_rng(seed), np.array(box)
    if not low.all():
        return random.uniform(low, high, (samples, 4))
    return np.exp(random.uniform(np.log(low), np.log(high), (samples, 4)))


def nearest(library: Any, plant: Plant, wanted: Array, drawn: Array, relative: bool = True) -> Found:
    """The draw whose feedback gains on the plant of table 16.1 are nearest to the wanted ones (eq. 16.4).

    ``relative`` divides each error by the wanted gain; otherwise the third gain, of thousands, dominates.
    """
    feedback = library.backstepping_state_gains(plant=plant.numbers, gains=drawn, weights=UNIT_WEIGHTS).K_cancelled
    costs = np.linalg.norm((feedback - wanted) / (wanted if relative else 1.0), axis=-1)
    best = int(costs.argmin())
    return Found(drawn[best], float(costs[best]))
