"""The ground's page in headless Chromium: first point, delay to the screen, weight.

Needs playwright and Chromium; the argument is a scenario. Ten frames a second come from a
satellite's link. Each opening is by a browser that has just been started, with a new profile or
with one that has seen the page before. Chromium without a graphics card puts its window together
without WebGL, and draws WebGL by software. Prints and writes benchmarks/ground_page.json.
"""

from __future__ import annotations

import json
import shutil
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ground import EXTENDED, SOFTWARE, START_S, numbers
from playwright.sync_api import sync_playwright

from torquer.flight.link import open_link
from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.protected import TelemetrySender
from torquer.ground.file import SatelliteTable, make_satellite
from torquer.pages.ground.server import Ground

HERE = Path(__file__).parent
RATE_HZ, LISTENED_S, TURNS = 10.0, 20.0, 5
#: Chromium keeps what it has compiled of a script that it has seen before.
SEEN = 2
#: Frames that fill the 15 minutes which plots show, and how many of them are sent a second.
FULL, FULL_HZ = 9000, 500.0
FLAGS = (
    *("--no-sandbox", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
#: A row was handed to the plots two frames ago; a plot has its axes.
SHOWN = "window.torquer?.latency.length"
DRAWN = f"document.querySelector('.gl-plot-tick') && {SHOWN}"
VIEWS = {
    "overview": "",
    "single_plot": "#/browse/torquer:chibis_m/torquer:chibis_m.plot.extended.omega",
}


class Satellite(threading.Thread):
    """Sends frames at a rate, by a clock on which they are a tenth of a second apart."""

    def __init__(self):
        super().__init__(daemon=True)
        self.link, self.rate_hz = open_link("tcp:127.0.0.1:0"), RATE_HZ
        self.sent, self.ended = 0, threading.Event()

    def run(self) -> None:
        send = sender(self.link)
        while not self.ended.wait(1.0 / self.rate_hz):
            at_s = self.sent / RATE_HZ
            send("extended", at_s, numbers(at_s))
            self.sent += 1


def sender(link):
    """`send(packet, at_s, numbers)` on a satellite's link, in protected frames."""
    keys, made = SOFTWARE.keys, Downlink(SOFTWARE.dictionary)
    sends = TelemetrySender(keys.down, keys.spi, keys.spacecraft)

    def send(packet: str, at_s: float, values: list) -> None:
        link.receive()
        link.send(sends.wrap(made.frame(packet, START_S + at_s, values)) + sends.flush())

    return send


@contextmanager
def serving(link, scenario: Path) -> Iterator[Ground]:
    """A ground that is connected to a satellite's link."""
    with tempfile.TemporaryDirectory() as folder:
        table = SatelliteTable(link=link.address, scenario=scenario)
        ground = Ground([make_satellite("chibis_m", table)], Path(folder))
        thread = threading.Thread(target=ground.serve, daemon=True)
        thread.start()
        time.sleep(2.0)
        yield ground
        ground.stop()
        thread.join()


@contextmanager
def browser(playwright, profile: str) -> Iterator:
    """A browser that has just been started, its files in the folder `profile`."""
    context = playwright.chromium.launch_persistent_context(
        profile,
        executable_path=shutil.which("chromium"),
        args=list(FLAGS),
        viewport={"width": 1400, "height": 850},
    )
    yield context
    context.close()


def opened(context, address: str) -> tuple:
    """A page, and when its first point was shown and its axes drawn [s]."""
    page = context.pages[0]
    page.goto(address)
    at_ms = [page.wait_for_function(f"({w}) && performance.now()") for w in (SHOWN, DRAWN)]
    return page, *(1e-3 * ms.json_value() for ms in at_ms)


def openings(playwright, address: str, is_new: bool) -> dict[str, float]:
    """Medians of times to the first point and to the axes [s]."""
    folder, found = tempfile.TemporaryDirectory, []
    with folder() as kept:
        for _ in range(TURNS if is_new else TURNS + SEEN):
            with folder() as new, browser(playwright, new if is_new else kept) as context:
                found.append(opened(context, address)[1:])
                context.pages[0].wait_for_timeout(1e3)  # in which Chromium writes what it keeps
    shown_s, drawn_s = (statistics.median(each) for each in zip(*found[-TURNS:], strict=True))
    return {"first_point_s": shown_s, "axes_s": drawn_s}


def delays(page) -> dict[str, float]:
    """From the reception of a row to the second frame on screen [ms]."""
    page.evaluate("window.torquer.latency.length = 0")
    page.wait_for_timeout(1e3 * LISTENED_S)
    late = sorted(page.evaluate("window.torquer.latency"))
    return {"median_ms": statistics.median(late), "95_percent_ms": late[int(0.95 * len(late))]}


def weight(context, address: str) -> dict[str, float]:
    """What is sent to a new page, and how many requests leave this machine."""
    page, sent, asked = context.pages[0], [], []
    client = context.new_cdp_session(page)
    client.send("Network.enable")
    client.on("Network.loadingFinished", lambda event: sent.append(event["encodedDataLength"]))
    page.on("request", lambda request: asked.append(request.url))
    opened(context, address)
    own = address.partition("?")[0]
    away = [url for url in asked if not url.startswith((own, "data:", "blob:"))]
    return {"sent_megabytes": sum(sent) / 1e6, "requests_away": len(away)}


def measured(playwright, ground: Ground, satellite: Satellite) -> dict:
    """All of it, by name."""
    address = f"{ground.address}&measure"
    found: dict = {"numbers_a_row": len(EXTENDED.names)}
    for view, place in VIEWS.items():
        for what, is_new in (("new_profile", True), ("profile_kept", False)):
            found[f"{view}, {what}"] = openings(playwright, f"{address}{place}", is_new)
    with tempfile.TemporaryDirectory() as new, browser(playwright, new) as context:
        found |= weight(context, address)
        page = context.pages[0]
        found["delay"] = delays(page)
        last, satellite.rate_hz = satellite.sent + FULL, FULL_HZ
        while satellite.sent < last:
            page.wait_for_timeout(100)
        satellite.rate_hz = RATE_HZ
        found["delay, plots full"] = delays(page)
    return found


def main() -> None:
    """Measure, print, write."""
    satellite = Satellite()
    satellite.start()
    with serving(satellite.link, Path(sys.argv[1])) as ground, sync_playwright() as playwright:
        found = measured(playwright, ground, satellite)
        satellite.ended.set()
    print(json.dumps(found, indent=1))
    (HERE / "ground_page.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
