"""`python -m gallery.studies`: the page of the stored results; cases that are named fly first."""

import sys
from pathlib import Path

from gallery.drawing import save_small
from gallery.studies import pocketqube, pocketqube_page
from gallery.studies.flying import store

DOCS = Path(__file__).parents[2] / "docs"
HEAD = """# Published studies, flown again

`python -m gallery.studies` makes this page; do not edit. A simulator should be able to say which
published numbers depend on their steps, and which do not. Each study flies with its published
models and steps, then with converged ones. Figures are facts of the sources; text and code are
ours. The results stand beside the scripts in `gallery/studies/`, with date and version. An
independent code flies a member of each over an hour (`tests/gallery/test_studies.py`). `python -m
gallery.studies CASE` flies a case again.
"""


def main(cases: list[str]) -> None:
    """Fly some cases; write the page and its pictures."""
    for case in cases:
        rows = pocketqube.fly_alone() if case == "free" else pocketqube.fly(case)
        store(pocketqube.NAME, case, rows)
    save_small(pocketqube_page.picture(), DOCS / pocketqube_page.PICTURE)
    (DOCS / "studies.md").write_text(page(), encoding="utf-8")


def page() -> str:
    """The page as Markdown."""
    return f"{HEAD}\n{pocketqube_page.section()}\n"


if __name__ == "__main__":
    main(sys.argv[1:])
