"""The board's page in headless Chromium: from slider to redrawn plots, first load, memory.

Needs playwright and Chromium. The scenario is that of `torquer init` over ten orbits. A change is
made half a second after the last one; its time ends with the frame in which the plots are drawn. A
drag makes twenty changes a second. `--changes`: so many more, each once the previous one is drawn,
after each sixth of which the memory of the page and of the server is read.
`--trace FILE`: Chromium's trace of thirty changes. Prints and writes benchmarks/board_page.json.
"""

from __future__ import annotations

import argparse
import json
import shutil
import statistics
import tempfile
import threading
from pathlib import Path

from playwright.sync_api import sync_playwright

import torquer.scenario
from torquer.pages.board.server import BoardServer

HERE = Path(__file__).parent
START = Path(torquer.scenario.__file__).with_name("start.toml")
LOADS, CHANGES, TRACED, PARTS = 5, 40, 30, 6
#: Changes while a slider is moved, and the time from one to the next [ms].
MOVES, EVERY_MS = 100, 50
GAIN, INCLINATION = "control.law.gain_a_m2_s_per_t", "orbit.inclination_deg"
FLAGS = (
    *("--no-sandbox", "--enable-unsafe-swiftshader", "--disable-quic"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update"),
    *("--disable-sync", "--js-flags=--expose-gc", "--enable-precise-memory-info"),
)
#: Moves a slider to a place and waits until the last change is drawn: milliseconds.
CHANGE = """async ([key, place]) => {
  const before = board.drawn;
  const slider = document.querySelector(`[data-slider='${key}']`);
  slider.value = place;
  slider.dispatchEvent(new Event("input"));
  while (board.drawn === before) await new Promise((done) => setTimeout(done, 2));
  return board.redraws.at(-1);
}"""
#: Moves a slider all the time: milliseconds from each change that is drawn to its picture.
DRAG = """async ([key, moves, everyMs]) => {
  const before = board.redraws.length;
  const slider = document.querySelector(`[data-slider='${key}']`);
  for (let i = 0; i < moves; i++) {
    slider.value = 300 + 4 * i;
    slider.dispatchEvent(new Event("input"));
    await new Promise((done) => setTimeout(done, everyMs));
  }
  const isStale = () => document.querySelector("#plots.is-stale");
  do await new Promise((done) => setTimeout(done, everyMs)); while (isStale());
  return board.redraws.slice(before);
}"""
#: From the request to the last byte of the answer, of the last flight.
ANSWERED = """() => {
  const all = performance.getEntriesByName(`${location.origin}/api/fly`);
  performance.clearResourceTimings();
  return all.at(-1).duration;
}"""


def text_of_ten_orbits() -> str:
    """The scenario that is flown."""
    return START.read_text(encoding="utf-8").replace("revolutions = 3", "revolutions = 10")


def until(page, value: str):
    """Wait for a value that is true, without eval, which the page's policy forbids."""
    while not (found := page.evaluate(value)):
        page.wait_for_timeout(10)
    return found


def loaded(context, address: str) -> tuple:
    """A page, and when its first plots were drawn, from the beginning of the navigation [ms]."""
    page = context.new_page()
    page.goto(address)
    drawn = until(page, "window.board?.firstDrawnAt")
    until(page, "document.querySelector('#theory tbody').rows.length")
    page.wait_for_timeout(1500)
    return page, drawn


def changed(page, key: str, count: int) -> tuple[list[float], list[float]]:
    """Times from slider to redraw, and of the requests among them, sorted [ms]."""
    redraws, requests = [], []
    for i in range(count):
        redraws.append(page.evaluate(CHANGE, [key, 300 + 7 * i % 400]))
        requests.append(page.evaluate(ANSWERED))
        page.wait_for_timeout(500)
    return sorted(redraws), sorted(requests)


def quantiles(name: str, times: list[float]) -> dict[str, float]:
    """Median and 90 %."""
    return {
        f"{name}_median_ms": statistics.median(times),
        f"{name}_90_percent_ms": times[int(0.9 * len(times))],
    }


def megabytes(page) -> dict[str, float]:
    """Memory of the page's scripts after garbage collection, and of this process."""
    page.evaluate("gc()")
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    resident = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    return {
        "page": page.evaluate("performance.memory.usedJSHeapSize") / 1e6,
        "server": int(resident.split()[1]) / 1e3,
    }


def memory(page, changes: int) -> list[dict[str, float]]:
    """Memory at the beginning and after each part of many changes."""
    found = [megabytes(page)]
    for part in range(PARTS):
        for i in range(changes // PARTS):
            page.evaluate(CHANGE, [GAIN, 200 + (part + 7 * i) % 600])
        found.append(megabytes(page))
    return found


def measured(browser, address: str, given: argparse.Namespace) -> dict:
    """All measurements."""
    firsts = []
    for _ in range(LOADS):  # each in a new profile: nothing is kept
        context = browser.new_context(viewport={"width": 1400, "height": 900})
        page, first_ms = loaded(context, address)
        firsts.append(first_ms)
        if len(firsts) < LOADS:
            context.close()
    again, again_ms = loaded(context, address)
    again.close()
    found = {"first_load_s": statistics.median(firsts) / 1e3, "worst_load_s": max(firsts) / 1e3}
    found["load_again_s"] = again_ms / 1e3
    for name, key in (("gain", GAIN), ("inclination", INCLINATION)):
        redraws, requests = changed(page, key, CHANGES)
        found |= quantiles(name, redraws) | quantiles(f"{name}_request", requests)
    drawn = sorted(page.evaluate(DRAG, [GAIN, MOVES, EVERY_MS]))
    found |= {"drag_pictures": len(drawn)} | quantiles("drag", drawn)
    if given.trace:
        browser.start_tracing(page=page, path=given.trace)
        changed(page, GAIN, TRACED)
        browser.stop_tracing()
    if given.changes:
        found["changes"] = given.changes
        found["megabytes"] = memory(page, given.changes)
    return found


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--changes", type=int, default=0)
    parser.add_argument("--trace", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        server = BoardServer(text_of_ten_orbits(), "satellite", Path(folder))
        ready = threading.Event()
        server.board.make_ready()
        serving = threading.Thread(target=server.serve, args=(ready.set,), daemon=True)
        serving.start()
        ready.wait()
        chromium = shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        found = measured(browser, server.address, given)
        browser.close()
        server.stop()
        serving.join()
    print(json.dumps(found, indent=1))
    (HERE / "board_page.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
