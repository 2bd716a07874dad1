"""The wrist of chapter 6: what its equations mean once their misprints are mended, and what its kernels do."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy
from matplotlib.figure import Figure

from awiwi_gen.derive import Deriver
from awiwi_gen.hand.wrist import Linkage
from awiwi_gen.ir.algebras import ball
from awiwi_gen.ir.passes.bind import bind
from awiwi_gen.kernels.wrist import wrist_kernels
from awiwi_gen.reproduce.figures.wrist import bar_errors, figures, internal_angles, layers, tendon_displacements
from awiwi_gen.verify.reference import ball_values

A, B, C = 0.050, 0.042, 0.036  # table 6.1
R, D = math.hypot(A, B, C), B  # BB0 and BC


@pytest.fixture(scope="module")
def wrist(hand):
    return hand.wrist


@pytest.fixture(scope="module")
def grid(wrist):
    """Poses (41, 41) over the whole documented range."""
    return np.meshgrid(*(np.linspace(low, high, 41) for low, high in zip(*wrist.range, strict=True)))


@pytest.fixture(scope="module")
def neutral(lib, wrist):
    """A, B, C of the neutral pose, and M amid B and C."""
    a, b, c, _ = lib.wrist_points(*wrist.neutral)
    return a, b, c, (b + c) / 2


def pull(lib, wrist, axis: int, degrees: float):
    """Tendon displacements (m) [m] at a palm angle: flexion (axis 0) or abduction (axis 1)."""
    return tendon_displacements(lib, wrist, *internal_angles(lib, wrist, axis, np.radians([degrees])))[0]


# -- the linkage ------------------------------------------------------------------------------------------


def test_all_six_bars_keep_their_lengths_over_the_whole_range(lib, wrist, grid):
    assert bar_errors(lib, wrist, *grid).max() < 1e-16


@pytest.mark.parametrize("route", ["sympy", "casadi"])
def test_all_six_bars_keep_their_lengths_exactly_in_high_precision(wrist, route):
    kernel = next(kernel for kernel in wrist_kernels(wrist) if kernel.name == "wrist_points")
    values = {path: quantity.value for path, quantity in wrist.quantities().items()}
    poses = {"q71": np.array([[0.2], [0.6], [1.1]]), "q73": np.array([[1.3], [0.9], [0.7]])}
    found = ball_values(bind(Deriver(wrist).derive(kernel, route), values), poses, values)
    a, b, c = (np.array(found[point]).T for point in "ABC")  # (3 samples, 3 coordinates) of balls
    a0, drawn_a, drawn_b = (np.array([ball(values[f"{key}[{i}]"]) for i in range(3)]) for key in ("a0", "a", "b"))
    b0, c0, drawn_c = drawn_b * 0, drawn_b * [0, 1, 0], drawn_b * [1, 0, 1]
    bars = [(a, a0, drawn_a, a0), (b, b0, drawn_b, b0), (c, c0, drawn_c, c0)]
    bars += [(a, b, drawn_a, drawn_b), (a, c, drawn_a, drawn_c), (b, c, drawn_b, drawn_c)]
    for p, q, drawn_p, drawn_q in bars:
        squared = ((p - q) * (p - q)).sum(axis=1)  # a ball around zero has no power
        assert all(abs(error) < 1e-60 for error in squared - ((drawn_p - drawn_q) * (drawn_p - drawn_q)).sum())


def test_the_neutral_pose_is_the_drawn_one_and_its_palm_is_parallel_to_the_forearm(lib, wrist, neutral):
    a, b, c, _ = neutral

    np.testing.assert_allclose([a, b, c], [[A, B / 2, 0], [A, B, C], [A, 0, C]], rtol=0, atol=2e-17)
    expected = np.eye(4)
    expected[:3, 3] = A, B / 2, C / 2
    np.testing.assert_allclose(lib.wrist_palm_pose(*wrist.neutral).T, expected, rtol=0, atol=5e-16)
    np.testing.assert_allclose(np.degrees(wrist.neutral), [35.7539, 55.7182], rtol=0, atol=1e-4)


def test_the_axis_of_q71_is_b0c0_so_that_flexion_leaves_the_width_alone(lib, wrist):
    still, flexed = (lib.wrist_points(wrist.neutral[0] + angle, wrist.neutral[1] + 0.1) for angle in (0.0, 0.3))

    for before, after in zip(still[1:3], flexed[1:3], strict=True):
        assert after[1] == before[1]  # y, along B0C0
        assert math.atan2(after[2], after[0]) - math.atan2(before[2], before[0]) == pytest.approx(0.3, abs=1e-15)


def test_the_palm_frame_is_built_from_its_three_points(lib, grid):
    a, b, c, _ = lib.wrist_points(*grid)
    pose = lib.wrist_palm_pose(*grid).T

    np.testing.assert_allclose(pose[..., :3, 1], (b - c) / B, rtol=0, atol=1e-15)
    np.testing.assert_allclose(pose[..., :3, 2], ((b + c) / 2 - a) / C, rtol=0, atol=1e-15)
    np.testing.assert_allclose(pose[..., :3, 3], (2 * a + b + c) / 4, rtol=0, atol=1e-16)


def test_the_palm_turns_about_twice_as_far_as_the_internal_angles(lib, wrist):
    """The 30 and 20 deg of figures 6.9 and 6.10 are therefore angles of the palm."""
    flexed, _ = internal_angles(lib, wrist, 0, np.radians([30, -30]))
    _, abducted = internal_angles(lib, wrist, 1, np.radians([20, -20]))

    np.testing.assert_allclose(np.degrees(flexed - wrist.neutral[0]), [-16.39, 13.61], rtol=0, atol=0.01)
    np.testing.assert_allclose(np.degrees(abducted - wrist.neutral[1]), [-11.68, 13.56], rtol=0, atol=0.01)


# -- the misprints ----------------------------------------------------------------------------------------


def circles(centre: tuple[sympy.Expr, sympy.Expr]) -> list[sympy.Expr]:
    """|BC|^2 - D^2 and |C - centre|^2 - R^2 for B of eq. 6.1 and C of eq. 6.4: both zero if the centre is right."""
    r, d, t = sympy.symbols("R D t", positive=True)
    cos, sin = (1 - t**2) / (1 + t**2), 2 * t / (1 + t**2)  # of t_B, by the half angle
    denominator = -2 * r * d * sin + d**2 + r**2
    c = (r * (r**2 - d**2) * cos / denominator, (r**2 - d**2) * (r * sin - d) / denominator)
    gaps = [
        (r * cos - c[0]) ** 2 + (r * sin - c[1]) ** 2 - d**2,
        (c[0] - centre[0]) ** 2 + (c[1] - centre[1]) ** 2 - r**2,
    ]
    return [sympy.cancel(gap) for gap in gaps]


def test_eq_6_4_holds_if_c_runs_about_c0_and_not_about_the_centre_eq_6_1_prints():
    d = sympy.Symbol("D", positive=True)

    assert circles((sympy.S.Zero, d)) == [0, 0]
    for wrong in ((0, 0), (0, -d), (d, 0)):
        assert circles(wrong)[1] != 0


def test_eq_6_3_solves_eq_6_2_only_with_the_width_in_its_second_bracket():
    t_b = math.pi / 2 - 0.9
    t_c = math.atan2((D**2 + R**2) * math.sin(t_b) - 2 * R * D, (R**2 - D**2) * math.cos(t_b))

    def squared(second: float) -> float:
        return (R * math.sin(0.9) - R * math.cos(t_c)) ** 2 + second**2

    assert squared(R * math.cos(0.9) - D - R * math.sin(t_c)) == pytest.approx(D**2, rel=1e-14)
    assert squared(R * math.cos(0.9) - R * math.sin(t_c)) > 2 * D**2  # as printed
    printed_root = t_b - 2 * math.asin(D / (2 * R))
    assert abs(printed_root - t_c) > 0.1


def test_the_kernel_takes_the_second_root_of_eq_6_3(lib, wrist):
    for q73 in np.linspace(wrist.range[0][1], wrist.range[1][1], 7):
        t_b = math.pi / 2 - q73
        t_c = math.atan2((D**2 + R**2) * math.sin(t_b) - 2 * R * D, (R**2 - D**2) * math.cos(t_b))
        c = lib.wrist_points(wrist.neutral[0], q73).C

        assert math.hypot(c[0], c[2]) == pytest.approx(R * math.cos(t_c), abs=1e-16)
        assert c[1] == pytest.approx(D + R * math.sin(t_c), abs=1e-16)


def test_the_arctan_of_eq_6_3_must_know_its_quadrant():
    side, width = 0.030, 0.042  # a bar shorter than the width turns the sign of the denominator
    t_b = 0.4
    numerator = (width**2 + side**2) * math.sin(t_b) - 2 * side * width
    denominator = (side**2 - width**2) * math.cos(t_b)

    def bc(t_c: float) -> float:
        b, c = side * np.array([math.cos(t_b), math.sin(t_b)]), side * np.array([math.cos(t_c), math.sin(t_c)])
        return float(np.linalg.norm(b - c - [0, width]))

    assert bc(math.atan2(numerator, denominator)) == pytest.approx(width, rel=1e-14)
    assert abs(bc(math.atan(numerator / denominator)) - width) > 0.01


def test_the_radius_of_eq_6_5_is_that_of_a_about_m(neutral):
    a, b, _, m = neutral
    direction = (a - m) / np.linalg.norm(a - m)

    def ab(radius: float) -> float:
        return float(np.linalg.norm(m + radius * direction - b)) * 1e3

    assert ab(math.sqrt(math.hypot(B / 2, C) ** 2 - B**2 / 4)) == pytest.approx(41.677332, abs=1e-6)
    assert ab(math.hypot(A, C)) == pytest.approx(65.092, abs=1e-3)  # with R_AA0, as 6.5 and 6.7 print


def test_eq_6_8_takes_the_inverse_of_the_matrix_of_eq_6_6(wrist, neutral):
    a, b, c, m = neutral
    q71 = wrist.neutral[0]
    z = np.array([-math.sin(q71), 0, math.cos(q71)])
    x = (c - b) / B
    to_bcm = np.eye(4)
    to_bcm[:3, :3] = x, np.cross(z, x), z
    to_bcm[:3, 3] = -to_bcm[:3, :3] @ m
    in_bcm = to_bcm @ [*a, 1]

    assert abs(in_bcm[0]) < 1e-17  # eq. 6.5
    np.testing.assert_allclose((np.linalg.inv(to_bcm) @ in_bcm)[:3], a, rtol=0, atol=1e-16)
    assert np.linalg.norm((to_bcm @ in_bcm)[:3] - a) > 0.1


def test_the_minus_of_eq_6_7_puts_the_parallelogram_together_which_does_not_turn(lib, wrist):
    """The other root keeps all bars too, but it is not crossed: the palm's z would stay where it is."""
    for angle in (0.0, 0.2):
        a, b, c, _ = lib.wrist_points(wrist.neutral[0] + angle, wrist.neutral[1])
        m = (b + c) / 2
        axis = (np.array([0, B / 2, C]) - m) / np.linalg.norm(np.array([0, B / 2, C]) - m)
        other = m + 2 * axis * ((a - m) @ axis) - (a - m)  # the mirror image of A in the plane of BC and A0

        assert np.linalg.norm(other - [0, B / 2, C]) == pytest.approx(math.hypot(A, C), abs=1e-16)
        np.testing.assert_allclose((m - other) / C, [0, 0, -1], rtol=0, atol=1e-14)


# -- the tendons ------------------------------------------------------------------------------------------


def test_the_tendon_lengths_are_distances_between_points_of_forearm_and_palm(lib, wrist, grid):
    pose = lib.wrist_palm_pose(*grid).T
    forearm, palm = (
        np.array([[float(x) for x in getattr(tendon, end)] for tendon in wrist.tendons]) for end in ("forearm", "palm")
    )
    ends = pose[..., None, :3, 3] + np.einsum("...ij,tj->...ti", pose[..., :3, :3], palm)

    np.testing.assert_allclose(
        lib.wrist_tendon_lengths(*grid).h, np.linalg.norm(ends - forearm, axis=-1), rtol=0, atol=1e-16
    )


def test_the_coupling_is_the_derivative_of_the_lengths(lib, grid):
    step = 1e-5
    for column, (d71, d73) in enumerate([(step, 0), (0, step)]):
        ahead, behind = (lib.wrist_tendon_lengths(grid[0] + s * d71, grid[1] + s * d73).h for s in (1, -1))

        np.testing.assert_allclose(
            lib.wrist_coupling(*grid).dh[..., column], (ahead - behind) / (2 * step), rtol=0, atol=1e-9
        )


def test_table_6_2_is_two_layers_at_a_pitch_of_1_6_mm_whose_palm_rows_are_shifted(wrist):
    forearm, palm = (np.array([getattr(tendon, end) for tendon in wrist.tendons]) for end in ("forearm", "palm"))
    k = np.arange(19)

    def rounded(places):
        return [round(float(place), 3) for place in places]

    assert [float(y) for y in forearm[:, 1]] == rounded([*(21.0 + 1.6 * (k - 9)) / 1e3, *(20.2 + 1.6 * (k - 9)) / 1e3])
    assert [float(y) for y in palm[:, 1]] == rounded([*1.6 * (k - 7) / 1e3, *1.6 * (k - 8) / 1e3])
    assert np.mean(1.6 * (k - 7)) == pytest.approx(3.2)  # mm: of a layer that the forearm centres
    assert np.mean(1.6 * (k - 8)) - (20.2 - 21.0) == pytest.approx(2.4)
    for end, places in ((forearm, {0.008, 0.028}), (palm, {0.010, -0.010})):
        assert {float(z) for z in end[:, 2]} == places


def test_no_tendon_feels_flexion_in_the_neutral_pose_since_all_cross_the_middle(lib, wrist):
    assert np.abs(lib.wrist_coupling(*wrist.neutral).dh[:, 0]).max() < 1e-16


@pytest.mark.parametrize("side", [30, -30])
def test_palm_flexion_of_30_deg_pulls_all_tendons_alike_by_0_74_mm(lib, wrist, side):
    moved = pull(lib, wrist, 0, side) * 1e3

    assert 0.740 < moved.min() < moved.max() < 0.743


def test_layers_that_did_not_cross_would_feel_flexion_by_millimetres(lib, wrist):
    flexed = internal_angles(lib, wrist, 0, np.radians([30.0]))
    forearm = np.array([[float(x) for x in tendon.forearm] for tendon in wrist.tendons])
    uncrossed = np.array([[float(x) for x in tendon.palm] for tendon in wrist.tendons]) * [1, 1, -1]

    def lengths(pose):
        return np.linalg.norm(pose[:3, 3] + uncrossed @ pose[:3, :3].T - forearm, axis=1)

    moved = lengths(lib.wrist_palm_pose(*flexed).T[0]) - lengths(lib.wrist_palm_pose(*wrist.neutral).T)
    assert moved.min() < -4e-3 < 6e-3 < moved.max()


@pytest.mark.parametrize("side", [20, -20])
def test_palm_abduction_pulls_tendons_in_proportion_to_their_distance_from_the_median(lib, wrist, side):
    moved = pull(lib, wrist, 1, side)

    assert np.abs(moved).max() > 5e-3
    for layer, place in layers(wrist):
        assert np.corrcoef(place, moved[layer])[0, 1] * -np.sign(side) > 0.997
        still = np.interp(0, *zip(*sorted(zip(moved[layer], place, strict=True)), strict=True))
        assert abs(still - B / 2) < 4e-3


def test_the_figures_hold_and_can_be_drawn(lib, hand):
    drawn = figures(lib, hand)
    assert [figure.number for figure in drawn] == ["6.9", "6.10"]
    for figure, curves in zip(drawn, [1, 38], strict=True):
        axes = Figure().subplots()
        figure.draw(axes)
        assert figure.holds, figure.claim
        assert [len(line.get_xdata()) for line in axes.lines[:curves]] == [804] * curves
        assert axes.get_xlabel()
        assert axes.get_ylabel()
    assert 0 < axes.lines[curves].get_xdata()[0] < 804  # where flexion ends


# -- the domain -------------------------------------------------------------------------------------------


def test_a_wrist_past_its_domain_is_a_status_in_every_kernel(lib, wrist):
    q71, q73 = wrist.neutral
    beyond = [(q71, math.pi + 0.01), (q71, -0.01), (math.radians(91), q73), (math.radians(-91), q73), (-1.0, q73 - 0.5)]
    for kernel in (lib.wrist_points, lib.wrist_palm_pose, lib.wrist_tendon_lengths, lib.wrist_coupling):
        assert kernel(q71, q73).status == 0
        assert [int(kernel(*pose).status) for pose in beyond] == [1] * len(beyond)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_a_number_gives_a_status(lib, wrist, bad):
    for pose in ((bad, wrist.neutral[1]), (wrist.neutral[0], bad)):
        assert lib.wrist_coupling(*pose).status == 1


@pytest.mark.parametrize(
    ("away", "bound"), [(-40, -1.0), (-30, -22.3), (-20, -43.6), (-10, -66.8), (10, -69.3), (20, -52.3), (40, -27.8)]
)
def test_the_lowest_q71_at_which_the_bars_close_depends_on_q73(lib, wrist, away, bound):
    q71 = np.radians(np.arange(-89.95, 89.95, 0.1))
    closed = lib.wrist_points(q71, wrist.neutral[1] + math.radians(away)).status == 0

    assert math.degrees(q71[closed][0]) == pytest.approx(bound, abs=0.4)
    assert closed[np.flatnonzero(closed)[0] :].all()


def test_the_hand_file_is_judged_by_the_domain_of_the_kernels(lib, wrist):
    linkage = Linkage.of(wrist)
    q71, q73 = np.meshgrid(np.linspace(-3.1, 3.1, 125), np.linspace(0.02, 3.12, 63))
    status = lib.wrist_points(q71, q73).status
    told = np.vectorize(lambda *pose: bool(linkage.obstacle(*pose)))(q71, q73)

    assert (status == told).all()
    assert 0.2 < status.mean() < 0.8
