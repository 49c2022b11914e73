"""What browsers and links send, whatever it is: one line, and no other effect."""

import asyncio
import json
import os
import socket
import sys
import threading
import time

import pytest
from ground_flight import serving, table, until
from ground_fuzz import Fuzzer
from small_satellite import command, ground_process, received, small_satellite

pytest.importorskip("uvicorn")


def asked(client, request, with_token=True):
    """The answer to a raw request: status, body."""
    head, _, rest = request.partition(b"\r\n")
    proof = f"Authorization: Bearer {client.token}\r\n" if with_token else ""
    own = f"Host: 127.0.0.1:{client.port}\r\nConnection: close\r\n{proof}".encode()
    with socket.create_connection(("127.0.0.1", client.port), 20) as end:
        end.sendall(head + b"\r\n" + own + (rest or b"\r\n"))
        answer = b""
        while part := end.recv(65_536):
            answer += part
    return int(answer[9:12]), answer.partition(b"\r\n\r\n")[2]


@pytest.mark.parametrize(
    ("place", "with_token", "status"),
    [
        ("/?x=%F0%9F%98%80", False, 403),
        ("/?token=%F0%9F%98%80", False, 403),
        ("/?" + "&".join(["token=a"] * 2000), False, 403),
        ("/%00", False, 403),
        ("/%00", True, 404),
        ("/a%00b.js", True, 404),
        ("/" + "a" * 300, True, 404),
        ("/" + "a/" * 3000, True, 404),
        ("/%ff%fe", True, 404),
        ("/%F0%9F%98%80", True, 404),
        ("/api/%00/log", True, 404),
        ("/api/sat/history/%F0%9F%98%80", True, 404),
        ("/api/sat/orbit?time=%F0%9F%98%80", True, 404),
        ("/api/sat/history/parameter/value?size=%C2%B2", True, 400),
        ("/api/sat/history/parameter/value?size=--5", True, 400),
        ("/api/sat/history/parameter/value?size=%D9%A3", True, 400),
        ("/api/sat/history/parameter/value?size=NaN", True, 400),
        ("/api/sat/history/parameter/value?start=1e999", True, 400),
        ("/api/sat/history/parameter/value?%00=1", True, 400),
        ("/api/sat/history/parameter/value?start=" + "9" * 5000, True, 400),
    ],
)
def test_odd_addresses_get_one_line(client, capfd, place, with_token, status):
    found, body = asked(client, f"GET {place} HTTP/1.1\r\n".encode(), with_token)
    assert found == status and body.strip().count(b"\n") == 0 and len(body) < 500
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("number", ["9" * 30, "9" * 5000, "-1", "1e3", "x", "%00", "%F0%9F%98%80"])
def test_odd_numbers_of_commands_get_one_line(client, capfd, number):
    place = f"POST /api/sat/commands/{number}/cancel HTTP/1.1\r\n".encode()
    status, body = asked(client, place + b"Content-Length: 0\r\n\r\n")
    assert status in (400, 404) and "error" in json.loads(body)
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (b'{"command": "a", "command": "b"}', "must have each key once; received 'command' twice"),
        (b'{"command": "a", "values": {"x": 1, "x": 2}}', "must have each key once"),
        (b'{"command": "get_parameter", "values": {"index": NaN}}', "values.index: must be"),
        (b'{"command": "get_parameter", "values": {"index": 1e999}}', "values.index: must be"),
        (b'{"command": "get_parameter", "values": {"index": 1' + b"0" * 5000 + b"}}", "must be"),
        (b'{"command": "\\ud800", "values": {}}', "must be a JSON object"),
        (b'{"command": "get_parameter", "values": {"\\udfff": 1}}', "must be a JSON object"),
        (b'{"a":' * 20_000, "command: must "),
    ],
)
def test_odd_bodies_get_one_line(client, capfd, body, message):
    head = b"POST /api/sat/commands HTTP/1.1\r\nContent-Length: %d\r\n\r\n" % len(body)
    status, answer = asked(client, head + body)
    error = json.loads(answer)["error"]
    assert status == 400 and message in error and "\n" not in error and len(error) < 800
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("place", ["commands", "stack", "gaps", "alarms/acknowledge"])
def test_who_goes_before_the_end_of_a_question_is_no_failure(client, capfd, place):
    head = f"POST /api/sat/{place} HTTP/1.1\r\nHost: 127.0.0.1:{client.port}\r\n"
    head += f"Authorization: Bearer {client.token}\r\nContent-Length: 100\r\n\r\n{{"
    with socket.create_connection(("127.0.0.1", client.port), 20) as end:
        end.sendall(head.encode())
        time.sleep(0.2)
    time.sleep(0.5)
    assert client.raw("/")[0] == 200 and capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "message", [b"\xff" * 9, "text", b"", b"\x00" * 70_000, b"a" * 10**6], ids=range(5)
)
def test_what_a_browser_says_by_the_websocket_is_not_heard(client, capfd, message):
    with client.live() as socket_:
        for _ in range(3):
            socket_.send(message)
        assert json.loads(socket_.recv(20))
        assert any("rows" in json.loads(socket_.recv(20)) for _ in range(50))
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("frame", [b"\x81\x82\0\0\0\0\xff\xfe", b"\x83\x80\0\0\0\0", b"\x81\x00"])
def test_odd_frames_end_the_websocket_with_a_line(client, capfd, frame):
    fuzzer = Fuzzer(client, 1)
    for _ in range(20):
        shake = fuzzer.websocket("commander").partition(b"\r\n\r\n")[0] + b"\r\n\r\n"
        asyncio.run(fuzzer.send_one(shake + frame))
    assert "Traceback" not in capfd.readouterr().err


def test_refusals_are_logged_by_cause_and_seldom(tmp_path, satellite):
    with serving(tmp_path, sat=table(satellite.address, in_scenario=None)) as client:
        for _ in range(200):
            asked(client, b"GET /%F0%9F%98%80 HTTP/1.1\r\n", with_token=False)
            assert client.raw("/", host="evil.example")[0] == 403
        time.sleep(1.5)
        said = [text for text in client.texts("sat") if "request refused" in text]
    assert any("wrong token" in text for text in said)
    assert any("wrong host" in text for text in said)
    assert len(said) < 20 and all(text.isascii() and len(text) < 200 for text in said)


def fuzz(client, satellite, capfd, number, seed=20261127):
    """Send that many messages of each kind; the ground must go on as if nothing had been."""
    fuzzer = Fuzzer(client, seed)
    obeyed = len(satellite.obeyed)
    begun_s = time.monotonic()
    fuzzer.send(number)
    satellite.injected = fuzzer.link(number, satellite.wrap)
    until(lambda: satellite.injected is None)
    errors = capfd.readouterr().err
    most = 100 + (time.monotonic() - begun_s)  # a cause that is seldom is said each time
    assert "Traceback" not in errors and errors.count("\n") < most, errors[:3000]
    assert command(client) == "executed"
    assert not any("service failed" in text for text in client.texts("sat"))
    assert set(satellite.obeyed[obeyed:]) <= {"get_parameter", "replay"}, "by who had the token"
    place = "sat/history/parameter/value?by=received&latest=1&size=500"
    coming = satellite.sent + 1
    until(lambda: coming in [value for _, _, value, _ in client.get(place)])
    return fuzzer


def test_mutated_messages_change_nothing(client, satellite, capfd):
    statuses = fuzz(client, satellite, capfd, 1500).statuses
    assert {101, 200, 400, 403, 404, 405} <= set(statuses)


@pytest.mark.slow
def test_thousands_of_mutated_messages_change_nothing(client, satellite, capfd):
    number, seed = (
        int(os.environ.get(f"TORQUER_FUZZ{x}", y)) for x, y in (("", 10_000), ("_SEED", 1))
    )
    fuzz(client, satellite, capfd, number, seed)


@pytest.mark.skipif(sys.platform == "win32", reason="no limits of descriptors")
def test_without_file_descriptors_who_is_there_is_served(tmp_path, satellite_of_its_own):
    resource = pytest.importorskip("resource")

    def limit():
        resource.setrlimit(resource.RLIMIT_NOFILE, (60, 60))

    process, client = ground_process(tmp_path, satellite_of_its_own.address, preexec_fn=limit)
    ends = []
    lines = []
    reader = threading.Thread(target=lambda: lines.extend(process.stderr), daemon=True)
    reader.start()
    try:
        with client.live() as socket_:
            for _ in range(80):
                ends.append(socket.create_connection(("127.0.0.1", client.port), 5))
            time.sleep(2.5)
            while "rows" not in json.loads(socket_.recv(0.1)):
                pass
            begun_s = time.monotonic()
            seen = 0
            while time.monotonic() - begun_s < 2.0:
                seen += len(json.loads(socket_.recv(5)).get("rows", ()))
            assert seen > 10
            for end in ends:
                end.close()
            until(lambda: received(client))
            assert command(client) == "executed"
    finally:
        process.terminate()
        process.wait(30)
        reader.join(10)
    assert process.returncode == 0
    assert not any("Traceback" in line for line in lines) and 0 < len(lines) < 15, lines
    assert any("out of system resource" in line for line in lines)


@pytest.fixture
def satellite_of_its_own():
    with small_satellite() as made:
        yield made
