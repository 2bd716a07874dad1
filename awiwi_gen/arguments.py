"""Options that several commands share: their types, names and help."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from awiwi_gen.errors import AwiwiError
from awiwi_gen.resources import CSRC


class Scalar(StrEnum):
    """Scalar type of the generated C."""

    f64 = "f64"
    f32 = "f32"


class Params(StrEnum):
    """Where the hand's numbers are: constants in the code, or fields of a struct."""

    baked = "baked"
    runtime = "runtime"


class Math(StrEnum):
    """Whose sine, arcus tangent and exponential function the C calls."""

    own = "own"
    libm = "libm"


HandFile = Annotated[Path | None, typer.Option("--hand", help="Hand file; the Awiwi hand if left out.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="Directory of the generated C.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]
Only = Annotated[
    str,
    typer.Option("--only", metavar="GLOB", help="Only kernels whose name matches; commas separate several patterns."),
]
ScalarOption = Annotated[Scalar, typer.Option("--scalar", help="Scalar type of the C.")]
MathOption = Annotated[Math, typer.Option("--math", help="Own sine, arcus tangent, ..., or the C library's.")]
ParamsOption = Annotated[Params, typer.Option("--params", help="Numbers as constants or in a struct.")]
GENERATED = Path("generated")
PAGE = Path("build/report/index.html")


def kernel_names(incomplete: str) -> list[str]:
    """What a shell offers for a kernel's name: those of `generated/`; nothing where there is no such directory."""
    from awiwi_gen.emit.tree import read_manifest

    try:
        manifest = read_manifest(GENERATED) or {"kernels": []}
    except AwiwiError:
        return []
    return [kernel["name"] for kernel in manifest["kernels"] if kernel["name"].startswith(incomplete)]


KernelName = Annotated[str, typer.Argument(help="Name of a kernel, see list.", autocompletion=kernel_names)]


def show_version(wanted: bool) -> None:
    """Print the version of the generator and that of the C interface, and end."""
    if wanted:
        from importlib import metadata

        header = (CSRC / "awiwi_version.h").read_text(encoding="utf-8")
        numbers = re.findall(r"define AWIWI_API_(?:MAJOR|MINOR|PATCH) (\d+)", header)
        print(f"awiwi-gen {metadata.version('awiwi_gen')}, C interface {'.'.join(numbers)}")
        raise typer.Exit


Version = Annotated[
    bool,
    typer.Option(
        "--version", callback=show_version, is_eager=True, help="Show the versions of generator and C interface."
    ),
]
