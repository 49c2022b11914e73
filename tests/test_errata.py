"""Numbers that are typed are those of a test or of a gallery entry, to their digits.

Each row of the errata cites what has its numbers; so have the reasons of the gallery's entries and
the pages of the theory.
"""

import json
import math
import re
from pathlib import Path

import pytest

from gallery.catalogue import ROW_OF
from gallery.lookup import entry_of

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/errata.md"
WHEELS = "tests/spacecraft/wheel_array/test_search.py"
RECORD = json.loads((ROOT / "docs/gallery/results.json").read_text(encoding="utf-8"))
#: A number as pages write it, neither part of a name, an equation's number, an exponent nor a time.
NUMBER = re.compile(r"(?<![\w.(^,/:-])\d+(?:\.\d+)?(?:e-?\d+)?(?!\.?\d|\w|:|\))")
PLACE = re.compile(r"\b(?:MAG|SDOT|FIELD|WHEEL|MGS|Figs?\.|Table|section) [\d.]+")
GALLERY = re.compile(rf"(?<![\w/])(?:{'|'.join({i.split('-')[0] for i in ROW_OF})})-[\w.]+")


def rows():
    """Cells of each row: source, printed, computed, shown by."""
    lines = [line for line in PAGE.read_text("utf-8").splitlines() if line.startswith("|")]
    return [tuple(cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]) for line in lines][
        2:
    ]


def files_of(shown_by: str) -> list[Path]:
    """The files that a row cites."""
    return [ROOT / name for name in re.findall(r"`([^`]+)`", shown_by)]


def numbers_in(text: str) -> list[float]:
    """All numbers in a text, also those within words, and shares in per cent."""
    found = [float(x) for x in re.findall(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?", text)]
    return [x * factor for x in found for factor in (1.0, 100.0)]


def of_record(data: dict) -> list[float]:
    """Numbers of an entry's record; of its reason, which nobody computes, none."""
    found = numbers_in(data["note"])
    for check in data["checks"]:
        found += numbers_in(f"{check['name']} {check['expected']} {abs(check['measured'] or 0)}")
    return found


def of_entry(data: dict) -> list[float]:
    """Numbers of an entry's record and code."""
    code = Path(entry_of()[data["id"]].compute.__code__.co_filename).read_text("utf-8")
    return of_record(data) + numbers_in(code.split("ENTRY = ")[0])


def known_to(shown_by: str) -> list[float]:
    """Numbers in the files and of the entries that a row cites."""
    found = [
        number for path in files_of(shown_by) for number in numbers_in(path.read_text("utf-8"))
    ]
    for id_ in GALLERY.findall(re.sub(r"`[^`]+`", "", shown_by)):
        (data,) = [each for each in RECORD if id_ in each["ids"]]
        found += of_entry(data)
    return found


def has(number: str, known: list[float]) -> bool:
    """Whether one of the numbers is this one, to its digits."""
    mantissa, _, power = number.partition("e")
    half = 0.5 * 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
    return any(abs(each - float(number)) <= half * (1.0 + 1e-9) for each in known)


def stated(cell: str) -> list[str]:
    """Numbers that a cell states; small whole ones, which any text has, are left out."""
    found = NUMBER.findall(PLACE.sub("", cell))
    return [x for x in found if not (x.isdigit() and int(x) < 10)]


def test_a_number_counts_to_its_digits():
    assert has("2.7", [2.65]) and has("51", [51.18]) and has("1.3e-6", [1.27e-6])
    assert not has("2.7", [2.76]) and not has("52", [51.18]) and not has("1.3e-6", [1.4e-6])
    assert stated("by (2.1), MAG 5.3: 14:30:27, k2 = 3 and 0.57 deg/s, 1e7 to 41 %, x^2") == [
        "0.57", "1e7", "41"]  # fmt: skip
    assert numbers_in("abs=0.056") == [0.056, pytest.approx(5.6)]


@pytest.mark.parametrize("row", rows(), ids=lambda row: row[0])
def test_each_row_cites_what_shows_it(row):
    """A file that is there, or an entry that is done, with every number of the row."""
    *_, computed, shown_by = row
    files = files_of(shown_by)
    assert files or GALLERY.findall(shown_by), "a row needs a test"
    assert [path for path in files if not path.is_file()] == []
    assert [path for path in files if path.relative_to(ROOT).parts[0] != "tests"] == []
    assert set(GALLERY.findall(re.sub(r"`[^`]+`", "", shown_by))) <= set(entry_of())
    known = known_to(shown_by)
    assert [x for x in stated(computed) if not has(x, known)] == []


def test_no_row_is_lost():
    assert len(rows()) > 70
    assert all(len(row) == 4 for row in rows())
    assert not math.isnan(sum(numbers_in(PAGE.read_text("utf-8"))))


# ------------------------------------------------------------------ reasons of entries


@pytest.mark.parametrize("data", RECORD, ids=lambda data: data["id"])
def test_numbers_of_a_reason_are_those_of_the_entry_or_of_a_test(data):
    known = of_entry(data)
    for file in (*(ROOT / "tests/gallery").glob("*.py"), ROOT / WHEELS):
        known += numbers_in(file.read_text("utf-8"))
    assert [x for x in stated(data["reason"]) if not has(x, known)] == []


# ------------------------------------------------------------------ pages of the theory

#: By page: sources whose entries, and tests whose numbers, it may state. The other two pages have
#: tests that compute every number of theirs.
PAGES = {
    "sdot": (["SDOT"], ["gallery/test_sdot.py", "cli/test_theory_command.py", "theory/slow"]),
    "which-field-model": (["FIELD", "MAG"], ["environment/field"]),
    "floquet": (["FIELD"], ["theory/periodic", "gallery/test_planar_magnet.py",
                            "gallery/test_pitch_wheel.py"]),
    "three-axis": (["MAG-4"], ["theory/three_axis", "attitude_holds.py"]),
    "averaging": (["MAG-1.2", "MAG-2", "FIELD-5", "FIELD-6"],
                  ["theory/slow/test_averaging_page.py"]),
    "spin-stabilised": (["MAG-3"], ["theory/slow/test_averaging_page.py"]),
}  # fmt: skip
#: Rows on a CubeSat in the air, of flights that no test repeats; a table and a limit that the page
#: has a test of its own for.
OPEN = {
    "three-axis": {"1.9", "0.08"},
    "averaging": {"14.71", "39.55", "54.74", "66.95", "0.032", "0.203", "0.333", "0.423", "25"},
}


def of_pages(name: str) -> tuple[list[str], list[float]]:
    """Numbers that a page states outside code and links, and those known to what it may cite."""
    sources, tests = PAGES[name]
    page = (ROOT / f"docs/theory/{name}.md").read_text("utf-8")
    page = re.sub(r"```.*?```", "", page, flags=re.DOTALL)
    page = re.sub(r"\]\([^)]*\)|`[^`]*`", "", page)
    known = []
    for each in tests:
        path = ROOT / "tests" / each
        files = [path] if path.is_file() else path.rglob("*.py")
        known += [number for file in files for number in numbers_in(file.read_text("utf-8"))]
    for data in RECORD:
        if any(id_.startswith(source) for id_ in data["ids"] for source in sources):
            known += of_record(data)
    return stated(page), known


@pytest.mark.parametrize("name", PAGES)
def test_numbers_of_a_page_of_the_theory_are_those_of_entries_and_tests(name):
    numbers, known = of_pages(name)
    assert numbers
    assert {x for x in numbers if not has(x, known)} == OPEN.get(name, set())
