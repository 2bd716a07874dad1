"""Motors that pull several tendons: what none can pull, although every single value is valid."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from awiwi_gen.hand.parts import Finger, Keys, Transmission

__all__ = ["across_complaints", "motor_complaints"]

Complaint = tuple[Keys, str]

_LEAST_ARM = 1e-7  # m; a motor with less than this about every joint pulls nothing
_STRETCH = 0.01  # of the largest arm: what strings on one drum, both ways, give way by


def across_complaints(across: Mapping[str, str], gains: bool, units: bool) -> Iterator[Complaint]:
    """What counts motors by tendons, beside motors that pull tendons of several fingers (finger -> motor)."""
    for key, given in ((("gains",), gains), (("spring", "units"), units)):
        if given and across:
            motor = next(iter(across.values()))
            why = f"the motor {motor} pulls tendons of several fingers; expected none, or a motor for each finger"
            yield key, f"count one motor for each tendon, but {why}"


def motor_complaints(finger: Finger, couplings: Sequence[Sequence[Sequence[float]]]) -> Iterator[Complaint]:
    """All faults of a finger's motors, from dh/dq [m/rad] of all its tendons in some poses."""
    for number, tendon in enumerate(finger.tendons):
        keys: Keys = ("tendons", number, "motor")
        if tendon.motor and tendon.spring:
            yield keys, "is at an elastic return string, which no motor pulls; expected motor or spring, not both"
        elif tendon.motor and not tendon.motor.ratio.value:
            yield (*keys, "ratio"), f'= "{tendon.motor.ratio}" moves nothing; expected another number, such as "0.5"'
    numbers = finger.pulled_numbers
    pulled = [[coupling[number] for number in numbers] for coupling in couplings]
    for transmission in finger.transmissions:
        if transmission.ratios:
            keys = ("tendons", numbers[transmission.members[0]], "motor")
            yield from ((keys, message) for message in _transmission(finger, transmission, pulled))


def _transmission(
    finger: Finger, transmission: Transmission, pulled: Sequence[Sequence[Sequence[float]]]
) -> Iterator[str]:
    if not any(ratio.value > 0 for ratio in transmission.ratios):
        yield "has no tendon with a ratio above zero; its length would shrink as they get longer"
        return
    weighted = [
        [[w * arm for arm in coupling[m]] for w, m in zip(transmission.weights, transmission.members, strict=True)]
        for coupling in pulled
    ]
    largest = max(abs(arm) for rows in weighted for row in rows for arm in row)
    if max(abs(arm) for coupling in pulled for arm in transmission.arms(coupling)) < _LEAST_ARM:
        yield "pulls nothing: its tendons cancel one another in every pose"
    elif transmission.two_way:
        sums = [
            (joint, _of_drum(transmission, column)) for rows in weighted for joint, column in _columns(finger, rows)
        ]
        joint, most = max(sums, key=lambda each: abs(each[1]))
        if abs(most) > _STRETCH * largest:
            why = "it winds some tendons up by as much as it lets the others go"
            found = f"the sum of |ratio| times length changes by {most * 1e3:.4g} mm per radian of {joint}"
            yield f"has ratios of both signs, so {why}, but {found}; expected none"


def _columns(finger: Finger, rows: Sequence[Sequence[float]]) -> list[tuple[str, tuple[float, ...]]]:
    return list(zip(finger.joints, zip(*rows, strict=True), strict=True))


def _of_drum(transmission: Transmission, arms: Sequence[float]) -> float:
    """The sum of |ratio| times arm [m/rad], from ratio times arm of every tendon."""
    return sum(arm if weight > 0 else -arm for weight, arm in zip(transmission.weights, arms, strict=True))
