"""Work of the gallery commands: progress bar, table or JSON, exit code."""

import contextlib
import sys
from pathlib import Path

from gallery.catalogue import ROW_OF
from gallery.entry import Entry, Outcome, Verdict
from gallery.lookup import all_entries, entry_of, wanted
from gallery.pages import (
    PICTURES,
    read_record,
    record_of,
    shown_limits,
    shown_number,
    updated_record,
    write_pages,
)
from gallery.runs import compute_all
from torquer.base.strict_json import json_text
from torquer.cli.output import make_writable, print_error, progress_bar, writing_to

NOT_AS_DECLARED = 1


def show_list(as_json: bool) -> int:
    """Every id of the catalogue with its declared verdict, or 'not yet'."""
    done = entry_of()
    states = {id_: str(done[id_].declared) if id_ in done else "not yet" for id_ in ROW_OF}
    if as_json:
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


def run(ids: tuple[str, ...], as_json: bool, out: Path, docs: Path | None) -> int:
    """Compute the entries of these ids; in the pages the others stay as they are."""
    if not ids:
        raise ValueError(
            "gallery run: must name at least one id (see `gallery list`); received none"
        )
    outcomes = _computed(wanted(ids), out, docs / PICTURES if docs else None)
    if docs:
        write_pages(updated_record(read_record(docs), outcomes), docs)
    return _print_all(outcomes, as_json, out)


def run_all(as_json: bool, out: Path, docs: Path | None) -> int:
    """Compute every entry; write the pages if a folder is given."""
    small = docs / PICTURES if docs else None
    outcomes = _computed(all_entries(), out, small)
    if docs:
        write_pages(record_of(outcomes), docs)
    return _print_all(outcomes, as_json, out)


def _computed(entries: list[Entry], out: Path, small: Path | None) -> list[Outcome]:
    for option, folder in (("--out", out), ("--docs", small)):
        if folder:
            make_writable(folder, option)
    with _progress(len(entries)) as progress, writing_to(out):
        return compute_all(entries, out, small, progress)


@contextlib.contextmanager
def _progress(total: int):
    """Progress callback for a bar on a terminal; None elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import TaskProgressColumn, TimeRemainingColumn

    with progress_bar(TaskProgressColumn(), TimeRemainingColumn()) as bar:
        task = bar.add_task("gallery", total=total)
        yield lambda name, count: bar.update(task, completed=count, description=name)


def _print_all(outcomes: list[Outcome], as_json: bool, out: Path) -> int:
    """Print the outcomes; return the exit code."""
    if as_json:
        print(json_text([outcome.as_data() for outcome in outcomes]))
    else:
        for outcome in outcomes:
            _print(outcome)
        print(f"{out}: results.json, {sum(len(o.pictures) for o in outcomes)} pictures")
    wrong = [outcome for outcome in outcomes if not outcome.as_declared]
    for outcome in wrong:
        print_error(
            f"gallery {outcome.entry.id}: must have its declared verdict, "
            f"'{outcome.entry.declared}'; received '{outcome.answer.verdict}'"
        )
    return NOT_AS_DECLARED if wrong else 0


def _print(outcome: Outcome) -> None:
    data = outcome.as_data()
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
