"""The lever spring, its curves and its calibration (chapter 4): energy, convexity, the inverse against the truth."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
import sympy
from actuators import compiled, hand_text
from flint import arb, ctx

from awiwi_gen.definitions import spring as springs
from awiwi_gen.definitions.naming import Derivation
from awiwi_gen.derive import Deriver
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.lever import Lever
from awiwi_gen.ir.algebras import Balls
from awiwi_gen.ir.builder import Builder
from awiwi_gen.ir.from_sympy import lower_sympy
from awiwi_gen.ir.graph import Output
from awiwi_gen.ir.interpret import evaluate
from awiwi_gen.ir.passes.bind import bind
from awiwi_gen.kernels import catalog

SLACK, TAUT = 3.25, 3.62


@pytest.fixture(scope="module")
def lib():
    return compiled()


@pytest.fixture(scope="module")
def spring():
    return Hand.parse(hand_text()).spring


@pytest.fixture(scope="module")
def angles():
    return np.linspace(SLACK, TAUT, 2001)


def values(part):
    return {path: quantity.value for path, quantity in part.quantities().items()}


def exact(spring, *outputs):
    """SymPy expressions of the hand's spring at a lever angle, as a function of lists of balls."""
    theta = sympy.Symbol("theta", real=True)
    part = spring.symbolic(lambda path, _: sympy.Symbol(path, real=True))
    builder = Builder()
    leaves = {sympy.Symbol(path, real=True): builder.param(path) for path in spring.quantities()}
    leaves[theta] = builder.input("theta", 0)
    elements = lower_sympy(builder, [output(part, theta) for output in outputs], leaves)
    graph = bind(builder.graph([Output("y", (len(elements),), tuple(elements))]), values(spring))
    return lambda balls: evaluate(graph, Balls(len(balls)), lambda node: list(balls))["y"]


def length(part, theta):
    return springs.path(part, theta, Derivation())


def energy(part, theta):
    return part.rate * (springs.spring_length(part, theta, Derivation()) - part.free_length) ** 2 / 2


def force(part, theta):
    return springs.pose_at(part, theta, Derivation()).force


def stiffness(part, theta):
    return springs.pose_at(part, theta, Derivation()).stiffness


def rising(part, theta):
    """dk/dx, how fast the stiffness rises with the elongation x = -dL."""
    derivation = Derivation()
    stiff = springs.pose_at(part, theta, derivation).stiffness
    return -derivation.partial(stiff, theta) / derivation.partial(springs.path(part, theta, derivation), theta)


# -- the mechanism ----------------------------------------------------------------------------------------


def test_the_work_of_the_tendon_is_the_energy_of_the_spring(spring):
    with ctx.workprec(256):
        at, step = [arb(a) for a in np.linspace(SLACK, TAUT, 50)], arb(2) ** -90
        ahead, behind, here = (exact(spring, length, energy, force)([a + d for a in at]) for d in (step, -step, arb(0)))
        for i in range(len(at)):
            given = (behind[0][i] - ahead[0][i]) / (2 * step)
            stored = (ahead[1][i] - behind[1][i]) / (2 * step)
            assert abs(here[2][i] * given - stored) < arb(10) ** -40


def test_the_stiffness_is_the_slope_of_the_force_over_the_elongation(spring):
    with ctx.workprec(256):
        at, step = [arb(a) for a in np.linspace(SLACK, TAUT, 50)], arb(2) ** -90
        ahead, behind, here = (
            exact(spring, length, force, stiffness)([a + d for a in at]) for d in (step, -step, arb(0))
        )
        for i in range(len(at)):
            slope = (ahead[1][i] - behind[1][i]) / (behind[0][i] - ahead[0][i])
            assert abs(here[2][i] - slope) < arb(10) ** -40


def test_the_spring_is_strictly_stiff_and_convex_at_every_angle_of_its_travel(spring):
    """Intervals that cover the travel, not samples of it: what holds for a ball holds for each of its points."""
    edges = [arb(a) for a in np.linspace(SLACK, TAUT, 4001)]
    intervals = [left.union(right) for left, right in pairwise(edges)]
    stiff, rise = exact(spring, stiffness, rising)(intervals)

    assert min(float(k.lower()) for k in stiff) > 5500
    assert min(float(r.lower()) for r in rise) > 1.2e5


def test_the_design_gives_4_to_100_newtons_over_10_millimetres(lib, angles):
    dL, f, k, status = lib.spring_lever(angles)

    assert not status.any()
    assert (f[0], f[-1]) == pytest.approx((3.876, 100.149), abs=1e-3)
    assert (k[0], k[-1]) == pytest.approx((5542.7, 23579.9), abs=0.1)
    assert dL[0] - dL[-1] == pytest.approx(10.0745e-3, abs=1e-7)


def contact(centre, radius, direction):
    """Where a run touches a pulley that turns the tendon to the left if its radius is positive."""
    return centre + radius * np.array([direction[1], -direction[0]])


def test_the_path_is_that_of_a_tendon_laid_around_the_pulleys(lib, angles):
    """Contact points and arcs, rebuilt one by one: what leaves the mechanism is what dL loses."""
    motor, fixed, pivot = np.array([-0.01, 0.0]), np.array([0.01, 0.0]), np.array([0.018, 0.008])
    directions, lengths = [], []
    for angle in angles[::50]:
        roller = pivot + 0.018 * np.array([math.cos(angle), math.sin(angle)])
        runs = []
        for start, end, r1, r2 in ((motor, roller, 0.004, -0.003), (roller, fixed, -0.003, 0.003)):
            chord = end - start
            turn = math.atan2(chord[1], chord[0]) - math.asin((r2 - r1) / math.hypot(*chord))
            u = np.array([math.cos(turn), math.sin(turn)])
            span = contact(end, r2, u) - contact(start, r1, u)
            assert span @ u == pytest.approx(math.hypot(*span), rel=1e-14)  # tangent at both ends
            runs.append((turn, span @ u))
        directions.append([turn for turn, _ in runs])
        lengths.append(sum(span for _, span in runs) + 0.003 * (runs[0][0] - runs[1][0]))
    first, second = np.array(directions).T
    laid = np.array(lengths) + 0.004 * (first - first[0]) - 0.003 * (second - second[0])

    assert lib.spring_lever(angles[::50]).dL == pytest.approx(laid, abs=1e-16)


def test_arcs_add_nothing_to_the_leverage(spring):
    """d dL/d theta is the roller's motion along the two runs; the arcs' own derivatives cancel."""
    lever, step = Lever(spring), 1e-6
    for angle in np.linspace(SLACK + step, TAUT - step, 20):
        slope = (lever.at(angle + step).path - lever.at(angle - step).path) / (2 * step)
        assert lever.at(angle).leverage == pytest.approx(slope, abs=1e-10)


def test_the_plain_floats_of_the_check_agree_with_the_kernel(lib, spring):
    lever = Lever(spring)
    poses = [lever.at(angle) for angle in lever.angles(50)]
    dL, f, k, _ = lib.spring_lever([pose.angle for pose in poses])

    assert dL == pytest.approx([pose.path for pose in poses], abs=1e-16)
    assert f == pytest.approx([pose.force for pose in poses], rel=1e-12)
    assert k == pytest.approx([pose.stiffness for pose in poses], rel=1e-12)


def test_a_lever_past_its_dead_point_or_a_slack_spring_is_a_status(lib):
    assert lib.spring_lever([3.2, 3.4, math.nan]).status.tolist() == [1, 0, 1]


def test_the_energy_is_the_integral_of_the_force_not_half_the_integral_of_stiffness_times_elongation(lib, angles):
    dL, f, k, _ = lib.spring_lever(angles)
    x, pulled = dL[0] - dL, f - f[0]
    work = np.trapezoid(pulled, x)
    printed = np.trapezoid(k * x, x) / 2

    # By parts, the integral of the force is that of (end - x) k; only for constant k is the printed one the same.
    assert np.trapezoid((x[-1] - x) * k, x) == pytest.approx(work, rel=1e-6)
    assert printed / work < 0.85


# -- the curves without an angle --------------------------------------------------------------------------


def test_the_force_of_an_elongation_is_that_of_the_true_inverse(lib, angles):
    dL, f, k, _ = lib.spring_lever(angles)
    elongation = dL[0] - dL
    force, stiffness, back = (
        lib.spring_force(elongation), lib.spring_stiffness(elongation), lib.spring_elongation(f)
    )  # fmt: skip

    assert np.max(np.abs(force.f - f)) < 3e-7  # N
    assert np.max(np.abs(stiffness.k - k)) < 6e-4  # N/m
    assert np.max(np.abs(back.x - elongation)) < 1e-9  # m
    assert not (force.status | stiffness.status | back.status).any()


def test_between_the_samples_the_curve_errs_as_little_as_at_256_bits(spring):
    """The error is that of the polynomial, not of rounding: the exact graph has the same."""
    kernel = next(k for k in catalog(Hand.parse(hand_text())) if k.name == "spring_force")
    graph = bind(Deriver(kernel.part).derive(kernel, "sympy"), values(spring))
    angles = [arb(a) for a in np.linspace(SLACK, TAUT, 501)]
    dL, f = exact(spring, length, force)(angles)
    x = [dL[0] - value for value in dL]
    curve = evaluate(graph, Balls(len(x)), lambda node: x)["f"][0]
    worst = max(float(abs(a - b)) for a, b in zip(curve, f, strict=True))

    assert 1e-8 < worst < 2.5e-7


def test_the_check_knows_the_curves_error_without_deriving_anything(spring):
    assert Lever(spring).curve_error() == pytest.approx(2.30e-9, rel=0.01)


def test_the_curves_agree_with_one_another(lib):
    x = np.linspace(0, 10.07e-3, 500)
    f, step = lib.spring_force(x).f, 1e-7

    assert lib.spring_elongation(f).x == pytest.approx(x, abs=2e-9)
    slope = (lib.spring_force(x[1:-1] + step).f - lib.spring_force(x[1:-1] - step).f) / (2 * step)
    assert lib.spring_stiffness(x[1:-1]).k == pytest.approx(slope, abs=0.05)


def test_beyond_the_travel_there_is_a_status(lib):
    assert lib.spring_force([-1e-3, -5e-5, 0.0, 0.01, 0.0101, 0.011, math.nan]).status.tolist() == [1, 1, 0, 0, 0, 1, 1]
    assert lib.spring_elongation([0.0, 4.0, 100.0, 110.0]).status.tolist() == [1, 0, 0, 1]


# -- calibration ------------------------------------------------------------------------------------------


def test_readings_are_the_lever_at_angles_linear_in_them(lib):
    counts = np.linspace(410, 3685, 501)
    dL, f, k, _ = lib.spring_lever(SLACK + (TAUT - SLACK) * (counts - 410) / (3685 - 410))
    read = lib.calibration_readings(np.repeat(counts[:, None], 3, axis=1))

    assert not read.status.any()
    assert np.max(np.abs(read.dL - dL[:, None])) < 1e-9
    assert np.max(np.abs(read.force - f[:, None])) < 1e-5
    assert np.max(np.abs(read.stiffness - k[:, None])) < 0.06


UNIT = """
[[spring.units]]
tendon = 1
rate = "6.5 N/mm"
sensor = { slack = "500", taut = "3600" }
source = "bench"
"""


def test_a_calibrated_unit_replaces_its_own_tendon_and_no_other(lib):
    own = compiled(("[tendon]", UNIT + "[tendon]"), only="calibration_*")
    counts = np.full(3, 2000.0)
    design, read = lib.calibration_readings(counts), own.calibration_readings(counts)

    assert read.force[[0, 2]] == pytest.approx(design.force[[0, 2]], rel=1e-15)
    f = lib.spring_lever(SLACK + (TAUT - SLACK) * 1500 / 3100).force
    assert read.force[1] == pytest.approx(f * 6.5 / 7, rel=1e-6)
    assert own.calibration_readings([410, 410, 410]).status == 1  # below what unit 1 reads when slack


def test_polynomials_from_the_bench_are_evaluated_between_the_sensors_ends(lib):
    powers = np.random.default_rng(1).uniform(-1, 1, (3, 7))
    counts, ends = np.linspace(600, 3500, 100), np.array([400.0, 3700.0])
    place = (2 * counts - 4100) / 3300
    read = lib.calibration_polynomials(counts, ends, *powers)

    for values_read, own in zip(read[:3], powers, strict=True):
        assert values_read == pytest.approx(np.polynomial.polynomial.polyval(place, own), abs=1e-14)
    assert lib.calibration_polynomials([300.0, 400.0, 3700.0, 3800.0], ends, *powers).status.tolist() == [1, 0, 0, 1]


# -- fibre and guidings -----------------------------------------------------------------------------------


def test_a_fibre_in_series_adds_its_elongation(lib):
    f, k = np.linspace(1, 100, 50), np.linspace(1000, 50000, 50)
    modulus, section, rest = 90e9, 0.2e-6, 0.3

    assert lib.tendon_stretch(f) == pytest.approx(f * rest / (modulus * section), rel=1e-14)
    assert f / lib.tendon_stiffness(k) == pytest.approx(f / k + lib.tendon_stretch(f), rel=1e-14)


@pytest.fixture(scope="module")
def guiding():
    return compiled().guiding_friction


def test_guiding_friction_is_what_many_small_bends_take(guiding):
    pulled, bends = 50.0, 200_000
    left = pulled
    for _ in range(bends):
        left -= 0.05 * left * (4.0 / bends)

    assert guiding(pulled, 4.0) == pytest.approx(pulled - left, rel=1e-5)


def test_guiding_friction_is_proportional_to_the_force_and_never_exceeds_it(guiding):
    f, bend = np.linspace(0, 100, 50)[:, None], np.linspace(0, 6, 50)
    loss = guiding(f, bend)

    assert loss == pytest.approx(f / 100 * guiding(100.0, bend), abs=1e-14)
    assert np.all(loss <= f)
    # The constant C0 of eq. 4.1, as measured at 100 N, would take more than there is from a tendon at 10 N.
    printed = 100.0 * (1 - np.exp(-0.05 * 6))
    assert printed > 10


def test_two_guidings_in_a_row_take_what_one_of_both_bends_takes(guiding):
    after = 80 - guiding(80.0, 2.5)

    assert after - guiding(after, 1.5) == pytest.approx(80 - guiding(80.0, 4.0), rel=1e-14)


# -- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('taut = "3.62 rad"', 'taut = "4.6 rad"', "fails at a lever angle of 4."),
        ('taut = "3.62 rad"', 'taut = "3.8 rad"', "would miss its force by 0.0003 of the largest"),
        ('taut = "3.62 rad"', 'taut = "3.25 rad"', "it would not move"),
        ('slack = "3.25 rad"', 'slack = "3.1 rad"', "fails at a lever angle of 3.1 rad: the spring is not stretched"),
        ('\narm = "18 mm"', '\narm = "22 mm"', "is not strictly convex at a lever angle of 3.25"),
        ('\narm = "18 mm"', '\narm = "24 mm"', "the roller is too close to a pulley"),
        ('anchor = ["-6 mm", "40 mm"]', 'anchor = ["-6 mm", "-40 mm"]', "pulls the lever the wrong way"),
        ('rate = "7 N/mm"', 'rate = "0 N/mm"', "must be above zero"),
        ('taut = "3685"', 'taut = "410"', "it would measure nothing"),
        ("winding = -1", "winding = 1", "fails at a lever angle of 3.25 rad"),
        ("[tendon]", UNIT.replace("tendon = 1", "tendon = 3") + "[tendon]", "expected 0 to 2"),
        ("[tendon]", UNIT + UNIT + "[tendon]", "is units[0] already"),
        (
            "[tendon]",
            UNIT.replace('rate = "6.5 N/mm"', 'free_length = "36 mm"') + "[tendon]",
            "units[0] fails at a lever",
        ),
    ],
)
def test_a_mechanism_that_is_no_such_spring_is_refused_with_its_angle(old, new, expected):
    with pytest.raises(InputError) as caught:
        Hand.parse(hand_text((old, new)))
    assert expected in str(caught.value)
    assert "hand.toml:" in str(caught.value)
