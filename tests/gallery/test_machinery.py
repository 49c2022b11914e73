"""The gallery's machinery: checks, verdicts, the catalogue, the lookup of entries, pages."""

import ast
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import gallery
from gallery import entries as folder, lookup
from gallery.catalogue import LEFT_OUT, ROW_OF, ROWS, SOURCES, known_id
from gallery.drawing import BLUE, COLOURS, GREEN, ORANGE, new_figure, save_small
from gallery.entry import (
    Answer,
    Entry,
    Grade,
    Outcome,
    Verdict,
    chosen,
    consistent,
    graded,
    half_unit,
    lost,
    near,
    percent,
    ratio_of_shares,
    share,
    uncertain,
    within,
)
from gallery.pages import pages, read_record, record_of, updated_record, write_pages
from gallery.runs import compute_all

ROOT = Path(gallery.__file__).parents[1]


def test_the_package_needs_the_gallery_for_its_command_only():
    """It is not installed."""
    naming = re.compile(r"^\s*(?:from|import) gallery\b", re.M)
    files = [path for path in (ROOT / "torquer").rglob("*.py") if naming.search(path.read_text())]
    assert files
    assert {path.parent.name for path in files} == {"commands"}
    assert all(path.stem.startswith("gallery") for path in files)


GOOD, BAD = near("x", "2.7", 2.74, "%"), near("x", "2.7", 2.76, "%")


def entry(*checks, ids=("FIELD-10",), figures=None, note="", **keys):
    return Entry(ids=ids, compute=lambda: Answer(checks, figures or {}, note), **keys)


# ------------------------------------------------------------------ checks and verdicts


@pytest.mark.parametrize(
    ("number", "half"),
    [("2.7", 0.05), ("1250", 0.5), ("0.184", 0.0005), ("9", 0.5), ("-1.0", 0.05)],
)
def test_half_a_unit_of_the_last_digit(number, half):
    assert half_unit(number) == pytest.approx(half)


def test_printed_number_agrees_to_half_unit_of_last_digit():
    assert (GOOD.verdict, BAD.verdict) == (Verdict.AGREES, Verdict.DIFFERS)
    assert (GOOD.low, GOOD.high) == pytest.approx((2.65, 2.75))
    assert GOOD.printed == "2.7 %"
    assert near("x", "52", 51.3, tolerance=1.0, printed="near 52").printed == "near 52"


def test_limits_include_their_ends_and_a_missing_number_never_agrees():
    assert within("x", "at most 10", 10.0, high=10.0).verdict is Verdict.AGREES
    assert within("x", "at least 10", 10.0, low=10.0).verdict is Verdict.AGREES
    assert within("x", "at most 10", 10.1, high=10.0).verdict is Verdict.DIFFERS
    assert within("x", "anything", math.nan).verdict is Verdict.DIFFERS
    assert lost("x", 1.0).verdict is Verdict.LOST


def test_a_check_tells_what_its_agreement_is_worth():
    assert chosen(GOOD).verdict is Verdict.CHOSEN
    assert consistent(GOOD).verdict is Verdict.CONSISTENT
    assert uncertain(GOOD, 0.1).verdict is Verdict.AGREES
    assert chosen(BAD).verdict is consistent(BAD).verdict is Verdict.DIFFERS
    assert uncertain(BAD, 0.1).verdict is Verdict.DIFFERS, "uncertainty is no wider limit"


def test_a_share_has_its_binomial_standard_error():
    happened = [True] * 64 + [False] * 36
    check = share("x", "mostly", happened, low=0.5)
    assert check.measured == 0.64
    assert check.standard_error == pytest.approx(math.sqrt(0.64 * 0.36 / 100.0))
    assert share("x", "mostly", happened, low=0.65).verdict is Verdict.DIFFERS, "no wider limit"
    assert share("x", "all", [True] * 24).standard_error == 0.0
    assert percent(happened) == "64 ± 5 %"
    assert percent([True] * 199 + [False]) == "99.5 ± 0.5 %"
    assert percent([True] * 24) == "100 %"


def test_a_ratio_of_shares_has_the_errors_of_both():
    one, other = [True] * 60 + [False] * 40, [True] * 80 + [False] * 20
    check = ratio_of_shares("x", "the same", one, other)
    assert check.measured == pytest.approx(0.75)
    relative = math.hypot(math.sqrt(0.24 / 100) / 0.6, math.sqrt(0.16 / 100) / 0.8)
    assert check.standard_error == pytest.approx(0.75 * relative)


@pytest.mark.parametrize(
    ("checks", "verdict"),
    [
        ((GOOD,), Verdict.AGREES),
        ((GOOD, lost("y", 1.0)), Verdict.AGREES),
        ((GOOD, BAD), Verdict.DIFFERS),
        ((BAD, lost("y", 1.0)), Verdict.DIFFERS),
        ((GOOD, chosen(GOOD)), Verdict.CHOSEN),
        ((BAD, chosen(GOOD)), Verdict.DIFFERS),
        ((GOOD, consistent(GOOD)), Verdict.AGREES),
        ((consistent(GOOD), lost("y", 1.0)), Verdict.CONSISTENT),
        ((chosen(GOOD), consistent(GOOD)), Verdict.CHOSEN),
        ((lost("y", 1.0),), Verdict.LOST),
        ((), Verdict.LOST),
    ],
)
def test_verdict(checks, verdict):
    assert Answer(checks, {}).verdict is verdict


@pytest.mark.parametrize(
    ("checks", "declared", "as_declared"),
    [
        ((GOOD,), Verdict.AGREES, True),
        ((GOOD,), Verdict.DIFFERS, False),
        ((BAD,), Verdict.DIFFERS, True),
        ((BAD,), Verdict.AGREES, False),
        ((GOOD,), Verdict.LOST, False),
        ((lost("x", 1.0),), Verdict.LOST, True),
    ],
)
def test_departure_from_declared_verdict_shows_in_both_directions(checks, declared, as_declared):
    reason = "" if declared is Verdict.AGREES else "because"
    grade = Grade.REFUTED if declared is Verdict.DIFFERS else None
    made = entry(*checks, declared=declared, reason=reason, grade=grade)
    assert Outcome(made, made.compute()).as_declared is as_declared


SMALL, WIDE = graded(BAD, Grade.ROUNDING), graded(BAD, Grade.OPEN)


@pytest.mark.parametrize(
    ("checks", "declared", "found", "of_each"),
    [
        ((BAD,), Grade.OPEN, Grade.OPEN, [Grade.OPEN]),
        ((SMALL, BAD, GOOD), Grade.REFUTED, Grade.REFUTED, [Grade.ROUNDING, Grade.REFUTED, None]),
        ((SMALL, WIDE), Grade.OPEN, Grade.OPEN, [Grade.ROUNDING, Grade.OPEN]),
        ((SMALL,), Grade.REFUTED, Grade.ROUNDING, [Grade.ROUNDING]),
        ((WIDE,), Grade.ROUNDING, Grade.OPEN, [Grade.OPEN]),
        ((graded(GOOD, Grade.REFUTED), SMALL), Grade.ROUNDING, Grade.ROUNDING, [None,
         Grade.ROUNDING]),
    ],
)  # fmt: skip
def test_an_entry_has_the_gravest_grade_of_what_differs(checks, declared, found, of_each):
    made = entry(*checks, declared=Verdict.DIFFERS, reason="so", grade=declared)
    outcome = Outcome(made, made.compute())
    assert outcome.grade is found
    assert outcome.as_declared is (found is declared)
    data = outcome.as_data()
    assert data["grade"] == found
    assert [check.get("grade") for check in data["checks"]] == of_each


def test_what_agrees_has_no_grade():
    made = entry(GOOD)
    data = Outcome(made, made.compute()).as_data()
    assert data["grade"] is None and "grade" not in data["checks"][0]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"ids": ()}, "entry: ids must be of the catalogue; received none"),
        (
            {"ids": ("FIELD-3", "FIELD-99")},
            "entry: ids must be of the catalogue; received FIELD-99",
        ),
        (
            {"reason": "so"},
            "entry FIELD-10: reason must be empty where the verdict is 'agrees'; received 'so'",
        ),
        (
            {"declared": Verdict.DIFFERS},
            "entry FIELD-10: reason must be given where the verdict is 'differs'; received ''",
        ),
        (
            {"declared": Verdict.LOST},
            "entry FIELD-10: reason must be given where the verdict is 'value lost'; received ''",
        ),
        (
            {"declared": Verdict.DIFFERS, "reason": "so"},
            "entry FIELD-10: grade must be given where the verdict is 'differs'; received none",
        ),
        (
            {"grade": Grade.OPEN},
            "entry FIELD-10: grade must be left out where the verdict is 'agrees'; received "
            "left open",
        ),
    ],
)
def test_an_entry_that_makes_no_sense(keys, message):
    with pytest.raises(ValueError) as error:
        entry(GOOD, **keys)
    assert str(error.value) == message


def test_json_of_an_outcome():
    made = entry(BAD, lost("y", math.inf), declared=Verdict.DIFFERS, reason="so", note="and so",
                 grade=Grade.OPEN)  # fmt: skip
    data = Outcome(made, made.compute(), (Path("a/FIELD-10.png"),)).as_data()
    assert json.loads(json.dumps(data, allow_nan=False)) == {
        "id": "FIELD-10",
        "ids": ["FIELD-10"],
        "title": "Accuracy with disturbances, without/with wheel",
        "expected": "similar",
        "verdict": "differs",
        "declared": "differs",
        "grade": "left open",
        "reason": "so",
        "checks": [
            {"name": "x", "expected": "2.7 %", "measured": 2.76, "unit": "%",
             "tolerance": [pytest.approx(2.65), pytest.approx(2.75)], "verdict": "differs",
             "uncertainty": 0.0, "fleeting": False, "grade": "left open"},
            {"name": "y", "expected": None, "measured": None, "unit": "",
             "tolerance": [None, None], "verdict": "value lost",
             "uncertainty": 0.0, "fleeting": False},
        ],
        "note": "and so",
        "pictures": [str(Path("a/FIELD-10.png"))],
    }  # fmt: skip


# ------------------------------------------------------------------ catalogue and lookup


def test_the_catalogue_has_every_id_once():
    ids = [id_ for row in ROWS for id_ in row.ids]
    assert len(ids) == len(set(ids)) == len(ROW_OF)
    assert {row.source for row in ROWS} == set(SOURCES)
    # rows of the project's catalogue, as counted there
    assert len(ROWS) == 58


@pytest.mark.parametrize(
    ("asked", "id_"), [("FIELD-3", "FIELD-3"), ("field-3", "FIELD-3"), ("mag-3.5.1T", "MAG-3.5.1t")]
)
def test_ids_in_any_case(asked, id_):
    assert known_id(asked) == id_


def test_an_unknown_id_names_what_is_near():
    with pytest.raises(ValueError) as error:
        known_id("FIELD-33")
    assert str(error.value).startswith(
        "gallery: must be an id of the catalogue; received 'FIELD-33'; near it: FIELD-3"
    )
    with pytest.raises(ValueError, match="received 'zzz'; see: gallery list"):
        known_id("zzz")


def test_what_is_left_out_has_a_source_and_a_reason():
    assert len(LEFT_OUT) == 7
    assert {one.source for one in LEFT_OUT} <= set(SOURCES)
    assert all(one.content and one.reason for one in LEFT_OUT)


def test_every_file_of_the_folder_is_one_entry():
    files = {path.stem for path in Path(folder.__path__[0]).glob("*.py")} - {"__init__"}
    assert len(lookup.all_entries()) == len(files)
    assert len(lookup.entry_of()) == sum(len(each.ids) for each in lookup.all_entries())


def test_entries_stand_in_the_order_of_the_catalogue():
    order = list(ROW_OF)
    places = [order.index(each.id) for each in lookup.all_entries()]
    assert places == sorted(places)


def test_an_id_that_is_served_twice(monkeypatch):
    class Module:
        ENTRY = entry(GOOD)

    monkeypatch.setattr(lookup.importlib, "import_module", lambda name: Module)
    with pytest.raises(ValueError, match="an id must have one entry; received two for FIELD-10"):
        lookup.all_entries()


def test_wanted_gives_each_entry_once():
    assert [each.id for each in lookup.wanted(["MAG-1.2.2", "field-5", "FIELD-3"])] == [
        "FIELD-5",
        "FIELD-3",
    ]


def test_what_is_not_done_yet_says_so(monkeypatch):
    todo = "MGS-1"
    monkeypatch.setattr(lookup, "all_entries", lambda: [entry(GOOD)])
    with pytest.raises(ValueError) as error:
        lookup.wanted([todo])
    assert str(error.value) == (
        f"gallery: must be an entry that is done; received {todo}, which is not yet; "
        "see: gallery list"
    )


def _names_used(tree):
    """Names imported, and attributes asked of anything."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            yield from node.module.split(".")
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Attribute):
            yield node.attr


def test_entries_use_public_names_only():
    for path in Path(gallery.__file__).parent.rglob("*.py"):
        names = _names_used(ast.parse(path.read_text(encoding="utf-8")))
        private = [n for n in names if n.startswith("_") and not n.startswith("__")]
        if path.parent.name == "entries" or path.stem in ("cones", "four_models"):
            assert private == [], path.name
    probe = ast.parse("from torquer.report.flight.png import _style\nx._y")
    assert {"_style", "_y"} <= set(_names_used(probe))


# ------------------------------------------------------------------ runs and pages


def made_figure():
    figure, (axes,) = new_figure("A title")
    axes.plot([0, 1, 2], [1, 3, 2])
    return figure


def outcomes(tmp_path, *made):
    small = tmp_path / "img"
    small.mkdir(exist_ok=True)
    return compute_all(made, tmp_path, small)


def test_compute_all_writes_pictures_and_results(tmp_path):
    answer = []
    made = [
        entry(GOOD, figures={"": made_figure()}, ids=("FIELD-11",)),
        entry(GOOD, figures={"a": made_figure(), "b": made_figure()}),
    ]
    found = compute_all(made, tmp_path, None, lambda name, count: answer.append((name, count)))
    assert answer == [("FIELD-11", 0), ("FIELD-10", 1)]
    names = ["FIELD-11.png", "FIELD-10-a.png", "FIELD-10-b.png"]
    assert [p.name for o in found for p in o.pictures] == names
    assert all((tmp_path / name).stat().st_size > 5000 for name in names)
    results = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert results == [o.as_data() for o in found]


def test_small_pictures_are_small_and_the_same_each_time(tmp_path):
    for name in "ab":
        save_small(made_figure(), tmp_path / f"{name}.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.png").stat().st_size < 20_000
    assert isinstance(made_figure(), Figure)


def test_the_record_rounds_and_leaves_out_what_a_clock_says(tmp_path):
    made = entry(within("x", "p", 1.23456789, high=2.0),
                 within("t", "q", 3.4, high=4.0, fleeting=True))  # fmt: skip
    (data,) = record_of(outcomes(tmp_path, made))
    assert [check["measured"] for check in data["checks"]] == [1.235, None]
    text = pages([data])["FIELD.md"]
    assert "| x | p | 1.235 | at most 2 | agrees |" in text
    assert "| t | q | a timing, not kept | at most 4 | agrees |" in text


def test_pages_and_record_show_standard_errors(tmp_path):
    made = entry(share("x", "half", [True] * 64 + [False] * 36, low=0.5), GOOD)
    (data,) = record_of(outcomes(tmp_path, made))
    assert [check.get("standard_error") for check in data["checks"]] == [0.048, None]
    assert "| x | half | 0.64 ± 0.048 | at least 0.5 | agrees |" in pages([data])["FIELD.md"]


def test_one_entry_is_replaced_in_a_record_the_others_stay(tmp_path):
    first = outcomes(tmp_path, entry(GOOD, ids=("FIELD-11",)), entry(GOOD, ids=("MAG-2.2",)))
    write_pages(record_of(first), tmp_path)
    record = read_record(tmp_path)
    assert record == record_of(first)
    other = entry(BAD, ids=("FIELD-11",), declared=Verdict.DIFFERS, reason="so",
                  grade=Grade.OPEN)  # fmt: skip
    added = outcomes(tmp_path, entry(GOOD, ids=("FIELD-3",)), other)
    found = updated_record(record, added)
    assert [data["id"] for data in found] == ["FIELD-3", "FIELD-11", "MAG-2.2"]
    assert [data["verdict"] for data in found] == ["agrees", "differs", "agrees"]
    assert found[2] == record[1]
    assert read_record(tmp_path / "nothing") == []


def test_small_picture_keeps_colours_of_lines_and_pale_shades(tmp_path):
    from PIL import Image

    figure, panels = new_figure("A title", 3, 7.0)
    x = np.linspace(0.0, 1.0, 400)
    for panel in panels:
        for k, colour in enumerate((GREEN, BLUE, ORANGE)):
            panel.axvspan(k / 3.0, (k + 1) / 3.0, color=colour, alpha=0.22, lw=0.0)
        for k, colour in enumerate(COLOURS):
            panel.plot(x, np.sin(40.0 * x + k), color=colour, lw=1.2)
            panel.plot(x, np.sin(70.0 * x + k) - 3.0, color=colour, lw=0.7, ls=(0, (4, 2)))
    save_small(figure, tmp_path / "a.png")
    found = np.array(Image.open(tmp_path / "a.png").convert("RGB")).reshape(-1, 3).astype(float)
    shades = [0.22 * np.array(to_rgb(c)) + 0.78 for c in (GREEN, BLUE, ORANGE)]
    for wanted in [*shades, *(np.array(to_rgb(c)) for c in COLOURS)]:
        assert np.abs(found - 255.0 * wanted).max(axis=1).min() < 8.0


def test_a_small_picture_of_what_a_clock_says_is_kept(tmp_path):
    clock = within("t", "q", 3.4, high=4.0, fleeting=True)
    (tmp_path / "img").mkdir()
    for checks, written in (((GOOD,), True), ((GOOD, clock), False)):
        small, full = tmp_path / "img" / "FIELD-10.png", tmp_path / "FIELD-10.png"
        small.write_text("the one before")
        full.write_text("the one before")
        outcomes(tmp_path, entry(*checks, figures={"": made_figure()}))
        assert (small.read_bytes() != b"the one before") is written
        assert full.read_bytes().startswith(b"\x89PNG")
        small.unlink()
        outcomes(tmp_path, entry(*checks, figures={"": made_figure()}))
        assert small.read_bytes().startswith(b"\x89PNG")


def test_pages_say_what_differs_and_what_is_not_yet(tmp_path):
    made = [
        entry(near("x", "2.7", 3.1, "%"), lost("y", 5.0, "s"), declared=Verdict.DIFFERS,
              reason="the reason", note="A note.", figures={"": made_figure()},
              grade=Grade.OPEN),
        entry(within("z", "about 1", 1.1, 0.9, 1.2), ids=("FIELD-5",)),
    ]  # fmt: skip
    text = pages(record_of(outcomes(tmp_path, *made)))
    assert set(text) == {"README.md", "differences.md", *(f"{s}.md" for s in SOURCES)}
    field = text["FIELD.md"]
    row = "| FIELD-10, FIELD-11 | Accuracy with disturbances, without/with wheel"
    assert f"{row} | differs (left open), not yet: FIELD-11 |" in field
    assert "| FIELD-3 | B0 arithmetic vs integral mean vs inclination, 350 km | not yet |" in field
    assert "**differs (left open)**: the reason" in field and "\nA note.\n" in field
    assert "![FIELD-10](img/FIELD-10.png)" in field
    assert "| x | 2.7 % | 3.1 % | 2.65 to 2.75 | **differs (left open)** |" in field
    assert "| y | lost | 5 s |  |  |" in field
    assert "| z | about 1 | 1.1 | 0.9 to 1.2 | agrees |" in field
    differs = [line for line in text["differences.md"].splitlines() if line.startswith("| [")]
    assert differs == ["| [FIELD-10](FIELD.md) | x | 2.7 % | 3.1 % | left open | the reason |"]
    for name in ("README.md", "differences.md"):
        assert "Of 3 numbers: 0 rounding, 1 left open, 0 refuted." in text[name]
    assert all(f"| {one.source}: {one.content} | {one.reason} |" in text["README.md"]
               for one in LEFT_OUT)  # fmt: skip
    # a row that two sources share stands on both pages
    assert "## FIELD-5" in text["MAG.md"] and "## FIELD-10" not in text["MAG.md"]


def test_write_pages_removes_pictures_without_an_entry(tmp_path):
    found = outcomes(tmp_path, entry(GOOD, figures={"": made_figure()}))
    (tmp_path / "img" / "FIELD-99.png").touch()
    write_pages(record_of(found), tmp_path)
    assert [path.name for path in (tmp_path / "img").iterdir()] == ["FIELD-10.png"]
    assert json.loads((tmp_path / "results.json").read_text(encoding="utf-8")) == record_of(found)
    assert (
        (tmp_path / "differences.md").read_text(encoding="utf-8").startswith("# Differences from")
    )
