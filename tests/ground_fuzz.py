"""Mutated HTTP, websocket and link messages for a ground, by a seed: hundreds in a second.

A connection carries several requests, of which the last one is damaged: most of the time would else
go into connections. Many connections are open at a time, since a damaged message has no answer.
"""

import asyncio
import contextlib
import random
import re
from collections import Counter

from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.software_file import load_link

_words = re.compile(r"\S+").findall
_METHODS = _words(
    "GET GET GET GET POST POST POST HEAD PUT DELETE OPTIONS PATCH TRACE CONNECT X- get"
)
_PLACES = _words("""
/ * //x /%00 /%ff%fe /a/../b /..%2f..%2fetc http://evil.example/ /main.js /style.css
/vendor/Apache-2.0.txt /api/%F0%9F%98%80/log /api/live /api/role /api/formats /api/satellites
/api/sat/history/parameter /api/sat/history/parameter/value /api/sat/history/_log/text
/api/sat/export/parameter /api/sat/past /api/sat/gaps /api/sat/log /api/sat/log/search
/api/sat/log.csv /api/sat/alarms /api/sat/alarms/acknowledge /api/sat/alarms/shelve
/api/sat/alarms/unshelve /api/sat/violations /api/sat/sent /api/sat/command-history
/api/sat/commands /api/sat/commands /api/sat/commands/1/cancel
/api/sat/commands/99999999999999999999999999/cancel /api/sat/stack /api/sat/stack
/api/sat/stack/next /api/sat/stack/run /api/sat/stack/hold /api/sat/stack/skip
/api/sat/stack/abort /api/sat/stack/%00 /api/sat/stacks/one /api/sat/stacks/..%2fone
/api/sat/stacks/%F0%9F%98%80 /api/sat/plan /api/sat/modes /api/sat/scene /api/sat/orbit
/api/sat/passes /api/sat/report /api/sat/map /api/coastline
""")
_KEYS = _words("""
start end size by latest time token code format numbers severity source text command state before
packet hours station x %F0%9F%98%80 %00 size&size
""")
_VALUES = _words("""
0 -1 1 1e999 nan NaN Infinity 9999999999999999999999 9007199254740992 1700000000000 %C2%B2
%F0%9F%98%80 %00 received time value csv parquet executed alarm ground parameter --5 +5 0x10 %ff%fe
' "; [] {} é true null 1.5 -0
""")
_BODIES = [
    b'{"command": "get_parameter", "values": {"index": 0}}',
    b'{"command": "get_parameter", "values": {"index": NaN}}',
    b'{"command": "get_parameter", "values": {"index": 1e999}, "delay_s": -1e999}',
    b'{"command": "get_parameter", "command": "reboot", "values": {}}',
    b'{"command": "\\ud800", "values": {"\\udfff": "\\u0000"}}',
    b'{"commands": [{"command": "get_parameter", "values": {"index": [[[[]]]]}}]}',
    b'{"command": "set_mode", "values": {"region": "\xff\xfe", "state": 1}}',
    b'{"command": 1' + b"0" * 5000 + b"}",
    b'{"text": "\\u0000[[", "name": ["one"]}',
    b'{"name": "one"}',
    b'{"stack": 1, "place": 1}',
    b'{"stack": 1e400, "place": -1}',
    b'{"alarms": [{"key": "parameter.value", "number": 1}], "comment": "seen"}',
    b'{"alarms": [[]], "comment": "\\u2028"}',
    b'{"key": "parameter.value", "for_s": 1e-9, "reason": "x"}',
    b'{"key": "_log.text", "for_s": NaN, "reason": ""}',
    b'{"start": 1, "end": 0}',
    b"[" * 3000,
    b'{"a":' * 3000,
    b"\xef\xbb\xbf{}",
    b"{}",
    b"",
    b"null",
]
_STACK = (
    """{"text": "[[commands]]\\ncommand = 'get_parameter'\\nvalues = {index = 0}", "name": "one"}"""
)
#: Requests that a ground grants: method, place, body.
_GRANTED = [
    ("GET", "/api/sat/history/parameter/value?by=received&latest=1&size=20&start=0", ""),
    ("GET", "/api/sat/history/parameter?start=0&end=4000000000000&size=20", ""),
    ("GET", "/api/sat/export/parameter?format=csv&numbers=value&start=0&end=1700000000000", ""),
    ("GET", "/api/sat/past?time=1900000000000&by=received", ""),
    ("GET", "/api/sat/gaps?packet=parameter&start=0&end=1900000000000", ""),
    ("POST", "/api/sat/gaps", '{"start": 5, "end": 0}'),
    ("GET", "/api/sat/log/search?severity=alarm&source=ground&text=refused&size=20", ""),
    ("GET", "/api/sat/log.csv?size=20", ""),
    ("GET", "/api/sat/violations?size=5", ""),
    ("GET", "/api/sat/command-history?command=get&state=executed&by=page&size=20&format=csv", ""),
    ("GET", "/api/sat/sent?size=20", ""),
    ("POST", "/api/sat/alarms/acknowledge", '{"alarms": [{"key": "_sat.link", "number": 1}]}'),
    ("POST", "/api/sat/alarms/shelve", '{"key": "_sat.link", "for_s": 5, "reason": "a"}'),
    ("POST", "/api/sat/alarms/unshelve", '{"key": "_sat.link"}'),
    ("POST", "/api/sat/commands", '{"command": "get_parameter", "values": {"index": 0}}'),
    ("POST", "/api/sat/stack", _STACK),
    ("POST", "/api/sat/stack", '{"name": "one"}'),
    ("PUT", "/api/sat/stacks/one", _STACK),
    ("GET", "/api/sat/stacks/one", ""),
    ("DELETE", "/api/sat/stacks/one", ""),
    *[("POST", f"/api/sat/stack/{act}", '{"stack": 1}') for act in ("run", "next", "abort")],
]
_WS = b"GET /api/live HTTP/1.1\r\nHost: HOST\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
_WS += b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"

#: How long an answer may take before the end of what was sent is said, and after it [s].
_ANSWER_S, _END_S = 0.3, 20.0
#: Requests of a connection, connections at a time, and the share of them that are websockets.
_ON_ONE, _AT_ONCE, _WEBSOCKETS = 8, 64, 0.5
#: Who sends: nobody who is known, who watches, who commands.
_NOBODY, _WATCHER, _COMMANDER = "nobody", "watcher", "commander"
_STATUS = re.compile(rb"HTTP/1\.1 (\d\d\d) ")


class Fuzzer:
    """Messages for the ground of a client; `statuses`: how many were answered by which."""

    def __init__(self, client, seed):
        self.random, self._port = random.Random(seed), client.port
        tokens = {_NOBODY: "", _WATCHER: client.watcher, _COMMANDER: client.token}
        self._tokens = {who: token.encode() for who, token in tokens.items()}
        self._host = b"127.0.0.1:%d" % client.port
        self.statuses: Counter = Counter()
        self.messages = 0

    def _cookie(self, who):
        return b"Cookie: torquer_%d=%s\r\n" % (self._port, self._tokens[who])

    def http(self, who, is_last=True):
        """A request, as bytes; one that is last may be damaged, or not whole."""
        pick, chance = self.random.choice, self.random.random
        method, place, text = pick(_GRANTED)
        body = text.encode()
        if chance() < 0.6:
            method, place = pick(_METHODS), pick(_PLACES)
            body = pick(_BODIES) if chance() < 0.4 else b""
        if chance() < 0.4:
            parts = [f"{pick(_KEYS)}={pick(_VALUES)}" for _ in range(self.random.randrange(1, 4))]
            place += ("&" if "?" in place else "?") + "&".join(parts)
        if is_last and chance() < 0.05:
            place += "a" * pick([300, 5000, 70_000])
        lines = [f"{method} {place} HTTP/1.1\r\n".encode(), b"Host: %s\r\n" % self._host]
        if self._tokens[who]:
            lines.append(
                pick([b"Authorization: Bearer %s\r\n" % self._tokens[who], self._cookie(who)])
            )
        if chance() < 0.15:
            origins = [self._host, b"evil.example", b"\xff\xfe", b"", b"null"]
            lines.append(b"Origin: http://%s\r\n" % pick(origins))
        if chance() < 0.1:
            lines.append(b'Cookie: a=\xff\xf0; torquer_%d="\\377\\400"\r\n' % self._port)
        if chance() < 0.1:
            lines.append(b"Torquer-Operator: %s\r\n" % pick(_VALUES).encode())
        if is_last and chance() < 0.1:
            lines.append(b"X: " + self.random.randbytes(40).replace(b"\n", b"") + b"\r\n")
        if body or chance() < 0.1:
            is_right = not is_last or chance() < 0.9
            size = len(body) if is_right else self.random.choice([0, 10**6, 10**30])
            lines.append(b"Content-Length: %d\r\n" % size)
        if not is_last:
            return b"".join(lines) + b"\r\n" + body
        return self._mutated(b"".join(lines) + b"Connection: close\r\n\r\n" + body, 0.6)

    def websocket(self, who):
        """A handshake, mostly a good one, and frames, mostly bad ones."""
        shake = _WS.replace(b"HOST", self._host)
        if self._tokens[who]:
            shake += self._cookie(who) + b"Origin: http://%s\r\n" % self._host
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

    def send(self, number):
        """Send about that many requests and handshakes.

        None may get an answer that it may not have, and none one of a failure.
        """
        asyncio.run(self._send_all(self.messages + number))

    async def _send_all(self, until):
        async def go_on():
            while self.messages < until:
                who = self.random.choice([_NOBODY, _WATCHER, _COMMANDER, _COMMANDER])
                if self.random.random() < _WEBSOCKETS:
                    await self._ask(who, [self.websocket(who)])
                else:
                    number = self.random.randrange(1, 2 * _ON_ONE)
                    await self._ask(
                        who, [self.http(who, k == number) for k in range(1, number + 1)]
                    )

        async with asyncio.TaskGroup() as group:
            for _ in range(min(_AT_ONCE, until - self.messages)):
                group.create_task(go_on())

    async def send_one(self, message, who=_COMMANDER):
        """Send one message by a connection of its own."""
        await self._ask(who, [message])

    async def _ask(self, who, messages):
        """Send messages by a connection, and judge their answers, which come in their order."""
        self.messages += len(messages)
        answer = await self._answer(b"".join(messages))
        found = [int(status) for status in _STATUS.findall(answer)]
        self.statuses.update(found or [0])
        for status, message in zip(found, messages, strict=False):
            self._judge(who, status, message)
        assert len(found) <= len(messages) + 1, (messages[-1][:500], found)

    def _judge(self, who, status, message):
        what = who, status, message[:500]
        assert status < 500, what
        method = message.split(b" ")[0].strip()
        may = who == _COMMANDER or (who == _WATCHER and method in (b"GET", b"HEAD"))
        assert may or status >= 400, what

    async def _answer(self, data):
        reader, writer = await asyncio.open_connection("127.0.0.1", self._port)
        answer = b""
        with contextlib.suppress(OSError):
            writer.write(data)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(_ANSWER_S):
                    answer = await reader.read(65_536)
            writer.write_eof()  # what is not whole now never will be
            async with asyncio.timeout(_END_S):
                answer += await reader.read()
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
        return answer

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
