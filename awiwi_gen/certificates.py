"""Certificates of a hand's gains: what their law bears on wrong plants, kept by the digest of all numbers it depends on.

`awiwi-gen tune` and `awiwi-gen generate` make them. They are kept in the cache, and that of a packaged hand in a file
beside its gains. Reading one compiles nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from awiwi_gen.cache import Cache, key

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand

VERSION = 2  # raise it where the laws, the clock test, the simulator or the family of plants change
SUFFIX = ".certificate.json"
Row = dict[str, Any]


def digest_of(hand: Hand) -> str:
    """The digest of all numbers that decide what a certificate says."""
    parts = [hand.motor, hand.spring, hand.clock, *hand.fingers.values(), *hand.gains]
    return key(VERSION, *(part.digest() for part in parts if part is not None))


def kept_certificate(digest: str, store: Cache, beside: Path | None = None) -> list[Row] | None:
    """The rows of the certificate of these numbers that is kept in the cache or in a file of the folder ``beside``."""
    for found in _certificates([store.read("certificates", digest), *_texts(beside)]):
        if found.get("digest") == digest:
            rows: list[Row] = found["joints"]
            return rows
    return None


def kept_rows(beside: Path | None) -> dict[str, Row]:
    """Rows of all certificates in a folder, by the digest of their joint: those that another hand may share."""
    return {row["digest"]: row for found in _certificates(_texts(beside)) for row in found["joints"] if "digest" in row}


def _texts(beside: Path | None) -> Iterator[bytes]:
    for file in sorted(beside.glob(f"*{SUFFIX}")) if beside is not None else []:
        if file.is_file():
            yield file.read_bytes()


def _certificates(texts: Iterable[bytes | None]) -> Iterator[dict[str, Any]]:
    for text in texts:
        try:
            found = json.loads(text) if text else None
        except ValueError:
            continue
        if isinstance(found, dict) and isinstance(found.get("joints"), list):
            yield found


def certificate_text(hand: Hand, rows: list[Row]) -> str:
    """The certificate as a file."""
    return json.dumps({"digest": digest_of(hand), "joints": rows}, indent=1) + "\n"


def certificate_lines(digest: str | None, store: Cache, beside: Path | None) -> Iterator[str]:
    """What `check` says of the gains of a hand, by the digest of the numbers that decide; None for a hand without."""
    if digest is None:
        return
    rows = kept_certificate(digest, store, beside)
    if rows is None:
        yield "gains: no certificate is kept for these numbers; awiwi-gen generate makes one"
        return
    radius, cycle = (max(rows, key=itemgetter(name)) for name in ("radius", "cycle"))
    margin = min(rows, key=itemgetter("margin"))
    yield (
        f"gains: certified on {rows[0]['plants']} plants of each of {len({row['joint'] for row in rows})} joints: spectral "
        f"radius at most {radius['radius']:.4f} ({radius['joint']}; {radius['at']['radius']}),"
    )
    yield f"  delay margin at least {margin['margin'] * 1e6:.0f} us ({margin['joint']}; {margin['at']['margin']}),"
    yield f"  limit cycle at most {cycle['cycle'] * 1e3:.2f} mrad ({cycle['joint']}; {cycle['at']['cycle']})"
