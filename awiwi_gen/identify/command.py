"""The command ``identify``: from a table of measurements to numbers of a hand file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from awiwi_gen import extras
from awiwi_gen.arguments import GENERATED, Json
from awiwi_gen.errors import InputError, printable


def identify(
    table: Annotated[Path, typer.Argument(help="Table in CSV; its head names columns with units.")],
    hand: Annotated[Path, typer.Option("--hand", help="Hand file that takes the numbers.")],
    tendon: Annotated[int | None, typer.Option("--tendon", help="Only of this tendon, counted from 0.")] = None,
    source: Annotated[str, typer.Option("--source", help="Source of the numbers; the table's name if left out.")] = "",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Hand file to write instead.")] = None,
    plot: Annotated[Path | None, typer.Option("--plot", help="PNG or SVG file for a plot.")] = None,
    params: Annotated[Path | None, typer.Option("--params", help="Also write this file of numbers for C.")] = None,
    generated: Annotated[Path, typer.Option("--generated", help="Directory that reads the file of numbers.")] = GENERATED,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Fit springs, sensors, friction or ripple to measurements, and write the numbers into a hand file."""
    from awiwi_gen.hand import Hand
    from awiwi_gen.hand.file import HandFile
    from awiwi_gen.identify.bench import findings
    from awiwi_gen.identify.hand_text import with_numbers
    from awiwi_gen.identify.plot import plotted, require_suffix
    from awiwi_gen.identify.table import read
    from awiwi_gen.writing import write_whole

    if plot is not None:
        extras.require("--plot", "matplotlib")
        require_suffix(plot)
    file, loaded, target = HandFile.read(hand), Hand.load(hand), output or hand
    try:
        found = findings(loaded, read(table), tendon)
    except InputError as error:
        raise InputError([replace(fault, file=fault.file or str(table)) for fault in error.faults]) from None
    text, changes = with_numbers(file, loaded, found, tendon, source or table.name)
    measured = Hand.parse(text, str(target))
    numbers_of_c = None
    if params is not None:
        from awiwi_gen.parameters import numbers_file
        from awiwi_gen.terminal import require

        numbers_of_c = numbers_file(measured, require(generated, hand), str(generated))
    write_whole(target, text)
    if numbers_of_c is not None and params is not None:
        numbers_of_c.write(params)
    if plot is not None:
        plotted(plot, found)
    if as_json:
        from awiwi_gen.report import print_json

        numbers = [{"key": n.key, "value": n.text, "deviation": n.deviation} for each in found for n in each.numbers]
        left = [
            {"of": each.labels[1], "points": len(each.x), "residual": each.residual, "hysteresis": each.hysteresis,
             "unit": each.unit} for each in found
        ]  # fmt: skip
        changed = [{"key": key, "old": old or None, "new": new} for key, old, new in changes]
        print_json({"file": str(target), "numbers": numbers, "left": left, "changed": changed})
        return 0
    print(printable("\n".join(f"{key}: {old or 'new'} -> {new}" for key, old, new in changes)))
    for each in found:
        for number in each.numbers:
            print(f"{number.key} = {number.text}, standard deviation {number.deviation}")
        about = f", hysteresis {each.hysteresis:.3g} {each.unit}" if each.hysteresis else ""
        print(f"{len(each.x)} points, residual {each.residual:.3g} {each.unit} (rms){about}")
    print(printable(f"{target}: written"))
    return 0
