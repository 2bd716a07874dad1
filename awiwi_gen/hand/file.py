"""From a file on disk to validated parts; an error names the file, line and key, and suggests a fix.

A good file costs one `tomllib` parse. Lines of keys come from a second parser, which is imported for messages only.
"""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from awiwi_gen.errors import MOST_FAULTS, Fault, InputError
from awiwi_gen.hand.messages import key_path, schema_faults
from awiwi_gen.hand.parts import Keys

__all__ = ["HandFile", "key_path"]

Model = TypeVar("Model", bound=BaseModel)
_MOST_BYTES = 250_000  # a hand file has about 15 kB
_MOST_ENTRIES = 2000  # of one array or table; the schema allows a few hundred, and words a fault for each entry
_MOST_COLUMNS = 1000  # the time to parse a dotted key grows with the square of its length


@dataclass(frozen=True)
class HandFile:
    """The text of a hand file, parsed but not validated; `included` has the files its top-level keys were read from."""

    name: str
    text: str
    data: dict[str, Any]
    included: Mapping[str, HandFile] = field(default_factory=dict)

    @classmethod
    def read(cls, path: str | os.PathLike[str], name: str | None = None) -> HandFile:
        """Read and parse a regular file; messages call it `name`. Raises `InputError` if it is no TOML text file."""
        name = name or os.fspath(path)
        try:
            mode = Path(path).stat().st_mode
            if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # reading a pipe or a device may never end
                raise InputError(Fault(file=name, message="is not a regular file"))
            with Path(path).open("rb") as stream:
                raw = stream.read(_MOST_BYTES + 1)
        except InputError:
            raise
        except (OSError, ValueError) as error:  # ValueError: a null character in the path
            reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
            raise InputError(Fault(file=name, message=f"cannot be read: {reason[:1].lower()}{reason[1:]}")) from None
        if len(raw) > _MOST_BYTES:
            raise InputError(Fault(file=name, message=f"is longer than {_MOST_BYTES} bytes, the limit of a hand file"))
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = raw.count(b"\n", 0, error.start) + 1
            message = f"is not UTF-8 text: byte {raw[error.start]:#04x} at offset {error.start}"
            raise InputError(Fault(file=name, line=line, message=message)) from None
        return cls.parse(text, name)

    @classmethod
    def parse(cls, text: str, name: str) -> HandFile:
        """Parse TOML text. Raises `InputError` with line and column."""
        for line, content in enumerate(text.split("\n"), start=1):
            if len(content) > _MOST_COLUMNS:
                raise InputError(Fault(file=name, line=line, message=f"is longer than {_MOST_COLUMNS} characters"))
        try:
            return cls(name, text, tomllib.loads(text))
        except RecursionError:
            fault = Fault(file=name, message="nests its brackets too deeply")
        except ValueError as error:  # a TOMLDecodeError, or an integer of more digits than Python reads
            found = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)$", str(error))
            at_end = found is not None and found[1] is None
            place = text.count("\n") + 1 if at_end else int(found[1]) if found else None
            column = " at its end" if at_end else f" in column {found[2]}" if found else ""
            reason = str(error)[: found.start() if found else 200]
            fault = Fault(file=name, line=place, message=f"is not TOML{column}: {reason[:1].lower()}{reason[1:]}")
        raise InputError(fault)

    def validated(self, schema: type[Model]) -> Model:
        """Validate the data by a schema. Raises `InputError` with all faults."""
        if long := _too_long(self.data):
            raise self.error([long])
        try:
            return schema.model_validate(self.data)
        except ValidationError as error:
            raise self.error(schema_faults(schema, error.errors(include_url=False))) from None

    def error(self, complaints: Iterable[tuple[Keys, str | Callable[[], str]]]) -> InputError:
        """The exception that lists complaints, top of the file first; those beyond the limit are only counted."""
        found = sorted(complaints, key=lambda each: self.line(each[0]) or 0)
        shown = [self.fault(keys, text if isinstance(text, str) else text()) for keys, text in found[:MOST_FAULTS]]
        return InputError(shown, hidden=len(found) - len(shown))

    def fault(self, keys: Keys, message: str, ratio: float | None = None) -> Fault:
        """A fault at a key, or at the table that should have the key."""
        file = self.included.get(str(keys[0]), self) if keys else self
        return Fault(file=file.name, line=self.line(keys), key=key_path(keys), message=message, ratio=ratio)

    def line(self, keys: Keys) -> int | None:
        """The line of a key, or of the innermost table above it that is in the file."""
        lines = self.included[str(keys[0])]._lines if keys and keys[0] in self.included else self._lines
        return next((lines[keys[:n]] for n in range(len(keys), 0, -1) if keys[:n] in lines), None)

    @cached_property
    def _lines(self) -> dict[Keys, int]:
        from awiwi_gen.hand.lines import lines_of_keys

        return lines_of_keys(self.text)


def _too_long(data: object, keys: Keys = ()) -> tuple[Keys, str] | None:
    """The first array or table that has more entries than any hand needs."""
    if not isinstance(data, dict | list):
        return None
    if len(data) > _MOST_ENTRIES:
        return keys, f"has {len(data)} entries; expected at most {_MOST_ENTRIES}"
    items = data.items() if isinstance(data, dict) else enumerate(data)
    return next((found for key, value in items if (found := _too_long(value, (*keys, key)))), None)
