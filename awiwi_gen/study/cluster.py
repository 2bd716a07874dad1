"""Chunks on a Dask cluster: kernels travel as text, by digest, and every worker process compiles them once.

The text reaches each worker as a plugin, those too that join later or are started again. A worker that dies loses what
it was computing and no more: the scheduler gives that to another one, and finished chunks are files here.
"""

from __future__ import annotations

import logging
import platform
import re
import sys
import threading
import time
import warnings
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from distributed import Client, Future, KilledWorker, WorkerPlugin, get_worker, wait

from awiwi_gen.build import load
from awiwi_gen.cache import code_digest
from awiwi_gen.emit.exchange import MANIFEST
from awiwi_gen.emit.tree import install, read_manifest
from awiwi_gen.errors import AwiwiError, InputError, OutputError
from awiwi_gen.parallel import Progress
from awiwi_gen.study.base import Array, Study
from awiwi_gen.study.folder import AGAIN, Chunks

REACHED, LOOK, PATIENCE = 10.0, 1.0, 30.0  # s: to reach a scheduler, between looks at it, without any worker
QUEUED = 3  # chunks of a thread, one of which is computed
ADDRESS = re.compile(r"(tcp|tls)://\S+:\d+")
KERNELS: dict[str, dict[str, str]] = {}  # in a worker: texts of generated files by digest
LOADING = threading.Lock()  # threads of a worker


class Kernels(WorkerPlugin):  # type: ignore[misc]
    """The generated C of a digest, for every worker."""

    def __init__(self, digest: str, files: dict[str, str]) -> None:
        self.digest, self.files, self.name = digest, files, f"awiwi_gen-{digest}"

    def setup(self, worker: Any) -> None:
        """Keep the text; the first chunk compiles it."""
        KERNELS[self.digest] = self.files


def identity() -> dict[str, str]:
    """What workers must share, so that every chunk has the same bits wherever it is computed."""
    return {
        "awiwi_gen": f"{version('awiwi_gen')} ({code_digest()[:8]})",
        "numpy": version("numpy"),
        "python": ".".join(map(str, sys.version_info[:2])),
        "machine": f"{platform.machine()} {sys.platform}",
    }


def different(own: Mapping[str, str], other: Mapping[str, str]) -> str:
    """How a worker differs, in words; empty if it does not."""
    return ", ".join(
        f"{name} {other.get(name)} instead of {value}" for name, value in own.items() if other.get(name) != value
    )


def chunk_of(study: Study, digest: str, index: int, expected: Mapping[str, str]) -> dict[str, Array]:
    """Compute a chunk in a worker. Raises OutputError in one that differs."""
    if words := different(expected, identity()):
        raise OutputError(f"the worker {get_worker().address} has {words}")
    with LOADING:
        library = _library(digest)
    return study.at(library, index)


@cache
def _library(digest: str) -> Any:
    """The kernels of this process, compiled at the first call."""
    directory = Path(get_worker().local_directory) / f"kernels-{digest[:16]}"
    install(directory, KERNELS[digest])
    library = load(directory)
    library.threads = 1
    return library


def on_cluster(
    address: str, study: Study, kernels: Path, missing: list[int], chunks: Chunks, progress: Progress
) -> None:
    """Compute the missing chunks on the workers of a scheduler. Raises OutputError for a cluster that cannot."""
    if not missing:
        return
    manifest = read_manifest(kernels) or {}
    digest, names = manifest["manifest_digest"], [MANIFEST, *manifest["files"]]
    files = {name: (kernels / name).read_text(encoding="utf-8") for name in names}
    with _connected(address) as client:
        _require_equal(client, address)
        plugin = Kernels(digest, files)
        client.register_plugin(plugin)
        try:
            _gathered(client, study, digest, missing, chunks, progress)
        finally:
            if client.status == "running":
                client.unregister_worker_plugin(plugin.name)


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    """A client of the scheduler; what the cluster does to it is one sentence."""
    if not ADDRESS.fullmatch(address):
        raise InputError(f"--scheduler {address}: expected an address such as tcp://host:8786")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    warnings.filterwarnings("ignore", module="distributed")
    try:
        client = Client(address, timeout=REACHED, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        reason = str(error).partition("\n")[0]
        raise OutputError(f"--scheduler {address} cannot be reached: {reason}") from None
    try:
        with client.as_current():
            yield client
    except AwiwiError:
        raise
    except KilledWorker as error:
        raise OutputError(f"workers of {address} died several times of one chunk ({error.task}); {AGAIN}") from None
    except (CancelledError, OSError, TimeoutError) as error:
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise OutputError(f"--scheduler {address} was lost: {reason}; {AGAIN}") from None
    finally:
        client.close(timeout=LOOK)


def _require_equal(client: Client, address: str) -> None:
    """Raise OutputError where there is no worker, or one of another version or machine."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        raise OutputError(f"--scheduler {address} has no workers; start some: dask worker {address}") from None
    own = identity()
    for worker, other in client.run(identity, on_error="return").items():
        if isinstance(other, ModuleNotFoundError):
            raise OutputError(f"the worker {worker} has no {other.name}; install awiwi_gen[cluster] there")
        if isinstance(other, BaseException):
            raise OutputError(f"the worker {worker} does not answer: {other}")
        if words := different(own, other):
            raise OutputError(f"the worker {worker} has {words}; install the same there")


def _gathered(
    client: Client, study: Study, digest: str, missing: list[int], chunks: Chunks, progress: Progress
) -> None:
    """Submit chunks, few more than workers can begin, and keep each as soon as it is done."""
    waiting, active, own = list(reversed(missing)), dict[Future, int](), identity()
    seen = time.monotonic()
    while waiting or active:
        threads = sum(each["nthreads"] for each in client.scheduler_info(n_workers=-1)["workers"].values())
        while waiting and len(active) < QUEUED * max(threads, 1):
            index = waiting.pop()
            active[client.submit(chunk_of, study, digest, index, own, pure=False)] = index
        try:
            done = wait(list(active), timeout=LOOK, return_when="FIRST_COMPLETED").done
        except TimeoutError:
            done = set()
        if client.status != "running":
            raise OSError("the connection is closed")
        seen = time.monotonic() if threads or done else seen
        if time.monotonic() - seen > PATIENCE:
            raise OSError("no worker is left")
        for future in done:
            chunks.write(active.pop(future), future.result())
            progress(study.stage, len(missing) - len(waiting) - len(active), len(missing))
