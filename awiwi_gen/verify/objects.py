"""Checks single-precision object files: no instruction computes in double, no double function is called.

A compiler does not warn where a literal without an ``f`` or a function of <math.h> widens a float; the object shows it.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

DOUBLE = {
    "x86-64": r"v?(?:add|sub|mul|div|sqrt|min|max|u?comi|cmp\w*|round|hadd)[sp]d|v?cvt\w*[sp]d\w*|vfn?m\w+[sp]d",
    "aarch64": r"f(?:n?m?add|n?m?sub|n?mul|div|sqrt|cvt\w*|cmpe?|max\w*|min\w*|ml[as])\s+(?:\w+, )?(?:d\d|v\d+\.2d)[^\n]*",
    "littlearm": r"v(?:n?m?add|sub|n?mul|n?ml[as]|div|sqrt|cvtr?|cmpe?|fn?m[as])\.(?:\w+\.)?f64\w*",
}
FUNCTIONS = (
    "sin|cos|sincos|tan|asin|acos|atan2?|sinh|cosh|tanh|exp|exp2|log|log2|log10|pow|sqrt|hypot|fabs|fmin|fmax|fma"
)
CALLED = re.compile(rf"(?:{FUNCTIONS}|floor|ceil|round|trunc|ldexp|frexp|fmod|__aeabi_\w*d(?!iv|md)\w*|__\w*df\d?\w*)")


@dataclass(frozen=True)
class Seal:
    """Per file, the double instructions and calls that were found; or why the objects were not examined."""

    examined: int = 0
    skipped: str = ""
    found: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether no double arithmetic was found."""
        return not self.found


def examine(objects: Mapping[str, Path]) -> Seal:
    """Look for double arithmetic in object files, given by the names of their sources."""
    tool = shutil.which("objdump")
    if tool is None:
        return Seal(skipped="objdump is not installed")
    found: dict[str, tuple[str, ...]] = {}
    for name, path in objects.items():
        done = subprocess.run(
            [tool, "-d", "-t", "--no-show-raw-insn", str(path)], capture_output=True, text=True, check=False
        )
        machine = next((m for m in DOUBLE if f"file format elf64-{m}" in done.stdout or f"-{m}\n" in done.stdout), None)
        if done.returncode or machine is None:
            return Seal(skipped=f"objdump does not show {name} as code of a supported machine ({', '.join(DOUBLE)})")
        if faults := doubles(done.stdout, machine):
            found[name] = faults
    return Seal(len(objects), "", found)


def doubles(listing: str, machine: str) -> tuple[str, ...]:
    """The double instructions in a listing of objdump, each with its function, and the double functions called."""
    instruction = re.compile(rf"^\s+[0-9a-f]+:\s+({DOUBLE[machine]})(?:\s|$)")
    faults: dict[str, None] = {}
    function = ""
    for line in listing.splitlines():
        if start := re.match(r"[0-9a-f]+ <(\S+)>:", line):
            function = start[1]
        elif match := instruction.match(line):
            faults[f"{match[1].split()[0]} in {function}"] = None
        elif (called := re.search(r"\*UND\*\s+[0-9a-f]+\s+(\S+)$", line)) and CALLED.fullmatch(called[1]):
            faults[f"a call of {called[1]}"] = None
    return tuple(faults)
