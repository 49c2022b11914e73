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
from torquer.cli.output import make_writable, moving_bar, print_error, say, writing_to
from torquer.cli.process import FAILED_CODE

Out = Annotated[Path, Parameter(help="Folder for the pictures.")]
Docs = Annotated[
    Path | None, Parameter(help="Also write pages and small pictures into this folder.")
]
_OUT = Path("runs/gallery")
#: The checkout that holds the gallery next to the package; an installed package has none.
CHECKOUT = Path(__file__).parents[3]


def list_(*, json: Json = False) -> int:
    """List the catalogue: id, verdict if available, grade of what differs, content."""
    _find_gallery()
    from gallery.catalogue import LEFT_OUT, ROW_OF
    from gallery.lookup import entry_of

    done = entry_of()
    if json:
        print(json_text([_listed(id_, row, done.get(id_)) for id_, row in ROW_OF.items()]))
        return 0
    for id_, row in ROW_OF.items():
        say(f"{id_:<15} {_state(done.get(id_)):<20} {row.content}")
    for one in LEFT_OUT:
        say(f"{one.source:<15} {'left out':<20} {one.content}: {one.reason}")
    say(f"{len(done)} of {len(ROW_OF)} done, {len(LEFT_OUT)} left out")
    return 0


def _state(entry) -> str:
    """The declared verdict of an entry with its grade; 'not yet' without one."""
    from gallery.entry import in_words

    return in_words(entry.declared, entry.grade) if entry else "not yet"


def _listed(id_: str, row, entry) -> dict:
    """A row of the catalogue as data."""
    return {
        "id": id_,
        "verdict": str(entry.declared) if entry else "not yet",
        "grade": str(entry.grade) if entry and entry.grade else None,
        "content": row.content,
        "expected": row.expected,
    }


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
    from gallery.entry import in_words

    if as_json:
        print(json_text([outcome.as_data() for outcome in outcomes]))
    else:
        for outcome in outcomes:
            _print(outcome.as_data())
        say(f"{out}: results.json, {sum(len(o.pictures) for o in outcomes)} pictures")
    wrong = [outcome for outcome in outcomes if not outcome.as_declared]
    for outcome in wrong:
        print_error(
            f"gallery {outcome.entry.id}: must have its declared verdict, "
            f"'{in_words(outcome.entry.declared, outcome.entry.grade)}'; received "
            f"'{in_words(outcome.answer.verdict, outcome.grade)}'"
        )
    return FAILED_CODE if wrong else 0


def _print(data: dict) -> None:
    """Print an outcome."""
    from gallery.entry import Verdict, in_words
    from gallery.pages import shown_limits, shown_number

    say(f"{', '.join(data['ids'])}: {data['title']}: {in_words(data['verdict'], data['grade'])}")
    for check in data["checks"]:
        limits = shown_limits(check)
        number = shown_number(check | {"fleeting": False})
        mark = in_words(check["verdict"], check.get("grade")).replace(Verdict.DIFFERS, "DIFFERS")
        printed = f"printed: {check['expected'] or 'lost'}"
        if limits:
            printed += f" (agrees if {limits})"
        say(f"  {check['name']}: {number}; {printed}: {mark}")
    if data["reason"]:
        say(f"  why: {data['reason']}")
