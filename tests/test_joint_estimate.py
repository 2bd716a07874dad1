"""Where the joints are, from the lengths of the tendons: closed form, bounded iteration, algorithm 1, and errors."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.optimize import least_squares
from thumbs import SHIPPED, literal, replaced, thumb, wider

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.reproduce.base_search import BaseSearch
from awiwi_gen.structure import estimated_parts
from awiwi_gen.tasks import ordered

OK, NOT_CONVERGED, NOT_FINITE = 0, 2, 3  # of awiwi_status
STRAIGHT = ("index", "middle", "ring", "fifth")  # fingers with constant couplings


def limits(lib, finger):
    port = lib[f"{finger}_tendon_lengths"].inputs[0]
    return np.array(port["low"]), np.array(port["high"])


def draw(lib, finger, count, seed=1):
    return np.random.default_rng(seed).uniform(*limits(lib, finger), (count, len(limits(lib, finger)[0])))


# -- constant couplings: eq. 5.15, mended ----------------------------------------------------------------


@pytest.mark.parametrize("finger", STRAIGHT)
def test_the_closed_form_is_the_least_squares_solution(lib, finger):
    q = draw(lib, finger, 50)
    h = lib[f"{finger}_tendon_lengths"](q) + np.random.default_rng(2).normal(0, 1e-3, (50, 1))
    straight, P = (lib[f"{finger}_{name}"](np.zeros(q.shape[1])) for name in ("tendon_lengths", "coupling"))
    expected = [np.linalg.lstsq(P, one - straight)[0] for one in h]

    np.testing.assert_allclose(lib[f"{finger}_joint_estimate"](h, np.zeros_like(q)), expected, rtol=0, atol=1e-13)


def test_equation_5_15_as_printed_forgets_the_reference_lengths():
    """With reference lengths of the tendons that differ, P^+ h + q0 is off by more than a radian."""
    thumb, index, others = re.split(r"(?=\[fingers\.index\]|\[fingers\.middle\])", SHIPPED)
    lengths = iter(range(0, 80, 10))
    shifted = re.sub('"0 mm", over', lambda _: f'"{next(lengths)} mm", over', index)
    job = Job(Hand.parse(thumb + shifted + others), only="index_*")
    lib = load(cached_tree(job), job.store)
    q = draw(lib, "index", 20)
    h, P = lib.index_tendon_lengths(q), lib.index_coupling(q[0])

    np.testing.assert_allclose(lib.index_joint_estimate(h, np.zeros_like(q)), q, atol=1e-13)
    assert np.abs(h @ np.linalg.pinv(P).T - q).max() > 1.0
    assert np.linalg.matrix_rank(P @ P.T) == 4  # of 8: the inverse that 5.15 prints does not exist


# -- the thumb -------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def readings():
    return {name: thumb(text) for name, text in {"literal": wider(literal(SHIPPED)), "tenth": wider(SHIPPED)}.items()}


@pytest.mark.parametrize(
    ("reading", "reach", "noise", "steps"),
    [("literal", 0.4, 0.0, 5), ("literal", 0.8, 0.0, 7), ("tenth", 0.4, 0.0, 5), ("tenth", 0.8, 0.0, 6),
     ("literal", 0.4, 1e-3, 7), ("literal", 0.8, 1e-3, 9)],
)  # fmt: skip
def test_few_steps_find_the_base_joints(readings, reading, reach, noise, steps):
    """From (0, 0) on a grid of 81 poses; undamped Gauss-Newton takes as many to 1e-12, with noise up to 14."""
    hand, lib = readings[reading]
    search, axis = BaseSearch(lib, hand, "thumb"), np.linspace(-reach, reach, 9)
    q = np.stack(np.meshgrid(axis, axis), axis=-1)
    h = search.lengths(q) + noise * np.random.default_rng(4).uniform(-1, 1, (9, 9, 4))
    found = search.least_squares(h, np.zeros(2), steps + 1)  # one evaluation to begin with

    assert (found.status == OK).all()
    if noise == 0:
        assert np.abs(found.q - q).max() < 1e-14


def test_the_parts_that_are_solved_apart_are_read_off_the_routing(hand):
    assert estimated_parts(hand.fingers["thumb"]) == [([0, 1], [0, 1, 2, 3]), ([2, 3], [4, 5, 6, 7])]


def test_joints_at_their_limits_leave_the_estimates_of_other_parts_alone(lib):
    low, high = limits(lib, "thumb")
    q = draw(lib, "thumb", 200)
    h, beyond = lib.thumb_tendon_lengths(q), lib.thumb_tendon_lengths(np.column_stack([q[:, :2], q[:, 2:] + 3]))
    start = np.broadcast_to((low + high) / 2, q.shape)

    inside, at_limits = lib.thumb_joint_estimate(h, start), lib.thumb_joint_estimate(beyond, start)

    assert not at_limits.status.any()
    assert np.array_equal(inside.q[:, :2], at_limits.q[:, :2])
    assert np.all(at_limits.q[:, 2] == high[2])


def test_too_few_iterations_are_told_and_leave_the_best_that_was_found(readings):
    hand, lib = readings["literal"]
    search, q = BaseSearch(lib, hand, "thumb"), np.array([0.7, -0.6])
    found = [search.least_squares(search.lengths(q), np.zeros(2), count) for count in (1, 2, 3, 20)]

    assert [int(f.status) for f in found] == [NOT_CONVERGED, NOT_CONVERGED, NOT_CONVERGED, OK]
    errors = [np.linalg.norm(search.lengths(f.q) - search.lengths(q)) for f in found]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-15


def test_the_estimate_is_that_of_scipy_also_at_the_limits(lib):
    """Thousands of noisy lengths, many of poses outside the limits, each from a start of its own."""
    count, (low, high) = 2000, limits(lib, "thumb")
    random = np.random.default_rng(8)
    q = random.uniform(low - 0.15, high + 0.15, (count, 4))
    h = lib.thumb_tendon_lengths(q) + random.uniform(-1e-3, 1e-3, (count, 8))
    start = np.clip(q + random.uniform(-0.3, 0.3, q.shape), low, high)
    found = lib.thumb_joint_estimate(h, start)

    assert (found.status == OK).all()
    assert ((found.q >= low) & (found.q <= high)).all()
    held = ((found.q == low) | (found.q == high)).any(axis=1)
    assert held.mean() > 0.3
    residual = lib.thumb_tendon_lengths(found.q) - h
    slope = np.einsum("sij,si->sj", lib.thumb_coupling(found.q), residual)
    outward = np.where(found.q == low, np.minimum(slope, 0), np.where(found.q == high, np.maximum(slope, 0), slope))
    assert np.abs(outward).max() < 1e-12  # no way down inside the limits: the condition of an optimum [m^2]
    for s in range(0, count, 5):  # SciPy takes its time
        other = least_squares(
            lambda x, h=h[s]: lib.thumb_tendon_lengths(x) - h, start[s], lib.thumb_coupling,
            (low, high), "dogbox", 1e-15, 1e-15, 1e-15,
        )  # fmt: skip
        own_cost = (residual[s] ** 2).sum() / 2

        assert own_cost < other.cost * (1 + 1e-9)
        assert np.abs(found.q[s] - other.x).max() < 1e-6 or own_cost < other.cost


@pytest.mark.parametrize("port", ["h", "start"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kernel", ["thumb_joint_estimate", "thumb_base_estimate_by_gradient"])
def test_what_is_not_a_number_is_told_and_gives_the_start(lib, kernel, port, bad):
    inputs = {p["name"]: np.array([p["low"], p["high"]]).mean(axis=0) for p in lib[kernel].inputs}
    begun = inputs["start"] + 0.1
    inputs["start"] = begun.copy()
    inputs[port][1] = bad
    found = lib[kernel](**inputs)
    middle = np.mean([lib[kernel].inputs[1][end] for end in ("low", "high")], axis=0)

    assert found.status == NOT_FINITE
    expected = np.where(np.isfinite(inputs["start"]), begun, middle)
    np.testing.assert_array_equal(found.q, expected)


@pytest.mark.parametrize("kernel", ["thumb_joint_estimate", "thumb_base_estimate_by_gradient"])
def test_a_start_outside_the_limits_is_moved_to_them(lib, kernel):
    lengths = lib.thumb_tendon_lengths([0.2, -0.3, 0.4, 0.5])
    n = lib[kernel].inputs[1]["shape"][0]
    h = lengths[: lib[kernel].inputs[0]["shape"][0]]
    outside, inside = lib[kernel](h, np.full(n, 9.0)), lib[kernel](h, lib[kernel].inputs[1]["high"])

    assert outside.status == inside.status == OK
    np.testing.assert_array_equal(outside.q, inside.q)
    np.testing.assert_allclose(outside.q, [0.2, -0.3, 0.4, 0.5][:n], atol=1e-8)


# -- algorithm 1 -----------------------------------------------------------------------------------------


def cost(search, q, h):
    """The squared residual and its gradient (eq. 5.24)."""
    residual = search.lengths(q) - h
    return (residual**2).sum(axis=-1), 2 * np.einsum("sij,si->sj", search.coupling(q), residual)


def printed(search, h, step, count, keep_best=False):
    """Algorithm 1 to the letter: C_best stays infinite, and every trial's gradient replaces the last."""
    q, best = np.zeros((len(h), 2)), np.full(len(h), np.inf)
    _, gradient = cost(search, q, h)
    steps = np.full((len(h), 1), step)
    for _ in range(count):
        trial = q - gradient * steps
        found, gradient = cost(search, trial, h)
        better = found < best
        q = np.where(better[:, None], q - gradient * steps, q)
        steps = np.where(better[:, None], steps, steps / 2)
        if keep_best:
            best = np.where(better, found, best)
    return q


@pytest.mark.parametrize(
    ("reach", "noise", "errors"),
    [(0.4, 0.0, (2.6e-7, 6.6e-13, 3.9e-16)), (0.8, 0.0, (1.0e-3, 6.5e-6, 7.8e-9)),
     (0.4, 0.5e-3, (0.0131,) * 3), (0.4, 1e-3, (0.0246,) * 3),
     (0.8, 0.5e-3, (0.0171,) * 3), (0.8, 1e-3, (0.0389,) * 3)],
)  # fmt: skip
def test_the_mended_algorithm_1_finds_what_the_printed_one_loses(readings, reach, noise, errors):
    """Largest errors after 15, 30 and 50 iterations from (0, 0) with step 200, for the points as printed.

    The errors from exact lengths are reproducible, those from noisy ones are as large as noise makes them.
    """
    hand, lib = readings["literal"]
    search, axis = BaseSearch(lib, hand, "thumb"), np.linspace(-reach, reach, 9)
    q = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    h = search.lengths(q) + noise * np.random.default_rng(6).uniform(-1, 1, (81, 4))

    for count, expected in zip((15, 30, 50), errors, strict=True):
        error = np.abs(search.gradient(h, np.zeros(2), count, 200.0).q - q).max()
        assert error < (1.1 if noise == 0 else 1.6) * expected + 1e-15
    assert np.abs(printed(search, h, 200.0, 50) - q).max() > 0.3
    assert np.abs(printed(search, h, 200.0, 50, keep_best=True) - q).max() > 0.15


def test_the_step_from_the_curvature_needs_no_tuning(readings):
    for hand, lib in readings.values():
        search, axis = BaseSearch(lib, hand, "thumb"), np.linspace(-0.8, 0.8, 9)
        q = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        h = search.lengths(q)

        assert np.abs(search.gradient(h, np.zeros(2), 50).q - q).max() < 1e-6
    wrong = search.gradient(h, np.zeros(2), 50, 2000.0).q  # a first step that is far too long is not always mended
    assert np.abs(wrong - q).max() > 1e-2


# -- what the estimate is worth --------------------------------------------------------------------------


@pytest.mark.parametrize("finger", ["thumb", *STRAIGHT])
def test_the_covariance_is_that_of_many_noisy_estimates(lib, finger):
    count, noise = 40000, 1e-5
    q = draw(lib, finger, 3)[2] * 0.8
    h = lib[f"{finger}_tendon_lengths"](q)
    measured = h + np.random.default_rng(9).normal(0, noise, (count, len(h)))
    estimates = lib[f"{finger}_joint_estimate"](measured, q)
    found = np.cov((estimates.q if hasattr(estimates, "q") else estimates).T)
    expected = lib[f"{finger}_joint_estimate_error"](q, noise).covariance
    variance = np.diag(expected)
    deviation = np.sqrt((np.outer(variance, variance) + expected**2) / count)

    assert (np.abs(found - expected) < 5 * deviation).all()


@pytest.mark.parametrize("finger", ["thumb", *STRAIGHT])
def test_the_worst_error_is_reached_and_not_exceeded(lib, finger):
    noise = 1e-6
    q = draw(lib, finger, 3)[2] * 0.8
    h, P = (lib[f"{finger}_{name}"](q) for name in ("tendon_lengths", "coupling"))
    worst = lib[f"{finger}_joint_estimate_error"](q, noise).worst

    def error(wrong):
        estimate = lib[f"{finger}_joint_estimate"](h + noise * wrong, q)
        return np.abs((estimate.q if hasattr(estimate, "q") else estimate) - q)

    reached = np.diag(error(np.sign(np.linalg.pinv(P))))
    np.testing.assert_allclose(reached, worst, rtol=1e-4)
    assert (error(np.random.default_rng(10).uniform(-1, 1, (20000, len(h)))) < worst * (1 + 1e-4)).all()


# -- what the motors, the springs and the wrist add -------------------------------------------------------


@pytest.mark.parametrize("finger", ["thumb", *STRAIGHT])
def test_motors_springs_and_wrist_are_taken_out_before_the_estimate(lib, hand, finger):
    """Motor angles of a tendon that is stretched and pulled by the wrist, and back to the joints (eq. 5.1)."""
    rows, joints = hand.blocks[finger]
    q = draw(lib, finger, 30)
    whole = np.zeros((30, 19))
    whole[:, joints] = q
    bent, neutral = hand.wrist.neutral + np.array([0.2, -0.15]), np.array(hand.wrist.neutral)
    w = (lib.wrist_tendon_lengths(*bent).h - lib.wrist_tendon_lengths(*neutral).h)[rows]
    x = lib.spring_elongation(np.linspace(5, 90, w.size)).x
    path = lib.hand_tendon_lengths(whole, bent).h - lib.hand_tendon_lengths(np.zeros(19), neutral).h
    theta = (x - path[:, rows]) / float(hand.motor.pulley)

    def estimate(h):
        found = lib[f"{finger}_joint_estimate"](h, q)
        return found.q if hasattr(found, "q") else found

    h = lib[f"{finger}_measured_lengths"](theta, x, w)
    np.testing.assert_allclose(h, lib[f"{finger}_tendon_lengths"](q), rtol=0, atol=1e-15)
    np.testing.assert_allclose(estimate(h), np.clip(q, *limits(lib, finger)), rtol=0, atol=1e-11)
    for forgotten in ((theta, 0 * x, w), (theta, x, 0 * w)):
        assert np.abs(estimate(lib[f"{finger}_measured_lengths"](*forgotten)) - q).max() > 0.01


def test_a_hand_file_without_motors_measures_nothing():
    cut = replaced(SHIPPED, r"(?s)# -+ motors\n.*", "", 1)
    names = [kernel.name for kernel in Job(Hand.parse(cut)).catalog]

    assert "thumb_joint_estimate" in names
    assert not [name for name in names if "measured" in name]


def test_kernels_of_one_piece_of_work_read_the_numbers_of_one_part():
    """Those of the whole hand and those of each finger's measured lengths have the same path, but other parts."""
    kernels = [kernel for kernel in Job(Hand.load()).kernels if not kernel.path and kernel.routes]
    pieces, _ = ordered([(kernel, {}, kernel.name) for kernel in kernels])

    assert len(kernels) > 5
    for members in pieces:
        assert len({tuple(kernel.part.quantities()) for kernel, _, _ in members}) == 1
