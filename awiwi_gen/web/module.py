"""The generated C as one WebAssembly module, which a page carries and a browser runs: with the bits of the native library.

The compiler is that of the package ``ziglang``. Its bare target has no C library: kernels that call more of one than
WebAssembly's own instructions are left out.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Iterable
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from awiwi_gen.build import FLAGS, WARNINGS, Headers
from awiwi_gen.cache import Cache, key
from awiwi_gen.emit.names import function_name
from awiwi_gen.errors import BuildError
from awiwi_gen.extras import require
from awiwi_gen.resources import CSRC

INSTRUCTIONS = ("sqrt", "fabs")  # functions of math.h that the target has instructions for, so their bits are IEEE's
HEADERS = {
    "math.h": "".join(f"#define {name} __builtin_{name}\n" for name in INSTRUCTIONS),
    "string.h": "#define memcpy __builtin_memcpy\n#define memset __builtin_memset\n",
}
ELSEWHERE = re.compile(r"\b(tan|asin|acos|log)\(")  # what a graph may call that is neither an instruction nor our own
SHARED = ("sincos.c",)  # what kernels without a solver call
TARGET = ("cc", "--target=wasm32-freestanding")
SAME_FLAGS = tuple(flag for flag in FLAGS if flag not in ("-fPIC", *WARNINGS))
LINK = ("-nostdlib", "-Wl,--no-entry", "-Wl,--export-memory", "-Wl,--export=__heap_base", "-Wl,--strip-all")


def runnable(directory: Path, names: Iterable[str]) -> list[str]:
    """Those kernels of a generated directory whose C needs no library."""
    return [name for name in names if not ELSEWHERE.search((directory / f"{name}.c").read_text(encoding="utf-8"))]


def compile_kernels(directory: Path, prefix: str, names: Iterable[str], store: Cache) -> bytes:
    """Kernels of a generated directory, by name, as a WebAssembly module that exports their functions and its memory.

    Raises MissingExtraError without the compiler, BuildError where it refuses the code.
    """
    require("report with sliders", "ziglang")
    sources = [*(directory / f"{name}.c" for name in names), *(CSRC / name for name in SHARED)]
    texts = [source.read_text(encoding="utf-8") for source in sources]
    flags = (*SAME_FLAGS, *LINK, *(f"-Wl,--export={function_name(prefix, name)}" for name in names))
    digest = key(*texts, Headers.of(directory), sorted(HEADERS.items()), flags, version("ziglang"))
    data = store.read("modules", digest)
    if data is None:
        data = _linked(directory, sources, flags)
        store.write("modules", digest, data)
    return data


def _linked(directory: Path, sources: Iterable[Path], flags: Iterable[str]) -> bytes:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, text in HEADERS.items():
            (folder / name).write_text(text, encoding="utf-8")
        target = folder / "kernels.wasm"
        command = [
            _zig(),
            *TARGET,
            *flags,
            f"-I{folder}",
            f"-I{directory}",
            f"-I{CSRC}",
            *map(str, sources),
            "-o",
            str(target),
        ]
        own = {"ZIG_GLOBAL_CACHE_DIR": scratch, "ZIG_LOCAL_CACHE_DIR": scratch}
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | own)
        if done.returncode:
            raise BuildError(f"ziglang failed:\n{done.stderr.strip()[:4000]}")
        return target.read_bytes()


def _zig() -> str:
    """The program in the package ``ziglang``."""
    found = find_spec("ziglang")
    if found is None or found.origin is None:
        raise BuildError("the package ziglang has no program")
    return str(Path(found.origin).parent / "zig")
