"""`awiwi-gen show`: the hand in a drawing."""

from __future__ import annotations

import json
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from awiwi_gen.arguments import HandFile, Json
from awiwi_gen.errors import printable


def show(
    hand: HandFile = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="SVG file to write.")] = Path("hand.svg"),
    open_: Annotated[bool, typer.Option("--open", help="Open the drawing in a browser.")] = False,
    as_json: Json = False,
) -> int:
    """Draw the hand: links in the middle of their ranges and at both ends, joints, pulleys, tendons, wrist."""
    from awiwi_gen.drawing import drawing
    from awiwi_gen.hand import Hand
    from awiwi_gen.report import counted
    from awiwi_gen.writing import write_whole

    drawn = Hand.load(hand)
    write_whole(output, drawing(drawn))
    joints = sum(len(finger.links) for finger in drawn.fingers.values())
    tendons = sum(len(finger.tendons) for finger in drawn.fingers.values())
    if as_json:
        print(json.dumps({"file": str(output), "fingers": list(drawn.fingers), "joints": joints, "tendons": tendons}))
    else:
        counts = [counted(len(drawn.fingers), "finger"), counted(joints, "joint"), counted(tendons, "tendon")]
        print(printable(f"{output}: {', '.join(counts)}"))
    if open_:
        webbrowser.open(output.resolve().as_uri())
    return 0
