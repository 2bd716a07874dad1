"""Sample points for verification: limits, the straight finger, corners, and the inside of every port's range."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from awiwi_gen.kernel import Port

SAMPLES = 320
SEED = 20120301  # printed with every report; the samples of a part depend on it and on the part's name only

NOISE = 1e-9  # far more than rounding leaves of zero

VARIATION = Fraction(1, 1000)  # of numbers that are read at run time; a thousandth keeps loops closed at joint limits

Array = np.ndarray[Any, Any]


def varied(values: Mapping[str, Fraction], part: str = "") -> dict[str, Fraction]:
    """Other numbers of a part, by paths relative to it, each within a thousandth of its own; zeros stay."""
    return {
        path: value
        * (
            1
            + VARIATION * Fraction(zlib.crc32(f"{SEED} {part}.{path}".replace(" .", " ").encode()) - (1 << 31), 1 << 31)
        )
        for path, value in values.items()
    }


def _share(path: str) -> Fraction:
    """A number from -1 to 1 that only a path decides."""
    return Fraction(zlib.crc32(f"{SEED} {path}".encode()) - (1 << 31), 1 << 31)


def draw(ports: Mapping[str, Port], part: str, dtype: type = np.float64, samples: int = SAMPLES) -> dict[str, Array]:
    """Arrays (samples, size) for every input port.

    Row 0 is zero (the straight finger at rest) as far as the range allows, rows 1 and 2 are the lower and
    the upper limits, every eighth row a corner of the box, the others are uniform.
    """
    drawn: dict[str, Array] = {}
    for name, port in ports.items():
        random = np.random.default_rng([SEED, zlib.crc32(f"{part}.{name}".encode())])
        low, high = np.array(port.bounds()).T.reshape(2, port.size)
        rows = random.uniform(low, high, (samples, port.size))
        corners = np.where(random.random((samples, port.size)) < 0.5, low, high)
        rows[::8] = corners[::8]
        rows[0], rows[1], rows[2] = np.clip(0.0, low, high), low, high
        drawn[name] = rows.astype(dtype)
    return drawn


def rounded(values: Array) -> Array:
    """What NumPy computes, in single precision: its last bits differ from processor to processor, the samples must not."""
    return np.asarray(values, np.float32).astype(np.float64)


def without_noise(values: Array) -> Array:
    """The same, with zeros for what is small beside the largest value: there may be nothing but last bits in it."""
    return np.where(np.abs(values) > NOISE * np.abs(values).max(initial=0.0), rounded(values), 0.0)
