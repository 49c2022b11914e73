"""The board for everybody: names for all inputs, by keys alone, without findings of axe."""

import re

import pytest
from watched_page import CHROMIUM, browser_context, serious_findings, watched_page

from torquer.compile import engine

sync_api = pytest.importorskip("playwright.sync_api")
pytest.importorskip("uvicorn")
pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium"),
]

#: Far longer than anything here takes: only a failure waits so long [ms].
PATIENCE_MS = 60_000.0
ALL_OPEN = "document.querySelectorAll('details').forEach((each) => (each.open = true))"


@pytest.fixture(scope="module", params=[1300, 400])
def context(request):
    with browser_context(request.param, 800, PATIENCE_MS) as context:
        yield context


@pytest.fixture
def page(context, served):
    with watched_page(context, "422") as page:
        page.goto(f"{served.base}/?token={served.server.token}")
        sync_api.expect(page.locator("#theory td").first).to_be_visible()
        page.evaluate(ALL_OPEN)
        yield page


def slider(page, name):
    return page.get_by_role("slider", name=name, exact=True)


def press(page, selector, text="", key="Enter"):
    """Go on with Tab to an element with a text; it must be seen to have the focus. Press a key."""
    for _ in range(600):
        page.keyboard.press("Tab")
        outline = page.evaluate(
            """([selector, text]) => {
              const element = document.activeElement;
              const name = element.ariaLabel ?? element.textContent;
              const is = element.matches(selector) && name.includes(text);
              return is ? getComputedStyle(element).outlineStyle : null;
            }""",
            [selector, text],
        )
        if outline is not None:
            assert outline != "none", f"{selector} has the focus, and nobody sees it"
            return page.keyboard.press(key)
    raise AssertionError(f"{selector} {text} is not reached")


def test_every_input_is_called_by_its_table_and_key(page):
    names = page.evaluate("""() => [...document.querySelectorAll("#form input, #form select")].map(
      (input) => {
        const ids = input.getAttribute("aria-labelledby")?.split(" ") ?? [];
        const texts = ids.map((id) => document.getElementById(id)?.textContent);
        return [input.type, input.closest("[data-table]").dataset.table, texts];
      })""")
    assert len(names) > 180
    assert all(len(texts) >= 2 and all(texts) for *_, texts in names)
    found = [(kind, table, *texts) for kind, table, texts in names]
    assert len({*found}) == len(found)  # no two that are called the same


def test_names_are_those_of_assistive_tools_with_what_they_are_about(page, data):
    inclination = page.get_by_role("textbox", name="orbit inclination [deg]", exact=True)
    sync_api.expect(inclination).to_have_value("97.6")
    sync_api.expect(inclination).to_have_accessible_description(
        re.compile("^Inclination to the equator. a number")
    )
    rate = slider(page, "initial rate [deg/s] y")
    sync_api.expect(rate).to_have_attribute("aria-valuetext", "-5 deg/s")
    sync_api.expect(slider(page, "initial euler [deg] 2")).to_have_count(1)
    sync_api.expect(page.get_by_role("combobox", name="law kind", exact=True)).to_have_value("bdot")
    sync_api.expect(page.get_by_role("button", name="take out altitude")).to_have_count(1)


def test_a_mistake_is_read_out_at_its_input(page):
    third = page.get_by_role("textbox", name="body inertia [kg m²] z", exact=True)
    third.fill("9")
    third.press("Enter")
    sync_api.expect(third).to_have_attribute("aria-invalid", "true")
    failure = page.get_by_role("alert").filter(has_text="triangle inequality")
    sync_api.expect(failure).to_be_visible()


def test_axe_has_no_serious_finding(page):
    assert serious_findings(page) == []
    page.locator("#pin").click()
    page.locator("#toml").click()
    page.locator("#text").wait_for()
    assert serious_findings(page) == []


def test_values_plots_and_view_by_keys_alone(page):
    before = page.evaluate("board.data().orbit.inclination_deg")
    press(page, "input[type=range][id='range-orbit.inclination_deg']", key="ArrowRight")
    sync_api.expect(page.locator("#form .help")).to_contain_text("Inclination to the equator")
    assert page.evaluate("board.data().orbit.inclination_deg") > before
    press(page, "button", "add wheels")
    heading = page.locator("[id='table-spacecraft.wheels']")
    sync_api.expect(heading).to_be_focused()  # where it was when the form was built again
    assert page.evaluate("board.data().spacecraft.wheels") == {}
    press(page, "[role=slider]", "time of rate", key="Home")
    time_of_rate = slider(page, "time of rate")
    sync_api.expect(time_of_rate).to_have_attribute("aria-valuetext", "0.00 h, size 9.9 deg/s")
    page.keyboard.press("PageUp")
    sync_api.expect(time_of_rate).to_have_attribute(
        "aria-valuetext", re.compile(r"^0.08 h, size 8.\d+ deg/s$")
    )
    sync_api.expect(page.locator("#view .caption")).to_contain_text("0.08 h")
    press(page, "[data-panel=rate] .u-label[role=button]", "x", key="Enter")
    shown = page.locator("[data-panel=rate] .u-label", has_text="x").first
    sync_api.expect(shown).to_have_attribute("aria-pressed", "true")


def test_the_form_can_be_skipped(page):
    press(page, ".skip", "to the plots")
    sync_api.expect(page.locator("#plots")).to_be_focused()
