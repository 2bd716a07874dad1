"""What tests of many samples share: one finger's kernels in three variants, random inputs, comparison of bits."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import awiwi_gen
from awiwi_gen.build import load
from awiwi_gen.emit.options import Options
from awiwi_gen.pipeline import Job, cached_tree

ONE_FINGER = Path(__file__).with_name("one_finger.toml").read_text(encoding="utf-8")
# Without its four-bar no kernel of the finger's kinematics and dynamics has a status.
WITHOUT_FOUR_BAR = re.sub(r"\[fingers\.jaw\.links\.four_bar\].*?\n\n", "", ONE_FINGER, flags=re.DOTALL)
ODD = 1003  # no multiple of any vector's length
RANDOM = np.random.default_rng(7)
VARIANTS = {
    "double": Options(),
    "single": Options(scalar="f32"),
    "runtime": Options(params="runtime"),
}


def tree(options: Options = VARIANTS["double"], only: str = "jaw_*") -> Path:
    return cached_tree(Job(awiwi_gen.Hand.parse(WITHOUT_FOUR_BAR), options, only))


def vectorised(directory: Path):
    """A library that compiles for vectors at the first call, and stays on one core."""
    made = load(directory)
    made.vectorise_after, made.threads = 0, 1
    return made


def points(function, *lead: int) -> list[np.ndarray]:
    """Random inputs inside the ranges of a kernel."""
    shapes = [(np.reshape(p["low"], p["shape"]), np.reshape(p["high"], p["shape"])) for p in function.inputs]
    return [RANDOM.uniform(low, high, (*lead, *low.shape)).astype(function.dtype) for low, high in shapes]


def fields(result) -> tuple[np.ndarray, ...]:
    return result if isinstance(result, tuple) else (result,)


def same_bits(a, b) -> bool:
    return all(np.array_equal(x, y, equal_nan=True) for x, y in zip(fields(a), fields(b), strict=True))
