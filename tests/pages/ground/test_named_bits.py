"""Bits by their names: in the page's own words, in what the server tells, in a browser."""

import json
import shutil
import subprocess

import pytest
from ground_flight import flying, serving, table, until
from unit_cases import SIDE, two_magnetometers, two_magnetometers_text
from watched_page import CHROMIUM, browser_context, watched_page

from torquer.computer.interface import SENSORS
from torquer.flight.packets.bits import in_words
from torquer.flight.packets.dictionary import Field
from torquer.pages.ground.routes import WEB

pytest.importorskip("uvicorn")
NODE = shutil.which("node")
#: Far longer than anything here takes: only a failure waits so long [ms].
PATIENCE_MS = 40_000
PARTS = Field(name="parts", type="u32", bits=("heater", "lamp"), description="parts")


@pytest.mark.skipif(NODE is None, reason="no Node.js")
def test_the_page_names_bits_as_commands_do():
    numbers = [0, 1, 3, 6, 1 << 31 | 1]
    code = (WEB / "bits.js").read_text(encoding="utf-8") + (
        f"const texts = {numbers}.map((number) => bitsInWords({list(PARTS.bits)}, number));"
        "console.log(JSON.stringify(texts));"
    )
    call = [NODE, "--input-type=module"]
    done = subprocess.run(call, input=code, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [f"{in_words(PARTS, n)} ({n})" for n in numbers]


@pytest.fixture(scope="module")
def ground(tmp_path_factory):
    """A ground for a satellite with two magnetometers, of which one is stuck already."""
    folder = tmp_path_factory.mktemp("ground")
    file = folder / "units.toml"
    file.write_text(two_magnetometers_text(), encoding="utf-8")
    with (
        flying(flown=two_magnetometers(864000.0)) as satellite,
        serving(folder, units=table(satellite.address, in_scenario=file)) as client,
    ):
        yield client


def test_the_server_tells_the_names_of_the_sensors(ground):
    (satellite,) = ground.get("satellites")
    measurements = {m["key"]: m for p in satellite["packets"] for m in p["measurements"]}
    for packet in ("extended", "stored"):
        value = measurements[f"{packet}.isolated"]["values"][0]
        assert value["bits"] == [*SENSORS, "panel", "side"]
    until(lambda: ground.value("isolated", "units")[2] == SIDE)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_the_page_names_the_stuck_magnetometer(ground):
    sync_api = pytest.importorskip("playwright.sync_api")
    packet = "torquer:units/torquer:units.packets/torquer:units.packet.extended"
    with (
        browser_context(1900, 850, PATIENCE_MS) as context,
        watched_page(context, "400 (Bad Request)") as page,
    ):
        page.goto(f"{ground.base}/?token={ground.token}")
        row = page.locator(".t-values tr", has_text="isolated")
        sync_api.expect(row).to_contain_text(f"side ({SIDE})")
        page.goto(f"{ground.base}/#/browse/{packet}?hideInspector=true&view=table")
        cell = page.locator(".c-telemetry-table td", has_text=f"side ({SIDE})").first
        sync_api.expect(cell).to_be_visible()
