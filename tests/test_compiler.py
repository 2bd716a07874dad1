"""What a compiled kernel is cached by: everything that decides it, and compilers that are refused."""

from __future__ import annotations

import os
import shutil
import sys
from importlib import metadata
from pathlib import Path

import pytest

import awiwi_gen
from awiwi_gen import cache, compiler
from awiwi_gen.build import Headers, load, object_key
from awiwi_gen.compiler import VARIABLES, bindings, machine
from awiwi_gen.errors import NoCompilerError
from awiwi_gen.resources import CSRC

SOURCE = CSRC / "dense.c"
HEADERS = {path.name: path.read_text() for path in CSRC.glob("*.h")}
GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="the options are gcc's")


@pytest.fixture(autouse=True)
def surroundings(monkeypatch):
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)


def current() -> str:
    return key_of(SOURCE)


def key_of(source: Path, **texts: str) -> str:
    """The key of an object where some headers have other texts."""
    return object_key(source, Headers(HEADERS | texts), compiler.compiler().identity)


@needs_gcc
@pytest.mark.parametrize("options", ["-O1", "-DX", "-DX=2", "-g", "-fno-inline", "-march=native", "-fwrapv"])
def test_an_option_of_the_command_changes_the_key(monkeypatch, options):
    monkeypatch.setenv("CC", "gcc")
    before = current()
    monkeypatch.setenv("CC", f"gcc {options}")

    assert current() != before
    monkeypatch.setenv("CC", "gcc")
    assert current() == before


@pytest.mark.parametrize("name", VARIABLES)
def test_a_variable_that_compilers_read_changes_the_key(monkeypatch, name):
    before = current()
    monkeypatch.setenv(name, "1" if name == "SOURCE_DATE_EPOCH" else "/nonexistent")
    try:
        assert current() != before
    except NoCompilerError:  # it does not even start: nothing is compiled with it
        assert name in ("GCC_EXEC_PREFIX", "COMPILER_PATH", "CCC_OVERRIDE_OPTIONS")


def wrapper(path: Path, *options: str) -> str:
    path.write_text(f'#!/bin/sh\nexec {GCC} {" ".join(options)} "$@"\n')
    path.chmod(0o755)
    return str(path)


@needs_gcc
def test_another_compiler_behind_the_same_name_changes_the_key(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", wrapper(tmp_path / "cc"))
    before = current()
    wrapper(tmp_path / "cc", "-O1")
    changed = current()
    assert changed != before

    monkeypatch.setenv("CC", wrapper(tmp_path / "elsewhere"))
    assert current() not in (before, changed)


@needs_gcc
def test_another_program_that_the_driver_runs_changes_the_key(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", "gcc")
    before = current()
    assembler = tmp_path / "as"
    assembler.write_text(f'#!/bin/sh\nexec {shutil.which("as")} "$@"\n')
    assembler.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    assert current() != before


def test_flags_text_and_headers_change_the_key(monkeypatch, tmp_path):
    before = current()
    assert key_of(SOURCE, **{"real.h": "typedef float awiwi_real;"}) != before
    assert key_of(CSRC / "riccati.c") != before
    monkeypatch.setattr(sys.modules["awiwi_gen.build"], "FLAGS", ("-std=c99",))
    assert current() != before


def test_only_headers_that_are_included_change_the_key():
    texts = {"a.h": '#include "b.h"', "b.h": ' # include  "c.h"\n#include <math.h>', "c.h": "int c;", "d.h": "int d;"}

    assert Headers(texts).included('#include <stdio.h>\n#include "a.h"\n') == ["a.h", "b.h", "c.h"]
    assert key_of(SOURCE, **{"kernels.h": "other kernels"}) == current()


@pytest.mark.parametrize("package", ["cffi", "numpy"])
def test_another_cffi_or_numpy_changes_the_key_of_libraries_and_verdicts(monkeypatch, package):
    before, proved = bindings(), machine()
    version = metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: "0.0" if name == package else version(name))
    machine.cache_clear()
    try:
        assert bindings() != before
        assert machine() != proved
    finally:
        machine.cache_clear()


class Optimised:
    optimize = 2


def test_python_without_docstrings_changes_all_keys(monkeypatch):
    before, derived = bindings(), cache.libraries()
    monkeypatch.setattr(sys, "flags", Optimised)
    cache.libraries.cache_clear()
    try:
        assert bindings() != before
        assert cache.libraries() == f"{derived}, without docstrings"
    finally:
        cache.libraries.cache_clear()


def test_a_second_process_asks_the_compiler_nothing(monkeypatch):
    before = current()
    compiler._identified.cache_clear()
    monkeypatch.setattr(compiler.subprocess, "run", None)

    assert current() == before


@needs_gcc
@pytest.mark.parametrize(
    ("options", "sign"),
    [
        ("-ffast-math", "__FAST_MATH__ is 1"),
        ("-Ofast", "-Ofast; __FAST_MATH__ is 1"),
        ("-ffinite-math-only", "__FINITE_MATH_ONLY__ is 1"),
        ("-funsafe-math-optimizations", "__RECIPROCAL_MATH__ is 1"),
        ("-freciprocal-math", "__RECIPROCAL_MATH__ is 1"),
        ("-fno-signed-zeros", "__NO_SIGNED_ZEROS__ is 1"),
        ("-fsingle-precision-constant", "__GCC_IEC_559 is 0"),
        ("-mpc32", "-mpc32"),
    ],
)
def test_a_compiler_that_does_not_compute_by_ieee_754_is_refused(monkeypatch, options, sign):
    monkeypatch.setenv("CC", f"gcc {options}")
    with pytest.raises(NoCompilerError) as caught:
        current()

    assert str(caught.value).startswith(f"the compiler 'gcc {options}' does not compute by IEEE 754 (")
    assert sign in str(caught.value)
    assert str(caught.value).endswith("leave -ffast-math, -Ofast and their relatives out of CC")
    assert caught.value.exit_code == 2


@needs_gcc
def test_a_wrapper_that_hides_fast_math_is_refused_too(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", wrapper(tmp_path / "cc", "-ffast-math"))
    with pytest.raises(NoCompilerError, match="__FAST_MATH__ is 1"):
        current()


@pytest.mark.parametrize("command", ["'gcc", "echo", "true"])
def test_what_is_no_compiler_is_refused_in_one_sentence(monkeypatch, command):
    monkeypatch.setenv("CC", command)
    with pytest.raises(NoCompilerError, match="no C compiler: ") as caught:
        current()

    assert len(str(caught.value).splitlines()) == 1


@needs_gcc
def test_a_library_of_another_command_is_another_library(monkeypatch, tmp_path):
    from samples import tree

    monkeypatch.setenv("CC", "gcc")
    first = load(tree(only="jaw_tendon_lengths"))
    monkeypatch.setenv("CC", "gcc -DANOTHER")
    assert load(tree(only="jaw_tendon_lengths")).origin != first.origin
    monkeypatch.setenv("CC", "gcc")
    assert load(tree(only="jaw_tendon_lengths")).origin == first.origin


def test_a_missing_compiler_is_reported_before_anything_is_derived(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", "/nonexistent/cc")
    monkeypatch.setenv("AWIWI_GEN_CACHE", str(tmp_path / "cache"))
    with pytest.raises(NoCompilerError, match="which is not there"):
        awiwi_gen.build(awiwi_gen.Hand.load())

    assert not (tmp_path / "cache").exists()
