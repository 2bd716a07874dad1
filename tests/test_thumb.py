"""The thumb's base: four straight tendons from the palm to the bone below PIP, in both readings of table 5.2."""

from __future__ import annotations

import numpy as np
import pytest
from textbook import fixed_turn, rotation_z, vector
from thumbs import SHIPPED, literal, thumb, wider

READINGS = {"literal": lambda: wider(literal(SHIPPED)), "tenth": lambda: wider(SHIPPED)}
BASE = slice(0, 4)  # the tendons that run straight


@pytest.fixture(scope="session", params=READINGS)
def reading(request):
    return request.param, *thumb(READINGS[request.param]())


def poses(count=300):
    random = np.random.default_rng(11)
    q = random.uniform(-1, 1, (count, 4))
    q[:, 2:] = np.abs(q[:, 2:])
    return q


def ends(hand):
    """Palmar and distal points (4, 3) [m] of the straight tendons."""
    spans = [tendon.span for tendon in hand.fingers["thumb"].tendons[BASE]]
    return np.array([vector(s.from_) for s in spans]), np.array([vector(s.to) for s in spans])


def moved(hand, q, order=(0, 0)):
    """Distal points (4, 3) [m] in the palm, or a derivative by both base joints, from eq. 5.19 spelled out."""

    def turn(angle, times):
        quarter = np.diag([1.0, 1.0, 0.0]) @ rotation_z(np.pi / 2)  # the derivative of a rotation is one turned further
        return rotation_z(angle) if times == 0 else np.linalg.matrix_power(quarter, times) @ rotation_z(angle)

    flexion, abduction, pip, _ = hand.fingers["thumb"].links
    _, local = ends(hand)
    bone = local @ fixed_turn(pip.turn).T + vector(abduction.offset)
    body = bone @ (fixed_turn(abduction.turn) @ turn(q[1], order[1])).T
    return (body + (vector(flexion.offset) if order[1] == 0 else 0)) @ turn(q[0], order[0]).T


def test_the_palmar_and_the_distal_points_are_separate_numbers(hand):
    numbers = hand.fingers["thumb"].quantities()

    assert all(f"tendons[{i}].span.{end}[1]" in numbers for i in range(4) for end in ("from", "to"))


def test_lengths_and_couplings_of_the_straight_thumb_are_those_of_the_reading(reading):
    name, _, lib = reading
    length, arms = {"literal": (51.0, (30.0, 25.0)), "tenth": (61.93747, (25.57418, 19.13220))}[name]  # mm
    signs = np.array([[-1, 1], [-1, -1], [1, 1], [1, -1]])

    np.testing.assert_allclose(lib.thumb_tendon_lengths(np.zeros(4))[BASE] * 1e3, length, atol=1e-5)
    np.testing.assert_allclose(lib.thumb_coupling(np.zeros(4))[BASE, :2] * 1e3, signs * arms, atol=1e-5)


def test_lengths_are_distances_between_the_points(reading):
    _, hand, lib = reading
    palmar, _ = ends(hand)
    q = poses()
    distances = [np.linalg.norm(moved(hand, one) - palmar, axis=1) for one in q]

    np.testing.assert_allclose(lib.thumb_tendon_lengths(q)[:, BASE], distances, rtol=0, atol=1e-16 * 4)


def test_the_coupling_projects_the_motion_of_the_point_on_the_tendon(reading):
    """P_ij = (A - A0) . dA/dq_j / h_i, the derivative of eq. 5.20; the distal joints do not move these tendons."""
    _, hand, lib = reading
    palmar, _ = ends(hand)
    for q in poses(100):
        run = moved(hand, q) - palmar
        expected = [(run * moved(hand, q, order)).sum(axis=1) for order in ((1, 0), (0, 1))]
        P = lib.thumb_coupling(q)[BASE]

        np.testing.assert_allclose(P[:, :2], np.transpose(expected / np.linalg.norm(run, axis=1)), atol=1e-16)
        assert not P[:, 2:].any()


def test_the_coupling_derivative_has_its_closed_form(reading):
    """d2h/dq_j dq_k = (A_j . A_k + (A - A0) . A_jk - P_j P_k) / h."""
    _, hand, lib = reading
    palmar, _ = ends(hand)
    for q in poses(100):
        run, first = moved(hand, q) - palmar, [moved(hand, q, order) for order in ((1, 0), (0, 1))]
        second = [[moved(hand, q, order) for order in row] for row in (((2, 0), (1, 1)), ((1, 1), (0, 2)))]
        h = np.linalg.norm(run, axis=1)
        P = [(run * a).sum(axis=1) / h for a in first]
        found = lib.thumb_coupling_derivative(q)
        for j in range(2):
            for k in range(2):
                expected = ((first[j] * first[k]).sum(axis=1) + (run * second[j][k]).sum(axis=1) - P[j] * P[k]) / h

                np.testing.assert_allclose(found[BASE, j, k], expected, atol=1e-15)


def test_the_geometric_stiffness_is_the_force_times_the_bend_of_the_lengths(reading):
    """K = P' K_t P + sum of f_i d2h_i/dq2, with a plus for lengths of the path (eq. 5.12, 5.23)."""
    _, _, lib = reading
    random, q = np.random.default_rng(3), poses()
    f, k = random.uniform(0, 100, (len(q), 8)), random.uniform(1e3, 5e4, (len(q), 8))
    P, second = lib.thumb_coupling(q), lib.thumb_coupling_derivative(q)
    elastic = np.einsum("sij,si,sik->sjk", P, k, P)
    geometric = np.einsum("si,sijk->sjk", f, second)

    np.testing.assert_allclose(lib.thumb_joint_stiffness(q, f, k), elastic + geometric, atol=1e-13)
    assert np.abs(geometric).max() > 0.02 * np.abs(elastic).max()  # it may not be left out


def test_the_stiffness_is_the_falling_torque_while_the_motors_stand_still(reading):
    """K = -d tau/dq for tendons that stiffen as they stretch: f = k0 x + k1 x^2, x = h(q) + x0."""
    _, _, lib = reading
    q = poses()
    k0, k1, x0 = 4e3, 1.5e6, 2e-3 - lib.thumb_tendon_lengths(q)

    def torque(at):
        x = lib.thumb_tendon_lengths(at) + x0
        return lib.thumb_joint_torque(at, k0 * x + k1 * x**2)

    step, unit = 1e-3, np.eye(4)
    slopes = [  # of fourth order
        (8 * (torque(q + step * e) - torque(q - step * e)) - torque(q + 2 * step * e) + torque(q - 2 * step * e)) / 12
        for e in unit
    ]
    x = lib.thumb_tendon_lengths(q) + x0
    K = lib.thumb_joint_stiffness(q, k0 * x + k1 * x**2, k0 + 2 * k1 * x)

    np.testing.assert_allclose(K, -np.stack(slopes, axis=-1) / step, rtol=0, atol=1e-8 * np.abs(K).max())


def tensible(lib, q):
    """Whether four pulling tendons can balance: whether zero lies within the four directions that they pull in."""
    pull = lib.thumb_coupling(np.concatenate([q, np.zeros_like(q)], axis=-1))[..., BASE, :2]
    angles = np.sort(np.arctan2(pull[..., 1], pull[..., 0]), axis=-1)
    gaps = np.diff(angles, axis=-1, append=angles[..., :1] + 2 * np.pi)
    return gaps.max(axis=-1) < np.pi


def test_only_close_distal_points_let_all_tendons_pull_over_a_human_range(reading):
    name, _, lib = reading
    axis = np.linspace(-1, 1, 41)
    q = np.stack(np.meshgrid(axis, axis), axis=-1)
    held = tensible(lib, q)
    inner = np.linalg.norm(q, axis=-1) <= 0.6

    assert held[inner].all()
    assert held.sum() == {"literal": 1211, "tenth": 1681}[name]
