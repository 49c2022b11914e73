"""`python -m gallery.studies`: the page of the stored results.

`python -m gallery.studies STUDY [CASE ...] [--members N]` flies cases of a study first, all of them
unless some are named.
"""

import argparse
from pathlib import Path

from gallery.drawing import save_small
from gallery.studies import (
    bar_magnet_page,
    non_monotonic_page,
    pocketqube_page,
    single_coil_page,
    upmsat_page,
)
from gallery.studies.flying import store

DOCS = Path(__file__).parents[2] / "docs"
_PAGES = (pocketqube_page, non_monotonic_page, bar_magnet_page, single_coil_page, upmsat_page)
STUDIES = {page.STUDY.name: page.STUDY for page in _PAGES}
HEAD = """# Published studies, flown again

`python -m gallery.studies` makes this page; do not edit. A simulator should be able to say which
published numbers depend on their steps, and which do not. Each study flies with its published
models and steps, then with converged ones. Figures are facts of the sources; text and code are
ours. The results stand beside the scripts in `gallery/studies/`, with date and version. An
independent code flies a member of each over an hour
(`tests/gallery/test_studies_independent.py`). `python -m gallery.studies STUDY CASE --members
1000` flies a case again, with as many members as you like: a standard error falls with the root
of their number.
"""


def main(words: list[str] | None = None) -> None:
    """Fly some cases; write the page and its pictures."""
    parser = argparse.ArgumentParser(prog="python -m gallery.studies", description=__doc__)
    parser.add_argument("study", nargs="?", choices=STUDIES)
    parser.add_argument("cases", nargs="*", metavar="case")
    parser.add_argument("--members", type=int)
    asked = parser.parse_args(words)
    if asked.study:
        study = STUDIES[asked.study]
        for case in asked.cases or study.cases:
            if case not in study.cases:
                parser.error(f"case: must be one of {', '.join(study.cases)}; received {case}")
            store(study.name, case, study.cases[case](asked.members))
    for study in STUDIES.values():
        path, figure = study.picture
        save_small(figure(), DOCS / path)
    (DOCS / "studies.md").write_text(page(), encoding="utf-8")


def page() -> str:
    """The page as Markdown."""
    return "\n".join([HEAD, *(f"{study.section()}\n" for study in STUDIES.values())])


if __name__ == "__main__":
    main()
