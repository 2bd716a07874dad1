"""Chunks of a study on local processes, or on a Dask cluster: those that are missing, each kept as soon as it is done."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from awiwi_gen import exits, parallel
from awiwi_gen.build import load
from awiwi_gen.emit.tree import read_manifest
from awiwi_gen.errors import InputError, OutputError
from awiwi_gen.parallel import Progress
from awiwi_gen.study.base import Study
from awiwi_gen.study.folder import AGAIN, Chunks


@dataclass(frozen=True)
class Place:
    """Where chunks are kept and who computes them: a Dask scheduler's address, or so many local processes."""

    folder: Path
    scheduler: str = ""
    workers: int | None = None


def computed(study: Study, kernels: Path, count: int, place: Place, progress: Progress) -> Chunks:
    """The first ``count`` chunks of a study with the generated C of a directory; those that were kept are not repeated.

    Raises OutputError where files cannot be written, a process is killed or a cluster fails; ends the program at an
    interrupt. What is done by then is kept.
    """
    manifest = read_manifest(kernels)
    if manifest is None:
        raise InputError(f"{kernels}: nothing generated here")
    digest = study.digest(manifest["manifest_digest"])
    chunks = Chunks(place.folder / "chunks" / f"{study.stage}-{digest[:16]}")
    missing = chunks.missing(count)
    if len(missing) < count:
        progress(f"{study.stage}, kept from before", count - len(missing), count - len(missing))
    try:
        if place.scheduler:
            from awiwi_gen.study.cluster import on_cluster

            on_cluster(place.scheduler, study, kernels, missing, chunks, progress)
        else:
            _locally(study, kernels, missing, chunks, place.workers, progress)
    except KeyboardInterrupt:
        done = count - len(chunks.missing(count))
        exits.leave(exits.INTERRUPTED, f"interrupted after {done} of {count} chunks; {AGAIN}")
    chunks.tidy()
    return chunks


def _locally(
    study: Study, kernels: Path, missing: list[int], chunks: Chunks, workers: int | None, progress: Progress
) -> None:
    library = load(kernels)
    library.threads = 1  # the processes are on all cores
    items = [(library, study, index, chunks) for index in missing]
    try:
        parallel.run(study.stage, _keep, items, progress, workers=workers)
    except OutputError as error:
        text = str(error)
        raise OutputError(text if AGAIN in text else f"{text}; {AGAIN}") from None


def _keep(item: tuple[Any, Study, int, Chunks]) -> None:
    """Compute one chunk in a process, and keep it."""
    library, study, index, chunks = item
    chunks.write(index, study.at(library, index))
