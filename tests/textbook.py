"""Newton and Euler's recursion as the source prints it (eq. 2.4 to 2.15), mended, on plain arrays.

It shares nothing with the package but the numbers. Complex joint angles pass through it, so that its derivatives are
exact to rounding. Misprints can be put back by their equation's number.
"""

from __future__ import annotations

import numpy as np

Z = np.array([0.0, 0.0, 1.0])


def rotation_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0 * c], [s, c, 0 * c], [0 * c, 0 * c, 1 + 0 * c]])


def fixed_turn(turn):
    """A turn such as "x+90" of the hand file as a matrix."""
    if turn == "none":
        return np.eye(3)
    axis, sine = "xyz".index(turn[0]), int(turn[1:]) / 90
    matrix = np.zeros((3, 3))
    after, last = (axis + 1) % 3, (axis + 2) % 3
    matrix[axis, axis], matrix[last, after], matrix[after, last] = 1, sine, -sine
    return matrix


def roll_pitch_yaw(rpy):
    """The rotation of URDF's fixed angles, written out."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rotations(finger, angles):
    """From coordinates of each link to those of the one before, at the angles (links) of all joints."""
    fixed = [fixed_turn(link.turn) @ roll_pitch_yaw(vector(link.rpy or (0, 0, 0))) for link in finger.links]
    drawn = [float(link.reference or 0) for link in finger.links]
    return [F @ rotation_z(angle - zero) for F, angle, zero in zip(fixed, angles, drawn, strict=True)]


def passive_torques(finger, q, qd):
    """Torques (n) [N m] of springs, damping and friction in the joints."""
    W, torques = coordinates(finger), []
    for link, angle, speed in zip(finger.links, W @ q, W @ qd, strict=True):
        torque = float(link.damping or 0) * speed
        if link.friction:
            torque += float(link.friction.torque) * 2 / np.pi * np.arctan(speed / float(link.friction.velocity))
        if link.spring:
            torque += float(link.spring.stiffness) * (angle - float(link.spring.reference))
        torques.append(torque)
    return W.T @ torques


def armature(finger):
    """What rotors add to the mass matrix (n x n) [kg m^2]."""
    W = coordinates(finger)
    return W.T @ np.diag([float(link.armature or 0) for link in finger.links]) @ W


def vector(quantities):
    return np.array([float(x) for x in quantities])


def tensor(inertia):
    xx, yy, zz, xy, xz, yz = (float(getattr(inertia, name)) for name in ("xx", "yy", "zz", "xy", "xz", "yz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def coordinates(finger):
    """W (links, n): joint angles of all links from the independent ones, W q, by the couplings' pulleys."""
    joints = [link.joint for link in finger.links]
    W = np.zeros((len(joints), len(finger.joints)))
    for row, joint in enumerate(joints):
        leader = finger.leaders.get(joint, joint)
        ratio = 1.0 if leader == joint else float(finger.radii[leader]) / float(finger.radii[joint])
        W[row, finger.joints.index(leader)] = ratio
    return W


def joint_torques(finger, q, qd, qdd, g, *misprints):
    """Joint torques (n) [N m] of a motion of the links; ``misprints`` are equation numbers to take literally."""
    W = coordinates(finger)
    q, qd, qdd = W @ q, W @ qd, W @ qdd
    turns = rotations(finger, q)
    offsets = [vector(link.offset) for link in finger.links]
    spin, turning = np.zeros(3, q.dtype), np.zeros(3, q.dtype)
    acceleration = np.zeros(3) if "2.5" in misprints else -np.asarray(g)  # 2.5 does not tell where gravity enters
    loads, before = [], np.zeros(3)
    for link, turn, velocity, rate in zip(finger.links, turns, qd, qdd, strict=True):
        if "5.2" in misprints:  # chapter 5's sense of the indices in the formulas of chapter 2
            turn = turn.T
        acceleration = turn.T @ (np.cross(turning, before) + np.cross(spin, np.cross(spin, before)) + acceleration)
        swept = np.cross(turn.T @ spin, velocity * Z)
        if "2.8" in misprints:  # the rotation of the whole product
            swept = turn.T @ np.cross(spin, velocity * Z)
        turning = turn.T @ turning + swept + rate * Z
        spin = turn.T @ spin + velocity * Z
        mass, com, inertia = float(link.mass or 0), vector(link.com or (0, 0, 0)), np.zeros((3, 3))
        if link.inertia:
            inertia = tensor(link.inertia)
        centripetal = np.cross(spin, np.cross(spin, com))
        if "2.10" in misprints:  # from left to right
            centripetal = np.cross(np.cross(spin, spin), com)
        force = mass * (acceleration + np.cross(turning, com) + centripetal)
        loads.append((force, inertia @ turning + np.cross(spin, inertia @ spin), com))
        before = vector(link.offset)

    torques = np.zeros(len(q), q.dtype)
    force, moment = np.zeros(3, q.dtype), np.zeros(3, q.dtype)
    for i in reversed(range(len(q))):
        own, own_moment, com = loads[i]
        arm = offsets[i - 1] if "2.14" in misprints and i else offsets[i]  # p of the next joint, not of this one
        after = turns[i + 1] if i + 1 < len(q) else np.eye(3)
        passed, passed_moment = after @ force, after @ moment
        if "2.13" in misprints:  # the rotation with its indices swapped
            passed, passed_moment = after.T @ force, after.T @ moment
        moment = own_moment + passed_moment + np.cross(com, own) + np.cross(arm, passed)
        force = passed + own
        torques[i] = moment[2]
    return W.T @ torques
