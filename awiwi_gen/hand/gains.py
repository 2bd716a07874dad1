"""Gains of the backstepping law as a hand file names them: one table per tendon, written by `awiwi-gen tune`.

    gains = "gains.toml"         # in the hand file: a file of its own, in or below the folder of the hand file
    [[gains]]                    # or the tables themselves

    Without either, hand.gains.toml beside hand.toml is read, if it is there.

They are numbers of the hand like any other, so the generated parameters carry them to the firmware.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from pydantic import Field

from awiwi_gen.errors import InputError
from awiwi_gen.hand.file import HandFile
from awiwi_gen.hand.names import Source
from awiwi_gen.hand.part import absent
from awiwi_gen.hand.parts import Keys, Measure, Part
from awiwi_gen.units import Quantity

__all__ = ["OPTIONAL", "REQUIRED", "GainsFile", "TendonGains", "gains_complaints", "with_gains"]

Rate = Annotated[Quantity, Measure("100 1/s", "1e-6 1/s", "1000000 1/s")]

Pretension = Annotated[Quantity, Measure("10 N", "1e-3 N", "10000 N")]
Delay = Annotated[Quantity, Measure("22 ms", "1 ms", "10 s")]
LeastTorque = Annotated[Quantity, Measure("2 mN m", "1e-12 N m", "1000 N m")]


class TendonGains(Part):
    """What the antagonistic law needs for one tendon; tendons count from zero, finger by finger.

    Both tendons of a joint share the joint's impedance K_p and K_d. The rates K_3 and K_4 are those of the errors of
    the tendon's torque and of its rate, C_t and C_s what these weigh in the Lyapunov function.

    The other keys may be left out: the tendon's pretension at rest, the delay of the reference filter, the rates of the
    observer, and of what it learns: inertia, springs, below which rate and torque nothing is learnt, and the plan of the
    pretension.
    """

    tendon: Annotated[int, Field(ge=0, examples=["11"])]
    K_p: Annotated[Quantity, Measure("0.5 N m/rad", "1e-9 N m/rad", "10000 N m/rad")]
    K_d: Annotated[Quantity, Measure("0.001 N m s/rad", "1e-12 N m s/rad", "1000 N m s/rad")]
    K_3: Rate
    K_4: Rate
    C_t: Annotated[Quantity, Measure("1 rad/(N m)", "1e-12 rad/(N m)", "1000000000 rad/(N m)")]
    C_s: Annotated[Quantity, Measure("0.001 rad s^2/(N m)", "1e-12 rad s^2/(N m)", "1000000000 rad s^2/(N m)")]
    pretension: Annotated[Pretension | None, Field(exclude_if=absent)] = None
    smoothing: Annotated[Delay | None, Field(exclude_if=absent)] = None
    link_rate: Annotated[Rate | None, Field(exclude_if=absent)] = None
    motor_rate: Annotated[Rate | None, Field(exclude_if=absent)] = None
    torque_rate: Annotated[Rate | None, Field(exclude_if=absent)] = None
    spring_rate: Annotated[Rate | None, Field(exclude_if=absent)] = None
    inertia_rate: Annotated[Rate | None, Field(exclude_if=absent)] = None
    balance_rate: Annotated[Rate | None, Field(exclude_if=absent)] = None
    memory_rate: Annotated[Rate | None, Field(exclude_if=absent)] = None
    pretension_rate: Annotated[Rate | None, Field(exclude_if=absent)] = None
    least_torque: Annotated[LeastTorque | None, Field(exclude_if=absent)] = None
    source: Source


REQUIRED = {
    "K_p": "N m/rad", "K_d": "N m s/rad", "K_3": "1/s", "K_4": "1/s", "C_t": "rad/(N m)", "C_s": "rad s^2/(N m)",
}  # fmt: skip
OPTIONAL = {
    "pretension": "N", "smoothing": "s", "link_rate": "1/s", "motor_rate": "1/s", "torque_rate": "1/s",
    "spring_rate": "1/s", "inertia_rate": "1/s", "balance_rate": "1/s", "memory_rate": "1/s", "pretension_rate": "1/s",
    "least_torque": "N m",
}  # fmt: skip


Gains = Annotated[tuple[TendonGains, ...], Field(strict=False, max_length=256, examples=["[[gains]]"])]


class GainsFile(Part):
    """A file of gains and nothing else."""

    gains: Gains


def with_gains(file: HandFile, folder: Path | None = None, beside: Path | None = None) -> HandFile:
    """A hand file with the gains of the file it names in place of that name, or of the file `beside` it.

    Only a regular file in or below the folder of the hand file is read; ``folder`` is that folder, where the file has
    another name in messages. Raises `InputError` with the faults of that
    file, or with the line that names it if it cannot be read.
    """
    name = file.data.get("gains")
    if name is None and beside is not None and beside.is_file():
        return _including(file, HandFile.read(beside))
    if not isinstance(name, str):
        return file
    folder = folder or Path(file.name).parent
    try:
        inside = (folder / name).resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # a null character, a loop of links
        inside = False
    shown = f"= {json.dumps(name[:60])}"
    if not inside:
        message = f'{shown} is no file in or below the folder of the hand file; expected a path such as "gains.toml"'
        raise InputError(file.fault(("gains",), message))
    try:
        included = HandFile.read(folder / name, None if folder == Path(file.name).parent else name)
    except InputError as error:
        if any(fault.line for fault in error.faults):
            raise
        found = [file.fault(("gains",), f"{shown}: {fault.file} {fault.message}") for fault in error.faults]
        raise InputError(found) from None
    return _including(file, included)


def _including(file: HandFile, included: HandFile) -> HandFile:
    included.validated(GainsFile)
    return replace(file, data=file.data | included.data, included={"gains": included})


def gains_complaints(
    gains: tuple[TendonGains, ...], tendons: int, missing: Sequence[str]
) -> Iterator[tuple[Keys, str]]:
    """Gains for tendons that the hand does not have, a second set of gains for one tendon, and gains without a plant.

    `missing` are the sections of the hand file that the plant of a tendon is made of and that the file lacks.
    """
    if gains and missing:
        sections = " and ".join(f"[{section}]" for section in missing)
        yield ("gains",), f"are checked with the hand's motors and springs; add {sections}, or leave the gains out"
    seen: dict[int, int] = {}
    for index, each in enumerate(gains):
        key = ("gains", index, "tendon")
        if each.tendon >= tendons:
            yield key, f"= {each.tendon} is no tendon of this hand; expected 0 to {tendons - 1}"
        elif each.tendon in seen:
            yield key, f"= {each.tendon} has gains already in gains[{seen[each.tendon]}]"
        seen.setdefault(each.tendon, index)
