"""The drawing of a hand: true to scale, with every joint, pulley and tendon of the file, readable by XML parsers."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import numpy as np
import pytest
from commands import ONE_FINGER, complaint, told

import awiwi_gen
from awiwi_gen.drawing import VIEW, drawing, skeleton
from awiwi_gen.hand import Hand
from awiwi_gen.hand.pose import Chain
from awiwi_gen.resources import STARTER_HAND

SVG = "{http://www.w3.org/2000/svg}"


def lines(hand: Hand, kind: str) -> list[np.ndarray]:
    root = ElementTree.fromstring(drawing(hand))  # noqa: S314 our own text
    found = [line.attrib["points"] for line in root.iter(f"{SVG}polyline") if line.attrib["class"] == kind]
    return [np.array([[float(x) for x in place.split(",")] for place in points.split()]) for points in found]


def words(hand: Hand) -> list[str]:
    root = ElementTree.fromstring(drawing(hand))  # noqa: S314 our own text
    return [text.text or "" for text in root.iter(f"{SVG}text")]


def test_links_have_their_lengths_and_pulleys_their_radii_at_one_scale():
    hand = Hand.load(STARTER_HAND)  # a planar finger: 45 and 28 mm
    along, across = lines(hand, "link")
    rims = lines(hand, "rim")[1:]  # after the bar of the scale
    lengths = np.linalg.norm(np.diff(along, axis=0), axis=1)

    assert lengths[0] / lengths[1] == pytest.approx(45 / 28, abs=0.02)
    assert np.ptp(rims[0][:, 0]) / lengths[0] == pytest.approx(2 * 9 / 45, abs=0.02)
    assert np.ptp(across[:, 1]) == pytest.approx(0, abs=0.2)
    assert max(np.ptp(np.concatenate([along, *lines(hand, "end")[:2]]), axis=0)) <= VIEW + 1


def test_the_bar_is_as_long_as_it_says():
    hand = Hand.load(STARTER_HAND)
    bar, link = lines(hand, "rim")[0], lines(hand, "link")[0]
    (said,) = (word for word in words(hand) if word.endswith(" mm"))

    assert np.ptp(bar[:, 0]) / np.linalg.norm(link[1] - link[0]) == pytest.approx(float(said[:-3]) / 45, abs=0.02)


def test_every_joint_and_every_tendon_is_named(hand):
    said = " ".join(words(hand))

    for name, finger in hand.fingers.items():
        assert name in words(hand)
        assert all(link.joint in said for link in finger.links)
    assert sum(word.startswith("tendon ") for word in words(hand)) == 38
    assert len(lines(hand, "tendon")) == 2 * 4  # the thumb's spans, in two views


def test_the_skeleton_ends_at_the_fingertip(hand, lib):
    q = [0.1, 0.4, 0.3, 0.2]
    tip = skeleton(Chain(hand.fingers["index"]), q)[-1]

    np.testing.assert_allclose(tip, lib.index_fingertip_pose(q)[:3, 3], atol=1e-12)


def test_names_cannot_leave_their_text():
    text = STARTER_HAND.read_text(encoding="utf-8").replace('"My hand"', '"a <script> & more"')

    assert "a &lt;script&gt; &amp; more: fingers" in drawing(Hand.parse(text))


def test_the_command_writes_the_file_and_says_what_is_in_it(tmp_path):
    place = tmp_path / "one.svg"

    assert told("show", "--hand", ONE_FINGER, "-o", place) == f"{place}: 1 finger, 3 joints, 3 tendons\n"
    assert place.read_text(encoding="utf-8") == drawing(Hand.load(ONE_FINGER))
    assert json.loads(told("show", "--hand", ONE_FINGER, "-o", place, "--json"))["fingers"] == ["jaw"]


def test_a_faulty_hand_leaves_the_drawing_that_is_there(tmp_path):
    (tmp_path / "one.svg").write_text("old", encoding="utf-8")
    (tmp_path / "hand.toml").write_text("prefix = 1\n", encoding="utf-8")

    assert "prefix" in complaint("show", "--hand", tmp_path / "hand.toml", "-o", tmp_path / "one.svg")
    assert (tmp_path / "one.svg").read_text(encoding="utf-8") == "old"


def test_the_wrist_is_drawn_with_its_bars_and_all_its_tendons():
    hand = Hand.load()
    without = hand.model_copy(update={"wrist": None})
    views = 2

    assert len(lines(hand, "link")) - len(lines(without, "link")) == views * 3
    assert len(lines(hand, "return")) - len(lines(without, "return")) == views * len(hand.wrist.tendons)
    assert "38 tendons run straight through it" in words(hand)
    assert not any("wrist" in word for word in words(without))


def test_a_plot_is_a_picture_for_notebooks_and_a_file_for_scripts(tmp_path):
    hand = Hand.load(STARTER_HAND)
    plotted = awiwi_gen.plot(hand)
    plotted.save(tmp_path / "hand.svg")

    assert plotted._repr_svg_() == drawing(hand) == (tmp_path / "hand.svg").read_text(encoding="utf-8")
