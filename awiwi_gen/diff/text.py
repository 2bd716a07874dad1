"""A difference as tables: of at most 80 columns for a terminal, or in Markdown for a change request."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

from awiwi_gen.diff.difference import Difference, Effect
from awiwi_gen.diff.kernels import OutputChange
from awiwi_gen.errors import printable
from awiwi_gen.report import counted
from awiwi_gen.tables import print_table

WIDTH = 80
STRONGEST = 3  # numbers of each figure in the tornado
TIGHTEST = 10  # lengths in the list for the workshop
GAP = 2  # columns between two cells
ABSENT = "-"


@dataclass(frozen=True)
class Section:
    """A table with a title above and notes below; without rows, title and notes only.

    A line that is too long loses letters in other columns than ``whole``.
    """

    title: str
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    notes: Sequence[str] = ()
    whole: int | None = None


def print_terminal(found: Difference, everything: bool) -> None:
    """Print the tables as plain text."""
    for number, section in enumerate(sections(found, everything)):
        if number:
            print()
        if section.rows:
            print_table(section.columns, _fitted(section), section.title)
        else:
            print(printable(section.title))
        for note in section.notes:
            print("\n".join(wrap(printable(note), WIDTH, subsequent_indent="  ", break_on_hyphens=False)))


def print_markdown(found: Difference, everything: bool) -> None:
    """Print the tables as Markdown."""
    for section in sections(found, everything):
        print(printable(f"### {section.title}\n"))
        if section.rows:
            table = [section.columns, ["---"] * len(section.columns), *section.rows]
            lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in table]
            print(printable("\n".join(lines) + "\n"))
        for note in section.notes:
            print(printable(f"{note}\n"))


def sections(found: Difference, everything: bool) -> Iterator[Section]:
    """The tables of a difference; with ``everything``, those figures too that stay as they are."""
    yield _values(found)
    for finger, where in found.only.items():
        yield Section(f"finger {finger}: only in {where}")
    for finger in found.fingers:
        shown = [each for each in found.figures if each.finger == finger and (everything or not each.same)]
        rows = [(each.name, each.unit, *_change(each.old, each.new)) for each in shown]
        yield Section(f"finger {finger}" + ("" if rows else ": no figure changes"), ("figure", "unit", *CHANGE), rows)
    yield _outputs(found, everything)
    if costs := [each for each in found.kernels if each.operations[0] != each.operations[1]]:
        yield Section(
            "operations that change", ("kernel", *CHANGE), [(each.name, *_change(*each.operations)) for each in costs]
        )
    yield from _present(found)
    for finger in found.fingers:
        names = [each.name for each in found.figures if each.finger == finger and (everything or not each.same)]
        if (section := _tornado(found, finger, [name for name in names if not _is_entry(name)])).rows:
            yield section
    if found.effects:
        yield _tightest(found)


CHANGE = ("old", "new", "change")


def _values(found: Difference) -> Section:
    names = f"{found.old} -> {found.new}"
    guesses = f"{len(found.assumed)} of {found.numbers} numbers of {found.new} are guesses"
    if len(found.assumed) != len(found.assumed_before):
        guesses += f", {len(found.assumed_before)} of {found.old} were"
    if not found.values:
        return Section(f"{names}: nothing changes", notes=[guesses])
    rows = [
        (
            each.key,
            each.old or ABSENT,
            each.new or ABSENT,
            "" if each.relative is None else _percent(100 * each.relative),
            "guess" if each.assumed else "",
        )
        for each in found.values
        if not any(each.key.startswith(f"fingers.{finger}.") for finger in found.only)
    ]
    return Section(f"{names}: {counted(len(found.values), 'value')}", ("key", *CHANGE, ""), rows, [guesses])


def _outputs(found: Difference, everything: bool) -> Section:
    """The worst change of each output; below, the inputs of the worst of all, or of each, as `awiwi-gen call` takes them."""
    changes = [output for each in found.kernels for output in each.outputs]
    rows = [_output_row(each) for each in changes]
    worst = sorted(changes, key=lambda each: -each.relative)[:1]
    notes = [f"at {_inputs(each)}" for each in (changes if everything else worst)]
    same = "other code, same outputs"
    notes += _by_reason({each.name: each.note or same for each in found.kernels if each.note or not each.outputs})
    title = f"kernels: {len(found.kernels)} of {found.kernel_count} change"
    title += "; worst of each output, in % of its largest value" if rows else ""
    return Section(title, ("kernel", "output", *CHANGE), rows, notes)


def _output_row(each: OutputChange) -> tuple[str, ...]:
    sign = 1 if each.new >= each.old else -1
    return each.kernel, each.output, _number(each.old), _number(each.new), _percent(100 * sign * each.relative)


def _inputs(each: OutputChange) -> str:
    texts = (f"{name}={','.join(f'{x:.3g}' for x in values)}" for name, values in each.inputs.items())
    return f"{each.kernel} {' '.join(texts)}"


def _by_reason(reasons: Mapping[str, str]) -> list[str]:
    """A line for each reason, with the names that it holds for."""
    return [
        f"{reason}: {', '.join(name for name, why in reasons.items() if why == reason)}"
        for reason in dict.fromkeys(reasons.values())
    ]


def _present(found: Difference) -> Iterator[Section]:
    for verb, absent in (("appear", found.appear), ("vanish", found.vanish)):
        if absent:
            hand = found.old if verb == "appear" else found.new
            yield Section(f"{counted(len(absent), 'kernel')} that {verb}; what {hand} lacks", notes=_by_reason(absent))


def _tornado(found: Difference, finger: str, names: Sequence[str]) -> Section:
    """The numbers that matter most for figures of a finger; entries of P follow from torques."""
    rows = []
    for name in names:
        effects = [each for each in found.effects if (each.finger, each.figure) == (finger, name) and each.part]
        for rank, each in enumerate(effects[:STRONGEST]):
            number = each.number.removeprefix(f"fingers.{finger}.")
            step = "" if each.step is None else f"{each.step:+.2g} {each.unit}"
            rows.append(("" if rank else name, number, _percent(each.part or 0.0), step, _guess(each)))
    columns = ("figure", "number", "per 1 %", "per 10 um", "")
    return Section(f"finger {finger}: the numbers that matter most for each figure", columns, rows, whole=0)


def _tightest(found: Difference) -> Section:
    """The lengths that have to be made most exactly, each with the figure that it moves most."""
    worst: dict[str, Effect] = {}
    for each in sorted(found.effects, key=lambda each: -abs(each.step_part or 0.0)):
        if each.step_part and not _is_entry(each.figure):
            worst.setdefault(each.number, each)
    rows = [
        (each.number, each.figure, _percent(each.step_part or 0.0), _guess(each))
        for each in list(worst.values())[:TIGHTEST]
    ]
    title = "for the workshop: the lengths of which 10 um matter most, and for what"
    return Section(title, ("length", "figure", "per 10 um", ""), rows)


def _is_entry(figure: str) -> bool:
    return figure.startswith("P[")


def _guess(each: Effect) -> str:
    return "guess" if each.assumed else ""


def _change(old: float | None, new: float | None) -> tuple[str, str, str]:
    percent = _percent(100 * (new / old - 1)) if old and new is not None else ""
    return _number(old), _number(new), percent


def _number(value: float | None) -> str:
    return ABSENT if value is None else f"{value:.6g}"


def _percent(value: float) -> str:
    return f"{value:+.3g} %"


def _fitted(section: Section) -> list[list[str]]:
    """The rows, their widest columns shortened until a line has at most 80 characters."""
    rows = [[*row] for row in section.rows]
    widths = [max(map(len, column)) for column in zip(section.columns, *rows, strict=True)]
    others = [index for index in range(len(widths)) if index != section.whole]
    while (excess := sum(widths) + GAP * (len(widths) - 1) - WIDTH) > 0:
        second, widest = sorted(others, key=widths.__getitem__)[-2:]
        widths[widest] = max(widths[widest] - excess, min(widths[second], widths[widest] - 1))
    return [[_short(cell, width) for cell, width in zip(row, widths, strict=True)] for row in rows]


def _short(text: str, width: int) -> str:
    """The text, or as much of it as fits, without its middle."""
    if len(text) <= width:
        return text
    kept = max(width - 2, 2)
    return f"{text[: kept // 2]}..{text[len(text) - (kept - kept // 2) :]}"
