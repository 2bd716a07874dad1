"""Figures 3.3 to 3.6 and 4.7 hold for the Awiwi hand's actuators, and say so when they do not."""

from __future__ import annotations

import pytest
from actuators import compiled, hand_text

from awiwi_gen.hand import Hand
from awiwi_gen.reproduce.figures.actuation import figures


@pytest.fixture(scope="module")
def shown():
    return {figure.number: figure for figure in figures(compiled(), Hand.parse(hand_text()))}


def test_every_figure_is_there_and_its_claim_holds(shown):
    assert list(shown) == ["3.3", "3.4", "3.5", "3.6", "4.7"]
    assert [figure.number for figure in shown.values() if not figure.holds] == []


def test_a_timid_compensation_does_not_pass_for_one(shown):
    change = ('compensation = "0.9"', 'compensation = "0.3"')
    timid = {f.number: f for f in figures(compiled(change), Hand.parse(hand_text(change)))}

    assert not timid["3.6"].holds
    assert timid["3.4"].holds
    assert "70% is left" in timid["3.6"].found


def test_a_hand_without_ripple_or_spring_has_fewer_figures():
    text = hand_text()
    smooth = text[: text.index("[[motor.ripple]]")]
    hand = Hand.parse(smooth)
    assert [figure.number for figure in figures(compiled(), hand)] == ["3.3"]
    assert figures(None, Hand.parse(text.split("[motor]")[0])) == []


def test_figures_can_be_drawn(shown):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    for figure in shown.values():
        canvas, axes = pyplot.subplots()
        figure.draw(axes)
        assert axes.get_lines()
        assert axes.get_xlabel()
        pyplot.close(canvas)
