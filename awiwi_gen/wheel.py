"""Wheels with a compiled hand: they run on every machine of a kind, without a compiler.

The library of kernels is that of `build.py`, whose wrapper keeps to Python's stable ABI. Loops over samples, which
`build.py` compiles for one machine, are compiled for the plainest processor and again with wider vectors;
`shipped.py` chooses when they are first needed.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
import sysconfig
import tempfile
import zipfile
from base64 import urlsafe_b64encode
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from awiwi_gen.build import BATCH_FLAGS, Headers, assemble_batch, compiled, text_of
from awiwi_gen.cache import Cache, code_digest, key
from awiwi_gen.compiler import compiler
from awiwi_gen.emit import batch
from awiwi_gen.emit.options import GCC_FLAGS
from awiwi_gen.emit.tree import OWN_DIGEST
from awiwi_gen.errors import NoCompilerError
from awiwi_gen.parallel import Progress, silent
from awiwi_gen.shipped import BATCHES, FORMAT, HAS_WIDER, RECORD, WIDER
from awiwi_gen.views import names_in
from awiwi_gen.writing import whole_file

if TYPE_CHECKING:
    from awiwi_gen.pipeline import Job

WIDER_FLAGS = {"x86_64": ("-mavx2",)}  # by machine; without fused multiply-add instructions, as everywhere
QUESTION = f'int {HAS_WIDER}(void) {{ return __builtin_cpu_supports("{WIDER}") != 0; }}\n'
OLDEST_LINUX = 17  # of glibc 2 for which there are tags
MOMENT = (1980, 1, 1, 0, 0, 0)  # the first that an archive can hold: the same bytes every time
PYTHON = "cp311-abi3"
INIT = '''"""The kernels of a hand, compiled; made by awiwi-gen wheel.

>>> import {package}
>>> lib = {package}.load()
"""

from awiwi_gen.shipped import load_shipped


def load():
    """The compiled hand as NumPy functions, as `awiwi_gen.load` returns it."""
    return load_shipped(__name__)
'''
METADATA = """Metadata-Version: 2.1
Name: {package}
Version: {version}
Summary: {summary}
Requires-Python: >=3.11
Requires-Dist: awiwi_gen>={generator}
"""
WHEEL = """Wheel-Version: 1.0
Generator: awiwi_gen
Root-Is-Purelib: false
Tag: {tag}
"""


def run(job: Job, output: Path, as_json: bool) -> None:
    """Generate a hand, write its wheel into a folder, and say how to use it."""
    from awiwi_gen.pipeline import cached_tree
    from awiwi_gen.report import print_json

    _require_portable()  # an error before anything is derived
    path = write_wheel(cached_tree(job), output, metadata.version("awiwi_gen"), job.store, job.progress)
    package = f"{job.hand.prefix}_hand"
    if as_json:
        print_json({"wheel": str(path), "package": package, "digest": job.hand.digest()})
    else:
        print(f"{path}: pip install it, then: import {package}; lib = {package}.load()")


def write_wheel(directory: Path, output: Path, version: str, store: Cache, progress: Progress = silent) -> Path:
    """Write a wheel of a generated directory, PREFIX_hand, into a folder; ``version`` is that of awiwi_gen.

    The manifest's digest is part of the wheel's version, so that pip replaces one revision by another. Raises
    NoCompilerError where there is no compiler, or none for other machines, OutputError where the file cannot be written.
    """
    files = package_files(directory, store, progress)
    record = json.loads(files[RECORD])
    manifest, tag = record["manifest"], wheel_tag(files)
    package, full = f"{manifest['prefix']}_hand", f"{version}+{manifest[OWN_DIGEST][:12]}"
    info = f"{package}-{full}.dist-info"
    summary = f"{' '.join(manifest['hand'].split())}: {len(manifest['kernels'])} compiled kernels"
    content = {f"{package}/{name}": data for name, data in files.items()}
    content[f"{package}/__init__.py"] = INIT.format(package=package).encode()
    content[f"{info}/METADATA"] = METADATA.format(
        package=package, version=full, summary=summary, generator=version
    ).encode()
    content[f"{info}/WHEEL"] = WHEEL.format(tag=tag).encode()
    rows = [f"{name},sha256={_digest(data)},{len(data)}\n" for name, data in content.items()]
    content[f"{info}/RECORD"] = "".join([*rows, f"{info}/RECORD,,\n"]).encode()
    path = output / f"{package}-{full}-{tag}.whl"
    with whole_file(path) as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            entry = zipfile.ZipInfo(name, MOMENT)
            entry.external_attr, entry.compress_type = 0o644 << 16, zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    return path


def package_files(directory: Path, store: Cache, progress: Progress = silent) -> dict[str, bytes]:
    """What a package with the compiled hand of a generated directory holds, by name. Raises as `write_wheel` does."""
    _require_portable()
    made = compiled(directory, store)
    file = f"{made.name}.abi3.so"
    names = names_in(text_of(directory / "hand.h"), made.manifest["prefix"])
    record = {
        "format": FORMAT,
        "platform": platform_tag(made.data),
        "module": made.name,
        "file": file,
        "digest": made.digest,
        "csrc": code_digest("csrc"),
        "names": {finger: [both.joints, both.tendons] for finger, both in names.items()},
        "manifest": made.manifest,
    }
    batches = _batch_libraries(directory, made.manifest, store, progress)
    return {RECORD: json.dumps(record, ensure_ascii=False).encode(), file: made.data, **batches}


def wheel_tag(files: Mapping[str, bytes]) -> str:
    """The tag of a wheel with these files: any CPython from 3.11 on, and the platform."""
    return f"{PYTHON}-{platform_tag(*(data for name, data in files.items() if name.endswith('.so')))}"


def platform_tag(*libraries: bytes) -> str:
    """The platforms that can load some libraries, as wheels name them: on Linux by the C library that they need."""
    platform = re.sub(r"[-.]", "_", sysconfig.get_platform())
    needed = [int(minor) for data in libraries for minor in re.findall(rb"GLIBC_2\.(\d+)", data)]
    return platform.replace("linux_", f"manylinux_2_{max(OLDEST_LINUX, *needed)}_") if needed else platform


def _require_portable() -> None:
    """Raise NoCompilerError where this Python or this compiler makes libraries for few others."""
    if sysconfig.get_config_var("Py_GIL_DISABLED") or sysconfig.get_config_var("Py_DEBUG"):
        raise NoCompilerError(f"{sys.executable} has no stable ABI; make wheels with a usual build of Python")
    found = compiler()
    macros = found.run("-dM", "-E", "-x", "c", os.devnull)
    if sys.platform == "linux" and "__x86_64__" in macros and "__SSE3__" in macros:
        plain = " ".join(word for word in found.command if not word.startswith("-m"))
        raise NoCompilerError(
            f"the compiler {' '.join(found.command)!r} compiles for newer processors than x86-64, "
            f"and a wheel is for all; set CC='{plain} -march=x86-64'"
        )


def _batch_libraries(
    directory: Path, manifest: Mapping[str, Any], store: Cache, progress: Progress
) -> dict[str, bytes]:
    """Libraries of loops over samples, one for every processor and one with wider vectors, by name."""
    entries = [e for e in manifest["kernels"] if batch.worthwhile(e, text_of(directory / f"{e['name']}.c"))]
    machine = sysconfig.get_platform().rpartition("-")[2]
    wider = WIDER_FLAGS.get(machine)
    levels: dict[str, tuple[str, ...]] = {"": (), **({f"_{WIDER}": wider} if wider else {})}
    if not entries:
        return {}
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(os.cpu_count()) as pool:
        objects: dict[str, list[Path]] = {}
        jobs = []
        for level, flags in levels.items():
            folder = Path(scratch, level or "usual")
            folder.mkdir()
            objects[level] = [folder / f"{entry['name']}.o" for entry in entries]
            jobs += [partial(_batch_object, directory, store, flags, into) for into in objects[level]]
        for done, _ in enumerate(pool.map(lambda job: job(), jobs), 1):
            progress("vectors", done, len(jobs))
        if wider:
            question = Path(scratch, "question.c")
            question.write_text(QUESTION, encoding="utf-8")
            compiler().run("-O2", "-fPIC", "-c", str(question), "-o", str(question.with_suffix(".o")))
            objects[""].append(question.with_suffix(".o"))
        return {BATCHES.format(level): _linked(found, Path(scratch, "all.so")) for level, found in objects.items()}


def _batch_object(directory: Path, store: Cache, flags: tuple[str, ...], into: Path) -> None:
    """The object of a kernel's loop over samples, from the cache where it is there."""
    source = directory / batch.BATCHES / f"{into.stem}.c"
    texts = (text_of(directory / source.name), Headers.of(directory), text_of(source), Headers.of(source.parent))
    digest = key("object", *texts, BATCH_FLAGS, GCC_FLAGS, flags, compiler().identity)
    data = store.read("batches", digest)
    if data is None:
        assembly = into.with_suffix(".s")
        assemble_batch(source, assembly, flags, ((),))
        compiler().run("-c", str(assembly), "-o", str(into))
        store.write("batches", digest, into.read_bytes())
    else:
        into.write_bytes(data)


def _linked(objects: list[Path], made: Path) -> bytes:
    compiler().run("-shared", "-s", *map(str, objects), "-o", str(made), "-lm")
    return made.read_bytes()


def _digest(data: bytes) -> str:
    return urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
