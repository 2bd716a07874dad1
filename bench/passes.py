"""What the compiler's passes save: operations that each takes away, over all kernels and for those of one finger.

Run by `make bench`; reads the budget beside the generated code, so it takes no time and says what is committed.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from awiwi_gen.budget import BUDGET, removals

GENERATED = Path(__file__).resolve().parent.parent / "generated"


def table(directory: Path, finger: str) -> str:
    """Operations before, taken away by each pass, and left: of all kernels together and of each of one finger."""
    kernels = json.loads((directory / BUDGET).read_text(encoding="utf-8"))
    rows = {name: removals(row["steps"], 1) for name, row in kernels.items() if row["steps"][0][0] == "derivation"}
    names = list(dict.fromkeys(step for row in rows.values() for step in row))[1:]
    chosen = {name: row for name, row in rows.items() if name.startswith(f"{finger}_") and row["derivation"]}
    total = {step: sum(row.get(step, 0) for row in rows.values()) for step in ["derivation", *names]}
    lines = [
        f"{'operations':32}{'derived':>9}" + "".join(f"{name:>{len(name) + 2}}" for name in names) + f"{'left':>9}"
    ]
    for name, row in {f"all {len(rows)} kernels": total, **chosen}.items():
        taken = "".join(f"{-row.get(step, 0):{len(step) + 2}}" for step in names)
        lines.append(f"{name:32}{-row['derivation']:9}{taken}{-sum(row.values()):9}")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(Path(sys.argv[1]) if len(sys.argv) > 1 else GENERATED, sys.argv[2] if len(sys.argv) > 2 else "index"))
