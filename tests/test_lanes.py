"""Kernels of alike fingers at once: a finger in each lane, with the bits of each finger alone."""

from __future__ import annotations

import ctypes
from math import prod

import numpy as np
import pytest
from samples import ONE_FINGER, fields

import awiwi_gen
from awiwi_gen.build import WARNINGS, compiler, load
from awiwi_gen.emit.batch import BATCHES
from awiwi_gen.emit.options import Options
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC

JAW = ONE_FINGER[ONE_FINGER.index("[fingers.jaw]") :]
NUMBERS = {"25 mm": "26 mm", "8 mm": "8.5 mm", "11 mm": "11.25 mm", "4 g": "4.5 g", "251 g": "252 g"}


def other(name: str) -> str:
    """The finger of the file under another name, with other numbers."""
    text = JAW.replace("fingers.jaw", f"fingers.{name}")
    for old, new in NUMBERS.items():
        text = text.replace(f'"{old}', f'"{new}')
    return text


def made(text: str, options: Options, only: str):
    return cached_tree(Job(awiwi_gen.Hand.parse(text), options, only))


def lanes(directory, name: str, scratch, dtype):
    """The compiled function, as one of arrays: element e of finger i at [e, i]."""
    target = scratch / f"{name}.so"
    flags = ("-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off", *WARNINGS, f"-I{directory}", f"-I{CSRC}")
    compiler().run(*flags, str(directory / BATCHES / f"{name}.c"), "-o", str(target), "-lm")
    function = getattr(ctypes.CDLL(str(target)), f"claw_{name}")

    def call(inputs, shapes, guarded):
        arrays = [np.ascontiguousarray(x.reshape(len(x), -1).T, dtype) for x in inputs]
        count = len(inputs[0])
        arrays += [np.empty((prod(shape), count), dtype) for shape in shapes]
        status = [np.full(count, -1, np.int32)] * guarded
        function(*(ctypes.c_void_p(a.ctypes.data) for a in (*arrays, *status)))
        return [*(a.T for a in arrays[len(inputs) :]), *status]

    return call


@pytest.mark.parametrize("options", [Options(), Options(scalar="f32")], ids=["double", "single"])
@pytest.mark.parametrize("family", ["dynamics_and_torque", "inverse_dynamics"])
def test_each_finger_has_the_bits_it_has_alone(options, family, tmp_path):
    directory = made(ONE_FINGER + other("maw") + other("paw").replace("60 deg", "61 deg"), options, f"*_{family}")
    lib, fingers = load(directory), ("jaw", "maw", "paw")
    kernels = [lib[f"{finger}_{family}"] for finger in fingers]
    call = lanes(directory, f"jaw_maw_paw_{family}_lanes", tmp_path, kernels[0].dtype)
    ports, random = kernels[0].inputs, np.random.default_rng(3)
    outputs = [port["shape"] for port in kernels[0].outputs]

    statuses = set()
    for number in range(40):
        reach = 4.0 if number % 4 == 3 else 1.0  # beyond where the four-bar closes
        low, high = ([reach * np.reshape(p[end], p["shape"]) for p in ports] for end in ("low", "high"))
        inputs = [random.uniform(a, b, (3, *np.shape(a))).astype(lib.dtype) for a, b in zip(low, high, strict=True)]
        found = call(inputs, outputs, True)
        for i, kernel in enumerate(kernels):
            alone = [np.asarray(x).reshape(-1) for x in fields(kernel(*(x[i] for x in inputs)))]
            assert all(np.array_equal(a, b[i].reshape(-1), equal_nan=True) for a, b in zip(alone, found, strict=True))
        statuses |= {*found[-1].tolist()}
    assert statuses == {0, 1}


def test_fingers_of_another_structure_share_no_program():
    pulled = (
        other("maw").replace('over = ["-mid"]', 'over = ["+mid"]').replace('["+root", "+mid"]', '["+root", "-mid"]')
    )
    longer = other("paw").replace('turn = "y-90"', 'turn = "y+90"')
    directory = made(ONE_FINGER + pulled + longer, Options(), "*_gravity,*_joint_torque")

    names = {path.stem for path in (directory / BATCHES).glob("*_lanes.c")}
    assert names == {"jaw_maw_gravity_lanes"}


def test_numbers_that_are_read_at_run_time_are_no_program_with_other_numbers():
    directory = made(ONE_FINGER + other("maw"), Options(params="runtime"), "*_gravity")

    assert not list((directory / BATCHES).glob("*_lanes.c"))


def test_the_hand_has_one_function_for_its_index_and_middle():
    directory = cached_tree(Job(awiwi_gen.Hand.load(), only="index_*,middle_*,ring_*"))
    header = (directory / BATCHES / "batches.h").read_text()

    assert "void awiwi_index_middle_dynamics_and_torque_lanes(const double q_in[8]" in header
    assert "ring_dynamics_and_torque_lanes" not in header
