"""Every number and every claim in numbers of chapters 7, 8, 9 and 11 against ours, all of them computed here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from awiwi_gen.hand import Hand
from awiwi_gen.kernels.fingers_control import antagonists
from awiwi_gen.reproduce.distribution_search import WEIGHTS, Demands, closed_form_of
from awiwi_gen.results import Printed, compared, judged, misprint
from awiwi_gen.simulate import PERIOD
from awiwi_gen.structure import groups

COUNT = 300
VISIBLE = 1e-3  # N; violations below are rounding


def printed_numbers(library: Any, hand: Hand) -> list[Printed]:
    """The table for these chapters, in the order of the source; of chapter 7 what this hand has the fingers for."""
    return [*counts(library, hand), *search(library, hand), *stiffness(library), *friction(), *cascade(library)]


def paired(hand: Hand) -> list[str]:
    """Fingers of four joints and eight tendons, all of them antagonistic pairs."""
    found = []
    for name, finger in hand.fingers.items():
        if (len(finger.joints), len(finger.tendons)) == (4, 8) and all(antagonists(finger, g) for g in groups(finger)):
            found.append(name)
    return found


def counts(library: Any, hand: Hand) -> Iterator[Printed]:
    """Sections 7.1 and 7.2."""
    for name in paired(hand)[:1]:
        P = library[f"{name}_coupling"](np.zeros(4))
        m, n = P.shape
        moves = m - np.linalg.matrix_rank(P)
        yield compared("section 7.1: numbers of a torque", "4", n, name)
        yield compared("section 7.1: numbers of a symmetric stiffness", "10", n * (n + 1) // 2, name)
        yield compared("section 7.1: tendon forces", "8", m, name)
        yield compared("eq. 7.7: alpha in R^n", "4", moves, "m - n of them; as many as joints only where m = 2 n")
        yield misprint("eq. 7.6", "P f = tau", f"P is {m} x {n}", "P' f, with the sign of the path length")
    yield misprint(
        "eq. 7.8, 7.9", "the root of the sum of x_i", f"{np.sqrt(np.sum([1.0, -1.0])):g} for x = (1, -1)",
        "a norm is zero for zero only: the sum is of squares",
    )  # fmt: skip
    yield misprint("eq. 7.10", "max a_ij", f"{max(-1.0, -2.0):g} for a = (-1, -2)", "a norm is not negative: of |a_ij|")


def search(library: Any, hand: Hand) -> Iterator[Printed]:
    """Section 7.2 and algorithm 2, on demands that forces within the limits give exactly."""
    for name in [name for name in paired(hand) if closed_form_of(library, name)][:1]:
        demands = Demands.feasible(library, name, COUNT)
        ours = demands.closed_form()
        yield misprint(
            "section 7.3", "numerical search is the only available tool",
            f"closed form: errors up to {demands.miss(ours).max():.0e} N m/rad, no limit violated",
            "antagonistic pairs make the problem convex in the sums of their stiffnesses",
        )  # fmt: skip
        printed, corrected = (demands.search(printed) for printed in (True, False))
        yield misprint(
            "chapter 7, algorithm 2", "alpha moves by the gradient of the last trial",
            f"median error {np.median(demands.miss(printed)):.2g} N m/rad, "
            f"corrected {np.median(demands.miss(corrected)):.2g}",
            "the gradient is overwritten before alpha moves, also by that of a rejected trial",
        )  # fmt: skip
        for weight in WEIGHTS:
            f = demands.search(False, weight)
            violated = demands.violation(f)
            yield Printed(
                f"section 7.2, penalty {weight:g}", "the limits are in practice achieved",
                f"violated in {np.mean(violated > VISIBLE):.0%} of {COUNT} cases, by up to {violated.max():.2g} N",
                "not reproducible" if violated.max() > VISIBLE else "agrees",
                f"a penalty trades limits for stiffness: its error there is {np.median(demands.miss(f)):.2g} N m/rad",
            )  # fmt: skip
        missed = np.abs(corrected @ demands.P + demands.tau).max()
        yield judged(
            missed < 1e-12, "section 7.2", "the torque is exactly achieved", f"to {missed:.0e} N m", "null space",
        )  # fmt: skip


def stiffness(library: Any) -> Iterator[Printed]:
    """Chapter 8."""
    for eps, word in ((2.0, "good"), (3.0, "good"), (1.5, "acceptable")):
        found = library.stiffness_correction_scalar(1.0, eps)
        yield judged(
            (abs(found.sensitivity) <= 1) == (word == "good"), f"eq. 8.2: eps = {eps:g}", word,
            f"K_imp = {found.k_imp:.4g} K_eff, dK_imp/dK_mech = {found.sensitivity:.4g}",
            "an error of K_mech comes back multiplied by the slope; where it is above 1 it grows",
        )  # fmt: skip
    for printed, felt in (("1", 1.0), ("0.7", 0.7)):
        mechanical = 1.5 * felt
        controller = library.stiffness_correction_scalar(felt, mechanical).k_imp
        yield compared(
            "figure 8.3: stiffness felt [N m/rad]", printed, float(1 / (1 / controller + 1 / mechanical)),
            f"{controller:.3g} N m/rad behind {mechanical:.3g}; what disturbances leave of it is in the figure",
        )  # fmt: skip
    yield misprint(
        "section 8.2", "stability only depends on K_eff being positive definite",
        f"K_imp = -3, K_mech = 1: K_eff = {1 / (1 / -3 + 1):g}, determinant of the energy {-3 * 1:g}",
        "the serial energy is positive definite only with K_imp and K_mech",
    )  # fmt: skip
    near = library.stiffness_correction_scalar(1.0, 1 + 1e-9).k_imp
    yield misprint(
        "section 8.3", "K_imp^-1 becomes infinite", f"K_imp = {near:.1e} at K_mech = (1 + 1e-9) K_eff",
        "K_imp does, its inverse vanishes",
    )  # fmt: skip


def friction() -> Iterator[Printed]:
    """Chapter 9."""
    for printed, share in (("10", -0.5), ("30", 0.5)):
        yield compared("chapter 9: 20 N with 50 % of friction", printed, 20 * (1 + share), "N")


def cascade(library: Any) -> Iterator[Printed]:
    """Chapter 11."""
    yield compared("section 11.2: control delay [us]", "333", PERIOD * 1e6, "one period of 3 kHz")
    D, P = 0.01 * np.eye(4), 0.005 * np.ones((8, 4))
    W = np.block([[D, P.T / 2], [P / 2, -np.eye(8)]])
    margin = library.cascade_certificate(D, P, np.full(8, 2e4), np.full(8, 200.0), 0.1, 140.0).margin
    yield misprint(
        "eq. 11.20, 11.21", "W is positive definite",
        f"its least eigenvalue is {np.linalg.eigvalsh(W)[0]:.3g}; ours has the margin {margin:.2g}",
        "G enters with a minus; a Lyapunov equation for the force loops mends it",
    )  # fmt: skip
