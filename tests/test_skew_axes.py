"""Joints about any axis: fixed rotations by any angles, reference angles, and where a finger stands in the palm."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from chains import chain, records, rpy
from textbook import coordinates, roll_pitch_yaw, rotations, vector

import awiwi_gen
from awiwi_gen.derive import Deriver
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError
from awiwi_gen.hand.pose import Chain
from awiwi_gen.ir.cost import cost
from awiwi_gen.ir.passes.bind import bind
from awiwi_gen.kernels import catalog
from awiwi_gen.records import prepare, values_of
from awiwi_gen.verify.samples import draw
from awiwi_gen.witnesses.dynamics import recursion
from awiwi_gen.witnesses.dynamics.skew_chain import skew_chain
from bench.skew import skew_hand

SKEW_FINGER = Path(__file__).with_name("skew_finger.toml")
# What a joint may have beside its link, for chains whose joints all turn about axes askew to each other.
ROTOR = {"armature": '"40 g mm^2"'}
LOSSES = {
    "damping": '"0.002 N m s/rad"',
    "friction": '{ torque = "3 N mm", velocity = "0.5 rad/s" }',
    "spring": '{ stiffness = "0.1 N m/rad", reference = "30 deg" }',
}
MIXED = [ROTOR, rpy(37, 20, -12) | LOSSES, rpy(0, -52) | ROTOR | LOSSES, rpy(33) | {"turn": '"z+90"'}]
TURNED_TWICE = rpy(20, 90, 20) | {"turn": '"x+90"'}  # back to a quarter turn, but only by these numbers
BASE = 'base = { position = ["40 mm", "0 mm", "3 mm"], rpy = ["90 deg", "0 deg", "180 deg"], source = "assumed" }\n'


@pytest.fixture(scope="module")
def skew():
    return awiwi_gen.Hand.load(SKEW_FINGER)


@pytest.fixture(scope="module")
def finger(skew):
    return skew.fingers["claw"]


@pytest.fixture(scope="module")
def lib(skew):
    return awiwi_gen.build(skew, only="claw_[befgilmp]*")


def angles(lib, count=20):
    port = lib.claw_fingertip_pose.inputs[0]
    return np.random.default_rng(4).uniform(port["low"], port["high"], (count, len(port["low"])))


def poses(finger, q):
    """Poses (links + 1, 4, 4) of the links, then of the fingertip, by multiplication."""
    found, T, offset = [], np.eye(4), np.zeros(3)
    for link, rotation in zip(finger.links, rotations(finger, coordinates(finger) @ q), strict=True):
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = rotation, offset
        T, offset = T @ step, vector(link.offset)
        found.append(T)
    step = np.eye(4)
    step[:3, 3] = offset
    return np.array([*found, T @ step])


def kernel(hand, family):
    return next(kernel for kernel in catalog(hand) if kernel.family == family)


def graph(hand, family, route="casadi"):
    """The graph of a kernel with its numbers."""
    found = kernel(hand, family)
    return bind(Deriver(found.part).derive(found, route), values_of(found))


def operations(hand, family):
    found = kernel(hand, family)
    graphs = {"casadi": Deriver(found.part).derive(found, "casadi")}
    return cost(prepare(graphs, values_of(found), Options()).stages[-1][1]).operations


def test_links_stand_where_multiplication_of_urdfs_rotations_puts_them(lib, finger):
    for q in angles(lib):
        by_hand = poses(finger, q)
        assert np.abs(lib.claw_link_poses(q) - by_hand[:-1]).max() < 2e-15
        assert np.abs(lib.claw_fingertip_pose(q) - by_hand[-1]).max() < 2e-15


def test_the_checks_of_a_hand_file_see_links_in_the_same_places(lib, finger):
    for q in angles(lib, 5):
        frames = [(np.array(axes).T, origin) for _, (axes, origin) in Chain(finger).frames(q)]
        for (axes, origin), pose in zip(frames, poses(finger, q), strict=False):
            assert np.abs(axes - pose[:3, :3]).max() < 2e-15
            assert np.abs(origin - pose[:3, 3]).max() < 1e-16


def test_a_span_ends_in_front_of_a_joint_but_behind_its_fixed_rotation(skew, finger):
    """As both derivations see it: records are made only where they agree."""
    lengths = records(skew, ("tendon_lengths",))["tendon_lengths"].reference.high["h"][:, 3]
    span, end = finger.tendons[3].span, finger.links[2]
    for q, length in zip(draw(kernel(skew, "tendon_lengths").inputs, "fingers.claw")["q"], lengths, strict=True):
        pose = poses(finger, q)[2]
        seat = pose[:3, :3] @ rotations(finger, coordinates(finger) @ q)[2].T @ roll_pitch_yaw(vector(end.rpy))
        distance = np.linalg.norm(pose[:3, 3] + seat @ vector(span.to) - vector(span.from_))
        assert length == pytest.approx(distance, rel=1e-14)


@pytest.mark.parametrize("route", ["sympy", "casadi"])
@pytest.mark.parametrize(
    ("turn", "by"),
    [
        ("x+90", (90, 0, 0)),
        ("y-90", (0, -90, 0)),
        ("z+90", (0, 0, 90)),
        ("x-90", (-90, 360, 0)),
        ("none", (0, 0, -360)),
    ],
)
def test_a_quarter_turn_by_angles_is_the_same_as_a_turn(route, turn, by):
    turned, by_angles = (awiwi_gen.Hand.parse(chain({}, each, {})) for each in ({"turn": f'"{turn}"'}, rpy(*by)))

    for family in ("mass_matrix", "fingertip_pose"):
        assert graph(by_angles, family, route) == graph(turned, family, route)


def test_a_turn_that_angles_undo_is_none():
    undone = awiwi_gen.Hand.parse(chain({}, {"turn": '"x+90"'} | rpy(-90), {}))

    assert graph(undone, "mass_matrix") == graph(awiwi_gen.Hand.parse(chain({}, {}, {})), "mass_matrix")


def test_a_rotation_about_three_axes_costs_no_more_than_one_about_x():
    about_x, about_all = (
        awiwi_gen.Hand.parse(chain({}, *links))
        for links in ([rpy(37), rpy(-52), rpy(71)], [rpy(37, 20, -12), rpy(-52, 33, 9), rpy(71, -8, 25)])
    )

    for family in ("mass_matrix", "gravity", "fingertip_pose"):
        assert operations(about_all, family) <= 1.1 * operations(about_x, family)  # it was 1.7 with three rotations


def test_parallel_axes_of_links_that_are_drawn_rotated_stay_a_planar_chain():
    straight, drawn = (awiwi_gen.Hand.parse(chain({}, *[rpy(yaw=yaw)] * 3)) for yaw in (0, 35))

    assert operations(drawn, "mass_matrix") <= operations(straight, "mass_matrix") + 3  # one addition for each angle


def test_constants_of_rotations_leave_no_residue_in_the_graph(skew):
    constants = [node[1] for node in graph(skew, "bias").nodes if node[0] == "const"]

    assert min(abs(float(value)) for value in constants if value) > 1e-30


def test_the_palm_pose_is_the_fingertips_behind_the_base(lib, finger):
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = roll_pitch_yaw(vector(finger.base.rpy)), vector(finger.base.position)

    for q in angles(lib):
        assert np.abs(lib.claw_palm_pose(q) - base @ poses(finger, q)[-1]).max() < 2e-15


def test_gravity_of_the_palm_comes_in_the_axes_of_the_fingers_base(lib, finger):
    g = np.array([1.0, -9.0, 4.0])

    assert lib.claw_palm_gravity(g) == pytest.approx(roll_pitch_yaw(vector(finger.base.rpy)).T @ g, rel=1e-15)


def test_a_base_of_quarter_turns_rotates_gravity_by_signs_alone():
    placed = graph(awiwi_gen.Hand.parse(chain({}, base=BASE)), "palm_gravity")

    assert {node[0] for node in placed.nodes} == {"input"}


def test_only_fingers_with_a_base_have_kernels_of_the_palm():
    assert not any("palm" in each.name for each in catalog(awiwi_gen.Hand.parse(chain({}))))


@pytest.mark.parametrize("links", [12, 20, 32])
def test_long_chains_are_read(links):
    assert len(awiwi_gen.Hand.parse(chain(*[rpy(10, 5)] * links)).fingers["arm"].joints) == links


def test_a_joint_may_turn_several_times():
    spool = awiwi_gen.Hand.parse(chain({"low": '"-1080 deg"', "high": '"1440 deg"'}))
    assert kernel(spool, "mass_matrix").inputs["q"].high == pytest.approx([8 * np.pi])

    with pytest.raises(InputError, match='high = "2000 deg" is not plausible'):
        awiwi_gen.Hand.parse(chain({"high": '"2000 deg"'}))


def test_names_of_joints_may_have_63_characters():
    name = "interphalangeal_joint_of_the_little_finger_about_its_skew_axis_"
    text = chain({}).replace("j0", name[:62] + "z")

    assert [*map(len, awiwi_gen.Hand.parse(text).fingers["arm"].joints)] == [63]
    with pytest.raises(InputError, match="at most 63 in all"):
        awiwi_gen.Hand.parse(text.replace(name[:62] + "z", name[:62] + "zz"))


@pytest.mark.parametrize("pitch", [90, -90])
@pytest.mark.parametrize("turn", ["none", "x+90"])
def test_both_derivations_agree_on_a_quarter_turn_between_two_other_angles(pitch, turn):
    hand = awiwi_gen.Hand.parse(chain({}, {**rpy(5, pitch, -7), "turn": f'"{turn}"'}, {}))
    found = records(hand, ("fingertip_pose", "mass_matrix"))

    assert max(record.agreement for record in found.values()) < 1e-60


def is_skew_chain(text):
    found = kernel(awiwi_gen.Hand.parse(text), "bias")
    finger = found.part.symbolic(lambda path, _: ca.SX.sym(path))
    return skew_chain(finger, ca.SX.sym("q", found.inputs["q"].size)) is not None


def test_chains_of_axes_askew_are_those_without_quarter_turns_followers_slides_and_four_bars():
    assert is_skew_chain(chain(*MIXED))
    assert is_skew_chain(chain({"turn": '"x+90"'}, rpy(0, 40)))  # where the finger stands does not matter
    assert is_skew_chain(chain({}, rpy(40, 0, 10) | {"turn": '"x+90"'}))
    for link in ({}, rpy(yaw=30), {"turn": '"x+90"'}, rpy(5, 90, -7), TURNED_TWICE):
        assert not is_skew_chain(chain({}, rpy(40), link))
    assert not is_skew_chain(chain({}))
    assert not is_skew_chain(SKEW_FINGER.read_text(encoding="utf-8"))


def test_two_axes_that_only_the_numbers_put_at_a_right_angle_divide_nothing_by_zero():
    found = records(awiwi_gen.Hand.parse(chain({}, TURNED_TWICE)), ("inverse_dynamics", "forward_dynamics"))

    assert max(record.agreement for record in found.values()) < 1e-60


@pytest.mark.parametrize(
    ("family", "of_five", "further"),
    [
        ("mass_matrix", 400, 190),
        ("gravity", 112, 28),
        ("bias", 538, 143),
        ("inverse_dynamics", 567, 144),
        ("forward_dynamics", 1013, 382),
    ],
)
def test_operations_of_five_skew_joints_and_of_a_sixth(family, of_five, further):
    five, six = (operations(awiwi_gen.Hand.parse(skew_hand(joints)), family) for joints in (5, 6))

    assert (five, six - five) == (of_five, further)


def test_articulated_bodies_take_as_many_operations_for_each_further_joint(monkeypatch):
    monkeypatch.setattr(recursion, "LONG", 1)
    four, five = (operations(awiwi_gen.Hand.parse(skew_hand(joints)), "forward_dynamics") for joints in (4, 5))

    assert (four, five - four) == (879, 366)


@pytest.mark.parametrize("least", [1, 9])
def test_both_ways_to_accelerations_agree_with_the_definition(monkeypatch, least):
    """Articulated bodies, and M with the bias: of rotors, springs, damping and friction in a chain of skew axes."""
    monkeypatch.setattr(recursion, "LONG", least)
    found = records(awiwi_gen.Hand.parse(chain(*MIXED)), ("bias", "inverse_dynamics", "forward_dynamics"))

    assert max(record.agreement for record in found.values()) < 1e-60
