"""Where the keys of a TOML text are, from a second parser that is imported for messages and edits only."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from typing import TYPE_CHECKING

from awiwi_gen.hand.parts import Keys

if TYPE_CHECKING:
    from tree_sitter import Node

__all__ = ["lines_of_keys", "values_of_keys"]

_DEEPEST = 12  # keys of a path that get a line of their own; the schema is 8 deep


def lines_of_keys(text: str) -> dict[Keys, int]:
    """The line, from 1, of each key, table and array element of a valid TOML text."""
    return _places(text)[0]


def values_of_keys(text: str) -> dict[Keys, slice]:
    """The bytes of the value of each key and array element of a valid TOML text in UTF-8; tables with a header have none."""
    return _places(text)[1]


def _places(text: str) -> tuple[dict[Keys, int], dict[Keys, slice]]:
    import tree_sitter_toml
    from tree_sitter import Language, Parser

    lines: dict[Keys, int] = {}
    values: dict[Keys, slice] = {}
    elements: dict[Keys, int] = {}  # number of [[tables]] of each name so far

    def mark(keys: Keys, node: Node) -> None:
        for end in range(1, min(len(keys), _DEEPEST) + 1):
            lines.setdefault(keys[:end], node.start_point.row + 1)

    def value(keys: Keys, node: Node) -> None:
        values[keys] = slice(node.start_byte, node.end_byte)
        inside = [child for child in node.named_children if child.type != "comment"]
        if node.type == "array":
            for index, child in enumerate(inside):
                mark((*keys, index), child)
                value((*keys, index), child)
        elif node.type == "inline_table":
            pairs(keys, inside)

    def pairs(table: Keys, nodes: Iterable[Node]) -> None:
        for node in nodes:
            if node.type == "pair":
                name, content = node.named_children[:2]
                keys = (*table, *_parts(name))
                mark(keys, node)
                value(keys, content)

    root = Parser(Language(tree_sitter_toml.language())).parse(text.encode()).root_node
    pairs((), root.named_children)
    for node in root.named_children:
        if node.type not in ("table", "table_array_element"):
            continue
        header, *body = (child for child in node.named_children if child.type != "comment")
        keys: Keys = ()
        *outer, last = _parts(header)
        for part in outer:  # a header names the newest element of the arrays in its path
            keys = (*keys, part)
            keys = (*keys, elements[keys] - 1) if keys in elements else keys
        keys = (*keys, last)
        if node.type == "table_array_element":
            elements[keys] = elements.get(keys, 0) + 1
            keys = (*keys, elements[keys] - 1)
        mark(keys, node)
        pairs(keys, body)
    return lines, values


def _parts(key: Node) -> list[str]:
    """The parts of a dotted key, with quotes and escapes read by the TOML parser."""
    text = (key.text or b"").decode()
    if re.fullmatch(r"[A-Za-z0-9_.-]+", text):
        return text.split(".")
    table = tomllib.loads(text + " = 0")
    parts = []
    while isinstance(table, dict):
        ((part, table),) = table.items()
        parts.append(part)
    return parts
