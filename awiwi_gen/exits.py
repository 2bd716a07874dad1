"""How a command ends: whatever the system does to it becomes one sentence and an exit code, never a traceback.

2 for errors of the system (no space, no permission, no memory), 130 for an interrupt, 141 without a word when the
reader of a pipe is gone, as shells count signals.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import NoReturn

from awiwi_gen.errors import OutputError

INTERRUPTED, PIPE_CLOSED, SYSTEM = 130, 141, 2


@contextmanager
def system_errors() -> Iterator[None]:
    """Raise errors of the operating system as OutputError, after all that was printed has left.

    An interrupt and a closed pipe end the program.
    """
    try:
        yield
        if sys.stdout is not None:
            sys.stdout.flush()
    except KeyboardInterrupt:
        leave(INTERRUPTED, "interrupted")
    except BrokenPipeError:
        leave(PIPE_CLOSED)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(sentence(error)) from error
    except MemoryError as error:
        raise OutputError("there is not enough memory; close other programs, or choose fewer kernels") from error


def sentence(error: OSError) -> str:
    """What the system refused, and where."""
    reason = (error.strerror or str(error)).lower()
    where = os.fsdecode(error.filename) if isinstance(error.filename, (str, bytes)) else ""
    if not where and error.errno in (errno.ENOSPC, errno.EIO, errno.EBADF):
        where = "standard output or a temporary file"
    return f"{where}: {reason}" if where else reason


def leave(code: int, message: str = "") -> NoReturn:
    """End the program at once, without writing to what cannot be written to."""
    with suppress(OSError, ValueError):
        if message and sys.stderr is not None:
            print(message, file=sys.stderr, flush=True)
    os._exit(code)


def run(application: Callable[[], object]) -> None:
    """Run a command line. Standard streams that are closed are opened, so that no other file gets their numbers."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    if sys.stdout is None:
        leave(SYSTEM, "standard output is closed; expected a terminal, a file or a pipe")
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 until the end of the program
    try:
        with system_errors():
            application()
    except SystemExit as ending:
        code = ending.code
        try:
            sys.stdout.flush()
        except BrokenPipeError:
            leave(PIPE_CLOSED)
        except OSError as error:
            leave(SYSTEM, sentence(error))
        raise SystemExit(code) from None
    except OutputError as error:
        leave(SYSTEM, str(error))
