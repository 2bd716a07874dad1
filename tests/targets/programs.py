"""Compile the kernels for a target, link them with the driver and run the program. Objects are cached by content."""

from __future__ import annotations

import hashlib
import os
import subprocess
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from .toolchains import BOARD, HERE, ROOT, SHIFT, Target, version

CSRC = ROOT / "csrc"
OBJECTS = ROOT / "build" / "targets" / "objects"
PATIENCE = 300  # seconds; emulated kernels take a few
EMPTY = "(empty)"  # the driver's kernel that does nothing
SELF_TEST = "(self-test)"  # the driver's line with the result of the boot self-test


class TargetError(Exception):
    """A compiler or a program failed."""


@dataclass(frozen=True)
class Run:
    """What a kernel did on a target: digest of its output bits, executed instructions of the dearest row, stack [B]."""

    digest: str
    instructions: int
    stack: int


def run_tool(*words: object) -> str:
    """Run a program and return what it prints. Raises TargetError with its messages."""
    command = [str(word) for word in words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        raise TargetError(f"{' '.join(command[:3])} ... did not end within {PATIENCE} s") from None
    if done.returncode:
        raise TargetError(f"{' '.join(command)} ended with {done.returncode}:\n{(done.stdout + done.stderr)[-4000:]}")
    return done.stdout


@cache
def _digest_of(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).digest()


def compile_object(source: Path, includes: Sequence[Path], target: Target) -> Path:
    """The object of a C file for a target; beside it its call graph with stack sizes (.ci), which gcc writes."""
    headers = sorted(path for folder in includes for path in folder.glob("*.h"))
    command = [target.compiler, *target.language, *target.flags, *(f"-I{folder}" for folder in includes)]
    if target.measured:
        command.append("-fcallgraph-info=su")
    key = hashlib.sha256("\0".join([*command, version(target.compiler), source.name]).encode())
    for path in (source, *headers):
        key.update(_digest_of(path))
    made = OBJECTS / f"{source.stem}-{key.hexdigest()[:24]}.o"
    if not made.exists():
        OBJECTS.mkdir(parents=True, exist_ok=True)
        partial = made.with_suffix(f".{os.getpid()}.o")
        run_tool(*command, "-c", source, "-o", partial)
        if target.measured:
            partial.with_suffix(".ci").replace(made.with_suffix(".ci"))
        partial.replace(made)
    return made


def compile_all(sources: Sequence[Path], includes: Sequence[Path], target: Target) -> list[Path]:
    """Objects of C files, on all cores."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda source: compile_object(source, includes, target), sources))


def kernel_objects(generated: Path, target: Target) -> list[Path]:
    """Objects of all kernels and of csrc, as a firmware compiles them."""
    sources = sorted(generated.glob("*.c")) + sorted(CSRC.glob("*.c"))
    return compile_all(sources, (generated, CSRC), target)


def run_kernels(generated: Path, driver: Path, target: Target) -> dict[str, Run]:
    """Every kernel on its golden inputs. ``driver`` is a folder with run.h and table.c."""
    includes = (generated, CSRC, driver, BOARD)
    support = compile_all([HERE / "run.c", driver / "table.c", *target.support], includes, target)
    program = driver / f"{target.name.replace(' ', '')}.elf"
    run_tool(target.compiler, *target.linking, *kernel_objects(generated, target), *support, "-lm", "-o", program)
    return _read(run_tool(*target.emulator, program), target)


def _read(text: str, target: Target) -> dict[str, Run]:
    found = {}
    for line in text.splitlines():
        name, digest, periods, stack = line.split()
        found[name] = Run(digest, _instructions(int(periods, 16), target), int(stack, 16))
    own = found.pop(EMPTY)
    return {n: Run(r.digest, r.instructions - own.instructions, r.stack) for n, r in found.items()}


def _instructions(periods: int, target: Target) -> int:
    """How many instructions of 2^SHIFT ns take that many periods of SysTick."""
    return round(periods * 1e9 / target.clock / 2**SHIFT) if target.clock else 0
