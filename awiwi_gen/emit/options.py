"""Options of the emitted C, one frozen value that is passed down, and compiler flags of the batches."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

# What batches are compiled with on top of the flags for the machine; batches.h and build.py both read it here.
VECTOR_FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
GCC_FLAGS = ("-fschedule-insns", "-fsched-pressure", "-fno-tree-loop-distribute-patterns")  # for long loops


@dataclass(frozen=True)
class Options:
    """Scalar type, whether the hand's numbers are constants or fields of a struct, our own functions or the C library's."""

    scalar: Literal["f64", "f32"] = "f64"
    params: Literal["baked", "runtime"] = "baked"
    math: Literal["own", "libm"] = "own"

    @property
    def c_type(self) -> str:
        """The C scalar type."""
        return "double" if self.scalar == "f64" else "float"

    @property
    def bits(self) -> int:
        """Number of bits of the scalar type."""
        return 64 if self.scalar == "f64" else 32

    @property
    def dtype(self) -> type:
        """The NumPy scalar type."""
        import numpy as np

        return np.float64 if self.scalar == "f64" else np.float32

    def literal(self, value: Fraction) -> str:
        """The shortest C literal that reads back as the nearest scalar."""
        rounded = value.numerator / value.denominator
        if self.scalar == "f64":
            return repr(rounded)
        import numpy as np

        text = str(np.float32(rounded))
        return (text if any(c in text for c in ".en") else text + ".0") + "f"

    def function(self, operation: str) -> str:
        """The C library's name of a function."""
        return operation if self.scalar == "f64" else operation + "f"
