"""Stiffness of a finger's tendons, and their forces for a joint torque and a joint stiffness."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from awiwi_gen.hand import Finger, Hand
from awiwi_gen.hand.capability import left_out
from awiwi_gen.hand.lever import Lever
from awiwi_gen.hand.parts import Tendon
from awiwi_gen.kernel import Kernel, Port, Solver
from awiwi_gen.kernels.declare import Family
from awiwi_gen.kernels.fingers import force_range, input_ports, per_finger
from awiwi_gen.kernels.sizes import Size
from awiwi_gen.structure import geared, groups, is_curved, senses
from awiwi_gen.units import N, m, one

UPDATES = 2 + 4  # evaluations of the curve by an update in the worst case, see csrc/awiwi_distribution.h
SEARCHES, INVERSIONS = 2 + 4 * 97, 66  # evaluations of the curve in the worst case, see csrc/awiwi_distribution.h


# -- stiffness of the tendons -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Elastic:
    """The elastic elements of a finger's tendons: springs and fibres of the hand, or its limits if it has no springs.

    `tendons` are the indices of these tendons in the hand.
    """

    hand: Any
    tendons: Sequence[int]

    @property
    def springs(self) -> list[Any]:
        """The spring mechanism of every tendon."""
        calibrated = self.hand.spring.calibrated
        return [calibrated.get(tendon, self.hand.spring) for tendon in self.tendons]

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
        """A copy with `leaf(path, quantity)` instead of each number."""
        return replace(self, hand=self.hand.symbolic(leaf))

    def structure(self) -> dict[str, Any]:
        """Everything but the numbers."""
        spring = self.hand.spring
        calibrated = [tendon if spring and tendon in spring.calibrated else None for tendon in self.tendons]
        return {
            "spring": spring and spring.structure(),
            "fibre": bool(self.fibre),
            "calibrated tendons": calibrated,
        }

    def range(self) -> tuple[float, float]:
        """Range of forces [N] that every tendon's curve covers."""
        if self.limits:
            return 0.0, float(self.limits.tendon_force)
        levers = [Lever(spring) for spring in self.springs]
        ends = [(lever.at(lever.slack).force, lever.at(lever.taut).force) for lever in levers]
        return max(slack for slack, _ in ends), min(taut for _, taut in ends)


of_elastic: Family[int] = Family("tendon_stiffness")  # sized by the number of tendons


def elastic_kernels(hand: Hand, name: str, finger: Finger) -> list[Kernel]:
    """The kernels of a finger's tendons, and those of the tendons in no pair alone, if the force distribution has both."""
    rows, _ = hand.blocks[name]
    chosen = {name: [*range(rows.start, rows.stop)]}
    pairs, searched = by_pairs_and_search(finger)
    if pairs and searched and (f"fingers.{name}", "tendon_distribution") not in left_out(hand):
        chosen[f"{name}_searched"] = [rows.start + i for i in searched]
    found = []
    for prefix, tendons in chosen.items():
        elastic, ports = Elastic(hand, tendons), {"tension": Port((len(tendons),), N, *force_range(hand))}
        found += of_elastic.kernels(prefix, elastic, "", elastic.structure(), ports, len(tendons))
    return found


@of_elastic(
    lambda tendons: {
        "k": Port((tendons,), N / m), "slope": Port((tendons,), one / m), "curvature": Port((tendons,), one / (N * m)),
    },
    "figure 4.7, section 4.3",
    guards=("every tension is on its spring's curve, with a margin of 0.4 %",),
)  # fmt: skip
def tendon_stiffness(elastic: Any, tension: Any) -> Any:
    """Stiffness of every tendon at its tension, spring and fibre in series, and its derivatives.

    slope and curvature are dk/df and d2k/df2.
    """


# -- forces for a torque and a stiffness --------------------------------------------------------------------


def antagonists(finger: Finger, group: list[int]) -> list[tuple[int, int]]:
    """A group as one or two independent pairs of tendons with opposite couplings; empty if it is not such a group."""
    motors = [finger.transmissions[i] for i in group]
    if any(motor.ratios for motor in motors):
        return []
    tendons = {i: motor.tendons[0] for i, motor in zip(group, motors, strict=True)}
    rest, pairs = list(group), []
    while rest:
        first = rest.pop(0)
        signs = senses(finger, tendons[first])
        second = next((i for i in rest if _opposite(signs, senses(finger, tendons[i]))), None)
        pair = [tendons[i] for i in (first, second) if i is not None]
        if second is None or not signs or not all(_counts(finger, tendon) for tendon in pair):
            return []
        rest.remove(second)
        pairs.append((first, second))
    if len(pairs) == 2:
        a, b = (senses(finger, tendons[first]) for first, _ in pairs)
        if all(a[x] * b[y] == a[y] * b[x] for x in {*a, *b} for y in {*a, *b}):
            return []
    return pairs if len(pairs) <= 2 else []


def _counts(finger: Finger, tendon: Tendon) -> bool:
    """Whether a tendon's coupling follows from its `senses`: from pulleys of leaders, and of joints that roll on these."""
    return not (geared(finger, tendon) or tendon.span or tendon.path or tendon.arms)


def _opposite(a: Counter[str], b: Counter[str]) -> bool:
    return all(a[joint] == -b[joint] for joint in {*a, *b})


def by_pairs_and_search(finger: Finger) -> tuple[list[tuple[int, int, int]], list[int]]:
    """The antagonistic pairs of a finger (first, second, number of the partner), and all other tendons."""
    pairs: list[tuple[int, int, int]] = []
    searched: list[int] = []
    for group in groups(finger):
        found, first = antagonists(finger, group), len(pairs)
        pairs += [(a, b, first + (len(found) - 1 - i)) for i, (a, b) in enumerate(found)]
        searched += [] if found else group
    return pairs, sorted(searched)


def distribution_update(finger: Finger) -> Solver:
    """The same with a search of few steps, from the last forces."""
    solver = distribution(finger)
    calls = {family: UPDATES if count == SEARCHES else count for family, count in solver.calls.items()}
    return replace(
        solver,
        problem="distribution update",
        strings={**solver.strings, "last": "f_last_in"},
        iterations=solver.iterations - SEARCHES + UPDATES,
        calls=calls,
        tolerance={"f64": 2e-8, "f32": solver.tolerance["f32"]},
        stop={"f64": "1e-8", "f32": solver.stop["f32"]},
    )


def distribution(finger: Finger) -> Solver:
    """Closed forms for antagonistic pairs of tendons, a search for all others."""
    pairs, searched = by_pairs_and_search(finger)
    both = bool(pairs and searched)
    return Solver(
        template="tendon_distribution.c.j2",
        problem="distribution",
        uses=(
            "coupling",
            "tendon_stiffness",
            *(["searched_tendon_stiffness"] if both else []),
            *(["coupling_derivative"] if is_curved(finger) else []),
        ),
        equations=tuple(range(len(finger.transmissions))),
        unknowns=tuple(range(len(finger.joints))),
        arrays={},
        strings={
            "pairs": ", ".join(f"{{{a}, {b}, {partner}}}" for a, b, partner in pairs),
            "pair_count": str(len(pairs)),
            "searched": ", ".join(map(str, searched)),
            "searched_count": str(len(searched)),
            "last": "",
        },
        iterations=(INVERSIONS if pairs else 0) + (SEARCHES if searched else 0),
        tolerance={"f64": 1e-11, "f32": 1e-4},
        calls={
            "coupling": 1,
            "coupling_derivative": 1,
            **({"tendon_stiffness": INVERSIONS, "searched_tendon_stiffness": SEARCHES} if both else {}),
        },
        pairs=tuple(pairs),
    )


@per_finger(lambda z: {"f": Port((z.tendons,), N)}, "eq. 7.2, 7.6, mended", solver=distribution)
def tendon_distribution(finger: Any, q: Any, tau: Any, K: Any, f_min: Any, f_max: Any) -> Any:
    """Tendon forces from f_min to f_max for the joint torque tau and the nearest possible joint stiffness to K.

    The torque is exact if the limits allow it, otherwise the nearest possible one (status AWIWI_INFEASIBLE). Of all
    forces with that torque, the result has the least error of the stiffness in the Frobenius norm: of pairs surely, of
    others as far as a search from four starts finds it.
    """


of_search: Family[Size] = Family()


def search_kernels(hand: Hand, name: str, finger: Finger) -> list[Kernel]:
    """The kernels of fingers with tendons in no pair, if these can choose their forces."""
    path, size = f"fingers.{name}", Size.of(finger)
    if not by_pairs_and_search(finger)[1] or (path, "tendon_distribution") in left_out(hand):
        return []
    return of_search.kernels(name, finger, path, finger.structure(), input_ports(hand, finger, size), size)


@of_search(lambda z: {"f": Port((z.tendons,), N)}, "eq. 7.2, 7.6, mended", solver=distribution_update)
def tendon_distribution_update(finger: Any, q: Any, tau: Any, K: Any, f_min: Any, f_max: Any, f_last: Any) -> Any:
    """Tendon forces as those of the distribution, in bounded time, for a demand that changes little from tick to tick.

    The search begins at the forces f_last and takes few steps: where they do not suffice, the status is
    AWIWI_NOT_CONVERGED, and the next update goes on from the result. The torque comes first. It does not look for
    nearer minima of the stiffness' error elsewhere.
    """
