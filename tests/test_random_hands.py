"""Random legal hands go the whole way: generated, compiled and proved. `tests/torture_hands.py` tries many more."""

from __future__ import annotations

import pytest
import random_hands

from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, generate, verify

SMALL = {
    "one joint, alike tendons": (1, {"alike", "motor", "ripple", "wrist"}),
    "one joint on a four-bar": (1, {"four-bar without zero", "spring", "units", "fibre"}),
    "two joints, a span": (2, {"spans", "narrow range", "axial mass"}),
    "a coupled joint, a narrow range": (2, {"couplings", "narrow range", "fibre"}),
    "skew axes, bodies without mass": (2, {"skew axes", "references", "massless links", "rotors", "base"}),
    "paths and strings": (2, {"paths", "return strings", "arms", "passive joints", "few tendons"}),
    "followers with ratios": (2, {"couplings", "ratios", "skew axes", "passive joints", "rotors"}),
    "slides": (3, {"slides", "passive joints", "rotors", "skew axes", "references", "arms", "paths"}),
    "fewest tendons": (2, {"fewest", "range without zero", "four-bar"}),
}
SEEDS = {  # of hands on which a kernel or its proof once failed
    "lengths bend in one direction only": (1, "one_joint_estimate"),
    "many tendons over few joints": (12, "two_tendon_distribution"),
    "a step of Gauss and Newton goes too far": (31, "two_joint_estimate"),
    "angles of the base and of a link add up to a right one": (93, "one_jacobian"),
    "no torque at any pose": (108, "one_inverse_dynamics*"),
    "inconsistent lengths shorten the steps of Gauss and Newton by half only": (124, "one_joint_estimate"),
    "exchanges between tendons are level within rounding": (145, "one_tendon_distribution"),
    "the search follows a curved valley": (175, "two_tendon_distribution"),
    "an output is exact, its reference at 256 bits is not": (17, "one_joint_estimate_error"),
    "lengths bend over a slide and a hinge at once": (50, "two_coupling_derivative"),
    "a joint slides along the axis of the hinge before it": (129, "one_coriolis_matrix"),
}
WHOLE = {"wrist", "motor", "spring", "fibre"}  # of the hand: with these the kernels of all its parts are proved
PARTS = "one_*, hand_*, wrist_*, motor_*, spring_*, tendon_*, calibration_*"  # laws have no number of the hand


def proof(text: str, directory, only: str = "*"):
    job = Job(Hand.parse(text), only=only)
    generate(job, directory)
    return verify(job, directory)


@pytest.mark.parametrize("name", SMALL)
def test_a_small_random_hand_is_proved(name, tmp_path):
    links, features = SMALL[name]
    kernels = PARTS if features & WHOLE else "one_*"
    found = proof(random_hands.hand(1, links, features), tmp_path / "generated", kernels)

    assert [verdict for verdict in found.verdicts if not verdict.passed] == []
    assert [law for law in found.laws if not law.passed] == []


@pytest.mark.parametrize("name", SEEDS)
def test_what_a_random_hand_once_showed_stays_mended(name, tmp_path):
    seed, kernel = SEEDS[name]
    assert proof(random_hands.hand(seed), tmp_path / "generated", kernel).passed


def test_a_finger_with_eight_links_is_proved(tmp_path):
    text = random_hands.hand(3, 8, {"couplings", "crossed"})
    kernels = ("one_forward_dynamics", "one_inverse_dynamics", "one_joint_estimate", "one_joint_stiffness")
    found = proof(text, tmp_path / "generated", ",".join(kernels))

    assert text.count("[[fingers.one.links]]") == 8
    assert {verdict.name for verdict in found.verdicts} == {*kernels}
    assert found.passed


def test_a_palm_on_joints_in_series_is_proved(tmp_path):
    text = random_hands.hand(3, 1, {"palm"})

    assert text.count("[[palm.joints]]") == 3
    assert proof(text, tmp_path / "generated", "palm_*").passed


def test_lengths_are_measured_from_where_a_four_bar_closes(tmp_path):
    text = random_hands.hand(3, 2, {"four-bar without zero", "paths", "motor"})

    assert "four_bar" in text
    assert proof(text, tmp_path / "generated", "one_measured_lengths").passed


def test_equal_seeds_give_equal_hands_and_others_differ():
    texts = [random_hands.hand(seed) for seed in (5, 5, 6)]

    assert texts[0] == texts[1] != texts[2]


def test_random_hands_are_of_all_kinds():
    kinds = set().union(*(random_hands.kinds(random_hands.hand(seed)) for seed in range(40)))

    assert kinds == {*random_hands.FEATURES, random_hands.SLIDES}


@pytest.mark.parametrize("turn", ["none", "z+90", "x+90"])
def test_both_derivations_agree_on_a_four_bar_behind_another_joint(turn):
    text = random_hands.hand(1, 2, {"four-bar"})
    before, four_bar = text.split('\njoint = "j1"\nturn = "')
    assert "[fingers.one.links.four_bar]" in four_bar
    hand = Hand.parse(f'{before}\njoint = "j1"\nturn = "{turn}"{four_bar[four_bar.index(chr(10)) :]}')
    records = Job(hand, only="one_fingertip_pose").records

    assert records["one_fingertip_pose"].agreement < 1e-60
