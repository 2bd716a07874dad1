"""A palm on joints in series: its pose, its Jacobian and gravity in its axes, from the hand file to the C."""

from __future__ import annotations

import json

import numpy as np
import pytest
from actuators import AWIWI
from samples import ONE_FINGER
from textbook import roll_pitch_yaw

import awiwi_gen
from awiwi_gen.build import load
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree, verify

PALM = """
[palm]
rpy = ["90 deg", "0 deg", "20 deg"]
base = { position = ["10 mm", "-4 mm", "200 mm"], rpy = ["0 deg", "90 deg", "-35 deg"], source = "drawing 9" }
source = "drawing 9"

[[palm.joints]]
joint = "deviation"
low = "-30 deg"
high = "20 deg"
offset = ["34 mm", "0 mm", "1 mm"]
source = "drawing 9"

[[palm.joints]]
joint = "flexion"
turn = "x-90"
rpy = ["12 deg", "0 deg", "0 deg"]
reference = "15 deg"
low = "-40 deg"
high = "28 deg"
offset = ["8 mm", "3 mm", "-6 mm"]
source = "drawing 9"
"""
TEXT = ONE_FINGER + PALM


@pytest.fixture(scope="module")
def job():
    return Job(Hand.parse(TEXT), only="palm_*")


@pytest.fixture(scope="module")
def lib(job):
    return load(cached_tree(job))


def place(position=(0, 0, 0), rpy=(0, 0, 0)) -> np.ndarray:
    """A fixed frame (4 x 4): position [mm], angles [deg]."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = roll_pitch_yaw(np.radians(rpy)), np.array(position) / 1000
    return frame


def drawn(q) -> np.ndarray:
    """The palm's pose, by the frames of the drawing one after the other."""
    first, second = np.degrees(q)
    chain = [
        place((10, -4, 200), (0, 90, -35)), place(rpy=(0, 0, first)), place((34, 0, 1)),
        place(rpy=(-90, 0, 0)), place(rpy=(12, 0, 0)), place(rpy=(0, 0, second - 15)), place((8, 3, -6)),
        place(rpy=(90, 0, 20)),
    ]  # fmt: skip
    return np.linalg.multi_dot(chain)


def test_the_kernels_of_the_palm_are_proved_and_obey_mechanics(job):
    proof = verify(job, cached_tree(job))

    assert [verdict.name for verdict in proof.verdicts] == ["palm_pose", "palm_jacobian", "palm_gravity"]
    assert [(verdict.name, verdict.reasons) for verdict in proof.verdicts if not verdict.passed] == []
    assert {law.statement: law.passed for law in proof.laws} == {
        "the wrist moves the palm by its jacobian": True,
        "gravity turns with the palm": True,
    }


def test_the_palm_stands_where_the_frames_of_the_drawing_lead(lib):
    for q in np.random.default_rng(4).uniform(-0.5, 0.4, (20, 2)):
        assert np.abs(lib.palm_pose(q) - drawn(q)).max() < 1e-15


def test_gravity_in_the_forearm_is_rotated_into_the_palm(lib):
    q, g = [0.3, -0.2], np.array([1.0, -2.0, -9.0])

    assert lib.palm_gravity(q, g) == pytest.approx(drawn(q)[:3, :3].T @ g, rel=1e-14)


def test_the_jacobian_is_that_of_the_drawing(lib):
    q, step = np.array([0.2, 0.1]), 1e-6
    jacobian = lib.palm_jacobian(q)
    for joint in range(2):
        ahead, behind = (drawn(q + sign * step * np.eye(2)[joint]) for sign in (1, -1))
        rate = (ahead - behind) / (2 * step)
        spin = rate[:3, :3] @ drawn(q)[:3, :3].T

        assert jacobian[:3, joint] == pytest.approx(rate[:3, 3], abs=1e-9)
        assert jacobian[3:, joint] == pytest.approx([spin[2, 1], spin[0, 2], spin[1, 0]], abs=1e-9)


def test_one_joint_without_optional_keys_is_enough():
    text = ONE_FINGER + (
        '\n[palm]\nsource = "drawing"\n[[palm.joints]]\njoint = "bend"\nlow = "-1 rad"\nhigh = "1 rad"\n'
        'offset = ["50 mm", "0 mm", "0 mm"]\nsource = "drawing"\n'
    )
    pose = load(cached_tree(Job(Hand.parse(text), only="palm_*"))).palm_pose([0.5])

    assert pose[:3, 3] == pytest.approx([0.05 * np.cos(0.5), 0.05 * np.sin(0.5), 0])


def test_numbers_do_not_change_the_structure_but_quarter_turns_do():
    structures = [
        json.dumps(Hand.parse(TEXT.replace(*change)).palm.structure(), sort_keys=True)
        for change in (("", ""), ('"12 deg"', '"13 deg"'), ('"12 deg"', '"90 deg"'), ('reference = "15 deg"\n', ""))
    ]

    assert structures[0] == structures[1]
    assert len(set(structures)) == 3


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('low = "-40 deg"', 'low = "40 deg"', r'palm.joints\[1\].low = "40 deg" is not below high = "28 deg"'),
        ('high = "20 deg"', 'high = "-29.999 deg"', r"palm.joints\[0\].high .* leaves a range of 0.001 deg"),
        ('"flexion"', '"deviation"', r'palm.joints\[1\].joint = "deviation" is the joint of joints\[0\] already'),
        ('offset = ["8 mm"', 'offset = ["8 N"', r'palm.joints\[1\].offset\[0\] = "8 N" is a force'),
        ("high = ", "hihg = ", r"palm.joints\[0\].hihg is not a known key; did you mean"),
    ],
)
def test_a_slip_in_the_palm_is_named(old, new, message):
    assert PALM.count(old) >= 1
    with pytest.raises(InputError, match=message):
        Hand.parse(ONE_FINGER + PALM.replace(old, new, 1))


def test_a_palm_has_joints_in_series_or_the_parallelogram():

    with pytest.raises(InputError, match=r"palm has joints, but the hand has a wrist that moves its palm"):
        awiwi_gen.Hand.parse(AWIWI + PALM)
