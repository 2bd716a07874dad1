"""A plot of measurements: the points with the model through them, and what it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from awiwi_gen.errors import InputError
from awiwi_gen.identify.bench import Finding
from awiwi_gen.writing import whole_file

SUFFIXES = (".png", ".svg")


def require_suffix(path: Path) -> None:
    """Raise InputError for a name that is neither of a PNG nor of an SVG."""
    if path.suffix not in SUFFIXES:
        raise InputError(f"--plot {path}: expected a name that ends with {' or '.join(SUFFIXES)}")


def plotted(path: Path, findings: Sequence[Finding]) -> None:
    """Write the plot as PNG or SVG, one column for each finding."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6 * len(findings), 6), layout="constrained")
    axes = figure.subplots(2, len(findings), squeeze=False, height_ratios=(3, 1), sharex="col")
    for (upper, lower), each in zip(axes.T, findings, strict=True):
        order = np.argsort(each.x)
        upper.plot(each.x, each.y, ".", markersize=3, color="grey", label="measured")
        upper.plot(each.x[order], each.fitted[order], linewidth=1.2, label="fitted")
        upper.set_ylabel(each.labels[1])
        upper.legend()
        lower.plot(each.x, each.y - each.fitted, ".", markersize=3, color="grey")
        lower.axhline(0, linewidth=0.8, color="black")
        lower.set_ylabel(f"left [{each.unit}]")
        lower.set_xlabel(each.labels[0])
    with whole_file(path) as stream:
        figure.savefig(stream, format=path.suffix[1:], metadata={"Date": None} if path.suffix == ".svg" else None)
