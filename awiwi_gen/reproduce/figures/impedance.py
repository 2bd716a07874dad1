"""Figures 15.16 to 15.21: the impedance law behind a linear and behind a nonlinear spring, with the compiled laws.

The thesis prints no characteristic of its nonlinear spring. Here it is a cubic with the stiffness of table 16.1 at rest
and nearly three times that under the load of the figures; what is concluded is about such springs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_15_1, TABLE_16_1, UNIT_WEIGHTS, impedance_loop
from awiwi_gen.loops.joint import Loop as LinearLoop
from awiwi_gen.loops.step import overshoot, run, settling
from awiwi_gen.results import Figure, curves, listed
from awiwi_gen.simulate import Array, Block, Scenario, Trace

STEP = np.pi / 4
LOAD = 0.2  # N m, as captioned
STIFFNESSES, DAMPINGS = (0.02, 0.1, 0.5), (0.01, 0.05, 0.1)
OUTER = (100.0, 100.0)
STEP_AT, LOAD_AT, END = 0.5, 1.5, 2.5  # s

GAINS = (0.5, 0.0012, 300.0, 400.0)  # of the nonlinear simulations: damping that a 3 kHz clock bears
CURVE = 0.605, 8.5  # N m/rad, N m/rad^3, of the nonlinear spring
SATURATION = 2.0  # N m
TICK = 1e-4  # s, so fast that the law acts as if in continuous time
NONLINEAR_STEP_AT, NONLINEAR_LOAD_AT, END_NONLINEAR = 0.05, 0.35, 0.6  # s
SPRING_JOINT = {  # signals of a joint of table 16.1 behind the nonlinear spring
    "bodies": (TABLE_16_1.m, TABLE_16_1.b), "curve": CURVE, "damping": np.zeros(2), "weights": UNIT_WEIGHTS,
}  # fmt: skip


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    return [*stiffness(library), damping(library), neglected_rate(library), *nonlinear(library)]


def load_and_step(loop: LinearLoop, times: Array) -> Array:
    """Position [rad] of the link: a step of the desired position, then a load, both fed to the law."""
    first, second = (int(np.searchsorted(times, at)) for at in (STEP_AT, LOAD_AT))
    moved = loop.response([-STEP, 0, 0, 0], times[first:] - times[first])
    loaded = loop.loaded(moved[second - first], times[second:] - times[second], LOAD)
    return np.concatenate([np.zeros(first), STEP + moved[: second - first, 0], STEP + loaded[:, 0]])


def stiffness(library: Any) -> list[Figure]:
    """Figure 15.16: what holds of its deflexions, and what does not of its rise times."""
    times = np.linspace(0, END, 2501)
    loops = {K_p: impedance_loop(library, TABLE_15_1, (K_p, 0.05, *OUTER)) for K_p in STIFFNESSES}
    rests = [LOAD / loop.stiffness for loop in loops.values()]
    slow = [-1 / loop.poles().real.max() for loop in loops.values()]
    lines = {f"K_p = {K_p:g} N m/rad": load_and_step(loop, times) for K_p, loop in loops.items()}
    draw = curves(times, lines, "t [s]", "q [rad]")
    return [
        Figure(
            "15.16 (deflexion)", "A step and a load at three stiffnesses",
            f"The stiffness decides the deflexion under {LOAD:g} N m.",
            f"{listed(rests, '.3g')} rad, load over stiffness, once the load is fed to the law.",
            bool(np.allclose(np.array(rests) * STIFFNESSES, LOAD, rtol=1e-6)), draw,
        ),
        Figure(
            "15.16 (rise)", "The rise at three stiffnesses",
            "The rise times are identical, for the motor imposes them.",
            f"The slowest time constants are {listed(slow, '.2g')} s: K_d / K_p.", max(slow) < 1.1 * min(slow), draw,
        ),
    ]  # fmt: skip


def damping(library: Any) -> Figure:
    """Figure 15.17."""
    times = np.linspace(0, END, 2501)
    loops = [impedance_loop(library, TABLE_15_1, (1.0, K_d, *OUTER)) for K_d in DAMPINGS]
    runs = [load_and_step(loop, times) for loop in loops]
    moving = (times >= STEP_AT) & (times < LOAD_AT)
    arrivals = [float(settling(times[moving] - STEP_AT, run[moving], STEP, 0.0)) for run in runs]
    lines = {f"K_d = {K_d:g} N m s/rad": run for K_d, run in zip(DAMPINGS, runs, strict=True)}
    return Figure(
        "15.17", "A step and a load at three dampings",
        "More damping settles later.", f"The step is within 2 % after {listed(arrivals, '.3g')} s.",
        arrivals == sorted(arrivals) and arrivals[0] < arrivals[-1], curves(times, lines, "t [s]", "q [rad]"),
    )  # fmt: skip


def neglected_rate(library: Any) -> Figure:
    """Section 15.3.5: the law without the rate of the outer torque, after a load step."""
    plants = {"K_d = 0.05": (TABLE_15_1, (0.5, 0.05, *OUTER)), "K_d = 0.0012": (TABLE_16_1, GAINS)}
    runs, peaks = {}, []
    for name, (plant, gains) in plants.items():
        loop = impedance_loop(library, plant, gains, fed=(1.0, 0.0))
        times = np.linspace(0, 8 * gains[1] / gains[0], 2001)
        runs[name] = times * gains[0] / gains[1], loop.response(np.zeros(4), times, [LOAD, 0.0])[:, 0] / LOAD * gains[0]
        peaks.append(float(runs[name][1].max()))
    return Figure(
        "15.16 (rate of the load)", "A load step whose rate is not fed to the law",
        "It is practically sufficient to neglect the rate of the outer torque.",
        f"The link goes to {listed(peaks, '.3g', ' and ')} times its deflexion.", max(peaks) < 1.1,
        curves(None, runs, "t K_p / K_d", "deflexion in parts of the static one"),
    )  # fmt: skip


def run_nonlinear(library: Any, limit: float) -> dict[str, Trace]:
    """A step and a load under the law that knows the spring and under the one for a linear spring.

    The load comes within 5 ms, and it is fed to the law with its rate.
    """
    ticks, ramp = round(END_NONLINEAR / TICK), 0.005
    times = np.arange(ticks) * TICK
    share = np.clip((times - NONLINEAR_LOAD_AT) / ramp, 0, 1)
    external = np.stack([LOAD * share, LOAD / ramp * ((share > 0) & (share < 1))], axis=1)
    desired = np.zeros((ticks, 5))
    desired[:, 0] = STEP * (times >= NONLINEAR_STEP_AT)
    values = SPRING_JOINT | {"x": np.zeros(4), "nominal": (CURVE[0], 0.0), "gains": GAINS}
    scenario = Scenario(values, ticks, {"desired": desired, "external": external})
    plant, traces = [Block("plant_joint_nonlinear", {"load": "external[0]"})], {}
    for name, spring in (("nonlinear law", "spring"), ("linear law", "nominal")):
        law = Block("backstepping_nonlinear", {"state": ("x[0:2]", "tau"), "spring": spring, "tau_m": "command"})
        traces[name] = run(library, plant, [law], scenario, ["x", "spring"], TICK, limit)
    return traces


def nonlinear(library: Any) -> list[Figure]:
    """Figures 15.19 to 15.21."""
    free, cut = (run_nonlinear(library, limit) for limit in (np.inf, SATURATION))
    deflexion = LOAD / GAINS[0]
    rest = STEP + deflexion
    times = free["linear law"].time
    moving = (times >= NONLINEAR_STEP_AT) & (times < NONLINEAR_LOAD_AT)
    loaded = times >= NONLINEAR_LOAD_AT
    angles = [{name: trace["x"][:, 0] for name, trace in run.items()} for run in (free, cut)]
    after = [np.stack([q[loaded] for q in run.values()], axis=1) for run in angles]  # the nonlinear law first
    settled = [settling(times[loaded] - NONLINEAR_LOAD_AT, q, rest, STEP) * 1e3 for q in after]
    over = [overshoot(q, rest, STEP) for q in after]
    apart = float(np.abs(angles[0]["nonlinear law"] - angles[0]["linear law"])[moving].max())
    stiffness = {name: trace["spring"][:, 0] for name, trace in free.items()}
    change = np.abs(stiffness["nonlinear law"] / CURVE[0] - 1)
    changes = [float(change[part].max()) for part in (moving, loaded)]
    return [
        Figure(
            "15.19", "Linear and nonlinear law behind a nonlinear spring",
            "In free motion both laws do the same; under load the nonlinear one settles sooner, overshoots more.",
            f"In free motion they differ by {apart:.1e} rad at most; under load the nonlinear and the linear law "
            f"settle after {settled[0][0]:.1f} and {settled[0][1]:.1f} ms and overshoot by "
            f"{over[0][0]:.0%} and {over[0][1]:.0%}.",
            bool(apart < 0.02 * STEP and settled[0][0] < settled[0][1] and over[0][0] > over[0][1]),
            curves(times, angles[0], "t [s]", "q [rad]", "-", "--"),
        ),
        Figure(
            "15.20", "Stiffness of the spring during figure 15.19",
            "Accelerating the link changes the stiffness little, loading it much.",
            f"By {changes[0]:.0%} and by {changes[1]:.0%}.", changes[0] < 0.1 * changes[1],
            curves(times, stiffness, "t [s]", "k [N m/rad]", "-", "--"),
        ),
        Figure(
            "15.21", f"The same with torques cut at {SATURATION:g} N m",
            "Saturation makes the laws more alike; the nonlinear one still settles sooner.",
            "The nonlinear and the linear law overshoot by "
            f"{over[1][0]:.0%} and {over[1][1]:.0%} and settle after {settled[1][0]:.0f} and "
            f"{settled[1][1]:.0f} ms, {settled[0][0]:.0f} and {settled[0][1]:.0f} ms without saturation.",
            bool(
                abs(settled[1][0] - settled[1][1]) < abs(settled[0][0] - settled[0][1])
                and settled[1][0] < settled[1][1]
            ), curves(times, angles[1], "t [s]", "q [rad]"),
        ),
    ]  # fmt: skip
