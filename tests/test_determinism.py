"""The same hand gives the same bytes: whatever the hash seed, the place, the time zone, the cores and their vectors."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

# Kernels of every kind, small enough to derive them from nothing again and again.
PATTERNS = ("fifth_mass_matrix", "ring_tendon_distribution", "thumb_joint_estimate", "wrist_coupling", "lqr")
# NumPy as on an old processor: its linear algebra and its functions have other last bits.
OLD = {"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": "X86_V4"} if platform.machine() == "x86_64" else {}
SURROUNDINGS = [
    {"PYTHONHASHSEED": "0"},
    {
        "PYTHONHASHSEED": "4294967295", "LC_ALL": "C", "TZ": "Pacific/Chatham", "HOME": "/nonexistent", "AWIWI_CORES": "1",
        "PYTHONUTF8": "0", "PYTHONOPTIMIZE": "1", **OLD,
    },
]  # fmt: skip
PROGRAM = """
import os, sys
from pathlib import Path
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, generate
os.cpu_count = lambda: int(os.environ.get("AWIWI_CORES", 2))
for number, pattern in enumerate(sys.argv[2:]):
    generate(Job(Hand.load(), only=pattern), Path(sys.argv[1]) / str(number))
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory, root) -> list[dict[str, str]]:
    """Digests of all generated files, once for each surrounding, every time in a new process with an empty cache."""
    found = []
    for surrounding in SURROUNDINGS:
        here = tmp_path_factory.mktemp("run")
        env = dict(os.environ) | {"AWIWI_GEN_CACHE": str(here / "cache"), "PYTHONPATH": str(root)} | surrounding
        words = [sys.executable, "-c", PROGRAM, str(here / "out"), *PATTERNS]
        subprocess.run(words, env=env, cwd=here, check=True, timeout=300)
        files = sorted(path for path in (here / "out").rglob("*") if path.is_file())
        found.append({str(p.relative_to(here)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files})
    return found


def test_every_byte_is_the_same(runs):
    assert len(runs[0]) > 30
    assert runs[1] == runs[0]


def test_what_comes_from_an_empty_cache_is_what_comes_from_a_full_one(runs, hand, tmp_path):
    from awiwi_gen.pipeline import Job, generate

    for number, pattern in enumerate(PATTERNS):
        generate(Job(hand, only=pattern), tmp_path / str(number))
    for name, digest in runs[0].items():
        assert hashlib.sha256((tmp_path / Path(*Path(name).parts[1:])).read_bytes()).hexdigest() == digest, name
