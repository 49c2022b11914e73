"""The ground serves satellites that fly: telemetry, commands, restarts, requests of strangers."""

import asyncio
import json
import math
import socket
from contextlib import closing
from pathlib import Path

import pytest
from ground_flight import flying, serving, table, until

from torquer.compile import engine
from torquer.flight.link import open_link
from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.keys import new_key
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.software_file import load_link
from torquer.ground import live
from torquer.ground.archive import EPOCH_MS, Row
from torquer.ground.client import RunningGround
from torquer.ground.contact import Counters

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")


@pytest.fixture(scope="module")
def flight():
    with flying() as satellite:
        yield satellite


@pytest.fixture(scope="module")
def client(flight, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ground")
    with serving(folder, chibis=table(flight.address)) as made:
        made.folder = folder
        until(lambda: made.value("omega_x")[2] is not None)  # unknown before the first estimate
        yield made


# Telemetry


def test_satellites_with_their_packets(client):
    (satellite,) = client.get("satellites")
    assert (satellite["key"], satellite["name"]) == ("chibis", "Chibis-M")
    has = dict.fromkeys(("modes", "scene", "orbit", "plan"), True)
    assert satellite["has"] == {**has, "passes": False}
    assert satellite["clock_ms"] > EPOCH_MS
    modes = next(p for p in satellite["packets"] if p["key"] == "modes")
    assert [m["name"] for m in modes["measurements"]][:2] == ["determination", "stabilisation"]
    texts = [e["string"] for e in modes["measurements"][1]["values"][0]["enumerations"]]
    assert texts == ["detumbling", "acquisition", "science"]


def test_history_grows_and_is_of_the_times_asked_for(client):
    time_ms, received_ms, value, quality = client.value("omega_x")
    assert quality == 2 and received_ms > time_ms and abs(value) < 30.0
    until(lambda: client.value("omega_x")[0] > time_ms)
    rows = client.get(f"chibis/history/extended/omega_x?start=0&end={time_ms}&size=20000")
    assert rows[-1] == [time_ms, received_ms, value, quality, 1]
    by = client.get(f"chibis/history/extended/omega_x?by=received&start={received_ms}&size=20000")
    assert by[0][1] >= received_ms


def test_the_last_rows_of_a_packet_have_all_its_numbers(client):
    time_ms, received_ms, omega_x, quality = client.value("omega_x")
    (*_, row) = client.get(f"chibis/history/extended?end={time_ms}&size=3")
    assert row[:3] == [time_ms, received_ms, quality]
    described = client.get("satellites")[0]["packets"]
    keys = [m["key"] for p in described if p["key"] == "extended" for m in p["measurements"]]
    assert row[3][keys.index("extended.omega_x")] == omega_x and len(row[3]) == len(keys)


@pytest.mark.parametrize(
    ("path", "status", "text"),
    [
        ("chibis/history/extended/nothing", 404, "there is no such thing"),
        ("chibis/history/sqlite_master/sql", 404, "there is no such thing"),
        ("chibis/history/sqlite_master", 404, "there is no such thing"),
        ("chibis/history/_commands", 404, "there is no such thing"),
        ('chibis/history/extended/omega_x"', 404, "there is no such thing"),
        ("nobody/log", 404, "there is no such thing"),
        ("chibis/history/extended/omega_x?size=0", 400, "size: must be"),
        ("chibis/history/extended/omega_x?start=5&end=4", 400, "end: must not be before start"),
        ("chibis/history/extended/omega_x?latest=1&start=5&end=4", 400, "end: must not be"),
        ("chibis/history/extended?start=5&end=4", 400, "end: must not be before start"),
        ("chibis/history/extended/omega_x?by=_quality", 400, "by: "),
        ("chibis/history/extended/omega_x?start=1e3", 400, "start: must be a whole number"),
        ("chibis/log?sizes=3", 400, "sizes: "),
        ("chibis/orbit?time=never", 400, "time: must be milliseconds"),
        ("chibis/orbit?time=2000000000000", 400, "time: must be milliseconds"),
        ("chibis/orbit?time=" + "9" * 400, 400, "time: must be milliseconds"),
    ],
)
def test_wrong_questions_get_one_line(client, path, status, text):
    found, body, _ = client.raw(f"/api/{path}")
    assert found == status
    error = json.loads(body)["error"]
    assert text in error and "\n" not in error and len(error) < 300


def test_log_of_satellite_and_ground(client):
    until(lambda: "link found" in client.texts())
    client.order("get_parameter", index=60_000)
    until(lambda: "svr: a value out of its range; argument: 21" in client.texts())
    entries = client.get("chibis/log")
    assert {each["source"] for each in entries} == {"ground", "satellite"}
    received = [each["received_ms"] for each in entries]
    assert received == sorted(received)


def test_the_page_and_nothing_outside_its_folder(client):
    status, body, headers = client.raw("/")
    assert status == 200 and b"<html" in body.lower() and "text/html" in headers["content-type"]
    for path in ("/../routes.py", "/%2e%2e/routes.py", "/vendor/../../routes.py", "//etc/passwd"):
        assert client.raw(path)[0] in (400, 404), path


def test_files_are_sent_again_only_if_they_changed(client):
    _, body, headers = client.raw("/vendor/openmct/openmct.js")
    assert headers["content-encoding"] == "gzip" and body[:2] == b"\x1f\x8b"
    status, body, _ = client.raw("/vendor/openmct/openmct.js", **{"if-none-match": headers["etag"]})
    assert (status, body) == (304, b"")


def test_scene_orbit_and_modes(client):
    assert len(client.get("chibis/scene")["sensors"]) == 5
    time_ms = client.value("omega_x")[0]
    orbit = client.get(f"chibis/orbit?time={time_ms}")
    assert 6.7e3 < sum(x * x for x in orbit["position_km"]) ** 0.5 < 7.1e3
    assert len(orbit["track_km"]) == 121 and orbit["sunlit"] in (0.0, 1.0)
    modes = client.get("chibis/modes")
    assert 'data-region="stabilisation" data-state="science"' in modes["svg"]
    states = [client.value(f"state_{k}", packet="modes")[2] for k in range(len(modes["regions"]))]
    assert all(s < len(r["states"]) for s, r in zip(states, modes["regions"], strict=True))


# Commands


def test_a_command_is_executed_and_another_refused(client):
    status, ordered = client.order("get_parameter", index=0)
    assert status == 200 and client.ends(ordered["id"])["state"] == "executed"
    assert client.value("index", packet="parameter")[2] == 0
    status, ordered = client.order("set_mode", region="stabilisation", state="science")
    refused = client.ends(ordered["id"])
    assert (refused["state"], refused["reason"]) == ("refused", "not possible in this mode")


def test_a_delayed_command_is_received_first(client):
    body = {"command": "get_parameter", "values": {"index": 0}, "delay_s": 30}
    _, answer, _ = client.raw("/api/chibis/commands", json.dumps(body).encode())
    number = json.loads(answer)["id"]
    assert client.ends(number)["state"] == "received"
    until(lambda: client.ends(number)["state"] == "executed")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (b'{"command": "set_mod"}', "command: must be one of"),
        (b'{"command": "reboot"}', "values.kind: must be given"),
        (b'{"command": "reboot", "values": {"kind": 1e999}}', "values.kind: must be"),
        (b'{"command": 7}', "command: must be text"),
        (b'{"command": "power", "key": 1}', "key: "),
        (b'{"command": "automatic", "values": {"on": 1}, "delay_s": -1}', "delay_s: must be"),
        (b'{"command": "automatic", "values": {"on": 1}, "delay_s": 1e300}', "delay_s: must be"),
        (b'{"command": "automatic", "values": {"on": 1}, "at_s": 1e300}', "at_s: must be"),
        (b"[1]", "command: must be a JSON object"),
        (b"{" * 2000, "command: must be a JSON object"),
        (b"\xff", "command: must be a JSON object"),
        (b'{"commands": 3}', "command: must be an object"),
        (b" " * 70_000, "command: must have at most"),
    ],
)
def test_wrong_commands_get_one_line(client, body, message):
    before = client.get("chibis/sent?size=1")
    status, answer, _ = client.raw("/api/chibis/commands", body)
    error = json.loads(answer)["error"]
    assert status == 400 and message in error and len(error.split("\n")) == 1
    assert client.get("chibis/sent?size=1")[:1] == before[:1]


def test_of_a_list_all_are_taken_or_none(client):
    before = client.get("chibis/sent?size=1")
    good = {"command": "get_parameter", "values": {"index": 0}}
    body = json.dumps({"commands": [good, {"command": "nothing"}]}).encode()
    assert client.raw("/api/chibis/commands", body)[0] == 400
    assert client.get("chibis/sent?size=1") == before
    body = json.dumps({"commands": [good, good]}).encode()
    _, answer, _ = client.raw("/api/chibis/commands", body)
    assert [client.ends(each["id"])["state"] for each in json.loads(answer)] == ["executed"] * 2


def test_replayed_and_forged_commands_are_refused_and_logged(client, flight):
    _, ordered = client.order("get_parameter", index=0)
    client.ends(ordered["id"])
    refusals = sum("not authentic" in text for text in client.texts())
    flight.injected = flight.uplink  # all that ever went up
    until(lambda: sum("not authentic" in text for text in client.texts()) > refusals)
    refusals = sum("not authentic" in text for text in client.texts())
    forged = bytearray(flight.uplink[: len(flight.uplink) // 2])
    forged[-1] ^= 1
    flight.injected = bytes(forged)
    until(lambda: sum("not authentic" in text for text in client.texts()) > refusals)
    parameters = len(client.get("chibis/history/parameter/index?size=20000"))
    _, ordered = client.order("get_parameter", index=0)
    assert client.ends(ordered["id"])["state"] == "executed", "the counter has not moved"
    assert len(client.get("chibis/history/parameter/index?size=20000")) == parameters + 1


# Browsers and strangers


def test_infinities_go_by_name_to_browsers(tmp_path):
    software = load_link()
    keys, made = software.keys, Downlink(software.dictionary)
    sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
    with (
        closing(open_link("tcp:127.0.0.1:0")) as link,
        serving(tmp_path, sat=table(link.address, in_scenario=None)) as client,
        client.live() as socket_,
    ):
        until(lambda: link.receive() or link.peers)
        for time_s, value in enumerate((1.5, math.inf, -math.inf)):
            frame = made.frame("parameter", 100 + time_s, (7, value))
            link.send(sender.wrap(frame) + sender.flush())
        seen = []
        while len(seen) < 3:
            seen += [row[-1] for row in json.loads(socket_.recv(60)).get("rows", ())]
        assert seen == [[7, 1.5], [7, "Infinity"], [7, "-Infinity"]]
        rows = client.get("sat/history/parameter/value")
        assert [value for _, _, value, *_ in rows] == [1.5, "Infinity", "-Infinity"]
        assert [row[-1] for row in client.get("sat/history/parameter")] == seen


def test_a_link_is_found_when_frames_come_not_when_somebody_listens(tmp_path):
    software = load_link()
    keys, made = software.keys, Downlink(software.dictionary)
    sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)
    with (
        closing(open_link("tcp:127.0.0.1:0")) as link,
        serving(tmp_path, sat=table(link.address, in_scenario=None)) as client,
        client.live() as socket_,
    ):
        until(lambda: link.receive() or link.peers)

        def states(number):
            found = []
            while len(found) < number:
                found += json.loads(socket_.recv(60)).get("links", ())
            return found

        link.send(b"no frame" * 100)
        told = states(3)
        assert not any(each["connected"] for each in told) and told[-1]["received_bytes"] == 800
        assert client.texts("sat") == []
        link.send(sender.wrap(made.frame("parameter", 100, (7, 1.5))) + sender.flush())
        until(lambda: client.texts("sat") == ["link found"])
        assert states(1)[-1]["connected"]


def test_rows_come_live(client):
    with client.live() as socket_:
        kinds, rows = set(), []
        while len(rows) < 5:
            message = json.loads(socket_.recv(60))
            kinds |= set(message)
            rows += [row for row in message.get("rows", ()) if row[1] == "extended"]
        client.order("get_parameter", index=0)
        while "commands" not in kinds:
            kinds |= set(json.loads(socket_.recv(60)))
    assert {"rows", "links", "commands"} <= kinds
    satellite, _, time_ms, received_ms, quality, values = rows[0]
    assert (satellite, quality, len(values)) == ("chibis", 2, 43) and received_ms > time_ms


@pytest.mark.parametrize(
    "wrong",
    [{"Origin": "http://evil.example"}, {"Origin": None}, {"Cookie": None}, {"Cookie": "a=b"}],
)
def test_strangers_get_no_live_rows(client, wrong):
    from websockets.exceptions import InvalidStatus

    with pytest.raises(InvalidStatus) as refused:
        client.live(**wrong)
    assert refused.value.response.status_code == 403


def test_strangers_are_refused_and_logged(client):
    assert client.raw("/api/satellites", authorization=None)[0] == 403
    assert client.raw("/api/chibis/commands", b"{}", origin="http://evil.example")[0] == 403
    until(lambda: any("request refused" in text for text in client.texts()))


def test_a_browser_that_does_not_read_costs_bounded_memory():
    async def run():
        listener, everybody = live.Listener(), live.Live()
        everybody.listeners.add(listener)
        for number in range(10_000):
            row = Row("extended", number, number, 2, 0, 0, (0.5, math.inf, math.nan) * 14)
            everybody.rows("sat", [row])
            everybody.message("log", "sat", {"id": number})
        taken = json.loads(await listener.take())
        assert taken["log"][-1] == {"satellite": "sat", "id": 9999}
        assert taken["rows"][-1] == ["sat", "extended", 9999, 9999, 2, [0.5, "Infinity", None] * 14]
        assert len(taken["rows"]) == live.MOST_ROWS and len(taken["log"]) == live.MOST_MESSAGES
        assert taken["rows"][-1][2] == 9999 and listener.dropped == 10_000 - live.MOST_ROWS

    asyncio.run(run())


def test_a_port_in_use_gets_one_line(tmp_path):
    from torquer.pages.ground.server import Ground

    must = pytest.raises(ValueError, match="--port: must be a port that is free; received")
    with socket.create_server(("127.0.0.1", 0)) as other, must:
        Ground([], tmp_path, other.getsockname()[1])


# Restarts


@pytest.fixture(scope="module")
def second_flight():
    with flying() as satellite:
        yield satellite


def test_ended_ground_leaves_no_trace_and_resumes_where_it_was(second_flight, tmp_path):
    flight = second_flight
    with serving(tmp_path, chibis=table(flight.address)) as client:
        port = client.port
        assert (tmp_path / "server.json").stat().st_mode & 0o077 == 0
        _, ordered = client.order("get_parameter", index=0)
        client.ends(ordered["id"])
        first = client.value("omega_x")
    assert not (tmp_path / "server.json").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "chibis.counters",
        "chibis.sqlite",
    ]
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", port), 1)
    with serving(tmp_path, chibis=table(flight.address)) as client:
        assert client.get("chibis/sent")[0]["state"] == "executed"
        _, ordered = client.order("get_parameter", index=0)
        assert client.ends(ordered["id"])["state"] == "executed", "the counter went on"
        until(lambda: client.value("omega_x")[0] > first[0])


@pytest.mark.slow
def test_a_lost_archive_needs_the_counter_of_commands(second_flight, tmp_path):
    tables = {"chibis": table(second_flight.address)}
    with serving(tmp_path, **tables) as client:
        client.value("omega_x")
        client.order("get_parameter", index=0)
        until(lambda: any("not authentic" in text for text in client.texts()))
    with serving(tmp_path, Counters(commands=1000), **tables) as client:
        _, ordered = client.order("get_parameter", index=0)
        assert client.ends(ordered["id"])["state"] == "executed"


def test_a_changed_key_of_commands_is_used_from_then_on(tmp_path):
    with flying() as flight:
        tables = {"chibis": table(flight.address)}

        def states(*commands):
            found = []
            for command, values in commands:
                _, ordered = client.order(command, **values)
                found.append(client.ends(ordered["id"])["state"])
            return found

        get, change = ("get_parameter", {"index": 0}), ("change_key", {"number": 4})
        with serving(tmp_path, **tables) as client:
            client.value("omega_x")
            assert states(get, get, change, get, get) == ["executed"] * 5
            assert states(change) == ["refused"]
        with serving(tmp_path, **tables) as client:
            client.value("omega_x")
            assert states(get, ("change_key", {"number": 5}), get) == ["executed"] * 3


def software(folder, **keys):
    """A software file; keys of its own where asked for."""
    shipped = Path("torquer/flight/software/chibis_m.toml").read_text(encoding="utf-8")
    if "link" in keys:
        shipped = shipped.replace('link = "protected"\n', "")
    path = folder / "software.toml"
    path.write_text("".join(f'{k} = "{v}"\n' for k, v in keys.items()) + shipped)
    return path


def test_with_known_keys_a_satellite_may_begin_again(tmp_path):
    with flying() as first, serving(tmp_path, chibis=table(first.address)) as client:
        client.value("omega_x")
    with flying() as second, serving(tmp_path, chibis=table(second.address)) as client:
        until(lambda: client.get("satellites")[0]["clock_ms"])
        _, ordered = client.order("get_parameter", index=0)
        assert client.ends(ordered["id"])["state"] == "executed"


def test_own_keys_reject_telemetry_that_counts_from_the_beginning(tmp_path):
    for name in ("up", "recovery", "down"):
        new_key(tmp_path / name)
    own = software(tmp_path, up_key="up", recovery_key="recovery", down_key="down")
    with flying(own) as first, serving(tmp_path / "a", chibis=table(first.address, own)) as client:
        until(lambda: len(client.get("chibis/history/extended/omega_x?size=20000")) > 100)
        _, ordered = client.order("get_parameter", index=0)
        assert client.ends(ordered["id"])["state"] == "executed"
    with flying(own) as second:
        with serving(tmp_path / "a", chibis=table(second.address, own)) as client:
            until(lambda: any("counter is not above" in text for text in client.texts()))
        accepting = serving(
            tmp_path / "a", Counters(new_telemetry=True), chibis=table(second.address, own)
        )
        with accepting as client:
            until(lambda: client.get("satellites")[0]["clock_ms"])


def test_pus_is_no_different(tmp_path):
    own = software(tmp_path, link="pus")
    with (
        flying(own) as flight,
        serving(tmp_path / "a", chibis=table(flight.address, own)) as client,
    ):
        assert client.value("omega_x")[3] == 2
        _, ordered = client.order("get_parameter", index=0)
        assert client.ends(ordered["id"])["state"] == "executed"
        _, ordered = client.order("set_mode", region="stabilisation", state="science")
        refused = client.ends(ordered["id"])
        assert (refused["state"], refused["reason"]) == ("refused", "not possible in this mode")
        body = {"command": "get_parameter", "values": {"index": 0}, "delay_s": 30}
        _, answer, _ = client.raw("/api/chibis/commands", json.dumps(body).encode())
        number = json.loads(answer)["id"]
        assert client.ends(number)["state"] == "received"
        until(lambda: client.ends(number)["state"] == "executed")
        assert client.value("value", packet="parameter")[3] == 2


def test_the_plan_of_pus_is_matched_by_command_and_time(tmp_path):
    """It names telecommands by numbers that the ground does not keep."""
    own = software(tmp_path, link="pus")
    folder = tmp_path / "a"
    with flying(own) as flight, serving(folder, chibis=table(flight.address, own)) as client:
        client.value("omega_x")
        body = {"command": "get_parameter", "values": {"index": 0}, "delay_s": 3000}
        _, answer, _ = client.raw("/api/chibis/commands", json.dumps(body).encode())
        number = json.loads(answer)["id"]
        assert client.ends(number)["state"] == "received"
        ground = RunningGround(folder)
        (entry,) = ground.plan()
        assert (entry["id"], entry["mark"]) == (number, "as sent")
        assert entry["request"] > 65_535
        assert ground.cancel(number)["state"] == "executed"
        assert ground.plan() == []


@pytest.mark.parametrize("address", ["udp:127.0.0.1:0", "can:virtual:ground_and_satellite"])
def test_other_links(tmp_path, address):
    if address.startswith("can"):
        pytest.importorskip("can")
    with (
        flying(address=address) as flight,
        serving(tmp_path, chibis=table(flight.address)) as client,
    ):
        assert client.value("omega_x")[3] == 2
        _, ordered = client.order("get_parameter", index=0)
        assert client.ends(ordered["id"])["state"] == "executed"


def test_historical_frames_and_several_satellites(flight, tmp_path):
    plain = software(tmp_path, link="historical")
    with flying(plain) as other:
        tables = {"chibis": table(flight.address), "old": table(other.address, plain, None)}
        with serving(tmp_path / "two", **tables) as client:
            assert [each["key"] for each in client.get("satellites")] == ["chibis", "old"]
            assert client.value("omega_x", "old")[3] == 1
            assert client.value("omega_x", "chibis")[3] == 2
            _, ordered = client.order("get_parameter", "old", index=0)
            assert client.ends(ordered["id"], "old")["state"] == "executed"
            status, answer = client.order("set_mode", "old", region="modes", state=1)
            assert status == 400 and "must be a number: no name is known" in answer["error"]
            assert client.raw("/api/old/scene")[0] == client.raw("/api/old/modes")[0] == 404
