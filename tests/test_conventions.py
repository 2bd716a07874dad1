"""What docs/conventions.md claims about signs, frames and layout and no other test shows, on the compiled hand."""

from __future__ import annotations

import numpy as np
import pytest

Q = np.array([0.1, 0.4, 0.6, 0.3])
UP = np.array([0.0, 0.0, 1.0])


def turn_about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def floats(values) -> np.ndarray:
    return np.array([float(value) for value in values])


def test_a_pose_maps_coordinates_of_the_link_into_those_of_the_base(lib, hand):
    first, second = lib.index_link_poses(Q)[:2]
    offset = floats(hand.fingers["index"].links[0].offset)

    assert first[:3, :3] == pytest.approx(turn_about_z(Q[0]))
    assert second[:3, 3] == pytest.approx(first[:3, :3] @ offset + first[:3, 3])
    assert second[3] == pytest.approx([0, 0, 0, 1])


def test_a_positive_angle_turns_counter_clockwise_about_the_joints_z_axis(lib):
    straight, turned = lib.index_link_poses(np.zeros(4)), lib.index_link_poses([0, 0.2, 0, 0])

    assert straight[1, :3, :3].T @ turned[1, :3, :3] == pytest.approx(turn_about_z(0.2))


def test_matrices_are_stored_row_by_row(lib):
    step = 1e-6
    rates = [
        (lib.thumb_tendon_lengths(Q + step * e) - lib.thumb_tendon_lengths(Q - step * e)) / 2 / step for e in np.eye(4)
    ]
    coupling = lib.thumb_coupling(Q)
    memory = lib.ffi.new("double[32]")
    lib.c.awiwi_thumb_coupling(list(Q), memory)

    assert coupling.shape == (8, 4)
    assert coupling == pytest.approx(np.array(rates).T, abs=1e-9)
    assert list(memory) == coupling.ravel(order="C").tolist()


def test_the_jacobian_has_the_velocity_above_the_angular_velocity(lib):
    tip, J = lib.index_fingertip_pose(Q), lib.index_jacobian(Q)

    assert J[3:, 0] == pytest.approx(UP)  # the first joint turns about z of the base
    assert J[:3, 0] == pytest.approx(np.cross(UP, tip[:3, 3]))


def test_a_positive_sense_lengthens_the_path_by_radius_times_angle(lib, hand):
    radius = float(hand.fingers["index"].radii["pip"])
    longer = lib.index_tendon_lengths([0, 0, 0.5, 0]) - lib.index_tendon_lengths(np.zeros(4))
    senses = [("+pip" in tendon.over) - ("-pip" in tendon.over) for tendon in hand.fingers["index"].tendons]

    assert longer == pytest.approx(np.multiply(senses, 0.5 * radius))


def test_tendons_pull_so_that_their_paths_get_shorter(lib, hand):
    radius = float(hand.fingers["index"].radii["pip"])
    pull = np.zeros(8)
    pull[4] = 10.0

    assert hand.fingers["index"].tendons[4].over == ("+pip",)
    assert lib.index_joint_torque(Q, pull) == pytest.approx([0, 0, -10 * radius, 0])


def test_gravity_is_the_acceleration_of_free_fall_in_the_base_frame(lib, hand):
    links, poses = hand.fingers["index"].links, lib.index_link_poses(Q)
    masses = floats(link.mass for link in links)
    centres = [pose[:3] @ [*floats(link.com), 1] for pose, link in zip(poses, links, strict=True)]
    height = masses @ np.array(centres)[:, 2]

    assert lib.index_energy(Q, np.zeros(4), -9.81 * UP).potential == pytest.approx(9.81 * height)


def test_gravity_torques_are_what_holds_the_finger(lib):
    g = np.array([1.0, -2.0, -9.0])
    held = lib.index_forward_dynamics(q=Q, qd=np.zeros(4), tau=lib.index_gravity(Q, g), g=g)

    assert held == pytest.approx(np.zeros(4), abs=1e-9)
    assert lib.index_inverse_dynamics(Q, np.zeros(4), np.zeros(4), g) == pytest.approx(lib.index_gravity(Q, g))


def test_a_joint_that_follows_is_no_coordinate(lib, hand):
    ring = hand.fingers["ring"]
    ratio = float(ring.radii["pip"]) / float(ring.radii["dip"])
    poses = lib.ring_link_poses([0.1, 0.2, 0.7])

    assert ring.joints == ("abduction", "flexion", "pip")
    assert poses[2, :3, :3].T @ poses[3, :3, :3] == pytest.approx(turn_about_z(0.7 * ratio))


def test_a_motors_torque_winds_the_tendon_up_against_its_force(lib, hand):
    radius, still = float(hand.motor.pulley), {"theta": 0.3, "thd": 0.0}
    without, loaded = (lib.motor_acceleration(**still, tau=0.5, f=force).thdd for force in (0.0, 20.0))
    B = 2 * lib.motor_energy(1.0)

    assert without - loaded == pytest.approx(radius * 20.0 / B)


def test_angles_of_the_wrist_are_the_internal_ones(lib, hand):
    assert lib.wrist_palm_pose(*hand.wrist.neutral).T[:3, :3] == pytest.approx(np.eye(3), abs=1e-12)
