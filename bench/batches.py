"""How fast many samples are: CasADi's C in a loop, our C in a loop, our loops for vector units, and those from Python.

python bench/batches.py

One finger's mass matrix, inverse and forward dynamics, with the textbook's recursions for CasADi as in `bench.peers`. All
loops are in one process and alternate; medians, and ratios to CasADi's loop, as nanoseconds drift with the machine. Time
is the processor's, which others on the machine do not lengthen much; for all cores it is the wall's, which they do.
`samples` lie one after another, `elements` have an array each. `CasADi, elements` is CasADi's program put into our
loop for vector units, with our sine in place of the C library's. Python's results come in fresh memory, but `with out=`.
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
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from awiwi_gen.build import BATCH_FLAGS, FLAGS, GCC_FLAGS, UNFUSED, compiler, load, native
from awiwi_gen.emit.batch import BATCHES
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, cached_tree
from awiwi_gen.resources import CSRC
from bench.hands import FINGER, spec
from bench.peers.casadi import generate
from bench.peers.kit import INLINED, prototype
from bench.quantities import QUANTITIES, Quantity

NAMES = ("mass_matrix", "inverse_dynamics", "forward_dynamics")
SMALL, LARGE = 1000, 1_000_000
PORTABLE = (*(flag for flag in FLAGS if not flag.startswith("-W")), "-fno-semantic-interposition")


class Loops:
    """C loops over samples of one quantity, compiled into one library, and arrays to run them on."""

    def __init__(self, quantity: Quantity, library: Any, tree: Path, finger: dict[str, Any], scratch: Path) -> None:
        self.quantity, self.library, self.scratch = quantity, library, scratch
        self.entry = next(e for e in library.manifest["kernels"] if e["name"] == f"{FINGER}_{quantity.name}")
        self.kernel, self.function = library[self.entry["name"]], f"awiwi_{self.entry['name']}"
        self.sizes = {p["name"]: prod(p["shape"]) for p in self.entry["inputs"] + self.entry["outputs"]}
        self.includes = (f"-I{tree}", f"-I{tree / BATCHES}", f"-I{CSRC}")
        file = f"{self.entry['name']}.c"
        kernel = (tree / file).read_text(encoding="utf-8")
        batch = (tree / BATCHES / file).read_text(encoding="utf-8").replace("../", "")
        vectors = ("-fno-semantic-interposition", *BATCH_FLAGS, *native()[0], *GCC_FLAGS, *UNFUSED[0])
        ported = self._sines() + self._peer(self.function, finger).replace("casadi_", "ported_")
        ported = batch.replace(f'#include "{file}"', ported).replace("_batch(", "_ported(").replace("INLINED", "static")
        casadi = self._peer("peer", finger) + self._loop("casadi", self._each("peer"))
        plain = f'#include "kernels.h"\n{self._loop("plain", self._each(self.function))}'
        objects = [
            self._compile("casadi", casadi, PORTABLE),
            self._compile("ported", ported + self._loop("ported", self._called("ported", by_element=True)), vectors),
            self._compile("plain", plain, PORTABLE),
            self._compile("kernel", kernel, PORTABLE),
            self._compile("samples", batch + self._loop("samples", self._called("batch", by_element=False)), vectors),
            self._compile("elements", self._loop("elements", self._called("batch", by_element=True)), vectors),
            self._compile("sincos", (CSRC / "sincos.c").read_text(encoding="utf-8"), PORTABLE),
        ]
        made = scratch / f"{quantity.name}.so"
        compiler().run("-shared", *objects, "-o", str(made), "-lm")
        self.c = ctypes.CDLL(str(made))

    def _compile(self, name: str, text: str, flags: tuple[str, ...]) -> str:
        source = self.scratch / f"{self.quantity.name}_{name}.c"
        source.write_text(text, encoding="utf-8")
        compiler().run(*flags, *self.includes, "-c", str(source), "-o", str(source.with_suffix(".o")))
        return str(source.with_suffix(".o"))

    def _sines(self) -> str:
        """Our sine and cosine by the names that CasADi calls."""
        function = "#define {0}(x) awiwi_sincos(x).{0}\n"
        return f'#include <math.h>\n#include "sincos.h"\n{function.format("sin")}{function.format("cos")}'

    def _loop(self, name: str, statement: str) -> str:
        """A C function that does a statement with the arrays of n samples again and again."""
        head = prototype(self.quantity, f"loop_{name}", "c").replace("(", "(long times, long n, ", 1)
        return (
            f'#include "batches.h"\n{head};\n{INLINED}\n{head}\n{{\n'
            f"    for (long t = 0; t < times; t++)\n        {statement}\n}}\n"
        )

    def _peer(self, name: str, finger: dict[str, Any]) -> str:
        """CasADi's program as a function of our prototype."""
        text, call = generate(self.quantity, finger)
        return f"{text}\nstatic {prototype(self.quantity, name, 'c')}\n{{\n{call}\n}}\n"

    def _each(self, function: str) -> str:
        """Calls of a function with one sample after another."""
        ports = ", ".join(f"{port} + {size}*i" for port, size in self.sizes.items())
        return f"for (long i = 0; i < n; i++) {function}({ports});"

    def _called(self, suffix: str, by_element: bool) -> str:
        """A call of a function over many samples as Python calls it: gravity is the same for all."""
        steps = {port: "1, n" if by_element else f"{size}, 1" for port, size in self.sizes.items()} | {"g": "0, 1"}
        return f"{self.function}_{suffix}(n, {', '.join(f'{port}, {steps[port]}' for port in self.sizes)});"

    def runs(self, n: int, times: int) -> dict[str, Callable[[], Any]]:
        """The contenders by name: all over the same n samples, ``times`` in a row."""
        draw = np.random.default_rng(7)
        arrays = {port: draw.uniform(-1, 1, (n, size)) for port, size in self.sizes.items()}
        if "g" in arrays:
            arrays["g"][:] = arrays["g"][0]
        by_rows = {port: array if port == "g" else np.ascontiguousarray(array.T) for port, array in arrays.items()}

        def loop(name: str) -> Callable[[], None]:
            function = getattr(self.c, f"loop_{name}")
            used = by_rows if name in ("ported", "elements") else arrays
            addresses = [array.ctypes for array in used.values()]  # these keep their arrays
            return lambda: function(
                ctypes.c_long(times), ctypes.c_long(n), *(a.data_as(ctypes.c_void_p) for a in addresses)
            )

        def python(threads: int, by_element: bool, reused: bool = False) -> Callable[[], None]:
            given = [port["name"] for port in self.entry["inputs"]]
            arguments = [arrays[p][0] if p == "g" else by_rows[p].T if by_element else arrays[p] for p in given]

            out = self.kernel(*arguments) if reused else None

            def run() -> None:
                self.library.threads = threads
                for _ in range(times):
                    self.kernel(*arguments, out=out)

            return run

        cores = len(os.sched_getaffinity(0))
        runs = {name: loop(name) for name in ("casadi", "ported", "plain", "samples", "elements")}
        runs |= {"python": python(1, False), "python by elements": python(1, True)}
        return runs | {"python reused": python(1, True, True), "python on all cores": python(cores, True, True)}


TITLES = {
    "casadi": "CasADi, loop",
    "ported": "CasADi, elements",
    "plain": "ours, loop",
    "samples": "ours, samples",
    "elements": "ours, elements",
    "python": "Python, samples",
    "python by elements": "Python, elements",
    "python reused": "with out=",
    "python on all cores": "on all cores",
}


def measure(runs: dict[str, Callable[[], Any]], rounds: int, evaluations: int) -> dict[str, float]:
    """Median nanoseconds of one evaluation, by name; measured alternately."""
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
    print(f"{'':28}{'samples':>9}" + "".join(f"{title:>18}" for title in TITLES.values()))
    with tempfile.TemporaryDirectory(prefix="awiwi-bench-") as scratch:
        for name in NAMES:
            loops = Loops(QUANTITIES[name], library, tree, spec(hand), Path(scratch))
            for n, times, rounds in ((SMALL, 16, chosen.rounds), (LARGE, 1, max(chosen.rounds // 10, 3))):
                found = measure(loops.runs(n, times), rounds, n * times)
                cells = "".join(f"{found[key]:10.1f} ({found['casadi'] / found[key]:5.1f})" for key in TITLES)
                print(f"{QUANTITIES[name].title:28}{n:9}{cells}", flush=True)


if __name__ == "__main__":
    main()
