"""The value of the polynomial through samples, by Neville's scheme, which needs no coefficients."""

from collections.abc import Sequence

from casadi import SX


def interpolate(nodes: Sequence[SX], values: Sequence[SX], argument: SX) -> SX:
    """Value at the argument of the polynomial through the values at the nodes."""
    row = list(values)
    for order in range(1, len(nodes)):
        for i in range(len(nodes) - order):
            left, right = nodes[i], nodes[i + order]
            row[i] = ((argument - right) * row[i] + (left - argument) * row[i + 1]) / (left - right)
    return row[0]
