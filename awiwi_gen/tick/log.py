"""Logs of a tick: written by firmware or by the simulated loop, read into arrays, and run again by the same C."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.errors import Fault, InputError
from awiwi_gen.tick.loop import ClosedLoop, HandStep
from awiwi_gen.tick.structs import Struct, require_tick

if TYPE_CHECKING:
    from awiwi_gen.library import Library

MAGIC, VERSION = b"AWIWILOG", 2


class Writer:
    """Writes the head of a log of a loop that just began, and a record at every call."""

    def __init__(self, stream: IO[bytes], loop: ClosedLoop) -> None:
        library, step = loop.step.library, loop.step
        head = Struct(library, "awiwi_hand_log")
        pose = library.ffi.new(f"{library.manifest['c_type']}[]", loop.start.tolist())
        arguments = (step.model, step.gains.pointer, step.input.pointer, pose, head.pointer)
        library.c.awiwi_hand_log_begin(*arguments)
        stream.write(head.bytes)
        self._stream, self._record = stream, Struct(library, "awiwi_hand_record")

    def __call__(self, loop: ClosedLoop) -> None:
        """Add the record of the tick that just ended."""
        step, record = loop.step, self._record
        arguments = (step.model, step.gains.pointer, step.input.pointer, step.state.pointer, record.pointer)
        step.library.c.awiwi_hand_log_tick(*arguments)
        self._stream.write(record.bytes)


@dataclass(frozen=True)
class Replay:
    """A log that was run again: torques (ticks, tendons) [N m] and status (ticks,) as logged, and the telemetry.

    ``telemetry`` has the state's arrays by name, (ticks, ...). ``first_difference`` is the first tick whose torques or
    status have other bits than the log, or -1.
    """

    torque: np.ndarray[Any, Any]
    status: np.ndarray[Any, Any]
    telemetry: dict[str, np.ndarray[Any, Any]]
    first_difference: int

    @property
    def ticks(self) -> int:
        """Number of records."""
        return len(self.torque)


TELEMETRY = ("q", "qd", "f", "f_des", "tau", "yield", "motion", "heat", "mode", "share", "torque", "tendon_status")


def replay(library: Library, path: Path) -> Replay:
    """Run a log again. Raises InputError for a file that is no log, is cut short, or comes from another build."""
    require_tick(library)
    step = HandStep(library)
    head, record = Struct(library, "awiwi_hand_log"), Struct(library, "awiwi_hand_record")
    data = path.read_bytes()
    _require(path, data, head, record, int(step.model.build_id))
    ffi = library.ffi
    ffi.memmove(step.gains.pointer, ffi.addressof(head.pointer, "gains"), ffi.sizeof("awiwi_hand_gains"))
    ffi.memmove(step.input.pointer, ffi.addressof(head.pointer, "input"), ffi.sizeof("awiwi_hand_input"))
    step.init(head.q[: step.joints])
    torque, status, first = [], [], -1
    telemetry: dict[str, list[Any]] = {name: [] for name in TELEMETRY}
    for tick, chunk in enumerate(_records(data, len(head.bytes), len(record.bytes))):
        record.bytes[:] = chunk
        ffi.memmove(step.gains.pointer, ffi.addressof(record.pointer, "gains"), ffi.sizeof("awiwi_hand_gains"))
        ffi.memmove(step.input.pointer, ffi.addressof(record.pointer, "input"), ffi.sizeof("awiwi_hand_input"))
        step.step()
        logged = record.torque[: step.tendons].copy()
        same = step.torque.tobytes() == logged.tobytes() and step.status == int(record.status[0])
        first = tick if first < 0 and not same else first
        torque.append(logged)
        status.append(int(record.status[0]))
        for name in TELEMETRY:
            telemetry[name].append(getattr(step.state, name).copy())
    found = {name: np.array(values) for name, values in telemetry.items()}
    return Replay(np.array(torque), np.array(status), found, first)


def _records(data: bytes, head: int, size: int) -> Iterator[bytes]:
    for start in range(head, len(data) - size + 1, size):
        yield data[start : start + size]


def _require(path: Path, data: bytes, head: Struct, record: Struct, build: int) -> None:
    """Read the head. Raises InputError where the file is no log of this build."""

    def refuse(message: str) -> None:
        raise InputError(Fault(file=str(path), message=message))

    if data[:8] != MAGIC:
        refuse("is no log of a tick; expected a file that begins with AWIWILOG")
    if len(data) < len(head.bytes):
        refuse(f"has {len(data)} bytes; the head of a log alone has {len(head.bytes)}")
    head.bytes[:] = data[: len(head.bytes)]
    if head.version[0] != VERSION:
        refuse(f"is a log of version {head.version[0]}; expected {VERSION}")
    if head.build_id[0] != build:
        refuse(f"comes from build {int(head.build_id[0]):#010x}; expected {build:#010x}, with whose C it is run again")
    if head.record_size[0] != len(record.bytes):
        refuse(f"has records of {head.record_size[0]} bytes; expected {len(record.bytes)}, as the headers have them")
    if rest := (len(data) - len(head.bytes)) % len(record.bytes):
        refuse(f"ends within a record, {rest} bytes after the last whole one; expected whole records")
