"""Rotors, damping, friction and springs in the joints, and links without mass: where they enter, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from chains import MASSLESS, chain, records, rpy
from commands import ONE_FINGER, complaint
from textbook import armature, joint_torques, passive_torques

import awiwi_gen
from awiwi_gen.emit.options import Options
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, cached_tree, verify

SKEW_FINGER = Path(__file__).with_name("skew_finger.toml")
# The joint of a four-bar, which is the crank, with all that a joint may have.
CRANK = rpy(0, 20, 0) | {
    "four_bar": '{ ground = "12 mm", crank = "10 mm", coupler = "7.5 mm", rocker = "11 mm", reference = "60 deg", '
    'branch = 1, source = "assumed" }',
    "damping": '"0.002 N m s/rad"',
    "friction": '{ torque = "3 N mm", velocity = "0.5 rad/s" }',
    "spring": '{ stiffness = "0.1 N m/rad", reference = "30 deg" }',
}
DYNAMICS = "claw_[befgilmp]*"  # kinematics, dynamics, and the palm
G = np.array([3.0, -7.0, 6.0])  # m/s^2


@pytest.fixture(scope="module")
def skew():
    return awiwi_gen.Hand.load(SKEW_FINGER)


@pytest.fixture(scope="module")
def finger(skew):
    return skew.fingers["claw"]


@pytest.fixture(scope="module")
def lib(skew):
    return awiwi_gen.build(skew, only=DYNAMICS)


def states(lib, count=100):
    """Joint angles within their limits, velocities and accelerations, (count, n) each."""
    port, random = lib.claw_bias.inputs[0], np.random.default_rng(3)
    q = random.uniform(port["low"], port["high"], (count, len(port["low"])))
    return q, random.uniform(-20, 20, q.shape), random.uniform(-2000, 2000, q.shape)


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


def test_newton_and_euler_with_rotors_and_passive_torques_agree_with_the_compiled_dynamics(lib, finger):
    q, qd, qdd = states(lib)
    by_hand = np.array([
        joint_torques(finger, *motion, G) + armature(finger) @ motion[2] + passive_torques(finger, *motion[:2])
        for motion in zip(q, qd, qdd, strict=True)
    ])  # fmt: skip

    assert relative(lib.claw_inverse_dynamics(q, qd, qdd, G), by_hand) < 1e-13
    assert relative(lib.claw_bias(q, qd, G), lib.claw_inverse_dynamics(q, qd, 0 * qdd, G)) < 1e-13


def test_rotors_are_on_the_diagonal_of_the_mass_matrix_a_followers_with_the_square_of_its_ratio(lib, finger):
    q, qd, _ = states(lib)
    of_links = np.array([[joint_torques(finger, x, 0 * x, axis, 0 * G) for axis in np.eye(2)] for x in q])

    assert armature(finger)[1, 1] == pytest.approx(15e-9 * (6 / 7) ** 2)
    whole = of_links + armature(finger)
    assert relative(lib.claw_mass_matrix(q), whole) < 1e-13
    assert relative(lib.claw_energy(q, qd, G).kinetic, np.einsum("si,sij,sj->s", qd, whole, qd) / 2) < 1e-13


def test_passive_torques_are_those_of_springs_damping_and_friction(lib, finger):
    q, qd, _ = states(lib)
    by_hand = np.array([passive_torques(finger, *state) for state in zip(q, qd, strict=True)])

    assert relative(lib.claw_passive_torque(q, qd), by_hand) < 1e-14


def test_friction_of_a_fast_joint_is_its_torque_and_at_rest_there_is_none(lib, finger):
    ratio, end, speed = 6 / 7, finger.links[2], 1e6
    spring = -ratio * float(end.spring.stiffness) * float(end.spring.reference)
    damped = ratio**2 * float(end.damping) * speed

    for sign in (1, -1):
        torque = lib.claw_passive_torque([0, 0], [0, sign * speed])[1]
        assert sign * (torque - spring) - damped == pytest.approx(3e-3 + ratio * 1e-3, abs=1e-8)
    assert lib.claw_passive_torque([0, 0], [0, 0]) == pytest.approx([0, spring])


def test_gravity_is_that_of_the_links_alone(lib, finger):
    q, _, _ = states(lib)
    of_links = np.array([joint_torques(finger, x, 0 * x, 0 * x, G) for x in q])

    assert relative(lib.claw_gravity(q, G), of_links) < 1e-13


def test_forward_dynamics_undo_inverse_dynamics(lib):
    q, qd, qdd = states(lib)

    assert relative(lib.claw_forward_dynamics(q, qd, lib.claw_inverse_dynamics(q, qd, qdd, G), G), qdd) < 1e-11


def test_derivatives_of_the_torques_have_those_of_springs_damping_and_friction(lib, finger):
    q, qd, qdd = states(lib, 20)
    found, step = lib.claw_inverse_dynamics_derivatives(q, qd, qdd, G), 1e-30j

    def torques(x, v, a):
        return joint_torques(finger, x, v, a, G) + passive_torques(finger, x, v)

    for name, turn, speed in (("dtau_dq", step, 0j), ("dtau_dqd", 0j, step)):
        by_hand = [
            np.array([torques(x + turn * e, v + speed * e, a + 0j).imag / 1e-30 for e in np.eye(2)]).T
            for x, v, a in zip(q, qd, qdd, strict=True)
        ]
        assert relative(getattr(found, name), np.array(by_hand)) < 1e-13


def test_a_released_joint_loses_the_energy_that_damping_and_friction_take(lib):
    """One second by the classical method of fourth order, whose error is that of the step's fourth power."""

    def rates(state):
        q, qd = state[:2], state[2:4]
        lost = qd @ (lib.claw_passive_torque(q, qd) - lib.claw_passive_torque(q, 0 * qd))
        return np.concatenate([qd, lib.claw_forward_dynamics(q, qd, np.zeros(2), G), [lost]])

    def total(state):
        return sum(lib.claw_energy(state[:2], state[2:4], G))

    first = state = np.array([0.1, 0.9, 0, 0, 0])
    for _ in range(2000):
        k = rates(state)
        l = rates(state + 1e-4 * k)
        m = rates(state + 1e-4 * l)
        state = state + 2e-4 / 6 * (k + 2 * l + 2 * m + rates(state + 2e-4 * m))
    assert state[4] > 1e-3
    assert total(state) + state[4] == pytest.approx(total(first), abs=1e-6 * state[4])


def test_laws_of_physics_hold_for_every_kind_of_joint(skew, lib):
    report = verify(Job(skew, only=DYNAMICS), cached_tree(Job(skew, only=DYNAMICS)))
    laws = {law.statement for law in report.laws if law.passed}

    assert report.passed
    assert {"damping and friction take energy", "the palm pose turns like gravity"} <= laws
    assert "energy changes by the power of the joint torques" in laws


def test_laws_that_would_need_the_passive_torques_are_skipped_without_them(skew, lib):
    job = Job(skew, only="claw_[eg]*")
    report = verify(job, cached_tree(job))

    assert report.passed
    assert "gravity is the gradient of the potential" not in {law.statement for law in report.laws}


def test_numbers_of_joints_may_be_read_at_run_time(skew, lib):
    """Both derivations agree, with these numbers and with others."""
    for name, record in records(
        skew, ("passive_torque", "palm_pose", "mass_matrix"), Options(params="runtime")
    ).items():
        assert record.varied is not None, name
        assert record.function.cost.operations <= 1.3 * lib[f"claw_{name}"].cost["operations"]


def test_a_four_bars_joint_is_its_crank():
    """Both derivations agree, and the crank's rotor counts as it is."""
    with_rotor, without = (
        records(awiwi_gen.Hand.parse(chain(CRANK | each, rpy(10, 20, 30))), ("mass_matrix", "bias", "energy"))
        for each in ({"armature": '"500 g mm^2"'}, {})
    )
    added = with_rotor["mass_matrix"].reference.high["M"] - without["mass_matrix"].reference.high["M"]

    assert added == pytest.approx(np.tile([5e-7, 0, 0, 0], (len(added), 1)), abs=1e-18)


def test_documentation_tells_what_joints_add_and_only_where_they_do(skew):
    docs = {kernel.name: kernel.doc for kernel in catalog(skew)}
    plain = {kernel.name: kernel.doc for kernel in catalog(awiwi_gen.Hand.load(ONE_FINGER))}

    assert "armature" in docs["claw_mass_matrix"]
    assert "damping, friction and springs" in docs["claw_bias"]
    assert not any("armature" in doc or "passive_torque" in doc for doc in plain.values())
    assert "jaw_passive_torque" not in plain


def faults(tmp_path, text):
    path = tmp_path / "hand.toml"
    path.write_text(text)
    return complaint("check", "--hand", path)


def test_a_chain_that_ends_without_mass_needs_armature(tmp_path):
    rotor = {"armature": '"15 g mm^2"'}
    awiwi_gen.Hand.parse(chain({}, MASSLESS | rotor))

    message = faults(tmp_path, chain({}, MASSLESS))
    assert 'fingers.arm.links[1].joint = "j1" moves no inertia of its own at j0 = 10 deg, j1 = 10 deg; ' in message
    assert message.endswith("expected mass, com and inertia for a link that only this joint moves, or armature")


def test_a_rotor_that_outweighs_its_finger_is_remarked(tmp_path):
    path = tmp_path / "hand.toml"
    path.write_text(chain({}, {"armature": '"0.03 kg m^2"'}, {"armature": '"2e-6 kg m^2"'}))
    warnings = awiwi_gen.Hand.review(path)[1]

    assert [warning.key for warning in warnings] == ["fingers.arm.links[1].armature"]
    assert re.search(r'= "0.03 kg m\^2" is [\d.e+]+ times the inertia of all links', warnings[0].message)


def test_a_follower_may_end_the_chain_without_mass(skew):
    head, end = SKEW_FINGER.read_text().rsplit("[[fingers", 1)
    body = re.compile(r"(mass|com|inertia|armature) = .*\n")

    assert awiwi_gen.Hand.parse(head + "[[fingers" + body.sub("", end)).fingers["claw"].links[2].mass is None


def test_joints_of_one_body_whose_axes_fall_together_are_refused_with_the_pose(tmp_path):
    """The first and the last of three joints turn about one axis where the second has turned by 90 degrees."""
    here = MASSLESS | {"offset": '["0 mm", "0 mm", "0 mm"]'}
    first, last = here | {"turn": '"z+90"'}, {"turn": '"y-90"'}
    middle = here | {"turn": '"x+90"', "low": '"-60 deg"', "high": '"60 deg"'}
    awiwi_gen.Hand.parse(chain(first, middle, last))

    message = faults(tmp_path, chain(first, middle | {"high": '"90 deg"'}, last))
    assert "moves no inertia of its own at j0 = 40 deg, j1 = 90 deg, j2 = 40 deg; expected" in message


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('mass = "9 g"\n', "", '.links[1].mass is missing; expected a mass such as "1.5 g" beside com and inertia (a link'),
        ('com = ["19 mm", "1 mm", "-0.5 mm"]\n', "", ".links[1].com is missing; expected a point such as"),
        ('damping = "0.002 N m s/rad"', 'damping = "0.002 N m"', ".links[0].damping = \"0.002 N m\" is"),
        ('damping = "0.002 N m s/rad"', 'damping = "-1 N m s/rad"', ".links[0].damping = \"-1 N m s/rad\" is not plausible"),
        ('velocity = "0.5 rad/s"', 'velocity = "0 rad/s"', ".links[1].friction.velocity = \"0 rad/s\" must be above zero"),
        (', velocity = "0.5 rad/s"', "", ".links[1].friction.velocity is missing; expected an angular velocity"),
        ('stiffness = "0.05 N m/rad"', 'stiffness = "0.1 N/m"', ".links[2].spring.stiffness = \"0.1 N/m\" is"),
        ('armature = "40 g mm^2"', 'armature = "40 g"', ".links[0].armature = \"40 g\" is a mass; expected"),
        ("armature =", "amature =", 'amature is not a known key; did you mean "armature"?'),
        ('["10 deg", "0 deg", "-90 deg"]', '["10 deg", "0 deg"]', ".base.rpy[2] is missing; expected an angle"),
        ("schema = 2", "schema = 3", "schema = 3 is not one of 1 or 2"),
    ],
)  # fmt: skip
def test_a_fault_of_a_joint_is_told_with_its_place(tmp_path, old, new, told):
    text = SKEW_FINGER.read_text()
    assert text.count(old) >= 1
    assert told in faults(tmp_path, text.replace(old, new, 1))


def test_a_reference_at_a_four_bar_is_refused(tmp_path):
    text = Path(ONE_FINGER).read_text().replace('turn = "none"\n', 'turn = "none"\nreference = "5 deg"\n', 1)

    expected = '.links[0].reference = "5 deg" is at a four-bar, whose angles count from four_bar.reference'
    assert expected in faults(tmp_path, text)
