"""The report of what one format says and the other cannot hold."""

from __future__ import annotations

from collections.abc import Iterable

from awiwi_gen.interchange.model import Loss

_SHOWN = 3


def loss_lines(losses: Iterable[Loss]) -> list[str]:
    """One line for each loss: how many places, what is lost, and the first of the places."""
    rows = []
    for loss in losses:
        named = [place for place in loss.places if place]
        more = ", ..." if len(named) > _SHOWN else ""
        where = f" ({', '.join(named[:_SHOWN])}{more})" if named else ""
        rows.append(f"{len(loss.places):5d}  {loss.what}{where}")
    return ["not held:", *rows] if rows else ["nothing is lost"]
