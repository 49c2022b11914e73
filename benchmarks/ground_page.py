"""The ground's page in headless Chromium: first point, delay to the screen, weight, a week.

Needs playwright and Chromium. Ten frames a second come from a satellite's link. `week`: the page
stays open while a week of on-board time passes in minutes, and its memory is read after garbage
collection. Prints and writes benchmarks/ground_page.json.
"""

from __future__ import annotations

import json
import shutil
import statistics
import sys
import tempfile
import threading
import time
from pathlib import Path

from ground import EXTENDED, SOFTWARE, START_S, numbers
from playwright.sync_api import sync_playwright

from torquer.ground.file import SatelliteTable, satellite_of
from torquer.ground.server import Ground
from torquer.link import open_link
from torquer.packets.frames import Downlink
from torquer.packets.protected import TelemetrySender

HERE = Path(__file__).parent
RATE_HZ, LISTENED_S, TURNS = 10.0, 20.0, 5
#: Length of the week's stand-in, and its parts between readings of the memory.
WEEK_S, PARTS, PART_S = 7 * 86400.0, 7, 20.0
FLAGS = (
    *("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update"),
    *("--disable-sync", "--js-flags=--expose-gc", "--enable-precise-memory-info"),
)
#: A row was handed to the plots two frames ago; a plot has its axes.
SHOWN = "window.torquer?.latency.length"
DRAWN = "document.querySelector('.gl-plot-tick') && window.torquer?.latency.length"


class Satellite(threading.Thread):
    """Sends frames at a rate; `pace`: how much faster than real time its clock runs."""

    def __init__(self):
        super().__init__(daemon=True)
        self.link, self.pace, self.ended = open_link("tcp:127.0.0.1:0"), 1.0, threading.Event()

    def run(self) -> None:
        keys, made = SOFTWARE.keys, Downlink(SOFTWARE.dictionary)
        sends = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
        at_s = 0.0
        while not self.ended.wait(1.0 / RATE_HZ):
            at_s += self.pace / RATE_HZ
            self.link.receive()
            frame = made.frame("extended", START_S + at_s, numbers(at_s))
            self.link.send(sends.wrap(frame) + sends.flush())


def opened(context, ground) -> tuple:
    """A page, when its first point was shown and its axes drawn [s], bytes sent, requests away."""
    page, sent, away = context.new_page(), [], []
    client = context.new_cdp_session(page)
    client.send("Network.enable")
    client.on("Network.loadingFinished", lambda event: sent.append(event["encodedDataLength"]))
    page.on(
        "request",
        lambda asked: (
            None
            if asked.url.startswith((f"http://127.0.0.1:{ground.port}/", "data:", "blob:"))
            else away.append(asked.url)
        ),
    )
    page.goto(f"{ground.address}&measure")
    shown_ms, drawn_ms = (
        page.wait_for_function(f"({what}) && performance.now()").json_value()
        for what in (SHOWN, DRAWN)
    )
    return page, (shown_ms / 1e3, drawn_ms / 1e3), sent, away


def megabytes(page) -> float:
    """Memory of the page's scripts after garbage collection."""
    page.evaluate("gc()")
    return page.evaluate("performance.memory.usedJSHeapSize") / 1e6


def week(page, satellite: Satellite) -> list[float]:
    """Memory after each part of a week of on-board time [MB]."""
    satellite.pace = WEEK_S / (PARTS * PART_S)
    found = [megabytes(page)]
    for _ in range(PARTS):
        page.wait_for_timeout(1e3 * PART_S)
        found.append(megabytes(page))
    return found


def main() -> None:
    """Measure, print, write."""
    satellite = Satellite()
    satellite.start()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        table = SatelliteTable(link=satellite.link.address, scenario=Path(sys.argv[1]))
        ground = Ground([satellite_of("chibis_m", table)], Path(folder))
        serving = threading.Thread(target=ground.serve, daemon=True)
        serving.start()
        time.sleep(2.0)
        chromium = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        firsts, away = [], []
        for _ in range(TURNS):  # each in a new profile: nothing is kept
            context = browser.new_context(viewport={"width": 1400, "height": 850})
            page, first_s, sent, left = opened(context, ground)
            firsts.append(first_s)
            away += left
            if len(firsts) < TURNS:
                context.close()
        again, again_s, *_ = opened(context, ground)
        again.close()
        page.evaluate("window.torquer.latency.length = 0")
        page.wait_for_timeout(1e3 * LISTENED_S)
        late = sorted(page.evaluate("window.torquer.latency"))
        found = {
            "first_point_s": statistics.median(shown_s for shown_s, _ in firsts),
            "axes_s": statistics.median(drawn_s for _, drawn_s in firsts),
            "first_point_again_s": again_s[0],
            "sent_megabytes": sum(sent) / 1e6,
            "late_median_ms": statistics.median(late),
            "late_95_percent_ms": late[int(0.95 * len(late))],
            "requests_away": len(away),
            "numbers_a_row": len(EXTENDED.names),
        }
        if "--week" in sys.argv:
            found["week_megabytes"] = week(page, satellite)
        browser.close()
        satellite.ended.set()
        ground.stop()
        serving.join()
    print(json.dumps(found, indent=1))
    (HERE / "ground_page.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
