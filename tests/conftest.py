"""What tests share: the Awiwi hand and the example hand, generated and compiled once per run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
os.environ.setdefault("AWIWI_GEN_CACHE", str(ROOT / ".cache"))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices here are small: threads would only wait for each other

from trees import version  # noqa: E402 the cache is chosen first

import awiwi_gen  # noqa: E402
from awiwi_gen.emit.tree import install  # noqa: E402


def pytest_sessionstart(session):
    """Fill the cache before workers start, so that they do not all derive the same hand."""
    if not hasattr(session.config, "workerinput"):
        awiwi_gen.build(awiwi_gen.Hand.load())


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def hand():
    return awiwi_gen.Hand.load()


@pytest.fixture(scope="session")
def lib(hand):
    return awiwi_gen.build(hand)


@pytest.fixture
def tree(tmp_path):
    """A small generated directory."""
    directory = tmp_path / "home" / "generated"
    install(directory, version("old"))
    return directory
