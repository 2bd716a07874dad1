"""What commands must know of a hand file to see whether anything is to be done: read back while no file has changed.

Reading the hand itself takes ten times as long: that loads the schema, checks the physics and makes the catalogue.
"""

from __future__ import annotations

import hashlib
import os
import tomllib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from awiwi_gen.cache import Cache, code_digest, key
from awiwi_gen.errors import Fault, OutputError
from awiwi_gen.resources import DEFAULT_HAND, gains_beside

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand


@dataclass(frozen=True)
class Facts:
    """What a hand file without faults says, as plain data.

    ``warnings`` are those about unusual numbers, ``left_out`` has the reasons why kernels are impossible, ``estimates``
    what joints are estimated by, ``certificate`` the digest of the numbers that decide that of the gains, if there are any.
    """

    name: str
    digest: str
    fingers: int
    kernels: tuple[str, ...]
    tick: dict[str, str]
    warnings: tuple[Fault, ...]
    left_out: dict[str, str]
    estimates: dict[str, dict[str, tuple[str, ...]]]
    lines: tuple[str, ...]
    certificate: str | None


def facts(path: Path | None, store: Cache) -> Facts:
    """The facts of a hand file, or of the packaged one. Raises InputError like `Hand.load`, with every fault."""
    file = path or DEFAULT_HAND
    files = (file, gains_beside(file))
    known = key(path, os.path.abspath(file), *map(_content, files), code_digest())
    found = store.get("facts", known)
    if isinstance(found, Facts):
        return found
    from awiwi_gen.hand import Hand

    found = _of(*Hand.review(path))
    # What was read is what the key says: no other file is named, and none has changed meanwhile.
    if not _names_gains(file) and known == key(path, os.path.abspath(file), *map(_content, files), code_digest()):
        with suppress(OutputError):  # a check needs no cache
            store.put("facts", known, found)
    return found


def _of(hand: Hand, warnings: list[Fault]) -> Facts:
    from awiwi_gen.certificates import digest_of
    from awiwi_gen.hand.capability import estimate_lines, estimate_sources, left_out_names
    from awiwi_gen.hand.tick import tick_lines, tick_values
    from awiwi_gen.kernels import catalog

    return Facts(
        hand.name,
        hand.digest(),
        len(hand.fingers),
        tuple(kernel.name for kernel in catalog(hand)),
        tick_values(hand),
        tuple(warnings),
        left_out_names(hand),
        estimate_sources(hand),
        (*estimate_lines(hand), *tick_lines(hand)),
        digest_of(hand) if hand.gains else None,
    )


def _content(file: Path) -> str:
    """A digest of what a file holds; empty where there is none."""
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""
    except OSError:
        return ""


def _names_gains(file: Path) -> bool:
    """Whether a hand file names a file of gains."""
    return isinstance(tomllib.loads(file.read_text(encoding="utf-8-sig")).get("gains"), str)
