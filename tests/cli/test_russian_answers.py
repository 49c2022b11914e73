"""Answers as they are printed in Russian: no sentence is left in English, names stay."""

import re
from pathlib import Path

import pytest

from torquer.cli.answer import answer
from torquer.cli.output import say

ROOT = Path(__file__).parents[2]
#: Commands that answer at once.
COMMANDS = (
    "design coil --dipole-a-m2 3.2 --diameter-m 0.3 --mass-kg 0.4 --voltage-v 12",
    "design bench --time-s 600 --bench-inertia 0.4 --inertia 1.6 --bench-field-nt 1e5 "
    "--field-nt 1e4",
    f"modes {ROOT}/examples/safe_mode.toml",
    f"wheels {ROOT}/examples/wheels/foton.toml",
)
#: What the author of a design of wheels calls it.
_TITLE = "Four-sided pyramid on a Foton-like satellite"
_WORD, _SENTENCE = re.compile(r"[A-Za-z]{3,}"), re.compile(r"[A-Za-z]{2,} [a-z]{2,} [a-z]{2,}")


def said(words: str, language: str, capsys, monkeypatch) -> str:
    monkeypatch.setenv("TORQUER_LANG", language)
    monkeypatch.setenv("COLUMNS", "400")
    assert not answer(words.split())
    return capsys.readouterr().out


@pytest.mark.parametrize("words", COMMANDS)
def test_no_sentence_is_left_in_english(words, capsys, monkeypatch):
    shown = said(words, "ru", capsys, monkeypatch)
    assert re.search("[\u0400-\u04ff]", shown)
    assert [line for line in shown.splitlines() if _SENTENCE.search(line.replace(_TITLE, ""))] == []


@pytest.mark.parametrize("words", COMMANDS[:2])
def test_no_word_is_left_in_english(words, capsys, monkeypatch):
    shown = said(words, "ru", capsys, monkeypatch)
    assert {*_WORD.findall(shown)} <= {"AWG"}


@pytest.mark.parametrize("words", COMMANDS[:3])
def test_numbers_are_those_of_the_english_answer(words, capsys, monkeypatch):
    english, russian = (said(words, code, capsys, monkeypatch) for code in ("en", "ru"))
    digits = [sorted(re.findall(r"\d+\.\d+", text)) for text in (english, russian)]
    assert digits[0] == digits[1]


@pytest.mark.parametrize("words", COMMANDS[:3])
def test_json_is_the_same_in_both_languages(words, capsys, monkeypatch):
    texts = [said(f"{words} --json", code, capsys, monkeypatch) for code in ("en", "ru")]
    assert texts[0] == texts[1]


def test_a_path_is_said_as_it_is(capsys, monkeypatch):
    monkeypatch.setenv("TORQUER_LANG", "ru")
    path = Path("runs") / "rate and report.html"
    say(path, "rate")
    shown = capsys.readouterr().out.splitlines()
    assert shown[0] == str(path) and shown[1] != "rate"
