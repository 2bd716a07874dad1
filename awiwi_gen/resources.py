"""Where the files that travel with the package are: in the wheel inside it, in a checkout beside it."""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent


def _find(name: str) -> Path:
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


TEMPLATES = _find("templates")
CSRC = _find("csrc")
WEB = PACKAGE / "web"
DEFAULT_HAND = PACKAGE / "hand.toml"
STARTER_HAND = PACKAGE / "starter.toml"
SOURCES = (PACKAGE, TEMPLATES, CSRC)


def gains_beside(path: Path) -> Path:
    """The file of gains that belongs to a hand file without naming it: hand.gains.toml to hand.toml."""
    return path.with_suffix(".gains.toml")
