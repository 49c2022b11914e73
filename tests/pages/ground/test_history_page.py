"""The page on the past: an instant, gaps, files, satellites side by side, narrow screens."""

import csv
import re
import time

import pytest
from ground_flight import serving, table, until
from made_archive import CHIBIS, archive_of, row
from watched_page import CHROMIUM

from torquer.flight.link import open_link
from torquer.flight.packets.codec import decoder
from torquer.flight.packets.frames import Downlink
from torquer.ground.archive import EPOCH_MS

sync_api = pytest.importorskip("playwright.sync_api")
pytest.importorskip("uvicorn")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")

#: Far longer than anything here takes: only a failure waits so long [ms].
PATIENCE_MS = 30_000
SOFTWARE = 'name = "Chibis-M"\ndictionary = "chibis_m"\nlink = "historical"\n'
#: On-board time of the first row [ms]: 2012-01-23, 07:33:20; 300 rows, of which 50 are missing.
BEGIN_MS = EPOCH_MS + 65_000_000_000
ROWS = [k for k in range(300) if not 100 <= k < 150]
VIEWS = ("overview", "attitude", "commands", "log", "past", "gaps")
EXTENDED = CHIBIS.down["extended"]


@pytest.fixture(scope="module")
def ground(tmp_path_factory):
    """A ground of two satellites: one with an archive, one that is heard now."""
    folder = tmp_path_factory.mktemp("ground")
    (folder / "software.toml").write_text(SOFTWARE)
    rows = [
        row("extended", BEGIN_MS + 1000 * k, BEGIN_MS + 10**9 + 1000 * k, digest=k, omega_x=k / 8)
        for k in ROWS
    ]
    archive_of(folder / "north.sqlite", [*rows, row("beacon", BEGIN_MS)])
    links = [open_link("tcp:127.0.0.1:0") for _ in "ab"]
    tables = [table(link.address, folder / "software.toml", None) for link in links]
    try:
        with serving(folder, north=tables[0], south=tables[1]) as client:
            client.south, client.folder = links[1], folder
            yield client
    finally:
        for link in links:
            link.close()


def opened(page, ground, place, query=""):
    page.goto(f"{ground.base}/?token={ground.token}#/browse/{place}?hideInspector=true{query}")
    return page


def view(name, key="north"):
    return f"torquer:{key}/torquer:{key}.view.{name}"


def let_south_be_heard(ground, ahead_s=0.0):
    """A frame of the southern satellite, whose clock is ahead."""
    values = list(decoder(EXTENDED)(bytes(EXTENDED.size)))
    values[-1] = 1e3 * (time.time() + ahead_s) - EPOCH_MS
    until(lambda: ground.south.receive() or ground.south.peers)
    ground.south.send(Downlink(CHIBIS).frame("extended", int(values[-1] / 1e3), values))


def test_an_instant_of_the_past_with_the_age_of_each_packet(page, ground):
    opened(page, ground, view("past"))
    page.get_by_label("At (UTC)").fill("2012-01-23T07:33:45")
    extended = page.locator("section[data-packet=extended]")
    cell = extended.get_by_role("row").filter(has_text="omega_x").get_by_role("cell").first
    sync_api.expect(cell).to_have_text("3.125")
    sync_api.expect(extended).to_contain_text("0.0 s old")
    sync_api.expect(page.locator("section.is-stale")).to_have_attribute("data-packet", "beacon")
    page.get_by_role("button", name="+ 1 min").press("Enter")  # by keyboard: now in the gap
    sync_api.expect(cell).to_have_text("10.625")
    page.get_by_role("button", name="+ 1 min").press("Enter")
    sync_api.expect(extended).to_contain_text("46.0 s old: stale")
    page.get_by_label("Which time").select_option("received")
    sync_api.expect(page.locator(".t-past")).to_contain_text("0 packets received by then")
    page.get_by_label("At (UTC)").fill("2012-02-03T21:20:30")
    page.get_by_label("What is shown").select_option("state")
    sync_api.expect(page.locator(".t-values__head")).to_contain_text("2012-01-23 07:33:50 UTC")


def test_gaps_are_listed_and_asked_for(page, ground):
    opened(page, ground, view("gaps"))
    line = page.get_by_role("row").filter(has_text="extended")
    sync_api.expect(line).to_contain_text("2012-01-23 07:34:59 UTC")
    sync_api.expect(line).to_contain_text("50, one each 1.0 s")
    line.get_by_role("button").press("Enter")
    sync_api.expect(line).to_contain_text(re.compile(r"no\. \d+: (waiting|sent)"))
    assert ground.get("north/sent")[0]["command"] == "replay"


def test_what_a_plot_shows_comes_as_a_file(page, ground, tmp_path):
    number = "torquer:north.packet.extended.omega_x"
    place = f"torquer:north/torquer:north.packets/torquer:north.packet.extended/{number}"
    span = f"&tc.startBound={BEGIN_MS}&tc.endBound={BEGIN_MS + 9000}"
    opened(page, ground, place, f"&tc.mode=fixed&tc.timeSystem=utc{span}")
    page.get_by_role("button", name="Export").first.click()
    with page.expect_download() as expected:
        page.get_by_role("link", name="CSV").press("Enter")
    name = "north_extended_20120123T073320Z_20120123T073329Z.csv"
    assert expected.value.suggested_filename == name
    expected.value.save_as(tmp_path / name)
    head, *lines = csv.reader((tmp_path / name).open())
    assert head[-1] == "omega_x [deg/s]" and [float(line[-1]) for line in lines] == [
        k / 8 for k in range(10)
    ]


def test_satellites_side_by_side_with_their_clocks(page, ground):
    opened(page, ground, "torquer:satellites")
    north, south = (page.locator(f"section[data-satellite={key}]") for key in ("north", "south"))
    sync_api.expect(north).to_contain_text("2012-01-23 07:38:19 UTC on board")
    for k in range(6):  # at some ten times real time
        let_south_be_heard(ground, 9.0 * k)
        time.sleep(0.7)
    sync_api.expect(south).to_contain_text("to UTC; simulated at")
    plots = page.get_by_label("Plot of a number of both")
    plots.select_option(label="extended: omega_x")
    page.wait_for_url("**/torquer:satellites.extended.omega_x**")
    page.locator(".gl-plot-tick").first.wait_for()


def test_times_are_marked_and_changed_by_one_switch(page, ground):
    let_south_be_heard(ground)
    opened(page, ground, view("past"))
    line = page.locator(".t-link", has_text="south").locator(".t-link__time")
    switch = page.locator(".t-zone")
    sync_api.expect(line).to_contain_text("UTC on board")
    switch.press("Enter")
    sync_api.expect(line).to_contain_text("local on board")
    sync_api.expect(switch).to_have_text("Times: local")
    switch.press("Enter")
    sync_api.expect(line).to_contain_text("UTC on board")


def test_views_have_room_names_and_targets(page, context, ground):
    opened(page, ground, view("overview"))
    for name in VIEWS:
        page.goto(f"{ground.base}/#/browse/{view(name)}?hideInspector=true")
        page.locator(".t-view").first.wait_for()
        page.wait_for_timeout(300)
        folded = page.locator(".l-shell__pane-tree.l-pane--collapsed")
        sync_api.expect(folded).to_have_count(int(context.width < 700))
        found = page.evaluate("""() => {
          const what = ".t-view :is(button, select, input, a), .t-zone";
          const all = [...document.querySelectorAll(what)];
          const shown = all.filter((one) => one.offsetParent && one.type !== "checkbox");
          const named = (one) => one.textContent || one.ariaLabel || one.labels?.length;
          return {
            small: shown.filter((one) => one.offsetHeight < 24).map((one) => one.outerHTML),
            nameless: shown.filter((one) => !named(one)).map((one) => one.outerHTML),
            isWide: document.documentElement.scrollWidth > innerWidth,
            view: document.querySelector(".t-view").clientWidth,
          };
        }""")
        assert (found["small"], found["nameless"], found["isWide"]) == ([], [], False), name
        assert found["view"] > 300
