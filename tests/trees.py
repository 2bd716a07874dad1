"""What tests of generated directories share: small ones, what is in them, and what lies beside them."""

from __future__ import annotations

from pathlib import Path

from awiwi_gen.emit.exchange import MANIFEST
from awiwi_gen.emit.tree import sealed, sha256

INPUTS = {"hand": "h1", "generator": "g1", "libraries": "sympy 1"}
MANY = 12  # files: enough for a kill to come between two of them


def version(name: str, count: int = 3, inputs: dict[str, str] = INPUTS) -> dict[str, str]:
    """A whole generated directory as texts; every file says which version it is of."""
    files = {f"kernel{i}.c": f"/* {name} */\n" + "x" * 1000 for i in range(count)}
    manifest = {"inputs": inputs, "files": {file: sha256(text) for file, text in files.items()}}
    return {**files, MANIFEST: sealed(manifest)}


def contents(directory: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in directory.iterdir()}


def litter(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.parent.iterdir() if path != directory)
