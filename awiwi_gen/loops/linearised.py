"""The loop of compiled kernels on a clock, linearised: spectral radius, and how much more delay it bears.

All that a law keeps from one sample to the next belongs to the state, observers and reference filters too. Between
samples the plant moves by its matrix exponential, and a torque that comes some time later acts for the rest of its
period only: so the delay margin is that of the sampled loop itself.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from awiwi_gen.simulate import Array, Machine, slopes

STABLE = 1 - 1e-6  # what is called stable on the clock: rounding of slopes leaves that much
LONGEST = 6  # periods: no more delay is asked for
FINE = 6  # steps per period of the search for the delay margin
HALVINGS = 20


class SampledLoop:
    """The linear map of a loop from one sample to the next, about its present signals, for any delay of the torques.

    The machine is used up: no time passes in it any more. Its loop has actuators that are late by one period.
    """

    def __init__(self, machine: Machine, applied: str = "u") -> None:
        self.period = machine.loop.period
        acting = machine.indices(applied)
        self.A: Array = machine.plant_slopes()
        self.B: Array = slopes(machine.rates, machine.signals, np.array(acting))
        machine.freeze_plant()
        places = np.array(machine.memory())
        map_of: Array = slopes(lambda signals: machine.tick(signals)[places], machine.signals, places)
        read = np.abs(map_of).any(axis=0) | (places < machine.states) | np.isin(places, acting)
        self.acting = np.searchsorted(places[read], acting)
        self.thought: Array = map_of[np.ix_(read, read)]
        self.thought[: machine.states] = np.eye(machine.states, read.sum())  # the law takes no time

    def radius(self, late: float) -> float:
        """Spectral radius with torques that come ``late`` periods after their sample."""
        whole, part = divmod(late, 1.0)
        size, (n, p) = len(self.thought), self.B.shape
        loop = np.zeros((size + (int(whole) + 1) * p,) * 2)
        loop[:size, :size] = self.thought
        queue = np.arange(size, len(loop)).reshape(-1, p)  # torques of the last samples, newest first
        loop[queue[0]] = loop[self.acting]
        for later, earlier in zip(queue[1:], queue[:-1], strict=True):
            loop[later, earlier] = 1
        first, second = self._moved(part), self._moved(1 - part)
        now = queue[int(whole) - 1] if whole else None
        at_start = np.eye(len(loop))[queue[int(whole)]]
        after = loop[self.acting] if now is None else np.eye(len(loop))[now]
        moved = second[0] @ (first[0] @ loop[:n] + first[1] @ at_start) + second[1] @ after
        loop[:n] = moved
        return float(np.abs(np.linalg.eigvals(loop)).max())

    def margin(self) -> float:
        """The shortest delay [s] beyond the one sample at which a pole reaches the unit circle; infinite if none does."""
        for step in range(1, LONGEST * FINE + 1):
            if self.radius(step / FINE) >= STABLE:
                good, bad = (step - 1) / FINE, step / FINE
                for _ in range(HALVINGS):
                    middle = (good + bad) / 2
                    good, bad = (good, middle) if self.radius(middle) >= STABLE else (middle, bad)
                return good * self.period
        return float("inf")

    def _moved(self, part: float) -> tuple[Array, Array]:
        """The plant's state after a part of a period, by the state before and by the torques meanwhile."""
        n, p = self.B.shape
        step = expm(np.block([[self.A, self.B], [np.zeros((p, n + p))]]) * (self.period * part))
        return step[:n, :n], step[:n, n:]
