"""Mutated hand files: each loads, or gives a clear error with a location, in a second of CPU time and 1 GiB."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path


def test_mutated_hand_files_load_or_are_refused_with_a_location(tmp_path):
    """A process of its own has the memory limit; `make torture` tries 10 000 of them."""
    command = [sys.executable, str(Path(__file__).with_name("mutations.py")), "300", "20261128"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)

    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(done.stdout)
    assert found["loads"] + found["refused"] == 300
    assert found["loads"] > 20
    assert found["refused"] > 100
