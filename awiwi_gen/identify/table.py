"""Measurements from a table in CSV whose head names each column with its unit: ``elongation [mm],force [N]``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from awiwi_gen.errors import Fault, InputError, unknown
from awiwi_gen.identify.recording import Array
from awiwi_gen.reading import read_table
from awiwi_gen.units import parse_quantity

# Column and the unit that it is kept in.
COLUMNS = {
    "counts": "1", "elongation": "m", "force": "N", "velocity": "rad/s", "theta": "rad", "torque": "N m",
}  # fmt: skip


def read(path: Path) -> dict[str, Array]:
    """The columns of a table in SI, by name. Raises InputError with the line of what cannot be read."""
    columns, cells = read_table(path)
    scales = [_scale(path, *column) for column in columns]
    names = [name for name, _ in scales]
    if len(set(names)) < len(names) or not names:
        raise InputError(Fault(file=str(path), line=1, message="names a column twice, or none at all"))
    rows = [_row(path, line, row, names) for line, row in cells]
    values = np.array(rows, float).reshape(-1, len(names)) * [scale for _, scale in scales]
    return dict(zip(names, values.T, strict=True))


def _scale(path: Path, name: str, stated: str) -> tuple[str, float]:
    """A column's name, and its unit in SI."""
    if name not in COLUMNS:
        raise InputError(
            Fault(
                file=str(path),
                line=1,
                message=str(unknown("column", name, COLUMNS, f"columns are {', '.join(COLUMNS)}")),
            )
        )
    written, wanted = stated or "1", parse_quantity(f"1 {COLUMNS[name]}" if COLUMNS[name] != "1" else "1")
    try:
        unit = parse_quantity("1" if written.strip() == "1" else f"1 {written}")
    except InputError as error:
        raise InputError(Fault(file=str(path), line=1, key=name, message=error.faults[0].message)) from None
    if unit.unit != wanted.unit:
        message = f"is in {stated or 'no unit'}; expected a unit such as {name} [{COLUMNS[name]}]"
        raise InputError(Fault(file=str(path), line=1, key=name, message=message))
    return name, float(unit)


def _row(path: Path, line: int, cells: list[str], names: list[str]) -> list[float]:
    if len(cells) != len(names):
        message = f"has {len(cells)} cells; expected one for each of {', '.join(names)}"
        raise InputError(Fault(file=str(path), line=line, message=message))
    numbers = []
    for name, cell in zip(names, cells, strict=True):
        try:
            numbers.append(float(cell))
        except ValueError:
            raise InputError(Fault(file=str(path), line=line, key=name, message=f'= "{cell}" is no number')) from None
    return numbers
