"""A week at 1 Hz in an open page: 604 800 rows through link, archive and websocket to a plot.

Needs playwright and Chromium; the arguments are a scenario, a view and a number of days [the plot
of a vector, 7]. Rows come as fast as the page takes them, each a second of on-board time after the
one before, with states and an entry of the log a minute. After each day the memory of the page's
scripts after garbage collection is read, with the elements of the page and the memory of this
process, which is the ground. Prints and adds to benchmarks/ground_week.json.
"""

from __future__ import annotations

import json
import sys
import tempfile
import threading
import time
from pathlib import Path

from ground import START_S, numbers
from ground_page import VIEWS, browser, sender, serving
from playwright.sync_api import sync_playwright

from torquer.flight.link import open_link
from torquer.flight.packets.reasons import Reason

HERE = Path(__file__).parent
DAY = 86_400
#: Rows sent at a time, the pause after them [s], and how far they may be ahead of the page: the
#: ground drops rows for a browser for which 64 wait.
BURST, PAUSE_S, AHEAD = 60, 0.01, 60
PATIENCE_S = 60.0
#: Counts the rows that come to the page; the first ones are sent before it is open.
COUNTED = (
    f"window.rows = {BURST};"
    + """
window.WebSocket = class extends WebSocket {
  constructor(...given) {
    super(...given);
    this.addEventListener("message", ({ data }) => {
      const { rows = [] } = JSON.parse(data);
      const seconds = rows.filter(([, packet]) => packet === "extended").length;
      if (seconds) window.passed((window.rows += seconds));
    });
  }
};
"""
)


class Satellite(threading.Thread):
    """Sends seconds up to `until`, no more than `AHEAD` before the page has them."""

    def __init__(self):
        super().__init__(daemon=True)
        self.link, self.until = open_link("tcp:127.0.0.1:0"), 0
        self.sent = self.passed = 0

    def run(self) -> None:
        send = sender(self.link)
        while True:
            last = min(self.until, self.passed + AHEAD, self.sent + BURST)
            for second in range(self.sent, last):
                send("extended", second, numbers(second))
                if second % 60 == 0:
                    send("modes", second, [second // 60 % 3] * 32)
                    send("event", second, [1, Reason.MODE_CHANGED, 0, 1e3 * (START_S + second)])
            self.sent = last
            time.sleep(PAUSE_S)

    def note(self, passed: int) -> None:
        """Take from the page how many rows it has."""
        self.passed = passed


def reach(page, satellite: Satellite, until: int) -> None:
    """Send rows and wait until the page has all of them up to `until`."""
    satellite.until, before = until, -1
    while satellite.passed < until:
        if satellite.passed == before:
            raise SystemExit(f"rows: {satellite.sent} sent, {before} came to the page")
        before, due = satellite.passed, time.monotonic() + PATIENCE_S
        while satellite.passed < until and time.monotonic() < due:
            page.wait_for_timeout(200)


def state(page, client) -> dict[str, float]:
    """Memory of scripts after garbage collection, elements, listeners, memory of the ground."""
    page.wait_for_timeout(1e3)
    client.send("HeapProfiler.collectGarbage")
    found = {one["name"]: one["value"] for one in client.send("Performance.getMetrics")["metrics"]}
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return {
        "script_megabytes": found["JSHeapUsedSize"] / 1e6,
        "nodes": found["Nodes"],
        "listeners": found["JSEventListeners"],
        "ground_megabytes": 4096 * pages / 1e6,
    }


def week(view: str, days: int, scenario: Path) -> dict:
    """Send days past a page; what was found after an hour and each day."""
    satellite, found = Satellite(), []
    satellite.start()
    with (
        serving(satellite.link, scenario) as ground,
        sync_playwright() as playwright,
        tempfile.TemporaryDirectory() as profile,
        browser(playwright, profile) as context,
    ):
        page, begun = context.pages[0], time.monotonic()
        satellite.until = BURST
        page.expose_function("passed", satellite.note)
        page.add_init_script(COUNTED)
        page.wait_for_timeout(1e3)
        page.goto(f"{ground.address}{VIEWS[view]}")
        page.locator(".gl-plot-tick").first.wait_for()
        satellite.note(BURST)
        client = context.new_cdp_session(page)
        client.send("Performance.enable")
        for until in (3600, *range(DAY, (days + 1) * DAY, DAY)):
            reach(page, satellite, until)
            found.append({"rows": until, **state(page, client)})
            print(found[-1], f"{time.monotonic() - begun:.0f} s", flush=True)
        last = page.locator(".t-link__time").text_content()
        page.screenshot(path=f"{tempfile.gettempdir()}/ground_week.png")
    return {"days": found, "seconds": time.monotonic() - begun, "last": last}


def main() -> None:
    """Measure, print, write."""
    _, scenario, view, days = (*sys.argv, "single_plot", "7")[:4]
    place = HERE / "ground_week.json"
    found = json.loads(place.read_text()) if place.exists() else {}
    found[view] = week(view, int(days), Path(scenario))
    place.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
