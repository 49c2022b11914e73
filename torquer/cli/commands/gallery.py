"""`torquer gallery`: published figures and tables, recomputed and compared.

The gallery is a package of its own next to this one, imported within the functions.
"""

import contextlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.base.strict_json import json_text
from torquer.cli.options import Json
from torquer.cli.output import make_writable, moving_bar, print_error, writing_to
from torquer.cli.process import FAILED_CODE

Out = Annotated[Path, Parameter(help="Folder for the pictures.")]
Docs = Annotated[
    Path | None, Parameter(help="Also write pages and small pictures into this folder.")
]
_OUT = Path("runs/gallery")
#: The checkout that holds the gallery next to the package; an installed package has none.
CHECKOUT = Path(__file__).parents[3]


def list_(*, json: Json = False) -> int:
    """List the catalogue: id, verdict if available, content."""
    _find_gallery()
    from gallery.catalogue import ROW_OF
    from gallery.lookup import entry_of

    done = entry_of()
    states = {id_: str(done[id_].declared) if id_ in done else "not yet" for id_ in ROW_OF}
    if json:
        rows = [
            {"id": id_, "verdict": states[id_], "content": row.content, "expected": row.expected}
            for id_, row in ROW_OF.items()
        ]
        print(json_text(rows))
        return 0
    for id_, row in ROW_OF.items():
        print(f"{id_:<15} {states[id_]:<15} {row.content}")
    print(f"{len(done)} of {len(ROW_OF)} done")
    return 0


def run(*ids: str, json: Json = False, out: Out = _OUT, docs: Docs = None) -> int:
    """Compute the entries of these IDS; exit 1 if a verdict differs from the declared one."""
    _find_gallery()
    from gallery.lookup import wanted
    from gallery.pages import read_record, updated_record, write_pages

    if not ids:
        raise ValueError(
            "gallery run: must name at least one id (see `gallery list`); received none"
        )
    outcomes = _compute(wanted(ids), out, docs)
    if docs:  # the pages of all others stay as they are
        write_pages(updated_record(read_record(docs), outcomes), docs)
    return _print_all(outcomes, json, out)


def all_(*, json: Json = False, out: Out = _OUT, docs: Docs = None) -> int:
    """Compute every available entry; exit 1 if a verdict differs from the declared one."""
    _find_gallery()
    from gallery.lookup import all_entries
    from gallery.pages import record_of, write_pages

    outcomes = _compute(all_entries(), out, docs)
    if docs:
        write_pages(record_of(outcomes), docs)
    return _print_all(outcomes, json, out)


def _find_gallery() -> None:
    """Let the gallery be imported; ValueError where there is none."""
    if not (CHECKOUT / "gallery/lookup.py").is_file():
        raise ValueError(
            "gallery: must stand next to the package, as in a checkout with `pip install -e .`; "
            "received an installed package"
        )
    if str(CHECKOUT) not in sys.path:
        sys.path.append(str(CHECKOUT))


def _compute(entries: Sequence, out: Path, docs: Path | None) -> list:
    """Outcomes of entries, with their pictures written."""
    from gallery.pages import PICTURES
    from gallery.runs import compute_all

    small = docs / PICTURES if docs else None
    for option, folder in (("--out", out), ("--docs", small)):
        if folder:
            make_writable(folder, option)
    given, columns = ("description", "completed"), ("TaskProgressColumn", "TimeRemainingColumn")
    bar = moving_bar("gallery", given, *columns, total=len(entries))
    with bar as progress, writing_to(out), _explain_missing_sympy():
        return compute_all(entries, out, small, progress)


@contextlib.contextmanager
def _explain_missing_sympy():
    """Within the block, say what an entry lacks that derives in symbols."""
    try:
        yield
    except ImportError as error:
        if "sympy" not in str(error):
            raise
        raise ValueError(
            "gallery: needs sympy for this entry: pip install 'torquer[symbolic]'; received an "
            "installation without it"
        ) from None


def _print_all(outcomes: list, as_json: bool, out: Path) -> int:
    """Print the outcomes; return the exit code."""
    if as_json:
        print(json_text([outcome.as_data() for outcome in outcomes]))
    else:
        for outcome in outcomes:
            _print(outcome.as_data())
        print(f"{out}: results.json, {sum(len(o.pictures) for o in outcomes)} pictures")
    wrong = [outcome for outcome in outcomes if not outcome.as_declared]
    for outcome in wrong:
        print_error(
            f"gallery {outcome.entry.id}: must have its declared verdict, "
            f"'{outcome.entry.declared}'; received '{outcome.answer.verdict}'"
        )
    return FAILED_CODE if wrong else 0


def _print(data: dict) -> None:
    """Print an outcome."""
    from gallery.entry import Verdict
    from gallery.pages import shown_limits, shown_number

    print(f"{', '.join(data['ids'])}: {data['title']}: {data['verdict']}")
    for check in data["checks"]:
        limits = shown_limits(check)
        number = shown_number(check | {"fleeting": False})
        mark = check["verdict"].replace(Verdict.DIFFERS, "DIFFERS")
        printed = f"printed: {check['expected'] or 'lost'}"
        if limits:
            printed += f" (agrees if {limits})"
        print(f"  {check['name']}: {number}; {printed}: {mark}")
    if data["reason"]:
        print(f"  why: {data['reason']}")
