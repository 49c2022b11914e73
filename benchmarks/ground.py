"""The ground: cost of the archive, a day's history, rows pushed live, real time of a flight.

Prints times of this machine; `make bench` runs it. Live rows go from a satellite's link over the
ground to a websocket on this machine, at 10 and at 250 frames of 43 numbers a second, and at 500 to
two of them: late are those that arrive more than 100 ms after they were received.
"""

from __future__ import annotations

import json
import math
import statistics
import tempfile
import threading
import time
from contextlib import closing
from pathlib import Path
from urllib.parse import urlsplit

from websockets.sync.client import connect

from torquer.flight.link import open_link
from torquer.flight.packets.frames import Downlink, Stream
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.software_file import load_link
from torquer.ground.archive import EPOCH_MS, Archive, RowMaker, read_only
from torquer.ground.bins import points
from torquer.ground.file import SatelliteTable, make_satellite
from torquer.pages.ground.server import Ground

HERE = Path(__file__).parent
SOFTWARE = load_link()
EXTENDED = SOFTWARE.dictionary.down["extended"]
START_S, DAY = 100_000_000, 86_400
SECONDS = 20.0
TURNS = 5


def numbers(second: float) -> list:
    """Numbers of a packet `extended` that differ from second to second."""
    waves = [0.5 * math.sin(second / 900.0 + k) for k in range(len(EXTENDED.names) - 9)]
    return [1] * 8 + waves + [1e3 * (START_S + second)]


def archive_of_a_day(folder: Path) -> dict:
    """Time to decode, make and write rows, each per row, and to read a day of one number."""
    made = Downlink(SOFTWARE.dictionary)
    data = b"".join(made.frame("extended", START_S + s, numbers(s)) for s in range(DAY))
    path, maker = folder / "day.sqlite", RowMaker(SOFTWARE.dictionary)
    clock = time.perf_counter
    begun = clock()
    frames = list(Stream(SOFTWARE.dictionary, "down").feed(data))
    decoded = clock()
    rows = [maker.row(f, EPOCH_MS + 1000 * (START_S + n), 2) for n, f in enumerate(frames)]
    rowed = clock()
    with closing(Archive(path, SOFTWARE.dictionary)) as archive:
        begin_put = clock()
        for first in range(0, DAY, 250):
            archive.put(rows[first : first + 250])
        put = clock()
    ends = EPOCH_MS + 1000 * START_S, EPOCH_MS + 1000 * (START_S + DAY)
    read_ms = {}
    for by in ("time", "received"):
        taken = []
        for _ in range(TURNS):
            begin = clock()
            with closing(read_only(path)) as db:
                points(db, "extended", "omega_x", *ends, 2000, by)
            taken.append(1e3 * (clock() - begin))
        read_ms[by] = statistics.median(taken)
    return {
        "decode_us_a_frame": 1e6 * (decoded - begun) / DAY,
        "row_us": 1e6 * (rowed - decoded) / DAY,
        "write_us_a_row": 1e6 * (put - begin_put) / DAY,
        "megabytes_a_day": path.stat().st_size / 1e6,
        "day_by_time_ms": read_ms["time"],
        "day_by_reception_ms": read_ms["received"],
    }


def sender(link, rate_hz: float, ended: threading.Event) -> None:
    """Send frames at a rate until `ended` is set."""
    keys, made = SOFTWARE.keys, Downlink(SOFTWARE.dictionary)
    sends = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
    begun, number = time.monotonic(), 0
    while not ended.is_set():
        link.receive()
        frame = made.frame("extended", START_S + number, numbers(number / rate_hz))
        link.send(sends.wrap(frame) + sends.flush())
        number += 1
        time.sleep(max(0.0, begun + number / rate_hz - time.monotonic()))


def live(folder: Path, rate_hz: float, listeners: int) -> dict:
    """Rows that arrive at websockets, and how late after their reception."""
    link, ended = open_link("tcp:127.0.0.1:0"), threading.Event()
    ground = Ground([make_satellite("sat", SatelliteTable(link=link.address))], folder)
    serving = threading.Thread(target=ground.serve, daemon=True)
    sending = threading.Thread(target=sender, args=(link, rate_hz, ended), daemon=True)
    serving.start()
    time.sleep(1.0)
    late_ms: list[float] = []
    seen = [0] * listeners

    def listen(which: int) -> None:
        host = urlsplit(ground.address).netloc
        own = {"Cookie": f"torquer_{ground.port}={ground.token}", "Origin": f"http://{host}"}
        with connect(f"ws://{host}/api/live", additional_headers=own, proxy=None) as socket:
            end = time.monotonic() + SECONDS
            while time.monotonic() < end:
                rows = json.loads(socket.recv(60)).get("rows", [])
                now = time.time() * 1e3
                late_ms.extend(now - row[3] for row in rows)
                seen[which] += len(rows)

    sending.start()
    threads = [threading.Thread(target=listen, args=(which,)) for which in range(listeners)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    ended.set()
    sending.join()
    ground.stop()
    serving.join()
    link.close()
    with closing(read_only(folder / "sat.sqlite")) as db:
        archived = db.execute("SELECT count(*) FROM extended").fetchone()[0]
    late_ms.sort()
    return {
        "numbers_a_second": len(EXTENDED.names) * rate_hz,
        "archived": archived,
        "shown_of_those_sent": min(seen) / (SECONDS * rate_hz),
        "median_ms": statistics.median(late_ms),
        "95_percent_ms": late_ms[int(0.95 * len(late_ms))],
    }


def main() -> None:
    """Measure, print, write benchmarks/ground.json."""
    found: dict[str, dict] = {}
    with tempfile.TemporaryDirectory() as place:
        found["archive"] = archive_of_a_day(Path(place))
        for rate_hz, listeners in ((10.0, 1), (250.0, 1), (500.0, 2)):
            folder = Path(place) / f"{rate_hz:g}"
            folder.mkdir()
            found[f"{rate_hz:g} frames a second"] = live(folder, rate_hz, listeners)
    for name, numbers_ in found.items():
        print(name)
        for what, value in numbers_.items():
            print(f"  {what.replace('_', ' '):24} {value:10.3g}")
    (HERE / "ground.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
