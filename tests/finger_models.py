"""Fingers of several structures, with both routes to every quantity of each, for the tests of the models."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from functools import cache
from importlib import import_module
from types import SimpleNamespace as Tree
from typing import Any

import casadi as ca
import numpy as np
import sympy

from awiwi_gen import definitions, witnesses
from awiwi_gen.definitions.naming import definitions as meanings
from awiwi_gen.hand.parts import Tendon

SAMPLES = 3
BASE = [[f"{a}abduction", f"{b}flexion"] for a, b in ("++", "+-", "-+", "--")]
SINGLE = [["+pip"], ["-pip"]]

# Joints with their turns, couplings (follower -> leader), the joint of a four-bar, tendons (routes, joints of spans, links
# of paths; a tendon with a path has an arm of its own at the last joint).
STRUCTURES: dict[str, dict[str, Any]] = {
    "index": {
        "joints": {"abduction": "none", "flexion": "x+90", "pip": "none", "dip": "none"},
        "routes": [*BASE, *SINGLE, ["+pip", "-dip"], ["-pip", "+dip"]],
    },
    "ring": {
        "joints": {"abduction": "none", "flexion": "x+90", "pip": "none", "dip": "none"},
        "couplings": {"dip": "pip"},
        "routes": [*BASE, *SINGLE],
    },
    "fifth": {
        "joints": {"hmc": "x+90", "abduction": "x-90", "flexion": "x+90", "pip": "none", "dip": "none"},
        "couplings": {"dip": "pip"},
        "four_bar": "hmc",
        "routes": [["+hmc"], ["-hmc"], *BASE, ["+dip"], ["-dip"]],
    },
    "thumb": {
        "joints": {"flexion": "none", "abduction": "x+90", "pip": "x-90", "dip": "none"},
        "routes": [*SINGLE, ["-pip", "+dip"]],
        "spans": ["pip", "pip", "dip", "abduction", "flexion"],
    },
    "short": {"joints": {"a": "y+90", "b": "y-90"}, "routes": [["+a", "-b"]], "spans": ["b"]},
    "jaw": {"joints": {"root": "x-90", "end": "none"}, "routes": [["+root", "-end"]]},
    "winch": {
        "joints": {"lead": "none", "loop": "y-90", "tip": "none"},
        "couplings": {"tip": "lead"},
        "four_bar": "loop",
        "routes": [["+loop"]],
    },
    # What no finger of the hand has: a four-bar in mid-chain, a parallel joint behind it, a follower elsewhere.
    "odd": {
        "joints": {"a": "z-90", "loop": "y+90", "b": "none", "c": "x+180", "d": "y-90"},
        "couplings": {"d": "b"},
        "four_bar": "loop",
        "routes": [["+d"], ["-loop", "+a"]],
        "spans": ["loop", "b", "d"],
        "paths": [["palm", "b", "b", "d"], ["d", "a"]],
    },
}
KINDS = list(STRUCTURES)
FOUR_BAR = {"ground": 0.012, "crank": 0.010, "coupler": 0.0075, "rocker": 0.011, "reference": 1.1}

# What joints may have besides, see tests/test_joint_dynamics.py.
NOTHING_ELSE = dict.fromkeys(("rpy", "reference", "armature", "damping", "friction", "spring"))

Leaf = Callable[[str, float], Any]


def make(kind: str, leaf: Leaf, **special: float) -> Tree:
    """A finger of random plausible numbers, each passed through `leaf(name, number)`; `special` replaces some."""
    structure, random_number = STRUCTURES[kind], random.Random(kind)  # noqa: S311 no secrets here

    def number(name: str, low: float, high: float) -> Any:
        drawn = random_number.uniform(low, high)
        return leaf(name, special.get(name, drawn))

    def point(name: str, low: float, high: float) -> tuple[Any, ...]:
        return tuple(number(f"{name}_{axis}", low, high) for axis in "xyz")

    def link(joint: str, turn: str) -> Tree:
        moments = {axes: number(f"{joint}_{axes}", 1e-7, 3e-7) for axes in ("xx", "yy", "zz")}
        products = {axes: number(f"{joint}_{axes}", -2e-8, 2e-8) for axes in ("xy", "xz", "yz")}
        offset = (number(f"{joint}_length", 0.01, 0.05), *point(f"{joint}_offset", -0.005, 0.005)[1:])
        loop = {key: leaf(f"{joint}_{key}", value) for key, value in FOUR_BAR.items()}
        return Tree(
            joint=joint,
            turn=turn,
            offset=offset,
            mass=number(f"{joint}_mass", 0.002, 0.02),
            com=point(f"{joint}_com", -0.01, 0.03),
            inertia=Tree(**moments, **products),
            start=0,
            slides=False,
            four_bar=Tree(**loop, branch=1) if joint == structure.get("four_bar") else None,
            **NOTHING_ELSE,
        )

    def span(index: int, joint: str) -> Tree:
        return Tree(from_=point(f"from{index}", -0.03, 0.03), to=point(f"to{index}", -0.03, 0.03), joint=joint)

    def tendon(rest: Any, **given: Any) -> Tree:
        found = Tree(**{"rest": rest, "over": [], "arms": {}, "span": None, "path": [], "spring": None, **given})
        found.runs = Tendon.runs.fget(found)
        return found

    routes = [tendon(number(f"rest{i}", 0, 0.1), over=over) for i, over in enumerate(structure["routes"])]
    spans = [tendon(leaf(f"slack{i}", 0.0), span=span(i, joint)) for i, joint in enumerate(structure.get("spans", []))]
    finger = Tree(
        links=[link(joint, turn) for joint, turn in structure["joints"].items()],
        pulleys=[Tree(joint=joint, radius=number(f"{joint}_radius", 0.004, 0.009)) for joint in structure["joints"]],
        couplings=[
            Tree(follower=one, leader=other, ratio=None, offset=None)
            for one, other in structure.get("couplings", {}).items()
        ],
    )
    paths = [
        tendon(
            leaf(f"path{i}", 0.0),
            path=[
                Tree(link=link, at=point(f"at{i}{k}", -0.03, 0.03), radius=None, divisor=None)
                for k, link in enumerate(links)
            ],
            arms={finger.links[-1].joint: number(f"arm{i}", 0.004, 0.009)},
        )
        for i, links in enumerate(structure.get("paths", []))
    ]
    finger.pulled, finger.strings = routes + spans + paths, []
    finger.transmissions = [Tree(members=[i], ratios=[]) for i in range(len(finger.pulled))]
    return finger


def plain(name: str, number: float) -> float:
    return number


QUANTITIES: dict[str, tuple[str, str]] = {
    "link_poses": ("kinematics", "q"),
    "fingertip_pose": ("kinematics", "q"),
    "jacobian": ("kinematics", "q"),
    "mass_matrix": ("dynamics", "q"),
    "coriolis_matrix": ("dynamics", "q qd"),
    "gravity": ("dynamics", "q g"),
    "bias": ("dynamics", "q qd g"),
    "inverse_dynamics": ("dynamics", "q qd qdd g"),
    "forward_dynamics": ("dynamics", "q qd tau g"),
    "dynamics": ("dynamics", "q qd g"),
    "energy": ("dynamics", "q qd g"),
    "tendon_lengths": ("tendons", "q"),
    "coupling": ("tendons", "q"),
    "coupling_derivative": ("tendons", "q"),
    "joint_torque": ("tendons", "q f"),
    "joint_stiffness": ("tendons", "q f k"),
}


def sizes(kind: str) -> dict[str, int]:
    """Length of each argument."""
    finger = make(kind, plain)
    n, m = len(finger.links) - len(finger.couplings), len(finger.pulled)
    return {"q": n, "qd": n, "qdd": n, "tau": n, "g": 3, "f": m, "k": m}


@cache
def states(kind: str) -> list[dict[str, np.ndarray]]:
    """Random arguments."""
    rng = np.random.default_rng(sum(kind.encode()))
    scales = {"q": 0.6, "qd": 5.0, "qdd": 50.0, "tau": 0.1, "g": 9.81, "f": 50.0, "k": 9000.0}
    found = [{a: rng.uniform(-scales[a], scales[a], n) for a, n in sizes(kind).items()} for _ in range(SAMPLES)]
    return [state | {"f": abs(state["f"]), "k": abs(state["k"])} for state in found]


@cache
def function(kind: str, quantity: str) -> Any:
    """The CasADi route as a function of its arguments, elements row by row; symbols only where a user has them."""
    subject, names = QUANTITIES[quantity]
    arguments = [ca.SX.sym(name, sizes(kind)[name]) for name in names.split()]
    result = getattr(import_module(f"{witnesses.__name__}.{subject}"), quantity)(make(kind, plain), *arguments)
    parts = result if isinstance(result, (list, tuple)) else [result]
    return ca.Function(quantity, arguments, [ca.vertcat(*(ca.vec(ca.SX(part).T) for part in parts))])


def witness(kind: str, quantity: str, state: dict[str, np.ndarray]) -> np.ndarray:
    """The CasADi route's numbers: one flat array."""
    return np.array(function(kind, quantity)(*(state[name] for name in QUANTITIES[quantity][1].split()))).ravel()


def square(kind: str, quantity: str, state: dict[str, np.ndarray]) -> np.ndarray:
    """The CasADi route's n x n matrix."""
    return witness(kind, quantity, state).reshape(2 * [len(state["q"])])


Definition = tuple[list[sympy.Expr], dict[sympy.Symbol, float], dict[str, list[sympy.Symbol]]]


@cache
def definition(kind: str, quantity: str, leaf: Leaf | None = None) -> Definition:
    """The SymPy route's elements row by row, the values of the finger's symbols, and the symbols of its arguments."""
    numbers: dict[sympy.Symbol, float] = {}

    def symbol(name: str, number: float) -> sympy.Symbol:
        named = sympy.Symbol(name, real=True)
        numbers[named] = number
        return named

    subject, names = QUANTITIES[quantity]
    symbols = {
        name: [sympy.Symbol(f"{name}[{i}]", real=True) for i in range(sizes(kind)[name])] for name in names.split()
    }
    derive = getattr(import_module(f"{definitions.__name__}.{subject}"), quantity)
    result = derive(make(kind, leaf or symbol), *(sympy.Matrix(s) for s in symbols.values()))
    parts = result if isinstance(result, (list, tuple)) else [result]
    return [e for part in parts for e in (part.flat() if hasattr(part, "flat") else [part])], numbers, symbols


def by_definition(kind: str, quantity: str, state: dict[str, np.ndarray]) -> np.ndarray:
    """The SymPy route's numbers: one flat array."""
    elements, numbers, symbols = definition(kind, quantity)
    known = dict(numbers)
    for name, own in symbols.items():
        known |= dict(zip(own, state[name].tolist(), strict=True))
    return np.array(evaluate(elements, known))


def evaluate(elements: list[sympy.Expr], known: dict[Any, float]) -> list[float]:
    """Values of expressions, names included, each shared part once."""
    functions = {sympy.sin: math.sin, sympy.cos: math.cos, sympy.acos: math.acos, sympy.atan2: math.atan2,
                 sympy.Add: lambda *terms: math.fsum(terms), sympy.Mul: lambda *factors: math.prod(factors),
                 sympy.Pow: pow}  # fmt: skip

    def value(expr: sympy.Expr) -> float:
        if expr not in known:
            known[expr] = float(expr) if expr.is_number else functions[expr.func](*map(value, expr.args))
        return known[expr]

    for name, meaning in meanings(elements):
        known[name] = value(meaning)
    return [value(sympy.sympify(element)) for element in elements]


def direction(kind: str, quantity: str, state: dict[str, np.ndarray], **rates: np.ndarray) -> np.ndarray:
    """Rate of a quantity while its arguments change at the given rates."""
    names = QUANTITIES[quantity][1].split()
    symbols = [ca.SX.sym(name, len(state[name])) for name in names]
    seeds = [ca.DM(rates.get(name, np.zeros(len(state[name])))) for name in names]
    rate = ca.jtimes(function(kind, quantity)(*symbols), ca.vertcat(*symbols), ca.vertcat(*seeds))
    return np.array(ca.Function("rate", symbols, [rate])(*(state[name] for name in names))).ravel()


def assert_close(found: np.ndarray, expected: np.ndarray, tolerance: float = 1e-12) -> None:
    assert np.shape(found) == np.shape(expected)
    assert np.max(np.abs(found - expected)) <= tolerance * max(np.max(np.abs(expected)), 1e-12)
