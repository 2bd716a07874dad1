"""C structs as NumPy arrays: each member under its name, in the memory that the C reads and writes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from awiwi_gen.errors import InputError

if TYPE_CHECKING:
    from awiwi_gen.library import Library

KINDS = {"double": "f8", "float": "f4", "int": "i4", "unsigned int": "u4", "unsigned char": "u1"}


def has_tick(library: Library) -> bool:
    """Whether the hand of a library has a tick."""
    return bool(library.manifest.get("tick"))


def require_tick(library: Library) -> None:
    """Raises InputError where the hand has no tick."""
    if not has_tick(library):
        raise InputError(f"{library.manifest['hand']} has no tick; awiwi-gen list says why")


class Struct:
    """One C struct of a library: its members are NumPy arrays, of one element for a single number.

    Assignment writes into the memory of the struct: ``input.q_des = q``. ``pointer`` is what C functions take.
    Raises AttributeError for an unknown member.
    """

    def __init__(self, library: Library, kind: str) -> None:
        ffi = library.ffi
        memory = ffi.new(f"{kind} *")
        buffer = ffi.buffer(memory)
        members = {name: _view(ffi, buffer, field.offset, field.type) for name, field in _fields(ffi, kind)}
        self.__dict__.update(pointer=memory, kind=kind, bytes=buffer, members=members)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["members"][name]
        except KeyError:
            raise AttributeError(f"{self.__dict__['kind']} has no member {name}") from None

    def __setattr__(self, name: str, value: Any) -> None:
        getattr(self, name)[...] = value

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.members]


def _fields(ffi: Any, kind: str) -> list[tuple[str, Any]]:
    """Members of a struct that are numbers or arrays of them: no pointers, and no structs inside it."""
    return [(name, field) for name, field in ffi.typeof(kind).fields if _scalar(field.type) is not None]


def _scalar(kind: Any) -> str | None:
    """The NumPy type of a member's elements; none for what is no number."""
    while kind.kind == "array":
        kind = kind.item
    return KINDS.get(kind.cname)


def _view(ffi: Any, buffer: Any, offset: int, kind: Any) -> Any:
    shape = []
    element = kind
    while element.kind == "array":
        shape.append(element.length)
        element = element.item
    dtype = np.dtype(KINDS[element.cname])
    return np.ndarray(shape or (1,), dtype, buffer, offset)
