"""The loop of compiled kernels on a clock, linearised: spectral radius and delay margin.

The state includes all memory of the law: observers, reference filters. Between samples the plant moves by its matrix
exponential, and a torque with an additional delay acts for the rest of its period only.
"""

from __future__ import annotations

import numpy as np

from awiwi_gen.loops.nearest import least
from awiwi_gen.loops.sampled import hold
from awiwi_gen.simulate import Array, Machine, slopes

STABLE = 1 - 1e-6  # largest spectral radius that counts as stable: slopes have rounding errors
LONGEST = 6  # periods: the longest delay that is tried
FINE = 6  # steps per period of the search for the delay margin
HALVINGS = 20


class SampledLoop:
    """The linear map of a loop from one sample to the next, about its present signals, for any delay of the torques.

    The machine cannot be used afterwards. Its loop has actuators that are late by one period.
    """

    def __init__(self, machine: Machine, applied: str = "u") -> None:
        self.period = machine.loop.period
        inputs = machine.indices(applied)
        self.A: Array = machine.plant_slopes()
        self.B: Array = slopes(machine.rates, machine.signals, np.array(inputs))
        machine.freeze_plant()
        memory = np.array(machine.memory())
        law: Array = slopes(lambda signals: machine.tick(signals)[memory], machine.signals, memory)
        read = np.abs(law).any(axis=0) | (memory < machine.states) | np.isin(memory, inputs)
        self.inputs = np.searchsorted(memory[read], inputs)
        self.law: Array = law[np.ix_(read, read)]
        self.law[: machine.states] = np.eye(machine.states, read.sum())  # the law takes no time

    def radius(self, delay: float) -> float:
        """Spectral radius with torques that are delayed by this many periods more."""
        whole, part = divmod(delay, 1.0)
        size, (n, p) = len(self.law), self.B.shape
        loop = np.zeros((size + (int(whole) + 1) * p,) * 2)
        loop[:size, :size] = self.law
        queue = np.arange(size, len(loop)).reshape(-1, p)  # torques of the last samples, newest first
        loop[queue[0]] = loop[self.inputs]
        for later, earlier in zip(queue[1:], queue[:-1], strict=True):
            loop[later, earlier] = 1
        first, second = (hold(self.A, self.B, self.period * share) for share in (part, 1 - part))
        unit = np.eye(len(loop))
        before, after = unit[queue[int(whole)]], unit[queue[int(whole) - 1]] if whole else loop[self.inputs]
        loop[:n] = second[0] @ (first[0] @ loop[:n] + first[1] @ before) + second[1] @ after
        return float(np.abs(np.linalg.eigvals(loop)).max())

    def margin(self) -> float:
        """The shortest additional delay [s] at which a pole reaches the unit circle; infinite if none does."""
        found = least(lambda share: self.radius(share * LONGEST) >= STABLE, LONGEST * FINE, HALVINGS)
        return found[0] * LONGEST * self.period if found else float("inf")
