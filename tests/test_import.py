"""Import: fingers, frames, names and couplings from a tree of bodies, and the hand file that is written of them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from bodies import body, finger, joint, pose, spun, two_fingers
from hand_numbers import fingers_of, link_angles, poses, rpy_matrix, tendon_lengths

import awiwi_gen
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.model import Loss, Mimic, Model, Place, Tendon
from awiwi_gen.interchange.names import finger_names, joint_names, plain
from awiwi_gen.interchange.quarter import quarter_angle, quarter_axis, quarter_rotation
from awiwi_gen.interchange.toml import angle, cite, hand_text, length, quantity, tidy

POINTS = {1: np.array([0.0, 0.01, 0.0]), 2: np.array([0.01, 0.0, 0.004]), 4: np.array([0.0, 0.0, 0.002])}
PATH = Tendon("string", path=tuple(Place(*each) for each in POINTS.items()))


def imported(model: Model, **options) -> tuple[Hand, dict]:
    text = hand_text(draft(model, **options))
    return Hand.parse(text), fingers_of(text)


def states(model: Model):
    random = np.random.default_rng(4)
    for _ in range(20):
        yield {each.name: random.uniform(-1, 1) for each in model.joints}


# -- frames ----------------------------------------------------------------------------------------------------------


def test_links_stand_where_the_tree_has_them():
    model = finger()
    _, tables = imported(model)
    (written,) = tables.values()
    for angles in states(model):
        base = rpy_matrix(written["base"]["rpy"])
        palm_axes, palm = pose(model, {}, 1)
        frames = poses(written, np.array(list(angles.values())))
        pad_axes, pad = pose(model, angles, 4)
        tip = pad + pad_axes @ np.array([0.005, 0.0, 0.0])
        ours = palm + palm_axes @ (np.array(written["base"]["position"]) + base @ frames[-1][1])
        assert ours == pytest.approx(tip, abs=1e-15)
        axis = pose(model, angles, 3)[0] @ model.joints[2].axis
        assert palm_axes @ base @ frames[2][0][:, 2] == pytest.approx(axis, abs=1e-14)


def test_two_joints_in_one_body_are_a_link_without_mass_and_one_with_the_mass():
    hand, _ = imported(finger())
    (links,) = (each.links for each in hand.fingers.values())

    assert [link.mass is None for link in links] == [True, False, False]
    assert float(links[2].mass) == 0.008  # the pad is welded to the last link


def test_links_need_a_roll_about_x_at_most():
    hand, _ = imported(finger())
    for link in next(iter(hand.fingers.values())).links:
        assert [float(each) for each in link.rpy or (0, 0, 0)][1:] == [0, 0]


def test_axes_at_right_angles_need_no_number_at_all():
    hand, _ = imported(two_fingers())

    assert [f.links[0].turn for f in hand.fingers.values()] == ["x-90", "y+90"]
    assert all(f.links[0].rpy is None and f.links[0].reference is None for f in hand.fingers.values())


def test_tendons_through_points_are_as_long_as_in_the_tree():
    model = finger(tendons=(PATH,))
    _, tables = imported(model)
    (written,) = tables.values()
    for angles in states(model):
        points = []
        for index, local, *_ in PATH.path:
            axes, origin = pose(model, angles, index)
            points.append(origin + axes @ local)
        expected = sum(np.linalg.norm(b - a) for a, b in pairwise(points))
        assert tendon_lengths(written, np.array(list(angles.values()))) == pytest.approx([expected], abs=1e-15)


def test_a_body_that_a_tendon_wraps_round_stands_where_the_tree_has_it():
    axis, side = np.array([0.6, 0.0, 0.8]), np.array([0.01, 0.02, 0.004])
    wrap = Place(2, POINTS[2], 0.002, axis, side)
    start, end = Place(1, POINTS[1]), Place(4, POINTS[4], divisor=2.0)
    model = finger(tendons=(Tendon("string", path=(start, wrap, Place(2, POINTS[2] + [0.02, 0.0, 0.0]), end)),))
    (written,) = fingers_of(hand_text(draft(model))).values()
    body = written["tendons"][0]["path"][1]
    number = [link["joint"] for link in written["links"]].index(body["link"])
    base = pose(model, {}, 1)[0] @ rpy_matrix(written["base"]["rpy"])
    origin = pose(model, {}, 1)[1] + pose(model, {}, 1)[0] @ np.array(written["base"]["position"])
    for angles in states(model):
        axes, position = pose(model, angles, 2)
        own_axes, own = poses(written, np.array(list(angles.values())))[number]
        for local, key in ((wrap.at, "at"), (side, "side")):
            assert origin + base @ (own + own_axes @ np.array(body[key])) == pytest.approx(
                position + axes @ local, abs=1e-15
            )
        assert base @ own_axes @ np.array(body["axis"], float) == pytest.approx(axes @ axis, abs=1e-14)
    assert [each.get("divisor") for each in written["tendons"][0]["path"]] == [None, None, None, 2.0]
    assert body["radius"] == 0.002


# -- pulleys ---------------------------------------------------------------------------------------------------------


def test_joints_whose_arms_are_equal_and_opposite_have_a_pulley():
    opposite = (
        Tendon("a", arms={"IF:Spread": 0.009, "IF:Bend": 0.0065}),
        Tendon("b", arms={"IF:Spread": 0.009, "IF:Bend": -0.0065, "IF:Tip": 0.004}),
        Tendon("c", arms={"IF:Spread": -0.009, "IF:Tip": -0.005}),
    )
    hand, _ = imported(finger(tendons=opposite))
    (made,) = hand.fingers.values()

    assert {joint: float(radius) for joint, radius in made.radii.items()} == {"spread": 0.009, "bend": 0.0065}
    assert [tendon.over for tendon in made.tendons] == [("+spread", "+bend"), ("+spread", "-bend"), ("-spread",)]
    assert [list(tendon.arms) for tendon in made.tendons] == [[], ["tip"], ["tip"]]


def test_arms_in_one_sense_or_on_a_follower_stay_arms():
    mimics = (Mimic("IF:Tip", "IF:Bend", 0.5),)
    arms = [{"IF:Spread": 0.009, "IF:Tip": 0.004}, {"IF:Spread": 0.009, "IF:Tip": -0.004}]
    hand, _ = imported(finger(tendons=tuple(Tendon("ab"[i], arms=each) for i, each in enumerate(arms)), mimics=mimics))
    (made,) = hand.fingers.values()

    assert not made.pulleys
    assert [list(tendon.arms) for tendon in made.tendons] == [["spread", "tip"]] * 2


# -- couplings -------------------------------------------------------------------------------------------------------


def test_a_follower_turns_with_its_leader_as_published():
    mimic = Mimic("IF:Tip", "IF:Bend", -0.5, 0.1)
    arms = Tendon("arms", arms={"IF:Bend": 0.01, "IF:Tip": 0.03})
    model = finger(tendons=(arms,), mimics=(mimic,))
    hand, tables = imported(model)
    (written,) = tables.values()
    assert next(iter(hand.fingers.values())).motion("tip") == (0.1, -0.5)
    for spread, bend in ((0.1, 0.3), (-0.4, 1.1)):
        q = np.array([spread, bend])
        angles = {"IF:Spread": spread, "IF:Bend": bend, "IF:Tip": mimic.ratio * bend + mimic.offset}
        assert link_angles(written, q) == pytest.approx(list(angles.values()), abs=1e-16)
        base = pose(model, {}, 1)[0] @ rpy_matrix(written["base"]["rpy"])
        axis = pose(model, angles, 3)[0] @ model.joints[2].axis
        assert base @ poses(written, link_angles(written, q))[2][0][:, 2] == pytest.approx(axis, abs=1e-14)
        assert tendon_lengths(written, q)[0] == pytest.approx(0.01 * bend + 0.03 * angles["IF:Tip"], abs=1e-15)


def test_a_chain_of_followers_follows_the_independent_joint():
    mimics = (Mimic("IF:Tip", "IF:Bend", 2.0, 0.1), Mimic("IF:Bend", "IF:Spread", 0.5, 0.2))
    found = {mimic.follower: mimic for each in draft(finger(mimics=mimics)).fingers for mimic in each.followed}

    assert (found["tip"].leader, found["tip"].ratio, found["tip"].offset) == ("spread", 1.0, 0.5)


def test_a_coupling_in_a_loop_or_to_another_finger_is_a_loss():
    loop = (Mimic("IF:Tip", "IF:Bend", 1.0), Mimic("IF:Bend", "IF:Tip", 1.0))
    apart = two_fingers(mimics=(Mimic("index_bend", "thumb_bend", 1.0),))
    for model, places in ((finger(mimics=loop), ("IF:Bend to IF:Tip",)), (apart, ("index_bend to thumb_bend",))):
        (loss,) = (loss for loss in draft(model).losses if loss.what.startswith("couplings"))
        assert loss.places == places


# -- what a hand file cannot hold ------------------------------------------------------------------------------------


def test_tendons_of_the_wrist_are_reported():
    losses = draft(two_fingers(tendons=(Tendon("flexor", arms={"wrist": 0.01}),))).losses

    assert [loss.places for loss in losses if loss.what == "tendons of no finger"] == [("flexor",)]
    assert not [loss for loss in losses if loss.what.startswith("joints above")]


def wrist(**more) -> Model:
    """A forearm, a wrist of two skew axes with a body between, and a palm that is welded askew, with two fingers."""
    model = two_fingers()
    _, palm, *fingers = model.bodies
    tilted = replace(palm, parent=2, position=np.array([0.02, 0.01, -0.03]), axes=spun(np.array([0.6, 0.0, 0.8]), 0.7))
    bodies = (
        body("world", 0, mass=0.0),
        body("forearm", 0, (0.1, 0.2, 0.3), spun(np.array([0.0, 0.6, 0.8]), 0.4)),
        body("carpus", 1, (0.01, 0.02, 0.25)),
        tilted,
        *(replace(each, parent=3) for each in fingers),
    )
    joints = (
        joint("W:Deviation", 2, (0.1, 0.0, 1.0), (0.001, 0.002, 0.003), reference=0.1),
        joint("W:Flexion", 3, (0.2, 1.0, 0.1), (-0.002, 0.001, 0.0), **more),
        *(replace(each, body=each.body + 2) for each in model.joints[1:]),
    )
    return Model("Wrist", "wrist.xml", bodies, joints)


def test_a_wrist_of_joints_in_series_moves_the_palm_as_in_the_tree():
    model = wrist()
    hand, _ = imported(model)
    assert hand.palm is not None
    assert [each.joint for each in hand.palm.joints] == ["deviation", "flexion"]
    lib = awiwi_gen.build(hand, only="palm_pose")
    for angles in ((0.1, 0.0), (0.4, -0.3), (-0.2, 1.1)):
        named = dict(zip(("W:Deviation", "W:Flexion"), angles, strict=True))
        (axes, origin), (carrier, start) = pose(model, named, 3), pose(model, {}, 1)
        found = lib.palm_pose(angles)

        assert found[:3, :3] == pytest.approx(carrier.T @ axes, abs=1e-14)
        assert found[:3, 3] == pytest.approx(carrier.T @ (origin - start), abs=1e-15)


def test_more_joints_than_a_wrist_has_and_those_that_are_no_hinges_are_a_loss():
    model = wrist()
    arm = Model("Arm", "arm.xml", model.bodies, (joint("shoulder", 1), joint("elbow", 1), *model.joints))
    for changed, places in (
        (arm, ("shoulder", "elbow", "W:Deviation", "W:Flexion")),
        (wrist(kind="slide"), ("W:Deviation", "W:Flexion")),
    ):
        found = draft(changed)

        assert found.wrist is None
        assert Loss("joints above the palm: the palm is held as drawn", places) in found.losses


def test_a_finger_with_a_joint_that_neither_turns_nor_slides_is_refused_by_its_name():
    model = two_fingers()
    changed = Model("Pair", "pair.xml", model.bodies, (*model.joints, joint("pad", 2, kind="ball")))

    with pytest.raises(InputError, match="joint pad is a ball joint; a finger's joints are hinges"):
        draft(changed)


def test_a_slide_along_any_axis_moves_the_finger_as_the_tree_says():
    model = finger()
    push = joint("IF:Push", 2, (3.0, -1.0, 0.5), low=-0.01, high=0.03, reference=0.004, kind="slide")
    swing, bend, tip = model.joints
    changed = Model("Pushed", "pushed.xml", model.bodies, (swing, push, bend, tip), sites=model.sites)
    hand, tables = imported(changed)
    (found,) = hand.fingers.values()

    assert [link.kind for link in found.links] == ["hinge", "slide", "hinge", "hinge"]
    assert (float(found.links[1].low), float(found.links[1].reference)) == (-0.01, 0.004)
    (written,) = tables.values()
    frames = [poses(written, np.array([0.0, x, 0.2, 0.0]))[-1] for x in (0.004, 0.014)]  # as drawn, and 10 mm further
    axis = model.bodies[2].axes @ np.array([3.0, -1.0, 0.5]) / np.linalg.norm([3.0, -1.0, 0.5])
    base = rpy_matrix(written["base"]["rpy"])
    assert base @ (frames[1][1] - frames[0][1]) == pytest.approx(0.01 * axis, abs=1e-16)
    assert frames[1][0] == pytest.approx(frames[0][0], abs=1e-16)


def test_a_finger_that_branches_is_refused_with_both_branches():
    model = finger()
    fork = body("fork", 2)
    changed = Model("Fork", "fork.xml", (*model.bodies, fork), (*model.joints, joint("other", 5)))

    with pytest.raises(InputError, match=r"body knuckle carries 2 moving bodies \(distal, fork\)"):
        draft(changed, palm="palm")


def test_fingers_can_be_named_and_the_others_left_out():
    hand, _ = imported(two_fingers(), named={"pointer": "index_link"})

    assert list(hand.fingers) == ["pointer"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"palm": "plam"}, "no body 'plam'; did you mean palm"),
        ({"named": {"index": "index_lnk"}}, "no body 'index_lnk'; did you mean index_link"),
        ({"named": {"Index": "index_link"}}, "--finger Index=...: is not a usable name"),
        ({"palm": "index_link", "named": {"a": "thumb_link"}}, "is not below the palm index_link"),
    ],
)
def test_what_the_flags_name_must_exist(options, message):
    with pytest.raises(InputError) as caught:
        draft(two_fingers(), **options)

    assert message in str(caught.value)


# -- names and numbers -----------------------------------------------------------------------------------------------


def test_names_become_names_of_c_and_stay_apart():
    found = joint_names({"index": ["rh:IF J1", "rh:IF-J1", "rh:2nd", "rh:palm", "rh:double"]})

    assert list(found.values()) == ["if_j1", "if_j1_2", "n2nd", "palm_j", "double_j"]
    assert plain("FFJ3") == "ffj3"
    assert joint_names({"a": ["x" * 80]}) == {"x" * 80: "x" * 63}


def test_the_finger_is_not_in_the_names_of_its_joints_twice():
    assert joint_names({"index": ["r_index_mcp", "r_index_pip"], "thumb": ["r_thumb_ip"]}) == {
        "r_index_mcp": "mcp", "r_index_pip": "pip", "r_thumb_ip": "ip",
    }  # fmt: skip
    numbered = joint_names({"thumb": ["thumb_0_joint", "thumb_1_joint"], "index": ["index_0_joint"]})
    assert list(numbered.values()) == ["thumb_0_joint", "thumb_1_joint", "index_0_joint"]


def test_fingers_are_called_by_the_word_that_their_bodies_use():
    chains = [("palm", ["LFmetacarpal", "LFJ4"]), ("palm", ["r_index_tip", "r_index_mcp"]), ("palm", ["x1", "x2"]),
              ("claw.base", ["claw_a"]), ("palm", ["2a", "3b"])]  # fmt: skip

    assert finger_names(chains) == ["lf", "index", "finger3", "claw", "finger5"]


def test_published_roundings_of_quarter_turns_are_known():
    assert [quarter_angle(text) for text in ("1.57", "1.5708", "-3.1416", "1.6", "0.3", "1.55", "0")] == [
        math.pi / 2, math.pi / 2, -math.pi, None, None, None, None,
    ]  # fmt: skip
    assert quarter_axis(np.array([-1.3e-8, -1.0000003, 0])).tolist() == [0, -1, 0]
    assert quarter_axis(np.array([0.01, 1, 0])) is None
    assert quarter_rotation(np.array([0.707107, 0.707107, 0, 0])) == pytest.approx(
        [math.sqrt(0.5)] * 2 + [0, 0], abs=1e-16
    )
    assert quarter_rotation(np.array([0.9, 0.1, 0, 0])) is None


def test_numbers_are_written_to_the_last_digit_in_the_unit_of_designers():
    assert length(0.0062) == "6.2 mm"
    assert quantity(1.5e-7, "g mm^2", 9) == "150 g mm^2"
    assert quantity(1e-9, "kg m^2") == "1e-9 kg m^2"
    assert (angle(math.pi / 2), angle(-math.pi), angle(1.571)) == ("90 deg", "-180 deg", "1.571 rad")
    assert tidy([0.045, -3e-18, 0.045000000000000005, 1 / 3]) == [0.045, 0.0, 0.045, 1 / 3]


def test_a_source_fits_into_a_comment_of_c():
    assert cite("a*/b\\c" + "x" * 100).startswith("a* /b/cxxx")
    assert len(cite("x" * 100)) == 80


def test_the_file_says_what_is_lost_and_how_names_were_mapped():
    text = hand_text(draft(replace(finger(), losses=(Loss("meshes", ("a", "b")),))))

    assert "# name: joint IF:Spread -> spread\n" in text
    assert "# not held:\n#     2  meshes (a, b)\n" in text
    assert 'default = "test.xml joint IF:Tip"' in text


def test_the_tree_of_the_tests_turns_as_it_should():
    assert spun(np.array([0.0, 0.0, 1.0]), math.pi / 2) @ [1, 0, 0] == pytest.approx([0, 1, 0])


def test_a_single_finger_stands_on_the_last_body_that_is_called_a_palm():
    bodies = (
        body("world", 0, mass=0.0), body("forearm", 0), body("hand_Palm", 1), body("base", 2), body("link", 3, (0.03, 0, 0)),
    )  # fmt: skip
    joints = (joint("wrist", 2), joint("bend", 4, (0, 1, 0)))
    drafted = draft(Model("One", "one.xml", bodies, joints))

    assert drafted.palm == "hand_Palm"
    assert [each.joint for each in drafted.wrist.joints] == ["wrist"]
    assert [[each.joint for each in finger.links] for finger in drafted.fingers] == [["bend"]]
