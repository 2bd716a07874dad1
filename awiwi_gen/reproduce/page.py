"""The report page: figures with claims and verdicts, printed numbers beside ours, the proof of every kernel."""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from awiwi_gen.diff.figures import POSES
from awiwi_gen.emit.files import render
from awiwi_gen.hand import Hand
from awiwi_gen.report import COLUMNS, proof_rows
from awiwi_gen.reproduce.figures import all_figures, in_order
from awiwi_gen.reproduce.figures.absent import ABSENT
from awiwi_gen.reproduce.printed import all_numbers
from awiwi_gen.reproduce.this_hand import ThisHand, this_hand
from awiwi_gen.results import Figure, Printed, Table, Verdict
from awiwi_gen.web import Live, script, style

if TYPE_CHECKING:
    from awiwi_gen.pipeline import Job, Proof

SIZE = (6.4, 3.9)  # inches
STYLE = {
    "svg.fonttype": "path", "font.size": 9.0, "axes.grid": True, "grid.alpha": 0.3, "grid.linewidth": 0.5,
    "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
}  # fmt: skip
UNIT = r"(?:[munkM]?(?:m|N|s|g|rad|Hz|J|W|V|A)|deg|%|turn)(?:\^[\d/]+)?"
UNITS = re.compile(rf"(?<=[\d)]) {UNIT}(?:(?: |/\(?){UNIT}\)?)*(?!\w)")  # behind a number
FIRST_OF_PART_II = 7  # chapter
COUNTED: dict[Verdict, str] = {
    "agrees": "agree",
    "misprint": "are misprints",
    "not reproducible": "cannot be reproduced",
}
PARTS = {"Modelling": range(FIRST_OF_PART_II), "Control": range(FIRST_OF_PART_II, 100)}


@dataclass(frozen=True)
class Results:
    """Everything on the page of a hand."""

    figures: Sequence[Figure]
    numbers: Sequence[Printed]
    proof: Proof
    compared: Sequence[Table] = ()
    hand: ThisHand = field(default_factory=ThisHand)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        shown = [
            {"number": f.number, "title": f.title, "claim": f.claim, "found": f.found, "holds": bool(f.holds)}
            for f in self.figures
        ]
        return {
            "hand": self.hand.as_dict(),
            "figures": shown,
            "numbers": [vars(number) for number in self.numbers],
            "compared": [vars(table) for table in self.compared],
        }


Comparison = Callable[[Any, Hand], tuple[list[Figure], list[Table]]]


def publish(job: Job, path: Path, comparison: Comparison) -> Results:
    """Compute figures and numbers of a hand, verify its kernels, write the page.

    ``comparison`` gives the figures and tables of compared laws. The source's figures and numbers are those of the packaged
    hand, and no other hand has them.
    """
    from awiwi_gen.build import load
    from awiwi_gen.pipeline import cached_tree, verify

    directory = cached_tree(job)
    library = load(directory, job.store)
    proof, hand = verify(job, directory), this_hand(job, directory, library.manifest)
    compared_figures, tables = comparison(library, job.hand)
    results = Results([], [], proof, tables, hand)
    if job.hand.digest() == Hand.load().digest():
        figures = in_order([*all_figures(library, job.hand), *compared_figures])
        results = replace(results, figures=figures, numbers=all_numbers(library, job.hand))
    write_page(path, job.hand, results, library.manifest)
    return results


def write_page(path: Path, hand: Hand, results: Results, manifest: Mapping[str, Any]) -> None:
    """Write one self-contained HTML file; the same bytes for the same results."""
    kernels = {entry["name"]: chapter(entry["source"]) for entry in manifest["kernels"]}
    rows = proof_rows(results.proof.verdicts, manifest)
    parts = [
        {
            "name": name,
            "anchor": name.lower(),
            "figures": [_shown(figure) for figure in results.figures if chapter(figure.number) in chapters],
            "kernels": _escaped(row for row in rows if kernels[row[0]] in chapters),
        }
        for name, chapters in PARTS.items()
    ]
    page = render(
        "report.html.j2",
        hand=escape(hand.name),
        digest=hand.digest(),
        proofs=escape(proofs(results)),
        claims=escape(claims(results)),
        style=style(),
        script=script(),
        live=results.hand.live if isinstance(results.hand.live, Live) else None,
        lacking=text_of(results.hand.lacking),
        image=results.hand.image,
        capability=(results.hand.capability[0], _escaped(results.hand.capability[1])),
        workspace=(results.hand.workspace[0], _escaped(results.hand.workspace[1])),
        costs=(results.hand.costs[0], _escaped(results.hand.costs[1])),
        poses=POSES,
        own_numbers=_escaped(results.hand.numbers),
        guesses=results.hand.guesses,
        parts=parts,
        absent=_escaped(ABSENT.items()),
        columns=COLUMNS,
        compared=[{"title": escape(t.title), "columns": t.columns, "rows": _escaped(t.rows)} for t in results.compared],
        numbers=_escaped((n.where, n.printed, n.ours, n.verdict, n.reason) for n in results.numbers),
        laws=_escaped(
            (law.part, law.statement, f"{law.worst:.0e}", "holds" if law.passed else "fails")
            for law in results.proof.laws
        ),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page, encoding="utf-8", newline="\n")


def chapter(reference: str) -> int:
    """The chapter of a figure, an equation or a kernel's source; the last one for what the source lacks."""
    found = re.search(r"\d+", reference)
    return int(found[0]) if found else max(PARTS["Control"])


def summary(results: Results) -> str:
    """Counts of kernels that are proved and, with figures, of claims that hold and numbers that agree."""
    return " ".join(filter(None, (proofs(results), claims(results))))


def proofs(results: Results) -> str:
    """How many kernels are proved."""
    proved = sum(verdict.passed for verdict in results.proof.verdicts)
    return f"{proved} of {len(results.proof.verdicts)} kernels proved."


def claims(results: Results) -> str:
    """How many claims of figures hold, and printed numbers agree; nothing without figures."""
    if not results.figures:
        return ""
    verdicts = Counter(number.verdict for number in results.numbers)
    counts = ", ".join(f"{verdicts[name]} {word}" for name, word in COUNTED.items() if verdicts[name])
    holding = sum(bool(figure.holds) for figure in results.figures)
    held = f"{holding} of {len(results.figures)} claims of figures hold."
    return f"{held} Printed numbers: {counts or 'none compared'}."


def verdict(figure: Figure) -> str:
    """Whether a figure's claim holds, in words."""
    return "holds" if figure.holds else "does not hold"


def _shown(figure: Figure) -> dict[str, str]:
    return {
        "anchor": f"figure-{re.sub(r'[^0-9a-z]+', '-', figure.number.lower()).strip('-')}",
        "number": escape(figure.number),
        "title": escape(figure.title),
        "claim": text_of(figure.claim),
        "found": text_of(figure.found),
        "verdict": verdict(figure),
        "drawing": drawing(figure),
    }


def drawing(figure: Figure) -> str:
    """A figure as SVG text, without date or version."""
    import matplotlib as mpl
    from cycler import cycler
    from matplotlib.figure import Figure as Canvas

    text = io.StringIO()
    # identifiers inside a drawing are made from the salt, and must be unique on the page
    colours = mpl.rcParamsDefault["axes.prop_cycle"]
    cycle = cycler("linestyle", ["-", "--", "-.", ":"]) * colours  # lines beyond ten differ, too
    with mpl.rc_context(STYLE | {"svg.hashsalt": figure.number, "axes.prop_cycle": cycle}):
        canvas = Canvas(figsize=SIZE, layout="constrained")
        figure.draw(canvas.add_subplot())
        canvas.savefig(text, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    drawn = text.getvalue()[text.getvalue().index("<svg") :]
    return drawn.replace("<svg", f'<svg role="img" aria-label="{escape(figure.title)}"', 1)


def _escaped(rows: Iterable[Sequence[str]]) -> list[list[str]]:
    return [[text_of(cell) for cell in row] for row in rows]


def text_of(words: str) -> str:
    """Text of the page, in which no number is parted from its unit."""
    return UNITS.sub(lambda found: found[0].replace(" ", "\N{NO-BREAK SPACE}"), escape(words))
