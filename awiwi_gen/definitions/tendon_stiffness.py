"""Stiffness of whole tendons over their forces: lever spring and fibre in series (section 4.3, figure 4.7).

As for the spring's other curves, a polynomial goes through samples of the mechanism. The slope and the curvature are its
exact derivatives, so Newton's method on the curve converges.
"""

from typing import Any

from sympy import Expr, Matrix, Rational

from awiwi_gen.definitions import fibre
from awiwi_gen.definitions.interpolation import coefficients, horner
from awiwi_gen.definitions.naming import Derivation, Named
from awiwi_gen.definitions.spring import pose_at
from awiwi_gen.hand.lever import BEYOND, READING_NODES, chebyshev


def tendon_stiffness(elastic: Any, tension: Matrix) -> tuple[Matrix, Matrix, Matrix, list[Expr]]:
    """k [N/m], dk/df [1/m] and d2k/df2 [1/(N m)] of each tendon (m) at its force (m) [N]."""
    derivation = Derivation("k")
    if elastic.limits:
        return _linear(elastic.limits, tension, derivation)
    curves: dict[int, _Curve] = {}
    rows, arguments = [], []
    for force, spring in zip(tension, elastic.springs, strict=True):
        if id(spring) not in curves:
            curves[id(spring)] = _Curve(spring, elastic.fibre, derivation)
        curve = curves[id(spring)]
        rows.append(curve.at(force))
        arguments.append(curve.normalised(force))
    table = Matrix(rows)
    return table[:, 0], table[:, 1], table[:, 2], [BEYOND - _farthest(arguments, derivation)]


def _farthest(arguments: list[Expr], derivation: Derivation) -> Expr:
    """The largest square of the curves' arguments."""
    largest: Expr = Rational(0)
    for x in arguments:
        largest = derivation.name((largest + x**2 + abs(largest - x**2)) / 2)  # the larger of the two
    return largest


def _linear(limits: Any, tension: Matrix, derivation: Derivation) -> tuple[Matrix, Matrix, Matrix, list[Expr]]:
    """For hands without springs: stiffness grows linearly between its limits, from force zero to the largest force."""
    slope = (limits.tendon_stiffness_high - limits.tendon_stiffness_low) / limits.tendon_force
    k = tension.applyfunc(lambda force: limits.tendon_stiffness_low + slope * force)
    count = len(tension)
    arguments = [2 * force / limits.tendon_force - 1 for force in tension]
    return k, Matrix([slope] * count), Matrix([0] * count), [BEYOND - _farthest(arguments, derivation)]


class _Curve:
    """The polynomial of one mechanism; its argument is -1 at the slack end and 1 at the taut end."""

    def __init__(self, spring: Any, strand: Any, derivation: Derivation) -> None:
        def pose(share: Any) -> Any:
            return pose_at(
                spring, Named(f"angle{share}", spring.slack + share * (spring.taut - spring.slack)), derivation
            )

        self.derivation = derivation
        self.slack, self.taut = (pose(Rational(end)).force for end in (0, 1))
        poses = [pose(Rational(share)) for share in chebyshev(READING_NODES)]
        whole = [fibre.stiffness(strand, [p.stiffness]) if strand else p.stiffness for p in poses]
        self.powers = [coefficients([self.normalised(p.force) for p in poses], whole, derivation)]
        for _ in range(2):
            self.powers.append([derivation.name(i * power) for i, power in enumerate(self.powers[-1])][1:])

    def normalised(self, force: Expr) -> Expr:
        """A force scaled linearly to -1 at the slack end and 1 at the taut end."""
        return self.derivation.name((2 * force - self.slack - self.taut) / (self.taut - self.slack))

    def at(self, force: Expr) -> list[Expr]:
        """The polynomial and its first two derivatives by the force."""
        x, scale = self.normalised(force), self.derivation.name(2 / (self.taut - self.slack))
        return [horner(powers, x, self.derivation) * scale**order for order, powers in enumerate(self.powers)]
