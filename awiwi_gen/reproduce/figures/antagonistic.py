"""Figures 15.23 to 15.27: the antagonistic law of section 15.5, with the compiled laws.

From figure 15.24 on the thesis shows measurements. Here the same experiments are simulated as the hand would run them,
at 3 kHz with one sample of delay, behind springs that stiffen as they are pulled, with gains from the regulator of
chapter 16; there is no friction and no noise in it, and no cascade to compare with.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_16_1, Array, Plant
from awiwi_gen.loops.pair import TABLE_PAIR, at_rest, pair_loop
from awiwi_gen.loops.regulator import cancelling, exact_gains, regulator
from awiwi_gen.loops.sampled import PERIOD
from awiwi_gen.reproduce.pair_simulation import Setting, simulate
from awiwi_gen.results import Figure

IMPEDANCE = (0.5, 0.05)
PRETENSION = 0.15  # N m
COSTS = np.diag([250.0, 0.01, 0.01, 0.01]), 0.01
STEP, STEP_AT = 0.5, 0.02
STIFFNESSES = (0.5, 2.0, 5.0)
FREQUENCIES = (2.0, 4.0, 8.0, 16.0)  # Hz


def figures(library: Any, hand: Hand) -> list[Figure]:
    """All of them; they need nothing of the hand."""
    setting = tuned(library)
    return [
        deflexion(library),
        pretension(library),
        step(library, setting),
        *sines(library, setting),
        rendered(library),
    ]


def tuned(library: Any) -> Setting:
    """The pair of table 16.1 with gains from costs."""
    single = Plant(TABLE_16_1.m, 2 * TABLE_16_1.b, 2 * TABLE_16_1.k)
    found = exact_gains(library, single, regulator(single, *COSTS) + cancelling(single))
    tuning = np.concatenate([found.gains[2:], 2 * found.weights])
    return Setting(TABLE_PAIR, PRETENSION, found.gains[:2], tuning)


def wanted(position: float, *rates: float) -> tuple[float, ...]:
    """A desired position with its four derivatives, zero if not given."""
    return (position, *rates, *(0.0,) * (4 - len(rates)))


def deflexion(library: Any) -> Figure:
    """Figure 15.23, continuous: a step, then a torque on the link."""
    loop, _ = pair_loop(library.backstepping_antagonistic, TABLE_PAIR, IMPEDANCE)
    times, torque, goal = np.linspace(0, 1.5, 1501), 0.1, np.pi / 4
    start = np.array([-goal, 0, 0, 0, 0, 0])
    moved = loop.response(start, times)
    jump = (loop.E + loop.B @ loop.H) @ [0.0, torque]
    loaded = loop.response(moved[-1] + jump, times, [torque, 0.0])
    q = goal + np.concatenate([moved[:, 0], loaded[:, 0]])
    end = goal + torque / IMPEDANCE[0]

    def draw(axes: Any) -> None:
        axes.plot(np.concatenate([times, times[-1] + times]), q, linewidth=0.8)
        axes.set(xlabel="t [s]", ylabel="q [rad]")

    return Figure(
        number="15.23",
        title="A step and a torque on the link, exact law",
        claim="The link arrives, then yields to the torque as its impedance says.",
        found=f"It ends at {q[-1]:.6f} rad; the step and torque over stiffness make {end:.6f}.",
        holds=bool(abs(q[-1] - end) < 1e-3 and (np.diff(q) > -1e-9).all()),
        draw=draw,
    )


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

    def draw(axes: Any) -> None:
        for name, run in runs.items():
            axes.plot(times, run, linewidth=0.8, label=name)
        axes.set(xlabel="t [s]", ylabel="common torque [N m]")
        axes.legend()

    return Figure(
        number="15.23 (pretension)",
        title="The pretension under the printed decoupling",
        claim="Motors can be treated as not aware of one another, and the pretension be added.",
        found=(
            f"Of {PRETENSION:g} N m the printed decoupling leaves {left['decoupled']:.2g}, the law of the whole system of "
            f"order six {left['exact']:.4g}."
        ),
        holds=left["decoupled"] > 0.9 * PRETENSION,
        draw=draw,
    )


def step(library: Any, setting: Setting) -> Figure:
    """Figure 15.24: a step, and the energy on its way down."""
    run = simulate(library, setting, 0.15, lambda t: wanted(STEP if t >= STEP_AT else 0.0))
    off = np.abs(run.q - STEP) > 0.02 * STEP
    settled = float(run.times[off][-1] - STEP_AT)
    after = run.times > STEP_AT + 2 * PERIOD
    falls = bool((np.diff(run.V[after]) <= 1e-9 * run.V[after].max()).all())
    over = max(float(run.q.max() / STEP - 1), 0.0)

    def draw(axes: Any) -> None:
        axes.plot(run.times, run.q, linewidth=0.8, label="q [rad]")
        axes.plot(run.times, run.V / run.V.max(), linewidth=0.8, label="V, scaled")
        axes.legend()
        axes.set(xlabel="t [s]", ylabel="angle [rad], energy by its largest value")

    return Figure(
        number="15.24 (simulated)",
        title=f"A step of {STEP:g} rad at 3 kHz",
        claim="The backstepping law is fast and accurate.",
        found=(
            f"Settled after {settled * 1e3:.0f} ms with {over:.1%} overshoot; V falls after the step; the slacker tendon "
            f"keeps {run.torques.min():.2g} N m."
        ),
        holds=falls and settled < 0.04 and over < 0.02 and bool(run.torques.min() > 0),
        draw=draw,
    )


def sines(library: Any, setting: Setting) -> list[Figure]:
    """Figures 15.25 and 15.26: sines with their derivatives fed, and without."""
    amplitude, w = 0.3, 2 * np.pi * np.array(FREQUENCIES)
    powers = np.stack([w**order for order in range(5)], axis=-1)

    def desired(t: float) -> Array:
        s, c = amplitude * np.sin(w * t), amplitude * np.cos(w * t)
        fed = powers * np.stack([s, c, -s, -c, s], axis=-1)
        return np.stack([fed, fed * [1, 0, 0, 0, 0]])

    run = simulate(library, setting, 0.15 + 1 / FREQUENCIES[0], desired)
    late = run.times >= run.times[-1] - 1 / FREQUENCIES[0]
    turned = np.exp(-1j * w * run.times[late, None])[:, None]
    gains = np.abs((run.q[late] * turned).mean(axis=0)) * 2 / amplitude
    error = float(np.abs(run.q[late, 0, 0] - amplitude * np.sin(w[0] * run.times[late])).max())

    def follow(axes: Any) -> None:
        axes.plot(run.times, run.q[:, :, 0], linewidth=0.8, label=["derivatives fed", "position only"])
        axes.legend()
        axes.set(xlabel="t [s]", ylabel="q [rad]")

    def diagram(axes: Any) -> None:
        axes.plot(FREQUENCIES, gains.T, "o-", label=["derivatives fed", "position only"])
        axes.set(xlabel="frequency [Hz]", ylabel="gain")
        axes.legend()

    return [
        Figure(
            number="15.25 (simulated)",
            title=f"A sine of {FREQUENCIES[0]:g} Hz at 3 kHz",
            claim="The law follows a sine.",
            found=f"Within {error:.1e} rad of {amplitude:g} rad once the sine's derivatives are fed.",
            holds=error < 0.01 * amplitude,
            draw=follow,
        ),
        Figure(
            number="15.26 (simulated)",
            title="Gain over frequency at 3 kHz",
            claim="The gain stays near one over a wide range of frequencies.",
            found=(
                f"At {FREQUENCIES[-1]:g} Hz it is {gains[0, -1]:.3f} with the derivatives fed, and {gains[1, -1]:.2f} "
                "with the position alone."
            ),
            holds=bool(np.abs(gains[0] - 1).max() < 0.05),
            draw=diagram,
        ),
    ]


def rendered(library: Any) -> Figure:
    """Figure 15.27: the torque at a deflexion, for three stiffnesses."""
    imposed = np.linspace(0, 0.4, 5)
    torques = {K_p: static_torques(library, K_p, imposed) for K_p in STIFFNESSES}
    worst = max(float(np.abs(t - K_p * imposed).max()) for K_p, t in torques.items())

    def draw(axes: Any) -> None:
        for K_p, torque in torques.items():
            axes.plot(imposed, torque, "o-", label=f"K_p = {K_p:g} N m/rad")
        axes.set(xlabel="imposed deflexion [rad]", ylabel="torque of the tendons [N m]")
        axes.legend()

    return Figure(
        number="15.27 (simulated)",
        title="Torque at an imposed deflexion",
        claim="The torque of the tendons at an imposed deflexion is that of the desired stiffness.",
        found=f"It is, within {worst:.0e} N m.",
        holds=worst < 1e-9,
        draw=draw,
    )


def static_torques(library: Any, K_p: float, imposed: Array) -> Array:
    """Torque [N m] of the tendons against a fixture that holds the link at deflexions [rad] and is felt by the law.

    The fixture's torque is the load under which the link would stand there by itself.
    """
    loop, _ = pair_loop(library.backstepping_antagonistic, TABLE_PAIR, (K_p, 0.05))
    unit = loop.at_rest([1.0, 0.0])
    torques: Array = imposed / unit[0] * (unit[4] - unit[2])
    return torques
