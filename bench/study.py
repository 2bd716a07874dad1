"""How studies scale over workers: a study of tolerances by 1, 2 and 4 local processes, and by as many workers of Dask.

Run with `python -m bench.study`. All runs compute the same chunks, each into a folder of its own, in turn; the best of
several counts. "busy" is the processors' time over that of as many cores as could have worked. The last lines say where
the time of a run goes that is not spent in chunks.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from awiwi_gen.build import load
from awiwi_gen.hand import Hand
from awiwi_gen.parallel import silent
from awiwi_gen.study.base import poses_of
from awiwi_gen.study.folder import Chunks
from awiwi_gen.study.prepare import generated, ranges_of
from awiwi_gen.study.run import Place, computed
from awiwi_gen.study.tolerance import POSES, Tolerance

WORKERS = (1, 2, 4)
FIGURES = ("fingertip", "coupling", "stiffness", "gravity")
ONLY = "index_fingertip_pose,index_coupling,index_joint_stiffness,index_tendon_stiffness,index_gravity"


def processors() -> float:
    """Time of this process and of all that it started, running or ended [s]."""
    import psutil  # which comes with distributed

    own = psutil.Process()
    return sum(sum(each.cpu_times()[:4]) for each in (own, *own.children(recursive=True)))


def studied() -> tuple[Tolerance, Path]:
    """The study of the index finger with numbers known to 2 %, and the kernels of it."""
    hand = Hand.load().model_copy(update={"gains": ()})
    kernels = generated(hand, ONLY, silent, "runtime")
    numbers = hand.quantities()
    values = np.array([float(numbers[each["path"]]) for each in load(kernels).manifest["params"]["numbers"]])
    tendons = np.full(len(hand.fingers["index"].tendons), 20.0)
    poses = poses_of(*ranges_of(hand, "index"), 0, POSES)
    gravity = np.array([0, 0, -9.81])
    return Tolerance(0, "bench", "index", FIGURES, values, 0.02 * np.abs(values), poses, tendons, gravity), kernels


@contextmanager
def cluster(workers: int) -> Iterator[Place]:
    """A Dask cluster of so many processes on this machine, that is running when the clock starts."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=50) as local:
        local.wait_for_workers(workers, timeout=60)
        yield Place(Path(), local.scheduler_address)


@contextmanager
def processes(workers: int) -> Iterator[Place]:
    """Local processes, that a study starts itself."""
    yield Place(Path(), workers=workers)


def timed(place: Place, study: Tolerance, kernels: Path, count: int) -> float:
    """The seconds of a study into a new folder."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        computed(study, kernels, count, Place(Path(folder), place.scheduler, place.workers), silent)
        return time.perf_counter() - start


def main() -> None:
    """Measure all and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--chunks", type=int, default=64, help="of 1024 hands at 32 poses")
    parser.add_argument("--runs", type=int, default=3, help="of each kind; the best counts")
    chosen = parser.parse_args()
    study, kernels = studied()
    library = load(kernels)
    library.threads = 1
    study.at(library, 0)
    kinds: list[tuple[str, Callable[[int], object]]] = [("processes", processes), ("Dask workers", cluster)]
    best: dict[tuple[str, int], tuple[float, float]] = {}
    for _ in range(chosen.runs):
        for name, kind in kinds:
            for workers in WORKERS:
                with kind(workers) as place:  # type: ignore[attr-defined]
                    started = processors()
                    seconds = timed(place, study, kernels, chosen.chunks)
                    used = processors() - started
                best[name, workers] = min(best.get((name, workers), (float("inf"), 0.0)), (seconds, used))
                print(f"  {workers} {name}: {seconds:.2f} s", file=sys.stderr, flush=True)
    samples = chosen.chunks * Tolerance.SIZE * POSES
    print(
        f"{chosen.chunks} chunks, {samples / 1e6:.1f} million samples of {len(FIGURES)} figures, {os.cpu_count()} cores"
    )
    print(f"{'workers':20}{'seconds':>9}{'million/s':>11}{'times':>7}{'processors':>12}{'busy':>7}")
    for (name, workers), (seconds, used) in best.items():
        times, cores = best[name, 1][0] / seconds, min(workers, os.cpu_count() or 1)
        row = f"{f'{workers} {name}':20}{seconds:9.2f}{samples / seconds / 1e6:11.2f}{times:7.2f}{used:12.2f}"
        print(f"{row}{used / seconds / cores:7.0%}")
    print(limits(study, library, kernels))


def limits(study: Tolerance, library: object, kernels: Path) -> str:
    """Times [ms] of what a chunk needs besides the kernels."""
    with tempfile.TemporaryDirectory() as folder:
        chunks = Chunks(Path(folder))
        start = time.perf_counter()
        found = study.at(library, 1)
        made = time.perf_counter()
        chunks.write(1, found)
        written = time.perf_counter()
        chunks.read(1)
        read = time.perf_counter()
        load(kernels)
        again = time.perf_counter()
    parts = {"compute": made - start, "write": written - made, "read": read - written, "load kernels": again - read}
    return "ms, of one chunk: " + ", ".join(f"{name} {seconds * 1e3:.1f}" for name, seconds in parts.items())


if __name__ == "__main__":
    main()
