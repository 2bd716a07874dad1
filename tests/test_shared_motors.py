"""Motors that pull several tendons: differentials, and drums that pull both ways."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from exported_mjcf import read_mjcf

from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out_names, of_motors
from awiwi_gen.hand.pose import Chain
from awiwi_gen.interchange import export_mjcf
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.toml import hand_text
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, cached_tree, verify

TEXT = Path(__file__).with_name("motor_fingers.toml").read_text(encoding="utf-8")
FLEXORS = '{ name = "flexor", ratio = "0.5" }'
STATES = 40


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.parse(TEXT)


@pytest.fixture(scope="module")
def lib(hand):
    return load(cached_tree(Job(hand, only="*tendon*,*coupling*,*joint_*,*measured*")))


@pytest.fixture(scope="module")
def strings():
    """The same hand with a motor for every string."""
    alone = TEXT
    for name, ratios in {"flexor": ["0.5"], "turner": ["0.5", "-0.5"], "grip": ["0.4", "0.6"]}.items():
        for ratio in ratios:
            alone = alone.replace(f', motor = {{ name = "{name}", ratio = "{ratio}" }}', "")
    return load(cached_tree(Job(Hand.parse(alone), only="*tendon_lengths,*_coupling,*joint_*")))


INDEX = np.array([[0.5, 0, 0.5, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
THUMB = np.array([[0.5, -0.5, 0, 0], [0, 0, 0.4, 0.6]])


def poses(hand, finger: str) -> np.ndarray:
    port = next(kernel for kernel in catalog(hand) if kernel.name == f"{finger}_coupling").inputs["q"]
    low, high = np.array(port.bounds()).T
    return np.random.default_rng(2).uniform(low, high, (STATES, len(low)))


@pytest.mark.parametrize(("finger", "shares"), [("index", INDEX), ("thumb", THUMB)])
def test_lengths_arms_and_torques_are_those_of_the_strings(hand, lib, strings, finger, shares):
    for q in poses(hand, finger):
        f = np.random.default_rng(3).uniform(0, 50, len(shares))
        k = np.random.default_rng(4).uniform(2e3, 9e3, len(shares))
        P = strings[f"{finger}_coupling"](q)

        assert lib[f"{finger}_tendon_lengths"](q) == pytest.approx(shares @ strings[f"{finger}_tendon_lengths"](q))
        assert lib[f"{finger}_coupling"](q) == pytest.approx(shares @ P, abs=1e-16)
        assert lib[f"{finger}_joint_torque"](q, f) == pytest.approx(
            strings[f"{finger}_joint_torque"](q, shares.T @ f), abs=1e-14
        )
        geometric = strings[f"{finger}_joint_stiffness"](q, shares.T @ f, np.zeros(shares.shape[1]))
        elastic = (shares @ P).T @ np.diag(k) @ shares @ P
        assert lib[f"{finger}_joint_stiffness"](q, f, k) == pytest.approx(elastic + geometric, rel=1e-12)


def test_pretension_of_a_drum_that_pulls_both_ways_turns_no_joint(hand, strings):
    for q in poses(hand, "thumb"):
        assert strings.thumb_joint_torque(q, [30.0, 30.0, 0.0, 0.0]) == pytest.approx(0, abs=1e-15)


def test_arrays_of_the_hand_have_one_element_for_each_motor(hand, lib):
    assert hand.tendons == 5
    assert hand.blocks == {"index": (slice(0, 3), slice(0, 2)), "thumb": (slice(3, 5), slice(2, 4))}
    q = np.array([0.3, 0.4, -0.2, 0.7])
    P = lib.hand_coupling(q)

    assert P[:3, :2] == pytest.approx(lib.index_coupling(q[:2]))
    assert P[3:, 2:] == pytest.approx(lib.thumb_coupling(q[2:]))
    assert not P[:3, 2:].any()
    assert not P[3:, :2].any()


def test_lengths_of_the_motors_tell_the_joints(hand, lib):
    for finger in ("index", "thumb"):
        for q in poses(hand, finger)[:10]:
            found = lib[f"{finger}_joint_estimate"](lib[f"{finger}_tendon_lengths"](q), q + 0.05)
            assert getattr(found, "q", found) == pytest.approx(q, abs=1e-9)


def test_a_torque_is_shared_among_motors_that_only_pull(lib):
    q, tau = np.array([0.3, 0.5]), np.array([-0.1, 0.05])
    f, status = lib.index_tendon_distribution(q, tau, np.diag([2.0, 1.0]), 2.0, 90.0)

    assert status == 0
    assert lib.index_joint_torque(q, f) == pytest.approx(tau, abs=1e-12)
    assert f.min() >= 2.0 - 1e-12


def test_forces_of_both_signs_belong_to_motors_that_pull_both_ways(hand):
    kernels = {kernel.name: kernel for kernel in catalog(hand)}

    assert kernels["index_joint_torque"].inputs["f"].bounds() == [(0, 100)] * 3
    assert kernels["thumb_joint_torque"].inputs["f"].bounds() == [(-100, 100), (0, 100)]
    assert kernels["hand_joint_torque"].inputs["f"].bounds()[2:] == [(0, 100), (-100, 100), (0, 100)]
    assert kernels["motor_torque"].inputs["f"].bounds() == [(-100, 100)]
    assert [low for low, _ in kernels["thumb_measured_lengths"].inputs["x"].bounds()] == [-0.1, 0]
    low, high = np.array(kernels["thumb_tendon_lengths"].inputs["q"].bounds()).T
    assert all(a < b for a, b in kernels["thumb_joint_estimate"].inputs["h"].bounds())
    assert low.tolist() < high.tolist()


def test_measured_lengths_are_in_the_range_of_the_estimate(hand, lib):
    kernels = {kernel.name: kernel for kernel in catalog(hand)}
    for finger in ("index", "thumb"):
        low, high = np.array(kernels[f"{finger}_joint_estimate"].inputs["h"].bounds()).T
        for q in poses(hand, finger):
            h = lib[f"{finger}_tendon_lengths"](q)
            assert (low <= h).all()
            assert (h <= high).all()


def test_stiffness_over_force_does_not_exist_for_motors_that_pull_both_ways(hand):
    reasons = left_out_names(hand)

    assert set(reasons) == {"thumb_tendon_distribution", "thumb_tendon_stiffness"}
    assert all("pulls both ways" in reason for reason in reasons.values())


def test_one_motor_for_two_joints_leaves_out_what_needs_more():
    less = TEXT.replace('    { rest = "0 mm", over = ["+pip"], source = "assumed" },\n', "")
    reason = left_out_names(Hand.parse(less))

    assert "index_joint_estimate" not in reason
    assert "none pulls towards" in reason["index_tendon_distribution"]
    least = less.replace('    { rest = "40 mm", over = ["+mcp"], source = "assumed" },\n', "")
    assert "move only 1 of the 2 joints" in left_out_names(Hand.parse(least))["index_joint_estimate"]


def test_an_exported_motor_is_one_tendon_and_comes_back_with_its_arms(hand):
    text, losses = export_mjcf.text_and_losses(hand)
    again = Hand.parse(hand_text(draft(read_mjcf(text))))
    root = ElementTree.fromstring(text)  # noqa: S314 our own
    ranges = {each.get("tendon"): each.get("ctrlrange") for each in root.findall("actuator/*")}

    assert ranges["index.flexor"] == "0 100"
    assert ranges["thumb.turner"] == "-100 100"
    assert [each.get("divisor") for each in root.iter("pulley")] == ["2.5"]
    assert [loss.places for loss in losses if "arcs and lines" in loss.what] == [("thumb.grip",)]
    for finger, rows in (("index", [0, 1, 2]), ("thumb", [0])):  # arcs and lines of a motor are two tendons there
        ours, theirs = (next(of_motors(each.fingers[finger], [coupling(each, finger)])) for each in (hand, again))
        assert np.array(theirs)[rows] == pytest.approx(np.array(ours)[rows], abs=1e-15)
    assert [each.two_way for each in again.fingers["thumb"].transmissions] == [True, False, False]
    twice = Hand.parse(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(again)[0]))))
    assert [t.motor.name for t in twice.fingers["thumb"].pulled if t.motor] == ["thumb_turner"] * 2
    assert twice.fingers["thumb"].structure() == again.fingers["thumb"].structure()


def coupling(hand: Hand, finger: str) -> list[list[float]]:
    return Chain(hand.fingers[finger]).coupling([0.2, 0.3])


@pytest.mark.parametrize("motors", export_mjcf.MOTORS)
def test_forces_of_motors_that_pull_both_ways_have_both_signs_in_every_export(hand, motors):
    root = ElementTree.fromstring(export_mjcf.text_and_losses(hand, motors)[0])  # noqa: S314 our own
    actuators = {each.get("name"): each.get("ctrlrange") or each.get("forcerange") for each in root.find("actuator")}
    low, high = map(float, actuators["thumb.turner.motor"].split())

    assert low == -high < 0
    assert "0" in actuators["index.flexor.motor"].split()


@pytest.mark.parametrize("options", [Options(params="runtime"), Options(scalar="f32")], ids=["runtime", "f32"])
def test_kernels_of_shared_motors_are_proved_in_all_forms(hand, options):
    job = Job(hand, options, only="index_tendon*,index_joint*,thumb_tendon_lengths,thumb_coupling,thumb_joint_estimate")

    assert [verdict.name for verdict in verify(job, cached_tree(job)).verdicts if not verdict.passed] == []


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            FLEXORS,
            '{ name = "flexor", ratio = "0" }',
            'index.tendons[0].motor.ratio = "0" moves nothing; expected another number, such as "0.5"',
        ),
        (
            FLEXORS,
            '{ name = "flexor" }',
            "index.tendons[0].motor.ratio is missing",
        ),
        (
            "-0.5",
            "0.5",
            "thumb.tendons[0].motor pulls nothing: its tendons cancel one another in every pose",
        ),
        (
            "-0.5",
            "-0.6",
            "thumb.tendons[0].motor has ratios of both signs, so it winds some tendons up by as much as it lets the others "
            "go, but the sum of |ratio| times length changes by -0.8 mm per radian of base; expected none",
        ),
        (
            'over = ["+pip"]',
            'over = ["+pip"], motor = { name = "m", ratio = "-1" }',
            "index.tendons[3].motor has no tendon with a ratio above zero",
        ),
        (
            'over = ["+pip"]',
            'over = ["+pip"], spring = { stiffness = "9 N/m", rest = "-20 mm" }, motor = { name = "m", ratio = "1" }',
            "index.tendons[3].motor is at an elastic return string, which no motor pulls; expected motor or spring",
        ),
    ],
)
def test_motors_that_no_hand_has_are_refused(old, new, message):
    with pytest.raises(InputError) as caught:
        Hand.parse(TEXT.replace(old, new, 1))

    assert message in str(caught.value)


def test_the_digest_of_a_hand_without_shared_motors_has_no_trace_of_them(hand):
    finger = hand.fingers["index"]
    alone = {each.model_dump_json() for each in finger.tendons if each.motor is None}

    assert len(alone) == 2
    assert not any("motor" in text for text in alone)
    assert hand.digest() != Hand.parse(TEXT.replace('ratio = "0.4"', 'ratio = "0.41"')).digest()
