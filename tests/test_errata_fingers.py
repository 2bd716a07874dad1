"""Misprints of chapters 2 and 5 that no other test meets: each printed formula fails, each mended one holds."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import quad
from textbook import coordinates, joint_torques
from thumbs import SHIPPED, replaced

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.units import parse_quantity

G = np.array([3.0, -7.0, 6.0])


def compiled(text, only):
    job = Job(Hand.parse(text), only=only)
    return load(cached_tree(job), job.store)


def motions(lib, finger, count=60):
    port = lib[f"{finger}_inverse_dynamics"].inputs[0]
    random = np.random.default_rng(21)
    q = random.uniform(port["low"], port["high"], (count, len(port["low"])))
    return q, random.uniform(-20, 20, q.shape), random.uniform(-2000, 2000, q.shape)


# -- chapter 2 -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("misprint", ["2.5", "2.8", "2.10", "2.13", "2.14", "5.2"])
def test_the_recursion_taken_literally_gives_other_torques(lib, hand, misprint):
    """Measured on the thumb, whose axes cross twice; without a misprint the same recursion agrees to rounding."""
    q, qd, qdd = motions(lib, "thumb")
    compiled_torques = lib.thumb_inverse_dynamics(q, qd, qdd, G)

    def error(*taken):
        found = [joint_torques(hand.fingers["thumb"], *m, G, *taken) for m in zip(q, qd, qdd, strict=True)]
        return np.abs(np.array(found) - compiled_torques).max() / np.abs(compiled_torques).max()

    assert error() < 1e-14
    assert error(misprint) > 0.005


def test_equation_2_5_without_a_start_value_leaves_gravity_out(lib, hand):
    q, still = motions(lib, "thumb")[0][0], np.zeros(4)

    assert not joint_torques(hand.fingers["thumb"], q, still, still, G, "2.5").any()
    assert np.abs(lib.thumb_gravity(q, G)).min() > 1e-5


def test_equation_2_17_multiplies_the_velocities_by_a_matrix(lib):
    q, qd, _ = motions(lib, "index")

    assert lib.index_coriolis_matrix(q, qd).shape == (*q.shape, 4)


# -- chapter 5: rigid fingers ----------------------------------------------------------------------------


def test_table_5_1_with_a_zero_in_the_corner_forgets_where_the_finger_is_mounted():
    mount, table = np.eye(4), np.eye(4)
    mount[:3, 3], table[0, 3] = (0.05, 0.02, 0.01), 0.006
    printed = table.copy()
    printed[3, 3] = 0.0

    assert (mount @ table)[:3, 3] == pytest.approx([0.056, 0.02, 0.01])
    assert not (mount @ printed @ [0, 0, 0, 1])[:3] @ [0, 1, 1]  # y and z of the mount are lost
    assert np.linalg.det(printed) == 0


def test_the_modulus_of_the_fibre_is_a_stress():
    """k = E S / l is a stiffness for E in N/m^2, not in N/m as printed in section 5.1."""
    section, length, stiffness = (parse_quantity(text).unit for text in ("1 mm^2", "1 m", "1 N/m"))

    assert parse_quantity("1 N/m^2").unit * section / length == stiffness
    assert parse_quantity("1 N/m").unit * section / length != stiffness


def test_equation_5_4_needs_both_potentials_with_a_minus(lib):
    """At rest, the torque that holds a finger is dV/dq = -dL/dq for L = T - V; L = T + V pulls it down twice."""
    q = motions(lib, "index")[0]
    still, step = np.zeros_like(q), 1e-5

    def potential(at):
        return lib.index_energy(at, still, G).potential

    slope = np.stack([potential(q + step * e) - potential(q - step * e) for e in np.eye(4)], axis=-1) / (2 * step)
    held = lib.index_inverse_dynamics(q, still, still, G)

    np.testing.assert_allclose(held, slope, atol=1e-10)
    assert np.abs(held + slope).max() > 1e-2 * np.abs(held).max()


def test_the_elastic_energy_is_the_integral_of_the_force():
    """For k = k0 + k1 h the printed half integral of k h is neither that integral nor what a straight spring stores."""
    k0, k1, h = 4e3, 3e5, 0.01

    def force(x):
        return quad(lambda s: k0 + k1 * s, 0, x)[0]

    energy = quad(force, 0, h)[0]
    printed = quad(lambda s: (k0 + k1 * s) * s, 0, h)[0] / 2

    assert energy == pytest.approx(k0 * h**2 / 2 + k1 * h**3 / 6, rel=1e-12)
    assert energy == pytest.approx(quad(lambda s: (h - s) * (k0 + k1 * s), 0, h)[0], rel=1e-12)
    assert printed == pytest.approx(k0 * h**2 / 4 + k1 * h**3 / 6, rel=1e-12)


def test_abduction_stays_at_rest_only_without_the_offsets_along_the_axes():
    """Section 5.2.2 has it rest while the finger oscillates, but table 5.1 shifts the distal links out of the plane."""
    thumb, index, others = re.split(r"(?=\[fingers\.index\]|\[fingers\.middle\])", SHIPPED)
    flat = replaced(index, r'com = \["([\d.]+ mm)", "[^"]*", "[^"]*"\]', r'com = ["\g<1>", "0 mm", "0 mm"]', 4)
    flat = replaced(flat, r'(x[yz]|yz) = "[^"]*"', r'\g<1> = "0 g mm^2"', 12)
    plane = replaced(flat, r'"0 mm", "-[\d.]+ mm"\]', '"0 mm", "0 mm"]', 2)
    masses = [compiled(thumb + text + others, "index_mass_matrix").index_mass_matrix for text in (flat, plane)]
    coupled = [mass([0.0, 0.1, 0.2, 0.3])[0, 1:] for mass in masses]

    assert np.abs(coupled[0]).max() > 1e-8
    assert np.abs(coupled[1]).max() < 1e-20


# -- chapter 5: tendons ----------------------------------------------------------------------------------


def test_equation_5_8_takes_the_power_of_the_joints_from_the_tendons(lib):
    """tau = -P' f with the path lengths h of eq. 5.5: a tendon that gets shorter does work on the joints."""
    q, qd, _ = motions(lib, "thumb")
    f = np.random.default_rng(2).uniform(0, 100, (len(q), 8))
    rate = (lib.thumb_coupling(q) @ qd[..., None])[..., 0]
    tau = lib.thumb_joint_torque(q, f)
    printed = (lib.thumb_coupling(q).swapaxes(1, 2) @ f[..., None])[..., 0]

    np.testing.assert_allclose((tau * qd).sum(axis=1), -(f * rate).sum(axis=1), atol=1e-12)
    np.testing.assert_allclose(tau, -printed, atol=1e-13)


def test_equation_5_9_has_its_rows_in_another_order(lib, hand):
    r20, r21, r22, r23 = (float(hand.fingers["index"].radii[joint]) for joint in hand.fingers["index"].joints)
    printed = np.array([
        [r20, -r21, 0, 0], [-r20, -r21, 0, 0], [r20, r21, 0, 0], [-r20, r21, 0, 0],
        [0, 0, -r22, 0], [0, 0, r22, 0], [0, 0, r22, -r23], [0, 0, -r22, r23],
    ])  # fmt: skip
    P = lib.index_coupling(np.zeros(4))

    np.testing.assert_array_equal(printed, P[np.array([2, 4, 1, 3, 6, 5, 7, 8]) - 1])
    assert not np.array_equal(printed, P)
    assert not np.array_equal(printed, -P)


@pytest.mark.parametrize("finger", ["thumb", "index", "middle", "ring", "fifth"])
def test_equation_5_10_needs_a_minus_for_a_stiffness_that_holds(lib, finger):
    q = motions(lib, finger)[0]
    m = lib[f"{finger}_joint_torque"].inputs[1]["shape"][0]
    K = lib[f"{finger}_joint_stiffness"](q, np.zeros(m), np.full(m, 5e3))

    assert np.linalg.eigvalsh(K).min() > 0


def test_equation_5_16_has_its_ratio_upside_down(lib, hand):
    """The coupling tendon rolls on both pulleys, so what one takes the other gives: r42 q42 = r43 q43."""
    ring = hand.fingers["ring"]
    r42, r43 = float(ring.radii["pip"]), float(ring.radii["dip"])
    poses = lib.ring_link_poses([0.0, 0.0, 0.3])[..., :3, :3]
    bend = poses[2].T @ poses[3]  # from the medial to the distal phalanx

    assert np.arctan2(bend[1, 0], bend[0, 0]) * r43 == pytest.approx(0.3 * r42, rel=1e-14)
    assert r43 / r42 != pytest.approx(r42 / r43, rel=0.1)


def test_equation_5_18_drives_the_coupled_joints_by_other_arms_than_printed(hand):
    """A tendon over both pulleys of the ring moves by 2 r42 per radian if it winds the same way, else not at all."""
    ring = hand.fingers["ring"]
    r42, r43 = float(ring.radii["pip"]), float(ring.radii["dip"])
    head, tail = SHIPPED.split("[fingers.ring]")
    body, rest = tail.split("couplings", 1)
    both = replaced(body, r'over = \["-pip"\]', 'over = ["-pip", "-dip"]', 1)
    both = replaced(both, r'over = \["\+pip"\]', 'over = ["+pip", "+dip"]', 1)
    P = compiled(f"{head}[fingers.ring]{both}couplings{rest}", "ring_coupling").ring_coupling(np.zeros(3))
    against = np.array([r42, -r43]) @ coordinates(ring)[2:, 2]

    np.testing.assert_allclose(P[4:, 2], [2 * r42, -2 * r42], rtol=1e-15)
    assert abs(2 * r42 - (r42 + r43)) > 1e-3
    assert abs(against) < 1e-18
    assert [len(finger.tendons) for finger in hand.fingers.values()] == [8, 8, 8, 6, 8]  # 38 with two for PIP and DIP


def test_equation_5_21_is_minus_the_derivative_of_5_22(lib, hand):
    r12, r13 = (float(hand.fingers["thumb"].radii[joint]) for joint in ("pip", "dip"))
    printed = np.array([[-r12, 0], [r12, 0], [r12, -r13], [-r12, r13]])
    P = lib.thumb_coupling([0.1, -0.2, 0.3, 0.4])

    assert P.shape == (8, 4)  # not 4 x 8
    np.testing.assert_array_equal(P[4:, 2:], -printed)
    assert not P[4:, :2].any()
