"""What a study finds: a figure, a printed number beside ours, a table. The report page shows all three."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Any, Literal

Verdict = Literal["agrees", "misprint", "not reproducible"]
CROWDED = 6  # lines of a figure whose legend stands beside it
Draw = Callable[[Any], None]


@dataclass(frozen=True)
class Figure:
    """A figure of the source, computed again. ``draw`` takes Matplotlib axes.

    ``claim`` is what the source concludes from the figure, in our words. ``found`` is what the compiled kernels give, in
    numbers. ``holds`` says whether the claim is true of the same data, for this hand.
    """

    number: str
    title: str
    claim: str
    found: str
    holds: bool
    draw: Draw


@dataclass(frozen=True)
class Table:
    """Columns and rows of text; the last column is a verdict."""

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]


def milliseconds(time: float, digits: int = 0) -> str:
    """A time [s] as text; never, if it is infinite."""
    return f"{time * 1e3:.{digits}f} ms" if time < float("inf") else "never"


@dataclass(frozen=True)
class Printed:
    """A number or formula that the source prints: where, what is printed, what we compute, and why they differ."""

    where: str
    printed: str
    ours: str
    verdict: Verdict
    reason: str


def compared(where: str, printed: str, ours: float, reason: str, otherwise: Verdict = "misprint") -> Printed:
    """A printed number beside ours: "agrees" if the printed digits are the same, else the verdict ``otherwise``."""
    agrees = same_digits(printed, ours)
    return Printed(where, printed, f"{ours:.7g}", "agrees" if agrees else otherwise, reason)


def misprint(where: str, printed: str, ours: str, reason: str) -> Printed:
    """Something that the source prints wrong, and what is right."""
    return Printed(where, printed, ours, "misprint", reason)


def judged(holds: bool, where: str, printed: str, ours: str, reason: str) -> Printed:
    """A statement of the source that agrees with what we compute, or cannot be reproduced."""
    return Printed(where, printed, ours, "agrees" if holds else "not reproducible", reason)


def listed(values: Any, spec: str, separator: str = ", ") -> str:
    """Numbers in one format, as text."""
    return separator.join(f"{value:{spec}}" for value in values)


def same_digits(printed: str, ours: float) -> bool:
    """Whether our value, rounded to the printed digits, is the printed value.

    Trailing zeros of a printed integer count as unknown: "4600" has two digits.
    """
    try:
        number = Decimal(printed)
    except InvalidOperation:
        return False
    last = number.normalize().as_tuple().exponent if number == number.to_integral() else number.as_tuple().exponent
    if not isinstance(last, int) or number == 0:
        return float(number) == ours
    return Decimal(repr(float(ours))).quantize(Decimal(1).scaleb(last)) == number


def curves(x: Any, lines: Any, xlabel: str, ylabel: str, *styles: str, markersize: float = 3, **settings: Any) -> Draw:
    """Draw lines over x, from a mapping of labels to values (or to pairs of x and values), or one unlabelled line.

    ``styles`` are Matplotlib formats such as ":", one for each line; ``settings`` go to ``axes.set``.
    """

    def draw(axes: Any) -> None:
        labelled = isinstance(lines, dict)
        for index, (label, values) in enumerate(lines.items() if labelled else [(None, lines)]):
            style = styles[index] if index < len(styles) else ""
            axes.plot(
                *(values if isinstance(values, tuple) else (x, values)),
                *([style] if style else []),
                linewidth=0.8,
                markersize=markersize,
                label=label,
            )
        axes.set(xlabel=xlabel, ylabel=ylabel, **settings)
        if labelled:
            beside = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)} if len(lines) > CROWDED else {}
            axes.legend(**beside)

    return draw


def shaded(axes: Any, x: Any, lines: Any, numbers: Any, label: str, linewidth: float = 0.6) -> None:
    """Draw one line over x for each row of ``lines``, coloured by a number of its own, with a bar of the colours."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    colours, scale = colormaps["viridis"], Normalize(min(numbers), max(numbers))
    for line, number in zip(lines, numbers, strict=True):
        axes.plot(x, line, "-", linewidth=linewidth, color=colours(scale(number)))
    axes.figure.colorbar(ScalarMappable(scale, colours), ax=axes, label=label)
