"""Stability of a law with its gains on the hand's clock and one sample of delay, from the loop of the compiled kernels.

At rest dry friction is a stiff damper, and makes nearly all gains look stable; while a motor slides it is a constant
torque, and damps nothing. Gains must be stable in both cases.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from awiwi_gen.compare.laws import Law
from awiwi_gen.errors import InputError
from awiwi_gen.loops.hand_joint import Joint, loop_around, values_of
from awiwi_gen.loops.linearised import STABLE, SampledLoop
from awiwi_gen.loops.nearest import nearest
from awiwi_gen.simulate import Machine, Scenario, simulate

SPARE = (0.0, 0.25, 0.5, 0.75, 1.0)  # periods of additional delay at which the nearest gains must be stable
RESTING = 600  # ticks for which noise is recorded
SETTLING = 12  # ticks until all signals of a law are constant


@dataclass(frozen=True)
class Clocked:
    """A law with gains on the clock: spectral radius, and delay margin [s] beyond the one sample.

    ``noise`` is the largest torque commanded because of sensor noise alone, as a share of the motors' limit; ``period`` [s]
    is that of the clock.
    """

    law: str
    gains: Mapping[str, float]
    radius: float
    margin: float
    noise: float
    period: float

    @property
    def runs(self) -> bool:
        """Whether the loop is stable and noise does not saturate the motors."""
        return self.radius < STABLE and self.noise < 1

    @property
    def reason(self) -> str:
        """The reason, in words."""
        clock = f"{1 / self.period:.0f} Hz and one sample of delay"
        if self.radius >= STABLE:
            return f"unstable at {clock}: spectral radius {self.radius:.4g}"
        if self.noise >= 1:
            return f"stable at {clock}, but the sensors' noise alone drives the motors to their limit"
        return f"stable at {clock}: spectral radius {self.radius:.4f}, delay margin {self.margin * 1e6:.0f} us"

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self) | {"runs": self.runs}


def clocked(library: Any, law: Law, gains: Mapping[str, float], joint: Joint, force: float) -> Clocked:
    """Stability of a law with gains. Raises InputError where its kernels refuse them."""
    loops = loops_of(library, law, gains, joint, force)
    radius = max(loop.radius(0.0) for loop in loops)
    spare = min(loop.margin() for loop in loops) if radius < STABLE else 0.0
    return Clocked(law.name, dict(gains), radius, spare, noise(library, law, gains, joint, force), joint.period)


def noise(library: Any, law: Law, gains: Mapping[str, float], joint: Joint, force: float) -> float:
    """The largest deviation of the command from its mean at rest, as a share of the motors' limit."""
    values = values_of(joint, joint.believed(), force) | law.values(library, joint.believed(), force, gains)
    loop = loop_around(joint, list(law.blocks))
    (trace,) = simulate(library, loop, [Scenario(values, RESTING, seed=1)], ["wanted"])
    command = trace["wanted"][RESTING // 3 :]
    return float(np.abs(command - command.mean(axis=0)).max() / joint.limit) if len(command) else float("inf")


def loops_of(library: Any, law: Law, gains: Mapping[str, float], joint: Joint, force: float) -> list[SampledLoop]:
    """The linearised loop with sliding motors, then with motors at rest."""
    sliding = replace(joint, friction=joint.friction * [1, 0, 1])
    loops = []
    for each in (sliding, joint):
        values = values_of(each, each.believed(), force) | law.values(library, each.believed(), force, gains)
        machine = Machine(library, loop_around(each, list(law.blocks)).exact(), Scenario(values, 0))
        for _ in range(SETTLING):
            machine.signals[:] = machine.tick(machine.signals)
        loops.append(SampledLoop(machine))
    return loops


def running_gains(library: Any, law: Law, gains: Mapping[str, float], joint: Joint, force: float) -> Clocked | None:
    """The nearest stable gains, and their stability: they are stable with another sample of delay, too."""

    def works(chosen: Mapping[str, float]) -> bool:
        try:
            if noise(library, law, chosen, joint, force) >= 1:  # the cheaper check; it also finds most unstable gains
                return False
            loops = loops_of(library, law, chosen, joint, force)
        except InputError:
            return False
        return all(loop.radius(late) < STABLE for loop in loops for late in SPARE)

    def radius(chosen: Mapping[str, float]) -> float:
        try:
            return max(loop.radius(1.0) for loop in loops_of(library, law, chosen, joint, force))
        except InputError:
            return float("inf")

    found = nearest(gains, {name: gain.power for name, gain in law.gains.items()}, works, radius)
    return clocked(library, law, found.gains, joint, force) if found else None


def require_clocked(library: Any, law: Law, gains: Mapping[str, float], joint: Joint, force: float) -> Clocked:
    """Stability of gains. Raises InputError for gains that cannot run, with the reason and the nearest that can."""
    found = clocked(library, law, gains, joint, force)
    if found.runs:
        return found
    way_out = running_gains(library, law, gains, joint, force)
    if way_out is None:
        instead = "no other bandwidth and no change of gains was found that helps"
    else:
        changed = ", ".join(f"{name} = {value:.4g}" for name, value in way_out.gains.items() if value != gains[name])
        instead = f"the nearest that run have {changed} ({way_out.reason})"
    raise InputError(f"{law.name}: these gains are {found.reason}; {instead}")
