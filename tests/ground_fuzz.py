"""Mutated HTTP, websocket and link messages for a ground, by a seed: thousands in a minute."""

import contextlib
import random
import socket

from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.software_file import load_link

_METHODS = [
    "GET",
    "GET",
    "GET",
    "POST",
    "POST",
    "HEAD",
    "PUT",
    "DELETE",
    "OPTIONS",
    "PATCH",
    "TRACE",
    "CONNECT",
    "X-",
    "get",
]
_PLACES = [
    "/",
    "/api/satellites",
    "/api/sat/history/parameter",
    "/api/sat/history/parameter/value",
    "/api/sat/log",
    "/api/sat/sent",
    "/api/sat/commands",
    "/api/sat/commands/1/cancel",
    "/api/sat/modes",
    "/api/sat/scene",
    "/api/sat/orbit",
    "/api/live",
    "/main.js",
    "/vendor/openmct/openmct.js",
    "/%00",
    "/..%2f..%2fetc",
    "/api/sat/commands/99999999999999999999999999/cancel",
    "/api/%F0%9F%98%80/log",
    "/%ff%fe",
    "//x",
    "/a/../b",
    "*",
    "http://evil.example/",
    "/api/sat/history/_log/text",
]
_KEYS = [
    "start",
    "end",
    "size",
    "by",
    "latest",
    "time",
    "token",
    "x",
    "%F0%9F%98%80",
    "%00",
    "size&size",
]
_VALUES = [
    "0",
    "-1",
    "1",
    "1e999",
    "nan",
    "NaN",
    "Infinity",
    "9999999999999999999999",
    "%C2%B2",
    "%F0%9F%98%80",
    "%00",
    "received",
    "time",
    "--5",
    "+5",
    "0x10",
    "%ff%fe",
    "'",
    '";',
    "[]",
    "{}",
    "é",
    "true",
    "null",
    "1.5",
    "-0",
]
_BODIES = [
    b'{"command": "get_parameter", "values": {"index": 0}}',
    b'{"command": "get_parameter", "values": {"index": NaN}}',
    b'{"command": "get_parameter", "values": {"index": 1e999}, "delay_s": -1e999}',
    b'{"command": "get_parameter", "command": "reboot", "values": {}}',
    b'{"command": "\\ud800", "values": {"\\udfff": "\\u0000"}}',
    b'{"commands": [{"command": "get_parameter", "values": {"index": [[[[]]]]}}]}',
    b'{"command": "set_mode", "values": {"region": "\xff\xfe", "state": 1}}',
    b'{"command": 1' + b"0" * 5000 + b"}",
    b"[" * 3000,
    b'{"a":' * 3000,
    b"\xef\xbb\xbf{}",
    b"{}",
    b"",
    b"null",
]
_WS = b"GET /api/live HTTP/1.1\r\nHost: HOST\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
_WS += b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"

#: How long an answer to a whole message may take; others get none before their end [s].
_ANSWER_S = 0.3


class Fuzzer:
    """Messages for the ground of a client; `knows`: whether a message has the token."""

    def __init__(self, client, seed):
        self.random, self._port = random.Random(seed), client.port
        self._token = client.token.encode()
        self._cookie = b"Cookie: torquer_%d=%s\r\n" % (client.port, self._token)
        self._host = b"127.0.0.1:%d" % client.port
        self.statuses = {}

    def http(self):
        """A request, as bytes."""
        pick, chance = self.random.choice, self.random.random
        place = pick(_PLACES)
        if chance() < 0.6:
            parts = [f"{pick(_KEYS)}={pick(_VALUES)}" for _ in range(self.random.randrange(1, 4))]
            place += "?" + "&".join(parts)
        if chance() < 0.02:
            place += "a" * self.random.choice([300, 5000, 70_000])
        body = pick(_BODIES) if chance() < 0.4 else b""
        lines = [f"{pick(_METHODS)} {place} HTTP/1.1\r\n".encode(), b"Host: %s\r\n" % self._host]
        if chance() < 0.7:
            proofs = [b"Authorization: Bearer %s\r\n" % self._token, self._cookie]
            lines.append(pick(proofs))
        if chance() < 0.3:
            origins = [self._host, b"evil.example", b"\xff\xfe", b"", b"null"]
            lines.append(b"Origin: http://%s\r\n" % pick(origins))
        if chance() < 0.1:
            lines.append(b'Cookie: a=\xff\xf0; torquer_%d="\\377\\400"\r\n' % self._port)
        if chance() < 0.05:
            lines.append(b"X: " + self.random.randbytes(40).replace(b"\n", b"") + b"\r\n")
        if body or chance() < 0.1:
            size = len(body) if chance() < 0.9 else self.random.choice([0, 10**6, 10**30])
            lines.append(b"Content-Length: %d\r\n" % size)
        return self._mutated(b"".join(lines) + b"Connection: close\r\n\r\n" + body, 0.3)

    def websocket(self):
        """A handshake, mostly a good one, and frames, mostly bad ones."""
        shake = _WS.replace(b"HOST", self._host)
        if self.random.random() < 0.8:
            shake += self._cookie + b"Origin: http://%s\r\n" % self._host
        frames = b"".join(self._frame() for _ in range(self.random.randrange(4)))
        return self._mutated(shake + b"\r\n", 0.15) + frames

    def _frame(self):
        size = self.random.choice([0, 1, 5, 125, 126, 127])
        data = self.random.randbytes(min(size, 125))
        first = self.random.choice([0x81, 0x82, 0x88, 0x89, 0x8A, 0x01, 0x80, 0x83, 0xC1, 0xFF])
        mask = self.random.choice([0x80, 0x80, 0])
        head = bytes([first, mask | size])
        if size > 125:
            head += self.random.randbytes(2 if size == 126 else 8)
        return head + (self.random.randbytes(4) if mask else b"") + data

    def _mutated(self, data, share):
        found = bytearray(data)
        while self.random.random() < share and found:
            at = self.random.randrange(len(found))
            kind = self.random.randrange(4)
            if kind == 0:
                found[at] = self.random.randrange(256)
            elif kind == 1:
                del found[at : at + self.random.randrange(1, 9)]
            elif kind == 2:
                found[at:at] = self.random.randbytes(self.random.randrange(1, 9))
            else:
                del found[at:]
        return bytes(found)

    def send(self, message):
        """Send a message; it must get no answer that it may not have, and none of a failure."""
        with socket.create_connection(("127.0.0.1", self._port), 20) as end:
            answer = b""
            end.settimeout(_ANSWER_S)
            with contextlib.suppress(OSError):
                end.sendall(message)
                answer = end.recv(4096)
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_WR)  # what is not whole now never will be
                answer = answer or end.recv(4096)
        status = answer[9:12].decode("latin-1") if answer.startswith(b"HTTP/1.1 ") else ""
        self.statuses[status] = self.statuses.get(status, 0) + 1
        assert not status.startswith("5"), (status, message[:500], answer[:300])
        if self._token not in message:
            assert status[:1] in ("", "4"), (status, message[:500])

    def link(self, number, wrap):
        """That many frames of telemetry, most of them damaged, as bytes that `wrap` protects."""
        made = Downlink(load_link().dictionary)
        packets = {"parameter": (7, 1.5), "event": (3, 49, -7, 4.2e11)}
        for k in range(number):
            name = self.random.choice([*packets])
            frame = made.frame(name, k, packets[name])
            if self.random.random() < 0.5:  # damaged before it is authenticated
                frame = self._mutated(frame, 0.7)
            yield self._mutated(wrap(frame), 0.3)
