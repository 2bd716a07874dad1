"""What MuJoCo does that people who exchange models do not expect; docs/interchange.md has a row for each.

An entry that no longer holds means that the row, and what the import and export do about it, must be looked at again.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import mujoco
import numpy as np
import pinocchio

from .pinocchio_behaviours import BEHAVIOURS as OF_PINOCCHIO

_BODY = '<inertial mass="1" pos="0 0 0.1" diaginertia="1 1 1"/>'


def _compiled(inside: str, after: str = "", before: str = "") -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{before}<worldbody>{inside}</worldbody>{after}</mujoco>")
    return model, mujoco.MjData(model)


def stiffness_polynomials_are_not_odd_and_damping_polynomials_are() -> bool:
    model, data = _compiled(f'<body>{_BODY}<joint stiffness="1 2 3" damping="1 2 3"/></body>')
    found = []
    for sign in (1, -1):
        data.qpos[0] = data.qvel[0] = sign * 0.5
        mujoco.mj_forward(model, data)
        found.append((data.qfrc_spring[0], data.qfrc_damper[0]))
    return bool(found[0][0] != -found[1][0] and found[0][1] == -found[1][1])


def ranges_of_tendons_and_controls_stay_in_degrees() -> bool:
    model, _ = _compiled(
        f'<body>{_BODY}<joint name="j" range="-90 90"/></body>',
        '<tendon><fixed name="t" range="-90 90"><joint joint="j" coef="1"/></fixed></tendon>'
        '<actuator><position joint="j" ctrlrange="-90 90"/></actuator>',
        '<compiler angle="degree"/>',
    )
    return bool(model.jnt_range[0, 1] < 2 and model.tendon_range[0, 1] == 90 and model.actuator_ctrlrange[0, 1] == 90)


def to_xml_writes_six_digits() -> bool:
    spec = mujoco.MjSpec.from_string(
        f'<mujoco><worldbody><body pos="0.123456789 0 0">{_BODY}<joint/></body></worldbody></mujoco>'
    )
    spec.compile()
    return re.search(r'pos="(0\.12\d*)', spec.to_xml())[1] == "0.123457"


def armature_of_a_tendon_over_siblings_does_not_couple_them() -> bool:
    model, data = _compiled(
        f'<body><body>{_BODY}<joint name="a"/></body><body>{_BODY}<joint name="b"/></body></body>',
        '<tendon><fixed armature="2"><joint joint="a" coef="1"/><joint joint="b" coef="1"/></fixed></tendon>',
    )
    mujoco.mj_forward(model, data)
    mass = np.zeros((2, 2))
    mujoco.mj_fullM(model, data, mass)
    return bool(mass[0, 1] == 0 and mass[0, 0] == 3)


def the_force_range_of_a_tendon_limits_the_sum_before_the_gear() -> bool:
    model, data = _compiled(
        f'<body>{_BODY}<joint name="a"/></body>',
        '<tendon><fixed name="t" actuatorfrcrange="-4 4"><joint joint="a" coef="1"/></fixed></tendon>'
        '<actuator><motor tendon="t" gear="3"/></actuator>',
    )
    data.ctrl[0] = 100
    mujoco.mj_forward(model, data)
    return bool(data.qfrc_actuator[0] == 12)


def damping_of_a_tendon_diverges_with_euler_and_not_with_implicitfast() -> bool:
    speeds = []
    for integrator in ("Euler", "implicitfast"):
        model, data = _compiled(
            '<body><inertial mass="0.01" pos="0 0 0" diaginertia="1e-6 1e-6 1e-6"/><joint name="a"/></body>',
            '<tendon><fixed damping="100"><joint joint="a" coef="0.01"/></fixed></tendon>',
            f'<option integrator="{integrator}" timestep="0.002"/>',
        )
        data.qvel[0] = 1
        for _ in range(4):
            mujoco.mj_step(model, data)
        speeds.append(abs(data.qvel[0]))
    return bool(speeds[0] > 1 and speeds[1] < 1)


def a_mimic_joint_is_a_soft_equality() -> bool:
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    links = "".join(f'<link name="{name}">{inertial}</link>' for name in "abc")
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/><axis xyz="0 0 1"/>'
    spec = mujoco.MjSpec.from_string(
        f'<robot name="r">{links}'
        f'<joint name="p" type="revolute"><parent link="a"/><child link="b"/>{limit}</joint>'
        f'<joint name="d" type="revolute"><parent link="b"/><child link="c"/>{limit}<mimic joint="p"/></joint></robot>'
    )
    model = spec.compile()
    return bool(model.neq == 1 and model.nv == 2)


def _wrapped(cylinder: str, first: str, last: str, side: str) -> float:
    """Length of a tendon from a site to another, round a cylinder of radius 1 along z."""
    model, data = _compiled(
        f'<geom name="g" type="cylinder" size="{cylinder}"/><site name="s" pos="{side}"/>'
        f'<site name="a" pos="{first}"/><site name="b" pos="{last}"/>',
        '<tendon><spatial><site site="a"/><geom geom="g" sidesite="s"/><site site="b"/></spatial></tendon>',
    )
    mujoco.mj_forward(model, data)
    return float(data.ten_length[0])


def a_tendon_is_straight_through_a_geom_that_a_site_is_inside() -> bool:
    return _wrapped("1 1", "-2 0 0", "0.9 0 0", "0 2 0") == 2.9 and _wrapped("1 1", "-2 0 0", "1.1 0 0", "0 2 0") > 3.5


def a_tendon_wraps_round_a_cylinder_beyond_its_ends() -> bool:
    return _wrapped("1 1", "-2 0 50", "2 0 50", "0 2 50") == _wrapped("1 1", "-2 0 0", "2 0 0", "0 2 0") > 4.5


def a_side_site_near_the_axis_and_far_along_it_is_outside() -> bool:
    return (
        _wrapped("1 1", "-2 0.1 0", "2 0.1 0", "0 0.5 0")
        < 4.1
        < 4.4
        < _wrapped("1 1", "-2 0.1 0", "2 0.1 0", "0 0.5 2")
    )


def a_bend_inside_a_geom_is_not_quite_where_the_string_is_shortest() -> bool:
    off = []
    for x in np.linspace(0.4, 3, 80):
        a, b = np.array([-x, -1.7]), np.array([0.9, -1.2])
        ends = "".join(f'<site name="{name}" pos="{p[0]} {p[1]} 0"/>' for name, p in (("a", a), ("b", b)))
        model, data = _compiled(
            f'<geom name="g" type="cylinder" size="1 1"/><site name="s" pos="0 0 0"/>{ends}',
            '<tendon><spatial><site site="a"/><geom geom="g" sidesite="s"/><site site="b"/></spatial></tendon>',
        )
        mujoco.mj_forward(model, data)
        bend = np.asarray(data.wrap_xpos).reshape(-1, 3)[1, :2]
        pull = sum((end - bend) / np.linalg.norm(end - bend) for end in (a, b))
        off.append(abs(pull[0] * bend[1] - pull[1] * bend[0]))  # along the surface; zero where the string is shortest
    return 1e-8 < max(off) < 1e-5


def a_link_of_a_urdf_without_inertial_weighs_what_its_geometry_does() -> bool:
    box = '<link name="b"><collision><geometry><box size="1 1 1"/></geometry></collision></link>'
    hinge = '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>'
    model = mujoco.MjModel.from_xml_string(f'<robot name="r"><link name="a"/>{box}{hinge}</robot>')
    return bool(model.body("b").mass[0] == 1000)


def the_balance_of_a_tensor_is_the_mean_of_its_moments() -> bool:
    long = '<inertial mass="1" pos="0 0 0" diaginertia="1 2 6"/>'
    try:
        _compiled(f"<body>{long}<joint/></body>")
    except ValueError:
        model, _ = _compiled(f"<body>{long}<joint/></body>", before='<compiler balanceinertia="true"/>')
        return bool(np.all(model.body_inertia[1] == 3))
    return False


BEHAVIOURS: tuple[Callable[[], bool], ...] = (
    stiffness_polynomials_are_not_odd_and_damping_polynomials_are,
    ranges_of_tendons_and_controls_stay_in_degrees,
    to_xml_writes_six_digits,
    armature_of_a_tendon_over_siblings_does_not_couple_them,
    the_force_range_of_a_tendon_limits_the_sum_before_the_gear,
    damping_of_a_tendon_diverges_with_euler_and_not_with_implicitfast,
    a_mimic_joint_is_a_soft_equality,
    a_tendon_is_straight_through_a_geom_that_a_site_is_inside,
    a_tendon_wraps_round_a_cylinder_beyond_its_ends,
    a_side_site_near_the_axis_and_far_along_it_is_outside,
    a_bend_inside_a_geom_is_not_quite_where_the_string_is_shortest,
    a_link_of_a_urdf_without_inertial_weighs_what_its_geometry_does,
    the_balance_of_a_tensor_is_the_mean_of_its_moments,
)


def changed() -> list[str]:
    """The behaviours that these versions of MuJoCo and Pinocchio do not have."""
    engines = ((f"MuJoCo {mujoco.__version__}", BEHAVIOURS), (f"Pinocchio {pinocchio.__version__}", OF_PINOCCHIO))
    return [f"{name}: not so any more: {each.__name__}" for name, known in engines for each in known if not each()]
