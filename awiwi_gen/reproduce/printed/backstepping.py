"""Every number printed in chapters 15 and 16 against ours, all of them computed here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import (
    TABLE_15_1,
    TABLE_16_1,
    UNIT_WEIGHTS,
    Loop,
    impedance_loop,
    joint_loop,
    normalised_loop,
    position_loop,
)
from awiwi_gen.loops.pair import TABLE_PAIR, TUNING, at_rest, literal_loop, pair_loop
from awiwi_gen.loops.regulator import cancelling, regulator
from awiwi_gen.reproduce.gain_search import PRINTED_BOX, draw, nearest
from awiwi_gen.results import Printed, compared, judged, listed, misprint
from awiwi_gen.simulate import PERIOD

FIGURE_15_13 = (5.0, 1.0, 100.0, 100.0)  # K1 .. K4
FIGURE_15_16 = (0.5, 0.05, 100.0, 100.0)  # K_p, K_d, K3, K4
TABLE_16_COSTS = np.diag([100.0, 0.01, 0.01, 0.01]), 0.1
SAMPLES, SEED = 20000, 1


def printed_numbers(library: Any, hand: Hand) -> list[Printed]:
    """The table for chapters 15 and 16, in the order of the source."""
    return [
        *example(library), *single_joint(library), *impedance(library), *nonlinear(library), *antagonistic(library),
        *state_feedback(library), *optimum(library, hand),
    ]  # fmt: skip


def example(library: Any) -> Iterator[Printed]:
    """Section 15.1, at the smallest gains of figure 15.1."""
    x, k = np.array([0.1, 0.1]), np.array([0.01, 0.5])
    ours = library.backstepping_academic_lyapunov(x=x, k=k)
    rises = ours.Vdot + x[0] * (x[1] - ours.controls)
    yield misprint(
        "eq. 15.10, 15.9", "V' < 0", f"V' = {rises:+.3g} at k = (0.01, 0.5), x = (0.1, 0.1)",
        f"the control lacks -x1; with it V' = {ours.Vdot:+.3g} there",
    )  # fmt: skip


def single_joint(library: Any) -> Iterator[Printed]:
    """Section 15.2."""
    ratio = f"{TABLE_15_1.b / TABLE_15_1.m:.4g} times too much for table 15.1"
    yield misprint("eq. 15.15", "f / m in the motor's row", "f / b", ratio)
    yield compared(
        "tables 15.1, 15.2: b", "2e-4", TABLE_16_1.b, "2e-7 kg m^2 times the square of the printed gear ratio of 100",
    )  # fmt: skip
    laws = {"position law": position_loop, "impedance law, m = 1": normalised_loop}
    for name, build in laws.items():
        loop = build(library, TABLE_15_1, FIGURE_15_13)
        margin, radius = loop.delay_margin(), loop.sampled_radius()
        yield judged(
            False, "section 15.2.4, figure 15.13", "333 us should not make it oscillate",
            f"{name}: delay margin {margin * 1e6:.0f} us",
            f"at {1 / PERIOD:.0f} Hz and one sample of delay the spectral radius is {radius:.3f}",
        )  # fmt: skip
    for name, build in laws.items():
        peak = peak_torque(build(library, TABLE_15_1, (1.0, 1.0, 100.0, 100.0)), 0.8)
        yield judged(
            False, "figures 15.10, 15.11", "strong saturation at 0.0005", f"{name}: largest torque {peak:.2g} N m",
            "with b of table 15.1 the torque never gets there",
        )  # fmt: skip


def peak_torque(loop: Loop, step: float) -> float:
    """Largest torque [N m] of a loop on its way from ``step`` away; it is at the start or soon after."""
    times = np.linspace(0, 20 / np.abs(loop.poles().real).min(), 20001)
    fine = np.linspace(0, 20 / np.abs(loop.poles()).max(), 2001)
    start = np.array([-step, *np.zeros(len(loop.A) - 1)])
    return max(float(np.abs(loop.response(start, t) @ loop.K.T).max()) for t in (times, fine))


def impedance(library: Any) -> Iterator[Printed]:
    """Section 15.3."""
    m, b, k = TABLE_15_1.numbers
    K_p, K_d, K_3, K_4 = FIGURE_15_16
    yield misprint("eq. 15.53", "k / m before the bracket", "k / b", f"{b / m:.4g} times too much")
    ours = library.backstepping_state_gains(plant=(m, b, k), gains=FIGURE_15_16, weights=UNIT_WEIGHTS)
    third = b / k * (k * (m + b) / (m * b) + K_4 * (K_3 + K_d / m) + (K_3 * K_d + K_p) / m + 1)
    wrong = joint_loop(TABLE_15_1, np.array([*ours.K[:2], third, ours.K[3]]), ours.h)
    yield misprint(
        "eq. 15.70, gain of tau", f"{third:.7g}", f"{ours.K[2]:.7g}",
        "sign of k (m + b) / (m b), and 1 / m left out; as printed the static stiffness is "
        f"{wrong.stiffness:.2g} N m/rad instead of {K_p:g}",
    )  # fmt: skip
    fed, unfed = (impedance_loop(library, TABLE_15_1, FIGURE_15_16, fed=(part, 0.0)) for part in (1.0, 0.0))
    yield judged(
        False, "section 15.3.5", f"stiffness {K_p:g} N m/rad from tau and tau' alone", f"{unfed.stiffness:.2g} N m/rad",
        f"tau_ext must be fed; then it is {fed.stiffness:.7g}",
    )  # fmt: skip
    times = np.linspace(0, 10 * K_d / K_p, 4001)
    overshoot = fed.response(np.zeros(4), times, [1.0, 0.0])[:, 0].max() * fed.stiffness
    yield judged(
        False, "section 15.3.5", "sufficient to neglect the rate of tau_ext",
        f"a load step overshoots to {overshoot:.3g} times its deflexion",
        "the error that the step makes of the torque's rate takes K_d / K_p to die",
    )  # fmt: skip
    loops = [impedance_loop(library, TABLE_15_1, (K, *FIGURE_15_16[1:])) for K in (0.02, 0.1, 0.5)]
    deflexions = [torque / loops[0].stiffness for torque in (1.0, 0.2)]
    yield misprint(
        "figure 15.16", "1 N m in the text, 0.2 N m in the caption", listed(deflexions, ".3g", " rad and ") + " rad",
        "deflexions at the softest gain; no finger has them. The third label, q_ss at 0.2, means K_p = 0.5",
    )  # fmt: skip
    slowest = [loop.poles().real.max() for loop in loops]
    yield judged(
        False, "figure 15.16", "rise times are identical", listed(slowest, ".2f") + " 1/s",
        "slowest poles at the three gains: near -K_p / K_d, not the motor's",
    )  # fmt: skip
    other, softer = (impedance_loop(library, TABLE_16_1, (K_p, damping, K_3, K_4)) for damping in (K_d, 0.0012))
    yield judged(
        False, "figures 15.16, 15.17: K_d", "0.05", f"delay margin {fed.delay_margin() * 1e6:.1f} us",
        f"a pole at -K_d / m: on the hand's clock the spectral radius is {fed.sampled_radius(0):.1f} without delay and "
        f"{fed.sampled_radius(1):.1f} with a sample of it, {other.sampled_radius(0):.1f} and {other.sampled_radius(1):.1f} "
        f"for table 16.1, where with K_d = 0.0012 it is {softer.sampled_radius(1):.4f} with a sample of delay",
    )  # fmt: skip
    expected = 2 * 0.3
    yield compared("figure 15.18, expected torque", "0.6", expected, "2 N m/rad at 0.3 rad")
    below = f"measured: {(expected - 0.579) / expected:.1%} below the law"
    yield compared("figure 15.18, measured torque", "0.579", expected, below, "not reproducible")


def nonlinear(library: Any) -> Iterator[Printed]:
    """Section 15.4: the factor of tau behind a linear spring, by the compiled law."""
    m, b, _ = TABLE_15_1.numbers
    law = library.backstepping_nonlinear
    given = {"bodies": (m, b), "gains": FIGURE_15_16, "weights": UNIT_WEIGHTS, "external": np.zeros(2)}
    given |= {"desired": np.zeros(5), "state": (0.0, 0.0, 1.0, 0.0)}
    stiff = law(spring=(1e30, 0.0), **given).tau_m  # an endless slope leaves this factor alone
    printed = (b + m) / (b * m)
    yield misprint(
        "eq. 15.77, factor of tau", f"{printed:.4g}", f"{stiff:.4g}",
        f"(b + m) / m; printed {printed / stiff:.0f} times too large, 1 / b",
    )  # fmt: skip


def antagonistic(library: Any) -> Iterator[Printed]:
    """Section 15.5, on the plant of table 16.1 doubled."""
    stiffness_and_damping, wanted = FIGURE_15_16[:2], 0.15
    law = library.backstepping_antagonistic
    loop, constant = pair_loop(law, TABLE_PAIR, stiffness_and_damping, pretension=wanted)
    turned, _ = pair_loop(law, TABLE_PAIR, stiffness_and_damping, (-TUNING[0], *TUNING[1:]))
    yield misprint(
        "eq. 15.95, sign of K_t", f"slowest pole {turned.poles().real.max():+.4g} 1/s",
        f"{loop.poles().real.max():+.4g} 1/s", f"near +K_t / C_t = {TUNING[0]:g} 1/s as printed",
    )  # fmt: skip
    literal = literal_loop(TABLE_PAIR, stiffness_and_damping)
    yield misprint(
        "eq. 15.106", f"slowest pole {literal.poles().real.max():+.3g} 1/s", f"{loop.poles().real.max():+.4g} 1/s",
        "one derivative too many, and K_t e_t taken for K_t e_t'",
    )  # fmt: skip
    shortcut = pair_loop(
        library.backstepping_antagonistic_decoupled, TABLE_PAIR, stiffness_and_damping, pretension=wanted
    )
    left, exact = at_rest(*shortcut)[2], at_rest(loop, constant)[2]
    yield misprint(
        "eq. 15.84 to 15.86", f"pretension {wanted:g} N m", f"{left:.2g} N m",
        f"each motor takes its pretension for an acceleration; as one system of order six it is {exact:.7g}",
    )  # fmt: skip


def state_feedback(library: Any) -> Iterator[Printed]:
    """Equation 16.3 on the plant of table 16.1."""
    m, b, k = TABLE_16_1.numbers
    given = {"plant": (m, b, k), "weights": UNIT_WEIGHTS}
    found = library.backstepping_state_gains_derivatives(gains=np.full(4, 1e-9), **given)
    yield compared("eq. 16.3, b / k", "0.0033", found[3, 2], "slope of the gain of tau' by K_3")
    yield compared("eq. 16.3, b / (k m)", "4600", found[3, 1], "slope of the gain of tau' by K_d")
    yield compared("eq. 16.3, 1 / m", "1400000", found[3, 1] / found[3, 2], "the quotient of both")
    rest = library.backstepping_state_gains(gains=np.full(4, 1e-12), **given)
    yield compared(
        "eq. 16.3, constant", "7400", float(rest.K[2]),
        f"+(m + b) / m in place of -(m + b) / m; with the spring cancelled as in table 16.1, {rest.K_cancelled[2]:.7g}",
    )  # fmt: skip


def optimum(library: Any, hand: Hand) -> Iterator[Printed]:
    """Tables 16.1 and 16.2, and algorithm 3."""
    plant = TABLE_16_1
    wanted = regulator(plant, *TABLE_16_COSTS, cancelled=True)
    unit = regulator(plant, np.eye(4), 1.0, cancelled=True)
    poles = np.sort(joint_loop(plant, unit - cancelling(plant), np.zeros(2)).poles().real)
    for text, pole, gain in zip(("-7.7018", "-3.8384", "-3.8384", "-0.0100"), poles, wanted, strict=True):
        hundredth = compared("", text, pole / 100, "")
        relation = "is" if hundredth.verdict == "agrees" else "is not even"
        reason = f"it {relation} a hundredth of the real part of a closed-loop pole for Q = I and R = 1"
        yield misprint("tables 16.1, 16.2: K_des", text, f"{gain:.7g}", reason)
    m, b, k = plant.numbers
    least = b / k * (1 + 1 / m)
    yield judged(
        False, "eq. 16.4, table 16.1", "some gains come close to the optimum",
        f"gain of tau: at least {least:.6g}, wanted {wanted[2]:.6g}",
        "with weights of 1 no gains have it; with other weights all four are had exactly",
    )  # fmt: skip
    drawn = nearest(library, plant, wanted, draw(PRINTED_BOX, SAMPLES, SEED), relative=False)
    pole = impedance_loop(library, plant, drawn.gains).poles().real.max()
    yield judged(
        False, "chapter 16, algorithm 3", "rand(1, 4)", f"slowest pole {pole:.2g} 1/s",
        "gains between 0 and 1 hold no useful K_3 or K_4; and the best draw is overwritten by its feedback gains",
    )  # fmt: skip
    yield compared("chapters 14 and 16, tendons", "38", float(hand.tendons), "of this hand", "not reproducible")
    joints = sum(len(finger.joints) for finger in hand.fingers.values())
    yield compared("chapter 14, joints", "19", float(joints), "of the fingers of this hand", "not reproducible")
