"""The polynomial through samples of a smooth function, by Newton's divided differences, in powers of its argument.

Samples may be named expressions. The coefficients are then formulas too, and constants once the hand's numbers are bound.
"""

from collections.abc import Sequence

from sympy import Expr, S

from awiwi_gen.definitions.naming import Derivation


def coefficients(nodes: Sequence[Expr], values: Sequence[Expr], derivation: Derivation) -> list[Expr]:
    """Coefficients, constant first, of the polynomial through the values at the nodes."""
    differences = list(values)
    for order in range(1, len(nodes)):
        for i in range(len(nodes) - 1, order - 1, -1):
            rise = differences[i] - differences[i - 1]
            differences[i] = derivation.name(rise / (nodes[i] - nodes[i - order]))
    powers = [differences[-1]]
    for node, difference in zip(reversed(nodes[:-1]), reversed(differences[:-1]), strict=True):
        shifted, scaled = [S.Zero, *powers], [node * power for power in powers] + [S.Zero]
        powers = [derivation.name(a - b) for a, b in zip(shifted, scaled, strict=True)]
        powers[0] = derivation.name(powers[0] + difference)
    return powers


def horner(powers: Sequence[Expr], argument: Expr, derivation: Derivation) -> Expr:
    """Value of a polynomial with the given coefficients, constant first."""
    value = powers[-1]
    for power in reversed(powers[:-1]):
        value = derivation.name(value * argument + power)
    return value
