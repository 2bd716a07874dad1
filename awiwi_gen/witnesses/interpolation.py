"""The value of the polynomial through samples, by Neville's scheme: it never learns the coefficients."""

from collections.abc import Sequence

from casadi import SX


def interpolate(nodes: Sequence[SX], values: Sequence[SX], argument: SX) -> SX:
    """What the polynomial that takes the values at the nodes is at the argument."""
    row = list(values)
    for order in range(1, len(nodes)):
        for i in range(len(nodes) - order):
            left, right = nodes[i], nodes[i + order]
            row[i] = ((argument - right) * row[i] + (left - argument) * row[i + 1]) / (left - right)
    return row[0]
