"""Tendons that wrap round spheres and cylinders: lengths, arms, where they lift off, and what no tendon can have."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from wrapped_hands import hand_with, place, text_of

from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out
from awiwi_gen.hand.pose import Chain
from awiwi_gen.pipeline import Job, cached_tree, verify

FILE = text_of("wrapped_finger")
SPHERE = ', radius = "6 mm"'
CYLINDER = SPHERE + ', axis = ["0", "0", "1"]'
ABOVE = ', side = ["0 mm", "8 mm", "0 mm"]'
START, END = place("palm", -20, 3, 0), place("root", 20, 3, 0)


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.parse(FILE)


@pytest.fixture(scope="module")
def job(hand) -> Job:
    """Tendon lengths, coupling with its derivative, and the torque of the string."""
    return Job(hand, only="[ch]?*_[rtc][eo][nut]*[esg]")


@pytest.fixture(scope="module")
def lib(job):
    return load(cached_tree(job), job.store)


@pytest.fixture(scope="module")
def q(hand) -> np.ndarray:
    return np.array(Chain(hand.fingers["claw"]).poses())


@pytest.fixture(scope="module")
def knuckle():
    """Strings over a cylinder and a sphere about the first joint, in the plane of its rotation."""
    job = Job(
        hand_with(*(START + place("palm", 0, 0, 0, body + ABOVE) + END for body in (CYLINDER, SPHERE)), START + END),
        only="claw_[tc][eo][nu][dp]*",
    )
    return load(cached_tree(job), job.store)


def sweep(angles) -> np.ndarray:
    return np.stack([angles, np.zeros_like(angles)], axis=1)


def test_both_derivations_agree_and_forces_have_the_power_of_their_torques(job):
    proof = verify(job, cached_tree(job))

    assert {"claw_tendon_lengths", "claw_coupling", "claw_return_torque", "hand_coupling"} <= {
        v.name for v in proof.verdicts
    }
    assert proof.passed


def test_a_string_that_touches_a_body_about_the_joint_has_the_radius_as_its_arm(knuckle):
    bent = sweep(np.linspace(-0.6, -0.4, 9))

    arms = knuckle.claw_coupling(bent).P * 1e3
    np.testing.assert_allclose(arms[:, :2, 0], -6, rtol=1e-12)
    np.testing.assert_allclose(arms[:, :2, 1], 0, atol=1e-12)


def test_a_string_that_touches_is_two_tangents_and_an_arc(knuckle):
    angle = -0.5
    tangent = np.sqrt(20**2 + 3**2 - 6**2)
    arc = 6 * (np.pi - angle - 2 * np.arctan2(3, 20) - 2 * np.arctan2(tangent, 6))

    h = knuckle.claw_tendon_lengths([angle, 0.0]).h * 1e3
    np.testing.assert_allclose(h[:2], 2 * tangent + arc, rtol=1e-14)


def test_a_string_that_lifts_off_is_straight(knuckle):
    h = knuckle.claw_tendon_lengths(sweep(np.linspace(0.4, 1.0, 9))).h

    np.testing.assert_allclose(h[:, 0], h[:, 2], rtol=1e-15)
    np.testing.assert_allclose(h[:, 1], h[:, 2], rtol=1e-15)


def test_lengths_and_arms_are_continuous_where_a_string_lifts_off(knuckle):
    angles = sweep(np.linspace(-0.6, 1.0, 4001))
    h, arms = knuckle.claw_tendon_lengths(angles).h, knuckle.claw_coupling(angles).P[..., 0]
    step = 1.6 / 4000

    assert (h[:, 0] > h[:, 2] + 1e-6).any()
    assert (h[:, 0] == h[:, 2]).any()
    assert np.abs(np.diff(h[:, 0])).max() < 1.01 * step * np.abs(arms).max()
    assert np.abs(np.diff(arms[:, 0])).max() < 20 * step * 6e-3


def test_no_pose_has_a_string_inside_the_body(hand, q):
    chain = Chain(hand.fingers["claw"])
    for lines in chain.lines:
        for line in (each for each in lines if each.body):
            for pose in q:
                ends = chain.seen_by(line.body, pose, line)
                straight = np.linspace(*ends, 200)
                nearest = min(line.body.distance(tuple(each)) for each in straight)
                longer = line.body.length(*ends) > np.linalg.norm(np.subtract(*ends)) + 1e-9
                assert longer or nearest > line.body.radius - 1e-5


def test_the_arms_of_the_checks_are_those_of_the_kernel(hand, lib, q):
    chain = Chain(hand.fingers["claw"])

    np.testing.assert_allclose([chain.coupling(each)[:3] for each in q], lib.claw_coupling(q).P, rtol=0, atol=1e-9)


def test_arms_are_the_slopes_of_lengths(lib, q):
    step = 1e-6
    for joint, arms in enumerate(np.moveaxis(lib.claw_coupling(q).P, -1, 0)):
        ahead, behind = (lib.claw_tendon_lengths(q + side * step * np.eye(2)[joint]).h for side in (1, -1))
        np.testing.assert_allclose(arms, (ahead - behind) / (2 * step), rtol=0, atol=1e-9)


def test_a_string_round_a_cylinder_pulls_by_its_stretch(lib, q):
    found = lib.claw_return_torque(q)
    chain = Chain(Hand.parse(FILE).fingers["claw"])
    stretch = np.array([max(0.0, chain.length(3, each) - 25e-3) for each in q])

    np.testing.assert_allclose(found.energy, 150 * stretch**2, rtol=1e-9)


def test_a_string_on_the_other_side_of_its_body_has_a_status(knuckle):
    aside = sweep(np.array([-0.2, 3.0]))

    np.testing.assert_array_equal(knuckle.claw_tendon_lengths(aside).status, [0, 1])


def test_a_point_inside_the_body_has_a_status_and_no_length():
    near = place("root", 6.6, 2, 0)
    job = Job(hand_with(START + place("palm", -2, 0, 0, CYLINDER + ABOVE) + near), only="claw_tendon_lengths")
    found = load(cached_tree(job), job.store).claw_tendon_lengths(sweep(np.array([0.0, np.pi])))

    np.testing.assert_array_equal(found.status, [0, 1])
    np.testing.assert_array_equal(np.isnan(found.h[:, 0]), [False, True])


def test_without_a_side_the_shorter_way_is_taken_and_no_other():
    bodies = [place("palm", 0, -8, 0, CYLINDER + side) for side in ("", ABOVE)]
    job = Job(hand_with(*(START + body + END for body in bodies)), only="claw_tendon_lengths")
    found = load(cached_tree(job), job.store).claw_tendon_lengths(sweep(np.linspace(-0.6, 1.0, 33)))

    np.testing.assert_allclose(found.h[:, 0], found.h[:, 1], rtol=1e-14)
    assert not found.status.any()
    with pytest.raises(InputError, match=r"path\[1\] is passed on the other side at root"):
        hand_with(START + place("palm", 0, 0, 0, CYLINDER) + END)


def test_forces_are_distributed_over_strings_round_bodies_where_these_have_a_status_of_zero():
    sides = [START + place("palm", 0, 0, 0, CYLINDER + ABOVE) + END]
    sides += [place("palm", -20, -9, z) + place("root", 20, -9, z) for z in (-4, 4)]
    sides += [place("palm", -20, 0, z) + place("end", 9, y, z) for y, z in ((8, 2), (-8, -2))]
    job = Job(hand_with(*sides), only="claw_tendon_distribution")
    lib = load(cached_tree(job), job.store)
    outside = lib.claw_tendon_distribution([3.0, 0.0], [0.01, 0.0], np.zeros((2, 2)), 1.0, 90.0)
    inside = lib.claw_tendon_distribution([-0.3, 0.2], [0.01, 0.02], np.zeros((2, 2)), 1.0, 90.0)

    assert (outside.status, inside.status) == (1, 0)
    np.testing.assert_array_equal(outside.f, 1)
    torque = -lib.claw_coupling([-0.3, 0.2]).P.T @ inside.f
    np.testing.assert_allclose(torque, [0.01, 0.02], rtol=1e-9)


def test_a_torque_that_takes_a_tendon_to_its_limit_is_within_reach_in_single_precision():
    job = Job(Hand.parse(FILE), Options("f32"), "claw_tendon_distribution")
    lib = load(cached_tree(job), job.store)
    q, tau = [0.6961405, 0.06115133], [1.8636609, -0.44994697]
    found = lib.claw_tendon_distribution(q, tau, [[10.441851, -4.1569753], [-4.1569753, 2.2416348]], 3.72247, 95.23174)

    assert found.status == 0
    np.testing.assert_allclose(found.f, [88.69803, 12.83388, 95.23174], atol=2e-4)


def test_joint_angles_are_found_from_the_lengths_of_strings_round_bodies():
    job = Job(Hand.parse(FILE), only="claw_joint_estimate")
    lib = load(cached_tree(job), job.store)
    pose = [0.5, -0.2]
    found = lib.claw_joint_estimate(lib.claw_tendon_lengths(pose).h, [0.3, 0.1])

    assert found.status == 0
    np.testing.assert_allclose(found.q, pose, atol=1e-12)


def test_no_kernel_is_left_out_for_wraps(hand):
    assert left_out(hand) == {}


def test_tendons_that_differ_in_numbers_alone_share_their_derivations(hand):
    other = Hand.parse(FILE.replace('radius = "7 mm"', 'radius = "6.9 mm"'))
    ball = Hand.parse(FILE.replace(', axis = ["0", "1", "0"]', ""))

    assert other.fingers["claw"].structure() == hand.fingers["claw"].structure()
    assert ball.fingers["claw"].structure() != hand.fingers["claw"].structure()


def test_a_path_is_cut_into_runs_at_its_points(hand):
    runs = hand.fingers["claw"].tendons[0].runs

    assert [(run.first, run.between, run.last) for run in runs] == [(0, 1, 2), (2, 3, 4)]
    assert all(one.end == other.start for one, other in pairwise(runs))


def test_branches_behind_pulleys_count_divided(lib, hand, q):
    chain = Chain(hand.fingers["claw"])
    first, half, *third = ([chain.distance(each, line) for each in q] for line in chain.lines[2])
    total = np.array(first) + np.array(half) / 2 + np.array(third).sum(axis=0) / 3

    np.testing.assert_allclose(lib.claw_tendon_lengths(q).h[:, 2], total, rtol=1e-12)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (
            START + place("root", 20, 3, 0, SPHERE),
            "path[1] is a sphere at the end of the path; expected a point before it",
        ),
        (
            START + place("palm", 0, 0, 0, CYLINDER) + place("root", 9, 0, 0, SPHERE) + END,
            "path[1] is a cylinder with another body after it; expected a point between the two",
        ),
        (
            START + END + place("palm", 9, 0, 0, ', divisor = "2"'),
            "path[2] is a branch of one point; expected two or more",
        ),
        (
            START + place("palm", 0, 0, 0, SPHERE) + place("palm", 9, 0, 0, ', divisor = "2"') + END,
            "path[1] is a sphere at the end of the path",
        ),
        (
            START + place("palm", 0, 0, 0, SPHERE + ', divisor = "2"') + END,
            "path[1].divisor is at a sphere; expected it at the point where the branch begins",
        ),
        (
            START + place("root", 9, 0, 0, ', axis = ["0", "0", "1"]') + END,
            'path[1].axis is at a point; expected a radius such as "6.2 mm" beside it',
        ),
        (
            START + place("palm", 0, 0, 0, SPHERE + ', axis = ["0", "0", "0"]') + END,
            'path[1].axis has no direction; expected such as ["0", "0", "1"]',
        ),
        (
            START + place("palm", 0, 0, 0, SPHERE + ', side = ["0 mm", "5 mm", "0 mm"]') + END,
            "path[1].side is 5 mm from the centre of a sphere of radius 6 mm, so the tendon would wrap round its inside",
        ),
        (
            START + place("palm", 0, 0, 0, CYLINDER + ', side = ["0 mm", "0 mm", "9 mm"]') + END,
            "path[1].side is on the cylinder's axis; expected a point on one side of it",
        ),
        (
            place("palm", -5, 3, 0) + place("palm", 0, 0, 0, CYLINDER) + END,
            "path[0] lies 0.17 mm inside the cylinder path[1] at root = ",
        ),
        (
            START + place("palm", 0, 0, 0, CYLINDER + ABOVE) + place("end", -37, 3, 0),
            "path[2] lies 3.1 mm inside the cylinder path[1] at root = ",
        ),
    ],
)
def test_a_fault_of_a_wrap_is_told_with_its_place(path, message):
    with pytest.raises(InputError) as caught:
        hand_with(path)

    assert f"fingers.claw.tendons[0].{message}" in str(caught.value)


def test_a_tendon_that_would_jump_over_its_body_is_refused():
    jumping = place("palm", -20, 3, 0) + place("palm", 0, 0, 0, CYLINDER + ', side = ["-9 mm", "0 mm", "0 mm"]') + END
    with pytest.raises(InputError, match=r"path\[1\] is passed on the other side at root = .*: expected one side"):
        hand_with(jumping)
