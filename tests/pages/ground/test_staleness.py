"""What the page shows is of now, or the page says since when it is not."""

import os
import signal
import sqlite3
import time
from contextlib import closing, contextmanager

import pytest
from small_satellite import ground_process, received, small_satellite
from watched_page import CHROMIUM, browser_context, watched_page

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium"),
    pytest.mark.skipif(os.name == "nt", reason="no SIGSTOP"),
]

PATIENCE_MS = 40_000
#: How long the page may take to say that nothing comes [ms].
SAID_MS = 3000
NO_WORD = "no word from the ground since"


@pytest.fixture(scope="module")
def context():
    with browser_context(1280, 800, PATIENCE_MS) as context:
        yield context


@contextmanager
def page_of(context, satellite, folder, *refusals):
    """A ground in a process of its own, and its page with the values of a packet."""
    process, client = ground_process(folder, satellite.address)
    try:
        with watched_page(context, "ERR_CONNECTION", *refusals) as page:
            place = "#/browse/torquer:sat/torquer:sat.packet.parameter?hideInspector=true"
            page.goto(f"{client.base}/?token={client.token}{place}")
            sync_api.expect(page.locator(".t-link:has(.t-link__state)")).to_contain_text("link up")
            page.locator(".t-values__value", has_text="7").first.wait_for()
            yield process, client, page
    finally:
        process.send_signal(signal.SIGCONT)
        process.terminate()
        process.communicate(timeout=30)


def value(page):
    """The number that is shown."""
    return float(page.locator(".t-values tr", has_text="value").locator("td").first.inner_text())


def greys(page):
    """What makes the numbers lose their colour."""
    return page.locator(".l-shell__main-container").evaluate("e => getComputedStyle(e).filter")


def test_a_ground_that_stands_still_is_said_within_seconds(context, tmp_path):
    with small_satellite() as satellite, page_of(context, satellite, tmp_path) as shown:
        process, client, page = shown
        assert greys(page) == "none"
        process.send_signal(signal.SIGSTOP)
        stopped_s = time.monotonic()
        page.locator(".t-silence", has_text=NO_WORD).wait_for(timeout=SAID_MS)
        line = page.locator(".t-link:has(.t-link__state)")
        sync_api.expect(line).to_contain_text(NO_WORD)
        assert time.monotonic() - stopped_s < SAID_MS * 1e-3 + 0.5
        assert "link up" not in line.inner_text() and "grayscale" in greys(page)
        still = value(page)
        time.sleep(1.0)
        assert value(page) == still
        process.send_signal(signal.SIGCONT)
        sync_api.expect(line).to_contain_text("link up", timeout=SAID_MS)
        sync_api.expect(page.locator(".t-silence")).to_have_text("")
        assert greys(page) == "none"
        page.wait_for_function(
            "before => Number(document.querySelector('.t-values tr:nth-child(2) td').innerText)"
            "> before",
            arg=still,
        )
        numbers = received(client)
        assert numbers == [float(n + 1) for n in range(len(numbers))]


def test_a_satellite_that_falls_silent_is_said(context, tmp_path):
    with small_satellite() as satellite, page_of(context, satellite, tmp_path) as shown:
        _, _, page = shown
        satellite.is_mute = True
        line = page.locator(".t-link:has(.t-link__state)")
        sync_api.expect(line).to_contain_text("no telemetry since", timeout=SAID_MS)
        assert "link up" not in line.inner_text() and greys(page) == "none"
        page.locator(".t-view.is-silent").wait_for(timeout=2000)
        banner = page.locator(".t-silence")
        assert not banner.is_visible(), "the status line says it"
        page.set_viewport_size({"width": 400, "height": 800})
        sync_api.expect(banner).to_contain_text("Chibis-M: no telemetry since")
        assert banner.is_visible()
        page.set_viewport_size({"width": 1280, "height": 800})
        satellite.is_mute = False
        sync_api.expect(line).to_contain_text("link up", timeout=SAID_MS)
        page.locator(".t-view:not(.is-silent)").wait_for(timeout=2000)


def test_an_archive_that_takes_nothing_is_shown(context, tmp_path):
    with small_satellite() as satellite, page_of(context, satellite, tmp_path) as shown:
        _, _, page = shown
        with closing(sqlite3.connect(tmp_path / "sat.sqlite", isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            archive = page.locator(".t-link__archive")
            sync_api.expect(archive).to_contain_text("not archived since", timeout=6000)
            before = value(page)
            page.wait_for_timeout(500)
            assert value(page) > before
            other.execute("ROLLBACK")
        sync_api.expect(archive).to_have_text("", timeout=8000)


def test_a_tab_that_slept_says_so_and_catches_up(context, tmp_path):
    """Timers and messages stand still, as on a computer that sleeps."""
    with small_satellite() as satellite, page_of(context, satellite, tmp_path) as shown:
        _, _, page = shown
        page.evaluate("location.hash = '#/browse/torquer:sat/torquer:sat.view.log'")
        page.locator(".t-log td", has_text="link found").wait_for()
        page.wait_for_timeout(1000)
        with page.expect_request("**/api/sat/log/search?*", timeout=10_000):
            page.evaluate("() => { const end = Date.now() + 4000; while (Date.now() < end); }")
        sync_api.expect(page.locator(".t-silence")).to_have_text("")
        sync_api.expect(page.locator(".t-link:has(.t-link__state)")).to_contain_text("link up")


def test_a_ground_that_was_started_again_says_how_to_go_on(context, tmp_path):
    strange = "403", "Unexpected response code"
    with small_satellite() as satellite, page_of(context, satellite, tmp_path, *strange) as shown:
        process, client, page = shown
        process.terminate()
        process.wait(30)
        banner = page.locator(".t-silence")
        sync_api.expect(banner).to_contain_text(NO_WORD)
        assert "started again" not in banner.inner_text(), "none is there"
        again, new = ground_process(tmp_path, satellite.address, port=client.port)
        try:
            sync_api.expect(banner).to_contain_text("it was started again; open the address")
            page.set_viewport_size({"width": 400, "height": 800})
            is_cut = "e => e.scrollHeight > e.clientHeight || e.scrollWidth > e.clientWidth"
            assert not banner.evaluate(is_cut)
            page.set_viewport_size({"width": 1280, "height": 800})
            opened = context.new_page()
            opened.goto(f"{new.base}/?token={new.token}")
            sync_api.expect(banner).to_have_text("")
            line = page.locator(".t-link:has(.t-link__state)")
            sync_api.expect(line).to_contain_text("link up")
            opened.close()
        finally:
            again.terminate()
            again.communicate(timeout=30)
