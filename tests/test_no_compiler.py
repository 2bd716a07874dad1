"""Without a C compiler that works: one clear message, exit code 2, and nothing is replaced."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from awiwi_gen.build import load
from awiwi_gen.cache import Cache
from awiwi_gen.errors import BuildError

ONE_FINGER = str(Path(__file__).with_name("one_finger.toml"))
OPTIONS = ("--hand", ONE_FINGER, "--only", "jaw_tendon_lengths")
NOWHERE = {"CC": "/nonexistent/cc"}
NOTHING_ON_THE_PATH = {"CC": "", "PATH": "/nonexistent"}


def run(*arguments: object, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, "-m", "awiwi_gen", *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, env=dict(os.environ) | env, check=False)


@pytest.fixture(scope="module")
def generated(tmp_path_factory) -> Path:
    """Generating needs no compiler, so this works in the same poor surroundings."""
    directory = tmp_path_factory.mktemp("poor") / "generated"
    done = run("generate", *OPTIONS, "-o", directory, env=NOWHERE)
    assert done.returncode == 0, done.stderr
    return directory


@pytest.fixture
def empty_cache(tmp_path) -> dict[str, str]:
    return {"AWIWI_GEN_CACHE": str(tmp_path / "cache")}


def contents(directory: Path) -> dict[str, tuple[int, bytes]]:
    return {str(path): (path.stat().st_mtime_ns, path.read_bytes()) for path in directory.rglob("*") if path.is_file()}


@pytest.mark.parametrize("command", ["build", "verify", "generate --verify"])
def test_a_compiler_that_is_not_there_is_named(command, generated, empty_cache):
    before = contents(generated)
    options = () if command == "build" else OPTIONS
    done = run(*command.split(), *options, "-o", generated, env=NOWHERE | empty_cache)

    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == (
        "no C compiler: $CC is '/nonexistent/cc', which is not there; "
        "install one (Debian: apt-get install gcc) or set CC\n"
    )
    assert contents(generated) == before


def test_an_empty_path_is_told(generated, empty_cache):
    done = run("build", "-o", generated, env=NOTHING_ON_THE_PATH | empty_cache)

    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("no C compiler: there is no cc, gcc or clang on the PATH; install one")


def test_generate_with_verify_looks_for_the_compiler_before_it_replaces_anything(generated, tmp_path, empty_cache):
    thicker = tmp_path / "thicker.toml"
    thicker.write_text(Path(ONE_FINGER).read_text().replace('"9 mm"', '"9.5 mm"'))
    before = contents(generated)
    done = run("generate", "--verify", "--hand", thicker, *OPTIONS[2:], "-o", generated, env=NOWHERE | empty_cache)

    assert done.returncode == 2
    assert contents(generated) == before


def test_the_message_comes_in_json_where_json_was_asked_for(generated, empty_cache):
    done = run("build", "-o", generated, "--json", env=NOWHERE | empty_cache)

    assert done.returncode == 2
    assert json.loads(done.stdout)["error"] == "NoCompilerError"


@pytest.mark.parametrize("command", ["/bin/false", "/etc/passwd", f"{sys.executable} --no-such-option"])
def test_what_is_no_compiler_is_told_to_be_none(command, generated, empty_cache):
    done = run("build", "-o", generated, env={"CC": command} | empty_cache)

    assert done.returncode == 2
    assert done.stderr.startswith("no C compiler: ")
    assert "Traceback" not in done.stderr


def test_a_compiler_with_options_of_its_own_is_used(generated, empty_cache):
    done = run("build", "-o", generated, env={"CC": "gcc -O1"} | empty_cache)

    assert done.returncode == 0, done.stderr


def test_a_compiler_that_refuses_the_code_is_quoted(generated, tmp_path, empty_cache):
    copy = tmp_path / "generated"
    shutil.copytree(generated, copy)
    (copy / "jaw_tendon_lengths.c").write_text("this is not C\n")
    done = run("verify", *OPTIONS, "-o", copy, env=empty_cache)

    assert done.returncode == 1
    assert "jaw_tendon_lengths.c:1:1: error:" in done.stderr


def test_without_the_headers_of_python_they_are_asked_for(generated, tmp_path, monkeypatch):
    monkeypatch.setattr(sysconfig, "get_paths", lambda: {"include": str(tmp_path)})
    with pytest.raises(BuildError, match=rf"{tmp_path} has no Python.h; install .* apt-get install python3-dev"):
        load(generated, Cache(tmp_path / "cache"))


@pytest.mark.parametrize("command", [["check"], ["list", "--assumed"], ["--help"]])
def test_what_needs_no_compiler_does_not_ask_for_one(command):
    assert run(*command, *OPTIONS[:2] * (command != ["--help"]), env=NOTHING_ON_THE_PATH).returncode in (0, 1)
