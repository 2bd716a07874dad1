"""What a hand's tendons can do, and which kernels cannot exist because of what they cannot do.

Tendons only pull: the torques -P' f of forces f >= 0 form a cone. Lengths tell the joint angles where P = dh/dq has as
many independent columns as there are joints, or where springs of joints tell the rest. A torque of any direction needs
the cone to be the whole space. Only tendons with motors count, and those of one motor count as one. Return strings pull
with a force of their own that no controller changes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from awiwi_gen.hand.parts import Finger
from awiwi_gen.hand.pose import Chain
from awiwi_gen.structure import independent, resting_parts, rests_in_a_bend

if TYPE_CHECKING:
    from awiwi_gen.hand import Hand

__all__ = ["estimate_lines", "estimate_sources", "left_out", "left_out_names"]

# Kernel families of a finger that need tendons at all.
_NEED_TENDONS = ("tendon_lengths", "coupling", "coupling_derivative", "joint_torque", "joint_stiffness",
                 "joint_torque_and_stiffness")  # fmt: skip
# Kernel families of a finger that need tendon lengths to tell the joint angles, and tendons that can give any torque.
_NEED_LENGTHS = ("joint_estimate", "joint_estimate_error")
_NEED_TORQUES = ("tendon_distribution",)
_NEED_SPANS = ("base_estimate_by_gradient",)
_TWO_WAY = "a motor of the finger pulls both ways, and the stiffness of its tendons follows from their pretension"
_RANK = 1e-7  # a singular value below this share of the largest is zero; central differences are good to 1e-10
_TURN = 1e-4  # rad or m, of differences of arms
_FIRM = 1e-3  # least stiffness of what springs hold, as a share of the largest
_RESIDUAL = 1e-7  # likewise for the part of a torque that no forces give


def left_out(hand: Hand) -> dict[tuple[str, str], str]:
    """(path of a part, kernel family) -> why this kernel cannot exist for the hand; empty for most hands."""
    found = {
        (f"fingers.{name}", family): reason
        for name, finger in hand.fingers.items()
        for family, reason in _of_finger(finger)
    }
    without = [name for name, finger in hand.fingers.items() if not finger.pulled]
    driven = ("tendon_stiffness", *(["measured_lengths"] if hand.motor else []))
    found |= {("", f"{name}_{family}"): _none(hand.fingers[name]) for name in without for family in driven}
    two_way = [name for name, finger in hand.fingers.items() if any(each.two_way for each in finger.transmissions)]
    found |= {("", f"{name}_tendon_stiffness"): _TWO_WAY for name in two_way}
    for name, motor in hand.across.items():
        why = f"the motor {motor} pulls tendons of several fingers, whose forces"
        found[f"fingers.{name}", "tendon_distribution"] = f"{why} no finger can choose alone"
        if hand.motor:
            found["", f"{name}_measured_lengths"] = (
                f"the motor {motor} tells the sum of lengths in several fingers only"
            )
    if not hand.tendons:
        found |= dict.fromkeys(_of_all_tendons(hand), "no motor pulls a tendon of this hand")
    return found


def _of_all_tendons(hand: Hand) -> list[tuple[str, str]]:
    """(Path of a part, kernel family) of every kernel with an array over the tendons of the whole hand."""
    found = [("", f"hand_{family}") for family in ("tendon_lengths", "coupling", "joint_torque", "joint_stiffness")]
    found += [("wrist", f"wrist_{family}") for family in ("tendon_lengths", "coupling") if hand.wrist]
    return found + [("spring", f"calibration_{family}") for family in ("readings", "tensions") if hand.spring]


def left_out_names(hand: Hand) -> dict[str, str]:
    """The same by the name that the kernel would have."""
    return {"_".join([*path.split(".")[1:], family]): reason for (path, family), reason in left_out(hand).items()}


@lru_cache(maxsize=64)
def _of_finger(finger: Finger) -> tuple[tuple[str, str], ...]:
    """(Kernel family, reason) for every kernel that no pose of the finger allows."""
    if not finger.pulled:
        return tuple((family, _none(finger)) for family in (*_NEED_TENDONS, *_NEED_LENGTHS, *_NEED_TORQUES))
    couplings = of_motors(finger, Chain(finger).couplings())
    first = next(couplings)
    # What one pose allows is no longer in question; most fingers need no second one.
    return _reasons(finger, [first]) and _reasons(finger, [first, *couplings])


def of_motors(finger: Finger, couplings: Iterable[list[list[float]]]) -> Iterator[list[list[float]]]:
    """The coupling of the motors [m/rad], a row for each, from that of all tendons of the file, in some poses."""
    for coupling in couplings:
        pulled = [coupling[number] for number in finger.pulled_numbers]
        yield [transmission.arms(pulled) for transmission in finger.transmissions]


def _reasons(finger: Finger, couplings: Sequence[Any]) -> tuple[tuple[str, str], ...]:
    """(Kernel family, reason) for every kernel that none of the couplings of some poses allows."""
    found: list[tuple[str, str]] = []
    lengths = _indistinct(couplings, finger.joints)
    one_sided = _one_sided(couplings, finger.joints)
    both_ways = any(transmission.two_way for transmission in finger.transmissions)
    torques = "; ".join(filter(None, (lengths, one_sided))) or _beyond_pull(couplings, finger.joints)
    torques = _TWO_WAY if both_ways else torques
    if torques and finger.strings and not both_ways:
        torques += "; return strings do not count, for no motor pulls them"
    torques = _mixed(finger) or torques
    unknown = _unknown_angles(finger, couplings)
    found += [(family, reason) for family in _NEED_LENGTHS for reason in unknown]
    if rests_in_a_bend(finger):
        found += [("resting_balance", reason) for reason in unknown]
    found += [(family, torques) for family in _NEED_TORQUES if torques]
    if not any(transmission.ratios for transmission in finger.transmissions):
        found += [(family, reason) for family in _NEED_SPANS for reason in _indistinct_base(finger, couplings)]
    return tuple(found)


def _mixed(finger: Finger) -> str:
    """That the stiffnesses of a finger's joints have no common measure, because some slide; empty if none does."""
    slide = next((joint for joint in finger.joints if joint in finger.sliding), "")
    return f"the joint {slide} slides: its stiffness has another unit than that of a hinge" if slide else ""


def _unknown_angles(finger: Finger, couplings: Sequence[Any]) -> list[str]:
    """Why tendon lengths do not tell the angles of the joints without sensors, if so."""
    free = [column for column in range(len(finger.joints)) if column not in finger.measured]
    columns = [[[row[column] for column in free] for row in coupling] for coupling in couplings]
    reason = _indistinct(columns, [finger.joints[column] for column in free])
    without = " without sensors" if finger.measured else ""
    if not reason or not (springs := _no_rest(finger)):
        return []
    return [f"{reason}: tendon lengths do not determine the joint angles{without}{springs if springs != ' ' else ''}"]


def estimate_sources(hand: Hand) -> dict[str, dict[str, tuple[str, ...]]]:
    """Kernel -> what gives its equations besides tendon lengths, for which joints; those by lengths alone are not in it."""
    absent = left_out(hand)
    found = {
        f"{name}_joint_estimate": _sources(finger)
        for name, finger in hand.fingers.items()
        if (f"fingers.{name}", "joint_estimate") not in absent
    }
    return {kernel: sources for kernel, sources in found.items() if sources}


def estimate_lines(hand: Hand) -> list[str]:
    """The same as lines of text."""
    return [
        f"estimate: {kernel}: by tendon lengths"
        + "".join(f" and {source} of {', '.join(joints)}" for source, joints in sources.items())
        for kernel, sources in estimate_sources(hand).items()
    ]


def _sources(finger: Finger) -> dict[str, tuple[str, ...]]:
    resting = [joint for part, _ in resting_parts(finger) for joint in part]
    found = {"sensors": finger.measured, "springs": resting}
    return {source: tuple(finger.joints[j] for j in joints) for source, joints in found.items() if joints}


def _no_rest(finger: Finger) -> str:
    """Why springs do not tell the angles that lengths leave open; empty if they do, blank if there are none."""
    import numpy as np

    if not finger.strings and not any(link.spring for link in finger.links):
        return " "
    chain = Chain(finger)
    couplings = [chain.coupling(q) for q in chain.poses()]
    pulled = list(of_motors(finger, couplings))
    stiffnesses = [_spring_stiffness(chain, q, coupling) for q, coupling in zip(chain.poses(), couplings, strict=True)]
    for joints, tendons in resting_parts(finger):
        names, firm = ", ".join(finger.joints[j] for j in joints), []
        tendons = tendons if rests_in_a_bend(finger) else independent(finger, tendons)[0]
        for coupling, stiffness in zip(pulled, stiffnesses, strict=True):
            arms = _scaled(np.array(coupling).reshape(-1, len(finger.joints))[np.ix_(tendons, joints)])
            if np.linalg.matrix_rank(arms, _RANK) == len(tendons) or not tendons:
                kept = np.linalg.svd(arms)[2][len(tendons) :] if tendons else np.eye(len(joints))
                held = np.linalg.eigvalsh(kept @ stiffness[np.ix_(joints, joints)] @ kept.T)
                firm.append(held.min() > _FIRM * stiffness.max(initial=1e-300))
        if not firm:
            return f", and springs do not either where tendons that move {names} depend on one another"
        if not all(firm):
            return f", nor do springs: in some pose they do not hold {names}"
    return "" if resting_parts(finger) else " "


def _spring_stiffness(chain: Chain, q: Sequence[float], coupling: Sequence[Sequence[float]]) -> Any:
    """Stiffness (n x n) at q of the springs of a finger's joints, and of its return strings that are taut there."""
    import numpy as np

    finger = chain.finger
    found = np.zeros((len(finger.joints), len(finger.joints)))
    for link in finger.links:
        if link.spring is not None:
            column, slope = chain.slope(link.joint, q)
            found[column, column] += float(link.spring.stiffness) * slope**2
    for number, tendon in enumerate(finger.tendons):
        if tendon.spring is not None and (stretch := chain.length(number, q) - float(tendon.spring.rest)) > 0:
            bends = np.array([_turned(chain, number, q, column) for column in range(len(q))])
            arms = np.outer(coupling[number], coupling[number])
            found += float(tendon.spring.stiffness) * (arms + stretch * (bends + bends.T) / 2)
    return found


def _turned(chain: Chain, number: int, q: Sequence[float], column: int) -> list[float]:
    """How a tendon's arms change with one joint, by central differences."""
    ends = [[x + way * _TURN * (j == column) for j, x in enumerate(q)] for way in (-1, 1)]
    before, after = (chain.coupling(end)[number] for end in ends)
    return [(b - a) / (2 * _TURN) for a, b in zip(before, after, strict=True)]


def _none(finger: Finger) -> str:
    """That a finger has no tendons with motors."""
    return "no motor pulls the finger: it has return strings only" if finger.strings else "the finger has no tendons"


def _indistinct_base(finger: Finger, couplings: Sequence[Any]) -> list[str]:
    """Why the straight spans of a finger that could have a tensegrity base do not tell its base joints apart, if so."""
    order = [link.joint for link in finger.links]
    rows = [row for row, tendon in enumerate(finger.pulled) if tendon.span]
    ends = [order.index(tendon.span.joint) for tendon in finger.pulled if tendon.span]
    base = {finger.leaders.get(joint, joint) for joint in order[: max(ends, default=0)]}
    columns = [column for column, joint in enumerate(finger.joints) if joint in base]
    spans = [[[coupling[row][column] for column in columns] for row in rows] for coupling in couplings]
    if not len(rows) >= len(columns) > 0:
        return []
    if slide := next((finger.joints[column] for column in columns if finger.joints[column] in finger.sliding), ""):
        return [f"the joint {slide} slides: a gradient search has no step for lengths beside angles"]
    reason = _indistinct(spans, [finger.joints[column] for column in columns])
    return [f"of the spans alone, {reason}"] if reason else []


def _indistinct(couplings: Sequence[Any], joints: Sequence[str]) -> str:
    """Why the tendons do not tell the joints apart in any of the poses; empty if they do."""
    import numpy as np

    best = 0
    for coupling in couplings:
        best = max(best, int(np.linalg.matrix_rank(_scaled(coupling), _RANK)))
        if best == len(joints):
            return ""
    return f"the tendons move only {best} of the {len(joints)} joints {', '.join(joints)} independently"


def _one_sided(couplings: Sequence[Any], joints: Sequence[str]) -> str:
    """Which joints are pulled to one side only in all of the poses, and to which side nothing pulls; empty if none."""
    import numpy as np

    arms: Any = np.array([_scaled(coupling) for coupling in couplings])
    lengthens, shortens = (arms > _RANK).any(axis=(0, 1)), (arms < -_RANK).any(axis=(0, 1))
    missing = [
        f"{'-' if pulled_up else '+'}{joint}"
        for joint, pulled_up, pulled_down in zip(joints, shortens, lengthens, strict=True)
        if pulled_up != pulled_down
    ]
    return f"tendons only pull, and none pulls towards {' and '.join(missing)}" if missing else ""


def _beyond_pull(couplings: Sequence[Any], joints: Sequence[str]) -> str:
    """Which torques the tendons cannot pull in any of the poses, all joints being moved; empty if they can."""
    torque: Any = None
    for coupling in couplings:
        torque = _unreachable(_scaled(coupling))
        if torque is None:
            return ""
    largest = max(abs(torque))
    signs = [f"{'+' if each > 0 else '-'}{joint}" for joint, each in zip(joints, torque, strict=True)
             if abs(each) > 0.1 * largest]  # fmt: skip
    return f"tendons only pull, and no forces give a torque towards {' and '.join(signs)}"


def _scaled(coupling: Any) -> Any:
    """The coupling with rows of equal length: a tendon's direction does not depend on its radii."""
    import numpy as np

    matrix = np.array(coupling, dtype=float)
    return matrix / np.maximum(np.linalg.norm(matrix, axis=1, keepdims=True), 1e-12)


def _unreachable(coupling: Any) -> Any:
    """A direction of torque that no forces f >= 0 give as -P' f, or None if there is none.

    The cone of the columns a of -P' is a linear space just if it has minus their sum. Where it has not, what is left
    of that after the best forces (non-negative least squares, by Lawson and Hanson) is a torque out of reach.
    """
    import numpy as np

    pulls = -coupling.T
    wanted = -pulls.sum(axis=1)
    forces = np.zeros(pulls.shape[1])
    active = np.zeros(len(forces), dtype=bool)
    rest = wanted
    for _ in range(3 * len(forces)):
        gain = np.where(active, 0.0, pulls.T @ rest)
        if max(gain, default=0.0) <= _RESIDUAL:
            break
        active[int(gain.argmax())] = True
        while True:
            found = np.zeros(len(forces))
            found[active] = np.linalg.lstsq(pulls[:, active], wanted, rcond=None)[0]
            negative = active & (found <= 0)
            if not negative.any():
                break
            share = min(forces[negative] / (forces[negative] - found[negative]))
            forces = forces + share * (found - forces)
            active &= forces > 1e-12
        forces, rest = found, wanted - pulls @ found
    return rest if np.linalg.norm(rest) > _RESIDUAL else None
