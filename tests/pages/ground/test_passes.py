"""Passes in the page: routes, what they refuse, and the view in a browser."""

import contextlib
import json
import threading
import time

import pytest
from ground_flight import PATIENCE_S, Client, flying
from station_skies import TARUSA
from watched_page import CHROMIUM, browser_context, watched_page

from torquer.compile import engine
from torquer.ground.file import SatelliteTable, make_satellite
from torquer.ground.footprint import coastline
from torquer.ground.passes import find_passes
from torquer.pages.ground.server import Ground
from torquer.scenario.load import load_scenario

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
SCENARIO = "examples/chibis_m_day.toml"
HOUR_MS = 3_600_000
VIEW = "#/browse/torquer:chibis/torquer:chibis.view.passes?hideInspector=true&hideTree=true"


@contextlib.contextmanager
def serving(folder, **satellites):
    """A client of a ground with satellites of (table, stations)."""
    made = [make_satellite(key, table, stations) for key, (table, stations) in satellites.items()]
    folder.mkdir(exist_ok=True)
    ground, ready = Ground(made, folder, 0), threading.Event()
    thread = threading.Thread(target=ground.serve, args=(ready.set,), daemon=True)
    thread.start()
    assert ready.wait(PATIENCE_S)
    try:
        client = Client(ground)
        client.ground = ground
        yield client
    finally:
        ground.stop()
        thread.join(PATIENCE_S)
        assert not thread.is_alive() and not ground.unarchived


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with flying() as flight:
        table = SatelliteTable(
            link=flight.address, scenario=SCENARIO, downlink_hz=435e6, downlink={"bit_s": 9600.0}
        )
        none = SatelliteTable(link="udp:127.0.0.1:0", scenario=SCENARIO)
        lost = none.model_copy(update={"scenario": None})
        with serving(
            tmp_path_factory.mktemp("ground"),
            chibis=(table, {"tarusa": TARUSA}),
            none=(none, {}),
            lost=(lost, {"tarusa": TARUSA}),
        ) as made:
            made.value("omega_x")
            yield made


def refused(client, path):
    """(status, line) of an answer that is an error."""
    status, body, _ = client.raw(f"/api/{path}")
    answer = json.loads(body)
    assert set(answer) == {"error"} and "\n" not in answer["error"]
    return status, answer["error"]


# Routes


def test_passes_by_the_clock_of_a_satellite_of_another_epoch(client):
    before = client.get("satellites")[0]["clock_ms"]
    found = client.get("chibis/passes")
    assert found["clock"] == "satellite" and before <= found["now_ms"] <= before + HOUR_MS
    assert found["stations"] == ["tarusa"] and found["frequency_hz"] == 435e6
    assert found["orbit"] == "that of the scenario chibis_m_day" and found["elements"] is None
    around = load_scenario(SCENARIO).orbit_environment()
    minute_ms = found["now_ms"] // 60_000 * 60_000
    expected = find_passes(
        around, {"tarusa": TARUSA}, minute_ms - 3 * HOUR_MS, minute_ms + 24 * HOUR_MS
    )
    # the start may have been a minute before: only a pass that it cuts would differ
    ours = [(each["aos"]["time_ms"], each["los"]["time_ms"]) for each in found["passes"]]
    assert ours[1:] == [(each.aos.time_ms, each.los.time_ms) for each in expected[1:]]
    assert found["passes"][0]["downlink"]["stored"][0]["packet"] == "stored"


def test_a_short_list(client):
    assert len(client.get("chibis/passes?hours=2")["passes"]) < 6


def test_only_satellites_with_stations_and_an_orbit_have_passes(client):
    has = {each["key"]: each["has"]["passes"] for each in client.get("satellites")}
    assert has == {"chibis": True, "none": False, "lost": False}
    for key in ("none", "lost", "other"):
        for route in ("passes", "map?time=0", "report?start=0&end=1"):
            assert refused(client, f"{key}/{route}")[0] == 404


def test_the_map_is_of_the_time_asked_for(client):
    now_ms = client.get("chibis/passes")["now_ms"]
    one, other = (client.get(f"chibis/map?time={now_ms + k * 600_000}") for k in (0, 1))
    assert one["time_ms"] == now_ms and one["at"] != other["at"]
    assert [each["name"] for each in one["stations"]] == ["tarusa"]
    assert client.get("coastline")[0][0] == list(coastline()[0][0])


def test_the_report_is_a_page_without_scripts(client):
    now_ms = client.get("satellites")[0]["clock_ms"]
    path = f"/api/chibis/report?start={now_ms - 60_000}&end={now_ms}&station=tarusa"
    status, body, headers = client.raw(path)
    assert status == 200 and headers["content-type"].startswith("text/html")
    assert b"<script" not in body and b"Packets received" in body and b"extended" in body
    assert "content-security-policy" in headers


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("passes?hours=0", "hours: must"),
        ("passes?hours=241", "hours: must"),
        ("passes?hours=nan", "hours: must"),
        ("passes?hours=x", "hours: must"),
        ("passes?minutes=1", "minutes: must be a known key"),
        ("map", "time: must be given"),
        ("map?time=x", "time: must"),
        ("map?time=1e300", "time: must"),
        ("map?time=-1e300", "time: must"),
        ("map?time=inf", "time: must"),
        ("report?end=1", "start: must be given"),
        ("report?start=0&end=-1", "end: must not be before start; received -1"),
        ("report?start=0&end=1e12", "end: must be at most a day after the start"),
        ("report?start=nan&end=1", "start: must"),
        ("report?start=0&end=" + "9" * 400, "end: must"),
        ("report?start=0&end=1&station=" + "x" * 101, "station: must"),
    ],
)
def test_what_browsers_ask_is_checked(client, path, text):
    status, line = refused(client, f"chibis/{path}")
    assert status == 400 and line.startswith(text)


@pytest.mark.parametrize("station", ["none", "nan", "7", "%3Cscript%3E", "%00"])
def test_a_report_over_no_station_has_no_prediction(client, station):
    status, body, _ = client.raw(f"/api/chibis/report?start=0&end=1&station={station}")
    assert status == 200 and b"data:image" not in body and b"<script" not in body


def test_a_clock_that_was_reset_on_board_does_not_count(tmp_path):
    """Elements of today, and a satellite that thinks it is 2010: the ground's clock is right."""
    tle = tmp_path / "now.tle"
    tle.write_text(elements_of_now(), encoding="utf-8")
    table = SatelliteTable(link="udp:127.0.0.1:0", elements=tle)
    with serving(tmp_path / "ground", sat=(table, {"tarusa": TARUSA})) as client:
        found = client.get("sat/passes")
        assert found["clock"] == "ground" and abs(found["now_ms"] - 1e3 * time.time()) < 60_000
        assert abs(found["elements"]["age_days"]) < 1.0
        contact = client.ground.contacts["sat"]
        contact.clock.hear(1_262_304_000_000)
        assert client.get("sat/passes")["clock"] == "ground"
        tle.write_text("nothing\n", encoding="utf-8")
        status, line = refused(client, "sat/passes?hours=1")
        assert status == 400 and line.startswith("elements: ")


def elements_of_now():
    """Two lines of Chibis-M with today's epoch."""
    from station_skies import CHIBIS

    from torquer.environment.orbit.sgp4 import checksum

    first = CHIBIS[0][:18] + time.strftime("%y%j", time.gmtime()) + ".00000000" + CHIBIS[0][32:68]
    return f"{first}{checksum(first + '0')}\n{CHIBIS[1]}\n"


# The view


@pytest.fixture(scope="module")
def context():
    with browser_context(1280, 800, 40_000) as context:
        yield context


@pytest.fixture
def page(context, client):
    with watched_page(context, "400 (Bad Request)") as page:
        page.goto(f"{client.base}/?token={client.token}{VIEW}")
        page.locator(".t-passes tbody tr").first.wait_for()
        yield page


@needs_browser
def test_the_view_lists_passes_by_the_clock_on_board(page, client):
    found = client.get("chibis/passes")
    rows = page.locator(".t-passes tbody tr")
    sync_api.expect(rows).to_have_count(len(found["passes"]))
    clock = page.locator("[data-role=clock]")
    sync_api.expect(clock).to_contain_text("2012-03-04")
    sync_api.expect(clock).to_contain_text("UTC, by the satellite's clock")
    sync_api.expect(page.locator("[data-role=orbit]")).to_contain_text("scenario chibis_m_day")
    first = rows.filter(has_text="in ").first
    sync_api.expect(first).to_contain_text("tarusa")
    sync_api.expect(page.locator(".t-next")).to_contain_text("Chibis-M (chibis): ")
    sync_api.expect(page.locator(".t-next")).to_contain_text("tarusa")


@needs_browser
def test_the_map_and_the_sky_say_what_they_show(page):
    label = page.locator(".t-map")
    page.locator(".t-map__here[cx]").wait_for(state="attached")
    assert "Map: the satellite is over" in label.get_attribute("aria-label")
    assert page.locator(".t-map__station").count() == 1
    assert page.locator(".t-map__track").count() == 2
    assert page.locator(".t-map__land").get_attribute("d").count("M") == len(coastline())
    assert "Sky over tarusa" in page.locator(".t-sky").get_attribute("aria-label")


@needs_browser
def test_a_pass_is_chosen_with_the_keyboard(page):
    names = page.locator(".t-pass__name")
    last = names.nth(names.count() - 1)
    before = page.locator(".t-sky").get_attribute("aria-label")
    last.focus()
    page.keyboard.press("Enter")
    sync_api.expect(last).to_have_attribute("aria-pressed", "true")
    assert page.locator(".t-pass__name[aria-pressed=true]").count() == 1
    assert page.locator(".t-sky").get_attribute("aria-label") != before


@needs_browser
def test_a_past_pass_has_its_report(page, context):
    link = page.locator(".t-passes tr[data-state=past] a").first
    with context.expect_page() as opened:
        link.click()
    report = opened.value
    sync_api.expect(report.locator("h1")).to_contain_text("chibis over tarusa")
    report.close()


@needs_browser
def test_nothing_hangs_over_at_400_pixels(context, client):
    with watched_page(context, "400 (Bad Request)") as page:
        page.set_viewport_size({"width": 400, "height": 800})
        page.goto(f"{client.base}/?token={client.token}{VIEW}")
        page.locator(".t-map__here[cx]").wait_for(state="attached")
        wide = page.locator(".t-passes").evaluate("(box) => box.scrollWidth - box.clientWidth")
        assert wide <= 0
        height = page.locator(".t-sky").evaluate("(box) => box.getBoundingClientRect().height")
        assert height > 150
