"""`make bench`: everything that is measured, one section after another, and all numbers in build/bench.json.

python -m bench                 all sections
python -m bench peers           one of them: peers, passes, skew, sizes, tick, simulator, batches,
                                whole_hands, generation
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "build" / "bench.json"
PROGRAMS = (
    "passes",
    "skew",
    "sizes",
    "tick",
    "simulator",
    "batches",
    "whole_hands",
    "generation",
)  # sections that are programs of their own


def main() -> int:
    """Run the chosen sections; 1 if results disagree or a section fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = ["peers", *(name for name in PROGRAMS if (ROOT / "bench" / f"{name}.py").exists())]
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=", ".join(known))
    parser.add_argument("--rounds", type=int, default=400, help="how often every kernel's time is taken")
    parser.add_argument("--only", default="", help="comma-separated peers instead of all")
    chosen = parser.parse_args()
    wrong = set(chosen.sections) - set(known)
    if wrong:
        parser.error(f"no such section: {', '.join(sorted(wrong))}; there are {', '.join(known)}")
    failed = []
    for section in chosen.sections or known:
        print(f"== {section} ==", flush=True)
        if section == "peers":
            good = _peers(chosen.rounds, tuple(filter(None, chosen.only.split(","))))
        else:
            good = subprocess.run([sys.executable, f"bench/{section}.py"], cwd=ROOT, check=False).returncode == 0
        failed += [section] * (not good)
    if failed:
        print(f"failed: {', '.join(failed)}")
    return bool(failed)


def _peers(rounds: int, only: tuple[str, ...]) -> bool:
    from bench import peer_section, tables
    from bench.objects import COMPILER, VARIANTS

    results, agreed = peer_section.run(ROOT / "build" / "bench", rounds, only or peer_section.PEERS)
    goals = tables.goals(results)
    tables.print_goals(goals)
    version = subprocess.run([*COMPILER["c"], "--version"], capture_output=True, text=True, check=True).stdout
    table: dict[str, Any] = {
        "compiler": version.splitlines()[0],
        "cores": os.cpu_count(),
        "variants": VARIANTS,
        "hands": results,
        "goals": goals,
    }
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    print(f"\nall numbers: {RESULTS.relative_to(ROOT)}")
    if not agreed:
        print("results DISAGREE: see above")
    return agreed


if __name__ == "__main__":
    sys.exit(main())
