"""Tendons of published hands: a finger of each, accepted as it is, with the kernels that its tendons allow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out_names
from awiwi_gen.hand.pose import Chain
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, cached_tree, verify

HANDS = Path(__file__).with_name("hands")


def published(name: str) -> Hand:
    return Hand.load(HANDS / f"{name}.toml")


def test_three_pairs_of_tendons_on_four_joints_of_the_shadow_finger_leave_estimates_and_distribution_out():
    hand = published("shadow")
    absent = left_out_names(hand)

    assert set(absent) == {"ff_joint_estimate", "ff_joint_estimate_error", "ff_tendon_distribution"}
    assert all(
        reason.startswith("the tendons move only 3 of the 4 joints rh_ffj4, rh_ffj3") for reason in absent.values()
    )
    assert {"ff_coupling", "ff_joint_stiffness", "hand_joint_torque"} <= {kernel.name for kernel in catalog(hand)}


def test_a_joint_of_the_aero_thumb_that_nothing_extends_is_a_reason_no_fault():
    hand = published("aero")
    absent = left_out_names(hand)

    assert "the tendons move only 4 of the 5 joints right_thumb_cmc_abd" in absent["thumb_joint_estimate"]
    assert absent["thumb_tendon_distribution"].endswith("none pulls towards -right_thumb_ip")
    assert not any("right_thumb_ip" in str(warning) for warning in Hand.review(HANDS / "aero.toml")[1])


def test_the_adroit_finger_misses_only_the_distribution():
    reason = "tendons only pull, and no forces give a torque towards -ffj1 and +ffj0"

    assert left_out_names(published("adroit")) == {"ff_tendon_distribution": reason}


@pytest.mark.parametrize(("name", "radii"), [("shadow", [10, 10, 10, 10]), ("adroit", [10, 10, 8.05, 7.05])])
def test_arms_are_the_radii_of_the_model(name, radii):
    coupling = np.array(Chain(published(name).fingers["ff"]).coupling([0.0] * 4))

    np.testing.assert_allclose(np.abs(coupling * 1e3).max(axis=0), radii, rtol=1e-14)


def test_the_arms_of_the_myofinger_let_its_five_tendons_pull_every_torque_on_four_joints():
    hand = published("myofinger")
    arms = [[0, 24, 20, 9], [0, -24, -29.0066575, 0], [0, -24, -29.0066575, -23.1396588],
            [23.4508836, -3.6094362, 0, 0], [-23.4508836, -3.6094362, 0, 0]]  # fmt: skip
    job = Job(hand, only="index_[cj]o[iu][np]*[egr]")
    proof, lib = verify(job, cached_tree(job)), load(cached_tree(job), job.store)
    q = np.array([0.2, 0.3, 0.4, 0.5])

    assert left_out_names(hand) == {}
    assert {"index_coupling", "index_joint_torque", "index_joint_estimate_error"} <= {v.name for v in proof.verdicts}
    assert proof.passed
    np.testing.assert_allclose(lib.index_coupling(q) * 1e3, arms, rtol=1e-14)


def test_the_tendons_of_the_myofinger_pull_a_torque_that_is_asked_for():
    job = Job(published("myofinger"), only="index_tendon_distribution")
    lib = load(cached_tree(job), job.store)
    q, tau, K = np.array([0.2, 0.3, 0.4, 0.5]), np.array([0.1, -0.2, 0.3, -0.1]), np.diag([5.0, 5, 5, 5])
    found = lib.index_tendon_distribution(q, tau, K, 2.0, 90.0)

    assert found.status == 0
    assert (found.f >= 2).all()
    assert (found.f <= 90).all()
    np.testing.assert_allclose(-lib.index_coupling(q).T @ found.f, tau, rtol=0, atol=1e-10)
