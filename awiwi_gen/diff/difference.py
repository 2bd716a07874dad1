"""All that an edit of a hand file changes, as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from awiwi_gen.diff.figures import SHARED, Figure, figures
from awiwi_gen.diff.kernels import KernelChange, absent, changed
from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, derive
from awiwi_gen.units import Quantity, m

PART = 0.01  # the share of a number, and
STEP = 1e-5  # the length [m], whose effects are told
ROUNDING = 1e-12  # of a figure, in its unit or of its value


@dataclass(frozen=True)
class ValueChange:
    """A value of the hand file that is another one, or that only one of the files has; ``assumed`` marks a guess."""

    key: str
    old: str | None
    new: str | None
    relative: float | None
    assumed: bool


@dataclass(frozen=True)
class FigureChange:
    """A figure of a finger in both hands; None where a hand does not have it."""

    finger: str
    name: str
    unit: str
    old: float | None
    new: float | None

    @property
    def same(self) -> bool:
        """Whether nothing changes, but for rounding."""
        if self.old is None or self.new is None:
            return False
        return abs(self.new - self.old) <= ROUNDING * max(abs(self.old), abs(self.new), 1.0)


@dataclass(frozen=True)
class Effect:
    """What a number of the new hand does to a figure.

    ``part`` is the change [%] of the figure, away from zero, for one percent of the number; None where the number is
    zero. For a length ``step`` is that for 10 um, in the figure's unit, and ``step_part`` in percent.
    """

    finger: str
    figure: str
    unit: str
    number: str
    assumed: bool
    part: float | None
    step: float | None
    step_part: float | None


@dataclass(frozen=True)
class Difference:
    """What differs between two hands.

    ``assumed`` are the keys of guesses, ``fingers`` those whose figures were computed, ``only`` those of one hand, with its
    name. ``appear`` and ``vanish`` have kernels with the reason why the other hand has none.
    """

    old: str
    new: str
    values: Sequence[ValueChange]
    assumed_before: Sequence[str]
    assumed: Sequence[str]
    numbers: int
    fingers: Sequence[str]
    only: Mapping[str, str]
    figures: Sequence[FigureChange]
    kernels: Sequence[KernelChange]
    kernel_count: int
    appear: Mapping[str, str]
    vanish: Mapping[str, str]
    effects: Sequence[Effect]

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)


def difference(old: Job, new: Job, names: tuple[str, str], wanted: Sequence[str] | None = None) -> Difference:
    """Compare two hands; figures of the fingers that both have and that change, or of those that are ``wanted``."""
    for job in (old, new):
        derive(job)
    common = [name for name in new.hand.fingers if name in old.hand.fingers]
    values = list(_value_changes(old.hand, new.hand))
    if wanted is None:
        wanted = [name for name in common if any(_moves(each.key, name) for each in values)]
    found: list[FigureChange] = []
    effects: list[Effect] = []
    assumed = new.hand.assumed()
    for finger in wanted:
        before = {each.name: each for each in figures(old, finger)}
        after = {each.name: each for each in figures(new, finger)}
        found += _paired(finger, before, after)
        effects += [each for figure in after.values() for each in _effects(finger, figure, new.hand, assumed)]
    only = {name: names[1] for name in new.hand.fingers if name not in common}
    only |= {name: names[0] for name in old.hand.fingers if name not in common}
    return Difference(
        *names,
        values=values,
        assumed_before=list(old.hand.assumed()),
        assumed=list(assumed),
        numbers=len(new.hand.quantities()),
        fingers=list(wanted),
        only=only,
        figures=found,
        kernels=list(changed(old, new)),
        kernel_count=len(new.catalog),
        appear=absent(old, new),
        vanish=absent(new, old),
        effects=effects,
    )


def _moves(key: str, finger: str) -> bool:
    """Whether figures of a finger depend on a value of the hand file."""
    return key in SHARED or key.startswith(f"fingers.{finger}.")


def _value_changes(old: Hand, new: Hand) -> Iterator[ValueChange]:
    """Values that differ, in the order of the new file, then those that are gone; texts of sources do not count."""
    before, after = _values(old), _values(new)
    guesses = set(old.assumed()) | set(new.assumed())
    for key in [*after, *(key for key in before if key not in after)]:
        was, now = before.get(key), after.get(key)
        if was == now:
            continue
        relative = None
        if isinstance(was, Quantity) and isinstance(now, Quantity) and was.value:
            relative = float(now.value / was.value - 1)
        yield ValueChange(key, _shown(was), _shown(now), relative, key in guesses)


def _shown(value: Any) -> str | None:
    return None if value is None else str(value)


def _values(hand: Hand) -> dict[str, Any]:
    """Numbers and all other values of a hand by their keys, but for sources."""
    found: dict[str, Any] = dict(hand.quantities())
    _collect(hand.symbolic(lambda *_: None).model_dump(by_alias=True), "", found)
    return found


def _collect(node: Any, key: str, found: dict[str, Any]) -> None:
    if isinstance(node, dict):
        for name, each in node.items():
            if name != "source":
                _collect(each, f"{key}.{name}" if key else str(name), found)
    elif isinstance(node, (list, tuple)) and any(isinstance(each, (dict, list, tuple)) for each in node):
        for index, each in enumerate(node):
            _collect(each, f"{key}[{index}]", found)
    elif isinstance(node, (list, tuple)):
        if texts := [str(each) for each in node if each is not None]:
            found[key] = ", ".join(texts)
    elif node is not None:
        found[key] = node


def _paired(finger: str, before: Mapping[str, Figure], after: Mapping[str, Figure]) -> Iterator[FigureChange]:
    for name in [*after, *(name for name in before if name not in after)]:
        was, now = before.get(name), after.get(name)
        unit = (now or before[name]).unit
        yield FigureChange(finger, name, unit, was.value if was else None, now.value if now else None)


def _effects(finger: str, figure: Figure, hand: Hand, assumed: Mapping[str, Any]) -> Iterator[Effect]:
    """The effects of all numbers on a figure, but for a figure that is zero; the strongest for one percent first."""
    if abs(figure.value) <= ROUNDING:
        return
    quantities = hand.quantities()
    found = []
    for path, slope in figure.slopes.items():
        number = quantities[path]
        part = 100 * PART * slope * float(number) / figure.value if number.value else None
        step = slope * STEP if number.unit == m and not number.unit.radians else None
        step_part = None if step is None else 100 * step / figure.value
        found.append(Effect(finger, figure.name, figure.unit, path, path in assumed, part, step, step_part))
    yield from sorted(found, key=lambda each: -abs(each.part or 0.0))
