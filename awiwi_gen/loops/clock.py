"""Stability of a law with its gains on the hand's clock and one sample of delay, from the loop of the compiled kernels.

At rest dry friction is a stiff damper, and makes nearly all gains look stable; while a motor slides it is a constant
torque, and damps nothing. Gains must be stable in both cases.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.loops.hand_joint import Joint, loop_around, values_of
from awiwi_gen.loops.laws import Law
from awiwi_gen.loops.linearised import LONGEST, STABLE, SampledLoop
from awiwi_gen.loops.nearest import nearest
from awiwi_gen.loops.scenarios import CYCLE, PLANTS
from awiwi_gen.loops.search import judged
from awiwi_gen.simulate import Machine, Scenario, simulate

SPARE = (0.0, 0.25, 0.5, 0.75, 1.0)  # periods of additional delay at which the nearest gains must be stable
RESTING = 600  # ticks for which noise is recorded
TRIED = (0.5, 0.999)  # shares of the smallest margin so far, at which other plants must be stable
SETTLING = 12  # ticks until all signals of a law are constant


KNOWN = {"as known": PLANTS["as known"]}


@dataclass(frozen=True)
class Clocked:
    """A law with gains on the clock: worst spectral radius, and delay margin [s] beyond the one sample.

    ``cycle`` is the amplitude [rad] of what motion is left at rest, by simulation; infinite where a run does not end.
    ``at`` has the plant of the worst radius, margin and cycle, ``plants`` the number of plants. ``noise`` is the largest
    torque commanded because of sensor noise alone, as a share of the motors' limit; ``period`` [s] is that of the clock.
    """

    law: str
    gains: Mapping[str, float]
    radius: float
    margin: float
    cycle: float
    noise: float
    period: float
    at: Mapping[str, str]
    plants: int = 1

    @property
    def stable(self) -> bool:
        """Whether the linearised loop is stable on all plants."""
        return self.radius < STABLE

    @property
    def runs(self) -> bool:
        """Whether the loop is stable, or hunts less than one sees, and noise does not saturate the motors."""
        return (self.stable or self.cycle <= CYCLE) and self.noise < 1

    @property
    def reason(self) -> str:
        """The reason, in words."""
        clock = f"{1 / self.period:.0f} Hz and one sample of delay"
        where = f" on the plant '{self.at['radius']}'" if self.plants > 1 else ""
        radius = f"spectral radius {self.radius:.4g}{where}"
        if not self.stable and self.cycle > CYCLE:
            grows = "runs away" if not np.isfinite(self.cycle) else f"cycles by {self.cycle:.2g} rad"
            return f"unstable at {clock}: {radius}; it {grows} on the plant '{self.at['cycle']}'"
        if self.noise >= 1:
            steady = "stable" if self.stable else f"hunting ({radius})"
            return f"{steady} at {clock}, but the sensors' noise alone drives the motors to their limit"
        if not self.stable:
            return f"hunting by {self.cycle:.2g} rad at {clock}: {radius}"
        return f"stable at {clock}: {radius}, delay margin {self.margin * 1e6:.0f} us"

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self) | {"runs": self.runs}


def clocked(
    library: Any, law: Law, gains: Mapping[str, float], joint: Joint, force: float,
    plants: Mapping[str, Mapping[str, Any]] = KNOWN,
) -> Clocked:  # fmt: skip
    """Stability of a law with gains on plants; it believes the joint as known. Raises InputError where kernels refuse."""
    loops = {name: loops_of(library, law, gains, joint, force, plant) for name, plant in plants.items()}
    radii = {name: max(loop.radius(0.0) for loop in both) for name, both in loops.items()}
    worst = max(radii, key=radii.__getitem__)
    spare, tight = (0.0, worst) if radii[worst] >= STABLE else _margin(loops)
    scores = judged(library, law, joint, gains, force, plants)
    cycles = {name: float("inf") if each.failed else each.cycle for name, each in scores.items()}
    wild = max(cycles, key=cycles.__getitem__)
    return Clocked(
        law.name, dict(gains), radii[worst], spare, cycles[wild], noise(library, law, gains, joint, force), joint.period,
        {"radius": worst, "margin": tight, "cycle": wild}, len(plants),
    )  # fmt: skip


def _margin(loops: Mapping[str, Sequence[SampledLoop]]) -> tuple[float, str]:
    """The smallest delay margin [s], and its plant. Loops that bear the smallest one so far are not looked at closer."""
    smallest, where = float("inf"), next(iter(loops))
    period = loops[where][0].period
    nearest_first = sorted(loops, key=lambda name: -max(loop.radius(1.0) for loop in loops[name]))
    for name in nearest_first:
        for loop in loops[name]:
            most = min(smallest / period, float(LONGEST))
            if any(loop.radius(share * most) >= STABLE for share in TRIED):
                found = loop.margin()
                if found < smallest:
                    smallest, where = found, name
    return smallest, where


def noise(library: Any, law: Law, gains: Mapping[str, float], joint: Joint, force: float) -> float:
    """The largest deviation of the command from its mean at rest, as a share of the motors' limit."""
    values = values_of(joint, joint.believed(), force) | law.values(library, joint.believed(), force, gains)
    loop = loop_around(joint, list(law.blocks))
    (trace,) = simulate(library, loop, [Scenario(values, RESTING, seed=1)], ["wanted"])
    command = trace["wanted"][RESTING // 3 :]
    return float(np.abs(command - command.mean(axis=0)).max() / joint.limit) if len(command) else float("inf")


def loops_of(
    library: Any,
    law: Law,
    gains: Mapping[str, float],
    joint: Joint,
    force: float,
    plant: Mapping[str, Any] = PLANTS["as known"],
) -> list[SampledLoop]:
    """The linearised loop with sliding motors, then with motors at rest, of a law that has learnt the springs only."""
    loops, true, believed = [], joint.perturbed(**plant), joint.believed()
    design = law.values(library, believed, force, gains)
    for each in (replace(true, friction=true.friction * [1, 0, 1]), true):
        known = believed if each is true else replace(believed, friction=believed.friction * [1, 0, 1])
        values = values_of(each, known, force) | design
        values["memory"][-2:] = each.stronger(known, force)
        machine = Machine(library, loop_around(each, law.constant).exact(), Scenario(values, 0))
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
