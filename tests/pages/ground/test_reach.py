"""The page for everybody: by keys alone, on wide and narrow screens, without findings of axe."""

import time

import pytest
from ground_flight import serving, table, until
from small_satellite import command, received, small_satellite
from watched_page import CHROMIUM, serious_findings

from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.software_file import load_link

sync_api = pytest.importorskip("playwright.sync_api")
pytest.importorskip("uvicorn")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")

#: Far longer than anything here takes: only a failure waits so long [ms].
PATIENCE_MS = 40_000
VIEWS = (
    *("alarms", "attitude", "commands", "gaps", "history", "log", "overview", "past"),
    *("plan", "stack", "state"),
)
PACKET = "torquer:sat/torquer:sat.packets/torquer:sat.packet.parameter"
PLACES = [
    *(f"torquer:sat/torquer:sat.view.{view}" for view in VIEWS),
    *(
        "torquer:alarms",
        "torquer:satellites",
        PACKET,
        f"{PACKET}/torquer:sat.packet.parameter.value",
    ),
]


@pytest.fixture(scope="module")
def ground(tmp_path_factory):
    """A ground that hears one satellite, with an alarm and commands, and another one never."""
    packets = load_link().dictionary
    values = dict.fromkeys(packets.down["housekeeping"].names, 0.0) | {"coils_current": 9.0}
    frame = Downlink(packets).frame("housekeeping", 1000, tuple(values.values()))
    with small_satellite() as satellite:
        tables = {
            "sat": table(satellite.address, in_scenario=None),
            "unheard": table("udp:127.0.0.1:0", in_scenario=None),
        }
        with serving(tmp_path_factory.mktemp("ground"), **tables) as client:
            until(lambda: received(client))
            satellite.injected = iter([satellite.wrap(frame)])
            until(lambda: client.get("sat/alarms")["alarms"])
            assert command(client) == "executed"
            for refused in ({"origin": "http://127.0.0.1:1"}, {"authorization": "Bearer x"}):
                client.raw("/", **refused)
            yield client


def opened(page, ground, place):
    page.goto(
        f"{ground.base}/?token={ground.token}&{time.time()}#/browse/{place}?hideInspector=true"
    )
    page.locator(".t-view, .gl-plot").first.wait_for()
    return page


def view(name):
    return f"torquer:sat/torquer:sat.view.{name}"


# Keys


def press(page, selector, text="", key="Enter"):
    """Go on with Tab to an element with a text; it must be seen to have the focus. Press a key."""
    focused = """([selector, text]) => {
      const element = document.activeElement;
      if (!element.matches(selector) || !element.textContent.includes(text)) return null;
      const style = getComputedStyle(element);
      const isSeen = element.checkVisibility({ visibilityProperty: true });
      return isSeen && style.outlineStyle === "solid";
    }"""
    for _ in range(300):
        page.keyboard.press("Tab")
        is_seen = page.evaluate(focused, [selector, text])
        if is_seen is not None:
            assert is_seen, f"{selector} has the focus, and nobody sees it"
            return page.keyboard.press(key) if key else None
    raise AssertionError(f"{selector} {text} is not reached")


def go(page, context, name):
    """Open a view of the tree, which is folded on a narrow screen."""
    if context.width < 700:
        press(page, ".l-pane__expand-button[aria-label='Expand Browse Pane']")
    press(page, ".c-tree__item__label", name)


def test_commands_history_and_alarms_by_keys_alone(page, context, ground):
    opened(page, ground, view("log"))
    go(page, context, "Commands")
    press(page, "button[data-command=get_parameter]")
    press(page, ".t-form [name=index]", key="1")
    press(page, ".t-send")
    sent = page.locator("tr[data-command=get_parameter][data-state=executed]")
    sync_api.expect(sent.filter(has_text="index = 1").first).to_contain_text("page")
    go(page, context, "Command history")
    press(page, ".t-history [name=by]", key="p")
    sync_api.expect(page.locator(".t-history [role=status]")).to_contain_text("newest first")
    go(page, context, "Alarms")
    press(page, ".t-alarms tr button[aria-label='Shelve housekeeping.coils_current']", key="")
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Enter")
    line = page.locator("tr[data-key='housekeeping.coils_current']")
    sync_api.expect(line).to_have_attribute("data-alarm", "acknowledged")


def test_a_span_is_selected_by_keys_alone(page, ground):
    opened(page, ground, view("log"))
    press(page, ".c-compact-tc__gear")
    press(page, "[aria-label='Time Conductor Mode Menu']")
    press(page, "[role=menuitem]", "Fixed")
    press(page, "input[aria-label='Start time']", key="Control+a")
    page.keyboard.type("00:01:00")
    press(page, "[aria-label='Submit time bounds']")
    page.wait_for_url("**tc.mode=fixed**")
    sync_api.expect(page.locator(".t-log [role=status]")).to_contain_text("of the time span")


# Screens


def test_tables_are_as_wide_as_the_screen_and_offer_only_what_there_is(page, ground):
    for name in ("history", "commands", "plan", "gaps", "log", "alarms"):
        opened(page, ground, view(name))
        page.locator("tbody").first.wait_for(state="attached")
        page.wait_for_timeout(300)
        wide = page.evaluate("""() => [...document.querySelectorAll(".t-scroll, .t-wide")]
          .filter((element) => element.scrollWidth > element.clientWidth + 1)
          .map((element) => element.className)""")
        assert wide == [], name
        if name == "history":
            sync_api.expect(page.locator("tr[data-state=executed]").last).to_be_visible()
            assert not page.get_by_role("button", name="Older ones").is_visible()


def test_each_of_two_satellites_has_a_line_of_the_status(page, context, ground):
    opened(page, ground, view("log"))
    lines = page.locator(".t-link:has(.t-link__state)")
    heard = lines.filter(has_text="simulated at")
    sync_api.expect(heard).to_contain_text("another epoch")
    heights = lines.evaluate_all("""(each) => each.map((line) => {
      const parts = [...line.children].filter((part) => part.textContent);
      const boxes = parts.map((part) => part.getBoundingClientRect());
      return Math.max(...boxes.map((b) => b.bottom)) - Math.min(...boxes.map((b) => b.top));
    })""")
    assert len(heights) == 2
    assert context.width < 700 or max(heights) < 20, "one line, with all there is to be said"


def test_a_log_of_no_span_says_so_in_place_of_entries(page, ground):
    opened(page, ground, view("log"))
    page.locator(".t-log td", has_text="link found").wait_for()
    page.get_by_label("From (on board, UTC)").fill("2026-01-02T00:00:00")
    page.get_by_label("To (on board, UTC)").fill("2026-01-01T00:00:00")
    said = page.locator(".t-log [role=status]")
    sync_api.expect(said).to_contain_text("end: must not be before start")
    sync_api.expect(page.locator(".t-log__lines tbody tr")).to_have_count(0)
    page.get_by_label("To (on board, UTC)").fill("")
    sync_api.expect(said).to_contain_text("newest first, live")


def test_the_log_of_an_overview_shows_several_lines(page, ground):
    opened(page, ground, view("overview"))
    lines = page.locator(".t-log__lines tbody tr")
    sync_api.expect(lines.nth(3)).to_be_attached()
    lines.first.scroll_into_view_if_needed()
    seen = page.evaluate("""() => {
      const box = document.querySelector(".t-log .t-scroll").getBoundingClientRect();
      const lines = [...document.querySelectorAll(".t-log__lines tbody tr")];
      return lines.filter((line) => line.getBoundingClientRect().bottom <= box.bottom + 1).length;
    }""")
    assert seen >= 4


def test_a_satellite_that_was_never_heard_has_no_time(page, ground):
    opened(page, ground, "torquer:satellites")
    times = page.locator(".t-link__time, .t-side__clock")
    sync_api.expect(times.filter(has_text="on-board time unknown")).to_have_count(2)
    sync_api.expect(times.filter(has_text="UTC on board")).to_have_count(2)


# Who hears the page


@pytest.mark.slow
def test_axe_has_no_serious_finding(page, ground):
    for place in PLACES:
        opened(page, ground, place)
        page.wait_for_timeout(1500)
        assert serious_findings(page) == [], place
