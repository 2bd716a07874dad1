"""One mistake in all inertia tensors of a hand is one message, with the mend that fits every body."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand

ONE_FINGER = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")
KEYS = ("xx", "yy", "zz", "xy", "xz", "yz")
# Tensors about the centre of mass [g mm^2] of three bodies of 5, 4 and 2 g at (15, 0, 0), (0, 0, 12), (0, 0, 9) mm.
TENSORS = [(60, 400, 405, 13, 12, 21), (250, 251, 40, 3, 9, 11), (80, 81, 20, 6, 5, 7)]
ROW_BY_ROW = [0, 3, 4, 1, 5, 2]


COMS = [(15, 0, 0), (0, 0, 12), (0, 0, 9)]  # mm
MASSES = [5, 4, 2]  # g


def hand_file(tensors, coms=COMS) -> str:
    """The small hand with other tensors and centres of mass."""
    tables = iter("{ " + ", ".join(f'{k} = "{x} g mm^2"' for k, x in zip(KEYS, t, strict=True)) + " }" for t in tensors)
    points = iter("[" + ", ".join(f'"{x} mm"' for x in com) + "]" for com in coms)
    text = re.sub(r"(?<=inertia = )\{.*\}", lambda _: next(tables), ONE_FINGER)
    return re.sub(r"(?<=com = )\[.*\]", lambda _: next(points), text)


def fault(tensors, coms=COMS) -> str:
    """The message about the small hand with other tensors and centres of mass."""
    with pytest.raises(InputError) as caught:
        Hand.parse(hand_file(tensors, coms))
    return str(caught.value)


def moved(sign, entries, coms):
    """The tensors with some entries increased, or reduced, by those of the mass at its centre."""
    for tensor, mass, com in zip(TENSORS, MASSES, coms, strict=True):
        x = dict(zip("xyz", com, strict=True))
        share = {a + b: mass * ((a == b) * sum(c * c for c in com) - x[a] * x[b]) for a, b in KEYS}
        yield [value + sign * (key in entries) * share[key] for key, value in zip(KEYS, tensor, strict=True)]


def test_the_tensors_to_begin_with_are_those_of_bodies():
    assert len(Hand.parse(hand_file(TENSORS)).fingers["jaw"].links) == 3


def test_entries_in_the_order_of_another_format_are_told_once_for_all_bodies():
    message = fault([[tensor[i] for i in ROW_BY_ROW] for tensor in TENSORS])

    assert message.startswith("hand.toml:35 fingers.jaw.links[0].inertia breaks the triangle inequality")
    assert "3 of 3 links are like this (root, mid, end)" in message
    assert message.endswith(
        "the entries are probably in the order xx, xy, xz, yy, yz, zz (as in URDF), not xx, yy, zz, xy, xz, yz"
    )


def test_products_about_another_point_than_the_moments_are_told():
    coms = [(15, 4, 3), (9, 2, 12), (6, 8, 9)]
    message = fault(moved(1, KEYS[3:], coms), coms)

    assert message.endswith(
        "the products xy, xz, yz are probably about the link's origin; expected about the centre of mass"
    )


def test_products_of_another_unit_are_told():
    message = fault([(*tensor[:3], *(100 * each for each in tensor[3:])) for tensor in TENSORS])

    assert message.endswith("xy, xz, yz of every link are probably 100 times too large")


def test_tensors_from_which_the_offset_was_subtracted_twice_are_told():
    coms = [(8, 1, 1), (1, 1, 7), (1, 1, 6)]
    message = fault(moved(-1, KEYS, coms), coms)

    assert message.endswith("the tensor was probably about the centre of mass before m com^2 was subtracted from it")


def test_one_moment_that_is_wrong_in_every_body_is_told():
    message = fault([(t[0], t[1], 10 * t[2], *t[3:]) for t in TENSORS])

    assert message.count("no body is like that") == 1
    assert message.endswith("zz of every link are probably 10 times too large")


def test_tensors_that_are_all_wrong_without_a_common_mend_are_one_message():
    message = fault([(1, 1, 9, 0, 0, 0), (1, 900, 1, 0, 0, 0), (5000, 1, 1, 0, 0, 0)])

    assert message.count("\n") == 0
    assert message.endswith("3 of 3 links are like this (root, mid, end): look for one cause")


def test_two_different_slips_are_two_messages():
    message = fault([(60, 400, 4050, 3, -2, 1), TENSORS[1], (80, 810, 20, 1, -1, 1)])

    assert message.count("no body is like that") == 2
    assert "probably" not in message


def test_tensors_that_are_all_too_large_for_their_masses_are_one_message():
    message = fault([[10**6 * x for x in t] for t in TENSORS])

    assert message.count("\n") == 0
    assert "is too large for a mass of 5 g: radius of gyration 9.3 m" in message
    assert message.endswith("a common factor of all tensors, or of all masses, is probably wrong")
