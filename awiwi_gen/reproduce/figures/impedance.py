"""Figures 15.16 to 15.21: the impedance law behind a linear and behind a nonlinear spring, with the compiled laws.

The thesis prints no characteristic of its nonlinear spring. Here it is a hyperbolic sine with the stiffness of table
16.1 at rest and nearly three times that under the load of the figures; what is concluded is about such springs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_15_1, TABLE_16_1, UNIT_WEIGHTS, Array, Plant, impedance_loop
from awiwi_gen.results import Figure

STEP = np.pi / 4
LOAD = 0.2  # N m, as captioned
STIFFNESSES, DAMPINGS = (0.02, 0.1, 0.5), (0.01, 0.05, 0.1)
OUTER = (100.0, 100.0)
STEP_AT, LOAD_AT, END = 0.5, 1.5, 2.5  # s

GAINS = (0.5, 0.0012, 300.0, 400.0)  # of the nonlinear simulations: damping that a 3 kHz clock bears
SPRING = 0.0765, 0.1264  # torque [N m] and angle [rad] of tau = torque sinh(elongation / angle)
SATURATION = 2.0  # N m
TICK = 1e-4  # s


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    return [*stiffness(library), damping(library), neglected_rate(library), *nonlinear(library)]


# -- linear spring -----------------------------------------------------------------------------------------


def load_and_step(library: Any, plant: Plant, gains: Any, times: Array) -> Array:
    """Position [rad] of the link: a step of the desired position, then a load, both fed to the law."""
    loop = impedance_loop(library, plant, gains)
    first, second = (int(np.searchsorted(times, at)) for at in (STEP_AT, LOAD_AT))
    moved = loop.response([-STEP, 0, 0, 0], times[first:] - times[first])
    jump = (loop.E + loop.B @ loop.H) @ [0.0, LOAD]  # the impulse of the load's rate
    loaded = loop.response(moved[second - first] + jump, times[second:] - times[second], [LOAD, 0.0])
    return np.concatenate([np.zeros(first), STEP + moved[: second - first, 0], STEP + loaded[:, 0]])


def stiffness(library: Any) -> list[Figure]:
    """Figure 15.16: what holds of its deflexions, and what does not of its rise times."""
    times = np.linspace(0, END, 2501)
    gains = [(K_p, 0.05, *OUTER) for K_p in STIFFNESSES]
    runs = [load_and_step(library, TABLE_15_1, each, times) for each in gains]
    rests = [impedance_loop(library, TABLE_15_1, each).at_rest([LOAD, 0.0])[0] for each in gains]
    slow = [-1 / impedance_loop(library, TABLE_15_1, each).poles().real.max() for each in gains]

    def draw(axes: Any) -> None:
        for K_p, run in zip(STIFFNESSES, runs, strict=True):
            axes.plot(times, run, linewidth=0.8, label=f"K_p = {K_p:g} N m/rad")
        axes.set(xlabel="t [s]", ylabel="q [rad]")
        axes.legend()

    return [
        Figure(
            number="15.16 (deflexion)",
            title="A step and a load at three stiffnesses",
            claim=f"The stiffness decides the deflexion under {LOAD:g} N m.",
            found=f"{', '.join(f'{rest:.3g}' for rest in rests)} rad, load over stiffness, once the load is fed to the law.",
            holds=bool(np.allclose(np.array(rests) * STIFFNESSES, LOAD, rtol=1e-6)),
            draw=draw,
        ),
        Figure(
            number="15.16 (rise)",
            title="The rise at three stiffnesses",
            claim="The rise times are identical, for the motor imposes them.",
            found=f"The slowest time constants are {', '.join(f'{t:.2g}' for t in slow)} s: K_d / K_p.",
            holds=max(slow) < 1.1 * min(slow),
            draw=draw,
        ),
    ]


def damping(library: Any) -> Figure:
    """Figure 15.17."""
    times = np.linspace(0, END, 2501)
    runs = [load_and_step(library, TABLE_15_1, (1.0, K_d, *OUTER), times) for K_d in DAMPINGS]
    arrivals = [settling(times - STEP_AT, run, STEP, STEP, (STEP_AT, LOAD_AT)) for run in runs]

    def draw(axes: Any) -> None:
        for K_d, run in zip(DAMPINGS, runs, strict=True):
            axes.plot(times, run, linewidth=0.8, label=f"K_d = {K_d:g} N m s/rad")
        axes.set(xlabel="t [s]", ylabel="q [rad]")
        axes.legend()

    return Figure(
        number="15.17",
        title="A step and a load at three dampings",
        claim="More damping settles later.",
        found=f"The step is within 2 % after {', '.join(f'{t:.3g}' for t in arrivals)} s.",
        holds=arrivals == sorted(arrivals) and arrivals[0] < arrivals[-1],
        draw=draw,
    )


def settling(times: Array, run: Array, end: float, size: float, window: tuple[float, float]) -> float:
    """Time after which a run stays within two percent of ``size`` about its end; times count from the event."""
    inside = (times >= 0) & (times < window[1] - window[0])
    off = np.abs(run[inside] - end) > 0.02 * size
    return float(times[inside][off][-1]) if off.any() else 0.0


def neglected_rate(library: Any) -> Figure:
    """Section 15.3.5: the law without the rate of the outer torque, after a load step."""
    plants = {"K_d = 0.05": (TABLE_15_1, (0.5, 0.05, *OUTER)), "K_d = 0.0012": (TABLE_16_1, GAINS)}
    runs, peaks = {}, []
    for name, (plant, gains) in plants.items():
        loop = impedance_loop(library, plant, gains, fed=(1.0, 0.0))
        times = np.linspace(0, 8 * gains[1] / gains[0], 2001)
        runs[name] = times * gains[0] / gains[1], loop.response(np.zeros(4), times, [LOAD, 0.0])[:, 0] / LOAD * gains[0]
        peaks.append(float(runs[name][1].max()))

    def draw(axes: Any) -> None:
        for name, (times, run) in runs.items():
            axes.plot(times, run, linewidth=0.8, label=name)
        axes.set(xlabel="t K_p / K_d", ylabel="deflexion in parts of the static one")
        axes.legend()

    return Figure(
        number="15.16 (rate of the load)",
        title="A load step whose rate is not fed to the law",
        claim="It is practically sufficient to neglect the rate of the outer torque.",
        found=f"The link goes to {' and '.join(f'{peak:.3g}' for peak in peaks)} times its deflexion.",
        holds=max(peaks) < 1.1,
        draw=draw,
    )


# -- nonlinear spring --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """A step and a load with the nonlinear law and with the linear one: arrays (ticks, 2)."""

    times: Array
    q: Array
    stiffness: Array


def characteristic(elongation: Array) -> tuple[Array, Array, Array]:
    """Torque [N m] of the spring, its slope and its curvature."""
    torque, angle = SPRING
    x = np.clip(elongation / angle, -12, 12)
    return torque * np.sinh(x), torque / angle * np.cosh(x), torque / angle**2 * np.sinh(x)


def run_nonlinear(library: Any, limit: float) -> Run:
    """Simulate both laws side by side; the load comes within 5 ms, and it is fed with its rate."""
    m, b, _ = TABLE_16_1.numbers
    nominal = float(characteristic(np.zeros(1))[1][0])
    ramp, at, load_at, end = 0.005, 0.05, 0.35, 0.6

    def law(x: Array, desired: Array, external: Array) -> Array:
        torque, slope, curvature = characteristic(x[:, 2] - x[:, 0])
        state = np.stack([x[:, 0], x[:, 1], torque, slope * (x[:, 3] - x[:, 1])], axis=-1)
        local = np.array([[slope[0], curvature[0]], [nominal, 0.0]])  # what either law believes
        given = {"gains": GAINS, "weights": UNIT_WEIGHTS, "desired": desired, "external": external}
        motor = library.backstepping_nonlinear(state=state, bodies=(m, b), spring=local, **given).tau_m
        cut: Array = np.clip(motor, -limit, limit)
        return cut

    def flow(t: float, x: Array) -> Array:
        share = float(np.clip((t - load_at) / ramp, 0, 1))
        external = np.array([LOAD * share, LOAD / ramp if 0 < share < 1 else 0.0])
        motor = law(x, np.array([STEP if t >= at else 0.0, 0, 0, 0, 0]), external)
        torque = characteristic(x[:, 2] - x[:, 0])[0]
        return np.stack([x[:, 1], (torque + external[0]) / m, x[:, 3], (motor - torque) / b], axis=-1)

    times = np.arange(0, end, TICK)
    states = [np.zeros((2, 4))]
    for t in times[:-1]:
        x = states[-1]
        k1 = flow(t, x)
        k2 = flow(t + TICK / 2, x + TICK / 2 * k1)
        k3 = flow(t + TICK / 2, x + TICK / 2 * k2)
        states.append(x + TICK / 6 * (k1 + 2 * k2 + 2 * k3 + flow(t + TICK, x + TICK * k3)))
    trace = np.array(states)
    return Run(times, trace[..., 0], characteristic(trace[..., 2] - trace[..., 0])[1])


def nonlinear(library: Any) -> list[Figure]:
    """Figures 15.19 to 15.21."""
    at, load_at, end = 0.05, 0.35, 0.6
    free, cut = run_nonlinear(library, np.inf), run_nonlinear(library, SATURATION)
    deflexion = LOAD / GAINS[0]
    rest = STEP + deflexion
    moving = (free.times >= at) & (free.times < load_at)
    loaded = free.times >= load_at
    apart = float(np.abs(free.q[moving, 0] - free.q[moving, 1]).max())
    times = {
        name: [settling(run.times - load_at, run.q[:, law], rest, deflexion, (load_at, end)) * 1e3 for law in (0, 1)]
        for name, run in (("free", free), ("cut", cut))
    }
    over = {
        name: np.maximum(run.q[loaded].max(axis=0) - rest, 0) / deflexion
        for name, run in (("free", free), ("cut", cut))
    }
    nominal = free.stiffness[0, 0]
    changes = [float(np.abs(free.stiffness[part, 0] / nominal - 1).max()) for part in (moving, loaded)]

    def draw(run: Run, what: Array, label: str) -> Any:
        def on(axes: Any) -> None:
            axes.plot(run.times, what, linewidth=0.8, label=["nonlinear law", "linear law"])
            axes.set(xlabel="t [s]", ylabel=label)
            axes.legend()

        return on

    return [
        Figure(
            number="15.19",
            title="Linear and nonlinear law behind a nonlinear spring",
            claim="In free motion both laws do the same; under load the nonlinear one settles sooner, overshoots more.",
            found=(
                f"In free motion they differ by {apart:.1e} rad at most; under load the nonlinear and the linear law "
                f"settle after {times['free'][0]:.1f} and {times['free'][1]:.1f} ms and overshoot by "
                f"{over['free'][0]:.0%} and {over['free'][1]:.0%}."
            ),
            holds=bool(
                apart < 0.02 * STEP and times["free"][0] < times["free"][1] and over["free"][0] > over["free"][1]
            ),
            draw=draw(free, free.q, "q [rad]"),
        ),
        Figure(
            number="15.20",
            title="Stiffness of the spring during figure 15.19",
            claim="Accelerating the link changes the stiffness little, loading it much.",
            found=f"By {changes[0]:.0%} and by {changes[1]:.0%}.",
            holds=changes[0] < 0.1 * changes[1],
            draw=draw(free, free.stiffness, "k [N m/rad]"),
        ),
        Figure(
            number="15.21",
            title=f"The same with torques cut at {SATURATION:g} N m",
            claim="Saturation makes the laws more alike; the nonlinear one still settles sooner.",
            found=(
                "The nonlinear and the linear law overshoot by "
                f"{over['cut'][0]:.0%} and {over['cut'][1]:.0%} and settle after {times['cut'][0]:.0f} and "
                f"{times['cut'][1]:.0f} ms, {times['free'][0]:.0f} and {times['free'][1]:.0f} ms without saturation."
            ),
            holds=bool(
                abs(times["cut"][0] - times["cut"][1]) < abs(times["free"][0] - times["free"][1])
                and times["cut"][0] < times["cut"][1]
            ),
            draw=draw(cut, cut.q, "q [rad]"),
        ),
    ]
