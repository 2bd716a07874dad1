"""Every program of the gallery runs, with few samples, and draws."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import awiwi_gen

SCRIPTS = sorted((Path(__file__).resolve().parent.parent / "examples/gallery").glob("plot_*.py"))
FEW = re.compile(r"^([A-Z]+) = [\d_.]+  # ([\d_.]+) in tests$", re.MULTILINE)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_program_of_the_gallery_runs_and_draws(script, lib, monkeypatch):
    monkeypatch.setattr(awiwi_gen, "build", lambda hand: lib)
    shown = []
    monkeypatch.setattr(
        plt, "show", lambda: shown.extend(axes for n in plt.get_fignums() for axes in plt.figure(n).axes)
    )
    plt.switch_backend("agg")
    text, fewer = FEW.subn(r"\1 = \2", script.read_text(encoding="utf-8"))
    try:
        exec(compile(text, script, "exec"), {"__name__": "__main__"})  # noqa: S102 our own program
    finally:
        plt.close("all")

    assert fewer == 1
    assert shown
    assert all(axes.get_xlabel() or axes.get_ylabel() for axes in shown)


def test_the_gallery_has_the_seven_subjects():
    assert [script.stem.split("_", 2)[2] for script in SCRIPTS] == [
        "fall", "batch", "workspace", "tendon_forces", "closed_loop", "identification", "tuning",
    ]  # fmt: skip
