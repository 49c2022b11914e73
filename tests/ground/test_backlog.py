"""What waits on board for a pass, against frames that are really made."""

import pytest

from torquer.base.explain import ScenarioError
from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.pus import ApplicationProcess
from torquer.flight.packets.software_file import load_link
from torquer.ground.backlog import DownlinkTable, air_bytes, downlinked, most_packets, packet_bytes
from torquer.ground.file import SatelliteTable, load_ground, make_satellite

LINKS = {kind: load_link({"link": kind}) for kind in ("historical", "protected", "pus")}
LINK = LINKS["historical"]


def made(link, name, count):
    """Bytes of packets as the satellite makes them."""
    packet = link.dictionary.down[name]
    values = [b"\0" * f.count if f.type == "bytes" else 0 for _, f, _ in packet.numbers()]
    frame = Downlink(link.dictionary).frame(name, 0.0, values)
    if link.link == "historical":
        return len(frame) * count
    sender, total = TelemetrySender(bytes(32), 1, 77), 0
    process = ApplicationProcess(link.dictionary, 77, {}, {})
    for _ in range(count):
        if link.link == "protected":
            total += len(sender.wrap(frame))
        else:
            total += sum(len(sender.wrap_packet(each)) for each in process.reports([frame], 0))
    return total + len(sender.flush())


@pytest.mark.parametrize("kind", sorted(LINKS))
@pytest.mark.parametrize("name", ["beacon", "extended", "stored"])
@pytest.mark.parametrize("count", [0, 1, 2, 100])
def test_bytes_are_those_of_frames(kind, name, count):
    assert air_bytes(LINKS[kind], name, count) == made(LINKS[kind], name, count)


def test_bytes_of_space_packets_have_their_header(tmp_path):
    dictionary = tmp_path / "other.toml"
    dictionary.write_text(
        'name = "other"\n[down.hk]\nid = 5\ndescription = "housekeeping"\ntime_ms = "t"\n'
        "fields = [\n"
        '{ name = "t", type = "f64", description = "time" },\n'
        '{ name = "x", type = "f32", description = "a number" }]\n',
        encoding="utf-8",
    )
    link = load_link({"link": "space_packets", "dictionary": str(dictionary)})
    assert air_bytes(link, "hk", 3) == 3 * (6 + 12)


def test_what_accumulates_and_what_fits():
    table = DownlinkTable(live_s={"extended": 1.0}, stored_s={"stored": 60.0, "beacon": 10.0})
    sizes = {name: packet_bytes(LINK, name) for name in ("extended", "stored", "beacon")}
    # an hour without contact, then a pass of ten minutes at 9600 bit/s: 720 000 bytes
    found = downlinked(LINK, table, 9600.0, 600.0, 3600.0)
    assert found.bytes == 720_000
    (live,) = found.live
    assert (live.packet, live.packets, live.bytes) == ("extended", 600, 600 * sizes["extended"])
    stored, beacon = found.stored
    assert (stored.packet, stored.packets, stored.fit) == ("stored", 70, 70)
    assert (beacon.packet, beacon.packets, beacon.fit) == ("beacon", 420, 420)
    assert stored.bytes == 70 * sizes["stored"] and found.left_packets == 0


def test_the_most_wanted_packets_come_first():
    sizes = {name: packet_bytes(LINK, name) for name in ("stored", "beacon")}
    for first, second in (("stored", "beacon"), ("beacon", "stored")):
        table = DownlinkTable(stored_s={first: 1.0, second: 1.0})
        room = 100 * sizes[first] + 30 * sizes[second] + 1
        one, two = downlinked(LINK, table, room * 8.0, 1.0, 99.0).stored
        assert (one.packets, one.fit, two.packets, two.fit) == (100, 100, 100, 30)


def test_what_is_sent_all_the_time_leaves_nothing_in_a_slow_pass():
    table = DownlinkTable(live_s={"extended": 1.0}, stored_s={"stored": 60.0})
    found = downlinked(LINK, table, 100.0, 600.0, 3600.0)
    assert found.live_bytes > found.bytes and found.stored[0].fit == 0
    assert found.left_packets == found.stored[0].packets == 70


@pytest.mark.parametrize("kind", sorted(LINKS))
def test_as_many_packets_fit_as_bytes_say(kind):
    for room in (0, 1, 259, 260, 1000, 12_345):
        n = most_packets(LINKS[kind], "beacon", 10_000, room)
        assert air_bytes(LINKS[kind], "beacon", n) <= room
        assert air_bytes(LINKS[kind], "beacon", n + 1) > room
    assert most_packets(LINKS[kind], "beacon", 3, 10**9) == 3


def test_periods_are_those_of_the_software_unless_given():
    table = SatelliteTable(link="udp:127.0.0.1:10315")
    shipped = make_satellite("s", table).table.downlink
    assert shipped.live_s == {"beacon": 10.0, "extended": 1.0}
    assert shipped.stored_s == {"stored": 60.0}
    own = table.model_copy(update={"downlink": DownlinkTable(stored_s={"beacon": 5.0})})
    assert make_satellite("s", own).table.downlink.live_s == {}


@pytest.mark.parametrize("kind", ["live_s", "stored_s"])
@pytest.mark.parametrize(
    ("given", "text"),
    [
        ('"nothing" = 1.0', ": must name packets of its telemetry; received 'nothing'"),
        ("beacon = 0.0", ".beacon: must be greater than 0; received 0.0"),
        ("beacon = -1.0", ".beacon: must be greater than 0; received -1.0"),
        ("beacon = nan", ".beacon: must be finite; received nan"),
        ("beacon = 1e8", ".beacon: must be less than or equal to 10000000; received 100000000.0"),
    ],
)
def test_wrong_periods_get_one_line(tmp_path, kind, given, text):
    file = tmp_path / "ground.toml"
    file.write_text(
        f'[satellites.s]\nlink = "udp:127.0.0.1:10315"\n[satellites.s.downlink.{kind}]\n{given}\n',
        encoding="utf-8",
    )
    with pytest.raises(ScenarioError) as refused:
        make_satellite("s", load_ground(file).satellites["s"])
    assert str(refused.value) == f"satellites.s.downlink.{kind}{text}"
