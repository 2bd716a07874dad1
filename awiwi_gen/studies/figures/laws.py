"""Figure 15.24 with what the source compares to: one step under all laws, on a joint of the hand as it really is."""

from __future__ import annotations

from typing import Any

from awiwi_gen.hand import Hand
from awiwi_gen.simulate import PERIOD
from awiwi_gen.studies.benchmark.joint import joint_of
from awiwi_gen.studies.benchmark.laws import LAWS, STIFFNESS
from awiwi_gen.studies.benchmark.scenarios import BEFORE, run, score
from awiwi_gen.studies.figures.figure import Figure

FORCE = 10.0  # N


def figures(library: Any, hand: Hand) -> list[Figure]:
    """The step, with friction, delay, quantisation, noise and saturation."""
    if hand.motor is None or hand.motor.friction is None or hand.spring is None:
        return []
    joint = joint_of(library, hand)
    runs, scores = {}, {}
    for law in LAWS.values():
        gains = law.gains_with({})
        traces = run(library, law, gains, joint, joint.believed(), FORCE)
        runs[law.name], scores[law.name] = traces["step"], score(traces, gains.get("K_p", STIFFNESS["K_p"].value))
    exact, cascade, adaptive = (scores[n] for n in ("backstepping_antagonistic", "cascade", "backstepping_adaptive"))

    def draw(axes: Any) -> None:
        for name, trace in runs.items():
            axes.plot((trace.time - BEFORE * PERIOD) * 1e3, trace["x"][:, 0], linewidth=0.8, label=name)
        axes.set(xlabel="t [ms]", ylabel="q [rad]", xlim=(-5, 150))
        axes.legend()

    return [
        Figure(
            number="15.24 (all laws)",
            title="One step under all laws, on a joint of the hand",
            claim="The antagonistic law settles faster than the cascade, and overshoots less.",
            found=(
                f"The exact law settles in {exact.settling * 1e3:.0f} ms, the cascade in {cascade.settling * 1e3:.0f} ms "
                f"with {cascade.overshoot:.0%} of overshoot; with what an observer learns of springs and friction, the law "
                f"settles in {adaptive.settling * 1e3:.0f} ms."
            ),
            holds=exact.settling < cascade.settling and exact.overshoot < cascade.overshoot,
            draw=draw,
        )
    ]
