"""Each entry of the gallery says where its code stands, and names its formulas and its errata."""

import importlib
import re
from pathlib import Path

import pytest

from gallery.links import formulas, where
from gallery.pages import pages, read_record

ROOT = Path(__file__).parents[2]
GALLERY = ROOT / "docs/gallery"
RECORD = {data["id"]: data for data in read_record(GALLERY)}


@pytest.mark.parametrize("data", RECORD.values(), ids=list(RECORD))
def test_every_section_leads_to_code_formulas_and_errata(data):
    line = where(data)
    assert line in (GALLERY / f"{data['id'].split('-', 1)[0]}.md").read_text(encoding="utf-8")
    (file,) = re.findall(r"Code: `([^`]+)`", line)
    module = importlib.import_module(file.removesuffix(".py").replace("/", "."))
    assert list(module.ENTRY.ids) == data["ids"]
    index = (ROOT / "docs/equations.md").read_text(encoding="utf-8")
    for key in formulas(data):
        assert (
            f"| {key} | " in index and f"[{key}](../equations.md#{key.split()[0].lower()})" in line
        )


def test_formulas_are_those_of_the_source_that_is_named():
    assert formulas(RECORD["FIELD-6"]) == ["FIELD (1.12)", "MAG (1.2.1)"]
    assert "[Errata]" in where(RECORD["MAG-1.2.3"]) and "[Errata]" not in where(
        RECORD["FIELD-cost"]
    )


def test_what_is_no_entry_has_no_line():
    assert where(RECORD["FIELD-6"] | {"id": "FIELD-0"}) == ""


def test_pages_are_those_of_the_record():
    for name, text in pages([*RECORD.values()]).items():
        assert (GALLERY / name).read_text(encoding="utf-8") == text, name
