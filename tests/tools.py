"""Programs that tests run besides Python, and how long they may try."""

from __future__ import annotations

import os
import shutil

import pytest

LONG = int(os.environ.get("AWIWI_TORTURE", "1"))  # times as many tries; all of what is sampled otherwise


def need(*names: str) -> str:
    """The path of the first of some programs that is here; the test ends without any."""
    return next(filter(None, map(shutil.which, names)), None) or without(" or ".join(names))


def without(tool: str) -> str:
    """End a test whose tool is missing: it is skipped, but fails in CI, which installs all."""
    (pytest.fail if os.environ.get("CI") else pytest.skip)(f"there is no {tool} here")
