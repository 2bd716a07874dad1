"""Joints that follow others by a polynomial: kinematics, dynamics, tendons, and faults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from exported_mjcf import read_mjcf
from numpy.polynomial import Polynomial

from awiwi_gen.build import load
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.pose import Chain
from awiwi_gen.interchange import export_mjcf, export_urdf
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.mimics import followed
from awiwi_gen.interchange.model import Mimic
from awiwi_gen.interchange.toml import hand_text
from awiwi_gen.pipeline import Job, cached_tree, verify

FILE = Path(__file__).with_name("curved_finger.toml").read_text(encoding="utf-8")
PLANAR = FILE.replace('rpy = ["-8 deg", "3 deg", "0 deg"]\n', "")
CURVE = Polynomial([np.radians(3), 0.4, 0.3, -0.1, 0.05])
KERNELS = "claw_[b-gilmp]*"  # all but those of solvers


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.parse(FILE)


@pytest.fixture(scope="module")
def lib(hand):
    job = Job(hand, only=KERNELS)
    return load(cached_tree(job), job.store)


@pytest.fixture(scope="module")
def q(hand) -> np.ndarray:
    return np.array(Chain(hand.fingers["claw"]).poses())


@pytest.mark.parametrize("text", [FILE, PLANAR], ids=["skew", "planar"])
def test_both_derivations_agree_and_the_laws_of_physics_hold(text):
    job = Job(Hand.parse(text), only=KERNELS)
    proof = verify(job, cached_tree(job))

    assert {"claw_mass_matrix", "claw_inverse_dynamics", "claw_forward_dynamics", "claw_coupling", "claw_energy"} <= {
        v.name for v in proof.verdicts
    }
    assert proof.passed


def test_the_follower_turns_by_the_polynomial(lib, q):
    poses = lib.claw_link_poses(q)
    turned = np.einsum("sji,sjk->sik", poses[:, 1, :3, :3], poses[:, 2, :3, :3])
    at_zero = turned[np.argmin(abs(q[:, 1]))]
    relative = np.einsum("ji,sjk->sik", at_zero, turned)
    angle = CURVE(q[:, 1]) - CURVE(q[np.argmin(abs(q[:, 1])), 1])

    np.testing.assert_allclose(relative[:, 1, 0], np.sin(angle), atol=1e-14)


def test_arms_at_a_follower_are_those_of_its_slope(hand, lib, q):
    slope = CURVE.deriv()(q[:, 1])
    job = Job(hand, only="claw_tendon_lengths")
    h = load(cached_tree(job), job.store).claw_tendon_lengths(q)

    np.testing.assert_allclose(lib.claw_coupling(q)[:, 0, 1] * 1e3, 7 * slope, rtol=1e-12)
    np.testing.assert_allclose(h[:, 1] * 1e3, -7 * q[:, 0] - 4 * CURVE(q[:, 1]), rtol=1e-12)


def test_the_arms_of_the_checks_are_those_of_the_kernel(hand, lib, q):
    chain = Chain(hand.fingers["claw"])

    np.testing.assert_allclose([chain.coupling(each) for each in q], lib.claw_coupling(q), rtol=0, atol=1e-9)


def test_energy_changes_by_the_power_of_the_joints_torque(lib):
    q, qd, qdd = np.array([0.3, 0.9]), np.array([2.0, -3.0]), np.array([40.0, 70.0])
    g, step = np.array([1.0, -2.0, -9.0]), 1e-6

    def total(time: float) -> float:
        energy = lib.claw_energy(q + time * qd + time**2 * qdd / 2, qd + time * qdd, g)
        return float(energy.kinetic + energy.potential)

    power = (total(step) - total(-step)) / (2 * step)
    rest = lib.claw_inverse_dynamics(q, qd, qdd, g) - lib.claw_passive_torque(q, qd)
    spring = lib.claw_passive_torque(q, 0 * qd)
    assert power == pytest.approx(float((rest + spring) @ qd), rel=1e-6)


def test_a_curve_comes_back_from_an_export(hand):
    again = Hand.parse(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(hand)[0])))).fingers["claw"]
    ours = hand.fingers["claw"]

    assert again.couplings[0].structure() == ours.couplings[0].structure()
    np.testing.assert_allclose(again.motion("end"), ours.motion("end"), rtol=1e-12)


def test_a_urdf_loses_the_curve_and_says_so(hand):
    losses = {loss.what: loss.places for loss in export_urdf.text_and_losses(hand)[1]}

    assert losses["couplings by a curve: its offset and ratio only"] == ("claw end",)


def test_an_offset_that_differences_of_angles_leave_by_rounding_is_none():
    assert Mimic.of("b", "a", Polynomial([1.4e-17, 0.857])) == Mimic("b", "a", 0.857)
    assert Mimic.of("b", "a", Polynomial([1e-9, 0.857])).offset == 1e-9


def test_followers_of_followers_are_composed_up_to_the_fourth_power():
    names = {name: name for name in "abc"}
    owner = dict.fromkeys("abc", "claw")
    square = Mimic("b", "a", 0.5, 0.1, (0.3,))
    found, losses = followed([square, Mimic("c", "b", 2.0, 0.0, (0.1,))], owner, names)
    _, lost = followed([square, Mimic("c", "b", 2.0, 0.0, (0.1, 0.2))], owner, names)

    assert not losses
    assert found[1].leader == "a"
    assert found[1].curve(0.7) == pytest.approx(2 * square.curve(0.7) + 0.1 * square.curve(0.7) ** 2, rel=1e-15)
    assert [loss.what for loss in lost] == ["couplings of joints over others by more than the fourth power"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('ratio = "0.4", ', "", "couplings[0] has powers without a ratio; expected one"),
        ('"0.3 1/rad"', '"0.3"', 'couplings[0].square = "0.3"'),
    ],
)
def test_a_fault_of_a_curve_is_told_with_its_place(old, new, message):
    with pytest.raises(InputError) as caught:
        Hand.parse(FILE.replace(old, new))

    assert f"fingers.claw.{message}" in str(caught.value)


def test_a_fingertip_that_never_turns_obeys_mechanics():
    """As in a gripper whose last joint turns back by what its leader turns: its angular velocity is zero, not undefined."""
    body = 'mass = "5 g"\ncom = ["9 mm", "1 mm", "0 mm"]\nsource = "assumed"\ninertia = { xx = "60 g mm^2", ' \
           'yy = "400 g mm^2", zz = "405 g mm^2", xy = "3 g mm^2", xz = "-2 g mm^2", yz = "1 g mm^2" }\n'  # fmt: skip
    link = f'[[fingers.claw.links]]\nturn = "none"\noffset = ["20 mm", "0 mm", "0 mm"]\n{body}'
    coupling = 'couplings = [{ follower = "end", leader = "root", ratio = "-1" }]\n'
    text = f"{FILE.partition('[fingers.claw]')[0]}[fingers.claw]\n{coupling}"
    text += f'{link}joint = "root"\nlow = "0 deg"\nhigh = "80 deg"\n{link}joint = "end"\n'
    job = Job(Hand.parse(text), only="claw_jacobian,claw_fingertip_pose")

    assert [law.passed for law in verify(job, cached_tree(job)).laws] == [True, True]
