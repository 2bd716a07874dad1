"""Every exception this package raises on purpose.

    AwiwiError                an error that a user can read and act on; exit code 1
    ├── InputError            the input is wrong: a hand file, an argument; exit code 2; lists its faults
    │   ├── OutputError       the output directory is missing, locked or not ours
    │   └── MissingExtraError a library is not installed; names the extra that brings it
    ├── DimensionError        an expression adds metres to newtons: the physics is wrong, not the file
    ├── BuildError            the C compiler refused the generated code
    │   └── NoCompilerError   there is no working C compiler; exit code 2
    ├── BudgetError           a kernel costs more than its committed budget
    └── VerificationError     two independent derivations of one number disagree

Any other exception that escapes is a bug of this package.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

__all__ = [
    "AwiwiError", "BudgetError", "BuildError", "DimensionError", "Fault", "InputError", "MissingExtraError",
    "NoCompilerError", "OutputError", "VerificationError", "printable", "unknown",
]  # fmt: skip

MOST_FAULTS = 100  # shown in one error; nobody scrolls back further


def printable(text: str) -> str:
    """The text with control characters escaped: safe for a terminal. Line ends and tabs stay."""
    return "".join(c if c.isprintable() or c in "\n\t" else c.encode("unicode_escape").decode() for c in text)


class AwiwiError(Exception):
    """Root of the tree; the command line prints it and exits with `exit_code`."""

    exit_code: ClassVar[int] = 1


@dataclass(frozen=True, kw_only=True)
class Fault:
    """An error or a warning about an input: its location, and a predicate that completes the sentence.

    >>> print(Fault(file="hand.toml", line=41, key="radius", message='= "6.2 N" is a force; expected a length'))
    hand.toml:41 radius = "6.2 N" is a force; expected a length

    A warning has a `ratio`: the value found over the largest (or smallest) usual one.
    """

    message: str
    file: str | None = None
    line: int | None = None
    key: str | None = None
    ratio: float | None = None

    def __str__(self) -> str:
        location = self.file if self.line is None else f"{self.file or ''}:{self.line}"
        return printable(" ".join(part for part in (location, self.key, self.message) if part))

    def as_dict(self) -> dict[str, Any]:
        """Everything that is known, ready for JSON."""
        return {name: value for name, value in vars(self).items() if value is not None}


class InputError(AwiwiError, ValueError):
    """Bad input, with its faults (at least one) in the order a reader meets them.

    `hidden` counts further faults that were found but not worded. It is a `ValueError` too, so that a schema library
    collects it.
    """

    exit_code: ClassVar[int] = 2

    def __init__(self, faults: str | Fault | Iterable[Fault], hidden: int = 0) -> None:
        if isinstance(faults, str):
            faults = Fault(message=faults)
        self.faults: tuple[Fault, ...] = (faults,) if isinstance(faults, Fault) else tuple(faults)
        self.hidden = hidden
        super().__init__(self.faults, hidden)  # the arguments that pickle passes on in another process

    def __str__(self) -> str:
        lines = [str(fault) for fault in self.faults[:MOST_FAULTS]]
        more = len(self.faults) - len(lines) + self.hidden
        return "\n".join(lines + [f"... and {more} more"] * (more > 0))


def unknown(kind: str, name: str, known: Iterable[str], otherwise: str = "see awiwi-gen list") -> InputError:
    """The exception for an unknown name; it suggests similar names, or else says where the names are listed."""
    near = difflib.get_close_matches(name, list(known), 3)
    return InputError(f"no {kind} {name!r}; {'did you mean ' + ', '.join(near) if near else otherwise}")


class OutputError(InputError):
    """The output directory cannot be written, or holds files that this program did not make."""


class MissingExtraError(InputError, ImportError):
    """A library that the task needs is not installed."""


class DimensionError(AwiwiError):
    """Units do not fit together inside an expression."""


class BuildError(AwiwiError):
    """The C compiler failed."""


class NoCompilerError(BuildError):
    """There is no working C compiler: the machine needs a fix, not the code."""

    exit_code = 2


class BudgetError(AwiwiError):
    """Kernels cost more than their committed budget."""


class VerificationError(AwiwiError):
    """Two derivations of one number contradict each other."""
