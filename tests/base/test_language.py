"""Which language people are shown, and that a text without a translation stays as it is."""

import json
import pickle
import re

import pytest

from torquer.base import language
from torquer.base.language import joined, message, told, translated

USAGE = "Usage: "


@pytest.mark.parametrize(
    ("stated", "code"),
    [
        ({}, "en"),
        ({"LANG": "C.UTF-8"}, "en"),
        ({"LANG": "de_DE.UTF-8"}, "en"),
        ({"LANG": "ru_RU.UTF-8"}, "ru"),
        ({"LANG": "RU"}, "ru"),
        ({"LANG": "ru_RU.UTF-8", "LC_MESSAGES": "C"}, "en"),
        ({"LANG": "C", "LC_MESSAGES": "ru_UA"}, "ru"),
        ({"LANG": "ru_RU.UTF-8", "LC_ALL": "en_GB.UTF-8"}, "en"),
        ({"LANG": "ru_RU.UTF-8", "LC_ALL": ""}, "ru"),
        ({"LANG": "ru_RU.UTF-8", "TORQUER_LANG": "en"}, "en"),
        ({"LC_ALL": "C", "TORQUER_LANG": "ru"}, "ru"),
        ({"LC_ALL": "C", "TORQUER_LANG": "xx"}, "en"),
    ],
)
def test_language_is_stated_by_the_variable_else_by_the_locale(stated, code):
    assert language.language(stated) == code


@pytest.mark.parametrize(("name", "code"), [("Russian_Russia", "ru"), ("English_Malta", "en")])
def test_windows_states_it_without_a_variable(monkeypatch, name, code):
    monkeypatch.setattr(language.os, "name", "nt")
    monkeypatch.setattr("locale.getlocale", lambda: (name, "1251"))
    assert language.language({}) == code
    assert language.language({"TORQUER_LANG": "ru"}) == "ru"


def test_english_reads_no_catalogue(monkeypatch):
    monkeypatch.setattr(language, "catalogue", None)
    monkeypatch.setenv("TORQUER_LANG", "en")
    assert translated(USAGE) == USAGE
    assert translated("{count} m {count}", count=2) == "2 m 2"


def test_what_has_no_translation_stays(monkeypatch):
    monkeypatch.setenv("TORQUER_LANG", "ru")
    assert translated(USAGE) != USAGE
    assert translated("") == ""  # whose translation is the catalogue's own head
    assert translated("never said: {count} {{", count=2) == "never said: 2 {"
    assert translated("never said: {") == "never said: {"


def test_a_message_is_english_until_it_is_told(monkeypatch):
    signal = message("rate")
    limit = message("{signal} below {below:.3g} {unit}", signal=signal, below=0.25, unit="deg/s")
    both = joined("; ", [limit, "never said"])
    monkeypatch.setenv("TORQUER_LANG", "ru")
    assert both == "rate below 0.25 deg/s; never said"
    assert json.loads(json.dumps({both: both})) == {str(both): str(both)}
    assert pickle.loads(pickle.dumps(both)).values == both.values
    shown = told(both)
    assert shown.endswith("; never said") and "0.25" in shown
    assert not re.search("rate|below|deg", shown)
    assert told(shown) == shown  # what is told already stays
    monkeypatch.setenv("TORQUER_LANG", "en")
    assert told(both) == both


def test_braces_within_values_are_left_alone(monkeypatch):
    monkeypatch.setenv("TORQUER_LANG", "ru")
    assert told(message("{kind} {key}", kind="{a}", key="b {")) == "{a} b {"
    assert told(joined(", ", ["{", "}"])) == "{, }"
    assert told(joined(", ", [])) == ""
