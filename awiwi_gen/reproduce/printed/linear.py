"""Every number printed in chapters 10, 12, 13 and 14 against ours, all of them computed here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.loops.joint import TABLE_12_1, TABLE_12_1_TARGET, TABLE_13_1, TABLE_14_2, Plant
from awiwi_gen.loops.sampled import is_implementable
from awiwi_gen.reproduce.figures.linear import stable_band
from awiwi_gen.reproduce.figures.tendon import DAMPING, FREQUENCY, STEPS, TUNED_AT, Bench
from awiwi_gen.results import Printed, compared, judged, misprint
from awiwi_gen.simulate import Array

OTHER_TARGET = {"omega": (100.0, 10.0), "xi": (1.0, 1.0)}
RISE = 0.03  # s, of the steps in figure 10.2
POLES_12_17 = ("-100", "-100", "-10", "-10")
GAINS_12_18 = ("4395", "6.177", "-4395", "288.99")
POLES_12_19 = (-318.78, 53.27, 53.27, -0.058)
GAINS_13_11 = ("-126.21", "-0.11", "159.37", "1.52")


def printed_numbers(library: Any, hand: Hand) -> list[Printed]:
    """The table for chapters 10, 12, 13 and 14, in the order of the source."""
    gains = [library.pole_placement(**TABLE_12_1.ports, **target).K for target in (TABLE_12_1_TARGET, OTHER_TARGET)]
    return [*tendon(library, hand), *poles(*gains), *sensitivity(*gains), *optimum(library), *pointwise(library)]


def tendon(library: Any, hand: Hand) -> Iterator[Printed]:
    """The law, its scheduled gains, and what is said of its damping."""
    given = {"f": 20.0, "fd": 0.0, "f_des": 20.0, "fd_des": 0.0, "f_hat": 20.0, "r": 0.004}
    ours = [float(library.tendon_force_pd(**given, kp=1.0, kd=1e-3, friction=each).tau) for each in (0.0, 0.5)]
    left = [-(ours[0] + 0.004 * 20.0), ours[1] - 0.5 - 0.004 * 20.0]
    yield misprint(
        "eq. 10.1, 10.2: torque left at rest", f"{2 * (0.5 + 0.004 * 20.0):.3g} N m, by the printed signs",
        f"{abs(round(left[1], 9)):.3g} N m",
        "at 20 N on a pulley of 4 mm with 0.5 N m of friction: estimates are to oppose what they estimate",
    )  # fmt: skip
    scheduled = given | {"friction": 0.0, "b": 2e-3, "stiffness": 8000.0, "omega0": 100.0, "xi0": 1.0}
    resting = library.tendon_force_scheduled(**scheduled, stiffness_rate=0.0)
    yield misprint(
        "eq. 10.10, 10.11: K_p", "omega^2 B/beta, endless where the force rests", f"{resting.gains[0]:.4g} m",
        "alpha, the slope of the force, stands where beta, its rate, is printed",
    )  # fmt: skip
    if hand.motor and hand.spring:
        bench = Bench(library, hand.motor)
        soft, stiff = bench.stiffness(STEPS[0])
        scheduled |= {"stiffness": float(stiff), "b": bench.inertia, "omega0": FREQUENCY, "xi0": DAMPING}
        rate = (stiff - soft) / RISE
        resting, moving = (
            library.tendon_force_scheduled(**scheduled, stiffness_rate=each).gains for each in (0.0, rate)
        )
        change = abs(1 - moving[0] / resting[0])
        yield judged(
            change < 0.1, "section 10.4: beta", "can be neglected",
            f"K_p changes by {change:.1%} at {rate:.2g} N/(m s)",
            f"the rate at which the stiffness changes from 10 to 20 N in {RISE * 1e3:.0f} ms, as in figure 10.2",
        )  # fmt: skip
        ratios = DAMPING * np.sqrt(bench.stiffness(STEPS[:, 1]) / bench.stiffness(TUNED_AT))
        yield misprint(
            "section 10.2: above the tuned force", "underdamped", f"damping ratio {ratios[-1]:.2f}",
            f"more damped, not less: {ratios[0]:.2f} at 20 N, {ratios[1]:.2f} at 30 N; it grows with the root of the slope",
        )  # fmt: skip
    yield misprint(
        "figures 10.3, 10.4: step", "5 N", f"{np.diff(STEPS)[0, 0]:g} N",
        "the text has steps from 10 N to 20 N and so on, the caption steps of 5 N",
    )  # fmt: skip


def poles(table: Array, other: Array) -> Iterator[Printed]:
    """Equations 12.14 to 12.18, for gains (4,) by the target of table 12.1 and by that of eq. 12.17."""
    m, b, k = TABLE_12_1.m, TABLE_12_1.b, TABLE_12_1.k
    wrong, right = m * b / k * (m + b), k * (m + b)
    yield misprint(
        "eq. 12.14, third row", f"{wrong:.4g}", f"{right:.4g}",
        "k (m + b); printed (m b/k) (m + b), which its own eq. 12.12 contradicts; by table 12.1",
    )  # fmt: skip
    reach = np.stack([np.linalg.matrix_power(TABLE_12_1.A, i) @ TABLE_12_1.B for i in range(4)], axis=1)
    printed = k**2 / (m**2 * b**4)
    yield compared("eq. 12.16, det(J)", f"{printed:.6g}", abs(float(np.linalg.det(reach))), "that of controllability")
    placed, meant = (_sorted(TABLE_12_1.loop(K).poles()) for K in (table, other))
    for index, text in enumerate(POLES_12_17):
        yield judged(
            False, f"eq. 12.17, pole {index + 1}", f"{text} {'+-'[index % 2]} {'0.66' if index < 2 else '0.38'}j",
            _complex(placed[index]),
            f"table 12.1 has omega = (100, 30) and xi = 0.7; omega = (100, 10) and xi = 1 give {meant[index].real:.4g}, "
            "twice; what is imaginary in print is the rounding of double poles",
        )  # fmt: skip
    for index, text in enumerate(GAINS_12_18):
        yield compared(
            f"eq. 12.18, alpha_{index + 1}", text, -float(table[index]),
            f"by the target of table 12.1; by the one of eq. 12.17 {-other[index]:.6g}", "not reproducible",
        )  # fmt: skip


def sensitivity(table: Array, other: Array) -> Iterator[Printed]:
    """Equation 12.19 and section 12.3, for the same gains."""
    softer = TABLE_12_1.with_(k=0.6)
    ours, meant = (_sorted(softer.loop(K).poles()) for K in (table, other))
    total = float(np.trace(softer.loop(other).closed))
    for index, text in enumerate(POLES_12_19):
        part = f" {'-+'[index % 2]} 225.14j" if index in (1, 2) else ""
        yield judged(
            False, f"eq. 12.19, pole {index + 1}", f"{text}{part}", _complex(ours[index]),
            f"{_complex(meant[index])} by the target of eq. 12.17; no plant has the printed four: their sum is "
            f"{sum(POLES_12_19):.2f}, that of the loop {total:.0f} for every spring",
        )  # fmt: skip
    low, high = stable_band(table)
    yield judged(
        low <= 0.43 and high >= 1.15, "section 12.3: springs from 0.43 to 1.15", "no unstable system",
        f"stable from {low:.6f} to {high:.6f}",
        f"{(high - low) / (high + low):.2%} either way; that it is sensitive agrees",
    )  # fmt: skip
    yield misprint(
        "figure 12.3: D_q", "0.43 to 1.15", f"{TABLE_12_1.dq:g} N m s/rad in table 12.1",
        "the range is that of the spring",
    )  # fmt: skip


def optimum(library: Any) -> Iterator[Printed]:
    """Equation 13.11 and the claims on figures 13.2 and 13.3."""
    bare = TABLE_13_1.with_(dq=0.0, dtheta=0.0)
    without, damped = bare.optimum(library), TABLE_13_1.optimum(library)
    fitted = fit_13_11(library)
    K = fitted.optimum(library)
    for index, text in enumerate(GAINS_13_11):
        yield compared(
            f"eq. 13.11, K{index + 1}", text, float(without[index]),
            f"{damped[index]:.6g} with the friction of table 12.1; {K[index]:.5g} with m = {fitted.m:.3g}, "
            f"b = {fitted.b:.3g}, d_q = {fitted.dq:.3g}", "not reproducible",
        )  # fmt: skip
    q1, _, q3, _ = TABLE_13_1.weights
    printed = float(GAINS_13_11[0]) + float(GAINS_13_11[2])
    total, rounding = float(without[0] + without[2]), 2 * 0.005
    yield judged(
        abs(total - printed) < rounding, "eq. 13.11, K1 + K3", f"{printed:.2f}", f"{total:.7g}",
        f"the root of (q1 + q3)/R, {np.sqrt((q1 + q3) / TABLE_13_1.R):.7g}, for any joint: Q and R are those printed",
    )  # fmt: skip


def fit_13_11(library: Any) -> Plant:
    """A joint near table 13.1 whose optimum is eq. 13.11: its m as in table 14.2, b and d_q by Newton's method."""
    joint = TABLE_13_1.with_(m=TABLE_14_2.m, b=4.1e-3, dq=5e-4)
    first, _, third, fourth = map(float, GAINS_13_11)
    q1, _, q3, _ = joint.weights
    wanted = np.array([(third + np.sqrt((q1 + q3) / joint.R) - first) / 2, fourth])  # K1 and K3 have one rounding each
    for _ in range(8):
        steps = {"b": 1e-6 * joint.b, "dq": 1e-6 * joint.dq}
        here = joint.optimum(library)[2:]
        slopes = np.stack(
            [(joint.with_(**{n: getattr(joint, n) + d}).optimum(library)[2:] - here) / d for n, d in steps.items()],
            axis=1,
        )
        move = np.linalg.solve(slopes, wanted - here)
        joint = joint.with_(b=joint.b + float(move[0]), dq=joint.dq + float(move[1]))
    return joint


def pointwise(library: Any) -> Iterator[Printed]:
    """Equations 14.5 to 14.10 and the tables."""
    K = TABLE_14_2.optimum(library)
    rows = {sign: TABLE_14_2.loop(sign * K).poles().real.max() for sign in (1, -1)}
    yield misprint(
        "eq. 14.5, 14.6: slowest pole", f"{rows[-1]:+.3g} 1/s", f"{rows[1]:+.3g} 1/s",
        "the printed signs are solved by -S, and u = -R^-1 B'S x then drives the joint away; by table 14.2",
    )  # fmt: skip
    given = {"thd": 0.0, "b": 2e-3, "dtheta": 0.0, "weights": (1.0, 1e-4), "R": 1e-6, "theta": 0.0, "theta_des": 0.0}
    gains = {k: library.sdre_tendon(**given, spring=(k, 0.0, 0.0)).K for k in (-100.0, 1.0, 100.0)}
    yield misprint(
        "eq. 14.9: K1 at 100 N m/rad", f"{gains[-100.0][0]:.6g}", f"{gains[100.0][0]:.6g}",
        "a spring that pulls back has a minus in A21: printed gains are 2 k too large",
    )  # fmt: skip
    stiff = {k: k + gains[k][0] for k in (1.0, 100.0)}
    changes = abs(stiff[100.0] / stiff[1.0] - 1), abs(gains[100.0][1] / gains[1.0][1] - 1)
    yield judged(
        max(changes) < 0.01, "section 14.4: tendon gains", "do not change significantly",
        f"k + K1 by {changes[0]:.2%}, K2 by {changes[1]:.2%}", "from 1 to 100 N m/rad, at the weights of table 14.1",
    )  # fmt: skip
    spring, ends = np.array([0.605, 0.0, 1.0]), (0.5, 0.1)
    powers = np.arange(1, 4)
    gap = float(spring @ (ends[0] ** powers - ends[1] ** powers))
    secant = float(library.secant_stiffness(spring, *ends).k)
    slope = float(spring @ (powers * ends[0] ** (powers - 1)))
    yield misprint(
        "eq. 14.10: k(x1 - x3), the joint stiffness",
        f"misses the torque by {slope * (ends[0] - ends[1]) - gap:.3g} N m",
        f"{secant * (ends[0] - ends[1]) - gap:.1g} N m with the secant",
        "only the secant makes A(x) x the plant; for 0.605 x + x^3 between 0.1 and 0.5 rad",
    )  # fmt: skip
    for name, A, B, found in (
        ("table 14.1", *_motor(100.0), gains[100.0]), ("table 14.2", TABLE_14_2.A, TABLE_14_2.B, K)
    ):  # fmt: skip
        answer = is_implementable(A, B, found)
        yield judged(
            answer.implementable, f"{name}: its gains", "simulated without a clock",
            f"spectral radius {answer.report.radius:.3g} at 3 kHz", answer.reason,
        )  # fmt: skip


def _motor(k: float) -> tuple[Array, Array]:
    """The motor of table 14.1 on a spring."""
    return np.array([[0, 1], [-k / 2e-3, 0]]), np.array([0, 1 / 2e-3])


def _sorted(values: Array) -> Array:
    """Poles, the fastest first, then by their imaginary parts."""
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 6)))
    found: Array = values[order]
    return found


def _complex(value: complex) -> str:
    value = complex(value)
    if abs(value.imag) < 1e-3:
        return f"{value.real:.6g}"
    return f"{value.real:.6g} {'+' if value.imag > 0 else '-'} {abs(value.imag):.6g}j"
