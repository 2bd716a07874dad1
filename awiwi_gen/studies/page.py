"""All studies on one page: every figure with its claim and whether that holds, and the proof of every kernel."""

from __future__ import annotations

import importlib.util
import io
import pkgutil
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from awiwi_gen import studies
from awiwi_gen.emit.files import render
from awiwi_gen.errors import InputError
from awiwi_gen.hand import Hand
from awiwi_gen.report import COLUMNS, proof_rows
from awiwi_gen.studies.figure import Figure

if TYPE_CHECKING:
    from awiwi_gen.pipeline import Job, Proof

SIZE = (7.0, 4.2)  # inches


def publish(job: Job, path: Path) -> tuple[list[Figure], Proof]:
    """Compute all figures of a hand, verify its kernels, write both. Raises InputError where libraries are missing."""
    from awiwi_gen.build import load
    from awiwi_gen.pipeline import cached_tree, verify

    missing = [name for name in ("matplotlib", "scipy") if importlib.util.find_spec(name) is None]
    if missing:
        raise InputError(f"{' and '.join(missing)} needed for figures; install them: pip install 'awiwi_gen[studies]'")
    directory = cached_tree(job)
    library = load(directory, job.store)
    figures, proof = all_figures(library, job.hand), verify(job, directory)
    write_page(path, job.hand, figures, proof, library.manifest)
    return figures, proof


def all_figures(library: Any, hand: Hand) -> list[Figure]:
    """What every module ``figures_*`` of this package shows of a hand, in the order of the source."""
    names = sorted(module.name for module in pkgutil.iter_modules(studies.__path__))
    modules = [importlib.import_module(f"{studies.__name__}.{name}") for name in names if name.startswith("figures_")]
    return sorted((figure for module in modules for figure in module.figures(library, hand)), key=_place)


def _place(figure: Figure) -> tuple[list[int], str]:
    return [int(digits) for digits in re.findall(r"\d+", figure.number)], figure.number


def write_page(path: Path, hand: Hand, figures: Sequence[Figure], proof: Proof, manifest: Mapping[str, Any]) -> None:
    """Write one HTML file that needs no other; the same bytes for the same results."""
    shown = [
        {
            "anchor": f"figure-{re.sub(r'[^0-9a-z]+', '-', figure.number.lower())}",
            "number": escape(figure.number),
            "title": escape(figure.title),
            "claim": escape(figure.claim),
            "verdict": verdict(figure),
            "drawing": drawing(figure),
        }
        for figure in figures
    ]
    page = render(
        "report.html.j2",
        hand=escape(hand.name),
        digest=hand.digest(),
        figures=shown,
        columns=COLUMNS,
        kernels=_escaped(proof_rows(proof.verdicts, manifest)),
        laws=_escaped(
            (law.part, law.statement, f"{law.worst:.0e}", "holds" if law.passed else "fails") for law in proof.laws
        ),
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page, encoding="utf-8", newline="\n")


def verdict(figure: Figure) -> str:
    """Whether a figure's claim holds, in words."""
    return "holds" if figure.holds else "does not hold"


def drawing(figure: Figure) -> str:
    """A figure as SVG text, without date or version."""
    import matplotlib as mpl
    from matplotlib.figure import Figure as Canvas

    text = io.StringIO()
    # what must be unique inside one drawing is made from the salt, and must be unique on the page
    with mpl.rc_context({"svg.hashsalt": figure.number, "svg.fonttype": "path", "font.size": 8.0}):
        canvas = Canvas(figsize=SIZE, layout="constrained")
        figure.draw(canvas.add_subplot())
        canvas.savefig(text, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _escaped(rows: Iterable[Sequence[str]]) -> list[list[str]]:
    return [[escape(cell) for cell in row] for row in rows]
