"""The ground serves a satellite of others: space packets, a dictionary without modules."""

import struct

import pytest
from ground_flight import serving, table, until

from torquer.flight.link import open_link

pytest.importorskip("uvicorn")


def housekeeping(second, coil):
    """The packet of examples/software/other_packets.toml, by its bits."""
    bits = f"{5:03b}{1:01b}" + "".join(f"{raw % 4096:012b}" for raw in (-320, 400, 12))
    bits += f"{coil:08b}{2000:012b}{0:04b}{2**47 + 1:048b}"
    data = struct.pack(">I", second) + int(bits, 2).to_bytes(14, "big")
    return struct.pack(">HHH", 1025, 0xC000 | second % 16384, len(data) - 1) + data


def test_space_packets_are_shown_live_with_labels_and_limits(tmp_path):
    link = open_link("tcp:127.0.0.1:0")
    other = table(link.address, "examples/software/other_satellite.toml", None)
    try:
        with serving(tmp_path, other=other) as client:
            until(lambda: link.receive() or link.peers)
            link.send(housekeeping(700_000_000, 150))
            assert client.value("b_x", "other", "housekeeping")[2] == 16.0
            assert client.value("coil", "other", "housekeeping")[2] == 35.0
            time_ms, _, counter, _ = client.value("counter", "other", "housekeeping")
            assert (time_ms, counter) == (946_684_800_000 + 700_000_000_000, 2**47 + 1)
            (satellite,) = client.get("satellites")
            points = {m["key"]: m for p in satellite["packets"] for m in p["measurements"]}
            mode = points["housekeeping.mode"]["values"][0]
            assert {"value": 4, "string": "SPIN"} in mode["enumerations"]
            assert points["housekeeping.coil"]["limits"]["WARNING"] == {"low": -30.0, "high": 60.0}
            assert client.get("other/commands")["commands"] == []
            status, answer = client.order("hold", "other")
            assert status == 400 and "command: must be one of no commands" in str(answer)
    finally:
        link.close()
