"""What tests of our own functions share: samples, errors in units in the last place, and programs."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

import mpmath
import numpy as np

from awiwi_gen.build import compiler
from awiwi_gen.emit.files import csrc_headers
from awiwi_gen.emit.options import Options
from awiwi_gen.resources import CSRC

ERROR = """
#include <math.h>
#include <stdio.h>
#include <stdint.h>
#include <string.h>

static double error(float computed, double exact) /* in units in the last of 24 places */
{
    uint64_t bits;
    double power; /* of two, at most the exact value */
    memcpy(&bits, &exact, 8);
    bits &= 0x7ff0000000000000u;
    memcpy(&power, &bits, 8);
    return fabs((double)computed - exact) / power * 8388608.0;
}
"""


def worst_ulp(computed: np.ndarray, function, *arguments: np.ndarray) -> float:
    """Largest error in units in the last place, against 40 digits."""
    mpmath.mp.dps = 40
    exact = [
        function(*map(mpmath.mpf, row)) for row in zip(*(a.astype(float).tolist() for a in arguments), strict=True)
    ]
    unit = np.spacing(np.abs(np.array([float(e) for e in exact])).astype(computed.dtype)).astype(float)
    errors = (abs(float((mpmath.mpf(float(c)) - e) / u)) for c, e, u in zip(computed, exact, unit, strict=True))
    return max(errors)


def compile_with(directory: Path, options: Options, name: str, text: str, *flags: str) -> str:
    """The object of a C text that includes headers of csrc in a scalar type."""
    headers = directory / options.scalar
    headers.mkdir(exist_ok=True)
    for header, content in csrc_headers(options).items():
        (headers / header).write_text(content)
    source, made = directory / f"{name}.c", directory / f"{name}.o"
    source.write_text(text)
    compiler().run("-std=c99", *flags, f"-I{headers}", f"-I{CSRC}", "-c", str(source), "-o", str(made))
    return str(made)


def build(directory: Path, options: Options, text: str, *flags: str, others: Sequence[str] = ()) -> str:
    """A program of a C text, the table of sincos.h and other objects."""
    table = compile_with(directory, options, "table", (CSRC / "sincos.c").read_text(), *flags)
    main = compile_with(directory, options, "main", text, *flags)
    program = str(directory / "program")
    compiler().run(main, table, *others, "-o", program, "-lm")
    return program


def run(program: str, given: np.ndarray | str = "") -> np.ndarray:
    """The numbers it prints, given rows of numbers."""
    text = given if isinstance(given, str) else "".join(" ".join(float(v).hex() for v in row) + "\n" for row in given)
    done = subprocess.run([program], input=text, capture_output=True, text=True, check=True)
    return np.array([float.fromhex(word) for word in done.stdout.split()])


def pattern(x: float) -> int:
    """The bits of a single-precision number."""
    return int(np.float32(x).view(np.uint32))
