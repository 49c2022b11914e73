"""The board in Russian: its page, its form and what it says of a run; keys stay as they are."""

import json
import re

import pytest
from watched_page import CHROMIUM, browser_context, serious_findings, watched_page

from torquer.compile import engine
from torquer.pages.board import words

PATIENCE_MS = 60_000.0
#: What stands on the page and is no word: files, axes of Euler angles, keys, kinds, presets.
_NAMES = re.compile(
    r"torquer( board)?|Python|TOML|IGRF|WGS84|TLE|mission|[a-z0-9]*_[\w.]*|B-dot|UTC|IERS"
)
_WORD = re.compile(r"[A-Za-z]{4,}")


@pytest.fixture(autouse=True)
def _in_russian(monkeypatch):
    monkeypatch.setenv("TORQUER_LANG", "ru")


def test_page_and_scripts_have_their_texts_from_the_catalogue():
    page = words.page()
    assert '<html lang="ru">' in page
    shown = " ".join(re.findall(r'>([^<>]+)<|(?:title|aria-label)="([^"]+)"', page)[0])
    assert _WORD.findall(_NAMES.sub("", shown)) == []
    said = json.loads(words.messages().removeprefix("export const words = ").rstrip(";\n"))
    assert len(said) > 50
    assert {text for text in said if text == said[text]} == {"torquer board", *_KEYS}
    assert [text for text in words.texts() if text not in said] == []


#: Keys of a keyboard, a format: the same in any language.
_KEYS = ["Ctrl-Z", "Ctrl-Shift-Z", "TOML"]


def test_page_is_as_the_file_in_english(monkeypatch):
    monkeypatch.setenv("TORQUER_LANG", "en")
    assert words.page() == (words.WEB / "index.html").read_text(encoding="utf-8")
    assert words.messages() == "export const words = {};\n"


def test_form_is_told_and_its_keys_are_not(served, data):
    _, russian = served.post("/api/form", {"data": data})
    tables = {table["key"]: table for table in russian["tables"]}
    assert tables["orbit"]["title"] == "орбита"
    (field,) = (x for x in tables["orbit"]["fields"] if x["key"] == "orbit.altitude_km")
    assert (field["name"], field["unit"]) == ("высота", "км")
    assert field["about"].startswith("Высота над экваториальным радиусом")
    given = [field["about"] for table in tables.values() for field in table["fields"]]
    assert [x for x in given if x and not re.search("[\u0400-\u04ff]", x)] == []
    assert "circular" in tables["orbit"]["kind"]["choices"]


@pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_all_that_is_seen_is_russian_and_can_be_reached(served):
    sync_api = pytest.importorskip("playwright.sync_api")
    with browser_context(1300, 900, PATIENCE_MS) as context, watched_page(context, "422") as page:
        page.goto(f"{served.base}/?token={served.server.token}")
        sync_api.expect(page.locator("#theory td").first).to_be_visible()
        sync_api.expect(page.locator("#state")).to_have_text(re.compile("^[0-9]+ мс$"))
        page.locator("#pin").click()
        sync_api.expect(
            page.get_by_role("textbox", name="орбита наклонение [град]")
        ).to_be_visible()
        assert serious_findings(page) == []
        seen = page.locator("body").inner_text()
        options = page.evaluate("[...document.querySelectorAll('option')].map((x) => x.text)")
        names = {*options, "start", "satellite"}
        left = _WORD.findall(_NAMES.sub("", seen))
        assert [word for word in left if word not in names] == []
