"""Compiled hands in packages that wheels install: loaded as they are, without a compiler.

`wheel.py` makes them. Such a package holds a record (format, platform, manifest, names), the library of all kernels, and one
of their loops over samples for each set of vector instructions.
"""

from __future__ import annotations

import ctypes
import importlib.machinery
import importlib.util
import json
import sysconfig
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from awiwi_gen.errors import BuildError, InputError
from awiwi_gen.resources import PACKAGE

if TYPE_CHECKING:
    from awiwi_gen.cache import Cache
    from awiwi_gen.library import Library

FORMAT = 1  # of these packages; another one means that they must be made again
RECORD = "library.json"
DEFAULT = f"{PACKAGE.name}.default_hand"  # in wheels of this package alone
CHECKOUT = PACKAGE.parent / "generated"
BATCHES = "batches{}.so"  # for every processor, and with the name of vector instructions that not all have
WIDER = "avx2"
HAS_WIDER = "processor_has_wider_vectors"  # a function in the former
VECTORISE_AFTER = 1000  # samples of a kernel: nothing is compiled, so the loops need not earn much


def default_library(store: Cache | None = None) -> Library:
    """The Awiwi hand that came with this package. Raises InputError where none did, and what `load_shipped` raises."""
    if default_record() is not None:
        return load_shipped(DEFAULT)
    if not (CHECKOUT / "manifest.json").is_file():
        raise InputError("this installation carries no compiled hand; name a generated directory: load('generated')")
    from awiwi_gen.build import load

    return load(CHECKOUT, store)


def default_record() -> Mapping[str, Any] | None:
    """The record of the hand that this package carries compiled; None in a checkout."""
    return _record(DEFAULT) if (PACKAGE / DEFAULT.rpartition(".")[2]).is_dir() else None


def default_manifest() -> Mapping[str, Any] | None:
    """The manifest of the hand that came with this package, compiled or in its checkout."""
    from awiwi_gen.emit.tree import read_manifest

    record = default_record()
    return record["manifest"] if record else read_manifest(CHECKOUT)


def default_made_from(inputs: Mapping[str, Any]) -> Library | None:
    """The hand that this package carries compiled, if it was made from just these inputs and from this csrc."""
    from awiwi_gen.cache import code_digest

    record = default_record()
    if record is None or record["manifest"]["inputs"] != inputs or record["csrc"] != code_digest("csrc"):
        return None
    return load_shipped(DEFAULT)


@cache
def load_shipped(package: str, digest: str = "") -> Library:
    """The compiled hand of an installed package as NumPy functions; with a digest, only if that is its library.

    Raises InputError where there is no such package, BuildError where it does not fit this machine or this awiwi_gen.
    """
    from awiwi_gen.library import Library
    from awiwi_gen.views import Names

    folder, record = _folder(package), _record(package)
    if digest not in ("", record["digest"]):
        raise BuildError(f"{package} has changed since its library was pickled; pickle it again")
    manifest = record["manifest"]
    path = folder / record["file"]
    try:
        module = import_extension(record["module"], str(path))
    except (ImportError, OSError) as error:
        absent = str(error).endswith("No such file or directory")  # says the loader of other processors' files, too
        reason = "it is for another processor" if absent and path.is_file() else str(error)
        message = f"{package} was compiled for {record['platform']} and cannot be loaded on {sysconfig.get_platform()}"
        raise BuildError(f"{message}: {reason}") from None

    def vectorised(entry: Mapping[str, Any]) -> Any:
        batches = _batches(folder)
        try:
            return None if batches is None else batch_of(batches, entry, manifest, module.ffi)
        except AttributeError:
            return None

    names = {finger: Names(*map(tuple, both)) for finger, both in record["names"].items()}
    origin = (load_shipped, (package, record["digest"]))
    library = Library(manifest, module.lib, module.ffi, vectorised, origin, names=names)
    library.vectorise_after = VECTORISE_AFTER
    return library


def _folder(package: str) -> Path:
    """Where an installed package is."""
    spec = importlib.util.find_spec(package)
    places = spec.submodule_search_locations if spec else None
    if not places:
        raise InputError(f"{package} is not installed; install its wheel, which awiwi-gen wheel makes")
    return Path(next(iter(places)))


@cache
def _record(package: str) -> Mapping[str, Any]:
    """What a package says of its library. Raises BuildError where it is damaged or in another format."""
    path = _folder(package) / RECORD
    try:
        record: Mapping[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        found = int(record["format"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BuildError(f"{package} is damaged ({path.name}: {error}); install its wheel again") from None
    if found != FORMAT:
        fix = "install a newer awiwi_gen" if found > FORMAT else "make its wheel again with awiwi-gen wheel"
        raise BuildError(f"{package} has format {found}, and this awiwi_gen reads {FORMAT}; {fix}")
    return record


@cache
def _batches(folder: Path) -> ctypes.CDLL | None:
    """The library of loops over samples with the widest vectors of this processor; None where no kernel has a loop."""
    usual, wider = (folder / BATCHES.format(name) for name in ("", f"_{WIDER}"))
    if not usual.is_file():
        return None
    found = ctypes.CDLL(str(usual))
    return ctypes.CDLL(str(wider)) if wider.is_file() and getattr(found, HAS_WIDER)() else found


def batch_of(library: ctypes.CDLL, entry: Mapping[str, Any], manifest: Mapping[str, Any], ffi: Any) -> Any:
    """A kernel's loop over samples in a library that has it. Raises AttributeError where it has not."""
    from awiwi_gen.emit.batch import prototype

    head = prototype(entry, manifest["prefix"], manifest["c_type"])
    result, name = head.split("(")[0].split()
    address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
    return ffi.cast(head.replace(f"{result} {name}", f"{result} (*)", 1), address)


def import_extension(name: str, path: str) -> Any:
    """The Python module of a library, from its file. Raises ImportError where that is impossible."""
    loader = importlib.machinery.ExtensionFileLoader(name, path)
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None:
        raise BuildError(f"{path} cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module
