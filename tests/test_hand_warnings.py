"""Warnings: numbers that are possible, but that hardly any body of that size and mass has."""

from __future__ import annotations

from pathlib import Path

import pytest

from awiwi_gen.hand import Hand

TESTS = Path(__file__).parent
ONE_FINGER = (TESTS / "one_finger.toml").read_text(encoding="utf-8")
CLAW = TESTS.parent / "examples" / "claw.toml"
ROOT = 'xx = "60 g mm^2", yy = "400 g mm^2", zz = "405 g mm^2", xy = "3 g mm^2", xz = "-2 g mm^2", yz = "1 g mm^2"'


@pytest.fixture
def warned(tmp_path):
    """(line, key, message, ratio) of every warning about the small hand, with one or more texts replaced."""

    def load(*changes: tuple[str, str]) -> list[tuple[int | None, str | None, str, float | None]]:
        text = ONE_FINGER
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        file = tmp_path / "hand.toml"
        file.write_text(text, encoding="utf-8")
        warnings = Hand.review(file)[1]
        assert all(warning.file == str(file) for warning in warnings)
        return [(warning.line, warning.key, warning.message, warning.ratio) for warning in warnings]

    return load


def test_hands_of_usual_numbers_have_no_warnings(warned):
    assert warned() == []
    assert Hand.review(CLAW)[1] == []


def test_the_tip_of_the_packaged_index_that_is_shorter_than_its_body_warns():
    com, inertia = Hand.review()[1]

    assert com.key == "fingers.index.links[3].com"
    assert com.ratio == pytest.approx(
        6.00673 / 2.12841, rel=1e-4
    )  # com (8, 0.2, -0.3) mm beside a bone (2.01, 0, -0.7) mm
    assert com.message.startswith("lies 6.01 mm beside a bone of 2.13 mm: 2.82 times its length")
    assert inertia.key == "fingers.index.links[3].inertia"
    assert all(each.message.endswith("offset is probably 10 times too small") for each in (com, inertia))
    assert all(each.line for each in (com, inertia))


def test_a_centre_of_mass_far_from_the_bone_warns(warned):
    ((line, key, message, ratio),) = warned(('com = ["15 mm"', 'com = ["900 mm"'))

    assert (line, key, ratio) == (34, "fingers.jaw.links[0].com", pytest.approx(29))
    assert message == "lies 870 mm beside a bone of 30 mm: 29 times its length"  # 9 mm or 90 mm: no slip is certain


def test_a_radius_of_gyration_beyond_the_link_warns(warned):
    ((line, key, message, ratio),) = warned((ROOT, ROOT.replace("g mm^2", "kg mm^2")))

    assert (line, key) == (35, "fingers.jaw.links[0].inertia")
    assert ratio == pytest.approx(294.1 / 30, rel=1e-3)  # sqrt(865e-6 / 2 / 5e-3) m
    assert "a radius of gyration of 294 mm, 9.8 times the length of a bone of 30 mm" in message


def test_kilograms_for_grams_warn_and_the_slip_is_named(warned):
    ((_, key, message, ratio),) = warned(('mass = "5 g"', 'mass = "5 kg"'))

    assert (key, ratio) == ("fingers.jaw.links[0].inertia", pytest.approx(0.0098, rel=1e-2))
    assert message.endswith("mass is probably 1000 times too large")


def test_a_body_denser_than_lead_warns(warned):
    ((_, key, message, ratio),) = warned(('mass = "5 g"', 'mass = "0.15 kg"'))

    assert key == "fingers.jaw.links[0].mass"
    # sqrt(865 / 2 / 150) = 1.70 mm of gyration: a ball of 2.19 mm, 44.1 mm^3
    assert ratio == pytest.approx(0.15 / 44.1e-9 / 12e3, rel=5e-3)
    assert "times as dense as lead or more" in message


def test_a_body_lighter_than_foam_warns(warned):
    light = ROOT.replace("g mm^2", "ug mm^2")
    ((_, key, message, _),) = warned(('mass = "5 g"', 'mass = "5 ug"'), (ROOT, light))

    assert key == "fingers.jaw.links[0].mass"
    assert "lighter than foam" in message


def test_an_inertia_about_the_joint_warns(warned):
    about_joint = ROOT.replace('"400 ', '"1525 ').replace('"405 ', '"1530 ')  # 5 g (15 mm)^2 = 1125 g mm^2 more
    ((line, key, message, ratio),) = warned((ROOT, about_joint))

    assert (line, key) == (35, "fingers.jaw.links[0].inertia")
    assert message.startswith("looks as if it were about the joint; expected about the centre of mass")
    assert ratio == pytest.approx((1497.5 / 5) ** 0.5 / 30, rel=1e-3)


@pytest.mark.parametrize(("radius", "ratio"), [("700 mm", 700 / 30), ("0.5 mm", 0.5 / 30)])
def test_a_pulley_out_of_proportion_warns(warned, radius, ratio):
    ((line, key, message, found),) = warned(('"9 mm"', f'"{radius}"'))

    assert (line, key, found) == (16, "fingers.jaw.pulleys[0].radius", pytest.approx(ratio))
    assert message.startswith(f'= "{radius}" is ')


def test_radians_written_as_degrees_warn(warned):
    ((line, key, message, ratio),) = warned(
        ('low = "-5 deg"', 'low = "0 deg"'), ('high = "90 deg"', 'high = "1.57 deg"')
    )

    assert (line, key, ratio) == (50, "fingers.jaw.links[1].low", pytest.approx(1.57 / 5))
    assert message == '= "0 deg" leaves a range of 1.57 deg up to high = "1.57 deg"; 90 deg if rad was meant'


def test_degrees_written_as_radians_warn_or_are_refused_with_the_angle_that_is_meant(warned):
    ((_, _, message, ratio),) = warned(('low = "-5 deg"', 'low = "-2 rad"'), ('high = "90 deg"', 'high = "5 rad"'))

    assert message == '= "-2 rad" leaves a range of 401 deg up to high = "5 rad"; 7 deg if deg was meant'
    assert ratio == pytest.approx(401.07 / 270, rel=1e-4)
    with pytest.raises(ValueError, match=r'= "90 rad" is not plausible; .*; did you mean "90 deg"'):
        warned(('high = "90 deg"', 'high = "90 rad"'))


def test_links_that_are_all_wrong_alike_have_one_cause(warned):
    heavy = [(f'mass = "{mass} g"', f'mass = "{mass} kg"') for mass in (5, 4, 2)]
    found = warned(*heavy)

    assert [key for _, key, _, _ in found] == [f"fingers.jaw.links[{i}].inertia" for i in range(3)]
    cause = "3 of 3 links are like this: mass is probably 1000 times too large everywhere"
    assert all(message.endswith(cause) for _, _, message, _ in found)
