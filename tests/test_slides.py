"""Joints that slide: where they lead, what they weigh, units of mixed arrays, and what is refused or left out."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import random_hands
from hand_numbers import fingers_of, gravity_torque, link_angles, mass_matrix, poses, tendon_lengths

import awiwi_gen
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.hand.capability import left_out_names
from awiwi_gen.hand.pose import Chain
from awiwi_gen.interchange import export_urdf
from awiwi_gen.kernels import catalog
from awiwi_gen.pipeline import Job, cached_tree, verify

HERE = Path(__file__).parent
SLIDING, TELESCOPE = (HERE / f"{name}_finger.toml" for name in ("sliding", "telescope"))
TEXT = SLIDING.read_text(encoding="utf-8")
G = np.array([3.0, -7.0, 6.0])  # m/s^2
INERTIA = '{ xx = "40 g mm^2", yy = "50 g mm^2", zz = "60 g mm^2", xy = "0 g mm^2", xz = "0 g mm^2", yz = "0 g mm^2" }'


@pytest.fixture(scope="module")
def sliding():
    return Hand.load(SLIDING)


@pytest.fixture(scope="module")
def lib(sliding):
    return awiwi_gen.build(sliding, only="claw_[bcfgilmp]*,claw_energy,claw_tendon_lengths,claw_joint_torque")


@pytest.fixture(scope="module")
def numbers():
    return fingers_of(TEXT)["claw"]


def states(lib, count=50):
    port, random = lib.claw_bias.inputs[0], np.random.default_rng(3)
    q = random.uniform(port["low"], port["high"], (count, len(port["low"])))
    return q, random.uniform(-1, 1, q.shape) * [0.5, 20, 20], random.uniform(-1, 1, q.shape) * [50, 2000, 2000]


def test_a_positive_position_moves_a_slide_along_its_z_axis(lib):
    q = np.array([0.004, 0.3, 0.2])
    before, after = (lib.claw_link_poses(q + np.array([step, 0, 0])) for step in (0, 0.01))

    assert np.array_equal(after[:, :3, :3], before[:, :3, :3])
    assert after[:, :3, 3] - before[:, :3, 3] == pytest.approx(np.tile(0.01 * before[0, :3, 2], (3, 1)), abs=1e-17)


def test_links_and_tendons_are_where_multiplication_puts_them(lib, numbers):
    for q in states(lib)[0]:
        frames = poses(numbers, link_angles(numbers, q))
        for found, (axes, origin) in zip([*lib.claw_link_poses(q), lib.claw_fingertip_pose(q)], frames, strict=True):
            assert found[:3, :3] == pytest.approx(axes, abs=1e-15)
            assert found[:3, 3] == pytest.approx(origin, abs=1e-16)
        assert lib.claw_tendon_lengths(q) == pytest.approx(tendon_lengths(numbers, q), abs=1e-16)


def test_masses_and_weights_are_those_of_the_bodies(lib, numbers):
    for q in states(lib)[0]:
        assert lib.claw_mass_matrix(q) == pytest.approx(mass_matrix(numbers, q), rel=1e-12, abs=1e-20)
        assert lib.claw_gravity(q, G) == pytest.approx(gravity_torque(numbers, q, G), rel=1e-12, abs=1e-16)


def test_a_pendulum_on_a_cart_moves_as_in_the_textbook():
    cart, ball, length = 0.3, 0.05, 0.04
    links = "".join(
        f'[[fingers.claw.links]]\njoint = "{joint}"\n{more}mass = "{mass} kg"\ninertia = {INERTIA}\nsource = "drawn"\n'
        for joint, more, mass in (
            ("cart", 'kind = "slide"\nturn = "y+90"\nlow = "-1 m"\nhigh = "1 m"\noffset = ["0 mm", "0 mm", "0 mm"]\n'
                     'com = ["0 mm", "0 mm", "0 mm"]\n', cart),
            ("arm", f'turn = "y-90"\nlow = "-170 deg"\nhigh = "170 deg"\noffset = ["{length} m", "0 mm", "0 mm"]\n'
                    f'com = ["{length} m", "0 mm", "0 mm"]\n', ball),
        )
    )  # fmt: skip
    head = TEXT[: TEXT.index("[fingers.claw]")]
    lib = awiwi_gen.build(Hand.parse(head + links), only="claw_dynamics,claw_forward_dynamics")
    for x, angle, speed in ((0.1, 0.3, 2.0), (-0.4, -2.5, -7.0)):
        c, s = math.cos(angle), math.sin(angle)
        M, C, gravity = lib.claw_dynamics([x, angle], [0.2, speed], [0, -9.81, 0])

        inertia = 60e-9 + ball * length**2
        assert M.ravel() == pytest.approx([cart + ball, -ball * length * s, -ball * length * s, inertia], abs=1e-16)
        assert C.ravel() == pytest.approx([0, -ball * length * c * speed, 0, 0], abs=1e-16)
        assert gravity == pytest.approx([0, 9.81 * ball * length * c], abs=1e-16)
        qdd = lib.claw_forward_dynamics([x, angle], [0.2, speed], [1.5, 0.01], [0, -9.81, 0])
        assert M @ qdd + C @ [0.2, speed] + gravity == pytest.approx([1.5, 0.01], abs=1e-13)


def test_forces_of_damping_friction_and_a_spring_act_on_the_slide(lib):
    passive = lib.claw_passive_torque([0.015, 0.2, 0.1], [0.04, 1.0, 0.0])

    force = 0.4 * 0.04 + 0.3 * 2 / math.pi * math.atan(0.04 / 0.002) + 120 * (0.015 - 0.005)
    assert passive == pytest.approx([force, 0.002, 0.0], rel=1e-14)


def test_derivatives_of_the_inverse_dynamics_are_those_of_differences(lib):
    q, qd, qdd = (each[0] for each in states(lib))
    found = lib.claw_inverse_dynamics_derivatives(q, qd, qdd, G).dtau_dq
    for joint, step in enumerate((1e-6, 1e-5, 1e-5)):
        ends = [lib.claw_inverse_dynamics(q + sign * step * np.eye(3)[joint], qd, qdd, G) for sign in (1, -1)]
        assert found[:, joint] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6, abs=1e-9)


def test_each_element_has_the_unit_of_its_joint(sliding):
    kernels = {kernel.family: kernel for kernel in catalog(sliding)}

    def units(family, port):
        return [str(unit) for unit in {**kernels[family].inputs, **kernels[family].outputs}[port].units]

    assert units("mass_matrix", "q") == ["m", "rad", "rad"]
    assert units("mass_matrix", "M") == ["kg", "kg m", "kg m", "kg m", "kg m^2", "kg m^2", "kg m", "kg m^2", "kg m^2"]
    assert units("inverse_dynamics", "tau") == ["N", "N m", "N m"]
    assert units("joint_stiffness", "K")[:4] == ["N/m", "N/rad", "N/rad", "N"]
    assert units("coriolis_matrix", "C")[:4] == ["N s/m", "N s/rad", "N s/rad", "N s"]
    assert units("coupling", "P")[:3] == ["1", "m/rad", "m/rad"]
    assert units("jacobian", "J")[::9] == ["1", "rad/m"]
    assert units("joint_estimate_error", "covariance")[:2] == ["m^2", "m rad"]
    assert kernels["mass_matrix"].inputs["q"].unit_text == "m, rad"
    assert "element 0 (rail) is of a slide: in m for rad, and N for N m." in kernels["mass_matrix"].doc
    assert kernels["inverse_dynamics"].inputs["qd"].bounds() == [(-0.5, 0.5), (-20.0, 20.0), (-20.0, 20.0)]
    assert kernels["forward_dynamics"].inputs["tau"].bounds()[0] == (-50.0, 50.0)


@pytest.mark.parametrize("options", [Options(), Options(params="runtime"), Options(scalar="f32")], ids=str)
@pytest.mark.parametrize("path", [SLIDING, TELESCOPE], ids=lambda path: path.stem)
def test_kernels_of_slides_are_proved(path, options):
    hand = Hand.load(path)
    (finger,) = hand.fingers
    job = Job(hand, options=options, only=f"{finger}_[bcefgimp]*,hand_coupling")
    report = verify(job, cached_tree(job))

    assert report.passed
    assert len(report.laws) > 10


def test_forces_for_a_stiffness_are_left_out_with_the_slide_that_prevents_them(sliding):
    assert left_out_names(sliding) == {
        "claw_tendon_distribution": "the joint rail slides: its stiffness has another unit than that of a hinge"
    }


def test_estimates_of_a_slide_beside_a_hinge_converge_where_lengths_contradict_each_other():
    text = random_hands.hand(
        3, 2, {"slides", "passive joints", "rotors", "skew axes", "references", "few tendons", "paths"}
    )
    job = Job(Hand.parse(text), only="one_joint_estimate")

    assert "slides" in random_hands.kinds(text)
    assert verify(job, cached_tree(job)).passed


def test_a_search_for_the_base_over_a_slide_is_left_out():
    spans = "".join(
        f'    {{ rest = "0 mm", span = {{ from = ["{x} mm", "9 mm", "0 mm"], to = ["0 mm", "3 mm", "1 mm"], '
        f'joint = "flexion" }}, source = "assumed" }},\n'
        for x in (-10, 15)
    )
    hand = Hand.parse(TEXT.replace("tendons = [\n", f"tendons = [\n{spans}"))

    assert "a gradient search has no step" in left_out_names(hand)["claw_base_estimate_by_gradient"]


def test_couplings_in_plain_floats_are_central_differences_of_lengths():
    chain = Chain(Hand.load(TELESCOPE).fingers["arm"])
    q, step = [0.2, 0.011], np.array([1e-4, 1e-6])
    for tendon, row in enumerate(chain.coupling(q)):
        for joint in range(2):
            ends = [chain.length(tendon, list(np.array(q) + sign * step * np.eye(2)[joint])) for sign in (1, -1)]
            assert row[joint] == pytest.approx((ends[0] - ends[1]) / (2 * step[joint]), rel=1e-5, abs=1e-9)


def test_a_urdf_has_prismatic_joints_with_force_and_mimics():
    text = export_urdf.text_and_losses(Hand.load(TELESCOPE))[0]
    joints = {each.get("name"): each for each in ElementTree.fromstring(text).iter("joint")}  # noqa: S314 our own

    assert joints["arm_inner"].get("type") == "prismatic"
    assert joints["arm_pinion"].get("type") == "revolute"
    assert joints["arm_outer"].find("limit").attrib == {
        "lower": "0.0006000000000000001", "upper": "0.023", "effort": "80", "velocity": "0.3"
    }  # fmt: skip
    assert joints["arm_outer"].find("mimic").get("multiplier") == "0.8"
    place = [float(word) for word in joints["arm_outer"].find("origin").get("xyz").split()]
    assert place == pytest.approx([0, 0.001, 0.014 - 0.001], abs=1e-17)  # 1 mm before where it is drawn


FAULTS = {
    "an effort": ('kind = "slide"', 'kind = "slide"\neffort = "1 N m"', 'effort = "1 N m" is a torque; expected a force'),
    "a sensor": ('kind = "slide"', 'kind = "slide"\nsensor = { resolution = "1 deg" }',
        'resolution = "1 deg" is an angle; expected a length'),
    "an angle at a slide": ('high = "25 mm"', 'high = "25 deg"',
        '.links[0].high = "25 deg" is an angle; expected a length such as "12 mm", for the joint slides'),
    "a length at a hinge": ('high = "80 deg"', 'high = "80 mm"',
        '.links[1].high = "80 mm" is a length; expected an angle such as "20 deg", for the joint turns'),
    "no end": ('high = "25 mm"\n', "", '.links[0].high is missing; expected a length such as "12 mm"'),
    "a short travel": ('low = "-3 mm"', 'low = "24.9999 mm"', 'leaves a range of 0.0001 mm from low = "24.9999 mm"'),
    "an inertia of a slide": ('armature = "15 g"', 'armature = "15 g mm^2"',
        '.links[0].armature = "15 g mm^2" is a moment of inertia; expected a mass such as "20 g"'),
    "damping of a hinge": ('damping = "0.4 N s/m"', 'damping = "0.4 N m s/rad"', "expected a damping such as"),
    "a torque of friction": ('{ force = "0.3 N"', '{ torque = "0.3 N m"',
        '.links[0].friction.torque is at a joint that slides; expected "force"'),
    "no force of friction": ('{ force = "0.3 N", ', "{ ", ".links[0].friction.force is missing"),
    "a spring of a hinge": ('"120 N/m"', '"120 N m/rad"', ".links[0].spring.stiffness"),
    "a kind that is none": ('kind = "slide"', 'kind = "ball"', '.links[0].kind = "ball"'),
    "a pulley": ('joint = "flexion", radius', 'joint = "rail", radius',
        '.pulleys[0].joint = "rail" slides and has no pulley; expected arms = { rail = "1" } of the tendons'),
    "a tendon over a slide": ('["-flexion"]', '["-rail"]', '.tendons[1].over[0] = "-rail" slides and has no pulley'),
    "a length for an arm": ('arms = { rail = "-1" }', 'arms = { rail = "-1 mm" }',
        '.tendons[0].arms.rail = "-1 mm" is a length; expected a plain number such as "1", for the joint slides'),
    "a plain arm of a hinge": ('end = "4 mm"', 'end = "4"',
        '.tendons[1].arms.end = "4" is a plain number; expected a length'),
    "no limit": ('slide_force = "50 N"\n', "",
        'limits.slide_force is missing; expected a force such as "50 N", because the joint rail of claw slides'),
    "a four-bar": ('armature = "15 g"\n', 'four_bar = { ground = "12 mm", crank = "10 mm", coupler = "7.5 mm", '
        'rocker = "11 mm", reference = "60 deg", branch = 1, source = "assumed" }\n',
        ".links[0].four_bar is at a joint that slides"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), FAULTS.values(), ids=FAULTS)
def test_what_a_slide_cannot_have_is_told(old, new, expected):
    assert old in TEXT
    with pytest.raises(InputError) as caught:
        Hand.parse(TEXT.replace(old, new, 1))
    assert expected in str(caught.value)


def test_a_slide_has_an_effort_and_a_sensor_of_its_own_units():
    own = 'kind = "slide"\neffort = "5 N"\nsensor = { resolution = "0.1 mm", low = "-5 mm", high = "30 mm" }'
    (finger,) = Hand.parse(TEXT.replace('kind = "slide"', own, 1)).fingers.values()
    link = next(link for link in finger.links if link.slides)

    assert float(link.effort) == 5
    assert float(link.sensor.resolution) == pytest.approx(1e-4)


COUPLINGS = {
    "a slide that follows a hinge": ('"3 mm/rad"', '"3"', "is a plain number; expected a length per angle such as"),
    "a hinge that follows a slide": ('"40 rad/m"', '"0.04"', "is a plain number; expected an angle per length such as"),
    "slides": ('"0.8"', '"0.8 mm/rad"', "is a length per angle; expected a plain number such as"),
    "a slide's offset": ('"-1 mm"', '"-1 deg"', "is an angle; expected a length"),
    "no ratio": ('ratio = "0.8", ', "", "has no ratio, but the follower slides and the leader slides"),
}


@pytest.mark.parametrize(("old", "new", "expected"), COUPLINGS.values(), ids=COUPLINGS)
def test_couplings_have_the_units_of_their_joints(old, new, expected):
    text = TELESCOPE.read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(InputError) as caught:
        Hand.parse(text.replace(old, new, 1))
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('high = "25 mm"', 'high = "900 mm"', "leaves a travel of 903 mm"),
        ('armature = "15 g"', 'armature = "90 kg"', "times the mass of all links that this joint moves"),
    ],
)
def test_unusual_slides_have_a_warning(tmp_path, old, new, expected):
    file = tmp_path / "hand.toml"
    file.write_text(TEXT.replace(old, new), encoding="utf-8")

    assert [expected in fault.message for fault in Hand.review(file)[1]] == [True]
