"""The folder of a study: chunks that survive any end of the program, and the results made of them."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from awiwi_gen.errors import InputError, OutputError
from awiwi_gen.study.base import Array, Report
from awiwi_gen.writing import whole_file, write_whole

DESCRIPTION = "study.json"
AGAIN = "the chunks that are done stay: the same command goes on from there"


@dataclass(frozen=True)
class Chunks:
    """The chunks of one stage, each a file that is there whole or not at all."""

    folder: Path

    def path(self, index: int) -> Path:
        """The file of a chunk."""
        return self.folder / f"{index:06d}.npz"

    def write(self, index: int, arrays: Mapping[str, Array]) -> None:
        """Keep a chunk. Raises OutputError where the system refuses."""
        try:
            with whole_file(self.path(index)) as stream:
                np.savez_compressed(stream, allow_pickle=False, **arrays)
        except OutputError as error:
            raise OutputError(f"{error}; {AGAIN}") from None

    def read(self, index: int) -> dict[str, Array] | None:
        """A chunk, or None where there is none or it is damaged."""
        try:
            with self.path(index).open("rb") as stream, np.load(stream, allow_pickle=False) as found:
                return {name: found[name] for name in found.files}
        except Exception:  # a damaged archive may raise anything; the chunk is computed again
            return None

    def missing(self, count: int) -> list[int]:
        """Those of the first so many that are not there."""
        return [index for index in range(count) if not self.path(index).exists() or self.read(index) is None]

    def all(self, count: int) -> Iterator[dict[str, Array]]:
        """The first so many, in order. Raises OutputError where one has gone since."""
        for index in range(count):
            found = self.read(index)
            if found is None:
                raise OutputError(f"{self.path(index)} has changed during the study; {AGAIN}")
            yield found

    def tidy(self) -> None:
        """Remove what killed processes left unfinished."""
        for path in self.folder.glob("*.tmp"):
            path.unlink(missing_ok=True)


def claim(folder: Path, described: Mapping[str, Any]) -> None:
    """Make the folder that of a study. Raises InputError where it is that of another one."""
    path = folder / DESCRIPTION
    text = json.dumps(described, indent=1, sort_keys=True, ensure_ascii=False) + "\n"
    if path.exists():
        try:
            before = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            before = {}
        differing = sorted(name for name in described if before.get(name) != json.loads(text)[name])
        if differing:
            raise InputError(
                f"{folder} holds a study with another {', another '.join(differing)}; choose another folder with -o, "
                "or remove it"
            )
        return
    if folder.exists() and any(folder.iterdir()):
        raise InputError(f"{folder} holds other files; choose an empty or new folder with -o")
    write_whole(path, text)


def write_results(folder: Path, described: Mapping[str, Any], report: Report) -> None:
    """Write ``result.npz``, and ``result.json`` with units and meanings. Raises OutputError where the system refuses."""
    with whole_file(folder / "result.npz") as stream:
        arrays = {name: each.values for name, each in report.results.items()}
        np.savez_compressed(stream, allow_pickle=False, **arrays)
    explained = {
        name: {"shape": list(each.values.shape), "unit": each.unit, "meaning": each.meaning}
        for name, each in report.results.items()
    }
    made = {"awiwi_gen": version("awiwi_gen"), "numpy": np.__version__, "python": platform.python_version()}
    whole = {"study": dict(described), "made with": made, "arrays": explained, "found": _finite(report.data)}
    write_whole(folder / "result.json", json.dumps(whole, indent=1, ensure_ascii=False) + "\n")


def _finite(value: Any) -> Any:
    """The same with null for infinity and NaN, which JSON does not have."""
    match value:
        case Mapping():
            return {name: _finite(each) for name, each in value.items()}
        case list() | tuple():
            return [_finite(each) for each in value]
        case float() if not np.isfinite(value):
            return None
    return value
