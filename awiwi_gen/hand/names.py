"""Names and texts of a hand file that end up in the generated C."""

from __future__ import annotations

import re
from functools import partial
from typing import Annotated

from pydantic import AfterValidator, Field, PlainValidator

__all__ = ["FingerName", "JointName", "Over", "Prefix", "Source", "Title"]

# Keywords up to C23 and C++23: both languages include the generated header.
_C = """alignas alignof asm auto bool break case char const constexpr continue default do double else enum extern false
    float for fortran goto if inline int long nullptr register restrict return short signed sizeof static static_assert
    struct switch thread_local true typedef typeof union unsigned void volatile while"""
_CPP = """and and_eq bitand bitor catch char8_t char16_t char32_t class co_await co_return co_yield compl concept
    const_cast consteval constinit decltype delete dynamic_cast explicit export final friend import module mutable
    namespace new noexcept not not_eq operator or or_eq override private protected public reinterpret_cast requires
    static_cast template this throw try typeid typename using virtual wchar_t xor xor_eq"""
_KEYWORDS = frozenset(f"{_C} {_CPP}".split())
# A finger's name begins the names of its kernels, so it must differ from the first word of every other kernel.
_KERNELS = """backstepping batch calibration cascade finger force forearm friction guiding hand impedance joint joints
    lever lqr model motor observer optimal palm params pole sdre self spring status step stiffness tendon tendons test
    version wrist"""
_TAKEN = frozenset(_KERNELS.split())


def _identifier(text: str, longest: int, underscores: bool = True, taken: frozenset[str] = frozenset()) -> str:
    if not re.fullmatch(r"[a-z](?:_?[a-z0-9])*" if underscores else r"[a-z][a-z0-9]*", text) or len(text) > longest:
        inside = ", 0-9 and single underscores" if underscores else " and 0-9"
        raise ValueError(f"is not a usable name; expected a letter, then a-z{inside}, at most {longest} in all")
    if text in _KEYWORDS:
        raise ValueError("is a keyword of C or C++")
    if text in taken:
        raise ValueError("is a name that the generated C reserves")
    return text


def _one_line(text: str) -> str:
    """Text for a C comment: it must not close the comment, continue it, or hide characters."""
    if not text.strip() or not text.isprintable() or len(text) > 80:
        raise ValueError("is not one line of 1 to 80 printable characters")
    for bad in ("*/", "/*", "\\", "??"):
        if bad in text:
            raise ValueError(f"contains {bad}, which does not belong in a C comment")
    return text


_MOST_SOURCES = 64  # keys of one table's source; no table has as many numbers


def _source(value: object) -> str | dict[str, str]:
    """One text for all numbers of a table, or one per key; `span.from` in TOML is a table in a table."""
    if isinstance(value, str):
        return _one_line(value)
    if isinstance(value, dict) and len(value) > _MOST_SOURCES:
        raise ValueError(f"has {len(value)} entries; expected at most {_MOST_SOURCES}")
    if not isinstance(value, dict) or not value:
        raise ValueError('is not a source; expected "table 5.1", or { mass = "table 5.1", default = "assumed" }')
    flat: dict[str, str] = {}
    for key, source in value.items():
        inner = _source(source)
        flat |= {key: inner} if isinstance(inner, str) else {f"{key}.{below}": text for below, text in inner.items()}
    return dict(sorted(flat.items()))


def _over(text: str) -> str:
    if not re.fullmatch(r"[+-][a-z][a-z0-9_]*", text):
        raise ValueError('is not a sense and a pulley; expected something such as "+pip"')
    return text


Prefix = Annotated[str, AfterValidator(partial(_identifier, longest=16)), Field(examples=['"awiwi"'])]
FingerName = Annotated[str, AfterValidator(partial(_identifier, longest=16, underscores=False, taken=_TAKEN))]
JointName = Annotated[str, AfterValidator(partial(_identifier, longest=63)), Field(examples=['"flexion"'])]
Title = Annotated[str, AfterValidator(_one_line), Field(examples=['"Awiwi hand"'])]
Source = Annotated[
    str | dict[str, str],
    PlainValidator(_source, json_schema_input_type=str | dict[str, str]),
    Field(examples=['"table 5.1"', '"assumed"']),
]
Over = Annotated[str, AfterValidator(_over)]
