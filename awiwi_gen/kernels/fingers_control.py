"""What a finger's tendons can do for its joints: their stiffness, and their forces for a torque and a stiffness."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

from awiwi_gen.hand import Finger, Hand
from awiwi_gen.hand.lever import Lever
from awiwi_gen.hand.parts import Tendon
from awiwi_gen.kernel import Kernel, Port, Solver
from awiwi_gen.kernels.declare import Family
from awiwi_gen.kernels.fingers import force_range, per_finger
from awiwi_gen.models import tendon_stiffness as curves
from awiwi_gen.models import tendon_stiffness_neville as curves_neville
from awiwi_gen.units import N, m, one

SEARCHES, INVERSIONS = 3 * 97, 66  # evaluations of the curve in the worst case, see csrc/awiwi_distribution.h


# -- stiffness of the tendons -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Elastic:
    """What makes a finger's tendons elastic: springs and fibres of the hand, or limits where it tells of no springs.

    `tendons` are the finger's, counted through the hand.
    """

    hand: Any
    tendons: range

    @property
    def springs(self) -> list[Any]:
        """The mechanism of every tendon."""
        own = self.hand.spring.calibrated
        return [own.get(tendon, self.hand.spring) for tendon in self.tendons]

    @property
    def fibre(self) -> Any:
        """The fibre, or None."""
        return self.hand.tendon

    @property
    def limits(self) -> Any:
        """The hand's limits if it has no springs, else None."""
        return None if self.hand.spring else self.hand.limits

    def quantities(self) -> dict[str, Any]:
        """The hand's numbers."""
        found: dict[str, Any] = self.hand.quantities()
        return found

    def symbolic(self, leaf: Any) -> Elastic:
        """The same with `leaf(path, quantity)` in the place of each number."""
        return replace(self, hand=self.hand.symbolic(leaf))

    def structure(self) -> dict[str, Any]:
        """All that is not a number."""
        spring = self.hand.spring
        own = [tendon if spring and tendon in spring.calibrated else None for tendon in self.tendons]
        return {"spring": spring and spring.structure(), "fibre": bool(self.fibre), "own springs of tendons": own}

    def range(self) -> tuple[float, float]:
        """Forces [N] between which the stiffness of every tendon is known."""
        if self.limits:
            return 0.0, float(self.limits.tendon_force)
        levers = [Lever(spring) for spring in self.springs]
        ends = [(lever.at(lever.slack).force, lever.at(lever.taut).force) for lever in levers]
        return max(slack for slack, _ in ends), min(taut for _, taut in ends)


of_elastic: Family[int] = Family()  # sized by the number of tendons


def elastic_kernels(hand: Hand, name: str, finger: Finger) -> list[Kernel]:
    """The kernels of a finger's tendons."""
    rows, _ = hand.blocks[name]
    elastic = Elastic(hand, range(rows.start, rows.stop))
    ports = {"tension": Port((len(finger.tendons),), N, *force_range(hand))}
    return of_elastic.kernels(name, elastic, "", elastic.structure(), ports, len(finger.tendons))


@of_elastic(
    lambda tendons: {
        "k": Port((tendons,), N / m), "slope": Port((tendons,), one / m), "curvature": Port((tendons,), one / (N * m)),
    },
    "figure 4.7, section 4.3",
    witness=curves_neville.tendon_stiffness,
    guards=("every tension is on its spring's curve, give or take a hundredth",),
)  # fmt: skip
def tendon_stiffness(elastic: Any, tension: Any) -> Any:
    """Stiffness of every tendon that is pulled with a tension: spring and fibre in series, and its derivatives.

    slope and curvature are dk/df and d2k/df2.
    """
    return curves.tendon_stiffness(elastic, tension)


# -- forces for a torque and a stiffness --------------------------------------------------------------------


def senses(finger: Finger, tendon: Tendon) -> Counter[str]:
    """How often, and in which sense, a tendon rolls on the pulleys of each independent joint."""
    found: Counter[str] = Counter()
    for over in tendon.over:
        found[finger.leaders.get(over[1:], over[1:])] += 1 if over[0] == "+" else -1
    return Counter({joint: count for joint, count in found.items() if count})


def moved(finger: Finger, tendon: Tendon) -> set[str]:
    """The independent joints that a tendon pulls."""
    order = [link.joint for link in finger.links]
    spanned = order[: order.index(tendon.span.joint)] if tendon.span else []
    return {finger.leaders.get(joint, joint) for joint in spanned} | set(senses(finger, tendon))


def groups(finger: Finger) -> list[list[int]]:
    """The tendons, those that share joints together."""
    found: list[tuple[set[str], list[int]]] = []
    for i, tendon in enumerate(finger.tendons):
        joints, members = moved(finger, tendon), [i]
        for other in [group for group in found if group[0] & joints]:
            found.remove(other)
            joints, members = joints | other[0], other[1] + members
        found.append((joints, members))
    return [sorted(members) for _, members in found]


def antagonists(finger: Finger, group: list[int]) -> list[tuple[int, int]]:
    """A group as one or two pairs of opposite couplings that are independent of each other; none if it is not that."""
    left, pairs = list(group), []
    while left:
        first = left.pop(0)
        own = senses(finger, finger.tendons[first])
        second = next((i for i in left if _opposite(own, senses(finger, finger.tendons[i]))), None)
        if second is None or not own or any(finger.tendons[i].span for i in (first, second)):
            return []
        left.remove(second)
        pairs.append((first, second))
    if len(pairs) == 2:
        a, b = (senses(finger, finger.tendons[first]) for first, _ in pairs)
        if all(a[x] * b[y] == a[y] * b[x] for x in {*a, *b} for y in {*a, *b}):
            return []
    return pairs if len(pairs) <= 2 else []


def _opposite(a: Counter[str], b: Counter[str]) -> bool:
    return all(a[joint] == -b[joint] for joint in {*a, *b})


def distribution(finger: Finger) -> Solver:
    """Formulas for the tendons that are antagonistic pairs, a search for the others."""
    pairs: list[tuple[int, int, int]] = []
    searched: list[int] = []
    for group in groups(finger):
        found, first = antagonists(finger, group), len(pairs)
        pairs += [(a, b, first + (len(found) - 1 - i)) for i, (a, b) in enumerate(found)]
        searched += [] if found else group
    bent = any(tendon.span for tendon in finger.tendons)
    return Solver(
        template="tendon_distribution.c.j2",
        problem="distribution",
        uses=("coupling", "tendon_stiffness", *(["coupling_derivative"] if bent else [])),
        equations=tuple(range(len(finger.tendons))),
        unknowns=tuple(range(len(finger.joints))),
        arrays={},
        strings={
            "pairs": ", ".join(f"{{{a}, {b}, {partner}}}" for a, b, partner in pairs),
            "pair_count": str(len(pairs)),
            "searched": ", ".join(map(str, searched)),
            "searched_count": str(len(searched)),
        },
        iterations=(INVERSIONS if pairs else 0) + (SEARCHES if searched else 0),
        tolerance={"f64": 1e-11, "f32": 1e-4},
        once=("coupling", "coupling_derivative"),
    )


@per_finger(lambda z: {"f": Port((z.tendons,), N)}, "eq. 7.2, 7.6, mended", solver=distribution)
def tendon_distribution(finger: Any, q: Any, tau: Any, K: Any, f_min: Any, f_max: Any) -> Any:
    """Tendon forces from f_min to f_max that give the joint torque tau and come nearest to the joint stiffness K.

    The torque is exact where the limits allow it, else the nearest (AWIWI_INFEASIBLE). The stiffness is the nearest
    of all with that torque, by the sum of the squares of the errors of all entries (the squared Frobenius norm).
    """
