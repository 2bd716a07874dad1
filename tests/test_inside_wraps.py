"""Tendons through the inside of spheres and cylinders: where they bend, how short they are, and faults."""

from __future__ import annotations

import numpy as np
import pytest
from exported_mjcf import read_mjcf
from wrapped_hands import hand_with, place, text_of

from awiwi_gen.build import load
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out
from awiwi_gen.hand.pose import Chain
from awiwi_gen.interchange import export_mjcf
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.toml import hand_text
from awiwi_gen.pipeline import Job, cached_tree, verify

FILE = text_of("inside_finger")
RING = ', radius = "2 mm", inside = true'
START, END = place("palm", -20, 9, 1), place("root", 20, 9, -2)


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.parse(FILE)


@pytest.fixture(scope="module")
def job(hand) -> Job:
    """Tendon lengths, coupling with its derivative, and the torque of the string."""
    return Job(hand, only="claw_[rtc][eo][nut]*[esg]")


@pytest.fixture(scope="module")
def lib(job):
    return load(cached_tree(job), job.store)


@pytest.fixture(scope="module")
def q(hand) -> np.ndarray:
    return np.array(Chain(hand.fingers["claw"]).poses())


def test_both_derivations_agree_and_forces_have_the_power_of_their_torques(job):
    proof = verify(job, cached_tree(job))

    assert {"claw_tendon_lengths", "claw_coupling", "claw_return_torque"} <= {v.name for v in proof.verdicts}
    assert proof.passed


def test_poses_with_a_bend_and_poses_without_one_are_both_proved(hand, q):
    chain = Chain(hand.fingers["claw"])
    bends = [
        {line.body.bends(*chain.seen_by(line.body, pose, line)) for pose in q}
        for lines in chain.lines
        for line in lines
        if line.body and line.body.inside
    ]

    assert bends == [{True, False}, {True, False}, {True, False}, {True}]


def test_a_string_is_as_short_as_a_point_of_the_ring_permits(hand, lib, q):
    chain = Chain(hand.fingers["claw"])
    (sphere, _), (cylinder, _) = chain.lines[0], chain.lines[1]
    angles = np.linspace(0, 2 * np.pi, 20001)[:, None]
    for line in (sphere, cylinder):
        for pose in q[:8]:
            if not line.body.bends(*chain.seen_by(line.body, pose, line)):
                continue
            ends = chain.seen_by(line.body, pose, line)
            (one, low), (other, high) = (line.body.across(end) for end in ends)
            along = np.array(one) / np.linalg.norm(one)
            across = np.array(other) - along * (along @ other)
            across /= np.linalg.norm(across)
            ring = line.body.radius * (np.cos(angles) * along + np.sin(angles) * across)
            flat = np.linalg.norm(ring - one, axis=1) + np.linalg.norm(ring - other, axis=1)

            assert chain.distance(pose, line) == pytest.approx(np.hypot(flat.min(), high - low), rel=1e-7)


def test_lengths_are_those_of_the_checks(hand, lib, q):
    chain = Chain(hand.fingers["claw"])
    lengths = np.array([[chain.length(number, pose) for number in (0, 1, 3)] for pose in q])

    found = lib.claw_tendon_lengths(q)
    np.testing.assert_allclose(found.h, lengths, rtol=1e-12)
    assert not found.status.any()


def test_arms_are_the_slopes_of_lengths_and_their_derivatives_the_slopes_of_arms(lib, q):
    step = 1e-6
    for joint, arms in enumerate(np.moveaxis(lib.claw_coupling(q).P, -1, 0)):
        ahead, behind = (q + side * step * np.eye(2)[joint] for side in (1, -1))
        slopes = (lib.claw_tendon_lengths(ahead).h - lib.claw_tendon_lengths(behind).h) / (2 * step)
        np.testing.assert_allclose(arms, slopes, rtol=0, atol=1e-9)
        slopes = (lib.claw_coupling(ahead).P - lib.claw_coupling(behind).P) / (2 * step)
        np.testing.assert_allclose(lib.claw_coupling_derivative(q).dP[..., joint], slopes, rtol=0, atol=1e-8)


def test_lengths_and_arms_are_continuous_where_a_string_becomes_straight(lib):
    angles = np.linspace(-0.6, 1.0, 4001)
    sweep = np.stack([angles, np.full_like(angles, 0.3)], axis=1)
    h, arms = lib.claw_tendon_lengths(sweep).h, lib.claw_coupling(sweep).P[..., 0]
    step = 1.6 / 4000

    assert np.abs(np.diff(h, axis=0)).max() < 1.01 * step * np.abs(arms).max()
    assert np.abs(np.diff(arms, axis=0)).max() < 40 * step * 6e-3


def test_a_string_whose_end_is_inside_the_body_is_straight():
    paths = [
        START + place("palm", -10, 5, 0, RING) + END,
        place("palm", -10, 5, 1) + place("palm", -10, 5, 0, RING) + END,
    ]
    job = Job(hand_with(*paths, START + END, name="inside_finger"), only="claw_tendon_lengths")
    found = load(cached_tree(job), job.store).claw_tendon_lengths([0.1, 0.0])

    assert found.status == 0
    assert found.h[0] > found.h[2] + 1e-4
    assert found.h[1] == pytest.approx(np.linalg.norm([np.cos(0.1) * 20 - np.sin(0.1) * 9 + 10,
        np.sin(0.1) * 20 + np.cos(0.1) * 9 - 5, -3]) * 1e-3, rel=1e-14)  # fmt: skip


def test_an_end_that_comes_too_near_to_the_surface_has_a_status_and_one_inside_has_none():
    reach, angle = np.hypot(20, 9), np.arctan2(9, 20) + 2.1
    ring = place("palm", round(reach * np.cos(angle), 6), round(reach * np.sin(angle), 6), 0, RING)
    job = Job(
        hand_with(place("palm", -10, 25, 0) + ring + place("root", 20, 9, 0), name="inside_finger"),
        only="claw_tendon_lengths",
    )
    lib = load(cached_tree(job), job.store)
    from_ring = [2 * np.arcsin(distance / (2 * reach)) for distance in (10, 2.01, 1.99)]

    found = lib.claw_tendon_lengths([[2.1 - turned, 0.0] for turned in from_ring])
    np.testing.assert_array_equal(found.status, [0, 1, 0])


def test_no_kernel_is_left_out_for_a_ring(hand):
    assert left_out(hand) == {}


def test_tendons_through_and_round_a_body_have_different_derivations(hand):
    other = Hand.parse(FILE.replace('radius = "4 mm"', 'radius = "3.9 mm"'))
    round_ = Hand.parse(FILE.replace('radius = "2 mm", inside = true', 'radius = "0.5 mm"'))

    assert other.fingers["claw"].structure() == hand.fingers["claw"].structure()
    assert round_.fingers["claw"].structure() != hand.fingers["claw"].structure()


def test_a_path_through_rings_comes_back_from_an_export(hand):
    again = Hand.parse(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(hand)[0]))))
    pairs = zip(hand.fingers["claw"].tendons, again.fingers["claw"].tendons, strict=True)

    assert all(ours.structure() == theirs.structure() for ours, theirs in pairs)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (
            place("palm", -20, 9, 1, ", inside = true") + END,
            'path[0].inside is at a point; expected a radius such as "6.2 mm" beside it',
        ),
        (
            START + place("palm", 0, 0, 0, RING + ', side = ["0 mm", "8 mm", "0 mm"]') + END,
            "path[1].inside is beside a side; expected one of the two",
        ),
        (
            place("palm", -10, 7.01, 0) + place("palm", -10, 5, 0, RING) + END,
            "path[1] ends 0.01 mm from the surface at root = 10 deg, end = 10 deg, where the string bends; "
            "expected 1 % of the radius or more",
        ),
    ],
)
def test_a_fault_of_a_ring_is_told_with_its_place(path, message):
    with pytest.raises(InputError) as caught:
        hand_with(path, name="inside_finger")

    assert f"fingers.claw.tendons[0].{message}" in str(caught.value)
