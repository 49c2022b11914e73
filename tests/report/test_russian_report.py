"""The report of a run in Russian: nothing is left in English that has words, all can be read.

Names of the scenario, keys, sources and notes are as they are in any language.
"""

import re
from html import unescape

import numpy as np
import pytest
from picture_faults import faults, texts_drawn

from torquer.analysis.summary import summarise
from torquer.base.strict_json import json_text
from torquer.report.common.one_page import draw_page
from torquer.report.flight.one_page import run_page
from torquer.report.flight.page import page
from torquer.report.flight.panels import pictures
from torquer.report.flight.png import picture_functions
from torquer.report.flight.view import make_view

RUNS = ("detumble", "flown", "switched")
#: Names in texts: of files, models, keys, states, units of speed.
_NAMES = re.compile(
    r"\[mission\]|four sided pyramid \(alpha [\d.]+ deg, beta"
    r"|igrf14|IGRF|RK4|B-dot|bdot|TOML|toml|JavaScript|torquer|UTC|BibTeX|plots|circular|min.?max"
    r"|\b(?:day|night|detumble|hold|safe|task|light|pitch|coils|damping|wheels|flown|switched)\b"
    r"|\w*_\w*|\w+\.\w+"
)
_WORD = re.compile(r"[A-Za-z]{4,}")


@pytest.fixture(params=RUNS)
def result(request, monkeypatch):
    monkeypatch.setenv("TORQUER_LANG", "ru")
    return request.getfixturevalue(request.param)


def left(text: str) -> list[str]:
    """English words of a text that are no names."""
    return _WORD.findall(_NAMES.sub("", text))


def test_pictures_are_in_russian_and_can_be_read(result):
    view = make_view(result)
    about = view.scenario.description
    figures = {name: draw(view) for name, draw in picture_functions(pictures(view)).items()}
    assert [(name, found) for name, each in figures.items() if (found := faults(each))] == []
    texts = {text for each in figures.values() for text, _ in texts_drawn(each)}
    assert [text for text in texts - {about} if left(text)] == []


def test_the_page_to_print_is_in_russian_and_can_be_read(result):
    made = run_page(result)
    figure = draw_page(made)
    assert faults(figure) == []
    shown = made.told()
    told = (shown.verdict, *(cell for row in shown.numbers for cell in row))
    assert [text for text in told if left(text)] == []
    assert any(re.search("[\u0400-\u04ff]", text) for text, _ in texts_drawn(figure))


def test_the_report_is_in_russian(result):
    view = make_view(result)
    text = page(view, pictures(view))
    assert '<html lang="ru">' in text
    for part in ("script", "style", "pre", "noscript", 'section class="notes"'):
        tag = part.split()[0]
        text = re.sub(rf"<{part}.*?</{tag}>", "", text, flags=re.S)
    text = re.sub(r'<section class="card" id="sources">.*?</details>', "", text, flags=re.S)
    words = re.findall(r'(?:aria-label|alt)="([^"]*)"', text)
    words += re.sub(r"<[^>]*>", "\n", re.sub(r'src="[^"]*"', "", text)).split("\n")
    about = (view.scenario.description, view.scenario.name)
    lines = [unescape(line).strip() for line in words]
    known = {law["name"] for law in view.laws.values()}
    lines = [line for line in lines if line not in about and line.split(" (")[0] not in known]
    versions = {"python", "numpy", "numba", "scipy", "xarray"}
    assert [line for line in lines if left(line) and line not in versions] == []


def test_programs_read_the_same_in_both_languages(result, monkeypatch):
    russian = summarise(result)
    text = str(russian)
    monkeypatch.setenv("TORQUER_LANG", "en")
    english = summarise(result)
    assert json_text(russian) == json_text(english)
    assert str(english) != text and re.search("[\u0400-\u04ff]", text)
    assert str(russian) == str(english)  # told where it is shown, not where it is made
    numbers = [re.findall(r"\d+\.\d+", each) for each in (text, str(english))]
    assert numbers[0] == numbers[1] and np.size(numbers[0]) > 10


def test_links_within_the_report_are_the_same_in_both_languages(result, monkeypatch):
    def places() -> list[str]:
        view = make_view(result)
        return re.findall(r'(?:id|href)="#?(\w*)"', page(view, pictures(view)))

    russian = places()
    monkeypatch.setenv("TORQUER_LANG", "en")
    assert russian == places() and "rate" in russian
