"""Generates and verifies random legal hands: `python tests/torture_hands.py [FIRST] [COUNT]`, 200 from 0 by default.

Prints a line for each hand and the number of each kind of part at the end; exit code 1 if a hand is not proved. The
file of such a hand stays in build/torture/.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import random_hands

KEPT = Path(__file__).resolve().parent.parent / "build" / "torture"
REFUSED = "refused: its gains are unstable"
COMMAND = Path(sys.executable).with_name("awiwi-gen")


def prove(file: Path, directory: Path) -> str:
    """Generate and verify a hand; returns what is wrong, or nothing."""
    arguments = [COMMAND, "generate", "--hand", file, "-o", directory, "--verify"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return ""
    if done.returncode == 2 and "these gains are unstable" in done.stderr:
        return REFUSED
    faults = [line for line in done.stdout.splitlines() if "FAIL" in line or "misses" in line or "error is" in line]
    return "; ".join([f"exit code {done.returncode}", *faults, *done.stderr.strip().splitlines()[-1:]])


def main(first: int = 0, count: int = 200) -> int:
    """Prove the hands of so many seeds."""
    failed, refused, kinds, links = [], 0, Counter[str](), Counter[int]()
    for seed in range(first, first + count):
        text = random_hands.hand(seed)
        with tempfile.TemporaryDirectory() as scratch:
            file = Path(scratch) / f"hand_{seed}.toml"
            file.write_text(text)
            start = time.monotonic()
            fault = prove(file, Path(scratch) / "generated")
        refused += fault == REFUSED
        if fault and fault != REFUSED:
            failed.append(seed)
            KEPT.mkdir(parents=True, exist_ok=True)
            (KEPT / file.name).write_text(text)
        kinds.update(random_hands.kinds(text))
        links[text.count("[fingers.one.links]]")] += 1
        line = f"{seed}: {fault or 'proved'} in {time.monotonic() - start:.0f} s"
        print(f"{line} ({', '.join(sorted(random_hands.kinds(text)))})", flush=True)
    proved = count - len(failed) - refused
    print(f"{proved} of {count} hands proved, {refused} refused for unstable gains; failed seeds: {failed or 'none'}")
    print("links:", dict(sorted(links.items())), "kinds:", dict(kinds.most_common()))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
