"""A simulated day at the console: both sides killed, the disk full, the archive locked, clocks set.

The satellite flies at many times real time in a process of its own, the ground in another one; two
pages, a wide and a narrow one, are open all the time.
"""

import json
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import partial

import pytest
from ground_flight import until
from small_satellite import ground_process
from watched_page import CHROMIUM, browser_context, watched_page

from torquer.compile import engine
from torquer.flight.packets.codec import decoder
from torquer.flight.packets.station import Station
from torquer.flight.software.memory import Memory
from torquer.flight.software.modules.tm import record_file
from torquer.flight.software.software import load_software
from torquer.ground.archive import EPOCH_MS

sync_api = pytest.importorskip("playwright.sync_api")
resource = pytest.importorskip("resource")
pytest.importorskip("uvicorn")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium"),
    pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="no limits of other processes"),
]

DAY = "examples/chibis_m_day.toml"
#: Flown at so many times real time; its rows, and those of its record, come each 20 s: 4320 a
#: day, of which a flight that is killed loses a few.
SPEED, DAY_S, FEWEST = 450, 86_400, 4000
FLOWN = """name = "Chibis-M"
dictionary = "chibis_m"
link = "protected"
[modules]
adc = {}
aos = {}
clk = {}
coils = {}
fs = {}
gyro = {}
mag = {}
mod = {}
stb = {}
sun = {}
wheels = {}
[modules.tm.settings]
beacon_s = 600.0
extended_s = 20.0
store_s = 20.0
in_file = 10
files = 1000
"""
#: A ground of which the clock of the machine, and that which goes on asleep, are set by a file [s].
CLOCKED = """
import sys, time
from pathlib import Path
from types import SimpleNamespace
from torquer.ground import ground_clock
set_by = Path(sys.argv.pop(1))
ahead = lambda place: round(1e9 * float(set_by.read_text().split()[place]))
ground_clock.time = SimpleNamespace(
    CLOCK_BOOTTIME=time.CLOCK_BOOTTIME,
    time_ns=lambda: time.time_ns() + ahead(0),
    clock_gettime_ns=lambda clock: time.clock_gettime_ns(clock) + ahead(1),
)
from torquer.cli import main
main()
"""
#: The browser's clock, likewise; and how late the page's timers are on a busy machine [ms].
IN_PAGES = """
const now = Date.now;
window.aheadMs = 0;
Date.now = () => now() + aheadMs;
let due = performance.now() + 100;
window.lateMs = 0;
setInterval(() => {
  lateMs = Math.max(lateMs, performance.now() - due);
  due = performance.now() + 100;
}, 100);
"""
#: Far longer than anything here takes; how long the page may take to say that nothing comes [ms].
PATIENCE_MS, SAID_MS = 120_000, 3000
WIDTHS = (1280, 400)
#: How long a first flight may take to begin, with nothing compiled [s].
COMPILING_S = 600.0


class Day:
    """Satellite, ground and pages; `states`: what became of each command by the ground's word."""

    def __init__(self, folder, context, stack):
        self.folder, self.software = folder, folder / "software.toml"
        self.software.write_text(FLOWN)
        self.clocks, self.flights, self.grounds = folder / "clocks", [], []
        self.states, self.port, self.client, self.pages = {}, 0, None, []
        self.set_clocks(0, 0)
        self.address = "tcp:127.0.0.1:0"
        for width in WIDTHS:
            known = ("ERR_CONNECTION", "403", "Failed to fetch")
            page = stack.enter_context(watched_page(context, *known))
            page.set_viewport_size({"width": width, "height": 800})
            page.add_init_script(IN_PAGES)
            self.pages.append(page)

    def set_clocks(self, machine_s, asleep_s):
        part = self.clocks.with_suffix(".part")
        part.write_text(f"{machine_s} {asleep_s}")
        part.replace(self.clocks)
        for page in self.pages:
            page.evaluate("ms => { window.aheadMs = ms; }", 1000 * machine_s)

    def fly(self):
        """Let the satellite fly, where it did before, with the memory that it had."""
        place, said = len(self.flights), self.folder / f"flight-{len(self.flights)}.txt"
        run = [sys.executable, "-m", "torquer", "fly", DAY, "--software", self.software]
        run += ["--speed", str(SPEED), "--listen", self.address]
        run += ["--memory", self.folder / "memory", "--out", self.folder / f"out-{place}"]
        with said.open("w") as file:
            self.flights.append(subprocess.Popen([*map(str, run)], stdout=file, stderr=file))
        listens = lambda: [w for w in said.read_text().split() if w.startswith("tcp:")]  # noqa: E731
        words = until(listens, patience_s=COMPILING_S)
        self.address = words[0]

    def serve(self):
        """Let the ground serve at the address that it had, and open both pages."""
        self.ground, self.client = ground_process(
            self.folder / "ground",
            self.address,
            *("--software", self.software, "--scenario", DAY),
            start=("-c", CLOCKED, str(self.clocks)),
            port=self.port,
        )
        self.grounds.append(self.ground)
        self.port = self.client.port
        for page, view in zip(self.pages, ("commands", "state"), strict=True):
            place = f"#/browse/torquer:sat/torquer:sat.view.{view}?hideInspector=true"
            page.goto(f"{self.client.base}/?token={self.client.token}&{len(self.grounds)}{place}")
            sync_api.expect(page.locator(".t-link[data-state=connected]")).to_have_count(1)

    def end(self, *processes):
        for process in processes or (*self.flights, *self.grounds):
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.terminate()
                process.wait(60)

    def clock_ms(self):
        return self.client.get("satellites")[0]["clock_ms"]

    def say_within_seconds(self, text, begin):
        """Both pages say something of a silence within 3 s of its beginning, which is called."""
        for page in self.pages:
            page.evaluate("lateMs = 0")
        begin()
        begun_s = time.monotonic()
        for page in self.pages:
            page.locator(".t-link:has(.t-link__state)", has_text=text).wait_for(state="attached")
            took_ms = 1000 * (time.monotonic() - begun_s)
            late_ms = max(each.evaluate("lateMs") for each in self.pages)
            print(f"{text}: {took_ms:.0f} ms, with timers {late_ms:.0f} ms late")
            assert took_ms < SAID_MS + 3 * late_ms

    def goes_on(self):
        """Both pages live, and a command executed, as one of them shows."""
        status, ordered = self.client.order("report_status", "sat", module_id=2)
        assert status == 200, ordered
        for page in self.pages:
            line = page.locator(".t-link__time")
            sync_api.expect(line).not_to_have_text(line.inner_text())
            sync_api.expect(page.locator(".is-silent")).to_have_count(0)
        number = ordered["id"]
        self.states[number] = self.client.ends(number, "sat")["state"]
        assert self.states[number] == "executed"
        row = self.pages[0].locator(".t-sent tr[data-state=executed]")
        row.filter(has=self.pages[0].get_by_text(str(number), exact=True)).wait_for()

    def say_archive(self, text):
        """Both pages say of the archive what is given: a part, or nothing."""
        for page in self.pages:
            said = sync_api.expect(page.locator(".t-link__archive"))
            said.to_contain_text(text) if text else said.to_have_text("")

    def says(self, text):
        found = lambda: [each for each in self.client.texts("sat") if text in each]  # noqa: E731
        return until(found, f"not said: {text}")


@pytest.fixture
def day(tmp_path):
    with browser_context(*WIDTHS, PATIENCE_MS) as context, ExitStack() as stack:
        day = Day(tmp_path, context, stack)
        stack.callback(day.end)
        day.fly()
        day.serve()
        yield day


def test_a_day(day):
    day.goes_on()
    begun_ms = day.clock_ms()
    for trouble in TROUBLES:
        begun_s = time.monotonic()
        with trouble(day):
            day.goes_on()
        day.goes_on()
        print(f"{trouble.__name__}: {time.monotonic() - begun_s:.0f} s")
    while day.clock_ms() - begun_ms < 1000 * DAY_S:
        day.goes_on()
        time.sleep(5.0)
    fill_gaps(day)
    day.goes_on()
    assert all(text.endswith(" 0 lost") for text in day.says("archived again"))
    day.end(*day.flights)
    kept = kept_on_board(day)
    assert len(kept) > FEWEST
    with suppress(AssertionError):  # the last ones are on their way
        until(lambda: kept <= archived(day))
    missing = sorted(kept - archived(day))
    assert not missing, f"{len(missing)} of {len(kept)}, {missing[:3]} to {missing[-3:]}"
    assert_no_command_twice(day)


@contextmanager
def full_disk(day):
    pid = day.ground.pid
    _, most = resource.prlimit(pid, resource.RLIMIT_FSIZE)
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (8192, most))
    day.say_archive("not archived since")
    yield
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (most, most))
    day.say_archive("")


@contextmanager
def lock_of_a_minute(day):
    path = day.folder / "ground" / "sat.sqlite"
    with closing(sqlite3.connect(path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        day.say_archive("not archived since")
        end_s = time.monotonic() + 60.0
        while time.monotonic() < end_s:
            day.goes_on()
            time.sleep(10.0)
        yield
        other.execute("ROLLBACK")
    day.say_archive("")


@contextmanager
def killed_ground(day):
    day.say_within_seconds("no word from the ground since", day.ground.kill)
    day.ground.communicate()
    time.sleep(2.0)
    day.serve()
    yield


@contextmanager
def clock_back_a_day(day):
    day.set_clocks(-86_400, 0)
    day.says("the clock of this machine was set by -86400 s")
    yield


@contextmanager
def asleep_for_ten_minutes(day):
    """Ground and pages stand still, and the clocks are later then; the satellite flies on."""
    day.ground.send_signal(signal.SIGSTOP)
    for page in day.pages:
        page.evaluate("end = performance.now() + 3000; while (performance.now() < end);")
    day.set_clocks(-86_400 + 600, 600)
    day.ground.send_signal(signal.SIGCONT)
    for page in day.pages:
        sync_api.expect(page.locator(".t-link[data-state=connected]")).to_have_count(1)
        sync_api.expect(page.locator(".is-silent")).to_have_count(0)
    yield


@contextmanager
def ground_that_stands_still(day):
    stop = partial(day.ground.send_signal, signal.SIGSTOP)
    day.say_within_seconds("no word from the ground since", stop)
    day.ground.send_signal(signal.SIGCONT)
    yield


@contextmanager
def killed_satellite(day):
    flight = day.flights[-1]
    day.say_within_seconds("no telemetry since", partial(flight.send_signal, signal.SIGSTOP))
    day.say_within_seconds("link lost", flight.kill)
    flight.wait()
    day.fly()
    for page in day.pages:
        sync_api.expect(page.locator(".t-link[data-state=connected]")).to_have_count(1)
    yield


TROUBLES = (
    full_disk,
    killed_ground,
    lock_of_a_minute,
    clock_back_a_day,
    killed_satellite,
    asleep_for_ten_minutes,
    ground_that_stands_still,
)


def fill_gaps(day):
    """Order all gaps of the main packet from the satellite's record, one after the other."""
    gaps = [gap for gap in day.client.get("sat/gaps")["gaps"] if gap["packet"] == "extended"]
    print(f"{len(gaps)} gaps, {sum(gap['missing'] for gap in gaps)} rows")
    assert gaps
    # what came down before the ground listened is no gap between rows
    gaps.append({"start_ms": EPOCH_MS, "end_ms": EPOCH_MS + int(min(archived(day)))})

    def is_filled(gap):
        """Whether the satellite takes the order: not while it goes on with the one before.

        What a flight that was killed had not written is not there.
        """
        body = json.dumps({"start": gap["start_ms"], "end": gap["end_ms"]}).encode()
        status, answer, _ = day.client.raw("/api/sat/gaps", body)
        assert status == 200, answer
        ordered = day.client.ends(json.loads(answer)["id"], "sat")
        return ordered["state"] == "executed" or "are not there" in ordered["reason"]

    for gap in gaps:
        until(lambda gap=gap: is_filled(gap), f"not filled: {gap}")
    day.goes_on()


def kept_on_board(day):
    """On-board times [ms] of the rows that the satellite's record holds in its memory."""
    packet = load_software(day.software).dictionary.down["stored"]
    memory, values_of = Memory(day.folder / "memory"), decoder(packet)
    at, size = packet.names.index("on_board_ms"), 4 + packet.size
    files = [memory.read(record_file(number)) or b"" for number in range(1000)]
    records = [data[k : k + size] for data in files for k in range(4, len(data), size)]
    return {values_of(record, 4)[at] for record in records}


def archived(day):
    """On-board times [ms] of the rows in the archive, as they came or from the record."""
    with closing(sqlite3.connect(day.folder / "ground" / "sat.sqlite")) as db:
        both = "SELECT on_board_ms FROM extended UNION SELECT on_board_ms FROM stored"
        return {time_ms for (time_ms,) in db.execute(both)}


def assert_no_command_twice(day):
    """The satellite has executed each command once, by the answers that it sent."""
    software, answered = load_software(day.software), Counter()
    for number in range(len(day.flights)):
        data = (day.folder / f"out-{number}" / "downlink.bin").read_bytes()
        for frame in Station(software).receive(data):
            if frame.packet.name == "acknowledgement":
                values = dict(zip(frame.packet.names, frame.values, strict=True))
                answered[values["request"]] += values["accepted"]
    assert {number for number, count in answered.items() if count > 1} == set()
