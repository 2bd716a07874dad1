"""The wrist in the hand file: what is refused, and wrists that are drawn otherwise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from awiwi_gen.build import load
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.reproduce.figures.wrist import bar_errors, figures, internal_angles, tendon_displacements

PACKAGED = (Path(__file__).parents[1] / "awiwi_gen" / "hand.toml").read_text(encoding="utf-8")
DRAWN = {"a0": (0, 21, 36), "a": (50, 21, 0), "b": (50, 42, 36), "palm": (50, 21, 18)}  # mm, the neutral pose


def written(key: str, point: tuple[float, float, float]) -> str:
    coordinates = ", ".join(f'"{x} mm"' for x in point)
    return f"{key} = [{coordinates}]"


def redrawn(**points: tuple[float, float, float]) -> str:
    """The packaged hand file with other points of the wrist [mm]."""
    text = PACKAGED
    for key, point in points.items():
        assert written(key, DRAWN[key]) in text
        text = text.replace(written(key, DRAWN[key]), written(key, point))
    return text


def replaced(old: str, new: str) -> str:
    assert PACKAGED.count(old) == 1
    return PACKAGED.replace(old, new)


def wrist_library(hand: Hand):
    job = Job(hand, only="wrist_[pt]*")  # without the coupling, which takes longest
    return load(cached_tree(job), job.store)


def unequal(sense: int = 1, **others: str) -> str:
    """A wrist whose bars differ in length, drawn upside down if the sense is -1."""
    points = {
        "a0": (0, 21, 36 * sense),
        "a": (52, 18, 2 * sense),
        "b": (50, 42, 36 * sense),
        "palm": (50, 21, 18 * sense),
    }
    keys = {"width": "40 mm", "c": ("52.5", 2, 37.8 * sense)} | others
    lines = [f'{key} = "{v}"' if isinstance(v, str) else written(key, v) for key, v in keys.items() if v]
    return redrawn(**points).replace("[wrist]", "\n".join(["[wrist]", *lines]))


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (unequal(c=("52.5", 2, 30)), "wrist.c has z = 30 mm; expected 37.8 mm, in the plane through B0C0 and B"),
        (unequal(c=("52.5", 90, 37.8)), "wrist.c is where the bars BB0 and CC0 do not cross"),
        (unequal(c="", width="-1 mm"), "wrist.width"),
        (unequal().replace('a = ["52 mm", "18 mm", "2 mm"]', 'a = ["52 mm", "18 mm", "40 mm"]'),
         "wrist.a lies on the same side of the side bars as A0"),
        (unequal().replace('q73 = { low = "-20 deg"', 'q73 = { low = "-50 deg"'), "wrist does not close at q71"),
        (replaced('q71 = { low = "-30 deg"', 'q71 = { low = "-120 deg"'),
         "wrist does not close at q71 = -84.25 deg, q73 = 35.72 deg (-120 and -20 deg from the neutral pose): "),
        (replaced('q71 = { low = "-30 deg", high = "30 deg"', 'q71 = { low = "-30 deg", high = "60 deg"'),
         "(+55.5 and -20 deg from the neutral pose): the plane of the side bars has reached A0"),
        (replaced('high = "20 deg" }  # from 55.72', 'high = "130 deg" }  # from 55.72'), "wrist does not close at"),
        (replaced('q73 = { low = "-20 deg"', 'q73 = { low = "20 deg"'),
         'wrist.q73.low = "20 deg" is not below high = "20 deg"'),
        (redrawn(a=(50, 21, 72)), "wrist.a lies on the same side of the side bars as A0"),
        (redrawn(a=(50, 21, 36)), "wrist.a lies on BC: the palm's three points must form a triangle"),
        (redrawn(a=(49, 20, 0)), "wrist.a has x = 49 mm; expected 50 mm, straight across the palm from the middle of"),
        (redrawn(a=("50.0000001", 21, 0)), "wrist.a has x = 50.0000001 mm; expected 50 mm, straight across the palm"),
        (redrawn(a0=(50, 21, 90)), 'wrist.a0[0] = "50 mm" lies no nearer to the elbow than the palm'),
        (redrawn(b=(50, -42, 36)), "wrist.b does not cross the width of the wrist"),
        (replaced('    { forearm = ["4 mm", "35 mm", "28 mm"], palm = ["-4 mm", "16 mm", "-10 mm"] },\n', ""),
         "wrist.tendons has 37 entries, but 38 tendons of the fingers pass here"),
        (replaced('tendons = "table 6.2", default = "assumed"', 'tendon = "table 6.2", default = "assumed"'),
         "wrist.source.tendon is the source of no number here"),
    ],
)  # fmt: skip
def test_a_wrist_that_cannot_be_is_refused_with_the_pose_or_number_that_fails(text, fault):
    with pytest.raises(InputError) as caught:
        Hand.parse(text)

    assert fault in str(caught.value)


def test_a_hand_without_a_wrist_has_no_wrist_kernels():
    hand = Hand.parse(PACKAGED[: PACKAGED.index("[wrist]")])
    names = {kernel.name for kernel in Job(hand).kernels}

    assert hand.wrist is None
    assert not {name for name in names if name.startswith("wrist_")}
    assert figures(None, hand) == []


def test_a_wrist_drawn_upside_down_moves_upside_down(lib, hand):
    """A0 below the side bars, A above: then the height AM is negative."""
    wrist = hand.wrist
    mirrored = Hand.parse(redrawn(a0=(0, 21, -36), a=(50, 21, 0), b=(50, 42, -36), palm=(50, 21, -18)))
    other = wrist_library(mirrored)
    q71, q73 = wrist.neutral[0] + 0.2, wrist.neutral[1] - 0.15

    assert mirrored.wrist.neutral[0] == -wrist.neutral[0]
    for ours, theirs in zip(lib.wrist_points(q71, q73)[:3], other.wrist_points(-q71, q73)[:3], strict=True):
        np.testing.assert_allclose(theirs, ours * [1, 1, -1], rtol=0, atol=1e-16)


FLAT = redrawn(a0=(0, 21, 18), a=(50, 21, -18), b=(50, 42, 0), palm=(50, 21, 0)).replace(
    'mm", "8 mm"], palm', 'mm", "-10 mm"], palm').replace('mm", "28 mm"], palm', 'mm", "10 mm"], palm')  # fmt: skip
X = 34.6987031457949  # mm: sqrt(a^2 - c^2)
SHORT = redrawn(a=(X, 21, 0), b=(X, 42, 36), palm=(X, 21, 18))


@pytest.mark.parametrize(
    ("text", "lowest", "highest"), [(FLAT, -0.560, 0.478), (SHORT, 0.818, 0.823)], ids=["flat side bars", "AA0 = a"]
)
def test_other_readings_of_the_drawing_are_other_numbers_of_the_same_file(text, lowest, highest):
    """Side bars in the middle plane with A0 and A on opposite faces; or a bar AA0 as long as the box of table 6.1.

    Bars keep their lengths there too. With flat side bars flexion pulls tendons both ways, unlike in figure 6.10.
    """
    other = Hand.parse(text)
    lib = wrist_library(other)
    grid = np.meshgrid(*(np.linspace(low, high, 21) for low, high in zip(*other.wrist.range, strict=True)))

    assert bar_errors(lib, other.wrist, *grid).max() < 1e-16
    flexed = internal_angles(lib, other.wrist, 0, np.radians([30.0]))
    moved = tendon_displacements(lib, other.wrist, *flexed) * 1e3
    assert [moved.min(), moved.max()] == pytest.approx([lowest, highest], abs=1e-3)


@pytest.mark.parametrize("sense", [1, -1])
def test_bars_of_any_length_keep_it_and_give_the_drawn_palm_in_the_neutral_pose(sense):
    hand = Hand.parse(unequal(sense))
    lib = wrist_library(hand)
    grid = np.meshgrid(*(np.linspace(low, high, 21) for low, high in zip(*hand.wrist.range, strict=True)))

    assert bar_errors(lib, hand.wrist, *grid).max() < 1e-16
    neutral = lib.wrist_palm_pose(*hand.wrist.neutral)
    assert neutral.status == 0
    np.testing.assert_allclose(
        neutral.T, [[1, 0, 0, 0.05], [0, 1, 0, 0.021], [0, 0, 1, 0.018 * sense], [0, 0, 0, 1]], atol=2e-15
    )


def test_equal_bars_written_as_any_bars_move_as_before(lib, hand):
    written_out = Hand.parse(PACKAGED.replace("[wrist]", '[wrist]\nwidth = "42 mm"\nc = ["50 mm", "0 mm", "36 mm"]'))
    grid = np.meshgrid(*(np.linspace(low, high, 9) for low, high in zip(*hand.wrist.range, strict=True)))

    other = wrist_library(written_out)
    np.testing.assert_allclose(other.wrist_palm_pose(*grid).T, lib.wrist_palm_pose(*grid).T, atol=1e-15)


def test_side_bars_that_reach_their_end_are_a_status():
    hand = Hand.parse(unequal(c=("52.5", 12, 37.8)).replace('q73 = { low = "-20 deg"', 'q73 = { low = "-10 deg"'))
    lib, (q71, q73) = wrist_library(hand), hand.wrist.neutral

    statuses = lib.wrist_points(q71, np.linspace(q73, 0.1, 200)).status
    assert statuses[0] == 0
    assert {*statuses.tolist()} > {0}
