"""Wheel and sdist hold all that they need, and work in environments where nothing else is installed."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pytest
from commands import ONE_FINGER, small  # noqa: F401 a fixture

import awiwi_gen
from awiwi_gen.cache import code_digest
from awiwi_gen.extras import COMMAND_LINE, EXTRAS
from awiwi_gen.pipeline import GENERATOR, Job, generate

ROOT = Path(__file__).resolve().parent.parent
PIP = ("-m", "pip", "--disable-pip-version-check", "--quiet")
NO_COMPILER = {"PATH": "/nonexistent", "CC": "/bin/false"}
PROJECT = ("awiwi_gen", "templates", "csrc", "tests", "pyproject.toml", "hatch_build.py", "README.md", "LICENSE", "Makefile",
           "requirements.lock", ".gitignore")  # fmt: skip
KERNELS = "jaw_tendon_lengths,jaw_mass_matrix"
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
def project(tmp_path_factory) -> Path:
    """The checkout with two kernels of a small hand in generated/, which a wheel carries compiled."""
    folder = tmp_path_factory.mktemp("project")
    for name in PROJECT:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, folder / name)
    generate(Job(awiwi_gen.Hand.load(ONE_FINGER), only=KERNELS), folder / "generated")
    return folder


@pytest.fixture(scope="module")
def wheel(project, tmp_path_factory) -> Path:
    return wheel_of(project, tmp_path_factory.mktemp("wheel"))


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


def test_the_wheel_holds_the_package_with_its_templates_its_c_and_a_compiled_hand(wheel):
    folders = {"awiwi_gen": "awiwi_gen", "templates": "awiwi_gen/templates", "csrc": "awiwi_gen/csrc"}
    wanted = {
        f"{inside}/{path.relative_to(ROOT / folder).as_posix()}"
        for folder, inside in folders.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    held = {name for name in contents(wheel) if ".dist-info/" not in name}

    assert held >= wanted
    assert {Path(name).parent.as_posix() for name in held - wanted} == {"awiwi_gen/default_hand"}
    assert {".json", ".so"} == {Path(name).suffix for name in held - wanted}
    assert "-cp311-abi3-" in wheel.name


def test_the_wheel_of_the_sdist_is_the_wheel_of_the_checkout(project, wheel, tmp_path):
    run("-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path, cwd=project)
    sdist = next(tmp_path.glob("*.tar.gz"))
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}

    assert contents(wheel_of(sdist, tmp_path)) == contents(wheel)
    assert names >= {
        "Makefile",
        "requirements.lock",
        "hatch_build.py",
        "generated/manifest.json",
        "tests/test_wheel.py",
        "csrc/awiwi.h",
    }


def test_an_installed_wheel_has_the_digests_of_its_checkout(with_everything, tmp_path):
    """So neither a key nor the freshness of a directory depends on where the package is."""
    code = """
from awiwi_gen.cache import code_digest
from awiwi_gen.extras import COMMAND_LINE, EXTRAS
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


CARRIED = """
import json, sys, numpy, awiwi_gen
lib = awiwi_gen.load()
q = numpy.linspace(-0.3, 0.3, 4002).reshape(2001, 2)
lib.jaw_mass_matrix(q)
print(json.dumps([list(lib), lib.digest, lib.jaw_mass_matrix(q).M.tolist(), lib.jaw_mass_matrix._vectorised is not None]))
"""


def test_the_compiled_hand_runs_without_a_compiler_and_has_the_bits_of_one_built_here(with_numpy_and_cffi, tmp_path):
    env = NO_COMPILER | {"AWIWI_GEN_CACHE": str(tmp_path / "cache")}
    names, digest, matrices, in_vectors = json.loads(
        run("-c", CARRIED, cwd=tmp_path, python=with_numpy_and_cffi, **env)
    )
    here = awiwi_gen.build(awiwi_gen.Hand.load(ONE_FINGER), only=KERNELS)

    assert (names, digest, in_vectors) == (list(here), here.digest, True)
    assert np.array_equal(matrices, here.jaw_mass_matrix(np.linspace(-0.3, 0.3, 4002).reshape(2001, 2)).M)
    assert list(tmp_path.iterdir()) == []


def test_build_takes_the_compiled_hand_exactly_when_hand_generator_and_options_agree(with_everything, tmp_path):
    code = """
import sys, awiwi_gen
for hand, options in ((sys.argv[1], {}), (sys.argv[1], {"scalar": "f32"}), (sys.argv[2], {})):
    try:
        print(type(awiwi_gen.build(awiwi_gen.Hand.load(hand), only=sys.argv[3], **options)).__name__)
    except awiwi_gen.BuildError as error:
        print(type(error).__name__)
"""
    other = tmp_path / "other.toml"
    other.write_text(Path(ONE_FINGER).read_text().replace('"9 mm"', '"9.5 mm"', 1))
    told = run("-c", code, ONE_FINGER, other, KERNELS, cwd=tmp_path, python=with_everything, **NO_COMPILER)

    assert told.split() == ["Library", "NoCompilerError", "NoCompilerError"]


def test_the_command_lists_and_calls_the_compiled_hand_without_what_derives(with_everything, tmp_path):
    hide = f"import sys; sys.modules.update(dict.fromkeys({[m for m in EXTRAS if m not in COMMAND_LINE]!r}))\n"
    code = hide + "from awiwi_gen.__main__ import main; main()"
    told = [
        json.loads(run("-c", code, *words, "--json", cwd=tmp_path, python=with_everything, **NO_COMPILER))
        for words in (["list"], ["call", "jaw_tendon_lengths", "q=0.1,0.2"])
    ]
    here = awiwi_gen.build(awiwi_gen.Hand.load(ONE_FINGER), only=KERNELS)

    assert [entry["name"] for entry in told[0]] == list(here)
    assert told[1] == {"h": here.jaw_tendon_lengths([0.1, 0.2]).tolist()}


def test_a_wheel_of_the_checkout_needs_a_compiler_and_says_so(project, tmp_path):
    words = ("-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path / "dist")
    done = subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True, cwd=project, check=False,
                          env=os.environ | NO_COMPILER)  # fmt: skip

    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(
        "the wheel of awiwi_gen carries compiled C: no C compiler: /bin/false "
    )
    assert not list(tmp_path.rglob("*.whl"))


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
