"""What all studies are: samples in chunks, each drawn from a seed of its own, so that no worker and no order matters."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, ClassVar

import numpy as np

from awiwi_gen.cache import code_digest, key

Array = np.ndarray[Any, Any]
Arrays = Mapping[str, Array]
CODE = ("awiwi_gen/study", "awiwi_gen/loops", "awiwi_gen/simulate.py", "csrc")  # that decides a chunk, beside kernels
POSES_STREAM = 1 << 20  # of random numbers: beyond all indices of chunks


@dataclass(frozen=True, eq=False)
class Study(ABC):
    """The part of a study that a worker needs. Its fields decide every chunk, with kernels, seed and index."""

    SIZE: ClassVar[int]  # samples of a chunk
    seed: int
    stage: str  # a folder of chunks

    @abstractmethod
    def chunk(self, library: Any, random: np.random.Generator) -> dict[str, Array]:
        """The results of ``SIZE`` samples."""

    def at(self, library: Any, index: int) -> dict[str, Array]:
        """The results of the chunk with an index."""
        return self.chunk(library, random_of(self.seed, index, self.stage))

    def digest(self, kernels: str) -> str:
        """The digest of all that decides the chunks; ``kernels`` is that of the generated C."""
        return key(
            type(self).__name__, kernels, code_digest(*CODE), *(_text(getattr(self, f.name)) for f in fields(self))
        )


def random_of(seed: int, index: int, stage: str = "") -> np.random.Generator:
    """A stream of random numbers, independent of those with other indices or stages."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index, *stage.encode())))


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()}"
    if is_dataclass(value):
        return key(*(f"{name}={_text(each)}" for name, each in vars(value).items()))
    return repr(value)


@dataclass(frozen=True)
class Result:
    """An array of a result: its unit, what it is, and its values."""

    unit: str
    meaning: str
    values: Array


@dataclass(frozen=True)
class Report:
    """What a study found: arrays for files, a table and lines for people, data for programs, a drawing of Matplotlib."""

    results: Mapping[str, Result]
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    lines: list[str]
    data: Mapping[str, Any]
    draw: Callable[[Any], None]


def poses_of(low: Array, high: Array, seed: int, count: int) -> Array:
    """Joint positions (count, joints) [rad, m for slides] in the ranges; the first is their middle."""
    share = random_of(seed, POSES_STREAM).uniform(size=(count, len(low)))
    share[0] = 0.5
    drawn: Array = low + share * (high - low)
    return drawn
