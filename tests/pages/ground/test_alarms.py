"""Alarms at the console: routes, live messages, the list, the log; fed by a link, no flight."""

import csv
import io
import json
import re
import shutil
import subprocess
from contextlib import closing

import pytest

pytest.importorskip("uvicorn")

from ground_flight import serving, table, until
from watched_page import CHROMIUM, browser_context, watched_page

from torquer.computer.names import Names
from torquer.flight.link import open_link
from torquer.flight.packets.frames import Downlink
from torquer.flight.packets.protected import TelemetrySender
from torquer.flight.packets.reasons import Reason
from torquer.flight.packets.software_file import load_link
from torquer.ground.limits import Limits, describe_limits
from torquer.pages.ground.routes import WEB

NODE = shutil.which("node")
PATIENCE_MS = 40_000
CURRENT, SWITCHED_OFF = "housekeeping.coils_current", "housekeeping.switched_off"


class Satellite:
    """Sends packets as a satellite does, a second apart by its clock."""

    def __init__(self, link):
        software = load_link()
        keys, self._packets = software.keys, software.dictionary.down
        self._link, self._made, self.time_s = link, Downlink(software.dictionary), 100
        self._sender = TelemetrySender(keys.down, keys.spi, keys.spacecraft)

    def send(self, packet, **given):
        self.time_s += 1
        values = dict.fromkeys(self._packets[packet].names, 0.0) | given
        if "on_board_ms" in values:
            values["on_board_ms"] = 1e3 * self.time_s
        frame = self._made.frame(packet, self.time_s, tuple(values.values()))
        self._link.send(self._sender.wrap(frame) + self._sender.flush())


@pytest.fixture
def fed(tmp_path):
    """A satellite and a client of the ground that hears it."""
    with (
        closing(open_link("tcp:127.0.0.1:0")) as link,
        serving(tmp_path, sat=table(link.address, in_scenario=None)) as client,
    ):
        until(lambda: link.receive() or link.peers)
        yield Satellite(link), client


def alarms(client):
    return {each["key"]: each for each in client.get("sat/alarms")["alarms"]}


def post(client, what, **body):
    status, answer, _ = client.raw(f"/api/sat/{what}", json.dumps(body).encode())
    return status, json.loads(answer)


def seen(client, *keys):
    return [{"key": key, "number": alarms(client)[key]["number"]} for key in keys]


def test_an_alarm_from_its_raising_to_its_end_in_the_log(fed):
    satellite, client = fed
    satellite.send("housekeeping", coils_current=1.7)
    until(lambda: alarms(client))
    satellite.send("housekeeping", coils_current=1.9, switched_off=1)
    until(lambda: len(alarms(client)) == 2)
    alarm = alarms(client)[CURRENT]
    assert (alarm["state"], alarm["severity"], alarm["unit"]) == ("active", "warning", "A")
    assert client.get("sat/alarms")["counts"] == {"alarm": 1, "warning": 1, "shelved": 0, "all": 2}
    status, (answer,) = post(
        client, "alarms/acknowledge", alarms=seen(client, CURRENT), comment="a test"
    )
    assert status == 200 and answer["state"] == "acknowledged"
    assert answer["acknowledged_by"] == "command line" and answer["comment"] == "a test"
    satellite.send("housekeeping", switched_off=1)
    until(lambda: alarms(client)[CURRENT]["state"] == "settling")
    log = until(lambda: [v for v in client.get("sat/violations") if v["is_over"]])
    assert (log[0]["key"], log[0]["comment"]) == (CURRENT, "a test")
    assert log[0]["extreme"] == pytest.approx(1.9)
    assert log[0]["end_ms"] - log[0]["start_ms"] == 1000
    texts = client.texts("sat")
    assert f"alarm raised: {CURRENT} above 1.5 A, 1.7" in texts
    assert f"acknowledged by command line: {CURRENT} (a test)" in texts


def test_shelving(fed):
    satellite, client = fed
    shelf = {"key": SWITCHED_OFF, "for_s": 3600, "reason": "repair"}
    status, answer = post(client, "alarms/shelve", **shelf)
    assert status == 200 and answer["shelf"]["reason"] == "repair" and "state" not in answer
    satellite.send("housekeeping", switched_off=1)
    until(lambda: "state" in alarms(client)[SWITCHED_OFF])
    assert client.get("sat/alarms")["counts"] == {"alarm": 0, "warning": 0, "shelved": 1, "all": 1}
    assert not any("alarm raised" in text for text in client.texts("sat"))
    status, answer = post(client, "alarms/unshelve", key=SWITCHED_OFF)
    assert status == 200 and "shelf" not in answer
    assert client.get("sat/alarms")["counts"]["alarm"] == 1


WRONG = {
    "nothing": ("acknowledge", {}, "alarms: must be given"),
    "no list": ("acknowledge", {"alarms": 3}, "alarms: "),
    "none": ("acknowledge", {"alarms": []}, "alarms: "),
    "too many": ("acknowledge", {"alarms": [{"key": "a", "number": 1}] * 501}, "alarms: "),
    "not there": ("acknowledge", {"alarms": [{"key": "a.b", "number": 1}]}, "alarm: must be one"),
    "a huge number": ("acknowledge", {"alarms": [{"key": "a", "number": 1e300}]}, "number"),
    "two lines": ("acknowledge", {"alarms": [{"key": "a", "number": 1}], "comment": "a\nb"},
                  "comment: must be one line"),
    "surrogates": ("acknowledge", {"alarms": [{"key": "\ud800", "number": 1}]}, "alarms: must be"),
    "a long comment": ("acknowledge", {"alarms": [{"key": "a", "number": 1}], "comment": "a" * 501},
                       "comment: "),
    "an unknown key": ("unshelve", {"key": "a", "more": 1}, "more: must be a known key"),
    "not shelved": ("unshelve", {"key": "a"}, "alarm: must be shelved; received 'a'"),
    "no limits": ("shelve", {"key": "a", "for_s": 1, "reason": "x"}, "alarm: must be packet"),
    "no reason": ("shelve", {"key": SWITCHED_OFF, "for_s": 1, "reason": ""}, "reason: "),
    "for ever": ("shelve", {"key": SWITCHED_OFF, "for_s": 1e9, "reason": "x"}, "for_s: must"),
    "for no time": ("shelve", {"key": SWITCHED_OFF, "for_s": 0, "reason": "x"}, "for_s: must"),
}  # fmt: skip


def test_wrong_requests_get_one_line(fed):
    _, client = fed
    for what, (path, body, message) in WRONG.items():
        status, answer = post(client, f"alarms/{path}", **body)
        assert status == 400 and message in answer["error"], (what, answer)
        assert len(answer["error"].splitlines()) == 1, what
    for body in (b"[]", b"{", b"\xff", b"{" * 3000, b" " * 70_000):
        status, answer, _ = client.raw("/api/sat/alarms/shelve", body)
        assert status == 400 and b"alarm: must " in answer
    for query in ("size=0", "size=x", "start=1e9", "severity=bad", "source=x", "more=1",
                  "text=" + "a" * 201, "size=20001", "size=2001"):  # fmt: skip
        status, answer, _ = client.raw(f"/api/sat/log/search?{query}")
        assert status == 400 and len(json.loads(answer)["error"].splitlines()) == 1, query
    assert client.raw("/api/none/alarms")[0] == client.raw("/api/none/log.csv")[0] == 404
    assert client.raw("/api/sat/alarms", authorization=None)[0] == 403


def test_one_that_was_raised_anew_is_not_acknowledged_unseen(fed):
    satellite, client = fed
    satellite.send("housekeeping", coils_current=1.7)
    until(lambda: alarms(client))
    old = seen(client, CURRENT)
    satellite.send("housekeeping", coils_current=2.5)
    until(lambda: alarms(client)[CURRENT]["severity"] == "alarm")
    status, answer = post(client, "alarms/acknowledge", alarms=old)
    assert status == 400 and "since housekeeping.coils_current was raised anew" in answer["error"]


def test_alarms_come_live(fed):
    satellite, client = fed
    with client.live() as socket:
        satellite.send("housekeeping", coils_current=1.7)
        found = []
        while not found:
            found = json.loads(socket.recv(60)).get("alarms", [])
    assert (found[0]["satellite"], found[0]["version"]) == ("sat", 1)
    assert found[0]["alarms"][0]["key"] == CURRENT and found[0]["counts"]["warning"] == 1


def test_the_log_is_searched_and_taken_as_a_file(fed):
    satellite, client = fed
    for argument in (3, 4):
        satellite.send("event", module_id=1, code=int(Reason.BOOTED), argument=argument)
        satellite.send("housekeeping", coils_current=1.7)
    until(lambda: len(client.get("sat/log")) >= 4)  # two events, an alarm, the link

    def found(query=""):
        return client.get(f"sat/log/search?{query}")

    everything = found()
    assert everything["complete"] and len(everything["entries"]) == len(client.get("sat/log"))
    assert found("source=satellite")["entries"] == [
        each for each in everything["entries"] if each["source"] == "satellite"
    ]
    (alarm,) = found("text=ALARM%20RAISED&severity=warning")["entries"]
    assert alarm["source"] == "ground" and CURRENT in alarm["text"]
    assert found("text=.*")["entries"] == found("text=%25")["entries"] == []
    newest = found("source=satellite&size=1")
    assert len(newest["entries"]) == 1 and not newest["complete"]
    at = newest["entries"][0]["time_ms"]
    assert len(found(f"source=satellite&end={at - 1}")["entries"]) == 1
    status, text, headers = client.raw("/api/sat/log.csv?source=satellite")
    rows = list(csv.reader(io.StringIO(text.decode())))
    assert status == 200 and "attachment" in headers["content-disposition"]
    assert rows[0] == ["on_board_utc", "received_utc", "source", "severity", "text"]
    assert [row[2] for row in rows[1:]] == ["satellite"] * 2
    assert rows[1][0] == "2010-01-01T00:01:43.000Z", "the newest first"


# In a browser


@pytest.mark.skipif(NODE is None, reason="no Node.js")
def test_page_and_ground_judge_alike(tmp_path):
    """Values at, within and beyond all limits that are shipped, in each mode."""
    limits = Limits(load_link().dictionary, Names({}, (), {}, {}, ()))
    cases, verdicts = [], []
    for point in (each for packet in limits.points.values() for each in packet):
        field = point.field
        stated = [point.own, *(each.ranges for each in point.by_mode)]
        ends = [x for each in stated for pair in (each.limits, each.critical) if pair for x in pair]
        numbers = [y for x in ends for y in (x, x - 0.5, x + 0.5)] + [*range(40)]
        for modes in ({}, {"extended.stb_mode": 1}, {"extended.stb_mode": 3}):
            found = [point.judge(number, modes) for number in numbers]
            verdicts += [[v.condition, "" if v.limit.startswith("is") else v.limit] for v in found]
            described = describe_limits(limits)[point.rule.key]
            names = {"labels": [*field.texts.items()], "bits": field.bits}
            cases.append([described, names, numbers, [*modes.items()], field.unit])
    code = (
        'import { readFileSync } from "node:fs";\n'
        + (WEB / "limits.js").read_text(encoding="utf-8")
        + """
      const cases = JSON.parse(readFileSync(process.argv[2]));
      const found = cases.flatMap(([limits, { labels, bits }, numbers, modes, unit]) => {
        const names = labels.length ? { labels: new Map(labels) } : bits.length ? { bits } : {};
        return numbers.map((value) => {
          const beyond = judge({ limits, ...names }, value, new Map(modes));
          const words = beyond?.side ? `${beyond.words} ${unit}`.trimEnd() : "";
          return [beyond?.severity ?? "in order", words];
        });
      });
      console.log(JSON.stringify(found));
    """
    )
    (tmp_path / "cases.json").write_text(json.dumps(cases), encoding="utf-8")
    call = [NODE, "--input-type=module", "-", tmp_path / "cases.json"]
    done = subprocess.run(call, input=code, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == verdicts
    assert {condition for condition, _ in verdicts} == {"in order", "warning", "alarm"}


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_the_list_by_keyboard_alone(fed):
    sync_api = pytest.importorskip("playwright.sync_api")
    satellite, client = fed
    satellite.send("housekeeping", coils_current=1.7)
    satellite.send("housekeeping", coils_current=1.8, switched_off=3)
    place = "#/browse/torquer:alarms?hideInspector=true"
    expect = sync_api.expect
    with (
        browser_context(1280, 800, PATIENCE_MS) as context,
        watched_page(context, "400 (Bad Request)") as page,
    ):
        page.goto(f"{client.base}/?token={client.token}{place}")
        lines = page.locator(".t-alarms__list tr[data-key]")
        expect(lines).to_have_count(2)
        expect(lines.nth(0)).to_contain_text("◆ alarm")
        expect(lines.nth(0)).to_contain_text("coils, wheels (3)")
        expect(lines.nth(1)).to_contain_text("above 1.5 A")
        indicator = page.locator(".t-alarms__indicator")
        expect(indicator).to_have_text("◆ 1 alarm  ▲ 1 warning")
        spoken = page.locator("[aria-live=polite].t-spoken")
        expect(spoken).to_have_text("◆ 1 alarm  ▲ 1 warning not acknowledged")
        # Acknowledged with a comment: the button goes, the focus stays in its line.
        page.get_by_label("Comment with which").focus()
        page.keyboard.type("seen")
        page.keyboard.press("Tab")
        page.keyboard.press("Tab")
        focused = page.locator(":focus")
        expect(focused).to_have_attribute("aria-label", f"Acknowledge {SWITCHED_OFF}")
        page.keyboard.press("Enter")
        line = page.locator(f"tr[data-key='{SWITCHED_OFF}'][data-alarm]")
        expect(line).to_contain_text("acknowledged by page")
        expect(line).to_contain_text("seen")
        expect(indicator).to_have_text("▲ 1 warning")
        expect(focused).to_have_attribute("aria-label", f"Shelve {SWITCHED_OFF}")
        # Shelved for an hour, by a dialog.
        page.keyboard.press("Enter")
        expect(page.locator("dialog[open]")).to_contain_text(SWITCHED_OFF)
        page.keyboard.type("repair")
        page.keyboard.press("Enter")
        expect(line).to_contain_text("shelved until")
        expect(line).to_contain_text("repair")
        page.get_by_label(f"Unshelve {SWITCHED_OFF}").press("Enter")
        expect(line).not_to_contain_text("shelved")
        # The out-of-limits log, and what comes while the list is open.
        log = page.locator(".t-violations tbody tr")
        expect(log).to_have_count(2)
        satellite.send("housekeeping", coils_current=2.5, switched_off=3)
        expect(page.locator(f"tr[data-key='{CURRENT}']")).to_contain_text("above 2 A")
        expect(indicator).to_have_text("◆ 1 alarm")


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_without_a_connection_alarms_are_unknown(fed):
    sync_api = pytest.importorskip("playwright.sync_api")
    satellite, client = fed
    with (
        browser_context(1280, 800, PATIENCE_MS) as context,
        watched_page(context, "400 (Bad Request)") as page,
    ):
        sockets = []
        page.route_web_socket(
            "**/api/live", lambda each: sockets.append(each) or each.connect_to_server()
        )
        page.goto(f"{client.base}/?token={client.token}")
        indicator = page.locator(".t-alarms__indicator")
        sync_api.expect(indicator).to_have_text("no alarms")
        # which may come before the connection does: a loss before it would be none
        state = page.locator(".t-link__state").first
        sync_api.expect(state).to_have_text(re.compile("^(link|no telemetry)"))
        page.route("**/api/sat/alarms", lambda route: route.fulfill(status=400, json={}))
        sockets[0].close()
        sync_api.expect(indicator).to_have_text("? alarms unknown")
        page.unroute("**/api/sat/alarms")
        satellite.send("housekeeping", coils_current=1.7)
        sync_api.expect(indicator).to_have_text("▲ 1 warning")


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_values_beyond_their_limits_are_marked_in_words(fed):
    sync_api = pytest.importorskip("playwright.sync_api")
    satellite, client = fed
    satellite.send("extended", stb_mode=3, omega_orbital_x=0.5, omega_x=-70.0, flags=16)
    packets = "torquer:sat/torquer:sat.packets/torquer:sat.packet.extended"
    with (
        browser_context(1280, 800, PATIENCE_MS) as context,
        watched_page(context, "400 (Bad Request)") as page,
    ):
        page.goto(f"{client.base}/?token={client.token}#/browse/{packets}?hideInspector=true")

        def marked(name):
            row = page.locator(".t-values tr").filter(
                has=page.get_by_role("rowheader", name=name, exact=True)
            )
            return row.locator(".t-values__beyond")

        expect = sync_api.expect
        expect(marked("omega_x")).to_have_text("◆ alarm: below -60")
        expect(marked("flags")).to_have_text("◆ alarm: coils_off")
        expect(marked("omega_orbital_x")).to_have_text("▲ warning: above 0.4")
        satellite.send("extended", stb_mode=1, omega_orbital_x=0.5)
        expect(marked("omega_orbital_x")).to_have_text("")
        expect(marked("omega_x")).to_have_text("")


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_the_view_of_the_log_searches_the_archive(fed):
    sync_api = pytest.importorskip("playwright.sync_api")
    satellite, client = fed
    satellite.send("housekeeping", coils_current=1.7, switched_off=1)
    until(lambda: len(alarms(client)) == 2)
    place = "#/browse/torquer:sat/torquer:sat.view.log?hideInspector=true"
    with (
        browser_context(1280, 800, PATIENCE_MS) as context,
        watched_page(context, "400 (Bad Request)") as page,
    ):
        page.goto(f"{client.base}/?token={client.token}{place}")
        lines, expect = page.locator(".t-log tbody tr"), sync_api.expect
        expect(lines).to_have_count(3)
        page.get_by_label("Text").fill("SWITCHED")
        expect(lines).to_have_count(1)
        page.get_by_label("Text").fill("")
        page.get_by_label("Least severity").select_option("warning")
        expect(lines).to_have_count(2)
        page.get_by_label("Source").select_option("satellite")
        expect(lines).to_have_count(0)
        satellite.send("event", module_id=1, code=int(Reason.BOOTED), argument=0)
        page.get_by_label("Least severity").select_option("info")
        expect(lines).to_have_count(1)
        with page.expect_download() as waited:
            page.get_by_text("CSV").click()
        rows = list(csv.reader(io.StringIO(waited.value.path().read_text(encoding="utf-8"))))
        assert [row[2] for row in rows] == ["source", "satellite"]
