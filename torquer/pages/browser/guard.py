"""Who may ask what: tokens, our own Host and Origin, for HTTP and websockets alike.

The server listens on this machine only, but any page that a browser here shows can send requests to
it, and a name in the internet can be made to lead here. So each request needs the token, which
other pages do not know, a Host that is ours, and no foreign Origin. Of the two tokens one is that
of the role that commands; with the other one, whoever watches changes nothing: a method that is not
for reading is refused, whatever the route. Plain ASGI, since middleware for HTTP would let
websockets pass.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie

from starlette.requests import ClientDisconnect

from torquer.pages.browser.files import FAILURE
from torquer.pages.browser.login import Login
from torquer.pages.browser.quiet import one_line

#: What a page may load: its own files; plots set styles.
POLICY = (
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
_HEADERS = [
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
]
#: Close code of a refused websocket.
_REFUSED = 4403
#: Roles: who asks with which token. `scope["role"]` tells the application.
COMMAND, WATCH = "command", "watch"
#: Methods that change nothing.
_READS = ("GET", "HEAD")
#: What those who watch are told.
_ONLY_WATCHES = f"role: must be {COMMAND} to change anything; received {WATCH}"
#: To the page, from within the browser: a page of somebody else, or a file, that leads here has the
#: browser keep a strict cookie back.
_ONWARD = b'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url=/">'
#: That of one which cannot be served.
_FAILED = 1011
#: Most characters of a path that are shown.
_SHOWN = 60


class Guard:
    """ASGI application around another one; `refused(reason, what)` is called for each refusal.

    `token`: of who commands, `watcher`: of who only watches; `login`: of the browser we open;
    `policy`: what the page may load; `command`: the one that printed the address with the token;
    `failed(reason, what)`: called for each request at which the application fails.
    """

    def __init__(
        self,
        app,
        token: str,
        port: int,
        refused: Callable[[str, str], None],
        policy: str = POLICY,
        command: str = "torquer",
        failed: Callable[[str, str], None] = lambda reason, what: None,
        watcher: str = "",
        login: Login | None = None,
    ):
        self._failed = failed
        self._app, self._token, self._refused, self._command = app, token, refused, command
        self._watcher, self._login = watcher, login or Login()
        self._headers = [(b"content-security-policy", policy.encode()), *_HEADERS]
        hosts = (f"127.0.0.1:{port}", f"localhost:{port}")
        self._hosts = {host.encode() for host in hosts}
        self._origins = {f"http://{host}".encode() for host in hosts}
        #: Browsers share cookies between the ports of a host.
        self._cookie = f"torquer_{port}"

    async def __call__(self, scope, receive, send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        reason = self._reason(scope, headers)
        if reason:
            self._refused(reason, _describe(scope))
            await self._refuse(scope, receive, send, reason)
        elif scope["entry"]:
            await self._welcome(scope, send)
        else:
            await self._pass_on(scope, receive, send)

    async def _pass_on(self, scope, receive, send) -> None:
        """Let the application answer; where it fails, answer in its place, in one line."""
        begun = is_whole = False

        async def sending(message) -> None:
            nonlocal begun, is_whole
            begun = True
            await send(message)
            is_body = message["type"] == "http.response.body"
            is_whole = is_body and not message.get("more_body", False)

        try:
            await self._app(scope, receive, self._with_headers(sending))
        except ClientDisconnect:
            return  # whoever asked has gone before the end of the question: no failure of ours
        except Exception as error:
            self._failed(one_line("a request failed", error), _describe(scope))
            if is_whole:
                return  # the application has answered that it fails
            if begun:
                raise ConnectionAbortedError from None
            if scope["type"] == "http":
                kind = (b"content-type", b"application/json")
                await self._answer(send, 500, json.dumps(FAILURE).encode(), [kind])
            else:
                await send({"type": "websocket.close", "code": _FAILED, "reason": "cannot serve"})

    def _reason(self, scope, headers: dict[bytes, bytes]) -> str:
        """Why a request is refused; "" if it is not."""
        if headers.get(b"host") not in self._hosts:
            return "wrong host"
        origin = headers.get(b"origin")
        if origin is not None and origin not in self._origins:
            return "foreign origin"
        if scope["type"] == "websocket" and origin is None:
            return "no origin"
        scope["entry"] = self._entry(scope)
        by_cookie = self._role(_read_cookie(headers, self._cookie))
        scheme, _, given = headers.get(b"authorization", b"").partition(b" ")
        by_header = self._role(given) if scheme.lower() == b"bearer" else ""
        if scope["type"] == "websocket":
            role = by_cookie
        else:
            role = self._role(scope["entry"]) or by_header or by_cookie
        if role == WATCH and scope["type"] == "http" and scope["method"] not in _READS:
            return _ONLY_WATCHES
        scope["role"] = role
        return "" if role else "wrong token"

    def _entry(self, scope) -> bytes:
        """The token that the address of the page has, or whose code, as only the first one does."""
        if scope["type"] != "http" or scope["path"] != "/" or scope["method"] != "GET":
            return b""
        parts = [part.partition(b"=") for part in scope["query_string"].split(b"&")]
        for name, _, given in parts:
            if name == b"token" and self._role(given):
                return given
            if name == b"code" and self._login.redeem(given):
                return self._token.encode()
        return b""

    def _role(self, given: bytes) -> str:
        """The role of who has a token; "" of one that is none."""
        for role, token in ((COMMAND, self._token), (WATCH, self._watcher)):
            if token and secrets.compare_digest(given, token.encode()):
                return role
        return ""

    async def _welcome(self, scope, send) -> None:
        """Move the token from the address, which is shown and kept, into a cookie."""
        kept = (b"token=", b"code=")
        rest = [part for part in scope["query_string"].split(b"&") if not part.startswith(kept)]
        place = b"/" + (b"?" + b"&".join(rest) if rest else b"")
        cookie = f"{self._cookie}={scope['entry'].decode()}; Path=/; HttpOnly; SameSite=Strict"
        headers = [(b"set-cookie", cookie.encode())]
        if any(part.startswith(b"code=") for part in scope["query_string"].split(b"&")):
            html = (b"content-type", b"text/html; charset=utf-8")
            await self._answer(send, 200, _ONWARD, [*headers, html])
        else:
            await self._answer(send, 303, b"", [(b"location", place), *headers])

    async def _refuse(self, scope, receive, send, reason: str) -> None:
        if scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": _REFUSED, "reason": reason})
            return
        if reason == _ONLY_WATCHES:
            text, kind = json.dumps({"error": reason}), b"application/json"
        else:
            text = f"{reason}: open the address that `{self._command}` printed\n"
            kind = b"text/plain; charset=utf-8"
        await self._answer(send, 403, text.encode(), [(b"content-type", kind)])

    async def _answer(self, send, status: int, body: bytes, headers: list) -> None:
        headers = [*headers, (b"content-length", str(len(body)).encode()), *self._headers]
        await send({"type": "http.response.start", "status": status, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    def _with_headers(self, send):
        """Send with the headers of every answer."""

        async def sending(message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message["headers"], *self._headers]}
            await send(message)

        return sending


def _read_cookie(headers: dict[bytes, bytes], name: str) -> bytes:
    cookies: SimpleCookie = SimpleCookie()
    try:
        cookies.load(headers.get(b"cookie", b"").decode("latin-1"))
    except (CookieError, ValueError):
        return b""
    return cookies[name].value.encode() if name in cookies else b""


def _describe(scope) -> str:
    """What is asked, in printable characters and short: anybody can ask anything."""
    path = ascii(scope["path"])[1:-1]
    return f"{scope['type']}, {path if len(path) <= _SHOWN else path[:_SHOWN] + '...'}"
