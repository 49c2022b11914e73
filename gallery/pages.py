"""Pages of docs/gallery, made from the record of the last `make gallery` and the catalogue.

The record (results.json) holds what does not change from run to run: numbers to four digits and,
for timings, the limits only. Pages are a pure function of it.
"""

import json
from collections.abc import Iterable
from pathlib import Path

from gallery.catalogue import LEFT_OUT, ROW_OF, ROWS, SOURCES, Row
from gallery.entry import Grade, Outcome, Verdict, in_words
from gallery.links import where

RECORD, PICTURES = "results.json", "img"
_MADE = (
    "Made by `make gallery`; do not edit. [What MAG, SDOT, FIELD, WHEEL and MGS are]"
    "(../sources.md)."
)
_NOT_YET = "not yet"
#: What the front page counts of each source's rows.
_COUNTED = (*map(str, Verdict), _NOT_YET)
#: And of what differs, number by number.
_GRADES = tuple(map(str, Grade))


def record_of(outcomes: Iterable[Outcome]) -> list[dict]:
    """The outcomes as they are recorded."""
    record = []
    for outcome in outcomes:
        data = outcome.as_data()
        data["pictures"] = [path.name for path in outcome.pictures]
        for check in data["checks"]:
            check["measured"] = None if check["fleeting"] else _recorded(check["measured"])
            for name in {"uncertainty", "standard_error"} & set(check):
                check[name] = _recorded(check[name])
        record.append(data)
    return record


def _recorded(number: float | None) -> float | None:
    """Four digits; zero for pure rounding error, which differs between machines."""
    if number is None:
        return None
    return 0.0 if abs(number) < 1e-12 else float(f"{number:.4g}")


def updated_record(record: list[dict], outcomes: Iterable[Outcome]) -> list[dict]:
    """A record with these outcomes in place of what it had, in the order of the catalogue."""
    by_id = {data["id"]: data for data in [*record, *record_of(outcomes)]}
    return [by_id[id_] for id_ in ROW_OF if id_ in by_id]


def read_record(folder: Path) -> list[dict]:
    """The record in a folder of pages; none where there is no such file."""
    path = folder / RECORD
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def write_pages(record: list[dict], folder: Path) -> None:
    """Write the record and all pages; remove small pictures that no entry has any more."""
    text = json.dumps(record, indent=2, ensure_ascii=False) + "\n"
    (folder / RECORD).write_text(text, encoding="utf-8")
    for name, page in pages(record).items():
        (folder / name).write_text(page, encoding="utf-8")
    kept = {picture for data in record for picture in data["pictures"]}
    for path in (folder / PICTURES).glob("*.png"):
        if path.name not in kept:
            path.unlink()


def pages(record: list[dict]) -> dict[str, str]:
    """Every page by its file name."""
    made = {f"{source}.md": _source_page(source, record) for source in SOURCES}
    return {"README.md": _front_page(record)} | made | {"differences.md": _differences(record)}


def _serving(row: Row, record: list[dict]) -> list[dict]:
    return [data for data in record if set(data["ids"]) & set(row.ids)]


def _state(row: Row, record: list[dict]) -> str:
    """Verdicts of a row's entries; 'not yet' where an id has none."""
    serving = _serving(row, record)
    states = list(dict.fromkeys(in_words(data["verdict"], data["grade"]) for data in serving))
    served = {id_ for data in serving for id_ in data["ids"]}
    missing = [id_ for id_ in row.ids if id_ not in served]
    if missing:
        alone = len(missing) == len(row.ids)
        states.append(_NOT_YET if alone else f"{_NOT_YET}: {' '.join(missing)}")
    return ", ".join(states)


def _front_page(record: list[dict]) -> str:
    lines = [
        "# Gallery: published figures and tables, recomputed",
        "",
        _MADE,
        "",
        "Each entry recomputes a published figure or table and compares its numbers with those",
        "printed. The verdicts on a number:",
        "",
        "- It *agrees*.",
        "- It is *chosen*: reproduced by a choice made in view of the printed one, or with a",
        "  start, gain or body that the source does not print and on which it depends.",
        "- It is *self-consistent*: the source prints none, and two of our computations agree.",
        "- It *differs*, for a stated reason.",
        "- Its *value is lost*: illegible there.",
        "",
        "After ± stands the standard error that a number over starts has, taken as drawn at",
        "random. It widens no limit.",
        "",
        "What differs has a grade. *Rounding*: the last printed digit is off, and nothing depends",
        "on it. *Left open*: the number depends on a choice that the print leaves open, and with",
        "those that we took it is another. *Refuted*: it does not follow from what the source",
        "itself states. A row has the gravest grade of its numbers.",
        "",
        "One entry: `torquer gallery run FIELD-5`. All: `torquer gallery all`.",
        "",
        "| source | what it is | rows | " + " | ".join(_COUNTED) + " |",
        "|---|---|---|" + "---|" * len(_COUNTED),
    ]
    for source, title in SOURCES.items():
        states = [_state(row, record) for row in ROWS if row.source == source]
        counts = [sum(word in state for state in states) for word in _COUNTED]
        numbers = " | ".join(map(str, [len(states), *counts]))
        lines.append(f"| [{source}]({source}.md) | {title} | {numbers} |")
    lines += [
        "",
        f"[Differences from the sources](differences.md): each number, with grade and reason. "
        f"{_graded_in_words(record)}",
        "",
        *_left_out(),
    ]
    return "\n".join(lines)


def _graded_in_words(record: list[dict]) -> str:
    """How many numbers differ, by grade."""
    found = [check.get("grade") for data in record for check in data["checks"]]
    counts = ", ".join(f"{found.count(grade)} {grade}" for grade in _GRADES)
    return f"Of {sum(len(data['checks']) for data in record)} numbers: {counts}."


def _left_out() -> list[str]:
    """Printed results that have no entry, with the reason."""
    lines = ["## Left out", "", "Printed results without an entry, each with the reason.", ""]
    lines += ["| result | reason |", "|---|---|"]
    return [*lines, *(f"| {one.source}: {one.content} | {one.reason} |" for one in LEFT_OUT), ""]


def _source_page(source: str, record: list[dict]) -> str:
    rows = [row for row in ROWS if any(id_.startswith(f"{source}-") for id_ in row.ids)]
    lines = [f"# {source}: {SOURCES[source]}", "", _MADE, "", "| id | content | verdict |"]
    lines += ["|---|---|---|"]
    lines += [f"| {', '.join(row.ids)} | {row.content} | {_state(row, record)} |" for row in rows]
    shown = {data["id"]: data for row in rows for data in _serving(row, record)}
    for data in shown.values():
        lines += ["", *_section(data)]
    return "\n".join([*lines, ""])


def _section(data: dict) -> list[str]:
    lines = [f"## {', '.join(data['ids'])}: {data['title']}", ""]
    if data["expected"]:
        lines += [f"Source: {data['expected']}.", ""]
    verdict = in_words(data["verdict"], data["grade"])
    lines += [f"**{verdict}**" + (f": {data['reason']}" if data["reason"] else ""), ""]
    lines += _table(data["checks"])
    if data["note"]:
        lines += ["", data["note"]]
    if links := where(data):
        lines += ["", links]
    for picture in data["pictures"]:
        lines += ["", f"![{data['id']}]({PICTURES}/{picture})"]
    return lines


def _table(checks: list[dict]) -> list[str]:
    rows = [
        f"| {check['name']} | {check['expected'] or 'lost'} | {shown_number(check)} "
        f"| {shown_limits(check)} | {_mark(check)} |"
        for check in checks
    ]
    return ["| | printed | computed | agrees if | |", "|---|---|---|---|---|", *rows]


def _mark(check: dict) -> str:
    verdict = check["verdict"]
    if verdict == Verdict.DIFFERS:
        return f"**{in_words(verdict, check['grade'])}**"
    return "" if verdict == Verdict.LOST else verdict


def shown_number(check: dict) -> str:
    """A check's number with its unit."""
    if check["fleeting"]:
        return "a timing, not kept"
    number = check["measured"]
    if number is None:
        return "none"
    error = check.get("standard_error")
    text = f"{number:.4g} ± {error:.2g}" if error else f"{number:.4g}"
    return f"{text} {check['unit']}".rstrip()


def shown_limits(check: dict) -> str:
    """Where a check agrees, in words."""
    low, high = check["tolerance"]
    if low is not None and high is not None:
        return f"{low:.6g} to {high:.6g}"
    if low is None and high is None:
        return ""
    return f"at least {low:.6g}" if high is None else f"at most {high:.6g}"


def _differences(record: list[dict]) -> str:
    lines = [
        "# Differences from the sources",
        "",
        f"{_MADE} Each number that differs, with its [grade](README.md) and the reason. "
        f"{_graded_in_words(record)}",
        "",
    ]
    lines += [
        "| id | quantity | printed | computed | grade | reason |",
        "|---|---|---|---|---|---|",
    ]
    for data in record:
        link = f"[{', '.join(data['ids'])}]({data['id'].split('-', 1)[0]}.md)"
        lines += [
            f"| {link} | {check['name']} | {check['expected']} | {shown_number(check)} "
            f"| {check['grade']} | {data['reason']} |"
            for check in data["checks"]
            if check["verdict"] == Verdict.DIFFERS
        ]
    return "\n".join([*lines, ""])
