"""The C compiler of this machine: which one it is, what decides its objects, and whether its arithmetic is IEEE's."""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from awiwi_gen.cache import Cache, key
from awiwi_gen.errors import BuildError, NoCompilerError

FIX = "install one (Debian: apt-get install gcc) or set CC"
# Variables that compilers, assemblers and linkers read. What only changes messages or paths of temporary files is left out.
VARIABLES = (
    "CCC_OVERRIDE_OPTIONS", "COMPILER_PATH", "CPATH", "C_INCLUDE_PATH", "CFLAGS", "CPPFLAGS", "GCC_EXEC_PREFIX",
    "GNUTARGET", "LDEMULATION", "LDFLAGS", "LD_RUN_PATH", "LIBRARY_PATH",
    "MACOSX_DEPLOYMENT_TARGET", "SDKROOT", "SOURCE_DATE_EPOCH",
)  # fmt: skip
PROGRAMS = ("cc1", "as", "collect2", "ld")  # what a driver runs
# Macros that say that arithmetic is not IEEE's, with the value they have where it is.
IEEE_MACROS = {
    "__FAST_MATH__": None, "__ASSOCIATIVE_MATH__": None, "__RECIPROCAL_MATH__": None, "__NO_SIGNED_ZEROS__": None,
    "__FINITE_MATH_ONLY__": "0",
}  # fmt: skip
# Options with the same effect that no macro shows: flush to zero, other precision, approximate division.
UNSAFE_OPTIONS = re.compile(r"-(Ofast|ffast-math|funsafe-math-optimizations|mdaz-ftz|mpc(32|64)|mrecip(=.*)?)")


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its command, the first line of ``--version``, and a digest of all that decides its objects."""

    command: tuple[str, ...]
    version: str
    identity: str

    def run(self, *arguments: str) -> str:
        """Run it and return what it prints. Raises BuildError with its messages."""
        try:
            done = subprocess.run([*self.command, *arguments], capture_output=True, text=True, check=False)
        except OSError as error:
            raise BuildError(f"{shlex.join(self.command)} cannot be run: {error.strerror or error}") from None
        if done.returncode:
            raise BuildError(f"{shlex.join(self.command)} failed:\n{done.stderr.strip()[:4000]}")
        return done.stdout


def compiler() -> Compiler:
    """``$CC`` with its options, or the first of cc, gcc and clang.

    Raises NoCompilerError when there is none that works, and when its arithmetic is not IEEE's.
    """
    try:
        named = shlex.split(os.environ.get("CC", ""))
    except ValueError as error:
        raise NoCompilerError(f"no C compiler: CC={os.environ['CC']!r} is not a command: {error}; {FIX}") from None
    for command in [named] if named else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(command[0]):
            return _identified(tuple(command), _environment(), os.environ.get("PATH", ""), _stamps(command))
    wanted = f"$CC is {named[0]!r}, which is not there" if named else "there is no cc, gcc or clang on the PATH"
    raise NoCompilerError(f"no C compiler: {wanted}; {FIX}")


def native() -> tuple[tuple[str, ...], str]:
    """Flags for this very machine, and the macros they define: code for one machine must not be run on another."""
    return _native(compiler())


@cache
def machine() -> str:
    """What a verdict depends on besides the objects: processor, C library, Python's level of optimisation, packages."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        processor = sorted({line for line in lines if line.startswith(("model name", "flags", "Features", "CPU part"))})
    except OSError:
        processor = [platform.processor()]
    return key(platform.machine(), sys.platform, processor, platform.libc_ver(), *bindings())


def bindings() -> tuple[object, ...]:
    """What decides the wrapper of a library besides the compiler."""
    from importlib.metadata import version  # which parses e-mail: slow

    return version("cffi"), version("numpy"), sys.version, sys.flags.optimize, platform.machine()


@cache
def _native(found: Compiler) -> tuple[tuple[str, ...], str]:
    for flags in ("-march=native",), ("-mcpu=native",):
        try:
            return flags, found.run(*flags, "-E", "-dM", "-x", "c", os.devnull)
        except BuildError:
            continue
    return (), platform.machine()


def _environment() -> tuple[tuple[str, str], ...]:
    return tuple((name, os.environ[name]) for name in VARIABLES if name in os.environ)


Stamp = tuple[str, int, int, int]  # path, size, time of change and inode of a program


def _stamps(names: Iterable[str]) -> tuple[Stamp, ...]:
    """Those names that are programs: a wrapper such as ccache, and what it runs."""
    paths = [shutil.which(name) for name in names]
    found = [(os.path.realpath(path), os.stat(path)) for path in paths if path]
    return tuple((path, info.st_size, info.st_mtime_ns, info.st_ino) for path, info in found)


@dataclass(frozen=True)
class _Answers:
    """What a compiler says of itself, and the programs it would run."""

    version: str
    macros: str
    programs: tuple[str, ...]
    stamps: tuple[Stamp, ...]


@cache
def _identified(
    command: tuple[str, ...],
    environment: tuple[tuple[str, str], ...],
    path: str,
    stamps: tuple[Stamp, ...],
) -> Compiler:
    """The compiler of a command. Its answers, and digests of its programs, are cached until one of the files changes."""
    store, question = Cache(), key(command, environment, path, stamps)
    answers = store.get("compilers", question)
    if not isinstance(answers, _Answers) or answers.stamps != _stamps(answers.programs):
        answers = _asked(command)
        store.put("compilers", question, answers)
    _require_ieee(command, answers.macros)
    programs = [*stamps, *answers.stamps]
    contents = [store.memo("programs", key(stamp), partial(_content, stamp[0])) for stamp in programs]
    identity = key(command, answers.version, answers.macros, environment, contents)
    return Compiler(command, answers.version, identity)


def _asked(command: tuple[str, ...]) -> _Answers:
    version = (_answer(command, "--version").splitlines() or ["of unknown version"])[0]
    macros = _answer(command, "-dM", "-E", "-x", "c", os.devnull)
    if "#define __STDC__ " not in macros:
        raise NoCompilerError(f"no C compiler: {shlex.join(command)} does not preprocess C; {FIX}")
    programs = tuple(_answer(command, f"-print-prog-name={name}", required=False).strip() or name for name in PROGRAMS)
    return _Answers(version, macros, programs, _stamps(programs))


def _answer(command: tuple[str, ...], *arguments: str, required: bool = True) -> str:
    try:
        return subprocess.run([*command, *arguments], capture_output=True, text=True, check=True).stdout
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        if not required:
            return ""
        words = (getattr(error, "stderr", "") or str(error)).strip().partition("\n")[0]
        raise NoCompilerError(f"no C compiler: {shlex.join(command)} does not work ({words}); {FIX}") from None


def _content(path: str) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _require_ieee(command: tuple[str, ...], text: str) -> None:
    """Raise NoCompilerError where a command asks for arithmetic that the proofs do not speak of."""
    macros: Mapping[str, str] = dict(re.findall(r"^#define (\w+) (.*)$", text, flags=re.MULTILINE))
    signs = [word for word in command if UNSAFE_OPTIONS.fullmatch(word)]
    signs += [f"{name} is {macros[name]}" for name, usual in IEEE_MACROS.items() if macros.get(name, usual) != usual]
    if macros.get("__GCC_IEC_559") == "0" and not signs:
        signs.append("__GCC_IEC_559 is 0")
    method = macros.get("__FLT_EVAL_METHOD__", "0")
    if method not in ("0", "16"):
        signs.append(f"__FLT_EVAL_METHOD__ is {method}: doubles in wider registers; on x86 add -msse2 -mfpmath=sse")
    if signs:
        raise NoCompilerError(
            f"the compiler {shlex.join(command)!r} does not compute by IEEE 754 ({'; '.join(signs)}), "
            "and no proof would hold; leave -ffast-math, -Ofast and their relatives out of CC"
        )
