"""The plot of a study as SVG."""

from __future__ import annotations

from pathlib import Path

from awiwi_gen.study.base import Report
from awiwi_gen.writing import whole_file


def draw_to(path: Path, report: Report) -> None:
    """Write the plot. The same results give the same bytes."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.figure import Figure

    with matplotlib.rc_context({"svg.hashsalt": "awiwi_gen"}):
        figure = Figure(figsize=(11, 7), layout="constrained")
        report.draw(figure)
        with whole_file(path) as stream:
            figure.savefig(stream, format="svg", metadata={"Date": None})
