"""Who may ask: every request without a token, with a foreign Origin or Host is refused."""

import asyncio
import json
import os
import stat

import pytest

from torquer.pages.browser.guard import Guard
from torquer.pages.browser.login import Login

PORT, TOKEN, WATCHER = 8421, "a-token-of-this-run", "a-token-to-watch"
HOST, ORIGIN = (b"host", b"127.0.0.1:8421"), (b"origin", b"http://127.0.0.1:8421")
COOKIE = (b"cookie", b"other=1; torquer_8421=a-token-of-this-run")
BEARER = (b"authorization", b"Bearer a-token-of-this-run")
WATCHING = {
    "cookie": (b"cookie", b"torquer_8421=a-token-to-watch"),
    "header": (b"authorization", b"Bearer a-token-to-watch"),
}


class Served:
    """What one request leads to."""

    def __init__(
        self, *headers, kind="http", path="/api/satellites", query=b"", method="GET", login=None
    ):
        self.messages, self.refused, self.reached = [], [], False
        scope = {
            "type": kind,
            "path": path,
            "query_string": query,
            "headers": list(headers),
            "method": method,
        }
        if kind == "websocket":
            del scope["method"]
        keys = {"watcher": WATCHER, "login": login, "failed": self._failed}
        guard = Guard(self._application, TOKEN, PORT, self._refused, **keys)
        asyncio.run(guard(scope, self._receive, self._send))

    def _refused(self, reason, what):
        self.refused.append(f"{reason} ({what})")

    def _failed(self, reason, what):
        raise AssertionError(reason)

    async def _application(self, scope, receive, send):
        self.reached, self.role = True, scope["role"]
        if scope["type"] == "http":
            await send({"type": "http.response.start", "status": 200, "headers": []})
            await send({"type": "http.response.body", "body": b"inside"})

    async def _receive(self):
        return {"type": "websocket.connect"}

    async def _send(self, message):
        self.messages.append(message)

    @property
    def status(self):
        return self.messages[0].get("status", self.messages[0].get("code"))

    def header(self, name):
        return dict(self.messages[0]["headers"]).get(name, b"")


@pytest.mark.parametrize("proof", [COOKIE, BEARER])
def test_the_token_opens(proof):
    served = Served(HOST, proof)
    assert served.reached and served.status == 200 and not served.refused
    assert b"default-src 'self'" in served.header(b"content-security-policy")


def test_our_own_origin_is_no_foreign_one():
    assert Served(HOST, COOKIE, ORIGIN, method="POST").reached
    local = (b"host", b"localhost:8421"), (b"origin", b"http://localhost:8421")
    assert Served(*local, COOKIE).reached
    assert Served(HOST, COOKIE, ORIGIN, kind="websocket").reached


WRONG = {
    "no token": ((HOST,), "wrong token"),
    "another token": ((HOST, (b"cookie", b"torquer_8421=guess")), "wrong token"),
    "the token of another port": (
        (HOST, (b"cookie", b"torquer_8422=a-token-of-this-run")),
        "wrong token",
    ),
    "a broken cookie": ((HOST, (b"cookie", b"\xff=;;=\x00")), "wrong token"),
    "another scheme": ((HOST, (b"authorization", b"Basic a-token-of-this-run")), "wrong token"),
    "an empty bearer": ((HOST, (b"authorization", b"Bearer ")), "wrong token"),
    "a foreign origin": ((HOST, COOKIE, (b"origin", b"http://evil.example")), "foreign origin"),
    "another port's origin": (
        (HOST, COOKIE, (b"origin", b"http://127.0.0.1:9999")),
        "foreign origin",
    ),
    "an origin of no name": ((HOST, COOKIE, (b"origin", b"null")), "foreign origin"),
    "a secure origin": ((HOST, COOKIE, (b"origin", b"https://127.0.0.1:8421")), "foreign origin"),
    "a name led here": (((b"host", b"evil.example:8421"), COOKIE), "wrong host"),
    "no host": ((COOKIE,), "wrong host"),
}


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize("what", WRONG)
def test_all_else_is_refused_and_noted(what, kind):
    headers, reason = WRONG[what]
    if kind == "websocket" and b"origin" not in dict(headers):
        headers = (*headers, ORIGIN)
    served = Served(*headers, kind=kind)
    assert not served.reached
    assert served.status == (403 if kind == "http" else 4403)
    assert len(served.refused) == 1 and served.refused[0].startswith(reason)
    assert TOKEN not in str(served.messages) + served.refused[0]


def test_a_websocket_needs_cookie_and_origin():
    assert not Served(HOST, COOKIE, kind="websocket").reached
    assert not Served(HOST, BEARER, ORIGIN, kind="websocket").reached
    query = Served(HOST, ORIGIN, kind="websocket", path="/", query=b"token=" + TOKEN.encode())
    assert not query.reached


def test_token_address_becomes_a_cookie_and_a_tokenless_address():
    served = Served(HOST, path="/", query=b"a=b&token=" + TOKEN.encode())
    assert not served.reached and served.status == 303
    assert served.header(b"location") == b"/?a=b"
    cookie = served.header(b"set-cookie").decode()
    assert cookie.startswith(f"torquer_{PORT}={TOKEN};")
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie


@pytest.mark.parametrize("proof", WATCHING)
def test_who_watches_reads_and_changes_nothing(proof):
    for method in ("GET", "HEAD"):
        served = Served(HOST, WATCHING[proof], method=method)
        assert served.reached and served.role == "watch"
    for method in ("POST", "PUT", "PATCH", "DELETE", "OPTIONS", "get", "ANYTHING", ""):
        served = Served(HOST, WATCHING[proof], ORIGIN, method=method)
        assert (served.reached, served.status) == (False, 403), method
        (line,) = json.loads(served.messages[1]["body"]).values()
        assert line == "role: must be command to change anything; received watch"


def test_who_watches_follows_what_comes():
    assert Served(HOST, WATCHING["cookie"], ORIGIN, kind="websocket").role == "watch"
    assert Served(HOST, COOKIE, ORIGIN, kind="websocket").role == "command"
    assert not Served(HOST, WATCHING["header"], ORIGIN, kind="websocket").reached


def test_the_address_to_watch_sets_the_cookie_to_watch():
    served = Served(HOST, path="/", query=b"token=" + WATCHER.encode())
    cookie = served.header(b"set-cookie").decode()
    assert served.status == 303 and WATCHER in cookie and TOKEN not in cookie


def test_a_guard_without_a_second_token_has_no_watchers():
    guard = Guard(None, TOKEN, PORT, print)
    assert [guard._role(given) for given in (b"", WATCHER.encode(), TOKEN.encode())] == [
        *("", "", "command")
    ]


def code_in(path):
    return path.read_text().split("?code=")[1].split('"')[0].encode()


def test_a_code_opens_once_and_leads_on_to_the_page(tmp_path):
    login = Login()
    path = login.write_file(tmp_path, "http://127.0.0.1:8421/")
    if os.name == "posix":
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert TOKEN not in path.read_text()
    code = b"code=" + code_in(path)
    for other in ({"path": "/api/satellites"}, {"method": "POST"}, {"kind": "websocket"}):
        assert not Served(HOST, ORIGIN, query=code, login=login, **({"path": "/"} | other)).reached
    assert Served(ORIGIN, path="/", query=code, login=login).status == 403  # of another host
    served = Served(HOST, path="/", query=code, login=login)
    assert served.status == 200 and TOKEN in served.header(b"set-cookie").decode()
    page = served.messages[1]["body"].decode()
    assert "url=/" in page and TOKEN not in page and not path.exists()
    assert Served(HOST, path="/", query=code, login=login).status == 403


def test_a_code_is_void_after_a_minute_or_when_the_server_ends(tmp_path, monkeypatch):
    clock = 1000.0
    monkeypatch.setattr("torquer.pages.browser.login.time.monotonic", lambda: clock)
    login = Login()
    first = code_in(login.write_file(tmp_path, "http://127.0.0.1:8421/"))
    path = login.write_file(tmp_path, "http://127.0.0.1:8421/")
    second = code_in(path)
    assert not login.redeem(first) and not login.redeem(b"")
    clock += 61.0
    assert not login.redeem(second)
    third = code_in(login.write_file(tmp_path, "http://127.0.0.1:8421/"))
    login.close()
    assert not login.redeem(third) and not login.redeem(b"") and not path.exists()


@pytest.mark.parametrize(
    ("path", "query", "method"),
    [
        ("/", b"token=guess", "GET"),
        ("/", b"token=", "GET"),
        ("/api/satellites", b"token=" + TOKEN.encode(), "GET"),
        ("/", b"token=" + TOKEN.encode(), "POST"),
    ],
)
def test_a_token_in_another_address_opens_nothing(path, query, method):
    assert not Served(HOST, path=path, query=query, method=method).reached


class Failing(Served):
    """A request at which the application fails after what it has `sent`."""

    def __init__(self, *sent, **keys):
        self.sent, self.failed = sent, []
        super().__init__(HOST, COOKIE, ORIGIN, **keys)

    async def _application(self, scope, receive, send):
        for message in self.sent:
            await send(message)
        raise RuntimeError("no\n\x1b[31m/secret/path " + 1000 * "x")

    def _failed(self, reason, what):
        self.failed.append((reason, what))


START = {"type": "http.response.start", "status": 500, "headers": []}
BODY = {"type": "http.response.body", "body": b'{"error": "told"}'}


@pytest.mark.parametrize("sent", [(), (START, BODY)])
def test_a_failure_is_one_line_there_and_nothing_of_why_here(sent):
    served = Failing(*sent)
    ((reason, what),) = served.failed
    assert reason.startswith("a request failed: RuntimeError: no \\x1b[31m/secret/path xxx")
    assert len(reason) < 220 and what == "http, /api/satellites"
    start, body = served.messages
    assert start["status"] == 500 and b"secret" not in body["body"]
    assert list(json.loads(body["body"])) == ["error"]


def test_a_failure_within_an_answer_ends_the_connection():
    with pytest.raises(ConnectionAbortedError):
        Failing(START, {**BODY, "more_body": True})
