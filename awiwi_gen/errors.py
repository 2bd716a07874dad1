"""Every exception this package raises on purpose.

    AwiwiError                something a user can read and act on; exit code 1
    ├── InputError            what was handed in is wrong: a hand file, an argument; exit code 2; lists all its faults
    │   └── OutputError       the place to write to is missing, locked or somebody else's
    ├── DimensionError        an expression adds metres to newtons: the physics, not the file, is wrong
    ├── BuildError            the C compiler refused the generated code
    │   └── NoCompilerError   there is none that works; exit code 2
    ├── BudgetError           a kernel costs more than what is committed
    └── VerificationError     two independent routes to one number disagree

Anything else that escapes is a bug of ours.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

__all__ = [
    "AwiwiError", "BudgetError", "BuildError", "DimensionError", "Fault", "InputError", "NoCompilerError", "OutputError",
    "VerificationError", "unknown",
]  # fmt: skip

_MOST_SHOWN = 100  # a terminal is not scrolled back farther than that; `faults` has them all


class AwiwiError(Exception):
    """Root of the tree; the command line prints it and leaves with `exit_code`."""

    exit_code: ClassVar[int] = 1


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One thing wrong with an input: where it is, and a predicate that completes the sentence.

    >>> print(Fault(file="hand.toml", line=41, key="radius", message='= "6.2 N" is a force; expected a length'))
    hand.toml:41 radius = "6.2 N" is a force; expected a length
    """

    message: str
    file: str | None = None
    line: int | None = None
    key: str | None = None

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file or ''}:{self.line}"
        return " ".join(part for part in (place, self.key, self.message) if part)


class InputError(AwiwiError, ValueError):
    """Bad input, with all faults found (at least one), in the order a reader meets them.

    It is a `ValueError` too, so that a schema library collects it instead of letting it through.
    """

    exit_code: ClassVar[int] = 2

    def __init__(self, faults: str | Fault | Iterable[Fault]) -> None:
        if isinstance(faults, str):
            faults = Fault(message=faults)
        self.faults: tuple[Fault, ...] = (faults,) if isinstance(faults, Fault) else tuple(faults)
        super().__init__(self.faults)  # what pickle hands back to this constructor in another process

    def __str__(self) -> str:
        lines = [str(fault) for fault in self.faults[:_MOST_SHOWN]]
        more = len(self.faults) - len(lines)
        return "\n".join(lines + [f"... and {more} more"] * (more > 0))


def unknown(kind: str, name: str, known: Iterable[str], otherwise: str = "see awiwi-gen list") -> InputError:
    """The exception for a name that is not known, with those that look like it, or else where to find names."""
    near = difflib.get_close_matches(name, list(known), 3)
    return InputError(f"no {kind} {name!r}; {'did you mean ' + ', '.join(near) if near else otherwise}")


class OutputError(InputError):
    """The output directory cannot be written, or holds files this program did not make."""


class DimensionError(AwiwiError):
    """Units do not fit together inside an expression."""


class BuildError(AwiwiError):
    """The C compiler failed."""


class NoCompilerError(BuildError):
    """There is no C compiler, or none that works: the machine is to be mended, not the code."""

    exit_code = 2


class BudgetError(AwiwiError):
    """Kernels cost more than their committed budget."""


class VerificationError(AwiwiError):
    """A witness contradicts another one."""
