"""The server of a ground: contacts with satellites, and the page, on this machine only."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import secrets
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import uvicorn

from torquer.ground import SERVER
from torquer.ground.contact import AS_ARCHIVED, Contact, Counters
from torquer.ground.file import Satellite
from torquer.ground.guard import Guard
from torquer.ground.live import Live
from torquer.ground.routes import application
from torquer.simulation.signals import ALL

HOST = "127.0.0.1"
#: How long the end waits for browsers and archives [s].
_GRACE_S = 2
#: Least time between two entries of the log on refused requests [s].
_PAUSE_S = 1.0


class _Server(uvicorn.Server):
    """A server that leaves signals to the ground: uvicorn's own would end the process by them."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take no signals."""
        yield


class Ground:
    """A ground that serves satellites: archives in `folder`, the page at `address`.

    `port` 0: any free one. ValueError with one line for a port that is taken, links and archives
    that cannot be opened.
    """

    def __init__(
        self,
        satellites: Sequence[Satellite],
        folder: Path,
        port: int = 0,
        counters: Counters = AS_ARCHIVED,
    ):
        self.folder, self.token = folder, secrets.token_urlsafe(32)
        self._socket = _listening(port)
        self.port = self._socket.getsockname()[1]
        self.address = f"http://{HOST}:{self.port}/?token={self.token}"
        self._live, self.contacts = Live(), {}
        self._refusals, self._due_s = 0, 0.0
        try:
            for satellite in satellites:
                self.contacts[satellite.key] = Contact(satellite, folder, self._live, counters)
        except BaseException:
            self._close()
            raise
        app = application(self.contacts, self._live, self._lifespan)
        self._server = _Server(
            uvicorn.Config(
                Guard(app, self.token, self.port, self._note_refusal),
                log_level="warning",
                lifespan="on",
                ws="websockets-sansio",
                timeout_graceful_shutdown=_GRACE_S,
                server_header=False,
                date_header=False,
            )
        )

    def serve(self, ready: Callable[[], None] = lambda: None) -> None:
        """Serve until a signal, or `stop` from another thread; then close everything."""
        self._ready = ready
        try:
            with _ended_by_signals(self.stop), _announced(self.folder / SERVER, self.address):
                self._server.run(sockets=[self._socket])
        finally:
            self._close()

    def stop(self) -> None:
        """End `serve`; at once if it is called again."""
        self._server.force_exit = self._server.should_exit
        self._server.should_exit = True

    @contextlib.asynccontextmanager
    async def _lifespan(self, app):
        tasks = [asyncio.create_task(self._serve(each)) for each in self.contacts.values()]
        self._ready()
        yield
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, contact: Contact) -> None:
        """Serve a satellite; what ends it must be seen, and ends the others too."""
        try:
            await contact.serve()
        except Exception as error:
            self.failed = error
            self.stop()

    #: What ended the service, if it was not a signal.
    failed: Exception | None = None

    def _note_refusal(self, what: str) -> None:
        """Log a refused request, not more than one a second."""
        self._refusals += 1
        if time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + _PAUSE_S
            more = f" and {self._refusals - 1} more" if self._refusals > 1 else ""
            self._refusals = 0
            for contact in self.contacts.values():
                contact.note("alarm", f"request refused: {what}{more}")

    def _close(self) -> None:
        for contact in self.contacts.values():
            contact.close()
        self._socket.close()


def _listening(port: int) -> socket.socket:
    try:
        return socket.create_server((HOST, port))
    except (OSError, OverflowError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise ValueError(f"--port: must be a port that is free; received {port} ({why})") from None


@contextlib.contextmanager
def _ended_by_signals(stop: Callable[[], None]) -> Iterator[None]:
    """Within the block, signals call `stop`, if this is the main thread, which alone gets them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, lambda *_: stop()) for number in ALL}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def _announced(path: Path, address: str) -> Iterator[None]:
    """Within the block, a file for its owner only says where the server is."""
    path.unlink(missing_ok=True)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with open(descriptor, "w", encoding="utf-8") as file:
        json.dump({"address": address, "process": os.getpid()}, file)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
