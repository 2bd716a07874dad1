"""Wheel and sdist hold all that they need, and work in environments where nothing else is installed."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import venv
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import pytest
from commands import ONE_FINGER, small  # noqa: F401 a fixture

import awiwi_gen
from awiwi_gen.cache import code_digest
from awiwi_gen.pipeline import GENERATOR

ROOT = Path(__file__).resolve().parent.parent
PIP = ("-m", "pip", "--disable-pip-version-check", "--quiet")
NO_INDEX = ("--no-index", "--no-deps", "--no-build-isolation")


def run(*words: object, cwd: Path, python: object = sys.executable, **env: str) -> str:
    """What a program prints; its complaints fail the test."""
    command = [str(python), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=os.environ | env, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def wheel_of(source: Path, into: Path) -> Path:
    run(*PIP, "wheel", *NO_INDEX, source, "-w", into, cwd=into)
    return next(into.glob("*.whl"))


def contents(wheel: Path) -> dict[str, int]:
    """The checksum of each file."""
    with zipfile.ZipFile(wheel) as archive:
        return {info.filename: info.CRC for info in archive.infolist()}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    return wheel_of(ROOT, tmp_path_factory.mktemp("wheel"))


def environment(folder: Path, wheel: Path) -> tuple[Path, Path]:
    """The Python and the packages of a new environment with the wheel and nothing else."""
    venv.create(folder, symlinks=True)
    python = folder / "bin" / "python"
    run(*PIP, "--python", python, "install", *NO_INDEX, wheel, cwd=folder)
    return python, next(folder.glob("lib/python*/site-packages"))


@pytest.fixture(scope="module")
def with_numpy_and_cffi(tmp_path_factory, wheel) -> Path:
    """The small install, with links to the packages that are installed here."""
    python, packages = environment(tmp_path_factory.mktemp("small_install"), wheel)
    for name in ("numpy", "cffi", "pycparser"):
        files = distribution(name)
        for top in {file.parts[0] for file in files.files or ()} - {"..", "__pycache__"}:
            (packages / top).symlink_to(files.locate_file(top))
    return python


@pytest.fixture(scope="module")
def with_everything(tmp_path_factory, wheel) -> Path:
    """The wheel before all packages that are installed here."""
    python, packages = environment(tmp_path_factory.mktemp("everything"), wheel)
    (packages / "others.pth").write_text(f"{distribution('sympy').locate_file('')}\n")
    return python


def test_the_wheel_holds_the_package_with_its_templates_and_its_c(wheel):
    folders = {"awiwi_gen": "awiwi_gen", "templates": "awiwi_gen/templates", "csrc": "awiwi_gen/csrc"}
    wanted = {
        f"{inside}/{path.relative_to(ROOT / folder).as_posix()}"
        for folder, inside in folders.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }

    assert {name for name in contents(wheel) if ".dist-info/" not in name} == wanted


def test_the_wheel_of_the_sdist_is_the_wheel_of_the_checkout(wheel, tmp_path):
    run("-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path, cwd=ROOT)
    sdist = next(tmp_path.glob("*.tar.gz"))
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}

    assert contents(wheel_of(sdist, tmp_path)) == contents(wheel)
    assert names >= {
        "Makefile",
        "requirements.lock",
        "generated/manifest.json",
        "tests/test_wheel.py",
        "csrc/awiwi.h",
    }


def test_an_installed_wheel_has_the_digests_of_its_checkout(with_everything, tmp_path):
    """So neither a key nor the freshness of a directory depends on where the package is."""
    code = """
from awiwi_gen.cache import code_digest
from awiwi_gen.pipeline import GENERATOR
for rooms in (["templates"], ["csrc"], GENERATOR):
    print(code_digest(*rooms))
"""
    told = run("-c", code, cwd=tmp_path, python=with_everything).split()

    assert told == [code_digest("templates"), code_digest("csrc"), code_digest(*GENERATOR)]
    assert len(set(told)) == 3


def test_a_digest_of_nothing_is_an_error():
    with pytest.raises(ValueError, match="no source text in no_such_room"):
        code_digest("csrc", "no_such_room")


def test_an_installed_wheel_generates_the_same_c(with_everything, small, tmp_path):  # noqa: F811
    words = ("-m", "awiwi_gen", "generate", "--hand", ONE_FINGER, "--only", "jaw_[fjt]*", "-o", "new")
    run(*words, cwd=tmp_path, python=with_everything, AWIWI_GEN_CACHE=str(tmp_path / "cache"))
    made, known = (
        {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        for folder in (tmp_path / "new", small)
    )

    assert made == known


def test_a_wheel_with_numpy_and_cffi_loads_and_calls_generated_c(with_numpy_and_cffi, small, tmp_path):  # noqa: F811
    code = "import sys, awiwi_gen; print(awiwi_gen.load(sys.argv[1]).jaw_tendon_lengths([0.1, 0.2]).tolist())"
    told = run("-c", code, small, cwd=tmp_path, python=with_numpy_and_cffi)

    assert told.strip() == str(awiwi_gen.load(small).jaw_tendon_lengths([0.1, 0.2]).tolist())


def test_without_a_compiler_it_says_so(with_numpy_and_cffi, small, tmp_path):  # noqa: F811
    code = """
import sys, awiwi_gen
try:
    awiwi_gen.load(sys.argv[1])
except awiwi_gen.BuildError as error:
    print(error)
"""
    told = run("-c", code, small, cwd=tmp_path, python=with_numpy_and_cffi, PATH="/nonexistent", CC="")

    assert told.startswith("no C compiler: there is no cc, gcc or clang on the PATH; install one")


def test_the_command_of_the_small_install_says_what_it_needs(with_numpy_and_cffi, tmp_path):
    done = subprocess.run(
        [with_numpy_and_cffi.with_name("awiwi-gen"), "list"], capture_output=True, text=True, cwd=tmp_path, check=False
    )

    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "awiwi-gen needs typer and pydantic; install them: pip install 'awiwi_gen[cli]'; "
        'Python alone has awiwi_gen.load("generated")\n'
    )
