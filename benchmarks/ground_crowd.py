"""Many satellites and many browsers: 10 satellites of 10 frames/s, 50 websockets, ten minutes.

The ground, the satellites and the browsers are a process each. Prints how late rows arrive after
their reception and the memory of the ground as time goes on; writes benchmarks/ground_crowd.json.

    python benchmarks/ground_crowd.py [SECONDS]
"""

from __future__ import annotations

import asyncio
import json
import multiprocessing
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from ground import EXTENDED, HERE, sender
from websockets.asyncio.client import connect

from torquer.flight.link import open_link
from torquer.ground.client import SERVER

SATELLITES, BROWSERS, RATE_HZ = 10, 50, 10.0


def satellites(addresses) -> None:
    """Links that send frames until the process is ended; puts their addresses into a queue."""
    links = [open_link("tcp:127.0.0.1:0") for _ in range(SATELLITES)]
    ended = threading.Event()
    threads = [threading.Thread(target=sender, args=(each, RATE_HZ, ended)) for each in links]
    for thread in threads:
        thread.start()
    addresses.put([each.address for each in links])
    for thread in threads:
        thread.join()


async def listen(address: str, end_s: float, late_ms: list[float]) -> int:
    """Rows that a browser gets until a time, each with how late it is; how many."""
    parts, rows = urlsplit(address), 0
    token = parse_qs(parts.query)["token"][0]
    own = {
        "Cookie": f"torquer_{parts.port}={token}",
        "Origin": f"http://{parts.netloc}",
    }
    async with connect(
        f"ws://{parts.netloc}/api/live", additional_headers=own, proxy=None, max_size=None
    ) as socket:
        while time.monotonic() < end_s:
            found = json.loads(await socket.recv()).get("rows", [])
            now_ms = time.time() * 1e3
            late_ms.extend(now_ms - row[3] for row in found)
            rows += len(found)
    return rows


async def crowd(address: str, seconds: float) -> tuple[list[int], list[float]]:
    """All browsers."""
    late_ms: list[float] = []
    end_s = time.monotonic() + seconds
    rows = await asyncio.gather(*(listen(address, end_s, late_ms) for _ in range(BROWSERS)))
    return rows, sorted(late_ms)


def resident_mb(process: int) -> float:
    """Memory of a process."""
    text = Path(f"/proc/{process}/status").read_text()
    return (
        int(next(line for line in text.splitlines() if line.startswith("VmRSS")).split()[1]) / 1e3
    )


def watch(process: int, sizes: list[float], ended: threading.Event) -> None:
    """Memory of the ground, each ten seconds."""
    while not ended.wait(10.0):
        sizes.append(resident_mb(process))


def main(seconds: float) -> None:
    """Measure, print, write."""
    addresses = multiprocessing.Queue()
    flying = multiprocessing.Process(target=satellites, args=(addresses,), daemon=True)
    flying.start()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tables = [
            f'[satellites.sat_{k}]\nlink = "{link}"\n' for k, link in enumerate(addresses.get())
        ]
        (folder / "ground.toml").write_text("\n".join(tables))
        command = [sys.executable, "-m", "torquer", "ground", str(folder / "ground.toml")]
        ground = subprocess.Popen(
            [*command, "--folder", str(folder / "g"), "--port", "0", "--no-browser"],
            stdout=subprocess.DEVNULL,
        )
        file = folder / "g" / SERVER
        while not (file.is_file() and file.read_text()):
            time.sleep(0.2)
        address = json.loads(file.read_text())["address"]
        time.sleep(5.0)
        sizes, ended = [resident_mb(ground.pid)], threading.Event()
        watching = threading.Thread(target=watch, args=(ground.pid, sizes, ended))
        watching.start()
        rows, late_ms = asyncio.run(crowd(address, seconds))
        ended.set()
        watching.join()
        ground.terminate()
        ground.wait()
    flying.kill()
    found = {
        "seconds": seconds,
        "numbers_a_second": len(EXTENDED.names) * RATE_HZ * SATELLITES,
        "rows_a_browser": [min(rows), max(rows)],
        "sent": seconds * RATE_HZ * SATELLITES,
        "median_ms": statistics.median(late_ms),
        "95_percent_ms": late_ms[int(0.95 * len(late_ms))],
        "ground_mb": [sizes[0], sizes[len(sizes) // 2], sizes[-1]],
    }
    print(json.dumps(found, indent=1))
    (HERE / "ground_crowd.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 600.0)
