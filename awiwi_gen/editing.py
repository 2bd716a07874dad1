"""`awiwi-gen init`, `set` and `schema`: a hand file to start from, one number of it changed in its text, and its schema."""

from __future__ import annotations

import json
import re
import shlex
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from awiwi_gen.arguments import Json
from awiwi_gen.errors import InputError, printable, unknown
from awiwi_gen.resources import STARTER_HAND

if TYPE_CHECKING:
    from awiwi_gen.hand.file import HandFile
    from awiwi_gen.hand.parts import Keys


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


def set_(
    key: Annotated[str, typer.Argument(help="A key of the file, such as fingers.index.pulleys[0].radius")],
    value: Annotated[str, typer.Argument(help='Its new value, such as "6.3 mm"')],
    hand: Annotated[Path, typer.Option("--hand", help="Hand file to change.")],
    as_json: Json = False,
) -> int:
    """Change one value of a hand file; comments, order and all other text stay. A hand with faults is not written."""
    from awiwi_gen.hand import Hand
    from awiwi_gen.hand.file import HandFile
    from awiwi_gen.writing import write_whole

    file = HandFile.read(hand)
    text, line, old, new = changed(file, key, value)
    Hand.parse(text, str(hand))
    write_whole(hand, text)
    if as_json:
        print(json.dumps({"file": str(hand), "line": line, "key": key, "old": old, "new": new}))
    else:
        print(printable(f"{hand}:{line} {key}: {old} -> {new}"))
    return 0


def schema(
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; printed if left out.")] = None,
    as_json: Json = False,
) -> int:
    """Write the JSON Schema of hand files, by which editors complete and check keys."""
    from awiwi_gen.hand.schema import json_schema
    from awiwi_gen.writing import write_whole

    text = json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"
    if output is None:
        print(text, end="")
        return 0
    write_whole(output, text)
    if as_json:
        print(json.dumps({"file": str(output)}))
    else:
        print(printable(f"{output}: for an editor, begin the hand file with the line  #:schema {output.name}"))
    return 0


def changed(file: HandFile, key: str, value: str) -> tuple[str, int, str, str]:
    """The text with a new value of a key, the key's line, the old value and the new one as TOML.

    Raises InputError if the text has no such value.
    """
    from awiwi_gen.hand.lines import values_of_keys

    places, keys = values_of_keys(file.text), keys_of(key)
    if keys not in places:
        if file.line(keys) and any(known[: len(keys)] == keys for known in places):
            raise InputError(f"{file.name}: {key} is a table; name one of its keys")
        raise InputError(f"{file.name}: {unknown('key', key, map(written, places), 'see docs/hand_file.md')}")
    raw, place, new = file.text.encode(), places[keys], _as_toml(value)
    text = b"".join((raw[: place.start], new.encode(), raw[place.stop :])).decode()
    return text, file.line(keys) or 1, raw[place].decode(), new


def written(keys: Keys) -> str:
    """Keys as messages and the command line write them: fingers.index.links[0].mass."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")


def keys_of(key: str) -> Keys:
    """The keys of fingers.index.links[0].mass as a tuple."""
    return tuple(int(index) if index else name for name, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", key))


def _as_toml(value: str) -> str:
    """The value as it is, if it is one of TOML on one line, else as a string: "6.3 mm" needs no quotes of its own."""
    try:
        read: dict[str, Any] = tomllib.loads(f"value = {value}")
    except ValueError:
        read = {}
    whole = list(read) == ["value"] and not set(value) & set("\n#")
    return value.strip() if whole else json.dumps(value, ensure_ascii=False)
