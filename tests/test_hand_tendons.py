"""The tendons of the whole hand: 38 x 19 in blocks of the fingers, and the wrist that pulls them all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree

FAMILIES = ("tendon_lengths", "coupling", "joint_torque", "joint_stiffness")


@pytest.fixture(scope="module")
def state(lib):
    """Random joint angles, forces, stiffnesses and wrist angles of 50 poses, all inside the documented ranges."""
    ports = {port["name"]: port for name in FAMILIES for port in lib[f"hand_{name}"].inputs}
    random = np.random.default_rng(6)
    return {name: random.uniform(port["low"], port["high"], (50, *port["shape"])) for name, port in ports.items()}


def of_fingers(lib, hand, state, family: str):
    """The output of a kernel for each finger, with the finger's share of the hand's state."""
    for name, (tendons, joints) in hand.blocks.items():
        kernel = lib[f"{name}_{family}"]
        share = {"q": joints, "f": tendons, "k": tendons}
        yield (tendons, joints), kernel(**{p["name"]: state[p["name"]][:, share[p["name"]]] for p in kernel.inputs})


def test_the_awiwi_hand_has_19_joints_and_38_tendons_in_the_order_of_its_fingers(lib, hand):
    sizes = {name: (t.stop - t.start, j.stop - j.start) for name, (t, j) in hand.blocks.items()}

    assert sizes == {"thumb": (8, 4), "index": (8, 4), "middle": (8, 4), "ring": (6, 3), "fifth": (8, 4)}
    assert lib.hand_coupling.outputs[0]["shape"] == [38, 19]
    starts = [(0, 0), *((t.stop, j.stop) for t, j in hand.blocks.values())]
    assert [(t.start, j.start) for t, j in hand.blocks.values()] == starts[:-1]


def test_the_coupling_of_the_hand_is_that_of_the_fingers_in_blocks_and_zero_elsewhere(lib, hand, state):
    whole = lib.hand_coupling(state["q"])
    expected = np.zeros_like(whole)
    for (tendons, joints), block in of_fingers(lib, hand, state, "coupling"):
        expected[:, tendons, joints] = block

    np.testing.assert_allclose(whole, expected, rtol=0, atol=1e-16)
    assert not whole[expected == 0].any()


def test_the_stiffness_of_the_hand_is_that_of_the_fingers_in_blocks_and_zero_elsewhere(lib, hand, state):
    whole = lib.hand_joint_stiffness(state["q"], state["f"], state["k"])
    expected = np.zeros_like(whole)
    for (_, joints), block in of_fingers(lib, hand, state, "joint_stiffness"):
        expected[:, joints, joints] = block

    np.testing.assert_allclose(whole, expected, rtol=0, atol=1e-13)
    assert not whole[expected == 0].any()


def test_the_torques_of_the_hand_are_those_of_the_fingers(lib, hand, state):
    whole = lib.hand_joint_torque(state["q"], state["f"])

    for (_, joints), torque in of_fingers(lib, hand, state, "joint_torque"):
        np.testing.assert_allclose(whole[:, joints], torque, rtol=0, atol=1e-14)


def test_a_tendon_is_as_long_as_its_paths_in_the_finger_and_in_the_wrist(lib, hand, state):
    whole = lib.hand_tendon_lengths(state["q"], state["wrist"])
    wrist = lib.wrist_tendon_lengths(state["wrist"][:, 0], state["wrist"][:, 1])

    assert not whole.status.any()
    for (tendons, _), lengths in of_fingers(lib, hand, state, "tendon_lengths"):
        np.testing.assert_allclose(whole.h[:, tendons], lengths + wrist.h[:, tendons], rtol=0, atol=1e-16)


def test_joints_and_wrist_together_move_tendons_by_both_couplings(lib, state):
    rate_q, rate_wrist = np.random.default_rng(7).normal(size=(2, 50, 19))
    rate_wrist, step = rate_wrist[:, :2], 1e-6

    def lengths(time: float):
        return lib.hand_tendon_lengths(state["q"] + time * rate_q, state["wrist"] + time * rate_wrist).h

    moving = (lengths(step) - lengths(-step)) / (2 * step)
    columns = lib.wrist_coupling(state["wrist"][:, 0], state["wrist"][:, 1]).dh
    both = np.concatenate([lib.hand_coupling(state["q"]), columns], axis=2)
    expected = np.einsum("sij,sj->si", both, np.concatenate([rate_q, rate_wrist], axis=1))
    np.testing.assert_allclose(moving, expected, rtol=0, atol=1e-9)


def test_the_joints_gain_the_power_that_the_tendons_lose(lib, state):
    velocity = np.random.default_rng(8).normal(size=(50, 19))
    pulled = np.einsum("sij,sj->si", lib.hand_coupling(state["q"]), velocity)
    gained = (lib.hand_joint_torque(state["q"], state["f"]) * velocity).sum(axis=1)

    np.testing.assert_allclose(gained, -(state["f"] * pulled).sum(axis=1), rtol=0, atol=1e-13)


def test_the_stiffness_of_the_hand_is_symmetric_and_the_falling_torque(lib, state):
    stiffness = lib.hand_joint_stiffness(state["q"], state["f"], state["k"])
    velocity, step = np.random.default_rng(9).normal(size=(50, 19)), 1e-6
    stretching = state["k"] * np.einsum("sij,sj->si", lib.hand_coupling(state["q"]), velocity)

    def torque(time: float):
        return lib.hand_joint_torque(state["q"] + time * velocity, state["f"] + time * stretching)

    falling = (torque(-step) - torque(step)) / (2 * step)
    np.testing.assert_allclose(falling, np.einsum("sij,sj->si", stiffness, velocity), rtol=0, atol=1e-6)
    np.testing.assert_allclose(stiffness, np.swapaxes(stiffness, 1, 2), rtol=0, atol=1e-13)


def test_no_operation_is_spent_on_the_zeros_between_the_fingers(lib, hand):
    for family in FAMILIES[1:]:
        of_parts = sum(lib[f"{name}_{family}"].cost["operations"] for name in hand.fingers)

        assert lib[f"hand_{family}"].cost["operations"] <= of_parts


def test_a_wrist_past_its_domain_leaves_the_whole_hand_a_status_and_no_number(lib, state):
    beyond = lib.hand_tendon_lengths(state["q"], np.array([0.6, -0.1]))
    lost = lib.hand_tendon_lengths(state["q"], np.array([-1.0, 0.5]))

    assert (beyond.status == 1).all()
    assert (lost.status == 1).all()
    assert np.isnan(lost.h).all()


def test_a_hand_without_a_wrist_has_tendons_all_the_same():
    hand = Hand.load(Path(__file__).with_name("one_finger.toml"))
    job = Job(hand, only="*_tendon_lengths")
    lib = load(cached_tree(job), job.store)
    (finger,) = hand.fingers
    q = np.array([0.2] * len(hand.fingers[finger].joints))

    assert hand.wrist is None
    np.testing.assert_array_equal(lib.hand_tendon_lengths(q), lib[f"{finger}_tendon_lengths"](q))
