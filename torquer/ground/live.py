"""What is sent to the browsers as it happens: bounded for each, whatever it reads.

The text of a row or message is made once for all browsers.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from itertools import chain
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from torquer.base.strict_json import INFINITIES, json_text
from torquer.ground.archive import Row

#: Most rows of a packet, and most other messages, that wait for a browser: the oldest are dropped.
MOST_ROWS, MOST_MESSAGES = 64, 200
#: Time between two messages to a browser [s].
PAUSE_S = 0.03


class Listener:
    """One browser: what waits for it; `dropped`: rows that it was too slow for."""

    def __init__(self) -> None:
        self._rows: dict[tuple[str, str], deque[str]] = {}
        self._others: dict[str, deque[str]] = {}
        self._wakes = asyncio.Event()
        self.dropped = 0

    def put_row(self, satellite: str, packet: str, row: str) -> None:
        """Add a row, as JSON."""
        rows = self._rows.setdefault((satellite, packet), deque(maxlen=MOST_ROWS))
        self.dropped += len(rows) == MOST_ROWS
        rows.append(row)
        self._wakes.set()

    def put(self, kind: str, message: str) -> None:
        """Add a message of another kind, as JSON."""
        self._others.setdefault(kind, deque(maxlen=MOST_MESSAGES)).append(message)
        self._wakes.set()

    def beat(self, clock_ms: int) -> None:
        """Add the report of each second, with the ground's clock; only the last one waits."""
        self._others["beat"] = deque([_text({"clock_ms": clock_ms, "dropped": self.dropped})])
        self._wakes.set()

    async def serve(self, socket: WebSocket) -> None:
        """Send what comes until the browser has gone."""
        reader = asyncio.create_task(_until_closed(socket))
        try:
            while not reader.done():
                taker = asyncio.create_task(self.take())
                await asyncio.wait({reader, taker}, return_when=asyncio.FIRST_COMPLETED)
                if not taker.done():
                    taker.cancel()
                    return
                await socket.send_text(taker.result())
                await asyncio.sleep(PAUSE_S)
        finally:
            reader.cancel()

    async def take(self) -> str:
        """What waits, as JSON, as soon as something does."""
        await self._wakes.wait()
        self._wakes.clear()
        found: dict[str, Iterable[str]] = {**self._others}
        if self._rows:
            found["rows"] = chain.from_iterable(self._rows.values())
        parts = [f'"{kind}":[{",".join(waiting)}]' for kind, waiting in found.items()]
        self._others.clear()
        self._rows.clear()
        return f"{{{','.join(parts)}}}"


async def _until_closed(socket: WebSocket) -> None:
    """Read what a browser sends, which is nothing, until it has gone."""
    with suppress(WebSocketDisconnect):
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass


class Live:
    """All browsers."""

    def __init__(self) -> None:
        self.listeners: set[Listener] = set()

    def rows(self, satellite: str, rows: list[Row]) -> None:
        """Rows for everybody."""
        if not self.listeners:
            return
        for row in rows:
            text = _text((satellite, row.packet, *row[1:4], row.values))
            for listener in self.listeners:
                listener.put_row(satellite, row.packet, text)

    def message(self, kind: str, satellite: str, message: dict) -> None:
        """A message for everybody."""
        text = message_text(satellite, message)
        for listener in self.listeners:
            listener.put(kind, text)

    def beat(self, clock_ms: int) -> None:
        """The report of each second for everybody."""
        for listener in self.listeners:
            listener.beat(clock_ms)


def message_text(satellite: str, message: dict) -> str:
    """A message of a satellite as JSON."""
    return _text({"satellite": satellite, **message})


def _text(data: Any) -> str:
    return json_text(data, None, INFINITIES)
