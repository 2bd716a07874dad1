"""Published inertia tensors that no body has, replaced by those of solids along the bones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import finger

from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.interchange.draft import draft
from awiwi_gen.interchange.solids import with_assumed_tensors
from awiwi_gen.interchange.toml import hand_text

TENSORS = {
    "too large": np.diag([0.01, 0.01, 0.01]),
    "no body's": np.diag([3e-7, 4e-7, 9e-7]),
    "a thin rod's": np.diag([0.0, 4e-7, 4e-7]),
}


def published(tensor):
    model = finger()
    pad = replace(model.bodies[4], mass=0.0, inertia=np.zeros((3, 3)))
    bodies = (*model.bodies[:3], replace(model.bodies[3], inertia=tensor), pad)
    return draft(replace(model, bodies=bodies))


@pytest.mark.parametrize("tensor", TENSORS.values(), ids=TENSORS)
def test_a_tensor_that_the_body_cannot_have_is_that_of_a_cylinder_along_its_bone(tensor):
    drafted = published(tensor)
    assumed = with_assumed_tensors(drafted)
    (parsed,) = Hand.parse(hand_text(assumed)).fingers.values()
    link = assumed.fingers[0].links[-1]
    length, axis = np.linalg.norm(link.offset), link.offset / np.linalg.norm(link.offset)
    moments = np.linalg.eigvalsh(link.inertia)

    with pytest.raises(InputError, match="inertia"):
        Hand.parse(hand_text(drafted))
    assert axis @ link.inertia @ axis == pytest.approx(moments[0])
    assert moments == pytest.approx(link.mass * length**2 * np.array([1 / 32, 19 / 192, 19 / 192]))
    assert "links[2].inertia.xx" in parsed.assumed()
    assert "links[2].mass" not in parsed.assumed()
    assert [loss.places for loss in assumed.losses if "cylinders" in loss.what] == [("distal",)]


def test_tensors_that_bodies_have_stay():
    drafted = draft(finger())

    assert hand_text(with_assumed_tensors(drafted)) == hand_text(drafted)
