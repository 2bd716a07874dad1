"""Compile generated C and load it: the only file that runs a compiler, and the only one that knows cffi.

Every C file becomes an object kept by the digest of its text, the headers, the flags and the compiler, so a
changed number recompiles the kernels it changes. The wrapper cffi makes depends on prototypes only.
"""

from __future__ import annotations

import ctypes
import importlib.machinery
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

from awiwi_gen.cache import Cache, key
from awiwi_gen.emit.names import input_name, output_name
from awiwi_gen.emit.options import GCC_FLAGS, VECTOR_FLAGS
from awiwi_gen.errors import BuildError, NoCompilerError
from awiwi_gen.resources import CSRC

if TYPE_CHECKING:
    from awiwi_gen.library import Library

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror")
FLAGS = ("-std=c99", "-O2", "-fPIC", "-ffp-contract=off", *WARNINGS)
GLUE_FLAGS = ("-O0", "-fPIC", "-w")  # what cffi writes is long and runs once a call; the loops are optimised
OPTIMISED = '#pragma GCC push_options\n#pragma GCC optimize ("O1")\n{}\n#pragma GCC pop_options\n'
BATCH_FLAGS = (*VECTOR_FLAGS, "-fPIC", "-w")
UNFUSED = (("-mno-fma",), ("-mno-fma", "-mno-avx512f"))  # x86 without the instructions, in AVX-512 they are built in
FUSED = re.compile(r"\b(v?fn?m(add|sub|la|ls|acc|sac)|xvn?m(add|sub)|vfm[as])\w*")


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its command and what it says of its version."""

    command: tuple[str, ...]
    version: str

    def run(self, *arguments: str) -> str:
        """Run it and return what it prints. Raises BuildError with its messages."""
        done = subprocess.run([*self.command, *arguments], capture_output=True, text=True, check=False)
        if done.returncode:
            raise BuildError(f"{' '.join(self.command)} failed:\n{done.stderr.strip()[:4000]}")
        return done.stdout


@cache
def compiler() -> Compiler:
    """``$CC``, or the first of cc, gcc and clang. Raises NoCompilerError when there is none that works."""
    named = os.environ.get("CC", "").split()
    for command in [named] if named else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(command[0]):
            return Compiler(tuple(command), _version(command))
    wanted = f"$CC is {named[0]!r}, which is not there" if named else "there is no cc, gcc or clang on the PATH"
    raise NoCompilerError(f"no C compiler: {wanted}; {MEND}")


@cache
def native() -> tuple[tuple[str, ...], str]:
    """Flags for this very machine, and what they make of it: code for one machine must not be run on another."""
    for flags in ("-march=native",), ("-mcpu=native",):
        try:
            return flags, compiler().run(*flags, "-E", "-dM", "-x", "c", os.devnull)
        except BuildError:
            continue
    return (), platform.machine()


MEND = "install one (Debian: apt-get install gcc) or set CC"


def _version(command: list[str]) -> str:
    try:
        done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        raise NoCompilerError(f"no C compiler: {' '.join(command)} does not work ({error}); {MEND}") from None
    return (done.stdout.splitlines() or ["of unknown version"])[0]


def headers(directory: Path) -> str:
    """Everything a generated C file may include, as one text; comments, which tell of ranges, decide no object."""
    files = sorted(directory.glob("*.h")) + sorted(CSRC.glob("*.h"))
    texts = (path.read_text(encoding="utf-8") for path in files)
    return "\0".join(re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL) for text in texts)


def sources(directory: Path) -> list[Path]:
    """All C files of a generated directory and of csrc."""
    return [*sorted(directory.glob("*.c")), *sorted(CSRC.glob("*.c"))]


def object_name(source: Path, shared: str) -> str:
    """The digest of everything that decides an object."""
    return key(source.read_text(encoding="utf-8"), shared, FLAGS, compiler().version) + ".o"


def compile_objects(directory: Path, store: Cache) -> list[Path]:
    """Objects of all C files of a generated directory and of csrc; only those not in the cache are compiled."""
    cc, shared = compiler(), headers(directory)
    includes = (f"-I{directory}", f"-I{CSRC}")

    def compile_one(source: Path) -> Path:
        digest = object_name(source, shared)
        target = store.directory / "objects" / digest
        if not target.exists():
            with tempfile.TemporaryDirectory() as scratch:
                made = Path(scratch) / "kernel.o"
                cc.run(*FLAGS, *includes, "-c", str(source), "-o", str(made))
                target = store.put_bytes("objects", digest, made.read_bytes())
        return target

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(compile_one, sources(directory)))


def declarations(directory: Path) -> str:
    """The firmware header, preprocessed: what cffi is told is what C sees."""
    return compiler().run("-E", "-P", "-std=c99", f"-I{directory}", str(CSRC / "awiwi.h"))


def load(directory: Path, store: Cache | None = None) -> Library:
    """Compile a generated directory and load it as a Library. Raises BuildError."""
    from awiwi_gen.library import Library

    store = store or Cache()
    manifest = json.loads((directory / "manifest.json").read_text(encoding="utf-8"))
    glue = _glue_source(manifest, declarations(directory))
    python = f"{sys.version} {sysconfig.get_config_var('EXT_SUFFIX')}"
    name = "_awiwi_" + key(glue, python, GLUE_FLAGS, compiler().version)[:16]
    with ThreadPoolExecutor(1) as aside:  # the wrapper takes longest: the kernels are compiled meanwhile
        wrapping = aside.submit(_glue_object, name, glue, directory, store)
        objects = compile_objects(directory, store)
        wrapper = wrapping.result()
    digest = key(name, *(path.name for path in objects)) + ".so"
    target = store.directory / "libraries" / digest
    if not target.exists():
        with tempfile.TemporaryDirectory() as scratch:
            made = Path(scratch) / "library.so"
            compiler().run("-shared", *(str(o) for o in objects), str(wrapper), "-o", str(made), "-lm")
            target = store.put_bytes("libraries", digest, made.read_bytes())
    module = _import(name, target)
    loaded = frozenset(path.name for path in objects)

    def vectorised(entry: Mapping[str, Any]) -> Any:
        return batch_function(entry, manifest, directory, store, loaded, module.ffi)

    return Library(manifest, module.lib, module.ffi, vectorised)


def batch_function(
    entry: Mapping[str, Any],
    manifest: Mapping[str, Any],
    directory: Path,
    store: Cache,
    loaded: frozenset[str],
    ffi: Any,
) -> Any:
    """A kernel's loop over samples, compiled for this machine's vectors; None where vectors do not help.

    Raises BuildError when that fails, and when the directory is no longer what the library was ``loaded`` from.
    """
    from awiwi_gen.emit.batch import BATCHES, prototype, worthwhile

    source = directory / f"{entry['name']}.c"
    text = source.read_text(encoding="utf-8")
    if not worthwhile(entry, text):
        return None
    shared = headers(directory)
    if object_name(source, shared) not in loaded:
        raise BuildError(f"{directory} has changed since it was loaded; load it again")
    looped = directory / BATCHES / source.name
    texts = (text, shared, looped.read_text(encoding="utf-8"), headers(directory / BATCHES))
    digest = key(texts, BATCH_FLAGS, GCC_FLAGS, UNFUSED, native(), compiler().version) + ".so"
    target = store.directory / "batches" / digest
    if not target.exists():
        with tempfile.TemporaryDirectory() as scratch:
            target = store.put_bytes("batches", digest, _compile_batch(looped, Path(scratch)).read_bytes())
    head = prototype(entry, manifest["prefix"], manifest["c_type"])
    result, name = head.split("(")[0].split()
    function = getattr(ctypes.CDLL(str(target)), name)
    return ffi.cast(head.replace(f"{result} {name}", f"{result} (*)", 1), ctypes.cast(function, ctypes.c_void_p).value)


def _compile_batch(source: Path, scratch: Path) -> Path:
    """A loop over samples as a library for this machine, of which no instruction multiplies and adds at once.

    gcc 12 makes such where it finds a sum beside a difference, whatever it is told; then it may not know them.
    """
    assembly, made = scratch / "batch.s", scratch / "batch.so"
    flags, machine = native()
    flags += () if "clang" in compiler().version else GCC_FLAGS
    for without in UNFUSED if "__x86_64__" in machine else ((),):
        includes = (f"-I{source.parent.parent}", f"-I{CSRC}")
        compiler().run(*BATCH_FLAGS, *flags, *without, *includes, "-S", str(source), "-o", str(assembly))
        if not FUSED.search(assembly.read_text(encoding="utf-8")):
            compiler().run("-shared", str(assembly), "-o", str(made), "-lm")
            return made
    raise BuildError(f"{compiler().version} fuses multiplications with additions against its flags")


def _glue_source(manifest: dict[str, Any], declared: str) -> str:
    """JSON of what the wrapper is made from: declarations, loops over batches, and the kernels in a uniform shape."""
    loops, prototypes = [], []
    scalar, prefix = manifest["c_type"], manifest["prefix"]
    if any(entry["params"] for entry in manifest["kernels"]):
        head = f"const {prefix}_params *DefaultParams(void)"
        prototypes.append(f"{head};")
        loops.append(f"static {head} {{ return &{prefix}_default_params; }}")
    for entry in manifest["kernels"]:
        inputs = [input_name(p["name"]) for p in entry["inputs"]]
        sizes = {output_name(p["name"]): prod(p["shape"]) for p in entry["outputs"]}
        outputs = list(sizes)
        signature = [f"const {scalar} *{n}, ptrdiff_t {n}_step" for n in inputs]
        signature += [f"{scalar} *{n}" for n in outputs]
        call = [f"{n} + i*{n}_step" for n in inputs] + [f"{n} + i*{sizes[n]}" for n in outputs]
        if entry["status"]:
            signature.append("int *status")
        if entry["params"]:
            signature.insert(0, f"const {prefix}_params *p")
            call.insert(0, "p")
        head = f"void Batch_{entry['name']}(ptrdiff_t n, {', '.join(signature)})"
        prototypes.append(f"{head};")
        keep = "status[i] = " if entry["status"] else ""
        body = f"for (ptrdiff_t i = 0; i < n; i++) {keep}{prefix}_{entry['name']}({', '.join(call)});"
        loops.append(f"static {head} {{ {body} }}")
        loops.append(_flat_source(entry, prefix, scalar))
    table = ", ".join(f"Flat_{entry['name']}" for entry in manifest["kernels"])
    prototypes.append("extern awiwi_flat FlatKernels[];")
    loops.append(f"static awiwi_flat FlatKernels[] = {{ {table} }};")
    return json.dumps({"declared": declared, "prototypes": prototypes, "loops": loops})


def _flat_source(entry: dict[str, Any], prefix: str, scalar: str) -> str:
    """A kernel with all inputs in one array and all outputs in another: what a loop can call without knowing it."""
    arguments = [f"&{prefix}_default_params"] if entry["params"] else []
    for side, array in (("inputs", "in"), ("outputs", "out")):
        place = 0
        for port in entry[side]:
            arguments.append(f"{array} + {place}")
            place += prod(port["shape"])
    call = f"{prefix}_{entry['name']}({', '.join(arguments)});"
    head = f"static int Flat_{entry['name']}(const {scalar} *in, {scalar} *out)"
    return f"{head} {{ return {call} }}" if entry["status"] else f"{head} {{ {call} return 0; }}"


def _glue_object(name: str, glue: str, directory: Path, store: Cache) -> Path:
    digest = key(name, glue) + ".o"
    target = store.directory / "objects" / digest
    if target.exists():
        return target
    import cffi.recompiler

    parts = json.loads(glue)
    ffi = cffi.FFI()
    ffi.cdef(re.sub(r"^#.*$", "", parts["declared"], flags=re.M) + "\n".join(parts["prototypes"]))
    preamble = '#include "awiwi.h"\n' + OPTIMISED.format("\n".join(parts["loops"]))
    with tempfile.TemporaryDirectory() as scratch:
        source, made = Path(scratch) / f"{name}.c", Path(scratch) / f"{name}.o"
        cffi.recompiler.make_c_source(ffi, name, preamble, str(source))
        python = sysconfig.get_paths()["include"]
        compiler().run(*GLUE_FLAGS, f"-I{python}", f"-I{directory}", f"-I{CSRC}", "-c", str(source), "-o", str(made))
        return store.put_bytes("objects", digest, made.read_bytes())


def _import(name: str, path: Path) -> Any:
    loader = importlib.machinery.ExtensionFileLoader(name, str(path))
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None:
        raise BuildError(f"{path} cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module
