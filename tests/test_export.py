"""Export to MJCF and URDF, read back without either program; what is lost, and files that are never half-written."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import random_hands
from commands import answer, complaint, told
from exported_mjcf import read_mjcf, rotation
from hand_numbers import coordinates, fingers_of, link_angles, poses, rpy_matrix, tendon_lengths

from awiwi_gen.hand import Hand
from awiwi_gen.interchange import export_mjcf, export_urdf
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.frames import about, turn_matrix
from awiwi_gen.interchange.mjcf_elements import quaternion
from awiwi_gen.interchange.toml import hand_text
from awiwi_gen.kernels.fingers_control import distribution

HERE = Path(__file__).parent
HANDS = ["exported_finger.toml", "sliding_finger.toml", "../examples/claw.toml", "../awiwi_gen/hand.toml"]


@pytest.mark.parametrize("name", HANDS)
def test_an_exported_hand_moves_as_the_hand_file_says(name):
    hand = Hand.load(HERE / name)
    before = fingers_of((HERE / name).read_text(encoding="utf-8"))
    after = fingers_of(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(hand)[0]))))
    assert set(after) == set(before)
    random = np.random.default_rng(1)
    for finger, written in after.items():
        if any("four_bar" in link for link in before[finger]["links"]):
            continue  # crank and coupler are two joints there
        assert coordinates(written)[0] == coordinates(before[finger])[0]
        for _ in range(5):
            q = random.uniform(-1, 1, len(coordinates(written)[0]))
            ours, theirs = (poses(each, link_angles(each, q)) for each in (before[finger], written))
            tips = [
                position + axes @ frames[-1][1]
                for (axes, position), frames in ((base_of(before[finger]), ours), (base_of(written), theirs))
            ]
            assert tips[1] == pytest.approx(tips[0], abs=1e-14)


def base_of(finger) -> tuple[np.ndarray, np.ndarray]:
    base = finger.get("base", {"rpy": [0, 0, 0], "position": [0, 0, 0]})
    return rpy_matrix(base["rpy"]), np.array(base["position"])


@pytest.mark.parametrize("name", ["exported_finger.toml", "sliding_finger.toml"])
def test_the_import_of_an_export_is_the_same_hand_again(name):
    first = hand_text(draft(read_mjcf(export_mjcf.text_and_losses(Hand.load(HERE / name))[0])))
    once = Hand.parse(first)
    twice = Hand.parse(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(once)[0]))))

    assert once.fingers["claw"].structure() == twice.fingers["claw"].structure()
    ours, theirs = (hand.fingers["claw"].quantities() for hand in (once, twice))
    for place, number in ours.items():
        assert float(theirs[place]) == pytest.approx(float(number), rel=1e-12, abs=1e-15), place


def test_imported_antagonists_share_their_force_in_closed_form_as_before():
    hand = Hand.load()
    again = Hand.parse(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(hand)[0]))))
    for name in ("index", "middle", "ring"):
        ours, theirs = (each.fingers[name] for each in (hand, again))

        assert [each.structure() for each in theirs.tendons] == [each.structure() for each in ours.tendons]
        assert distribution(theirs).strings == distribution(ours).strings
        assert distribution(theirs).strings["searched_count"] == "0"


def palm_pose(palm, q: np.ndarray) -> np.ndarray:
    """The palm's frame (4 x 4) in that of the forearm."""

    def frame(axes: np.ndarray, origin: np.ndarray) -> np.ndarray:
        return np.block([[axes, origin[:, None]], [np.zeros((1, 3)), np.eye(1)]])

    def metres(point) -> np.ndarray:
        return np.array([float(x) for x in point])

    def turned_by(rpy) -> np.ndarray:
        return rpy_matrix([float(angle) for angle in rpy or (0, 0, 0)])

    pose = frame(turned_by(palm.base.rpy), metres(palm.base.position)) if palm.base else np.eye(4)
    for joint, angle in zip(palm.joints, q, strict=True):
        turned = angle - float(joint.reference or 0)
        axes = turn_matrix(joint.turn) @ turned_by(joint.rpy) @ about(2, turned)
        pose = pose @ frame(axes, np.zeros(3)) @ frame(np.eye(3), metres(joint.offset))
    return pose @ frame(turned_by(palm.rpy), np.zeros(3))


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_wrist_of_joints_in_series_comes_back(seed):
    hand = Hand.parse(random_hands.hand(seed, 2, {"palm", "base", "references"}))
    again = Hand.parse(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(hand)[0]), palm="palm")))
    same = Hand.parse(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(again)[0]), palm="palm")))
    low, high = (np.array(ends) for ends in hand.palm.range)

    np.testing.assert_allclose(again.palm.range, hand.palm.range, rtol=1e-14)
    for share in (0, 0.3, 1):
        q = low + share * (high - low)
        np.testing.assert_allclose(palm_pose(again.palm, q), palm_pose(hand.palm, q), atol=1e-14)
    assert same.palm.structure() == again.palm.structure()


def test_a_urdf_has_the_joints_of_the_wrist_between_forearm_and_palm():
    hand = Hand.parse(random_hands.hand(3, 1, {"palm"}))
    root = ElementTree.fromstring(export_urdf.text_and_losses(hand)[0])  # noqa: S314 our own
    above = {each.find("child").get("link"): each for each in root.findall("joint")}
    road, link = [], "palm"
    while link in above:
        road.append(above[link].get("name"))
        link = above[link].find("parent").get("link")

    assert link == "forearm"
    assert road == ["palm.fixed", *(joint.joint for joint in reversed(hand.palm.joints))]


def test_tendons_of_pulleys_are_as_long_as_the_hand_file_says():
    text = (HERE / "exported_finger.toml").read_text(encoding="utf-8")
    hand = Hand.parse(text)
    written = fingers_of(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(hand)[0]))))["claw"]
    finger = hand.fingers["claw"]
    q = np.array([0.2, 0.4, -0.3])
    angles = dict(zip([link.joint for link in finger.links], coordinates(written)[1] @ q, strict=True))
    expected = [
        sum(float(f"{over[0]}1") * float(finger.radii[over[1:]]) * angles[over[1:]] for over in tendon.over)
        for tendon in finger.tendons
        if tendon.over
    ]
    assert tendon_lengths(written, q)[: len(expected)] == pytest.approx(expected, abs=1e-16)


def test_tendons_of_arms_and_through_points_are_as_long_as_before():
    text = (HERE / "exported_finger.toml").read_text(encoding="utf-8")
    before = fingers_of(text)["claw"]
    after = fingers_of(hand_text(draft(read_mjcf(export_mjcf.text_and_losses(Hand.parse(text))[0]))))["claw"]
    for q in np.random.default_rng(3).uniform(-0.4, 0.4, (5, 3)):
        assert tendon_lengths(after, q)[5:] == pytest.approx(tendon_lengths(before, q)[5:], abs=1e-15)
    assert after["tendons"][-1]["spring"] == before["tendons"][-1]["spring"]


def test_a_path_round_bodies_comes_back_with_its_sides_and_branches():
    hand = Hand.load(HERE / "wrapped_finger.toml").fingers["claw"]
    text = export_mjcf.text_and_losses(Hand.load(HERE / "wrapped_finger.toml"))[0]
    again = Hand.parse(hand_text(draft(read_mjcf(text)))).fingers["claw"]

    assert [tendon.structure() for tendon in again.tendons] == [tendon.structure() for tendon in hand.tendons]
    for ours, theirs in zip(hand.tendons, again.tendons, strict=True):
        for place, number in ours.quantities().items():
            if place.startswith("path"):
                assert float(theirs.quantities()[place]) == pytest.approx(float(number), rel=1e-14, abs=1e-17)


def test_a_urdf_has_mimic_joints_and_loses_tendons():
    text, losses = export_urdf.text_and_losses(Hand.load(HERE / "exported_finger.toml"))
    root = ElementTree.fromstring(text)  # noqa: S314 our own
    (mimic,) = root.iter("mimic")
    pulleys = Hand.load(HERE / "exported_finger.toml").fingers["claw"].radii

    assert float(mimic.get("multiplier")) == float(pulleys["mid"]) / float(pulleys["end"])
    assert {"tendons", "armature", "springs of joints"} <= {loss.what for loss in losses}


@pytest.mark.parametrize("seed", range(8))
def test_a_quaternion_is_that_of_its_rotation(seed):
    quat = np.random.default_rng(seed).normal(size=4) * ([1, 1e-9, 1, 1] if seed % 2 else [1e-9, 1, 1e-3, 1])
    quat /= np.linalg.norm(quat)

    assert rotation(quaternion(rotation(quat))) == pytest.approx(rotation(quat), abs=1e-15)


# -- the command -----------------------------------------------------------------------------------------------------


def test_export_writes_a_file_and_says_what_is_lost(tmp_path):
    shown = told("export", "urdf", "--hand", HERE / "one_finger.toml", "-o", tmp_path / "claw.urdf")

    assert shown.splitlines()[1] == "not held:"
    assert "four-bars: the coupler's angle is a line in the crank's, and differs at most (jaw" in shown
    assert (tmp_path / "claw.urdf").read_text(encoding="utf-8").startswith("<!-- One finger")


def test_export_replaces_a_file_only_if_asked(tmp_path):
    (tmp_path / "mine.xml").write_text("mine", encoding="utf-8")
    words = ["export", "mjcf", "--hand", HERE / "exported_finger.toml", "-o", tmp_path / "mine.xml"]

    assert "exists; choose another name with -o" in complaint(*words)
    assert (tmp_path / "mine.xml").read_text(encoding="utf-8") == "mine"
    assert answer(*words, "--replace")["file"] == str(tmp_path / "mine.xml")


def test_an_unknown_format_is_refused():
    assert complaint("export", "sdf") == "sdf is no format of export; expected mjcf, urdf or fmu"
