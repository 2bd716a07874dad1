"""A hand file, and the same with another value."""

from __future__ import annotations

from pathlib import Path

from commands import ONE_FINGER

from awiwi_gen.editing import changed
from awiwi_gen.hand.file import HandFile

TEXT = Path(ONE_FINGER).read_text(encoding="utf-8")
RADIUS = "fingers.jaw.pulleys[0].radius"


def edited(text: str, key: str, value: str) -> str:
    return changed(HandFile.parse(text, "hand.toml"), key, value)[0]
