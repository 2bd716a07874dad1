"""Build the documentation site: `make docs` writes build/site/index.html.

The sources are the project's own README and docs, as they lie, with pages made from the manifest, the proofs and the
schema beside them. Sphinx stops at the first kind of trouble: warnings are errors, and so are links within that lead
nowhere.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pages
from sphinx.cmd.build import main as sphinx

from awiwi_gen.hand import Hand
from awiwi_gen.pipeline import Job, verify
from awiwi_gen.report import Progress

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SOURCES, SITE = ROOT / "build/site-sources", ROOT / "build/site"
DOCUMENTS = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "bench/README.md"]


def lay_out(sources: Path) -> None:
    """Copy the documents to where their links among one another hold, and write the pages that are made."""
    shutil.rmtree(sources, ignore_errors=True)
    for name in [*DOCUMENTS, *(path.relative_to(ROOT) for path in sorted((ROOT / "docs").glob("*.md")))]:
        (sources / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, sources / name)
    shutil.copy(HERE / "index.md", sources)
    (sources / "_static").mkdir()
    shutil.copy(HERE / "site.css", sources / "_static")
    shutil.copy(ROOT / "docs/hand.schema.json", sources / "_static")
    shutil.copytree(
        ROOT / "examples/gallery", sources / "gallery_scripts", ignore=shutil.ignore_patterns("__pycache__")
    )
    job = Job(Hand.load(), progress=Progress())
    pages.write(sources, job, verify(job, ROOT / "generated"))


def main() -> int:
    """Lay out, then build; 0 if there was nothing to warn of."""
    lay_out(SOURCES)
    shutil.rmtree(SITE, ignore_errors=True)
    os.environ.setdefault("MPLBACKEND", "agg")
    return sphinx(["-b", "html", "-W", "--keep-going", "-q", "-c", str(HERE), str(SOURCES), str(SITE)])


if __name__ == "__main__":
    sys.exit(main())
