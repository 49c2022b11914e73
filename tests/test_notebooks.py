"""The notebooks run, and what they show is what their cells print and draw."""

import re

import notebooks
import pytest

from torquer.compile import engine

PATHS = sorted(notebooks.FOLDER.glob("*.ipynb"))
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
#: A picture within HTML.
_PICTURE = re.compile(r"base64,[\w+/=]+")
#: Greatest size of a file [bytes].
_MOST_BYTES = 200_000


def shown(notebook):
    """Outputs of all cells: kind and text, without pictures' data."""
    outputs = [out for cell in notebook["cells"] for out in cell.get("outputs", ())]
    return [
        (kind, "" if kind == "image/png" else _PICTURE.sub("", "".join(text)))
        for out in outputs
        for kind, text in (out.get("data") or {out["name"]: out["text"]}).items()
    ]


def as_words(text):
    """A text without its numbers, and the numbers; how many blanks lie between does not matter."""
    return _NUMBER.sub("#", text).split(), [float(each) for each in _NUMBER.findall(text)]


def test_there_are_three_and_a_page_leads_to_each():
    page = (notebooks.FOLDER.parents[1] / "docs/tutorials/notebook.md").read_text(encoding="utf-8")
    assert len(PATHS) == 3
    for path in PATHS:
        assert f"(../../examples/notebooks/{path.name})" in page
        assert path.stat().st_size < _MOST_BYTES


def test_a_cell_keeps_what_it_prints_and_the_value_of_its_last_line():
    cells = [
        {"cell_type": "markdown", "source": ["# Title"]},
        {"cell_type": "code", "source": ["a = 2\n", "print(a)"]},
        {"cell_type": "code", "source": ["a + 1"]},
    ]
    ran = notebooks.execute({"cells": cells}, "made here")
    assert shown(ran) == [("stdout", "2\n"), ("text/plain", "3")]
    assert [cell.get("execution_count") for cell in ran["cells"]] == [None, 1, 2]
    with pytest.raises(NameError, match="nothing_of_that_name"):
        notebooks.execute(
            {"cells": [{"cell_type": "code", "source": ["nothing_of_that_name"]}]}, ""
        )


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_a_notebook_shows_what_its_cells_print(path):
    kept = notebooks.read(path)
    for (kind, text), (made_kind, made) in zip(
        shown(kept), shown(notebooks.execute(kept, path.stem)), strict=True
    ):
        words, numbers = as_words(text)
        made_words, made_numbers = as_words(made)
        assert (kind, words) == (made_kind, made_words), "run docs/notebooks.py"
        # of a printed number the last digit, or of error estimates the first ones, may differ
        assert made_numbers == pytest.approx(numbers, rel=0.02, abs=0.011)
