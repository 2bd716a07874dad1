"""How fast many samples are: CasADi's C in a loop, our C in a loop, our loop for vector units, and that from Python.

python bench/batches.py

One finger's mass matrix, inverse and forward dynamics, with the textbook's recursions for CasADi as in `bench.peers`. All
loops are in one process and take turns; medians, and ratios to CasADi's loop, as nanoseconds drift with the machine. Time
is the processor's, which others on the machine do not lengthen much; for all cores it is the wall's, which they do.
`CasADi in vectors` is CasADi's program put into our loop, with our sine in place of the C library's.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from awiwi_gen.build import BATCH_FLAGS, FLAGS, GCC_FLAGS, UNFUSED, compiler, load, native
from awiwi_gen.emit.batch import batch_file
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC
from bench.hands import FINGER, spec
from bench.peers.casadi import generate
from bench.peers.kit import INLINED, prototype
from bench.quantities import QUANTITIES, Quantity

NAMES = ("mass_matrix", "inverse_dynamics", "forward_dynamics")
SMALL, LARGE = 1024, 1_000_000
PORTABLE = (*(flag for flag in FLAGS if not flag.startswith("-W")), "-fno-semantic-interposition")


class Loops:
    """C loops over samples of one quantity, compiled into one library, and arrays to run them on."""

    def __init__(self, quantity: Quantity, library: Any, tree: Path, finger: dict[str, Any], scratch: Path) -> None:
        self.quantity, self.library, self.scratch = quantity, library, scratch
        self.entry = next(e for e in library.manifest["kernels"] if e["name"] == f"{FINGER}_{quantity.name}")
        self.kernel = library[self.entry["name"]]
        self.includes = (f"-I{tree}", f"-I{CSRC}")
        source = tree / f"{self.entry['name']}.c"
        text, call = generate(quantity, finger)
        vectors = ("-fno-semantic-interposition", *BATCH_FLAGS, *native()[0], *GCC_FLAGS, *UNFUSED[0])
        batch = batch_file(self.entry, "awiwi", "double", source.read_text(encoding="utf-8"))
        objects = [
            self._compile("casadi", f"{self._peer(text, call)}\n{self._loop('casadi', 'peer')}", PORTABLE),
            self._compile(
                "ported",
                f"{self._sines()}{self._peer(text, call).replace('casadi_', 'ported_')}\n{self._loop('ported', 'peer')}",
                vectors,
            ),
            self._compile(
                "plain", f'#include "kernels.h"\n{self._loop("plain", "awiwi_" + self.entry["name"])}', PORTABLE
            ),
            self._compile("kernel", source.read_text(encoding="utf-8"), PORTABLE),
            self._compile("batch", batch + self._batch_loop(), vectors),
            *(self._compile(path.stem, path.read_text(encoding="utf-8"), PORTABLE) for path in tree.glob("trig.c")),
        ]
        made = scratch / f"{quantity.name}.so"
        compiler().run("-shared", *objects, "-o", str(made), "-lm")
        self.c = ctypes.CDLL(str(made))

    def _compile(self, name: str, text: str, flags: tuple[str, ...]) -> str:
        source = self.scratch / f"{self.quantity.name}_{name}.c"
        source.write_text(text, encoding="utf-8")
        compiler().run(*flags, *self.includes, "-c", str(source), "-o", str(source.with_suffix(".o")))
        return str(source.with_suffix(".o"))

    def _peer(self, text: str, call: str) -> str:
        return f"{text}\nstatic {prototype(self.quantity, 'peer', 'c')}\n{{\n{call}\n}}\n"

    def _sines(self) -> str:
        """Our sine and cosine by the names that CasADi calls."""
        function = "#define {0}(x) awiwi_sincos(x).{0}\n"
        return f'#include <math.h>\n#include "trig.h"\n{function.format("sin")}{function.format("cos")}'

    def _head(self, name: str) -> str:
        return prototype(self.quantity, f"loop_{name}", "c").replace("(", "(long times, long n, ", 1)

    def _loop(self, name: str, function: str) -> str:
        sizes = {**dict.fromkeys(("q", "qd", "qdd", "tau"), 4), "g": 3, **self.quantity.outputs}
        ports = ", ".join(f"{p} + {sizes[p]}*i" for p in [*self.quantity.inputs, *self.quantity.outputs])
        return (
            f"{self._head(name)};\n{INLINED}\n{self._head(name)}\n{{\n"
            f"    for (long t = 0; t < times; t++) {{\n#pragma GCC ivdep\n"
            f"        for (long i = 0; i < n; i++) {function}({ports});\n    }}\n}}\n"
        )

    def _batch_loop(self) -> str:
        """Our loop as Python calls it: gravity is the same for all samples."""
        given = ", ".join(f"{p}, {({'g': 0}).get(p, 4)}" for p in self.quantity.inputs)
        call = f"awiwi_{self.entry['name']}_batch(n, {given}, {', '.join(self.quantity.outputs)});"
        return f"\n{self._head('batch')};\n{self._head('batch')}\n{{\n    for (long t = 0; t < times; t++) {call}\n}}\n"

    def runs(self, n: int, times: int) -> dict[str, Callable[[], Any]]:
        """What takes turns, by name: all over the same n samples, ``times`` in a row."""
        draw = np.random.default_rng(7)
        ports = {p["name"]: (n, *p["shape"]) for p in self.entry["inputs"]}
        given = {name: draw.uniform(-1, 1, shape) for name, shape in ports.items()}
        given |= {
            name: np.ascontiguousarray(np.broadcast_to(given[name][0], given[name].shape))
            for name in given
            if name == "g"
        }
        out = [np.zeros((n, size)) for size in self.quantity.outputs.values()]
        addresses = [array.ctypes for array in (*given.values(), *out)]  # these keep their arrays

        def loop(name: str) -> Callable[[], None]:
            function = getattr(self.c, f"loop_{name}")
            return lambda: function(
                ctypes.c_long(times), ctypes.c_long(n), *(a.data_as(ctypes.c_void_p) for a in addresses)
            )

        arguments = [array[0] if name == "g" else array for name, array in given.items()]

        def python(threads: int) -> Callable[[], None]:
            def run() -> None:
                self.library.threads = threads
                for _ in range(times):
                    self.kernel(*arguments)

            return run

        cores = len(os.sched_getaffinity(0))
        runs = {name: loop(name) for name in ("casadi", "ported", "plain", "batch")}
        return runs | {"python": python(1), "python on all cores": python(cores)}


TITLES = {
    "casadi": "CasADi's C, loop",
    "ported": "CasADi in vectors",
    "plain": "our C, loop",
    "batch": "our C in vectors",
    "python": "from Python",
    "python on all cores": "Python, all cores",
}


def measure(runs: dict[str, Callable[[], Any]], rounds: int, evaluations: int) -> dict[str, float]:
    """Median nanoseconds of one evaluation, by name; all take turns."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for number in range(rounds + 1):
        for name, run in runs.items():
            clock = time.perf_counter_ns if name == "python on all cores" else time.process_time_ns
            start = clock()
            run()
            if number:  # the first round warms up
                times[name].append((clock() - start) / evaluations)
    return {name: statistics.median(found) for name, found in times.items()}


def main() -> None:
    """Measure all and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=101)
    chosen = parser.parse_args()
    hand = Hand.load()
    job = Job(hand, only=f"{FINGER}_*")
    tree = cached_tree(job)
    library = load(tree, job.store)
    library.vectorise_after = 0
    print(f"ns per evaluation, and times faster than CasADi's loop; {compiler().version}; medians of {chosen.rounds}")
    print(f"{'':28}{'samples':>9}" + "".join(f"{title:>22}" for title in TITLES.values()))
    with tempfile.TemporaryDirectory(prefix="awiwi-bench-") as scratch:
        for name in NAMES:
            loops = Loops(QUANTITIES[name], library, tree, spec(hand), Path(scratch))
            for n, times, rounds in ((SMALL, 16, chosen.rounds), (LARGE, 1, max(chosen.rounds // 10, 3))):
                found = measure(loops.runs(n, times), rounds, n * times)
                cells = "".join(f"{found[key]:12.1f}  ({found['casadi'] / found[key]:5.1f})" for key in TITLES)
                print(f"{QUANTITIES[name].title:28}{n:9}{cells}", flush=True)


if __name__ == "__main__":
    main()
