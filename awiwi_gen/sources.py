"""The modules of the package that a module imports, directly or not, and one digest of their text.

Cached results are keyed by the code that made them. Imports inside functions count too.
"""

from __future__ import annotations

import hashlib
import re
from functools import cache
from pathlib import Path

from awiwi_gen.resources import PACKAGE

NAME = rf"{PACKAGE.name}\.[\w.]+"
IMPORT = re.compile(
    rf"^ *(?:from (?P<parent>{NAME}) import (?P<members>\([^)]*\)|.*)|import (?P<module>{NAME}))", re.MULTILINE
)


@cache
def code_of(*modules: str) -> str:
    """Digest of the text of some modules (full names) and of every module of the package that they import."""
    return _digest(frozenset().union(*map(closure, modules)))


@cache
def _digest(modules: frozenset[str]) -> str:
    texts = (f"{name}\0{module_text(name)}" for name in sorted(modules))
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()


@cache
def closure(module: str) -> frozenset[str]:
    """A module and all modules of the package that it imports, directly or not."""
    found, waiting = {module}, [module]
    while waiting:
        new = _imported(waiting.pop()) - found
        found |= new
        waiting += new
    return frozenset(found)


@cache
def _imported(module: str) -> frozenset[str]:
    """The modules of the package that a module imports itself."""
    names = set()
    for found in IMPORT.finditer(module_text(module)):
        parent, members = found["parent"] or found["module"], re.findall(r"\w+", found["members"] or "")
        names |= {parent, *(f"{parent}.{member}" for member in members)}
    return frozenset(name for name in names if _file(name).is_file())


@cache
def module_text(name: str) -> str:
    """The source of a module of the package."""
    return _file(name).read_text(encoding="utf-8")


def _file(module: str) -> Path:
    path = PACKAGE.parent.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
