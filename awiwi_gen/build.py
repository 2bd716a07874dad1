"""Compile generated C and load it: the only file that knows cffi.

Every C file becomes an object, cached by the digest of its text, the headers it includes, the flags and the compiler, so
a changed number recompiles the kernels it changes, and all hands share the objects of csrc. The wrapper cffi makes
depends on prototypes only.
"""

from __future__ import annotations

import json
import os
import re
import sysconfig
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from awiwi_gen.cache import Cache, key
from awiwi_gen.compiler import bindings, compiler, native
from awiwi_gen.emit.options import GCC_FLAGS, VECTOR_FLAGS
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.errors import BuildError, InputError, NoCompilerError, OutputError
from awiwi_gen.resources import CSRC
from awiwi_gen.shipped import batch_of, import_extension

if TYPE_CHECKING:
    from awiwi_gen.library import Library

T = TypeVar("T")
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror")
FLAGS = ("-std=c99", "-O2", "-fPIC", "-ffp-contract=off", "-fno-math-errno", *WARNINGS)
GLUE_FLAGS = ("-O0", "-fPIC", "-w")  # cffi's wrapper is long and runs once a call; only the loops are optimised
OPTIMISED = '#pragma GCC push_options\n#pragma GCC optimize ("O1")\n{}\n#pragma GCC pop_options\n'
BATCH_FLAGS = (*VECTOR_FLAGS, "-fPIC", "-w")
UNFUSED = (("-mno-fma",), ("-mno-fma", "-mno-avx512f"))  # x86 without the instructions, in AVX-512 they are built in
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)
FUSED = re.compile(r"\b(v?fn?m(add|sub|la|ls|acc|sac)|xvn?m(add|sub)|vfm[as])\w*")


class Headers:
    """Texts that a C file may include, by name, without comments: they decide no object."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        code = {name: re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL) for name, text in texts.items()}
        self.digests = {name: key(name, text) for name, text in code.items()}
        self._direct = {name: INCLUDE.findall(text) for name, text in code.items()}

    @classmethod
    def of(cls, directory: Path) -> Headers:
        """The headers of a generated directory and of csrc."""
        files = [*sorted(CSRC.glob("*.h")), *sorted(directory.glob("*.h"))]
        return cls({path.name: path.read_text(encoding="utf-8") for path in files})

    def __str__(self) -> str:
        return key(*self.digests.values())

    def included(self, text: str) -> list[str]:
        """Names of those that a C text includes, directly or through others, in alphabetical order."""
        found, waiting = set[str](), INCLUDE.findall(text)
        while waiting:
            name = waiting.pop()
            if name in self.digests and name not in found:
                found.add(name)
                waiting += self._direct[name]
        return sorted(found)


def sources(directory: Path) -> list[Path]:
    """All C files of a generated directory and of csrc."""
    return [*sorted(directory.glob("*.c")), *sorted(CSRC.glob("*.c"))]


def object_key(source: Path, shared: Headers, identity: str) -> str:
    """The digest of everything that decides an object; ``identity`` is that of the compiler."""
    text = source.read_text(encoding="utf-8")
    return key(text, *(shared.digests[name] for name in shared.included(text)), FLAGS, identity)


def object_keys(directory: Path) -> dict[Path, str]:
    """The digest of each object of a generated directory, by its source."""
    shared, identity = Headers.of(directory), compiler().identity
    return {source: object_key(source, shared, identity) for source in sources(directory)}


def compile_objects(directory: Path, store: Cache, into: Path) -> list[Path]:
    """Objects of all C files of a generated directory and of csrc, as files in a folder; only new ones are compiled."""
    cc, digests = compiler(), object_keys(directory)
    includes = (f"-I{directory}", f"-I{CSRC}")

    def compile_one(source: Path) -> Path:
        digest, target = digests[source], into / f"{source.stem}.o"
        found = store.read("objects", digest)
        if found is None:
            cc.run(*FLAGS, *includes, "-c", str(source), "-o", str(target))
            store.write("objects", digest, target.read_bytes())
        else:
            target.write_bytes(found)
        return target

    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(compile_one, digests))


def declarations(directory: Path, store: Cache, shared: Headers) -> str:
    """The firmware header, preprocessed: cffi reads what C sees."""

    def preprocess() -> str:
        return compiler().run("-E", "-P", "-std=c99", f"-I{directory}", str(CSRC / "awiwi.h"))

    return store.memo("declarations", key(shared, compiler().identity), preprocess)


@dataclass(frozen=True)
class Compiled:
    """A generated directory as a shared library: its manifest, the name of its Python module, its bytes.

    ``digest`` is that of all that decides the bytes, ``objects`` are those of the objects.
    """

    manifest: dict[str, Any]
    name: str
    data: bytes
    digest: str
    objects: tuple[str, ...]


def compiled(directory: Path, store: Cache) -> Compiled:
    """The library of a generated directory, from the cache where it is there. Raises what `load` raises."""
    manifest = read_manifest(directory)
    if manifest is None:
        raise InputError(f"{directory}: nothing generated here; run awiwi-gen generate -o {directory}")
    shared, identity = Headers.of(directory), compiler().identity
    glue = _glue_source(manifest, declarations(directory, store, shared))
    python = f"{bindings()} {sysconfig.get_config_var('EXT_SUFFIX')}"
    name = "_awiwi_" + key(glue, python, GLUE_FLAGS, identity)[:16]
    objects = object_keys(directory).values()
    digest = key(name, glue, *objects)
    data = store.read("libraries", digest)
    if data is None:
        with tempfile.TemporaryDirectory() as scratch:
            data = _linked(name, glue, directory, store, Path(scratch))
        store.write("libraries", digest, data)
    return Compiled(manifest, name, data, digest, tuple(objects))


def load(directory: str | Path, store: Cache | None = None) -> Library:
    """Compile a generated directory and load it as NumPy functions; compiled objects are kept in a cache.

    Needs NumPy, cffi, a C compiler and Python's headers, but no library that derives kernels.

    Raises InputError where nothing was generated, NoCompilerError where there is no C compiler that works or no Python.h,
    BuildError where it refuses the code.
    """
    from awiwi_gen.library import Library
    from awiwi_gen.views import names_in

    directory, store = Path(directory), store or Cache()
    found = compiled(directory, store)
    manifest = found.manifest
    if found.digest not in _MODULES:
        _MODULES[found.digest] = open_copy(found.data, store, partial(import_extension, found.name))
    module = _MODULES[found.digest]

    def vectorised(entry: Mapping[str, Any]) -> Any:
        return batch_function(entry, manifest, directory, store, frozenset(found.objects), module.ffi)

    origin = (load_again, (str(directory.resolve()), str(store.directory.resolve()), found.digest))
    names = names_in(text_of(directory / "hand.h"), manifest["prefix"])
    return Library(manifest, module.lib, module.ffi, vectorised, origin, names=names)


_MODULES: dict[str, Any] = {}  # by the digest of their library: a process maps each once


@cache
def load_again(directory: str, cached: str, digest: str) -> Library:
    """The library that was pickled, in this process. Raises BuildError when its directory has changed since."""
    library = load(Path(directory), Cache(Path(cached)))
    if library.origin[1] != (directory, cached, digest):
        raise BuildError(f"{directory} has changed since its library was pickled; build and pickle it again")
    return library


def text_of(path: Path) -> str:
    """What a file holds, or nothing where there is none."""
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def _linked(name: str, glue: str, directory: Path, store: Cache, scratch: Path) -> bytes:
    """A library of all objects and the wrapper."""
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as aside:  # the wrapper takes longest: the kernels are compiled meanwhile
        wrapping = aside.submit(_glue_object, name, glue, directory, store, scratch)
        (scratch / "objects").mkdir()
        objects = compile_objects(directory, store, scratch / "objects")
        wrapper = wrapping.result()
    made = scratch / "library.so"
    compiler().run("-shared", *map(str, objects), str(wrapper), "-o", str(made), "-lm")
    return made.read_bytes()


def open_copy(data: bytes, store: Cache, opened: Callable[[str], T]) -> T:
    """Load a library from a private copy, so that no change of the cached file reaches a running program.

    The copy is in the folder of temporary files, or in the cache where programs may not be run from there.
    Raises OutputError when they may not be run from either.
    """
    reasons = []
    for folder in (tempfile.gettempdir(), str(store.directory)):
        try:
            with tempfile.TemporaryDirectory(dir=folder) as scratch:
                path = Path(scratch) / "library.so"
                path.write_bytes(data)
                return opened(str(path))
        except (OSError, ImportError) as error:
            reasons.append(f"{folder}: {str(error).rpartition(': ')[2].lower()}")
    raise OutputError(
        f"the compiled library cannot be loaded ({'; '.join(reasons)}); "
        "set TMPDIR to a folder that has space and is not mounted noexec"
    )


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
    import ctypes

    from awiwi_gen.emit.batch import BATCHES, worthwhile

    source = directory / f"{entry['name']}.c"
    text = source.read_text(encoding="utf-8")
    if not worthwhile(entry, text):
        return None
    shared, identity = Headers.of(directory), compiler().identity
    if object_key(source, shared, identity) not in loaded:
        raise BuildError(f"{directory} has changed since it was loaded; load it again")
    looped = directory / BATCHES / source.name
    texts = (text, shared, looped.read_text(encoding="utf-8"), Headers.of(directory / BATCHES))
    digest = key(*texts, BATCH_FLAGS, GCC_FLAGS, UNFUSED, native(), identity)
    data = store.read("batches", digest)
    if data is None:
        with tempfile.TemporaryDirectory() as scratch:
            data = _compile_batch(looped, Path(scratch)).read_bytes()
        store.write("batches", digest, data)
    return batch_of(open_copy(data, store, ctypes.CDLL), entry, manifest, ffi)


def _compile_batch(source: Path, scratch: Path) -> Path:
    """A loop over samples as a library for this machine."""
    assembly, made = scratch / "batch.s", scratch / "batch.so"
    flags, machine = native()
    assemble_batch(source, assembly, flags, UNFUSED if "__x86_64__" in machine else ((),))
    compiler().run("-shared", str(assembly), "-o", str(made), "-lm")
    return made


def assemble_batch(source: Path, into: Path, flags: tuple[str, ...], ways: tuple[tuple[str, ...], ...]) -> None:
    """Assembly of a loop over samples, without fused multiply-add instructions: the first of several ways without any.

    gcc 12 fuses where it finds a sum beside a difference, against its flags; then the instruction set is withheld.
    Raises BuildError where every way fuses.
    """
    flags += () if "clang" in compiler().version else GCC_FLAGS
    includes = (f"-I{source.parent.parent}", f"-I{CSRC}")
    for without in ways:
        compiler().run(*BATCH_FLAGS, *flags, *without, *includes, "-S", str(source), "-o", str(into))
        if not FUSED.search(into.read_text(encoding="utf-8")):
            return
    raise BuildError(f"{compiler().version} fuses multiplications with additions against its flags")


def _glue_source(manifest: dict[str, Any], declared: str) -> str:
    """JSON of what the wrapper is made from: declarations, loops over samples, and the kernels in a uniform shape."""
    from awiwi_gen.emit.batch import c_arrays

    loops, prototypes = [], []
    scalar, prefix = manifest["c_type"], manifest["prefix"]
    if manifest.get("params"):
        prototypes.append(f"void {prefix}_params_derive(const {prefix}_numbers *numbers, {prefix}_params *params);")
        prototypes.append(f"int {prefix}_params_load(const void *bytes, size_t size, {prefix}_params *out);")
        prototypes.append(f"extern {prefix}_params FlatParams;")
        loops.append(f"static {prefix}_params FlatParams;")  # of the kernels that are called with flat arrays
    if manifest.get("tick"):
        prototypes += [
            f"extern const awiwi_hand {prefix}_hand_model;",
            f"extern const awiwi_hand_gains {prefix}_default_gains;",
            f"extern const awiwi_hand_plant {prefix}_simulated_hand;",
        ]
    for entry in manifest["kernels"]:
        signature, call = ["ptrdiff_t n"], []
        if entry["params"]:
            signature.append(f"const {prefix}_params *p")
            call.append("p")
        for kind, name, size in c_arrays(entry, scalar):
            given = kind.startswith("const")
            signature += [f"{kind}*{name}", *[f"ptrdiff_t {name}_step"] * given]
            call.append(f"{name} + i*{f'{name}_step' if given else size}")
        signature += ["int *status"] * entry["status"]
        keep = "status[i] = " if entry["status"] else ""
        body = f"for (ptrdiff_t i = 0; i < n; i++) {keep}{prefix}_{entry['name']}({', '.join(call)});"
        loops.append(f"static void Loop_{entry['name']}({', '.join(signature)}) {{ {body} }}")
        loops.append(_flat_source(entry, prefix, scalar))
    # Tables, as a function of its own in the module is sixty lines of C for cffi.
    for kind, table in (("void *", "Loop"), ("awiwi_flat ", "Flat")):
        members = ", ".join(f"{table}_{entry['name']}" for entry in manifest["kernels"])
        prototypes.append(f"extern {kind}{table}Kernels[];")
        loops.append(f"static {kind}{table}Kernels[] = {{ {members} }};")
    return json.dumps({"declared": declared, "prototypes": prototypes, "loops": loops})


def _flat_source(entry: dict[str, Any], prefix: str, scalar: str) -> str:
    """A kernel with all inputs in one array and all outputs in another, so that C code can call any of them."""
    arguments = ["&FlatParams"] if entry["params"] else []
    for side, array in (("inputs", "in"), ("outputs", "out")):
        place = 0
        for port in entry[side]:
            arguments.append(f"{array} + {place}")
            place += prod(port["shape"])
    call = f"{prefix}_{entry['name']}({', '.join(arguments)});"
    head = f"static int Flat_{entry['name']}(const {scalar} *in, {scalar} *out)"
    return f"{head} {{ return {call} }}" if entry["status"] else f"{head} {{ {call} return 0; }}"


def _glue_object(name: str, glue: str, directory: Path, store: Cache, scratch: Path) -> Path:
    """The compiled wrapper, as a file in a folder."""
    digest, made = key(name, glue), scratch / f"{name}.o"
    found = store.read("objects", digest)
    if found is not None:
        made.write_bytes(found)
        return made
    python = sysconfig.get_paths()["include"]
    if not Path(python, "Python.h").is_file():
        raise NoCompilerError(
            f"{python} has no Python.h; install Python's headers (Debian: apt-get install python3-dev)"
        )
    import cffi.recompiler

    parts = json.loads(glue)
    ffi = cffi.FFI()
    ffi.cdef(re.sub(r"^#.*$", "", parts["declared"], flags=re.M) + "\n".join(parts["prototypes"]))
    own = '#include "params.h"\n' if "_params_load" in glue else ""
    own += '#include "hand.h"\n' * ("extern const awiwi_hand " in glue)
    preamble = f'#include "awiwi.h"\n{own}' + OPTIMISED.format("\n".join(parts["loops"]))
    source = scratch / f"{name}.c"
    cffi.recompiler.make_c_source(ffi, name, preamble, str(source))
    here = (f"-fmacro-prefix-map={scratch}/=", f"-I{python}", f"-I{directory}", f"-I{CSRC}")  # no path in the bytes
    compiler().run(*GLUE_FLAGS, *here, "-c", str(source), "-o", str(made))
    store.write("objects", digest, made.read_bytes())
    return made
