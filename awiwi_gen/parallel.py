"""Independent pieces of work on all cores, in processes that end with the one that started them."""

from __future__ import annotations

import gc
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from math import ceil
from typing import TYPE_CHECKING, Any, TypeVar

from awiwi_gen.errors import OutputError

if TYPE_CHECKING:
    from concurrent.futures import Future
    from multiprocessing.connection import Connection

T = TypeVar("T")
Progress = Callable[[str, int, int], None]  # stage, pieces done, pieces in all


def silent(stage: str, done: int, total: int) -> None:
    """Show no progress."""


def run(
    stage: str,
    function: Callable[[Any], object],
    items: Sequence[Any],
    progress: Progress,
    after: Sequence[set[int]] = (),
    workers: int | None = None,
) -> None:
    """Apply a function to items on all cores; to each when the items whose indices ``after`` names for it are done.

    ``workers`` is the number of processes, if not one for each core.
    """
    with running(stage, function, items, progress, after, workers) as finish:
        finish()


@contextmanager
def running(
    stage: str,
    function: Callable[[Any], object],
    items: Sequence[Any],
    progress: Progress,
    after: Sequence[set[int]] = (),
    workers: int | None = None,
) -> Iterator[Callable[[], None]]:
    """The same while the body of the `with` statement does something else; calling the target waits for the end.

    Raises what the function raises, and OutputError if a process dies. On any exception the others are stopped.
    """
    if len(items) <= 1:
        yield lambda: [function(item) for item in items].clear()
        return
    import multiprocessing
    from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
    from concurrent.futures.process import BrokenProcessPool

    waiting = dict(enumerate(after or [set() for _ in items]))
    active: dict[Future[Any], int] = {}
    alive, parent = multiprocessing.Pipe(duplex=False)
    workers = min(workers or os.cpu_count() or 1, len(items))
    with ProcessPoolExecutor(workers, initializer=_end_with_parent, initargs=(alive, parent)) as pool:

        def start() -> None:
            for index in [index for index, others in waiting.items() if not others]:
                del waiting[index]
                active[pool.submit(function, items[index])] = index

        def finish() -> None:
            while active:
                for future in sorted(wait(active, return_when=FIRST_COMPLETED).done, key=active.__getitem__):
                    future.result()
                    done = active.pop(future)
                    for others in waiting.values():
                        others.discard(done)
                start()
                progress(stage, len(items) - len(waiting) - len(active), len(items))

        try:
            with _interrupt_blocked():  # until the new processes ignore it
                start()
            yield finish
        except BrokenProcessPool:
            raise OutputError(
                f"{stage}: a worker process was killed, perhaps for lack of memory; run it again"
            ) from None
        except BaseException:
            parent.close()  # which ends the workers at once
            pool.shutdown(cancel_futures=True)
            raise
        finally:
            alive.close()
            pool.shutdown()
            parent.close()


@contextmanager
def _interrupt_blocked() -> Iterator[None]:
    """Delay an interrupt; processes that are started inside are not interrupted at all."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_parent(alive: Connection, parent: Connection) -> None:
    """End this worker when the other end of a pipe is closed: by its parent, or by the death of it."""
    gc.freeze()  # what the parent has made stays; graphs have no cycles, and looking for some takes a twentieth of the time
    gc.set_threshold(100_000, 20, 20)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is interrupted too, and ends its workers
    parent.close()

    def watch() -> None:
        alive.poll(None)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def split(groups: Sequence[list[T]], size: Callable[[T], int]) -> list[list[T]]:
    """The same items with groups cut into pieces that would keep one core busy while others wait."""
    sizes = [sum(map(size, members)) for members in groups]
    fair = max(1.0, sum(sizes) / (os.cpu_count() or 1))
    return [
        members[first::pieces]
        for members, total in zip(groups, sizes, strict=True)
        for pieces in [min(len(members), ceil(total / fair) or 1)]
        for first in range(pieces)
    ]
