"""The command ``diff``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from awiwi_gen.arguments import Json
from awiwi_gen.errors import InputError, unknown


def diff(
    old: Annotated[str, typer.Argument(help="Hand file, or with --hand a revision; HEAD if left out.")] = "",
    new: Annotated[str, typer.Argument(help="Hand file, or with --hand a revision; else the file as it is.")] = "",
    hand: Annotated[Path | None, typer.Option("--hand", help="Hand file whose revisions are compared.")] = None,
    finger: Annotated[list[str] | None, typer.Option("--finger", help="Figures of this finger, changed or not.")] = None,
    all_: Annotated[bool, typer.Option("--all", help="Figures of all fingers, and those that stay.")] = False,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="SVG file: the new hand over the old one.")] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print Markdown for a change request.")] = False,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Say what an edit of the hand file does to the physics: two hand files, or two revisions of one that git keeps."""
    from awiwi_gen.diff.difference import difference
    from awiwi_gen.diff.hands import both
    from awiwi_gen.diff.text import print_markdown, print_terminal
    from awiwi_gen.drawing import drawing
    from awiwi_gen.pipeline import Job
    from awiwi_gen.report import Progress, print_json
    from awiwi_gen.writing import write_whole

    (old_name, before), (new_name, after) = both(old, new, hand)
    common = [name for name in after.fingers if name in before.fingers]
    for name in finger or ():
        if name not in common:
            known = f"both hands have {', '.join(common)}" if common else "the hands have no finger in common"
            raise unknown("finger", name, common, known)
    if as_json and markdown:
        raise InputError("--json and --markdown are two forms; leave one of them out")
    jobs = [Job(each, progress=Progress()) for each in (before, after)]
    wanted = common if all_ else finger
    found = difference(jobs[0], jobs[1], (old_name, new_name), wanted)
    if output is not None:
        write_whole(output, drawing(after, before))
    if as_json:
        print_json(found.as_dict())
    else:
        (print_markdown if markdown else print_terminal)(found, bool(wanted))
    return 0
