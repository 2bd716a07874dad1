"""Stiffness of whole tendons over their forces: lever spring and fibre in series (section 4.3, figure 4.7).

As for the spring's other curves, a polynomial goes through samples of the mechanism. What it is differentiated to is
exactly its slope, so that who follows the curve by Newton's method follows what is computed.
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
        return _linear(elastic.limits, tension)
    curves: dict[int, _Curve] = {}
    rows, farthest = [], Rational(0)
    for force, spring in zip(tension, elastic.springs, strict=True):
        if id(spring) not in curves:
            curves[id(spring)] = _Curve(spring, elastic.fibre, derivation)
        curve = curves[id(spring)]
        rows.append(curve.at(force))
        place = curve.place(force)
        farthest = derivation.name((farthest + place**2 + abs(farthest - place**2)) / 2)  # the larger of the two
    table = Matrix(rows)
    return table[:, 0], table[:, 1], table[:, 2], [BEYOND - farthest]


def _linear(limits: Any, tension: Matrix) -> tuple[Matrix, Matrix, Matrix, list[Expr]]:
    """Between the limits of stiffness, from no force to the largest: for hands that tell nothing of their springs."""
    slope = (limits.tendon_stiffness_high - limits.tendon_stiffness_low) / limits.tendon_force
    k = tension.applyfunc(lambda force: limits.tendon_stiffness_low + slope * force)
    count = len(tension)
    places = [2 * force / limits.tendon_force - 1 for force in tension]
    farthest = Rational(0)
    for place in places:
        farthest = (farthest + place**2 + abs(farthest - place**2)) / 2
    return k, Matrix([slope] * count), Matrix([0] * count), [BEYOND - farthest]


class _Curve:
    """The polynomial of one mechanism; its argument runs from -1 at the slack end to 1 at the taut one."""

    def __init__(self, spring: Any, strand: Any, derivation: Derivation) -> None:
        def pose(share: Any) -> Any:
            return pose_at(
                spring, Named(f"angle{share}", spring.slack + share * (spring.taut - spring.slack)), derivation
            )

        self.derivation = derivation
        self.slack, self.taut = (pose(Rational(end)).force for end in (0, 1))
        poses = [pose(Rational(share)) for share in chebyshev(READING_NODES)]
        whole = [fibre.stiffness(strand, [p.stiffness]) if strand else p.stiffness for p in poses]
        self.powers = [coefficients([self.place(p.force) for p in poses], whole, derivation)]
        for _ in range(2):
            self.powers.append([derivation.name(i * power) for i, power in enumerate(self.powers[-1])][1:])

    def place(self, force: Expr) -> Expr:
        """Where a force lies between the ends."""
        return self.derivation.name((2 * force - self.slack - self.taut) / (self.taut - self.slack))

    def at(self, force: Expr) -> list[Expr]:
        """The polynomial and its first two derivatives by the force."""
        place, scale = self.place(force), self.derivation.name(2 / (self.taut - self.slack))
        return [horner(powers, place, self.derivation) * scale**order for order, powers in enumerate(self.powers)]
