"""A plot of a log: joints, forces and torques over time, and where the status changes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from awiwi_gen.errors import InputError
from awiwi_gen.writing import whole_file

if TYPE_CHECKING:
    from awiwi_gen.tick.log import Replay

SUFFIXES = (".png", ".svg")


def plotted(path: Path, found: Replay) -> None:
    """Write the plot as PNG or SVG. Raises InputError for another suffix."""
    if path.suffix not in SUFFIXES:
        raise InputError(f"--plot {path}: expected a name that ends with {' or '.join(SUFFIXES)}")
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.figure import Figure

    time = range(found.ticks)
    figure = Figure(figsize=(9, 9), layout="constrained")
    axes = figure.subplots(4, 1, sharex=True)
    axes[0].plot(time, found.telemetry["motion"][:, :, 0], "--", linewidth=0.6, color="grey")
    axes[0].plot(time, found.telemetry["q"], linewidth=0.9)
    axes[0].set_ylabel("joints [rad]\n(dashed: wanted)")
    axes[1].plot(time, found.telemetry["f"], linewidth=0.6)
    axes[1].set_ylabel("tendon forces [N]")
    axes[2].plot(time, found.torque, linewidth=0.6)
    axes[2].set_ylabel("motor torques [N m]")
    axes[3].step(time, found.telemetry["mode"], where="post")
    axes[3].set_yticks(range(5), ["off", "run", "hold", "ramp", "fault"])
    axes[3].set_ylabel("modes of the fingers")
    axes[3].set_xlabel("tick")
    with whole_file(path) as stream:
        figure.savefig(stream, format=path.suffix[1:])
