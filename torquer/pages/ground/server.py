"""The server of a ground: contacts with satellites, and the page, on this machine only."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from pathlib import Path

from torquer.ground.client import SERVER
from torquer.ground.contact import AS_ARCHIVED, Contact, Counters
from torquer.ground.file import Satellite
from torquer.ground.live import Live
from torquer.pages.browser.server import LocalServer
from torquer.pages.ground.routes import application

#: What the page may load: its own files. Open MCT needs generated code, styles and workers.
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; "
    "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
#: Least time between two entries of the log on refused requests [s].
_PAUSE_S = 1.0


class Ground(LocalServer):
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
        super().__init__(port)
        self.folder, self._live = folder, Live()
        self.contacts: dict[str, Contact] = {}
        self._refusals, self._due_s = 0, 0.0
        try:
            for satellite in satellites:
                self.contacts[satellite.key] = Contact(satellite, folder, self._live, counters)
        except BaseException:
            self.close()
            raise
        self._app = application(self.contacts, self._live, self._lifespan)

    def serve(self, ready: Callable[[], None] = lambda: None) -> None:
        """Serve until a signal, or `stop` from another thread; then close everything."""
        self._ready = ready
        try:
            with _announce(self.folder / SERVER, self.address):
                self.serve_application(self._app, POLICY, "torquer ground", self._note_refusal)
        finally:
            self.close()

    @contextlib.asynccontextmanager
    async def _lifespan(self, app):
        served = (each for c in self.contacts.values() for each in (c.serve, c.stack.serve))
        tasks = [asyncio.create_task(self._serve(each)) for each in served]
        self._ready()
        yield
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, serve: Callable[[], Awaitable[None]]) -> None:
        """Serve a satellite or its stack; what ends it must be seen, and ends the others too."""
        try:
            await serve()
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

    def close(self) -> None:
        """End the links and archives, and give the port back."""
        for contact in self.contacts.values():
            contact.close()
        super().close()


@contextlib.contextmanager
def _announce(path: Path, address: str) -> Iterator[None]:
    """Within the block, a file for its owner only says where the server is."""
    path.unlink(missing_ok=True)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with open(descriptor, "w", encoding="utf-8") as file:
        json.dump({"address": address, "process": os.getpid()}, file)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
