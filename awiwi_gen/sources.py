"""Which statements of the package a function depends on, and one digest of their text.

A statement of a module leads to every statement of the package that its names lead to: in its own module, or in
others by way of imports. So a result can be kept until something changes that it was really made with. Names are
followed wherever they stand, in annotations and unused branches too: rather one statement too many.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

from awiwi_gen.cache import Cache, key
from awiwi_gen.resources import PACKAGE

Place = tuple[str, str]  # a module, and a name that a statement of its top level binds
CATALOGUE = f"{PACKAGE.name}.kernels."
EFFECTS = ""  # the name of the statements that bind none: they run whenever their module is imported


def code_of(*roots: Any) -> str:
    """Digest of all that these functions, classes or callable objects depend on in the package's source."""
    return _code_of(frozenset(place for root in roots for place in _origins(root)))


@cache
def _code_of(origins: frozenset[Place]) -> str:
    """The digest of what some statements lead to; kept between runs, for reading the package takes a while."""

    def digest() -> str:
        return hashlib.sha256(b"".join(map(_digest, sorted(_reached(origins))))).hexdigest()

    return Cache().memo("code", key(_package(), sorted(origins)), digest)


@cache
def _package() -> str:
    """Digest of the text of all modules."""
    files = sorted(path.relative_to(PACKAGE.parent) for path in PACKAGE.rglob("*.py"))
    names = [".".join(file.with_suffix("").parts).removesuffix(".__init__") for file in files]
    return key(*(f"{name} {module_text(name)}" for name in names))


@cache
def _digest(place: Place) -> bytes:
    return hashlib.sha256(f"{place}\0{_module(place[0]).texts[place[1]]}".encode()).digest()


def reached(*roots: Any) -> frozenset[Place]:
    """Every statement that these functions, classes or callable objects lead to."""
    return _reached(frozenset(place for root in roots for place in _origins(root)))


def _reached(origins: frozenset[Place]) -> frozenset[Place]:
    return frozenset().union(*map(_closure, origins))


def _origins(root: Any) -> Iterator[Place]:
    """Where an object is written: a callable object by its class, and by the functions it holds."""
    if isinstance(root, partial):
        yield from _origins(root.func)
    elif hasattr(root, "__qualname__"):
        if (root.__module__ or "").split(".")[0] == PACKAGE.name:
            yield root.__module__, root.__qualname__.partition(".")[0]
    else:
        yield from _origins(type(root))
        held = [getattr(root, field.name) for field in fields(root)] if is_dataclass(root) else []
        for value in filter(callable, held):
            yield from _origins(value)


@cache
def _closure(root: Place) -> frozenset[Place]:
    """What a statement leads to, itself included."""
    found = {root}
    waiting = [root]
    while waiting:
        module, name = waiting.pop()
        new = _leads(module, name) - found
        found |= new
        waiting += new
    return frozenset(found)


@cache
def _leads(module: str, name: str) -> set[Place]:
    """What one statement leads to directly."""
    return {*_module(module).leads(name), (module, EFFECTS)}


class _Module:
    """The statements of a module's top level by the names they bind, and the names it has from others."""

    def __init__(self, name: str) -> None:
        text = module_text(name)
        tree, lines = ast.parse(text), text.splitlines()
        self.name = name
        self.imported = dict(_imported(tree))
        self._statements: dict[str, list[ast.stmt]] = {EFFECTS: []}
        for statement in tree.body:
            if isinstance(statement, (ast.Import, ast.ImportFrom)) or _is_docstring(statement):
                continue
            if isinstance(statement, ast.FunctionDef) and name.startswith(CATALOGUE):
                statement.decorator_list = []  # they declare the function to the catalogue and leave it as it is
            for bound in _bound(statement) or [EFFECTS]:
                self._statements.setdefault(bound, []).append(statement)
        self.texts = {bound: "\n".join(_text(s, lines) for s in found) for bound, found in self._statements.items()}

    def leads(self, bound: str) -> set[Place]:
        """The places that the names in a statement lead to."""
        found: set[Place] = set()
        for statement in self._statements[bound]:
            for name, attribute in _names(statement):
                if name in self._statements:
                    found.add((self.name, name))
                elif name in self.imported:
                    found |= _targets(*self.imported[name], attribute)
        return found


_module = cache(_Module)


def module_text(name: str) -> str:
    """The source of a module of the package. Raises OSError where there is none."""
    return _file(name).read_text(encoding="utf-8")


def _file(module: str) -> Path:
    path = PACKAGE.parent.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@cache
def _is_module(name: str) -> bool:
    return _file(name).is_file()


def _bound(statement: ast.stmt) -> list[str]:
    """The names that a statement binds; none for what only has an effect."""
    if isinstance(statement, (ast.FunctionDef, ast.ClassDef)):
        return [statement.name]
    targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
    if not isinstance(statement, (ast.Assign, ast.AnnAssign)):
        return []
    return [node.id for target in targets if target for node in ast.walk(target) if isinstance(node, ast.Name)]


def _imported(tree: ast.Module) -> Iterator[tuple[str, tuple[str, str]]]:
    """(local name, (module of the package, name in it)), imports inside functions included."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == PACKAGE.name:
            for alias in node.names:
                yield alias.asname or alias.name, (node.module or "", alias.name)


def _names(statement: ast.stmt) -> Iterator[tuple[str, str]]:
    """Names in a statement, each with the attribute that is asked of it, if any."""
    asked = set()
    for node in ast.walk(statement):  # an attribute comes before what it is asked of
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            asked.add(node.value)
            yield node.value.id, node.attr
        elif isinstance(node, ast.Name) and node not in asked:
            yield node.id, ""


def _targets(module: str, name: str, attribute: str) -> set[Place]:
    """The statements behind ``from module import name`` where ``name`` or its attribute is used."""
    if _is_module(f"{module}.{name}"):
        module, names = f"{module}.{name}", [attribute] if attribute else list(_module(f"{module}.{name}").texts)
    else:
        names = [name]
    return {place for name in names for place in _found(module, name)}


def _found(module: str, name: str) -> set[Place]:
    """Where a name of a module is bound: in it, or in the module that it has the name from."""
    known = _module(module)
    if name in known.texts:
        return {(module, name)}
    return _targets(*known.imported[name], "") if name in known.imported else set()


def _is_docstring(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _text(statement: ast.stmt, lines: list[str]) -> str:
    """The lines of a statement, without its documentation."""
    start = min([statement.lineno, *(d.lineno for d in getattr(statement, "decorator_list", []))])
    kept = [*range(start, (statement.end_lineno or start) + 1)]
    body = getattr(statement, "body", None)
    if isinstance(statement, (ast.FunctionDef, ast.ClassDef)) and body and _is_docstring(body[0]):
        kept = [i for i in kept if not body[0].lineno <= i <= (body[0].end_lineno or i)]
    return "\n".join(lines[i - 1] for i in kept)
