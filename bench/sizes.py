"""What the compiled kernels take: bytes of code and of stack of each, held against those that are committed.

Run by `make bench`. Sizes are the compiler's, so they are compared only with those of the same compiler and flags; with
`--accept` the measured ones become the committed ones.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from awiwi_gen.build import FLAGS, compiler
from awiwi_gen.resources import CSRC

ROOT = Path(__file__).resolve().parent.parent
COMMITTED = Path(__file__).with_suffix(".json")
SLACK, GRAIN = 0.02, 16  # of code: compilers align functions
FLAGS_HERE = (*FLAGS, "-fstack-usage")


def measure(directory: Path) -> dict[str, tuple[int, int]]:
    """Bytes of code and of stack of every function that the generated C files define, by name."""
    found: dict[str, tuple[int, int]] = {}
    with tempfile.TemporaryDirectory(prefix="awiwi-sizes-") as scratch:
        for path in sorted(directory.glob("*.c")):
            object_file = Path(scratch) / f"{path.stem}.o"
            compiler().run(*FLAGS_HERE, f"-I{directory}", f"-I{CSRC}", "-c", str(path), "-o", str(object_file))
            stack = {}
            for line in object_file.with_suffix(".su").read_text(encoding="utf-8").splitlines():
                place, size, _ = line.split("\t")
                stack[place.rsplit(":", 1)[1]] = int(size)
            for name, size in symbols(object_file).items():
                found[name] = (size, stack[name])
    return found


def symbols(object_file: Path) -> dict[str, int]:
    """Bytes of the functions of an object file that others may call."""
    command = [shutil.which("nm") or "nm", "--print-size", "--defined-only", str(object_file)]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    rows = [line.split() for line in lines]
    return {row[3]: int(row[1], 16) for row in rows if len(row) == 4 and row[2] == "T"}


def excesses(old: dict[str, list[int]], new: dict[str, tuple[int, int]]) -> list[str]:
    """A sentence for each function that takes more than before."""
    sentences = []
    for name, sizes in new.items():
        for kind, before, after in zip(("code", "stack"), old.get(name, sizes), sizes, strict=True):
            if after > before * (1 + SLACK) + GRAIN:
                sentences.append(f"{name} takes {after} bytes of {kind}, committed are {before}")
    return sentences


def main() -> None:
    """Measure, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", nargs="?", type=Path, default=ROOT / "generated")
    parser.add_argument("--accept", action="store_true", help="commit to what is measured")
    chosen = parser.parse_args()
    made_with = f"{compiler().version} {' '.join(FLAGS_HERE)}"
    sizes = measure(chosen.directory)
    if chosen.accept:
        rows = ",\n".join(f"  {json.dumps(name)}: {json.dumps(size)}" for name, size in sorted(sizes.items()))
        COMMITTED.write_text(
            f'{{\n "compiler": {json.dumps(made_with)},\n "bytes": {{\n{rows}\n }}\n}}\n', encoding="utf-8"
        )
    known = json.loads(COMMITTED.read_text(encoding="utf-8")) if COMMITTED.exists() else {"compiler": "", "bytes": {}}
    print(f"bytes of code and stack, {made_with}")
    for name, (code, stack) in sorted(sizes.items()):
        print(f"{name:44}{code:8}{stack:8}")
    if known["compiler"] != made_with:
        print("committed sizes are another compiler's: not compared")
        return
    sentences = excesses(known["bytes"], sizes)
    if sentences:
        sys.exit("\n".join([*sentences, "mend it, or accept it with --accept"]))


if __name__ == "__main__":
    main()
