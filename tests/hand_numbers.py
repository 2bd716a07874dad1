"""A hand file evaluated in plain NumPy, by other formulas than those of the package, to judge what was imported."""

from __future__ import annotations

import math
import tomllib
from itertools import pairwise
from typing import Any

import numpy as np

from awiwi_gen.units import parse_quantity


def numbers(node: Any) -> Any:
    """A hand file's tables with SI numbers in place of quantities; names and sources stay."""
    if isinstance(node, dict):
        kept = ("source", "joint", "kind", "turn", "link", "over", "follower", "leader", "prefix", "name")
        return {key: value if key in kept else numbers(value) for key, value in node.items()}
    if isinstance(node, list):
        return [numbers(value) for value in node]
    return float(parse_quantity(node)) if isinstance(node, str) else node


def fingers_of(text: str) -> dict[str, Any]:
    return numbers(tomllib.loads(text)["fingers"])


def about(axis: str, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    if axis == "x":
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    if axis == "y":
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def rpy_matrix(rpy: list[float]) -> np.ndarray:
    return about("z", rpy[2]) @ about("y", rpy[1]) @ about("x", rpy[0])


def turn_matrix(turn: str) -> np.ndarray:
    return np.eye(3) if turn == "none" else about(turn[0], math.radians(int(turn[1:])))


def coordinates(finger: dict[str, Any]) -> tuple[list[str], np.ndarray]:
    """Independent joints, and the matrix (links x joints) from their angles to those of all links."""
    radii = {pulley["joint"]: pulley["radius"] for pulley in finger.get("pulleys", [])}
    couplings = {each["follower"]: each for each in finger.get("couplings", [])}
    free = [link["joint"] for link in finger["links"] if link["joint"] not in couplings]
    matrix = np.zeros((len(finger["links"]), len(free)))
    for row, link in enumerate(finger["links"]):
        coupling = couplings.get(link["joint"])
        ratio = 1.0
        if coupling:
            ratio = coupling["ratio"] if "ratio" in coupling else radii[coupling["leader"]] / radii[link["joint"]]
        matrix[row, free.index(coupling["leader"] if coupling else link["joint"])] = ratio
    return free, matrix


def link_angles(finger: dict[str, Any], q: np.ndarray) -> np.ndarray:
    """The angles of all joints from those of the independent ones."""
    offsets = {each["follower"]: each.get("offset", 0.0) for each in finger.get("couplings", [])}
    return coordinates(finger)[1] @ q + np.array([offsets.get(link["joint"], 0.0) for link in finger["links"]])


def slides(link: dict[str, Any]) -> bool:
    return link.get("kind") == "slide"


def poses(finger: dict[str, Any], angles: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Axes and origin of every link, and of the tip, in the base frame."""
    found, axes, origin = [], np.eye(3), np.zeros(3)
    for link, angle in zip(finger["links"], angles, strict=True):
        fixed = turn_matrix(link.get("turn", "none")) @ rpy_matrix(link.get("rpy", [0.0, 0.0, 0.0]))
        moved = angle - link.get("reference", 0.0)
        if slides(link):
            axes = axes @ fixed
            origin = origin + axes[:, 2] * moved
        else:
            axes = axes @ fixed @ about("z", moved)
        found.append((axes, origin))
        origin = origin + axes @ np.array(link["offset"])
    return [*found, (axes, origin)]


def mass_matrix(finger: dict[str, Any], q: np.ndarray) -> np.ndarray:
    """By the velocities of the bodies: sum of m v v + w I w, and the armatures."""
    matrix = coordinates(finger)[1]
    frames = poses(finger, link_angles(finger, q))
    total = np.zeros((len(finger["links"]),) * 2)
    for i, link in enumerate(finger["links"]):
        total[i, i] += link.get("armature", 0.0)
        if "mass" not in link:
            continue
        axes, origin = frames[i]
        centre = origin + axes @ np.array(link["com"])
        J = np.zeros((6, len(finger["links"])))
        for k in range(i + 1):
            axis = frames[k][0][:, 2]
            lever = np.cross(axis, centre - frames[k][1])
            J[:, k] = [*axis, 0, 0, 0] if slides(finger["links"][k]) else [*lever, *axis]
        t = link["inertia"]
        tensor = np.array([[t["xx"], t["xy"], t["xz"]], [t["xy"], t["yy"], t["yz"]], [t["xz"], t["yz"], t["zz"]]])
        total += (
            J.T
            @ np.block([[link["mass"] * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), axes @ tensor @ axes.T]])
            @ J
        )
    return matrix.T @ total @ matrix


def gravity_torque(finger: dict[str, Any], q: np.ndarray, g: np.ndarray) -> np.ndarray:
    """What holds the finger against gravity g in the base frame."""
    matrix = coordinates(finger)[1]
    frames = poses(finger, link_angles(finger, q))
    torque = np.zeros(len(finger["links"]))
    for i, link in enumerate(finger["links"]):
        if "mass" in link:
            centre = frames[i][1] + frames[i][0] @ np.array(link["com"])
            for k in range(i + 1):
                axis = frames[k][0][:, 2]
                moves = axis if slides(finger["links"][k]) else np.cross(axis, centre - frames[k][1])
                torque[k] -= link["mass"] * g @ moves
    return matrix.T @ torque


def tendon_lengths(finger: dict[str, Any], q: np.ndarray) -> np.ndarray:
    angles = dict(zip([link["joint"] for link in finger["links"]], link_angles(finger, q), strict=True))
    frames = dict(zip(angles, poses(finger, np.array(list(angles.values())))[:-1], strict=True))
    frames["palm"] = (np.eye(3), np.zeros(3))
    radii = {pulley["joint"]: pulley["radius"] for pulley in finger.get("pulleys", [])}
    lengths = []
    for tendon in finger.get("tendons", []):
        points = [frames[p["link"]][1] + frames[p["link"]][0] @ np.array(p["at"]) for p in tendon.get("path", [])]
        straight = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
        arcs = sum(float(f"{over[0]}1") * radii[over[1:]] * angles[over[1:]] for over in tendon.get("over", []))
        arcs += sum(arm * angles[j] for j, arm in tendon.get("arms", {}).items())
        lengths.append(tendon["rest"] + straight + arcs)
    return np.array(lengths)
