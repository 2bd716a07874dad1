"""No kernel is silently wrong at or past the edges of its ranges, nor for inputs that are no numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from awiwi_gen.emit.options import Options
from awiwi_gen.pipeline import Job
from awiwi_gen.verify.samples import draw

ROWS = slice(3, 6)  # samples inside the ranges
NOT_FINITE = (np.nan, np.inf, -np.inf)
BEYOND = (1.03, 2.0, 10.0)  # how far past the middle of a range, in parts of its half


@dataclass
class Tried:
    """A kernel's results where one element of its inputs is at an edge."""

    element: tuple[str, int]
    value: str
    status: np.ndarray | None
    outputs: np.ndarray


@pytest.fixture(scope="module")
def job(hand):
    return Job(hand)


def usual(kernel) -> dict[str, np.ndarray]:
    return {name: rows[ROWS] for name, rows in draw(kernel.inputs, kernel.path, np.float64, 12).items()}


def edges(kernel):
    """(port, element, label, value) of everything that is tried."""
    for name, port in kernel.inputs.items():
        for element, (low, high) in enumerate(port.bounds()):
            for value in NOT_FINITE:
                yield name, element, str(value), value
            for share in BEYOND:
                for sign in (-1, 1):
                    yield name, element, f"{sign * share} times", (low + high + sign * share * (high - low)) / 2


def results(kernel, function, inputs):
    """Status, or None, and all outputs in a row."""
    found = function(**{n: rows.reshape(-1, *kernel.inputs[n].shape) for n, rows in inputs.items()})
    fields = getattr(found, "_fields", None)
    outputs = [getattr(found, name) for name in kernel.outputs] if fields else [found]
    samples = len(next(iter(inputs.values())))
    flat = np.concatenate([np.reshape(output, (samples, -1)) for output in outputs], axis=1)
    return found.status if fields and "status" in fields else None, flat


def tries(kernel, function):
    """The results of all edges, computed at once."""
    base, places = usual(kernel), list(edges(kernel))
    inputs = {name: np.tile(rows, (len(places), 1)) for name, rows in base.items()}
    count = ROWS.stop - ROWS.start
    for i, (name, element, _, value) in enumerate(places):
        inputs[name][i * count : (i + 1) * count, element] = value
    status, outputs = results(kernel, function, inputs)
    for i, (name, element, label, _) in enumerate(places):
        rows = slice(i * count, (i + 1) * count)
        yield Tried((name, element), label, None if status is None else status[rows], outputs[rows])


def complaint(kernel, tried, read) -> str:
    """What is wrong with a result, or nothing."""
    finite = np.isfinite(tried.outputs).all(axis=1)
    if tried.status is not None:
        if tried.value in ("nan", "inf", "-inf"):
            return "status 0 for an input that is not finite" if (tried.status == 0).any() else ""
        return "status 0 for outputs that are not finite" if (~finite & (tried.status == 0)).any() else ""
    if tried.value == "nan":
        return "a finite result of NaN" if finite.any() and tried.element in read else ""
    if tried.value in ("inf", "-inf"):
        return ""  # documented: what depends on infinity may be anything but a status
    return "" if finite.all() else "NaN without a status"


def test_no_kernel_is_silent_at_an_edge(job, lib):
    wrong = []
    for kernel in job.kernels:
        graph = job.records[kernel.name].graph
        read = {node[1:] for node in graph.nodes if node[0] == "input"} if graph else set()
        for tried in tries(kernel, lib[kernel.name]):
            if said := complaint(kernel, tried, read):
                wrong.append(f"{kernel.name}: {tried.element} {tried.value}: {said}")

    assert wrong == []


def test_the_fifth_finger_says_that_its_four_bar_does_not_close(lib):
    assert lib.fifth_fingertip_pose([0.3, 0.1, 0.2, 0.3]).status == 0
    assert lib.fifth_fingertip_pose([0.95, 0.1, 0.2, 0.3]).status == 1
    assert lib.fifth_inverse_dynamics([0.95, 0.1, 0.2, 0.3], np.zeros(4), np.zeros(4), [0, 0, -9.81]).status == 1


def test_a_motor_says_that_its_angle_is_past_its_travel(lib):
    assert lib.motor_ripple(5.0).status == 0
    assert lib.motor_ripple(5.14).status == 1
    assert lib.motor_acceleration(-5.14, 0.0, 0.0, 0.0).status == 1


def ends(lib, kernel, port) -> tuple[float, float]:
    """The range of the first element of an input."""
    entry = next(entry for entry in lib[kernel].inputs if entry["name"] == port)
    return entry["low"][0], entry["high"][0]


def test_forces_that_are_refused_stay_on_the_springs_curve(lib):
    (low, _), (_, high) = (ends(lib, "index_tendon_distribution", port) for port in ("f_min", "f_max"))

    def forces(f_min, f_max):
        found = lib.index_tendon_distribution(np.zeros(4), np.zeros(4), np.eye(4), f_min, f_max)
        return int(found.status), set(found.f.tolist())

    assert forces(low, 1.02 * high) == (1, {low})  # only the lower limit is on the curve
    assert forces(-high, 1.02 * high) == (1, {0.0})  # neither is
    assert forces(high, low) == (1, {high})
    assert forces(np.nan, high)[1] == {0.0}


def test_stiffnesses_are_verified_where_the_hand_has_them(lib):
    low, high = ends(lib, "stiffness_correction", "K_mech")
    for force in ends(lib, "index_tendon_stiffness", "tension"):
        k = lib.index_tendon_stiffness(np.full(8, force)).k
        stiffness = np.diag(lib.index_joint_stiffness(np.zeros(4), np.full(8, force), k))

        assert low <= stiffness.min() <= stiffness.max() <= high


@pytest.mark.parametrize("scalar", ["f64", "f32"])
def test_ripple_has_a_status_in_every_precision(scalar, hand):
    kernel = next(k for k in Job(hand, Options(scalar)).catalog if k.name == "motor_ripple")

    assert kernel.guards
