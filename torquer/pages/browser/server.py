"""A server for pages on this machine only, which ends at a signal."""

from __future__ import annotations

import contextlib
import secrets
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import uvicorn

from torquer.pages.browser.guard import Guard
from torquer.pages.browser.login import Login
from torquer.pages.browser.quiet import quietly, say_on_stderr, watch_loop
from torquer.pages.browser.throttle import Throttle
from torquer.simulation.setup.signals import ALL

HOST = "127.0.0.1"
#: How long the end waits for browsers [s].
_GRACE_S = 2


class _Server(uvicorn.Server):
    """A server that leaves signals to its owner: uvicorn's own would end the process by them.

    `ending` is called in its loop when it begins to end, before it waits for open requests;
    `beginning` when the loop begins.
    """

    def __init__(
        self, config: uvicorn.Config, ending: Callable[[], None], beginning: Callable[[], None]
    ):
        super().__init__(config)
        self._ending, self._beginning = ending, beginning

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin."""
        self._beginning()
        await super().startup(sockets)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Say that the end begins, and end."""
        self._ending()
        await super().shutdown(sockets)

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take no signals."""
        yield


class LocalServer:
    """Serves an application at `address`, which has the token that opens it.

    `watch_address` has the token of those who change nothing.
    `port` 0: any free one; ValueError for one that is taken. The port is held from the start;
    `serve_application` answers, `close` gives it back.
    """

    def __init__(self, port: int):
        self.token, self.watcher = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
        self._login = Login()
        self._socket = _listening(port)
        self.port = self._socket.getsockname()[1]
        self._base = f"http://{HOST}:{self.port}/"
        self.address = f"{self._base}?token={self.token}"
        self.watch_address = f"{self._base}?token={self.watcher}"
        self.trouble = Throttle(say_on_stderr)
        self._server: _Server | None = None
        self._stopped = False

    def serve_application(
        self,
        app,
        policy: str,
        command: str,
        refused: Callable[[str, str], None],
        ending: Callable[[], None] = lambda: None,
    ) -> None:
        """Serve an ASGI application, behind a `Guard`, until a signal, or `stop` in another thread.

        `policy`: what its page may load; `command`: the one that printed the address. `ending` is
        called when the end begins: requests that are open some seconds later are cut off.
        """

        def note(line: str) -> None:
            self.trouble.note(f"{command}: {line}")

        def failed(reason: str, what: str) -> None:
            self.trouble.note(f"{command}: {reason}", what)

        who = failed, self.watcher, self._login
        guarded = Guard(app, self.token, self.port, refused, policy, command, *who)
        self._server = _Server(
            uvicorn.Config(
                guarded,
                log_config=None,
                lifespan="on",
                ws="websockets-sansio",
                timeout_graceful_shutdown=_GRACE_S,
                server_header=False,
                date_header=False,
            ),
            ending,
            lambda: watch_loop(note),
        )
        self._server.should_exit = self._stopped
        with _ended_by_signals(self.stop), quietly(note):
            self._server.run(sockets=[self._socket])

    def write_opener(self, folder: Path) -> Path:
        """A file in a folder, for its owner only, that opens the page once within a minute.

        It goes when it has been used, and with `close`; OSError where it cannot be written.
        """
        return self._login.write_file(folder, self._base)

    def stop(self) -> None:
        """End serving; at once if it is called again."""
        if self._server is not None:
            self._server.force_exit = self._server.should_exit
            self._server.should_exit = True
        self._stopped = True

    def close(self) -> None:
        """Give the port back."""
        self._login.close()
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
