"""`awiwi-gen init`: a hand file to start from, with comments."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Annotated

import typer

from awiwi_gen.arguments import Json
from awiwi_gen.errors import InputError, printable
from awiwi_gen.resources import STARTER_HAND


def init(
    file: Annotated[Path, typer.Argument(help="Hand file to write.")] = Path("my_hand.toml"),
    as_json: Json = False,
) -> int:
    """Write a hand file to start from: one finger, with a comment for each part. A file that is there stays."""
    try:
        with file.open("x", encoding="utf-8", newline="\n") as target:
            target.write(STARTER_HAND.read_text(encoding="utf-8"))
    except FileExistsError:
        raise InputError(f"{file} is there already; choose another name, or remove it") from None
    if as_json:
        print(json.dumps({"file": str(file)}))
    else:
        check = shlex.join(["awiwi-gen", "check", "--hand", str(file)])
        print(printable(f"{file}: a finger with two joints; change its numbers, then: {check}"))
    return 0
