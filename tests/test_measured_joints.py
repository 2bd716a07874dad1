"""Joint angles where sensors give those that tendon lengths do not tell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out_names
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, cached_tree, verify

FEW = Path(__file__).with_name("motor_fingers.toml").read_text(encoding="utf-8")
for line in ('over = ["+mcp"]', 'over = ["+pip"]', 'name = "turner", ratio = "0.5"', 'name = "turner", ratio = "-0.5"'):
    FEW = "\n".join(each for each in FEW.split("\n") if line not in each)
SENSORS = FEW.replace('joint = "pip"\nturn', 'joint = "pip"\nsensor = {}\nturn').replace(
    'joint = "base"\nturn', 'joint = "base"\nsensor = { resolution = "0.1 deg" }\nturn'
)
NAMES = "*joint_estimate*,*tendon_lengths,*coupling"
MEASURED = {"index": 1, "thumb": 0}  # the only motor of the index has constant arms, that of the thumb has not


@pytest.fixture(scope="module")
def sensed() -> Hand:
    return Hand.parse(SENSORS)


@pytest.fixture(scope="module")
def compiled(sensed):
    return load(cached_tree(Job(sensed, only=NAMES)))


def poses(hand: Hand, finger: str) -> np.ndarray:
    low, high = np.array(kernels(hand)[f"{finger}_coupling"].inputs["q"].bounds()).T
    return np.random.default_rng(5).uniform(low, high, (30, len(low)))


def kernels(hand: Hand) -> dict:
    return {kernel.name: kernel for kernel in catalog(hand)}


def test_a_motor_for_two_joints_has_an_estimate_only_with_a_sensor(sensed):
    without = left_out_names(Hand.parse(FEW))

    for finger in MEASURED:
        assert "move only 1 of the 2 joints" in without[f"{finger}_joint_estimate"]
        assert f"{finger}_joint_estimate" not in left_out_names(sensed)
        assert f"{finger}_tendon_distribution" in left_out_names(sensed)
        assert list(kernels(sensed)[f"{finger}_joint_estimate"].inputs) == ["h", "start", "measured"]


@pytest.mark.parametrize(("finger", "index"), MEASURED.items())
def test_lengths_and_a_sensor_tell_both_angles(sensed, compiled, finger, index):
    port = kernels(sensed)[f"{finger}_joint_estimate"].inputs["measured"]
    assert port.bounds() == [kernels(sensed)[f"{finger}_coupling"].inputs["q"].bounds()[index]]
    for q in poses(sensed, finger):
        start = q + 0.1
        start[index] = 99.0  # is not read
        found = compiled[f"{finger}_joint_estimate"](compiled[f"{finger}_tendon_lengths"](q), start, [q[index]])

        assert getattr(found, "q", found) == pytest.approx(q, abs=1e-9)


@pytest.mark.parametrize(("finger", "index"), MEASURED.items())
def test_another_reading_of_the_sensor_moves_the_other_angle_by_the_ratio_of_the_arms(sensed, compiled, finger, index):
    q, step, other = poses(sensed, finger)[3] * 0.5 + 0.1, 1e-5, 1 - index
    h, P = compiled[f"{finger}_tendon_lengths"](q), compiled[f"{finger}_coupling"](q)[0]
    found = [compiled[f"{finger}_joint_estimate"](h, q, [q[index] + each]) for each in (-step, step)]
    before, after = (getattr(each, "q", each) for each in found)

    assert (after - before)[index] == pytest.approx(2 * step, rel=1e-6)
    assert (after - before)[other] / (2 * step) == pytest.approx(-P[index] / P[other], rel=1e-5)


@pytest.mark.parametrize(("finger", "index"), MEASURED.items())
def test_errors_of_the_estimate_are_those_of_the_other_joint(sensed, compiled, finger, index):
    q, noise, other = poses(sensed, finger)[0], 2e-4, 1 - index
    covariance, worst = compiled[f"{finger}_joint_estimate_error"](q, noise)
    arm = abs(compiled[f"{finger}_coupling"](q)[0, other])

    assert worst[other] == pytest.approx(noise / arm)
    assert covariance[other, other] == pytest.approx((noise / arm) ** 2)
    assert (worst[index], np.count_nonzero(covariance)) == (0, 1)


@pytest.mark.parametrize(
    "options", [Options(), Options(params="runtime"), Options(scalar="f32")], ids=["double", "runtime", "f32"]
)
def test_estimates_with_sensors_are_proved_in_all_forms(sensed, options):
    job = Job(sensed, options, only="*joint_estimate*")
    proof = verify(job, cached_tree(job))

    assert {f"{finger}_joint_estimate" for finger in MEASURED} <= {verdict.name for verdict in proof.verdicts}
    assert [verdict.name for verdict in proof.verdicts if not verdict.passed] == []


def test_sensors_on_all_joints_leave_the_estimate_to_lengths_alone():
    all_of_thumb = SENSORS.replace('joint = "tip"\nturn', 'joint = "tip"\nsensor = {}\nturn')
    hand = Hand.parse(all_of_thumb)

    assert hand.fingers["thumb"].measured == ()
    assert hand.fingers["thumb"].structure() == Hand.parse(FEW).fingers["thumb"].structure()
    assert "move only 1 of the 2 joints" in left_out_names(hand)["thumb_joint_estimate"]


def test_the_digest_tells_which_angles_are_inputs_and_not_what_sensors_resolve(sensed):
    finer = Hand.parse(SENSORS.replace('"0.1 deg"', '"0.01 deg"'))

    assert sensed.digest() == finer.digest() != Hand.parse(FEW).digest()
