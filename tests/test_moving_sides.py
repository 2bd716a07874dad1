"""Wraps on the side of a point that another link carries: what they return where it changes sides, and faults."""

from __future__ import annotations

import numpy as np
import pytest
from test_wraps import CYLINDER, END, START
from wrapped_hands import hand_with, place

from awiwi_gen.build import load
from awiwi_gen.errors import InputError
from awiwi_gen.pipeline import Job, cached_tree


def body(side: str) -> str:
    return START + place("palm", 0, 0, 0, f"{CYLINDER}{side}") + END


def on(link: str, y: float) -> str:
    return f', side = ["0 mm", "{y} mm", "0 mm"], side_link = "{link}"'


def test_a_side_that_turns_with_the_joint_has_a_status_where_the_string_changes_sides():
    job = Job(hand_with(body(on("root", 9)), body(on("palm", 9))), only="claw_tendon_lengths")
    found = load(cached_tree(job), job.store).claw_tendon_lengths([[-0.2, 0.0], [0.5, 0.0], [3.0, 0.0]])

    np.testing.assert_array_equal(found.status, [0, 0, 1])
    np.testing.assert_allclose(found.h[:2, 0], found.h[:2, 1], rtol=1e-15)


def test_a_side_link_that_is_the_bodys_own_changes_nothing():
    own, none = (
        hand_with(body(side)).fingers["claw"] for side in (on("palm", 9), on("palm", 9).split(", side_link")[0])
    )

    assert own.structure() == none.structure()


@pytest.mark.parametrize(
    ("side", "message"),
    [
        (on("root", 3), "path[1].side comes within 3 mm of the cylinder's centre at root = "),
        (on("knee", 9), 'path[1].side_link = "knee" names no link of this finger'),
        (', side_link = "root"', "path[1].side_link is without a side; expected the point that it carries beside it"),
    ],
)
def test_a_fault_of_a_moving_side_is_told_with_its_place(side, message):
    with pytest.raises(InputError) as caught:
        hand_with(body(side))

    assert f"fingers.claw.tendons[0].{message}" in str(caught.value)
