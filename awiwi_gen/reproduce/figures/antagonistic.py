"""Figures 15.23 to 15.27: the antagonistic law of section 15.5, with the compiled laws.

From figure 15.24 on the thesis shows measurements. Here the same experiments are simulated as the hand would run them,
at 3 kHz with one sample of delay, behind springs that stiffen as they are pulled, with gains from the regulator of
chapter 16; there is no friction and no noise in it, and no cascade to compare with.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_16_1, Plant
from awiwi_gen.loops.pair import TABLE_PAIR, at_rest, pair_loop
from awiwi_gen.loops.regulator import cancelling, exact_gains, regulator
from awiwi_gen.loops.step import overshoot, settling
from awiwi_gen.results import Figure, curves
from awiwi_gen.simulate import PERIOD, Actuator, Array, Block, Loop, Scenario, Sum, Trace, simulate

IMPEDANCE = (0.5, 0.05)
PRETENSION = 0.15  # N m
COSTS = np.diag([250.0, 0.01, 0.01, 0.01]), 0.01
STEP, STEP_AT = 0.5, 0.02
STIFFNESSES = (0.5, 2.0, 5.0)
FREQUENCIES = (2.0, 4.0, 8.0, 16.0)  # Hz


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    return [deflexion(library), pretension(library), step(library), *sines(library), rendered(library)]


def run(library: Any, goals: Sequence[Array]) -> list[Trace]:
    """The exact law under desired positions with four derivatives, each (ticks, 5), with gains from costs.

    The springs are cubic, the first terms of an exponential: at rest, at the elongation p, they have the torque of the
    pretension and the stiffness k of the pair.
    """
    single = Plant(TABLE_16_1.m, 2 * TABLE_16_1.b, 2 * TABLE_16_1.k)
    found = exact_gains(library, single, regulator(single, *COSTS) + cancelling(single))
    tuning = np.concatenate([found.gains[2:], 2 * found.weights])
    k, p = TABLE_PAIR.k[0], 1.5 * PRETENSION / TABLE_PAIR.k[0]
    law = {"torques": "torques", "springs": "springs", "external": "zeros", "tunings": "tunings"}
    loop = Loop(
        plant=[Block("plant_antagonistic", {"load": "zeros[0]"})],
        law=[
            Sum("speeds", (1.0, ("x[3]", "x[5]")), ("sides", "x[1]")),
            Block("antagonistic_springs"),
            Block("backstepping_antagonistic_lyapunov", law | {"joint": "x[0:2]"}),
            Block("backstepping_antagonistic", law | {"joint": "x[0:2]", "tau_m": "command"}),
        ],
        states={"x": "xd"},
        actuators=[Actuator("command", "u")],
    )
    values = {
        "x": (0, 0, p, 0, p, 0), "command": [PRETENSION] * 2, "tendons": [[0.4 * k, 0.2 * k / p, k / p**2 / 15]] * 2,
        "inertias": (TABLE_PAIR.m, *TABLE_PAIR.b), "damping": 0.0, "friction": (1.0, 0.0, 0.0), "zeros": np.zeros(2),
        "sides": (-1.0, 1.0), "pretension": (PRETENSION, 0, 0), "impedance": found.gains[:2], "tunings": [tuning] * 2,
    }  # fmt: skip
    scenarios = [Scenario(values, len(goal), {"desired": goal}) for goal in goals]
    return simulate(library, loop, scenarios, ["x", "tau", "V"])


def deflexion(library: Any) -> Figure:
    """Figure 15.23, continuous: a step, then a torque on the link."""
    loop, _ = pair_loop(library.backstepping_antagonistic, TABLE_PAIR, IMPEDANCE)
    times, torque, goal = np.linspace(0, 1.5, 1501), 0.1, np.pi / 4
    moved = loop.response([-goal, 0, 0, 0, 0, 0], times)
    loaded = loop.loaded(moved[-1], times, torque)
    q = goal + np.concatenate([moved[:, 0], loaded[:, 0]])
    end = goal + torque / IMPEDANCE[0]
    return Figure(
        "15.23", "A step and a torque on the link, exact law",
        "The link arrives, then yields to the torque as its impedance says.",
        f"It ends at {q[-1]:.6f} rad; the step and torque over stiffness make {end:.6f}.",
        bool(abs(q[-1] - end) < 1e-3 and (np.diff(q) > -1e-9).all()),
        curves(np.concatenate([times, times[-1] + times]), q, "t [s]", "q [rad]"),
    )  # fmt: skip


def pretension(library: Any) -> Figure:
    """What eq. 15.84 to 15.86 do to the pretension, beside the exact law; the link stands still, time is continuous."""
    laws = {"exact": library.backstepping_antagonistic, "decoupled": library.backstepping_antagonistic_decoupled}
    times, start = np.linspace(0, 0.2, 401), np.array([0, 0, PRETENSION, 0, PRETENSION, 0])
    runs = {}
    for name, law in laws.items():
        loop, constant = pair_loop(law, TABLE_PAIR, IMPEDANCE, pretension=PRETENSION)
        rest = at_rest(loop, constant)
        runs[name] = (rest + loop.response(start - rest, times))[:, 2::2].mean(axis=1)
    left = {name: float(run[-1]) for name, run in runs.items()}
    return Figure(
        "15.23 (pretension)", "The pretension under the printed decoupling",
        "Motors can be treated as not aware of one another, and the pretension be added.",
        f"Of {PRETENSION:g} N m the printed decoupling leaves {left['decoupled']:.2g}, the law of the whole system of "
        f"order six {left['exact']:.4g}.", left["decoupled"] > 0.9 * PRETENSION,
        curves(times, runs, "t [s]", "common torque [N m]"),
    )  # fmt: skip


def step(library: Any) -> Figure:
    """Figure 15.24: a step, and the energy on its way down."""
    ticks, at = round(0.15 / PERIOD), round(STEP_AT / PERIOD)
    goal = np.zeros((ticks, 5))
    goal[at:, 0] = STEP
    (trace,) = run(library, [goal])
    q, V, least = trace["x"][:, 0], trace["V"][:, 0], float(trace["tau"].min())
    settled = float(settling(trace.time, q, STEP, 0.0)) - STEP_AT
    over = float(overshoot(q, STEP, 0.0))
    falls = bool((np.diff(V[at + 3 :]) <= 1e-9 * V[at + 3 :].max()).all())
    lines = {"q [rad]": q, "V, scaled": V / V.max()}
    return Figure(
        "15.24 (simulated)", f"A step of {STEP:g} rad at 3 kHz",
        "The backstepping law is fast and accurate.",
        f"Settled after {settled * 1e3:.0f} ms with {over:.1%} overshoot; V falls after the step; the slacker tendon "
        f"keeps {least:.2g} N m.", falls and settled < 0.04 and over < 0.02 and least > 0,
        curves(trace.time, lines, "t [s]", "angle [rad], energy by its largest value"),
    )  # fmt: skip


def sines(library: Any) -> list[Figure]:
    """Figures 15.25 and 15.26: sines with their derivatives fed, and without."""
    amplitude, labels = 0.3, ("derivatives fed", "position only")
    times = np.arange(round((0.15 + 1 / FREQUENCIES[0]) / PERIOD)) * PERIOD
    goals = []
    for w in 2 * np.pi * np.array(FREQUENCIES):
        s, c = amplitude * np.sin(w * times), amplitude * np.cos(w * times)
        fed = w ** np.arange(5) * np.stack([s, c, -s, -c, s], axis=-1)
        goals += [fed, fed * [1, 0, 0, 0, 0]]
    q = np.array([trace["x"][:, 0] for trace in run(library, goals)]).reshape(len(FREQUENCIES), 2, -1)
    late = times >= times[-1] - 1 / FREQUENCIES[0]
    phase = 2 * np.pi * np.array(FREQUENCIES)[:, None] * times[late]
    gains = np.abs((q[..., late] * np.exp(-1j * phase)[:, None]).mean(axis=-1)) * 2 / amplitude
    error = float(np.abs(q[0, 0] - goals[0][:, 0])[late].max())
    follow, gain = (dict(zip(labels, rows, strict=True)) for rows in (q[0], gains.T))
    return [
        Figure(
            "15.25 (simulated)", f"A sine of {FREQUENCIES[0]:g} Hz at 3 kHz",
            "The law follows a sine.",
            f"Within {error:.1e} rad of {amplitude:g} rad once the sine's derivatives are fed.",
            error < 0.01 * amplitude, curves(times, follow, "t [s]", "q [rad]"),
        ),
        Figure(
            "15.26 (simulated)", "Gain over frequency at 3 kHz",
            "The gain stays near one over a wide range of frequencies.",
            f"At {FREQUENCIES[-1]:g} Hz it is {gains[-1, 0]:.3f} with the derivatives fed, and {gains[-1, 1]:.2f} "
            "with the position alone.", bool(np.abs(gains[:, 0] - 1).max() < 0.05),
            curves(FREQUENCIES, gain, "frequency [Hz]", "gain", "o-", "o-"),
        ),
    ]  # fmt: skip


def rendered(library: Any) -> Figure:
    """Figure 15.27: the torque at a deflexion, for three stiffnesses.

    A fixture holds the link and is felt by the law; its torque is the load under which the link would stand there.
    """
    imposed, torques = np.linspace(0, 0.4, 5), {}
    for K_p in STIFFNESSES:
        loop, _ = pair_loop(library.backstepping_antagonistic, TABLE_PAIR, (K_p, 0.05))
        unit = loop.at_rest([1.0, 0.0])
        torques[K_p] = imposed / unit[0] * (unit[4] - unit[2])
    worst = max(float(np.abs(t - K_p * imposed).max()) for K_p, t in torques.items())

    lines = {f"K_p = {K_p:g} N m/rad": torque for K_p, torque in torques.items()}
    return Figure(
        "15.27 (simulated)", "Torque at an imposed deflexion",
        "The torque of the tendons at an imposed deflexion is that of the desired stiffness.",
        f"It is, within {worst:.0e} N m.", worst < 1e-9,
        curves(imposed, lines, "imposed deflexion [rad]", "torque of the tendons [N m]", *["o-"] * 3),
    )  # fmt: skip
