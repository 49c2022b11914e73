"""The server of a ground: contacts with satellites, and the page, on this machine only."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from torquer.ground.client import SERVER
from torquer.ground.contact import AS_ARCHIVED, Contact, Counters
from torquer.ground.file import Satellite
from torquer.ground.ground_clock import now_ms
from torquer.ground.live import Live
from torquer.pages.browser.server import LocalServer
from torquer.pages.browser.throttle import Throttle
from torquer.pages.ground.announcement import Announcement
from torquer.pages.ground.routes import application

#: What the page may load: its own files. Open MCT needs generated code, styles and workers.
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; "
    "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
#: First and longest pause before a satellite whose service has failed is served again [s].
PAUSES_S = 1.0, 60.0
#: Time between two reports to the browsers [s].
_BEAT_S = 1.0


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
        self._refusals = Throttle(self._note_refusal)
        #: What could not be archived until the end, by satellite.
        self.unarchived: dict[str, int] = {}
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
        self._announcement = Announcement(self.folder / SERVER, self.address)
        self._announce()
        try:
            self.serve_application(self._app, POLICY, "torquer ground", self._refusals.note)
        finally:
            self._announcement.remove()
            self.close()

    def _announce(self) -> None:
        """Say in a file where the server is, as soon as it can be written."""
        if why := self._announcement.write():
            self.trouble.note(
                f"torquer ground: {SERVER} cannot be written, by which `torquer ground send` finds "
                f"this ground ({why})"
            )

    @contextlib.asynccontextmanager
    async def _lifespan(self, app):
        contacts = self.contacts.values()
        services = [*map(self._serve, contacts), *map(_serve_stack, contacts), self._beat()]
        tasks = [asyncio.create_task(each) for each in services]
        self._ready()
        yield
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, contact: Contact) -> None:
        """Serve a satellite, again after whatever ends it: the others go on."""
        pause_s, begun_s = PAUSES_S[0], 0.0
        while True:
            try:
                if begun_s:
                    await contact.restart()
                begun_s = time.monotonic()
                await contact.serve()
            except Exception as error:
                if time.monotonic() - begun_s > PAUSES_S[1]:
                    pause_s = PAUSES_S[0]  # it has worked well for a while
                begun_s = begun_s or time.monotonic()
                why = " ".join(f"{type(error).__name__}: {error}".split())
                contact.fail(f"service failed: {why[:200]}; tried again in {pause_s:g} s")
                await asyncio.sleep(pause_s)
                pause_s = min(2.0 * pause_s, PAUSES_S[1])

    async def _beat(self) -> None:
        """Tell the browsers each second that the ground is there."""
        while True:
            self._live.beat(now_ms())
            self._announce()
            self._refusals.flush()
            self.trouble.flush()
            await asyncio.sleep(_BEAT_S)

    def _note_refusal(self, line: str) -> None:
        for contact in self.contacts.values():
            contact.note("alarm", f"request refused: {line}")

    def close(self) -> None:
        """End the links and archives, and give the port back."""
        for key, contact in self.contacts.items():
            if left := contact.close():
                self.unarchived[key] = left
        self.contacts = {}
        super().close()


async def _serve_stack(contact: Contact) -> None:
    """Go on with the command stack of a satellite, again after whatever ends it."""
    while True:
        try:
            await contact.stack.serve()
        except Exception as error:
            why = " ".join(f"{type(error).__name__}: {error}".split())
            contact.note("alarm", f"the command stack failed: {why[:200]}; it goes on")
            await asyncio.sleep(PAUSES_S[1])
