"""The check of the style of pages: what is a sentence, and that each rule can fail."""

from pathlib import Path

import pytest
from loaded_scripts import loaded

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def style():
    """The script that checks the pages."""
    return loaded(ROOT / "docs/style.py")


def texts(style, text):
    return [each.text for each in style.sentences(text)]


def test_all_pages_keep_the_style(style):
    assert len(style.pages()) > 45
    wrong = {path.name: style.findings(path.read_text(encoding="utf-8")) for path in style.pages()}
    assert {name: found for name, found in wrong.items() if found} == {}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("One. Two. 3.5 deg, e.g. this.", ["One", "Two", "3.5 deg, e.g. this."]),
        ("# No title\n\nA line\ngoes on.", ["A line goes on."]),
        ("- one\n- two\n  goes on", ["one", "two goes on"]),
        ("| a | b. C |\n|---|---|\n| `x` | y |", ["a", "b", "C", "Code", "y"]),
        ("Text.\n\n```sh\ntorquer run\n```\n\n    int code;\n\nMore.", ["Text.", "More."]),
        ("| one<br>two. Three |", ["one", "two", "Three"]),
        ("See [the page. It](x.md) of `a. B`.", ["See the page", "It of Code."]),
        ("First. 'clip' is next.", ["First", "'clip' is next."]),
    ],
)
def test_what_a_sentence_is(style, text, expected):
    assert texts(style, text) == expected


def test_long_sentences_are_found_with_their_line(style):
    fits, long = " ".join(["word"] * 35) + ".", " ".join(["word"] * 36) + "."
    assert style.findings(f"{fits} {fits.capitalize()}") == []
    ((line, reason),) = style.findings(f"# Title\n\nShort.\n\n{long}")
    assert line == 5 and reason.startswith("36 words, of at most 35: word")
    ((line, _),) = style.findings(f"| a |\n|---|\n| {long} |")
    assert line == 3


@pytest.mark.parametrize("word", ["beforehand", "Utilises", "in order to", "which flies"])
def test_home_made_words_are_found_but_not_in_code(style, word):
    assert len(style.findings(f"A text {word} here.")) == 1
    assert style.findings(f"A text `{word}` here.") == []


def test_pages_in_the_passive_are_found(style):
    active, passive = "The board shows it. ", "It is shown here. "
    assert style.findings(active * 20 + passive * 10) == []
    ((_, reason),) = style.findings(active * 10 + passive * 10)
    assert reason == "50% of the sentences are passive, of 40%"
