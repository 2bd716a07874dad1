"""Joint angles of fingers with fewer tendons than joints, where springs give the missing equations."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from commands import told
from scipy.optimize import minimize

from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import estimate_lines, left_out_names
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, cached_tree, verify

FILE = Path(__file__).with_name("resting_fingers.toml")
TEXT = FILE.read_text(encoding="utf-8")
NAMES = "*joint_estimate*,*tendon_lengths,*coupling,ring_resting_balance"
SPRINGS = {"index": [(0, 1, 0.08, -15), (1, 1, 0.05, 0), (2, 1, 0.03, -5)], "thumb": [(2, 0.7, 0.04, -14)],
           "ring": [(0, 1, 0.08, -15), (1, 1, 0.05, 0), (2, 1, 0.03, -5)]}  # fmt: skip


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.load(FILE)


@pytest.fixture(scope="module")
def compiled(hand):
    return load(cached_tree(Job(hand, only=NAMES)))


def limits(hand: Hand, finger: str) -> np.ndarray:
    kernels = {kernel.name: kernel for kernel in catalog(hand)}
    return np.array(kernels[f"{finger}_coupling"].inputs["q"].bounds())


def lengths(compiled, finger: str, q: np.ndarray) -> np.ndarray:
    found = compiled[f"{finger}_tendon_lengths"](q)
    return np.asarray(getattr(found, "h", found))


def energy(finger: str, q: np.ndarray) -> float:
    """Of the springs as the hand file has them, and for the ring finger of its string, in the plane."""
    total = sum(k / 2 * (ratio * q[j] - np.radians(at)) ** 2 for j, ratio, k, at in SPRINGS[finger])
    if finger == "thumb":
        return total + 0.02 / 2 * q[0] ** 2
    if finger == "ring":
        turn = [np.exp(1j * angle) for angle in np.cumsum(q)]
        points = [-10 - 8j, turn[0] * (12 - 9j), turn[0] * 40 + turn[1] * (9 - 7j)]
        length = sum(abs(b - a) for a, b in itertools.pairwise(points)) / 1000
        total += 300 / 2 * max(0.0, length - 0.058) ** 2
    return total


def least_energy(compiled, finger: str, h: np.ndarray, start: np.ndarray, bounds) -> np.ndarray:
    """SciPy's minimum of the springs' energy among poses with these lengths."""
    return minimize(
        lambda q: 100 * energy(finger, q), start, method="SLSQP", bounds=bounds, options={"ftol": 1e-15, "maxiter": 300},
        constraints={"type": "eq", "fun": lambda q: 100 * (lengths(compiled, finger, q) - h)[::2]},  # one of antagonists
    ).x  # fmt: skip


@pytest.mark.parametrize("finger", ["index", "thumb"])
def test_linear_springs_hold_the_least_energy_that_lengths_allow(hand, compiled, finger):
    low, high = limits(hand, finger).T
    for share in np.random.default_rng(2).uniform(0.2, 0.8, (5, len(low))):
        q = low + share * (high - low)
        h = lengths(compiled, finger, q)
        found = compiled[f"{finger}_joint_estimate"](h, q)

        assert lengths(compiled, finger, found) == pytest.approx(h, abs=1e-15)
        assert found == pytest.approx(least_energy(compiled, finger, h, q, None), abs=2e-6)
        assert not np.allclose(found, q, atol=0.02)


def test_errors_are_those_by_which_the_estimate_moves_with_the_lengths(compiled):
    q, h, step = np.array([0.3, 0.4, 0.2]), np.array([0.004, 0.005, -0.006]), 1e-6
    slopes = np.array([
        (compiled.thumb_joint_estimate(h + each, q) - compiled.thumb_joint_estimate(h - each, q)) / (2 * step)
        for each in step * np.eye(3)
    ]).T  # fmt: skip
    covariance, worst = compiled.thumb_joint_estimate_error(q, 2e-4)

    assert covariance == pytest.approx(4e-8 * slopes @ slopes.T, rel=1e-6, abs=1e-12)
    assert worst == pytest.approx(2e-4 * np.abs(slopes).sum(axis=1), rel=1e-6)


def test_errors_of_a_bent_finger_are_those_by_which_it_moves_at_rest(hand, compiled):
    low, high = limits(hand, "ring").T
    q = compiled.ring_joint_estimate(lengths(compiled, "ring", low + 0.5 * (high - low)), low).q
    h, step = lengths(compiled, "ring", q), 1e-6
    ahead, back = (compiled.ring_joint_estimate(h + each, q).q for each in (step, -step))
    slopes = (ahead - back) / (2 * step)
    found = compiled.ring_joint_estimate_error(q, 2e-4)

    assert np.all((q > low) & (q < high))
    assert np.all(np.abs(slopes) > 1)
    assert found.covariance == pytest.approx(4e-8 * np.outer(slopes, slopes), rel=1e-5)
    assert found.worst == pytest.approx(2e-4 * np.abs(slopes), rel=1e-5)


def test_a_string_a_body_and_stops_are_in_the_energy(hand, compiled):
    bounds = limits(hand, "ring")
    low, high = bounds.T
    at_stops = 0
    for share in np.random.default_rng(4).uniform(0.0, 1.0, (12, 3)):
        q = low + share * (high - low)
        h = lengths(compiled, "ring", q)
        found = compiled.ring_joint_estimate(h, q)

        assert found.status == 0
        assert lengths(compiled, "ring", found.q) == pytest.approx(h, abs=1e-13)
        assert np.all((found.q >= low) & (found.q <= high))
        assert found.q == pytest.approx(least_energy(compiled, "ring", h, found.q, bounds), abs=2e-5)
        at_stops += bool(np.any((found.q == low) | (found.q == high)))

    assert 0 < at_stops < 12


def test_torques_balance_where_it_rests_and_stops_only_push(hand, compiled):
    low, high = limits(hand, "ring").T
    for q in low + np.random.default_rng(5).uniform(0.1, 0.9, (12, 3)) * (high - low):
        found = compiled.ring_joint_estimate(lengths(compiled, "ring", q), q).q
        P = compiled.ring_coupling(found).P[0]
        at_rest = compiled.ring_resting_balance(found, [0.0]).balance
        free = (found > low) & (found < high)
        force = -(P[free] @ at_rest[free]) / (P[free] @ P[free])
        left = compiled.ring_resting_balance(found, [force]).balance

        assert np.abs(left[free]).max() < 1e-12
        assert np.all(np.where(found == low, left, -left)[~free] >= 0)


@pytest.mark.parametrize(("offset", "end"), [(0.05, 0), (-0.05, 1)])
def test_lengths_that_no_pose_has_end_at_stops(hand, compiled, offset, end):
    bounds = limits(hand, "ring").T
    h = lengths(compiled, "ring", bounds[end]) + offset
    found = compiled.ring_joint_estimate(h, bounds.mean(axis=0))

    assert found.status == 0
    assert found.q == pytest.approx(bounds[end], abs=1e-12)


def test_what_is_not_finite_is_told(hand, compiled):
    middle = limits(hand, "ring").mean(axis=1)
    found = compiled.ring_joint_estimate([np.nan], middle)

    assert (found.status, list(found.q)) == (3, list(middle))


@pytest.mark.parametrize(
    "options", [Options(), Options(params="runtime"), Options(scalar="f32")], ids=["double", "runtime", "f32"]
)
def test_estimates_by_springs_are_proved_in_all_forms(hand, options):
    job = Job(hand, options, only="*joint_estimate*,ring_resting_balance")
    proof = verify(job, cached_tree(job))

    assert {"index_joint_estimate", "ring_joint_estimate", "ring_joint_estimate_error"} <= {
        v.name for v in proof.verdicts
    }
    assert [verdict.name for verdict in proof.verdicts if not verdict.passed] == []


FAULTS = {
    "no spring at all": ('spring = { stiffness = "0.04 N m/rad", reference = "-10 deg" }\n', "", "thumb",
                         "nor do springs: in some pose they do not hold mcp, ip"),
    "two tendons alike": ('arms = { mcp = "-9 mm", pip = "-7 mm", dip = "-5.5 mm" }, source = "assumed" }]',
                          'arms = { mcp = "-9 mm", pip = "-7 mm", dip = "-5.5 mm" }, source = "assumed" }, { rest = "0 mm", '
                          'arms = { mcp = "-18 mm", pip = "-14 mm", dip = "-11 mm" }, source = "assumed" }]', "index",
                          "springs do not either where tendons that move mcp, pip, dip depend on one another"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "finger", "reason"), FAULTS.values(), ids=FAULTS)
def test_what_springs_cannot_tell_is_left_out_with_the_reason(old, new, finger, reason):
    assert TEXT.count(old) == 1
    hand = Hand.parse(TEXT.replace(old, new))

    assert reason in left_out_names(hand)[f"{finger}_joint_estimate"]
    assert not [line for line in estimate_lines(hand) if finger in line]


def test_antagonists_over_the_same_pulleys_count_as_one_and_are_averaged():
    one = 'tendons = [{ rest = "12 mm", arms = { mcp = "-9 mm", pip = "-7 mm", dip = "-5.5 mm" }, source = "assumed" }]'
    radii = {"mcp": "9 mm", "pip": "7 mm", "dip": "5.5 mm"}
    pulleys = ", ".join(f'{{ joint = "{joint}", radius = "{r}", source = "assumed" }}' for joint, r in radii.items())
    senses = (("12 mm", ["-mcp", "-pip", "-dip"]), ("10 mm", ["+mcp", "+pip", "+dip"]))
    pair = ", ".join(f'{{ rest = "{rest}", over = {over}, source = "assumed" }}' for rest, over in senses)
    assert TEXT.count(one) == 1
    job = Job(Hand.parse(TEXT.replace(one, f"pulleys = [{pulleys}]\ntendons = [{pair}]")), only="index_joint_estimate*")
    tree = cached_tree(job)
    found, q, h = load(tree), np.array([0.1, 0.5, 0.4]), np.array([0.005, 0.017])
    slopes = [(found.index_joint_estimate(h + each, q) - found.index_joint_estimate(h, q)) / 1e-4
              for each in 1e-4 * np.eye(2)]  # fmt: skip

    assert [verdict.name for verdict in verify(job, tree).verdicts if not verdict.passed] == []
    assert slopes[0] == pytest.approx(-slopes[1])
    assert found.index_joint_estimate_error(q, 1e-3).worst == pytest.approx(2e-3 * np.abs(slopes[0]))


def test_a_string_that_is_slack_in_some_pose_is_no_spring():
    without = "\n".join(line for line in TEXT.split("\n") if not line.startswith("spring ="))
    slack = left_out_names(Hand.parse(without))

    assert "in some pose they do not hold mcp, pip, dip" in slack["ring_joint_estimate"]
    assert "ring_resting_balance" in slack
    assert "springs" not in slack["index_joint_estimate"]  # which has none


def test_check_and_list_say_what_an_estimate_uses():
    line = "estimate: thumb_joint_estimate: by tendon lengths and springs of mcp, ip\n"

    assert line in told("check", "--hand", FILE, code=1)
    assert line in told("list", "--hand", FILE)
    assert '"springs": [\n    "mcp",' in told("check", "--hand", FILE, "--json", code=1)
