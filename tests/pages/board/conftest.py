"""A board that serves, and the scenario that the tests of the board fly."""

import contextlib
import json
import threading
import urllib.error
import urllib.request
from pathlib import Path

import pytest

import torquer.scenario

START = Path(torquer.scenario.__file__).with_name("start.toml")
#: Far longer than anything here takes: only a failure waits so long.
PATIENCE_S = 120.0


@pytest.fixture(scope="session")
def text():
    """The scenario of `torquer init`, over half a revolution."""
    return START.read_text(encoding="utf-8").replace("revolutions = 3", "revolutions = 0.5")


@pytest.fixture
def data(text):
    """The same as plain data, for a test to change."""
    from torquer.pages.board.text import data_from_toml

    return data_from_toml(text)


class Client:
    """What a page may ask of a board."""

    def __init__(self, server):
        self.server, self.refused = server, []
        self.base = f"http://127.0.0.1:{server.port}"

    def note_refusal(self, reason, what):
        """Keep what was refused."""
        self.refused.append(f"{reason} ({what})")

    def raw(self, path, body=None, token=None, **headers):
        """Status, body and headers of an answer."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.base + path, data, headers)
        request.add_header("Authorization", f"Bearer {token or self.server.token}")
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(request, timeout=PATIENCE_S) as answer:
                return answer.status, answer.read(), answer.headers
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.read(), error.headers

    def post(self, path, body):
        """The answer in JSON, and its status."""
        status, answer, _ = self.raw(path, body)
        return status, json.loads(answer)


@contextlib.contextmanager
def serving(text, folder, **how):
    """A client of a board that serves a text in a thread of this process."""
    from torquer.pages.board.server import BoardServer

    server, ready = BoardServer(text, "satellite", folder, **how), threading.Event()
    client = Client(server)
    thread = threading.Thread(
        target=server.serve, args=(ready.set, client.note_refusal), daemon=True
    )
    thread.start()
    try:
        assert ready.wait(PATIENCE_S)
        yield client
    finally:
        server.stop()
        thread.join(PATIENCE_S)
        assert not thread.is_alive()


@pytest.fixture(scope="session", name="serving")
def _serving():
    """`with serving(text, folder, **how) as client`: a board of the test's own."""
    pytest.importorskip("uvicorn")
    return serving


@pytest.fixture(scope="session")
def served(text, tmp_path_factory):
    """A client of a board."""
    pytest.importorskip("uvicorn")
    with serving(text, tmp_path_factory.mktemp("board")) as client:
        yield client
