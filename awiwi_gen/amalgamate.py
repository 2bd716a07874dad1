"""All C of a generated directory as one header and one C file, for projects that prefer to add two files.

Names that are local to a C file (static functions and objects, types, enumerators) would collide in one file. They get
the name of their file in front: ``cost`` of least_squares.c becomes ``least_squares_cost``. Macros that a C file defines
are undefined after it.
"""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path

from awiwi_gen.errors import InputError, OutputError
from awiwi_gen.resources import CSRC

BANNER = "/* All kernels in one file, made by awiwi-gen amalgamate; do not edit. */\n"
# clang reports inline functions that are not used only outside of headers, where they stood.
QUIET = '#ifdef __clang__\n#pragma clang diagnostic ignored "-Wunused-function"\n#endif\n'
HEADER, SOURCE = "awiwi.h", "awiwi.c"
PUBLIC = (HEADER, "hand.h", "params.h", "self_test.h")  # what the one header holds
INCLUDE = re.compile(r'^#include "([^"]+)"\n', re.M)
SKIPPED = r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"'
TOKEN = re.compile(rf"{SKIPPED}|(?P<access>\.|->)?\b(?P<name>[A-Za-z_]\w*)", re.S)
STATIC = re.compile(r"^static\b[^;{=(\[]*?(\w+)\s*[(\[=;]", re.M)
TYPE = re.compile(
    r"^(?:typedef )?(?:struct|enum|union) (\w+) \{|^\} (\w+);|^typedef [^;{([]*?(\w+)[;[]|^typedef [^;{]*\(\*(\w+)\)",
    re.M,
)
ENUMERATORS = re.compile(r"^(?:typedef )?enum(?: \w+)? \{([^}]*)\}", re.M)
STRUCT = re.compile(r"struct \w* ?\{([^}]*)\}")
MACRO = re.compile(r"^#define (\w+)", re.M)


def amalgamate(directory: Path) -> dict[str, str]:
    """The texts of awiwi.h and awiwi.c. Raises InputError where the directory holds no generated C."""
    folders = (directory, CSRC)
    files = {p.name: p.read_text(encoding="utf-8") for folder in folders for p in sorted(folder.glob("*.[ch]"))}
    if "kernels.h" not in files:
        raise InputError(f"{directory} has no kernels.h; expected a generated directory, see awiwi-gen generate")
    sources = {name: text for name, text in files.items() if name.endswith(".c")}
    public = list(dict.fromkeys(h for name in PUBLIC if name in files for h in _ordered(name, files)))
    private = [name for text in sources.values() for name in _ordered_includes(text, files)]
    bodies = [body for name in {*public, *private} for body in STRUCT.findall(files[name])]
    members = {match["name"] for body in bodies for match in TOKEN.finditer(body)}
    parts = [BANNER, f'#include "{HEADER}"\n', QUIET]
    parts += [_without_includes(files[name]) for name in dict.fromkeys(private) if name not in public]
    for name, text in sources.items():
        parts.append(f"/* {name} */\n" + _renamed(_without_includes(text), Path(name).stem, members))
        parts.append("".join(f"#undef {macro}\n" for macro in dict.fromkeys(MACRO.findall(text))))
    return {HEADER: BANNER + "\n".join(_without_includes(files[n]) for n in public), SOURCE: "\n".join(parts)}


def write(directory: Path, output: Path) -> list[Path]:
    """Write both files into a folder, each whole or not at all.

    Raises OutputError rather than replace a file that this function did not write.
    """
    texts = amalgamate(directory)
    targets = [output / name for name in texts]
    for path in targets:
        if path.exists() and not path.read_text(encoding="utf-8", errors="replace").startswith(BANNER):
            raise OutputError(f"{path} exists and is no amalgamation; choose another folder with -o")
    output.mkdir(parents=True, exist_ok=True)
    for path, text in zip(targets, texts.values(), strict=True):
        with tempfile.NamedTemporaryFile("w", dir=output, encoding="utf-8", newline="\n", delete=False) as partial:
            partial.write(text)
        os.chmod(partial.name, 0o644)
        os.replace(partial.name, path)
    return targets


def run(directory: Path, output: Path, as_json: bool) -> None:
    """Write both files and print their names: what the command does."""
    files = [str(path) for path in write(directory, output)]
    print(json.dumps({"files": files}) if as_json else "\n".join(files))


def _ordered(name: str, files: Mapping[str, str]) -> list[str]:
    """A file after all that it includes."""
    return [*_ordered_includes(files[name], files), name]


def _ordered_includes(text: str, files: Mapping[str, str]) -> list[str]:
    found = [other for name in INCLUDE.findall(text) if name in files for other in _ordered(name, files)]
    return list(dict.fromkeys(found))


def _without_includes(text: str) -> str:
    return INCLUDE.sub("", text)


def _local_names(text: str) -> set[str]:
    """Identifiers with file scope that a C file does not export."""
    bare = re.sub(SKIPPED, "", text, flags=re.S)
    types = {name for groups in TYPE.findall(bare) for name in groups if name}
    constants = {name for body in ENUMERATORS.findall(bare) for name in re.findall(r"(?:^|,)\s*(\w+)", body)}
    return {*STATIC.findall(bare), *types, *constants}


def _renamed(text: str, prefix: str, members: set[str]) -> str:
    """A C file with its local names prefixed; comments and strings stay, and so do members of structs in headers."""
    own = _local_names(text)

    def rename(match: re.Match[str]) -> str:
        access, name = match["access"] or "", match["name"]
        return match[0] if name not in own or (access and name in members) else f"{access}{prefix}_{name}"

    return TOKEN.sub(rename, text)
