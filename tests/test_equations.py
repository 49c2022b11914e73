"""Every published formula that is cited exists, and has one home in the code."""

import importlib.util
import json
import re
from collections import Counter
from pathlib import Path

import pytest

import torquer

PACKAGE = Path(torquer.__file__).parent
GALLERY = Path(__file__).parents[1] / "gallery" / "theory"
CATALOGUE = json.loads((Path(__file__).parent / "data" / "published_equations.json").read_text())


def _reader():
    """The page of formulas is made by the same reading."""
    path = Path(__file__).parents[1] / "docs" / "generate.py"
    spec = importlib.util.spec_from_file_location("generate", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


READER = _reader()


def test_there_are_citations():
    assert len(READER.sources()) >= 10


def test_formulas_whose_source_goes_on_in_words_are_found():
    found = {(key, number) for key, number, _ in READER.sources()}
    assert found >= {("FIELD", "1.4"), ("FIELD", "1.8")}


def test_the_gallery_has_formulas_of_its_own():
    assert any("gallery/theory" in place for _, _, place in READER.sources())


def test_every_citation_is_in_the_catalogue():
    unknown = [c for c in READER.sources() if c[1] not in CATALOGUE.get(c[0], ())]
    assert unknown == []


def test_every_formula_has_one_home():
    counts = Counter((key, number) for key, number, _ in READER.sources())
    twice = [key for key, n in counts.items() if n > 1]
    assert [c for c in READER.sources() if c[:2] in twice] == []


def test_every_source_line_can_be_read():
    for place, text in READER.all_docstrings():
        assert len(re.findall(r"\bSources?:", text)) == len(READER.SOURCE.findall(text)), place


def test_sources_stand_in_docstrings_not_in_comments():
    for file in (*PACKAGE.rglob("*.py"), *GALLERY.glob("*.py")):
        for line in file.read_text(encoding="utf-8").splitlines():
            assert not re.search(r"#.*Source: [A-Z]+ \(", line), f"{file}: {line}"


def test_the_catalogue_is_complete_in_itself():
    """Numbers of a section run from 1 without a gap, in order, and each stands once."""
    assert set(CATALOGUE) == {"MAG", "SDOT", "FIELD", "WHEEL", "MGS"}
    for key, numbers in CATALOGUE.items():
        depth = 3 if key == "MAG" else 2
        split = [tuple(map(int, n.split("."))) for n in numbers]
        assert all(len(s) == depth for s in split)
        assert split == sorted(set(split))
        for section in {s[:-1] for s in split}:
            last = [s[-1] for s in split if s[:-1] == section]
            assert last == list(range(1, len(last) + 1)), (key, section)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Brakes. Source: MAG (2.1.3).", [("MAG", "2.1.3")]),
        ("Source: FIELD (1.10), FIELD (1.11).", [("FIELD", "1.10"), ("FIELD", "1.11")]),
        ("Source: FIELD (1.10),\n    and FIELD (1.11).", [("FIELD", "1.10"), ("FIELD", "1.11")]),
        ("Source: FIELD (1.4), whose axes are up, along, normal.", [("FIELD", "1.4")]),
        ("Source: MAG (1.1.1). Later. Source: WHEEL (6.2)", [("MAG", "1.1.1"), ("WHEEL", "6.2")]),
        ("As in MAG (2.1.3), or nearly.", []),
        ("Source: a book, chapter 3.", []),
    ],
)
def test_the_reader_of_citations(text, expected):
    assert READER.citations_of(text) == expected
