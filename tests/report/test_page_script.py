"""The script of the pages, in node on a page of fakes: what is drawn when, printing, zooms."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

import torquer.report

SCRIPT = Path(torquer.report.__file__).with_name("templates") / "page.js"
FAKES = Path(__file__).with_name("fake_page.js")
NODE = shutil.which("node")

pytestmark = pytest.mark.skipif(NODE is None, reason="needs node")


def tried(trial: str):
    """What the script did on a page of four plots, the last one within a closed <details>."""
    command = [NODE, str(FAKES), str(SCRIPT), trial]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    return json.loads(done.stdout)


@pytest.mark.parametrize("trial", ["idle", "no idle callbacks"])
def test_plots_that_nobody_scrolls_to_are_drawn_one_by_one(trial):
    found = tried(trial)
    assert found.get("first", []) == []
    assert found["drawn"] == [0, 1, 2]  # the closed one has no width yet
    assert max(found["steps"]) == 1


def test_printing_draws_what_is_missing_before_the_page_is_captured():
    found = tried("print")
    assert found["printed"] == [0, 1, 2]  # when the handler returns, not later
    assert found["again"] == [0, 1, 2]  # once
    assert not any(found["steps"])


def test_what_is_folded_is_drawn_when_it_is_opened():
    found = tried("fold")
    assert found["closed"] == [0, 1, 2]
    assert found["opened"] == [0, 1, 2, 3]


def test_a_link_to_what_is_folded_opens_it():
    assert tried("link") == [0, 1, 2, 3]


def test_a_zoom_reaches_all_plots_those_out_of_sight_later():
    found = tried("zoom")
    assert found["seen"] == [1]  # at once, as it is near the window
    assert found["atOnce"] == []  # its own plot has the range already
    assert found["scrolled"] == [["zoom", 2, [2, 3]]]
    assert found["all"] == [["zoom", 2, [2, 3]], ["zoom", 0, [2, 3]]]
    assert sorted(found["back"]) == [["zoom", k, [0, 10]] for k in (0, 1, 2)]


def test_keys_zoom_and_return_to_the_whole():
    """Of a plot whose range is given, and of one that plotly fits to its numbers."""
    given, whole, fitted, everything = tried("keys")
    assert given == ["zoom", 0, [1.0, 9.0]] and whole == ["zoom", 0, [0, 10]]
    assert fitted == ["zoom", 1, pytest.approx([0.7, 6.3])] and everything == ["zoom", 1, "all"]


def test_plots_are_drawn_in_the_colours_of_the_theme():
    colours = [colour for _, _, colour in tried("dark")]
    assert colours == ["#c3cad1"] * 3


def test_a_printed_page_is_light_whatever_the_theme():
    style = SCRIPT.with_name("page.css").read_text(encoding="utf-8")
    dark = [line for line in style.splitlines() if "prefers-color-scheme: dark" in line]
    assert dark and all("@media screen and (prefers" in line for line in dark)
    assert "@media print" in style
