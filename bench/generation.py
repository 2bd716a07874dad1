"""How long generating and verifying the Awiwi hand takes: from nothing, warm, after a changed radius, unchanged.

Run by `make bench`. Every run is a new process, as a user starts it, with a cache and a directory of its own. Wall
times depend on the machine and on what else it does, processor times less; nothing here fails when they grow. A second
table shows in which stages the runs from nothing and after a changed radius spend their time.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RADIUS = '{ joint = "abduction", radius = "9 mm"'


# Runs in a new process: the road of `pipeline`, its stages timed, those that stages call taken out of them.
STAGES = """
import json, resource, sys, time
start, spent = time.perf_counter(), []
from pathlib import Path
from awiwi_gen import pipeline
from awiwi_gen.hand import Hand

def now():
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return time.perf_counter(), sum(u.ru_utime + u.ru_stime for u in usage)

inside = []
def timed(module, name, stage):
    function = getattr(module, name)
    def run(*words):
        before = now()
        inside.append([0.0, 0.0])
        try:
            return function(*words)
        finally:
            whole = [b - a for a, b in zip(before, now())]
            inner = inside.pop()
            spent.append([stage, *(a - b for a, b in zip(whole, inner))])
            if inside:
                inside[-1][:] = [a + b for a, b in zip(inside[-1], whole)]
    setattr(module, name, run)

job = pipeline.Job(Hand.load(Path(sys.argv[1])))
job.catalog
spent.append(["start, read the hand, make the catalogue", *(a - b for a, b in zip(now(), (start, 0.0)))])
import awiwi_gen.build, awiwi_gen.records
timed(pipeline, "derive", "derive, check units")
timed(sys.modules["awiwi_gen.build"], "load", "compile, link, load")
timed(pipeline, "_judged", "compare the compiled kernels")
timed(pipeline, "_examine", "laws of physics, beyond what compiling hides")
timed(pipeline, "optimise", "bind, compare, optimise, print")
timed(pipeline, "generate", "write")
timed(pipeline, "verify", "digests of what is there")
pipeline.generate(job, Path(sys.argv[2]))
pipeline.verify(job, Path(sys.argv[2]))
total = {}
for stage, wall, processors in spent:
    known = total.setdefault(stage, [0.0, 0.0])
    total[stage] = [known[0] + wall, known[1] + processors]
print(json.dumps([[stage, *times] for stage, times in total.items()]))
"""


@dataclass
class Row:
    """One kind of run: its wall times [s], processor times of all its processes [s], memory of the largest [MB]."""

    name: str
    times: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)
    memory: float = 0.0


class Bench:
    """A scratch place with a copy of the hand file, and the rows measured so far."""

    def __init__(self, scratch: Path) -> None:
        self.scratch, self.rows = scratch, []
        self.hand = scratch / "hand.toml"
        # As where it is installed: modules are compiled once.
        self.environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"} | {
            "AWIWI_GEN_CACHE": str(scratch / "cache"),
            "PYTHONPATH": str(ROOT),
            "PYTHONPYCACHEPREFIX": str(scratch / "bytecode"),
        }
        packaged = ROOT / "awiwi_gen"
        for path in (*packaged.glob("*.toml"), *packaged.glob("*.json")):  # with the certificate of the gains
            shutil.copy(path, scratch)

    def run(self, row: Row, *words: str) -> None:
        """Time one command of awiwi-gen and show the row so far."""
        command = [sys.executable, "-m", "awiwi_gen", *words, "--hand", str(self.hand), "-o", str(self.scratch / "c")]
        start = time.perf_counter()
        quiet = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_WRONLY, 0) for number in (1, 2)]
        process = os.posix_spawn(sys.executable, command, self.environment, file_actions=quiet)
        _, status, usage = os.wait4(process, 0)
        row.times.append(time.perf_counter() - start)
        row.processor.append(usage.ru_utime + usage.ru_stime)
        row.memory = max(row.memory, usage.ru_maxrss / 1024)
        if status:
            sys.exit(f"{' '.join(command)} ended with {os.waitstatus_to_exitcode(status)}")
        print(
            f"  {row.name}: {row.times[-1]:.2f} s, {row.processor[-1]:.2f} s of processors", file=sys.stderr, flush=True
        )

    def measure(self, name: str, runs: int, *words: str, before: object = None) -> None:
        """One row of the table; ``before`` prepares each run and is not timed."""
        row = Row(name)
        for number in range(runs):
            if callable(before):
                before(number)
            self.run(row, *words)
        self.rows.append(row)

    def stages(self) -> list[tuple[str, float, float]]:
        """(stage, wall [s], processors [s]) of one generate --verify as the place stands."""
        words = [sys.executable, "-c", STAGES, str(self.hand), str(self.scratch / "c")]
        done = subprocess.run(words, env=self.environment, check=True, capture_output=True, text=True)
        return [tuple(row) for row in json.loads(done.stdout)]

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
    parser.add_argument("--cold", type=int, default=1, help="runs from nothing, half a minute each")
    parser.add_argument("--runs", type=int, default=5, help="of every other kind")
    chosen = parser.parse_args()
    prove = ("generate", "--verify")
    with tempfile.TemporaryDirectory(prefix="awiwi-bench-") as scratch:
        bench = Bench(Path(scratch))
        bench.measure("cold: empty cache", chosen.cold, *prove, before=lambda _: bench.forget("cache", "c"))
        bench.measure("warm: filled cache, new directory", chosen.runs, *prove, before=lambda _: bench.forget("c"))
        bench.measure("one pulley radius changed", chosen.runs, *prove, before=bench.change_radius)
        bench.measure("unchanged", chosen.runs, *prove)
        bench.measure("check", chosen.runs, "check")
        bench.change_radius(chosen.runs)
        stages = {"one radius": bench.stages()}
        if chosen.cold:
            bench.forget("cache", "c")
            stages = {"cold": bench.stages(), **stages}
    show(bench.rows)
    for name, rows in stages.items():
        print(f"\n{'stages, ' + name:48}{'seconds':>9}{'processors':>12}")
        for stage, wall, processors in rows:
            print(f"{stage:48}{wall:9.2f}{processors:12.2f}")


def show(rows: list[Row]) -> None:
    """The first table."""
    print(f"generate --verify on {os.cpu_count()} cores, Python {sys.version.split()[0]}; medians")
    print(f"{'run':36}{'seconds':>9}{'fastest':>9}{'slowest':>9}{'processors':>12}{'largest process, MB':>22}")
    for row in rows:
        shown = (statistics.median(row.times), min(row.times), max(row.times))
        numbers = "".join(f"{seconds:9.2f}" for seconds in shown)
        print(f"{row.name:36}{numbers}{statistics.median(row.processor):12.2f}{row.memory:22.0f}")


if __name__ == "__main__":
    main()
