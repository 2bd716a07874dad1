"""Patterns of kernel names, as `--only` takes them: `index_*`, or several with commas: `spring_*,*_coupling`."""

from __future__ import annotations

from fnmatch import fnmatchcase

ALL = "*"


def matches(name: str, only: str) -> bool:
    """Whether a name fits one of the patterns."""
    return any(fnmatchcase(name, pattern.strip()) for pattern in only.split(","))
