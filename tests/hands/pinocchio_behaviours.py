"""What Pinocchio does that people who exchange models do not expect; docs/interchange.md has a row for each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio

_INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def _robot(links: dict[str, str], joints: str) -> str:
    return f'<robot name="r">{"".join(f"<link name={n!r}>{i}</link>" for n, i in links.items())}{joints}</robot>'


def _joint(name: str, parent: str, child: str, more: str = "") -> str:
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    ends = f'<parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>'
    return f'<joint name="{name}" type="revolute">{ends}{limit}{more}</joint>'


_MIMIC = _robot(
    dict.fromkeys("abc", _INERTIAL),
    _joint("first", "a", "b") + _joint("second", "b", "c", '<mimic joint="first" multiplier="2"/>'),
)


def siblings_are_sorted_by_name() -> bool:
    text = _robot(dict.fromkeys("abc", _INERTIAL), _joint("z", "a", "b") + _joint("m", "a", "c"))
    return list(pinocchio.buildModelFromXML(text).names)[1:] == ["m", "z"]


def a_mimic_joint_is_independent_by_default() -> bool:
    return bool(pinocchio.buildModelFromXML(_MIMIC).nv == 2)


def aba_refuses_a_model_with_mimic_true() -> bool:
    model = pinocchio.buildModelFromXML(_MIMIC, mimic=True)
    try:
        pinocchio.aba(model, model.createData(), np.zeros(1), np.zeros(1), np.zeros(1))
    except (ValueError, RuntimeError):
        return bool(model.nv == 1)
    return False


def aba_is_nan_where_a_moving_link_has_no_inertia() -> bool:
    model = pinocchio.buildModelFromXML(_robot({"a": _INERTIAL, "b": ""}, _joint("j", "a", "b")))
    found = pinocchio.aba(model, model.createData(), np.zeros(1), np.zeros(1), np.zeros(1))
    return bool(np.isnan(found).all())


def a_link_without_inertial_has_no_mass_in_spite_of_its_geometry() -> bool:
    box = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    model = pinocchio.buildModelFromXML(_robot({"a": _INERTIAL, "b": box}, _joint("j", "a", "b")))
    return bool(model.inertias[1].mass == 0)


BEHAVIOURS: tuple[Callable[[], bool], ...] = (
    siblings_are_sorted_by_name,
    a_mimic_joint_is_independent_by_default,
    aba_refuses_a_model_with_mimic_true,
    aba_is_nan_where_a_moving_link_has_no_inertia,
    a_link_without_inertial_has_no_mass_in_spite_of_its_geometry,
)
