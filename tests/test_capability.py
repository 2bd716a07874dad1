"""What tendons cannot do, and the kernels that a hand therefore does not have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import _unreachable, left_out
from awiwi_gen.hand.pose import Chain
from awiwi_gen.kernels import catalog, declared
from awiwi_gen.pipeline import Job, cached_tree

TESTS = Path(__file__).parent
ONE_FINGER = (TESTS / "one_finger.toml").read_text(encoding="utf-8")
CLAW = TESTS.parent / "examples" / "claw.toml"
ROUTES = (
    '    { rest = "0 mm", over = ["+root", "+mid"], source = "assumed" },\n'
    '    { rest = "0 mm", over = ["-root", "+mid"], source = "assumed" },\n'
    '    { rest = "0 mm", over = ["-mid"], source = "assumed" },\n'
)


def routed(*tendons: str) -> Hand:
    """The small hand with other tendons."""
    assert ROUTES in ONE_FINGER
    return Hand.parse(
        ONE_FINGER.replace(ROUTES, "".join(f'{{ rest = "0 mm", {each}, source = "x" }},\n' for each in tendons))
    )


def over(*names: str) -> str:
    return "over = [" + ", ".join(f'"{name}"' for name in names) + "]"


@pytest.mark.parametrize("hand", [Hand.load(), Hand.load(CLAW), Hand.parse(ONE_FINGER)], ids=["awiwi", "claw", "one"])
def test_hands_whose_tendons_pull_every_torque_have_all_kernels(hand):
    assert left_out(hand) == {}
    assert [kernel.name for kernel in catalog(hand)] == [kernel.name for kernel in declared(hand)]


def test_tendons_with_rank_and_both_senses_may_still_not_pull_every_torque():
    hand = routed(over("+root", "-mid"), over("-root", "-mid"), over("+root", "+mid"))

    assert left_out(hand) == {
        ("fingers.jaw", "tendon_distribution"): "tendons only pull, and no forces give a torque towards +root and -mid"
    }
    left = {kernel.name for kernel in declared(hand)} - {kernel.name for kernel in catalog(hand)}
    assert left == {"jaw_tendon_distribution"}


@pytest.mark.parametrize(
    "tendons",
    [
        (over("+root", "+mid"), over("-root", "-mid"), over("+mid", "+root")),
        (over("+mid"), over("-mid")),  # fewer tendons that move apart than joints
        (over("+root", "+mid"),),
    ],
)
def test_kernels_that_need_more_tendons_than_there_are_are_left_out(tendons):
    found = left_out(routed(*tendons))
    reason = "the tendons move only 1 of the 2 joints root, mid independently"

    assert {family for _, family in found} == {"joint_estimate", "joint_estimate_error", "tendon_distribution"}
    assert all(each.startswith(reason) for each in found.values())


SPAN = 'span = {{ from = ["2 mm", "{}", "1 mm"], to = ["5 mm", "1 mm", "0 mm"], joint = "mid" }}'


def test_a_joint_without_a_tendon_to_one_side_is_a_reason_not_a_fault():
    hand = routed(over("+root", "+mid"), over("+root", "-mid"), over("-mid"))

    (reason,) = left_out(hand).values()
    assert reason == "tendons only pull, and none pulls towards +root"


def test_spans_count_for_the_rank():
    one_span, two_joints = SPAN.format("3 mm"), (over("+mid"), over("-mid"))

    assert ("fingers.jaw", "joint_estimate") not in left_out(routed(one_span, *two_joints))
    assert ("fingers.jaw", "tendon_distribution") in left_out(routed(one_span, *two_joints))  # one span, one sense
    both = (one_span, SPAN.format("-3 mm"), *two_joints)
    assert left_out(routed(*both)) == {}


def test_a_span_alone_on_two_joints_does_not_tell_them_apart():
    span = SPAN.format("3 mm").replace('"mid"', '"end"')
    hand = Hand.parse(
        ONE_FINGER.replace(ROUTES, f'{{ rest = "0 mm", {span}, source = "x" }},\n').replace(
            'couplings = [{ follower = "end", leader = "mid" }]', ""
        ).replace('joint = "end"\nturn', 'joint = "end"\nlow = "-5 deg"\nhigh = "90 deg"\nturn')
    )  # fmt: skip

    assert left_out(hand)[("fingers.jaw", "joint_estimate")].startswith("the tendons move only 1 of the 3 joints")


def test_the_cone_test_agrees_with_linear_programming():
    rng = np.random.default_rng(7)
    answers = []
    for _ in range(300):
        joints, tendons = rng.integers(1, 6), rng.integers(1, 11)
        coupling = rng.choice([-1.0, 0.0, 1.0], (tendons, joints)) * rng.uniform(0.5, 2.0, joints)
        coupling = coupling[np.abs(coupling).max(axis=1) > 0]
        if not len(coupling):
            continue
        # Strictly positive forces that cancel exist just if the torques of all forces are a linear space.
        balanced = linprog(np.zeros(len(coupling)), A_eq=coupling.T, b_eq=np.zeros(joints), bounds=(1, None)).success
        torque = _unreachable(coupling)
        assert (torque is None) == balanced
        answers.append(balanced)
        if torque is not None:
            within = linprog(np.zeros(len(coupling)), A_eq=-coupling.T, b_eq=torque, bounds=(0, None)).success
            assert not within
    assert 30 < sum(answers) < len(answers) - 30


@pytest.mark.parametrize("name", ["thumb", "index", "ring", "fifth"])
def test_arms_in_plain_floats_are_those_of_the_kernels(lib, hand, name):
    chain = Chain(hand.fingers[name])
    for q in chain.poses()[:6]:
        np.testing.assert_allclose(chain.coupling(q), lib[f"{name}_coupling"](q), rtol=0, atol=1e-10)


def test_a_span_beyond_a_four_bar_has_the_arms_of_the_kernel():
    hand = routed(SPAN.format("3 mm"), over("+mid"), over("-mid"))
    job = Job(hand, only="jaw_coupling")
    chain, library = Chain(hand.fingers["jaw"]), load(cached_tree(job), job.store)
    for q in chain.poses()[:6]:
        np.testing.assert_allclose(chain.coupling(q), library.jaw_coupling(q), rtol=0, atol=1e-10)
