"""Who may do what at the ground, and that no list of processes, file or history has a token."""

import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, suppress
from pathlib import Path
from urllib.parse import quote

import pytest
from ground_flight import PATIENCE_S, serving, table
from starlette.routing import Route
from watched_page import CHROMIUM, FLAGS

from torquer.ground.live import Live
from torquer.pages.browser.server import LocalServer
from torquer.pages.ground.routes import application

pytest.importorskip("uvicorn")

READS = {"GET", "HEAD"}
ROUTES = [each for each in application({}, Live(), None).routes if isinstance(each, Route)]
PLACES = {"satellite": "sat", "packet": "beacon", "number": "1", "action": "run", "name": "x"}


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A ground whose satellite is silent; `tokens` by roles."""
    folder = tmp_path_factory.mktemp("ground")
    with serving(folder, sat=table("tcp:127.0.0.1:9", None, None)) as made:
        made.folder = folder
        yield made


def asked(client, token, method, path, body=b"{}"):
    import http.client

    connection = http.client.HTTPConnection("127.0.0.1", client.port, timeout=PATIENCE_S)
    with closing(connection):
        connection.request(method, path, body, {"authorization": f"Bearer {token}"})
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


def path_of(route):
    return re.sub(r"\{(\w+)(:\w+)?\}", lambda key: PLACES.get(key[1], "x"), route.path)


def test_there_are_routes_that_change_something():
    assert sum(bool(route.methods - READS) for route in ROUTES) >= 6


@pytest.mark.parametrize(
    "route", [pytest.param(r, id=f"{r.path} {sorted(r.methods)}") for r in ROUTES]
)
def test_every_route_that_is_not_for_reading_needs_the_role_that_commands(client, route):
    for method in sorted(route.methods | {"POST", "PUT", "PATCH", "DELETE", "OPTIONS"}):
        status, text = asked(client, client.watcher, method, path_of(route))
        if method in READS:
            assert status != 403, (method, route.path)
        else:
            line = json.loads(text)["error"]
            assert (status, line) == (
                403,
                "role: must be command to change anything; received watch",
            )
            # the other role gets past the guard, whatever the route then says of it
            assert asked(client, client.token, method, path_of(route))[0] != 403
    assert asked(client, client.token, "GET", "/api/sat/sent")[1] == "[]"


def test_the_page_is_told_its_role(client):
    assert asked(client, client.watcher, "GET", "/api/role")[1] == '{"role":"watch"}'
    assert asked(client, client.token, "GET", "/api/role")[1] == '{"role":"command"}'


def test_only_the_token_that_commands_is_kept_for_the_command_line(client):
    path = client.folder / "server.json"
    assert client.token in path.read_text() and client.watcher not in path.read_text()
    if os.name == "posix":
        assert path.stat().st_mode & 0o777 == 0o600


# Names that are stated


def order(client, name):
    headers = {} if name is None else {"torquer-operator": name}
    body = json.dumps({"command": "report_status", "values": {"module_id": 1}}).encode()
    status, answer, _ = client.raw("/api/sat/commands", body, **headers)
    return status, json.loads(answer)


@pytest.mark.parametrize(
    ("stated", "by"),
    [
        (None, "command line"),
        ("Ada", "Ada (stated), command line"),
        (quote("Анна Ким"), "Анна Ким (stated), command line"),
        (quote("<b>O'Neil</b>"), "<b>O'Neil</b> (stated), command line"),
    ],
)
def test_who_orders_is_recorded_as_stated(client, stated, by):
    status, made = order(client, stated)
    assert (status, made["made_by"]) == (200, by)
    assert client.raw(f"/api/sat/commands/{made['id']}/cancel", b"{}")[0] == 200


@pytest.mark.parametrize(
    "stated", ["%0a", "a%00b", "%ff", "%20", "x" * 41, "%e2%80%ae", "%ed%a0%80"]
)
def test_a_name_that_is_none_gets_one_line(client, stated):
    status, answer = order(client, stated)
    assert status == 400 and answer["error"].startswith("operator: must be 1 to 40 printable")
    assert "\n" not in answer["error"]


# Processes


def test_no_private_file_no_browser(tmp_path, capsys):
    from torquer.cli.output import show_address

    server = LocalServer(0)
    with closing(server):
        show_address(server, tmp_path / "nothing", False)
    out, err = capsys.readouterr()
    assert server.address in out and "no browser is opened" in err


@pytest.mark.skipif(
    not Path("/proc/self/cmdline").exists(), reason="processes are listed otherwise"
)
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
@pytest.mark.parametrize("command", ["ground", pytest.param("board", marks=pytest.mark.slow)])
def test_no_process_and_no_history_shows_a_token(tmp_path, command):
    sync_api = pytest.importorskip("playwright.sync_api")
    profile, browser = tmp_path / "profile", tmp_path / "browser"
    flags = " ".join(
        [*FLAGS, "--headless", "--remote-debugging-port=0", f"--user-data-dir={profile}"]
    )
    own = f'echo $$ > "{tmp_path}/pid"\nexec {CHROMIUM} {flags} "$@" > /dev/null 2>&1\n'
    browser.write_text(f"#!/bin/sh\n{own}")
    browser.chmod(0o755)
    words = ["--link", "tcp:127.0.0.1:9", "--folder", str(tmp_path / "g")] * (command == "ground")
    with subprocess.Popen(
        [sys.executable, "-m", "torquer", command, *words, "--port", "0"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
        env={**os.environ, "BROWSER": f"{browser} %s", "DISPLAY": "",
             "PYTHONPATH": str(Path(__file__).parents[3])},
    ) as server:  # fmt: skip
        try:
            lines = [server.stdout.readline() for _ in range(3 if command == "ground" else 2)]
            tokens = re.findall(r"token=(\S+)", "".join(lines))
            assert len(tokens) == (2 if command == "ground" else 1)
            base = lines[0].split("?")[0]
            seen, port = set(), profile / "DevToolsActivePort"
            end_s = time.monotonic() + PATIENCE_S
            while not port.exists() and time.monotonic() < end_s:
                seen |= command_lines()
            with sync_api.sync_playwright() as playwright:
                address = f"http://127.0.0.1:{port.read_text().split()[0]}"
                shown = playwright.chromium.connect_over_cdp(address)
                page = shown.contexts[0].pages[0]
                page.wait_for_url(f"{base}**", timeout=PATIENCE_S * 1e3)
                page.wait_for_function("document.title !== 'torquer' && document.title !== ''")
                assert "token" not in page.url and "code" not in page.url
                assert page.evaluate("document.referrer") == ""
                assert page.evaluate("fetch('/api/nothing').then(a => a.status)") == 404
                seen |= command_lines()
                shown.new_browser_cdp_session().send("Browser.close")
        finally:
            with suppress(OSError, ValueError):
                os.kill(int((tmp_path / "pid").read_text()), signal.SIGKILL)
            server.terminate()
            _, err = server.communicate(timeout=PATIENCE_S)
    text = "\n".join(seen)
    assert "open_in_browser_" in text  # the browser was among those seen
    assert not any(token in text for token in tokens) and "?code=" not in text
    assert "Traceback" not in err
    assert not list(tmp_path.rglob("open_in_browser_*"))
    for history in profile.rglob("History"):
        with closing(sqlite3.connect(history)) as db:
            addresses = str(db.execute("SELECT url FROM urls").fetchall())
        assert not any(token in addresses for token in tokens)


def command_lines():
    """The arguments of all processes, as everybody sees them."""
    found = set()
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            found.add(path.read_bytes().replace(b"\0", b" ").decode("utf-8", "replace"))
    return found
