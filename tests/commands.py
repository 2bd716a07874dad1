"""Commands of the command line, run in this process or in one of their own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from awiwi_gen.__main__ import app

ONE_FINGER = str(Path(__file__).with_name("one_finger.toml"))


def run(*arguments: object, stdin: str | None = None) -> Any:
    """Run a command; whatever is no exit of its own is a bug and raises."""
    done = CliRunner().invoke(app, [str(argument) for argument in arguments], input=stdin)
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done


def told(*arguments: object, code: int = 0, stdin: str | None = None) -> str:
    """Standard output, after a look at the exit code."""
    done = run(*arguments, stdin=stdin)
    assert done.exit_code == code, done.output
    return done.stdout


def answer(*arguments: object, code: int = 0, stdin: str | None = None) -> Any:
    """The JSON document on standard output."""
    return json.loads(told(*arguments, "--json", code=code, stdin=stdin))


def complaint(*arguments: object, code: int = 2, stdin: str | None = None) -> str:
    """Standard error of a command that fails without printing anything else."""
    done = run(*arguments, stdin=stdin)
    assert (done.exit_code, done.stdout) == (code, "")
    return done.stderr.rstrip("\n")


@pytest.fixture(scope="module")
def small(tmp_path_factory) -> Path:
    """The small hand's kinematics and tendons, generated."""
    directory = tmp_path_factory.mktemp("small") / "generated"
    told("generate", "--hand", ONE_FINGER, "-o", directory, "--only", "jaw_[fjt]*")
    return directory


def process(*arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "awiwi_gen", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)
