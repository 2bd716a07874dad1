"""Wheels with a compiled hand: one for all CPythons and processors, loaded without a compiler, with the same bits."""

from __future__ import annotations

import json
import os
import pickle
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from commands import ONE_FINGER, answer, complaint
from samples import fields, points, same_bits
from tools import need

import awiwi_gen
from awiwi_gen.build import FUSED
from awiwi_gen.compiler import compiler
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import BuildError, InputError
from awiwi_gen.shipped import HAS_WIDER, RECORD, default_manifest, load_shipped
from awiwi_gen.wheel import platform_tag

KERNELS = ("--hand", ONE_FINGER, "--only", "jaw_tendon_lengths,jaw_mass_matrix")
# All that cffi's wrapper calls of Python, each in the stable ABI since 3.2 (docs.python.org/3/c-api/stable.html).
STABLE = {
    "PyArg_UnpackTuple", "PyErr_Occurred", "PyEval_RestoreThread", "PyEval_SaveThread", "PyFloat_AsDouble",
    "PyImport_ImportModule", "PyLong_FromLong", "PyLong_FromVoidPtr", "PyObject_CallMethod", "PyObject_Free",
    "PyObject_Malloc", "_Py_Dealloc", "_Py_NoneStruct",
}  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """The wheel of two kernels of the small hand."""
    done = answer("wheel", *KERNELS, "-o", tmp_path_factory.mktemp("dist"))
    assert done["package"] == "claw_hand"
    return Path(done["wheel"])


@pytest.fixture(scope="module")
def alone():
    """The same kernels as they are built for this machine."""
    return awiwi_gen.build(awiwi_gen.Hand.load(ONE_FINGER), only=KERNELS[-1])


@pytest.fixture
def package(made, tmp_path, monkeypatch):
    """A function that installs the wheel's package under a new name, and returns its folder."""
    monkeypatch.syspath_prepend(tmp_path)

    def install(name: str) -> Path:
        with zipfile.ZipFile(made) as archive:
            archive.extractall(tmp_path / "wheel")
        shutil.copytree(tmp_path / "wheel" / "claw_hand", tmp_path / name)
        return tmp_path / name

    return install


def change(folder: Path, **entries: object) -> None:
    path = folder / RECORD
    path.write_text(json.dumps(json.loads(path.read_text()) | entries))


def disassembled(library: Path) -> str:
    return subprocess.run(["objdump", "-d", library], capture_output=True, text=True, check=True).stdout


# ------------------------------------------------------------------------------------------------- what is inside


def test_the_name_of_a_wheel_tells_the_revision_the_stable_abi_and_the_platform(made, alone):
    name, version, python, abi, platform = made.name.removesuffix(".whl").split("-")

    assert (name, python, abi) == ("claw_hand", "cp311", "abi3")
    assert version.endswith(f"+{alone.manifest['manifest_digest'][:12]}")
    assert re.fullmatch(r"manylinux_2_\d+_\w+|(?!linux)\w+", platform)


def test_a_platform_is_named_after_the_newest_symbol_of_the_c_library_that_is_needed():
    assert platform_tag(b"GLIBC_2.2.5 GLIBC_2.14").startswith("manylinux_2_17_")
    assert platform_tag(b"GLIBC_2.4", b"GLIBC_2.29").startswith("manylinux_2_29_")
    assert not platform_tag(b"").startswith("manylinux")


def test_wheels_of_one_hand_have_the_same_bytes(made, tmp_path):
    again = answer("wheel", *KERNELS, "-o", tmp_path)["wheel"]

    assert Path(again).read_bytes() == made.read_bytes()


def test_the_record_has_the_digest_and_size_of_every_file(made, tmp_path):
    with zipfile.ZipFile(made) as archive:
        (record,) = (name for name in archive.namelist() if name.endswith(".dist-info/RECORD"))
        rows = {row.split(",")[0]: row.split(",")[1:] for row in archive.read(record).decode().splitlines()}

        assert rows.keys() == {*archive.namelist()}
        assert all(int(size) == archive.getinfo(name).file_size for name, (_, size) in rows.items() if size)


def test_a_library_needs_nothing_of_python_but_its_stable_abi_and_holds_no_path(package):
    (library,) = package("abi_hand").glob("*.abi3.so")
    listed = subprocess.run(["nm", "-D", "--undefined-only", library], capture_output=True, text=True, check=True)
    wanted = {line.split()[-1].partition("@")[0] for line in listed.stdout.splitlines()}

    assert {name for name in wanted if re.match("_?Py", name)} <= STABLE
    assert b"/tmp" not in library.read_bytes()


def test_no_library_fuses_operations_and_only_one_has_wider_vectors(package):
    if "__x86_64__" not in compiler().run("-dM", "-E", "-x", "c", "/dev/null"):
        pytest.skip("there is one set of vector instructions")
    folder = package("level_hand")
    code = {path.name: disassembled(path) for path in folder.glob("*.so")}
    wide = {name for name, text in code.items() if "%ymm" in text}

    assert len(code) == 3
    assert wide == {"batches_avx2.so"}
    assert not any(FUSED.search(text) or "%zmm" in text for text in code.values())


@pytest.mark.parametrize(("processor", "wider"), [("Nehalem", 0), ("max", 1)])
def test_the_processor_is_asked_for_its_vectors(processor, wider, package, tmp_path):
    folder, emulator = package(f"{processor}_hand".lower()), need("qemu-x86_64")
    if not (folder / "batches_avx2.so").is_file():
        pytest.skip("there is one set of vector instructions")
    (tmp_path / "main.c").write_text(f"int {HAS_WIDER}(void);\nint main(void) {{ return {HAS_WIDER}(); }}\n")
    program = str(tmp_path / "main")
    compiler().run(str(tmp_path / "main.c"), str(folder / "batches.so"), f"-Wl,-rpath,{folder}", "-o", program)

    assert subprocess.run([emulator, "-cpu", processor, program], check=False).returncode == wider


# ------------------------------------------------------------------------------------------------- loading it


@pytest.mark.parametrize("level", ["wider vectors", "any processor"])
def test_a_shipped_hand_has_the_bits_of_one_that_was_built_here(level, package, alone):
    folder = package(f"{level.split()[0]}_bits_hand")
    if level == "any processor":
        (folder / "batches_avx2.so").unlink(missing_ok=True)
    lib = load_shipped(folder.name)
    function, given = lib.jaw_mass_matrix, points(alone.jaw_mass_matrix, 2003)
    together = fields(function(*given))

    assert list(lib) == list(alone)
    assert function._vectorised, "2003 samples did not take the loop of the wheel"
    for sample in (0, 1, 1000, 2002):
        one = [array[sample] for array in given]
        assert same_bits(alone.jaw_mass_matrix(*one), tuple(field[sample] for field in together))
        assert same_bits(function(*one), alone.jaw_mass_matrix(*one))
    assert same_bits(lib.jaw_tendon_lengths(*given), alone.jaw_tendon_lengths(*given))
    assert lib.finger("jaw").joints == alone.finger("jaw").joints


def test_kernels_of_a_package_are_pickled_by_its_name(package):
    folder = package("pickled_hand")
    lib = load_shipped(folder.name)
    data = pickle.dumps(lib.jaw_tendon_lengths)

    assert str(folder) not in data.decode("latin-1")
    assert same_bits(pickle.loads(data)([0.1, 0.2]), lib.jaw_tendon_lengths([0.1, 0.2]))

    moved = pickle.dumps(lib).replace(lib.origin[1][1].encode(), b"0" * 64)
    with pytest.raises(BuildError, match="pickled_hand has changed since its library was pickled; pickle it again"):
        pickle.loads(moved)


def test_a_kernel_is_made_when_it_is_first_asked_for_and_only_once(package):
    lib = load_shipped(package("lazy_hand").name)
    assert lib._kernels._made == {}
    assert lib.jaw_mass_matrix is lib["jaw_mass_matrix"]
    assert lib.finger("jaw").mass_matrix is lib.jaw_mass_matrix
    assert set(lib._kernels._made) == {"jaw_mass_matrix"}


def test_loading_a_hand_and_calling_a_kernel_imports_nothing_that_derives_compiles_or_is_slow(package, tmp_path):
    package("light_hand")
    code = """
import sys, numpy
before = set(sys.modules)
from awiwi_gen.shipped import load_shipped
load_shipped("light_hand").jaw_tendon_lengths([0.1, 0.2])
print(*sorted(name for name in set(sys.modules) - before if name.startswith("awiwi_gen") or "." not in name))
"""
    env = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env, check=True)
    ours = {name for name in done.stdout.split() if name.startswith("awiwi_gen")} - {"awiwi_gen"}

    assert {name.removeprefix("awiwi_gen.") for name in ours} == {
        "arrays", "docstrings", "errors", "extras", "library", "resources", "shipped", "views"
    }  # fmt: skip
    assert not {"subprocess", "email", "logging", "zipfile", "cffi", "pycparser"} & {*done.stdout.split()}


def test_the_function_build_stays_when_the_module_of_its_name_is_imported():
    assert callable(sys.modules["awiwi_gen.build"].load)
    assert callable(awiwi_gen.build)


def test_wheels_in_single_precision_with_numbers_read_at_run_time_have_those_numbers(tmp_path, monkeypatch):
    words = ("--scalar", "f32", "--params", "runtime", "--only", "jaw_tendon_lengths")
    wheel = answer("wheel", "--hand", ONE_FINGER, *words, "-o", tmp_path)["wheel"]
    folder = tmp_path / "installed"
    monkeypatch.syspath_prepend(folder)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    (folder / "claw_hand").rename(folder / "single_hand")
    lib = load_shipped("single_hand")
    h = lib.jaw_tendon_lengths([0.1, 0.2])
    thicker = lib.with_numbers(2 * lib.default_numbers())

    assert h.dtype == np.float32
    assert not np.array_equal(thicker.jaw_tendon_lengths([0.1, 0.2]), h)


# ------------------------------------------------------------------------------------------------- what fails


def test_a_package_of_another_format_names_the_fix(package):
    for name, version, fix in (
        ("newer_hand", 2, "install a newer awiwi_gen"),
        ("older_hand", 0, "make its wheel again with awiwi-gen wheel"),
    ):
        change(package(name), format=version)
        with pytest.raises(BuildError) as caught:
            load_shipped(name)
        assert str(caught.value) == f"{name} has format {version}, and this awiwi_gen reads 1; {fix}"


def test_a_library_of_another_machine_is_told_as_such(package):
    folder = package("foreign_hand")
    (library,) = folder.glob("*.abi3.so")
    library.write_bytes(library.read_bytes()[:18] + b"\xf3" + library.read_bytes()[19:])  # of RISC-V, says its header
    with pytest.raises(BuildError, match=r"^foreign_hand was compiled for \w+ and cannot be loaded on [\w-]+: \w"):
        load_shipped("foreign_hand")


def test_damage_is_told_with_the_fix(package):
    (package("damaged_hand") / RECORD).write_text("{")
    with pytest.raises(BuildError, match=r"^damaged_hand is damaged \(library.json: .*\); install its wheel again$"):
        load_shipped("damaged_hand")
    with pytest.raises(
        InputError, match=r"^absent_hand is not installed; install its wheel, which awiwi-gen wheel makes$"
    ):
        load_shipped("absent_hand")


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("/nonexistent/cc", "no C compiler: $CC is '/nonexistent/cc', which is not there; "
         "install one (Debian: apt-get install gcc) or set CC"),
        ("gcc -march=x86-64-v3", "the compiler 'gcc -march=x86-64-v3' compiles for newer processors than x86-64, "
         "and a wheel is for all; set CC='gcc -march=x86-64'"),
    ],
)  # fmt: skip
def test_a_compiler_that_makes_no_wheel_is_told_and_nothing_is_written(command, message, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "")
    if "gcc" in command and "__x86_64__" not in compiler().run("-dM", "-E", "-x", "c", "/dev/null"):
        pytest.skip("the command is for x86")
    monkeypatch.setenv("CC", command)

    assert complaint("wheel", *KERNELS, "-o", tmp_path / "dist", code=2) == message
    assert list(tmp_path.iterdir()) == []


# ------------------------------------------------------------------------------------------------- the packaged hand


def test_a_checkout_compiles_the_hand_that_wheels_carry(lib):
    found = awiwi_gen.load()

    assert found.digest == lib.digest
    assert default_manifest()["digest"] == lib.digest
    assert Options(**{k: v for k, v in default_manifest()["inputs"]["options"].items() if k != "only"}) == Options()


def test_an_installation_without_a_compiled_hand_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr("awiwi_gen.shipped.CHECKOUT", tmp_path)
    with pytest.raises(InputError, match=r"carries no compiled hand; name a generated directory: load\('generated'\)"):
        awiwi_gen.load()
