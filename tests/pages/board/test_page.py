"""The page in a browser: changes are flown, the latest wins, mistakes stand at their fields."""

import json
import time

import numpy as np
import pytest
from watched_page import CHROMIUM, browser_context, watched_page

import torquer
from torquer.compile import engine
from torquer.pages.board import routes
from torquer.scenario.load import scenario_from_text

sync_api = pytest.importorskip("playwright.sync_api")
pytest.importorskip("uvicorn")
pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium"),
]

#: Far longer than anything here takes: only a failure waits so long.
PATIENCE_S = 60.0
GAIN, INERTIA = "control.law.gain_a_m2_s_per_t", "spacecraft.body.inertia_kg_m2"


@pytest.fixture(scope="module")
def context(served):
    with browser_context(1300, 800, 1e3 * PATIENCE_S) as context:
        yield context


@pytest.fixture
def page(context, served):
    """The board's page; it must have asked nobody but its server, without errors."""
    with watched_page(context, "422") as page:
        page.goto(f"{served.base}/?token={served.server.token}")
        until(page, "document.getElementById('theory').rows.length")
        assert f"token={served.server.token}" not in page.url
        yield page


def until(page, truth):
    """Wait for a truth of the page, without eval, which the page's policy forbids."""
    end_s = time.monotonic() + PATIENCE_S
    while not page.evaluate(truth):
        assert time.monotonic() < end_s, truth
        time.sleep(0.01)


def slide(page, key, place):
    """Move a slider to a place 0..1000."""
    page.locator(f"[data-slider='{key}']").evaluate(
        "(slider, place) => { slider.value = place; slider.dispatchEvent(new Event('input')); }",
        place,
    )


def settled(page):
    until(page, "!board.counts.inFlight && !document.querySelector('#plots.is-stale')")


def flown(page):
    """The size of the rate that is drawn [deg/s]."""
    return page.evaluate("board.shown()")


def test_what_is_drawn_is_simulated_to_the_bit(page, text):
    slide(page, GAIN, 800)
    settled(page)
    gain = page.evaluate("board.data().control.law.gain_a_m2_s_per_t")
    assert gain == pytest.approx(2e3 * 100**0.8, rel=1e-3)
    other = text.replace("gain_a_m2_s_per_t = 2e4", f"gain_a_m2_s_per_t = {gain!r}")
    result = torquer.simulate(scenario_from_text(other))
    rate = np.degrees(np.linalg.norm(result["omega_body"].values, axis=1))
    assert np.array_equal(np.array(flown(page)), rate)


def test_the_latest_of_many_changes_wins(page):
    page.evaluate("Object.assign(board.counts, { begun: 0, most: 0 })")
    page.locator(f"[data-slider='{GAIN}']").evaluate(
        """async (slider) => {
          for (let i = 0; i < 100; i++) {
            slider.value = 401 + i;
            slider.dispatchEvent(new Event("input"));
            await new Promise((done) => setTimeout(done, 5));
          }
        }"""
    )
    settled(page)
    shown = page.locator(f"[data-number='{GAIN}']").input_value()
    assert page.evaluate("board.data().control.law.gain_a_m2_s_per_t") == float(shown)
    assert float(shown) == pytest.approx(2e3 * 100**0.5, rel=1e-3)
    counts = page.evaluate("board.counts")
    assert counts["most"] == 1 and 1 <= counts["begun"] < 100
    assert page.evaluate("board.flownData().control.law.gain_a_m2_s_per_t") == float(shown)


def test_a_mistake_stands_at_its_slider_and_the_plots_stay(page):
    before = flown(page)
    slide(page, f"{INERTIA}[2]", 1000)
    failure = page.locator(f"[data-key='{INERTIA}'] .failure")
    sync_api.expect(failure).to_contain_text("triangle inequality")
    assert flown(page) == before
    assert page.locator("#plots.is-stale").count() == 1
    page.locator("#undo").click()
    settled(page)
    sync_api.expect(page.locator(f"[data-key='{INERTIA}'] .failure")).to_be_hidden()
    assert flown(page) == before


FRESH = """() => {
  window.fresh = [];
  for (const id of ["plots", "view"]) {
    const box = document.getElementById(id);
    new MutationObserver(() => box.matches(".is-stale") || fresh.push(id)).observe(
      box, { attributes: true, attributeFilter: ["class"] });
  }
}"""


def test_processor_draws_the_plots_and_the_3d_view_follows_them(page):
    attributes = "document.querySelector('.plot canvas').getContext('2d').getContextAttributes()"
    assert page.evaluate(attributes)["willReadFrequently"]
    until(page, "!document.querySelector('.is-stale')")
    page.evaluate(FRESH)
    slide(page, GAIN, 640)
    until(page, "fresh.includes('view')")
    assert page.evaluate("fresh") == ["plots", "view"]


@pytest.mark.slow
def test_stale_plots_look_stale_until_the_run_is_there(page, monkeypatch):
    fly, go = routes.fly, []

    def slow(*given):
        while not go:
            time.sleep(0.01)
        return fly(*given)

    monkeypatch.setattr(routes, "fly", slow)
    slide(page, GAIN, 650)
    sync_api.expect(page.locator("#plots.is-stale")).to_have_count(1)
    go.append(True)
    settled(page)


@pytest.mark.slow
def test_address_holds_the_scenario_and_toml_goes_both_ways(page, context):
    slide(page, GAIN, 750)
    settled(page)
    until(page, "location.hash.startsWith('#s=')")
    time.sleep(0.5)
    gain = page.evaluate("board.data().control.law.gain_a_m2_s_per_t")
    other = context.new_page()
    other.goto(page.url)
    until(other, "window.board && board.redraws.length")
    assert other.evaluate("board.data()") == page.evaluate("board.data()")
    other.close()
    page.locator("#toml").click()
    area = page.locator("#text textarea")
    until(page, "document.querySelector('#text').open")
    written = area.input_value()
    assert f"gain_a_m2_s_per_t = {json.dumps(gain).removesuffix('.0')}" in written
    area.fill("orbit = [")
    page.locator("[data-do=use]").click()
    sync_api.expect(page.locator("#text .failure")).to_contain_text("must be TOML")
    area.fill(written.replace("altitude_km = 550", "altitude_km = 700"))
    page.locator("[data-do=use]").click()
    until(page, "!document.querySelector('#text').open")
    sync_api.expect(page.locator("[data-number='orbit.altitude_km']")).to_have_value("700")


def test_early_mistake_stands_at_its_field_in_the_form(page):
    def late(route):
        until(page, "document.querySelector('#state').textContent.startsWith('not flown')")
        route.continue_()

    page.route("**/api/form", late)
    page.locator("[data-kind='control.law']").select_option("bdot_rate")
    sync_api.expect(page.locator(f"[data-number='{GAIN}']")).to_have_value("")  # of the new form
    sync_api.expect(page.locator(f"[data-key='{GAIN}'] .failure")).to_contain_text("must be given")
    assert page.locator("#errors li").count() == 0


@pytest.mark.slow
def test_pins_are_compared_and_another_law_has_its_own_fields(page):
    page.locator("#pin").click()
    slide(page, GAIN, 900)
    settled(page)
    row = page.locator("#pins tr").first
    sync_api.expect(row).to_contain_text("pin 1")
    sync_api.expect(row).to_contain_text("gain_a_m2_s_per_t")
    page.locator("[data-kind='control.law']").select_option("bdot_rate")
    sync_api.expect(page.locator(f"[data-key='{GAIN}'] .failure")).to_contain_text("must be given")
    field = page.locator(f"[data-number='{GAIN}']")
    field.fill("2e4")
    field.press("Enter")
    settled(page)
    assert page.evaluate("board.data().control.law") == {
        "kind": "bdot_rate",
        "gain_a_m2_s_per_t": 20000,
    }


def test_it_can_be_used_at_a_width_of_400(page):
    page.set_viewport_size({"width": 400, "height": 800})
    until(page, "document.querySelector('.plot canvas').clientWidth <= 400")
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
    slide(page, GAIN, 620)
    settled(page)
    box = page.locator(f"[data-slider='{GAIN}']")
    box.scroll_into_view_if_needed()
    assert box.bounding_box()["width"] > 150
    plot = page.locator("[data-panel=rate] canvas").bounding_box()
    assert plot["y"] + plot["height"] > 0  # it stays in view next to the sliders


@pytest.mark.slow
def test_memory_stays_flat_under_two_changes_a_second(page, context):
    tools = context.new_cdp_session(page)

    def used():
        tools.send("HeapProfiler.collectGarbage")
        return page.evaluate("performance.memory.usedJSHeapSize")

    sizes = []
    for part in range(6):
        for i in range(60):
            slide(page, GAIN, 300 + (60 * part + i) % 400)
            time.sleep(0.1)
        settled(page)
        sizes.append(used())
    assert sizes[-1] - sizes[1] < 3e6  # 240 changes later


@pytest.mark.slow
def test_the_band_of_the_starts_is_drawn(page):
    page.locator("#starts").click()
    end_s = time.monotonic() + 900.0
    while "256 of 256" not in page.locator("#starts").inner_text():
        assert time.monotonic() < end_s
        time.sleep(0.2)
    sync_api.expect(page.locator("[data-panel=rate] .u-legend")).to_contain_text("starts: median")
    slide(page, GAIN, 700)
    sync_api.expect(page.locator("#starts")).to_have_text("256 starts")
