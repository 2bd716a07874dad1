"""The models of a finger: two routes to every quantity, and what physics and the source say about both."""

from __future__ import annotations

import math
from types import SimpleNamespace as Tree

import casadi as ca
import numpy as np
import pytest
import sympy
from finger_models import (
    FOUR_BAR,
    KINDS,
    QUANTITIES,
    assert_close,
    by_definition,
    definition,
    direction,
    evaluate,
    make,
    plain,
    sizes,
    square,
    states,
    witness,
)

from awiwi_gen.definitions import kinematics
from awiwi_gen.definitions.dynamics import lagrange
from awiwi_gen.definitions.four_bar import four_bar_angles
from awiwi_gen.definitions.naming import Derivation, definitions
from awiwi_gen.witnesses import kinematics as recursion
from awiwi_gen.witnesses.four_bar import FourBar

# -- two routes -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("kind", KINDS)
def test_both_routes_agree(kind, quantity):
    for state in states(kind):
        assert_close(witness(kind, quantity, state), by_definition(kind, quantity, state))


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_definitions_take_plain_numbers_for_the_finger(quantity):
    elements, numbers, symbols = definition("fifth", quantity, plain)
    assert not numbers
    state = states("fifth")[0]
    known = {x: float(v) for name, own in symbols.items() for x, v in zip(own, state[name], strict=True)}
    assert_close(np.array(evaluate(elements, known)), by_definition("fifth", quantity, state))


def test_the_same_derivation_always_spells_the_same_expressions():
    q = sympy.Matrix([sympy.Symbol(f"q{i}", real=True) for i in range(4)])

    def spelled() -> list[str]:
        elements = lagrange.mass_matrix(make("fifth", lambda name, _: sympy.Symbol(name, real=True)), q).flat()
        return [f"{name} = {meaning}" for name, meaning in definitions(elements)] + [str(e) for e in elements]

    assert spelled() == spelled()


# -- names ----------------------------------------------------------------------------------------------------------


def test_derivatives_see_through_names():
    x, y = sympy.symbols("x y", real=True)
    derivation = Derivation()
    root = derivation.name(sympy.sqrt(1 + x**2 * y))
    angle = derivation.name(sympy.atan2(root, x) * sympy.acos(x / 9) + 1 / root)
    whole = sympy.sin(angle) * root**3
    spelled_out = whole.subs(angle, angle.definition).subs(root, root.definition)
    for wrt in (x, y):
        first = derivation.partial(whole, wrt)
        second = derivation.partial(first, x)
        expected = [spelled_out.diff(wrt), spelled_out.diff(wrt).diff(x)]
        values = evaluate([first, second], {x: 0.7, y: 1.3})
        assert_close(np.array(values), np.array([float(e.subs({x: 0.7, y: 1.3})) for e in expected]))


def test_a_rate_along_a_motion_is_the_sum_of_all_partial_rates():
    x, y = sympy.symbols("x y", real=True)
    derivation = Derivation()
    expr = sympy.cos(derivation.name(x * y)) / x
    along = derivation.along(expr, {x: sympy.Integer(3), y: x})
    parts = 3 * derivation.partial(expr, x) + x * derivation.partial(expr, y)
    assert_close(*(np.array(evaluate([e], {x: 0.7, y: 1.3})) for e in (along, parts)))


@pytest.mark.parametrize("name", ["sin", "cos", "tan", "asin", "acos", "atan", "exp", "log"])
def test_functions_have_their_derivatives(name):
    x = sympy.Symbol("x", real=True)
    whole = getattr(sympy, name)(x**2 / 3)
    assert float(Derivation().partial(whole, x).subs(x, 0.7)) == pytest.approx(float(whole.diff(x).subs(x, 0.7)))


@pytest.mark.parametrize("strange", [lambda x: 2**x, sympy.gamma])
def test_a_function_without_a_rule_is_refused(strange):
    x = sympy.Symbol("x", real=True)
    with pytest.raises(ValueError, match=r"2\*\*x has an exponent|gamma\(x\) has no derivative"):
        Derivation().partial(strange(x), x)


# -- kinematics -----------------------------------------------------------------------------------------------------


def test_fingertip_of_table_5_1_is_its_closed_form():
    e, l1, l2, l3, z2, z3 = 0.006, 0.04038, 0.0298, 0.00201, -0.005, -0.0007
    lengths = {"abduction": (e, 0, 0), "flexion": (l1, 0, 0), "pip": (l2, 0, z2), "dip": (l3, 0, z3)}
    special = {}
    for joint, (x, y, z) in lengths.items():
        special |= {f"{joint}_length": x, f"{joint}_offset_y": y, f"{joint}_offset_z": z}
    q = ca.SX.sym("q", 4)
    pose = ca.Function("pose", [q], [recursion.fingertip_pose(make("index", plain, **special), q)])
    for state in states("index"):
        (q0, q1, q2, q3) = state["q"]
        a1, a2, a3 = q1, q1 + q2, q1 + q2 + q3
        reach = e + l1 * math.cos(a1) + l2 * math.cos(a2) + l3 * math.cos(a3)
        aside = -(z2 + z3)
        expected = [math.cos(q0) * reach - math.sin(q0) * aside, math.sin(q0) * reach + math.cos(q0) * aside,
                    l1 * math.sin(a1) + l2 * math.sin(a2) + l3 * math.sin(a3)]  # fmt: skip
        assert_close(np.array(pose(state["q"]))[:3, 3], np.array(expected), 1e-15)


@pytest.mark.parametrize("kind", KINDS)
def test_poses_are_rigid_motions(kind):
    for state in states(kind):
        for pose in witness(kind, "link_poses", state).reshape(-1, 4, 4):
            assert_close(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), 1e-14)
            assert np.linalg.det(pose[:3, :3]) > 0
            assert pose[3].tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize("kind", KINDS)
def test_jacobian_gives_the_velocity_of_the_tip(kind):
    for state in states(kind):
        linear, angular = (witness(kind, "jacobian", state).reshape(6, -1) @ state["qd"]).reshape(2, 3)
        pose = witness(kind, "fingertip_pose", state).reshape(4, 4)
        moving = direction(kind, "fingertip_pose", state, q=state["qd"]).reshape(4, 4)
        turning = moving[:3, :3] @ pose[:3, :3].T
        assert_close(linear, moving[:3, 3])
        assert_close(angular, np.array([turning[2, 1], turning[0, 2], turning[1, 0]]))


def test_coupled_joints_roll_equal_arcs():
    finger = make("ring", plain)
    angles = kinematics.joint_angles(finger, sympy.Matrix(states("ring")[0]["q"]))
    radii = {pulley.joint: pulley.radius for pulley in finger.pulleys}
    assert float(radii["pip"] * angles["pip"]) == pytest.approx(float(radii["dip"] * angles["dip"]), rel=1e-15)


# -- the four-bar ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("branch", [1, -1])
def test_four_bar_loop_closes(branch):
    bar = Tree(**FOUR_BAR, branch=branch)
    for crank in np.linspace(0.3, 1.9, 33):
        loop = FourBar(bar, ca.SX(crank))
        angles = [float(angle) for angle in four_bar_angles(bar, sympy.Float(crank, 17))]
        vectors = [math.atan2(float(v[1]), float(v[0])) for v in (loop.coupler, loop.rocker)]
        for coupler, rocker in (angles, vectors):
            x = bar.crank * math.cos(crank) + bar.coupler * math.cos(coupler) - bar.rocker * math.cos(rocker)
            y = bar.crank * math.sin(crank) + bar.coupler * math.sin(coupler) - bar.rocker * math.sin(rocker)
            assert math.hypot(x - bar.ground, y) < 1e-15


@pytest.mark.parametrize("branch", [1, -1])
def test_four_bar_branch_tells_on_which_side_of_the_diagonal_the_rocker_ends(branch):
    bar = Tree(**FOUR_BAR, branch=branch)
    loop = FourBar(bar, ca.SX(0.9))
    diagonal = (bar.ground - bar.crank * math.cos(0.9), -bar.crank * math.sin(0.9))
    b = [float(x) for x in loop.coupler]
    assert math.copysign(1, b[0] * diagonal[1] - b[1] * diagonal[0]) == branch


def test_four_bar_rates_are_the_derivatives_of_the_angles():
    x = ca.SX.sym("x")
    bar = Tree(**FOUR_BAR, branch=1)
    loop = FourBar(bar, x)
    coupler, rocker = (ca.atan2(v[1], v[0]) for v in (loop.coupler, loop.rocker))
    pairs = [(loop.ratio, ca.jacobian(coupler, x)), (loop.rocker_ratio, ca.jacobian(rocker, x)),
             (loop.ratio_derivative, ca.jacobian(loop.ratio, x))]  # fmt: skip
    for found, expected in pairs:
        both = ca.Function("both", [x], [found, expected])
        for crank in (0.4, 1.0, 1.7):
            first, second = both(crank)
            assert float(first) == pytest.approx(float(second), rel=1e-11)


def test_metacarpal_is_parallel_to_its_seat_at_zero():
    q = ca.SX.sym("q", 4)
    poses = ca.Function("poses", [q], recursion.link_poses(make("fifth", plain), q))
    at_zero = np.array(poses(0)[0])
    assert_close(at_zero[:3, :3], np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), 1e-15)
    reference, crank = FOUR_BAR["reference"], FOUR_BAR["crank"]
    assert_close(at_zero[:3, 3], crank * np.array([math.cos(reference), 0, math.sin(reference)]), 1e-15)


# -- dynamics -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_mass_matrix_is_symmetric_and_positive_definite(kind):
    for state in states(kind):
        mass = square(kind, "mass_matrix", state)
        assert np.array_equal(mass, mass.T)
        assert np.linalg.eigvalsh(mass).min() > 0


@pytest.mark.parametrize("kind", KINDS)
def test_mass_rate_minus_twice_the_coriolis_matrix_is_skew(kind):
    for state in states(kind):
        mass_rate = direction(kind, "mass_matrix", state, q=state["qd"]).reshape(2 * [len(state["q"])])
        difference = mass_rate - 2 * square(kind, "coriolis_matrix", state)
        assert np.max(np.abs(difference + difference.T)) <= 1e-12 * np.max(np.abs(difference))


@pytest.mark.parametrize("kind", KINDS)
def test_coriolis_matrix_is_linear_and_symmetric_in_the_velocities(kind):
    """What tells Christoffel's matrix from the other ones with a skew difference."""
    state = states(kind)[0]
    a, b = state["qd"], state["qdd"]
    of_a, of_b, of_both = (square(kind, "coriolis_matrix", state | {"qd": v}) for v in (a, b, a + b))
    assert_close(of_a + of_b, of_both)
    assert_close(of_a @ b, of_b @ a)


@pytest.mark.parametrize("kind", KINDS)
def test_dynamics_add_up_to_the_inverse_dynamics(kind):
    for state in states(kind):
        mass, coriolis = square(kind, "mass_matrix", state), square(kind, "coriolis_matrix", state)
        bias = coriolis @ state["qd"] + witness(kind, "gravity", state)
        assert_close(witness(kind, "bias", state), bias)
        assert_close(witness(kind, "inverse_dynamics", state), mass @ state["qdd"] + bias)


@pytest.mark.parametrize("kind", KINDS)
def test_forward_dynamics_inverts_inverse_dynamics(kind):
    for state in states(kind):
        tau = witness(kind, "inverse_dynamics", state)
        assert_close(witness(kind, "forward_dynamics", state | {"tau": tau}), state["qdd"], 1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_energy_changes_by_the_power_of_the_joint_torques(kind):
    for state in states(kind):
        power = witness(kind, "inverse_dynamics", state) @ state["qd"]
        rate = direction(kind, "energy", state, q=state["qd"], qd=state["qdd"]).sum()
        assert rate == pytest.approx(power, rel=1e-10)


def test_gravity_is_the_gradient_of_the_potential_energy():
    for state in states("thumb"):
        steps = np.eye(len(state["q"]))
        gradient = [direction("thumb", "energy", state, q=step)[1] for step in steps]
        assert_close(witness("thumb", "gravity", state), np.array(gradient))


# -- tendons --------------------------------------------------------------------------------------------------------


def test_index_coupling_is_that_of_equation_5_5():
    finger = make("index", plain)
    r0, r1, r2, r3 = (pulley.radius for pulley in finger.pulleys)
    expected = np.array([
        [r0, r1, 0, 0], [r0, -r1, 0, 0], [-r0, r1, 0, 0], [-r0, -r1, 0, 0],
        [0, 0, r2, 0], [0, 0, -r2, 0], [0, 0, r2, -r3], [0, 0, -r2, r3],
    ])  # fmt: skip
    state = states("index")[0]
    assert np.array_equal(by_definition("index", "coupling", state).reshape(8, 4), expected)
    assert np.array_equal(witness("index", "coupling", state).reshape(8, 4), expected)
    assert not witness("index", "coupling_derivative", state).any()


def test_coupled_dip_tendon_moves_as_if_it_rolled_on_the_leader():
    finger = make("fifth", plain)
    pip = next(pulley.radius for pulley in finger.pulleys if pulley.joint == "pip")
    assert witness("fifth", "coupling", states("fifth")[0]).reshape(8, 4)[6] == pytest.approx([0, 0, 0, pip], abs=1e-18)


@pytest.mark.parametrize("kind", ["index", "ring", "fifth"])
def test_equal_tendon_forces_give_no_joint_torque(kind):
    state = states(kind)[0] | {"f": np.full(sizes(kind)["f"], 40.0)}
    assert np.max(np.abs(witness(kind, "joint_torque", state))) < 1e-15


@pytest.mark.parametrize("kind", KINDS)
def test_joints_receive_the_power_that_tendons_give(kind):
    for state in states(kind):
        lengthening = direction(kind, "tendon_lengths", state, q=state["qd"])
        power = by_definition(kind, "joint_torque", state) @ state["qd"]
        assert power == pytest.approx(-state["f"] @ lengthening, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_stiffness_is_minus_the_derivative_of_the_torque_of_elastic_tendons(kind):
    for state in states(kind):
        for step, column in zip(np.eye(len(state["q"])), square(kind, "joint_stiffness", state).T, strict=True):
            stretching = state["k"] * direction(kind, "tendon_lengths", state, q=step)
            assert_close(column, -direction(kind, "joint_torque", state, q=step, f=stretching), 1e-11)


def test_stiffness_of_taut_antagonists_is_positive_definite():
    stiffness = square("index", "joint_stiffness", states("index")[0])
    assert np.linalg.eigvalsh(stiffness).min() > 0


def test_span_is_the_distance_of_its_ends():
    finger = make("thumb", plain)
    in_the_base_frame_of_pip, in_the_base = finger.pulled[3].span, finger.pulled[7].span
    for state in states("thumb"):
        lengths = witness("thumb", "tendon_lengths", state)
        metacarpal = witness("thumb", "link_poses", state).reshape(-1, 4, 4)[1]
        x, y, z = in_the_base_frame_of_pip.to  # turned by x-90 against the metacarpal, at its end
        end = metacarpal[:3, 3] + metacarpal[:3, :3] @ np.add(finger.links[1].offset, (x, z, -y))
        assert lengths[3] == pytest.approx(math.dist(end, in_the_base_frame_of_pip.from_), rel=1e-14)
        assert lengths[7] == pytest.approx(math.dist(in_the_base.to, in_the_base.from_), rel=1e-14)
