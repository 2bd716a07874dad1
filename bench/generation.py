"""How long generating and verifying the Awiwi hand takes: from nothing, warm, after a changed radius, unchanged.

Run by `make bench`. Every run is a new process, as a user starts it, with a cache and a directory of its own. Wall
times depend on the machine and on what else it does; nothing here fails when they grow.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RADIUS = '{ joint = "abduction", radius = "9 mm"'


@dataclass
class Row:
    """One kind of run: its wall times [s], and the memory of its largest process [MB]."""

    name: str
    times: list[float] = field(default_factory=list)
    memory: float = 0.0


class Bench:
    """A scratch place with a copy of the hand file, and the rows measured so far."""

    def __init__(self, scratch: Path) -> None:
        self.scratch, self.rows = scratch, []
        self.hand = scratch / "hand.toml"
        for path in (ROOT / "awiwi_gen").glob("*.toml"):
            shutil.copy(path, scratch)

    def run(self, row: Row, *words: str) -> None:
        """Time one command of awiwi-gen and show the row so far."""
        command = [sys.executable, "-m", "awiwi_gen", *words, "--hand", str(self.hand), "-o", str(self.scratch / "c")]
        environment = dict(os.environ) | {"AWIWI_GEN_CACHE": str(self.scratch / "cache"), "PYTHONPATH": str(ROOT)}
        start = time.perf_counter()
        quiet = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_WRONLY, 0) for number in (1, 2)]
        process = os.posix_spawn(sys.executable, command, environment, file_actions=quiet)
        _, status, usage = os.wait4(process, 0)
        row.times.append(time.perf_counter() - start)
        row.memory = max(row.memory, usage.ru_maxrss / 1024)
        if status:
            sys.exit(f"{' '.join(command)} ended with {os.waitstatus_to_exitcode(status)}")
        print(f"  {row.name}: {row.times[-1]:.2f} s", file=sys.stderr, flush=True)

    def measure(self, name: str, runs: int, *words: str, before: object = None) -> None:
        """One row of the table; ``before`` prepares each run and is not timed."""
        row = Row(name)
        for number in range(runs):
            if callable(before):
                before(number)
            self.run(row, *words)
        self.rows.append(row)

    def forget(self, *names: str) -> None:
        """Remove parts of the scratch place."""
        for name in names:
            shutil.rmtree(self.scratch / name, ignore_errors=True)

    def change_radius(self, number: int) -> None:
        """Give the pulley of the first abduction joint in the file a radius it never had."""
        original = (ROOT / "awiwi_gen" / "hand.toml").read_text(encoding="utf-8")
        changed = original.replace(RADIUS, RADIUS.replace("9 mm", f"9.{number + 1} mm"), 1)
        if changed == original:
            sys.exit(f"hand.toml has no {RADIUS} to change")
        self.hand.write_text(changed, encoding="utf-8")


def main() -> None:
    """Measure all and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cold", type=int, default=1, help="runs from nothing, a minute each")
    parser.add_argument("--runs", type=int, default=5, help="of every other kind")
    chosen = parser.parse_args()
    prove = ("generate", "--verify")
    with tempfile.TemporaryDirectory(prefix="awiwi-bench-") as scratch:
        bench = Bench(Path(scratch))
        bench.measure("cold: nothing kept", chosen.cold, *prove, before=lambda _: bench.forget("cache", "c"))
        bench.measure("warm: kept results, new directory", chosen.runs, *prove, before=lambda _: bench.forget("c"))
        bench.measure("one pulley radius changed", chosen.runs, *prove, before=bench.change_radius)
        bench.measure("unchanged", chosen.runs, *prove)
        bench.measure("check", chosen.runs, "check")
    print(f"generate --verify on {os.cpu_count()} cores, Python {sys.version.split()[0]}; medians")
    print(f"{'run':36}{'seconds':>9}{'fastest':>9}{'slowest':>9}{'largest process, MB':>22}")
    for row in bench.rows:
        shown = (statistics.median(row.times), min(row.times), max(row.times))
        print(f"{row.name:36}" + "".join(f"{seconds:9.2f}" for seconds in shown) + f"{row.memory:22.0f}")


if __name__ == "__main__":
    main()
