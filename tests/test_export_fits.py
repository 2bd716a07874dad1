"""What the export fits: four-bars, lever springs and the wrist in MJCF, and motors that wind tendons up."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from commands import complaint
from exported_mjcf import numbers, read_mjcf, rotation

from awiwi_gen.hand import Hand
from awiwi_gen.hand.lever import Lever
from awiwi_gen.hand.pose import Chain
from awiwi_gen.interchange import export_mjcf, export_urdf
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.fits import coupler_fit, coupler_motion, elongation_curve, polynomial, spring_fit

HERE = Path(__file__).parent


def parsed(text: str) -> ElementTree.Element:
    return ElementTree.fromstring(text)  # noqa: S314 our own


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.load()


def losses(found) -> dict[str, tuple[str, ...]]:
    return {loss.what.split(":")[0]: loss.places for loss in found}


# -- fits ------------------------------------------------------------------------------------------------------------


def test_a_polynomial_is_found_again_with_no_error():
    x = np.linspace(0.1, 0.9, 30)
    fit = polynomial(x, 2 * (x - 0.2) - 3 * (x - 0.2) ** 3, range(1, 4), 0.2)

    assert fit.coefficients == pytest.approx((0, 2, 0, -3), abs=1e-12)
    assert fit.error < 1e-14


def test_more_powers_are_never_worse(hand):
    errors = [coupler_fit(hand.fingers["fifth"].links[0], degree).error for degree in (1, 2, 3, 4)]

    assert errors == sorted(errors, reverse=True)


def test_the_error_is_the_greatest_distance_from_the_linkage(hand):
    link = hand.fingers["fifth"].links[0]
    fit, q = coupler_fit(link, 4), np.linspace(float(link.low), float(link.high), 1234)
    missed = np.polynomial.Polynomial(fit.coefficients)(q) - coupler_motion(link.four_bar, 0.0, q)

    assert abs(missed).max() == pytest.approx(fit.error, rel=1e-3)


def test_a_lever_spring_rises_from_zero_and_is_off_by_its_error(hand):
    stretch, force = elongation_curve(Lever(hand.spring), 60000.0)
    fit = spring_fit(stretch, force)
    curve = np.polynomial.Polynomial(fit.coefficients)
    x = np.linspace(0, stretch[-1] - fit.origin, 500)

    assert curve(0) == 0
    assert (np.diff(curve(x)) > 0).all()
    assert abs(curve(stretch - fit.origin) - force).max() == pytest.approx(fit.error, rel=1e-12)
    assert fit.error < 0.01 * force[-1]


# -- four-bars -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("low", ["-30 deg", "5 deg"])  # the coupler counts from the angle that is nearest to zero
def test_crank_and_coupler_stand_as_the_linkage_does(low):
    text = (HERE.parent / "awiwi_gen" / "hand.toml").read_text(encoding="utf-8")
    hand = Hand.parse(text.replace('low = "-30 deg"\nhigh = "40 deg"', f'low = "{low}"\nhigh = "40 deg"'))
    link = hand.fingers["fifth"].links[0]
    assert float(link.low) == pytest.approx(np.radians(float(low.split()[0])))
    model = read_mjcf(export_mjcf.text_and_losses(hand)[0])
    crank, coupler = (next(j for j in model.joints if j.name == f"fifth_hmc{end}") for end in ("", ".coupler"))
    assert crank.body == coupler.body
    axes, origin = model.poses[crank.body]
    base_axes, base = model.poses[model.find("fifth.base")]
    grid = np.linspace(float(link.low), float(link.high), 7)
    for angle, chi in zip(grid, coupler_motion(link.four_bar, float(link.start), grid), strict=True):
        _, (expected_axes, expected) = next(iter(Chain(hand.fingers["fifth"]).frames([angle, 0, 0, 0])))
        moved, place = np.eye(3), np.zeros(3)
        for joint, value in ((crank, angle - crank.reference), (coupler, chi)):
            turn = rotation(np.array([np.cos(value / 2), *(np.sin(value / 2) * joint.axis)]))
            place = place + moved @ (joint.anchor - turn @ joint.anchor)
            moved = moved @ turn
        assert base_axes.T @ (origin + axes @ place - base) == pytest.approx(np.array(expected), abs=1e-14)
        assert base_axes.T @ axes @ moved == pytest.approx(np.array(expected_axes).T, abs=1e-14)


def test_a_urdf_has_a_mimic_joint_for_the_coupler(hand):
    text, found = export_urdf.text_and_losses(hand)
    mimic = next(j for j in parsed(text).findall("joint") if j.get("name") == "fifth_hmc.coupler").find("mimic")
    line = np.polynomial.Polynomial([float(mimic.get("offset")), float(mimic.get("multiplier"))])
    link = hand.fingers["fifth"].links[0]
    q = np.linspace(float(link.low), float(link.high), 1234)

    missed = abs(line(q) - coupler_motion(link.four_bar, 0.0, q)).max()
    assert losses(found)["four-bars"] == (f"fifth hmc by {missed:.2g} rad",)


# -- motors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("motors", ["torque", "position"])
def test_a_motor_winds_its_tendon_up_through_the_spring(hand, motors):
    root = parsed(export_mjcf.text_and_losses(hand, motors)[0])
    radius = float(hand.motor.pulley)
    (actuator,) = (each for each in root.find("actuator") if each.get("name") == "index.tendon2.motor")
    (tendon,) = (each for each in root.find("tendon") if each.get("name") == "index.tendon2")
    (shaft,) = (each for each in root.iter("joint") if each.get("name") == "index.tendon2.shaft")
    inertia = float(hand.motor.rotor_inertia) * float(hand.motor.gear_ratio) ** 2 + float(hand.motor.gear_inertia)

    assert actuator.tag == {"torque": "motor", "position": "position"}[motors]
    assert float(actuator.get("gear")) == 1 / radius
    assert tendon.find("joint[@joint='index.tendon2.shaft']").get("coef") == "1"
    assert len(numbers(tendon.get("stiffness"))) == 3
    assert (float(shaft.get("armature")) + 1e-9) * radius**2 == pytest.approx(inertia, rel=1e-12)


def test_a_straight_tendon_has_a_branch_to_its_shaft(hand):
    root = parsed(export_mjcf.text_and_losses(hand, "torque")[0])
    (tendon,) = (each for each in root.find("tendon") if each.get("name") == "thumb.tendon3")

    assert [each.tag for each in tendon] == ["site", "site", "pulley", "site", "site"]
    low, rest = numbers(tendon.get("springlength"))
    length = Chain(hand.fingers["thumb"]).length(3, [0, 0, 0, 0])
    assert low < 0 < rest < 1 + length


def test_a_hand_without_motors_says_what_it_lacks(tmp_path):
    words = ["export", "mjcf", "--hand", HERE / "exported_finger.toml", "-o", tmp_path / "x.xml", "--motors"]

    assert "the hand has no [motor] whose torque" in complaint(*words, "torque")
    assert "--motors hydraulic is none" in complaint(*words, "hydraulic")
    assert (
        complaint("export", "urdf", "--motors", "force")
        == "--motors force: URDF has no motors to choose; expected mjcf"
    )
    assert not list(tmp_path.iterdir())


def test_position_motors_without_springs_act_on_tendons_and_only_pull():
    text, _ = export_mjcf.text_and_losses(Hand.load(HERE / "exported_finger.toml"), "position")
    actuators = list(parsed(text).find("actuator"))

    assert {each.tag for each in actuators} == {"position"}
    assert {each.get("forcerange") for each in actuators} == {"-100 0"}


# -- the wrist -------------------------------------------------------------------------------------------------------


def test_the_bars_of_the_wrist_are_drawn_in_the_neutral_pose(hand):
    text, found = export_mjcf.text_and_losses(hand)
    model = read_mjcf(text)
    sites = {site.name: model.poses[site.body][1] + site.position for site in model.sites}

    for bar, ends in (("cc0", (hand.wrist.b, None)), ("aa0", (hand.wrist.a, hand.wrist.a0))):
        end = np.array([float(x) for x in ends[0]]) * ([1, 0, 1] if bar == "cc0" else 1)
        assert sites[f"wrist.{bar}.palm"] == pytest.approx(end, abs=1e-16)
    assert len(parsed(text).findall("equality/tendon")) == 2
    assert losses(found)["bars of the wrist"] == ("cc0", "aa0")


def test_runs_through_the_wrist_are_tendons_with_motors_behind_those_of_the_fingers(hand):
    text, found = export_mjcf.text_and_losses(hand)
    model, root = read_mjcf(text), parsed(text)
    (start, end) = next(each.path for each in model.tendons if each.name == "wrist.run7")
    names = [each.get("tendon") for each in root.findall("actuator/motor")]

    for place, origin, point in (
        (start, (0, 0, 0), hand.wrist.tendons[7].forearm),
        (end, hand.wrist.palm, hand.wrist.tendons[7].palm),
    ):
        axes, position = model.poses[place.body]
        wanted = [float(a) + float(b) for a, b in zip(origin, point, strict=True)]
        assert position + axes @ place.at == pytest.approx(wanted, abs=1e-16)
    assert names[-38:] == [f"wrist.run{number}" for number in range(38)]
    assert losses(found)["runs of tendons through the wrist"] == tuple(f"wrist.run{number}" for number in range(38))
    wound = parsed(export_mjcf.text_and_losses(hand, export_mjcf.MOTORS[1])[0])
    assert not [each for each in wound.findall("actuator/*") if "run" in each.get("name")]
    assert len([each for each in wound.findall("tendon/spatial") if "run" in each.get("name")]) == 38


def test_the_fingers_on_a_wrist_of_bars_come_back(hand):
    again = draft(read_mjcf(export_mjcf.text_and_losses(hand)[0]))

    assert [finger.name for finger in again.fingers] == list(hand.fingers)
    assert again.palm == "palm"
