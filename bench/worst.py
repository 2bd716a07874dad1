"""The dearest calls that a search finds: demands that were bred for the work that a solver does with them.

python bench/worst.py [--only distribution] [--start 20000] [--rounds 400]

A population of demands, most of them out of reach, is changed at random for some rounds; what makes the solver pass more
basic blocks stays. The compiler counts these (-fsanitize-coverage=trace-pc), so the search is deterministic. The worst
one is counted by callgrind as in `bench/tick.py`. It is the worst that was found, and no bound; docs/solvers.md has bounds.
"""

from __future__ import annotations

import argparse
import ctypes
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from awiwi_gen.build import FLAGS, compiler, load
from awiwi_gen.cache import Cache
from awiwi_gen.resources import CSRC
from bench.tick import HIGH, LOW, TICKS, Case, count, effects, joint_costs, laws

ROOT = Path(__file__).resolve().parent.parent
KEPT, BROOD = 200, 50  # demands that are changed, and rounds between two draws of the better half
Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Start:
    """Demands of one kernel by port, each (samples, elements), and which ports a search may change, and how far."""

    kernel: str
    inputs: dict[str, Array]
    free: dict[str, tuple[Any, Any]]


def starts(lib: Any, samples: int) -> Iterator[Start]:
    """What the searches begin with."""
    for finger in ("thumb", "index", "fifth"):
        yield distribution(lib, finger, samples)
    yield estimate(lib, samples)
    A, B, Q, R = joint_costs(np.random.default_rng(7), samples)
    inputs = {"A": A.reshape(samples, -1), "B": B.reshape(samples, -1), "Q": Q.reshape(samples, -1), "R": R}
    yield Start("lqr", inputs, dict.fromkeys(("A", "R"), (-np.inf, np.inf)))
    yield impedance(lib, samples)


def distribution(lib: Any, finger: str, samples: int) -> Start:
    """Poses and forces at limits; stiffnesses off by up to 10 times and 50 times as large, torques 4 times."""
    random, kernel = np.random.default_rng(0), lib[f"{finger}_tendon_distribution"]
    port, tendons = kernel.inputs[0], kernel.outputs[0]["shape"][0]
    low, high = np.asarray(port["low"], float), np.asarray(port["high"], float)
    q, f = random.uniform(low, high, (samples, len(low))), random.uniform(LOW, HIGH, (samples, tendons))
    at, held = random.random(q.shape), random.random(f.shape)
    q = np.where(at < 0.15, low, np.where(at < 0.3, high, q))
    tau, K = effects(lib, finger, q, np.where(held < 0.2, LOW, np.where(held < 0.4, HIGH, f)))
    one = (samples, 1, 1)
    off = random.normal(size=K.shape) * np.abs(K).max(axis=(1, 2), keepdims=True) * 10 ** random.uniform(-3, 1, one)
    off, scale = off + off.swapaxes(1, 2), random.choice([-1, 1], one) * 10 ** random.uniform(-2, 1.7, one)
    K = np.choose(random.integers(0, 4, one), [K, K + off, K * scale, off])
    tau = np.where(random.random((samples, 1)) < 0.25, tau * random.uniform(0.5, 4, (samples, 1)), tau)
    limits = {"f_min": np.full((samples, 1), LOW), "f_max": np.full((samples, 1), HIGH)}
    anything = (-np.inf, np.inf)
    inputs = {"q": q, "tau": tau, "K": K.reshape(samples, -1), **limits}
    return Start(kernel.name, inputs, {"q": (low, high), "tau": anything, "K": anything})


def estimate(lib: Any, samples: int) -> Start:
    """Lengths of random poses, off by up to 10 cm, from any start."""
    random, port = np.random.default_rng(1), lib.thumb_joint_estimate.inputs[1]
    low, high = np.asarray(port["low"], float), np.asarray(port["high"], float)
    h = lib.thumb_tendon_lengths(random.uniform(low, high, (samples, len(low))))
    h = h + random.normal(size=h.shape) * 10 ** random.uniform(-5, -1, (samples, 1))
    start = random.uniform(low, high, (samples, len(low)))
    return Start("thumb_joint_estimate", {"h": h, "start": start}, {"h": (-np.inf, np.inf), "start": (low, high)})


def impedance(lib: Any, samples: int) -> Start:
    """Feedback gains of known ones, off by up to 10 times each."""
    (known,) = [case for case in laws(lib) if case.kernel == "optimal_backstepping"]
    random = np.random.default_rng(4)
    inputs = {port: x[random.integers(0, len(x), samples)] for port, x in known.inputs.items()}
    off = 10 ** random.uniform(-1, 1, inputs["K_opt"].shape)
    free = dict.fromkeys(("K_opt", "start"), (-np.inf, np.inf))
    return Start(known.kernel, inputs | {"K_opt": inputs["K_opt"] * off}, free)


class Blocks:
    """The library with its basic blocks counted: what a kernel passes for each of many demands."""

    def __init__(self, lib: Any, kernels: list[str], directory: Path, scratch: Path) -> None:
        self.lib, counter = lib, "long blocks; void __sanitizer_cov_trace_pc(void) { blocks++; }"
        runs = [self._run(lib, kernel) for kernel in kernels]
        source = scratch / "blocks.c"
        source.write_text("\n".join(['#include "kernels.h"', counter, *runs]), encoding="utf-8")
        flags = (*FLAGS, "-w", f"-I{directory}", f"-I{CSRC}")
        objects = [scratch / "blocks.o"]
        compiler().run(*flags, "-c", str(source), "-o", str(objects[0]))
        for file in [*directory.glob("*.c"), *CSRC.glob("*.c")]:
            objects.append(scratch / f"{file.stem}.o")
            seen = ["-fsanitize-coverage=trace-pc"] * (file.parent == CSRC or file.stem in kernels)
            compiler().run(*flags, *seen, "-c", str(file), "-o", str(objects[-1]))
        target = scratch / "blocks.so"
        compiler().run("-shared", *map(str, objects), "-lm", "-o", str(target))
        self.c = ctypes.CDLL(str(target))

    def _run(self, lib: Any, kernel: str) -> str:
        sizes = [int(np.prod(port["shape"])) for port in lib[kernel].inputs]
        ports = [f"x + {sum(sizes[:i])}" for i in range(len(sizes))]
        ports += [f"y + {64 * i}" for i in range(len(lib[kernel].outputs))]
        step = (
            f"blocks = 0; {lib.manifest['prefix']}_{kernel}({', '.join(ports)}); counts[i] = blocks; x += {sum(sizes)};"
        )
        head = f"void run_{kernel}(long n, const double *x, long *counts)"
        return f"{head} {{ double y[512]; for (long i = 0; i < n; i++) {{ {step} }} }}"

    def of(self, kernel: str, inputs: dict[str, Array]) -> Array:
        """The blocks of each demand."""
        x = np.hstack([inputs[port["name"]] for port in self.lib[kernel].inputs])
        counts = np.zeros(len(x), np.int64)
        run = getattr(self.c, f"run_{kernel}")
        run(ctypes.c_long(len(x)), x.ctypes.data_as(ctypes.c_void_p), counts.ctypes.data_as(ctypes.c_void_p))
        return counts


def breed(blocks: Blocks, start: Start, rounds: int) -> dict[str, Array]:
    """The worst demand that is found, with one row in each port."""
    random, found = np.random.default_rng(3), blocks.of(start.kernel, start.inputs)
    best = np.argsort(-found)[:KEPT]
    now, found = {port: x[best] for port, x in start.inputs.items()}, found[best]
    for number in range(rounds):
        size = 10 ** random.uniform(-6, -0.3, (len(found), 1))
        trial = dict(now)
        for port, (low, high) in start.free.items():
            chosen = random.random((len(found), 1)) < 0.6
            change = np.abs(now[port]).max(axis=1, keepdims=True) * size * random.normal(size=now[port].shape)
            trial[port] = np.clip(now[port] + change * chosen, low, high)
        counts = blocks.of(start.kernel, trial)
        better = counts > found
        now = {port: np.where(better[:, None], trial[port], x) for port, x in now.items()}
        found = np.where(better, counts, found)
        if number % BROOD == BROOD - 1:
            half = np.repeat(np.argsort(-found)[: len(found) // 2], 2)
            now, found = {port: x[half] for port, x in now.items()}, found[half]
    return {port: x[[np.argmax(found)]] for port, x in now.items()}


def main() -> None:
    """Search, count and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="kernels whose name contains this")
    parser.add_argument("--start", type=int, default=20000, help="demands to begin with")
    parser.add_argument("--rounds", type=int, default=400)
    chosen = parser.parse_args()
    directory = ROOT / "generated"
    lib = load(directory, Cache())
    chosen_starts = [start for start in starts(lib, chosen.start) if chosen.only in start.kernel]
    with tempfile.TemporaryDirectory(prefix="awiwi-worst-") as scratch:
        blocks = Blocks(lib, [start.kernel for start in chosen_starts], directory, Path(scratch))
        cases = []
        for start in chosen_starts:
            cost = blocks.of(start.kernel, start.inputs)
            drawn = {port: x[[np.argmax(cost)]] for port, x in start.inputs.items()}
            for name, worst in (("drawn", drawn), ("bred", breed(blocks, start, chosen.rounds))):
                inputs = {port: np.repeat(x, TICKS, axis=0) for port, x in worst.items()}
                cases.append(Case(f"{start.kernel}, {name}", start.kernel, inputs))
    print(f"instructions of the worst call of {chosen.start} that were drawn, and of those bred from them")
    for name, instructions in count(lib, cases, directory).items():
        print(f"{name:50}{instructions:10.0f}")


if __name__ == "__main__":
    main()
