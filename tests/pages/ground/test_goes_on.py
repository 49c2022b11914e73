"""Whatever becomes of archive, disk, clock or one satellite: live view and commands go on."""

import json
import os
import signal
import sqlite3
import threading
import time
from contextlib import closing
from itertools import pairwise
from types import SimpleNamespace

import pytest
from ground_flight import serving, table, until
from small_satellite import command, ground_process, received, small_satellite

from torquer.cli.commands.ground_alarms import AlarmsOptions, alarms as show_alarms
from torquer.cli.commands.ground_history import (
    AtOptions,
    GapsOptions,
    at as show_at,
    gaps as show_gaps,
)
from torquer.cli.commands.ground_orders import HistoryOptions, history as commands_history
from torquer.ground import contact as contacts, ground_clock, spool


def sat(satellite):
    return table(satellite.address, in_scenario=None)


def live_numbers(socket_, number):
    """That many numbers of the satellite, as they come live."""
    found = []
    while len(found) < number:
        rows = json.loads(socket_.recv(30)).get("rows", ())
        found += [row[-1][1] for row in rows if row[1] == "parameter"]
    return found


def has_said(client, text, key="sat"):
    return until(lambda: [each for each in client.texts(key) if text in each], f"not said: {text}")


def is_whole(client, satellite, key="sat"):
    """Whether all that was sent is archived."""
    last = satellite.sent
    until(lambda: received(client, key)[-1:] >= [last])
    numbers = received(client, key)
    return numbers == [float(n + 1) for n in range(len(numbers))]


def goes_on(client, socket_):
    """Whether rows come live, without a pause, and a command is executed, within seconds."""
    begun_s = time.monotonic()
    numbers = live_numbers(socket_, 20)
    assert command(client) == "executed"
    return numbers == sorted(numbers) and time.monotonic() - begun_s < 6.0


@pytest.mark.parametrize("kind", ["IMMEDIATE", "EXCLUSIVE"])
def test_another_program_holds_the_archive(tmp_path, kind):
    with small_satellite() as satellite, serving(tmp_path, sat=sat(satellite)) as client:
        until(lambda: received(client))
        with client.live() as socket_, closing(sqlite3.connect(tmp_path / "sat.sqlite")) as other:
            other.isolation_level = None
            other.execute(f"BEGIN {kind}")
            assert goes_on(client, socket_)
            (text,) = has_said(client, "not archived since")
            violations = until(lambda: client.get("sat/violations"))
            assert [each["key"] for each in violations] == ["ground.archive"]
            assert "locked" in text
            assert goes_on(client, socket_)
            assert len(client.get("sat/command-history")) == 2
            alarms = client.get("sat/alarms")["alarms"]
            assert [each["key"] for each in alarms] == ["ground.archive"]
            assert not [each for each in client.texts("sat") if "ground.archive" in each]
            other.execute("ROLLBACK")
        (text,) = has_said(client, "archived again")
        assert text.endswith(" 0 lost") and not text.startswith("archived again: 0 rows")
        assert is_whole(client, satellite)
        assert [each["state"] for each in client.get("sat/sent")] == ["executed"] * 2


def test_a_ground_begins_while_another_program_holds_the_archive(tmp_path):
    with small_satellite() as satellite:
        with serving(tmp_path, sat=sat(satellite)) as client:
            assert command(client) == "executed"
        with closing(sqlite3.connect(tmp_path / "sat.sqlite", isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            with serving(tmp_path, sat=sat(satellite)) as client, client.live() as socket_:
                assert goes_on(client, socket_)
                has_said(client, "not archived since")
                other.execute("ROLLBACK")
                has_said(client, "archived again")
                assert [each["id"] for each in client.get("sat/sent")] == [2, 1]


def limit_pages(monkeypatch, most):
    """Let archives of this process take no more pages than `most[0]`, as a full disk does."""
    storing = spool.Archive.store

    def store(archive, batch):
        archive._db.execute(f"PRAGMA max_page_count = {most[0]}")
        return storing(archive, batch)

    monkeypatch.setattr(spool.Archive, "store", store)


def test_a_full_disk_that_is_freed(tmp_path, monkeypatch, capsys):
    most = [1]  # no page more than there are
    with small_satellite(pace_s=0.005) as satellite:
        limit_pages(monkeypatch, most)
        with serving(tmp_path, sat=sat(satellite)) as client, client.live() as socket_:
            (text,) = has_said(client, "not archived since")
            assert "full" in text
            for _ in range(20):
                assert command(client) == "executed"
            assert len(live_numbers(socket_, 100)) >= 100
            entries = client.get("sat/log")
            assert [each["severity"] for each in entries if each["text"] == text] == ["alarm"]
            capsys.readouterr()
            assert commands_history(how=HistoryOptions(folder=tmp_path, json=True)) == 0
            listed = json.loads(capsys.readouterr().out)
            assert [each["state"] for each in listed] == 20 * ["executed"]
            assert show_alarms(how=AlarmsOptions(folder=tmp_path, json=True, log=True)) == 0
            out, err = capsys.readouterr()
            for listed in json.loads(out).values():  # alarms, and violations
                assert [each["key"] for each in listed] == ["ground.archive"]
            assert not err
            assert show_gaps(how=GapsOptions(folder=tmp_path)) == 0
            assert show_at("2030-01-01T00:00:00Z", how=AtOptions(folder=tmp_path)) == 0
            notes = capsys.readouterr().err
            assert notes.count("note: sat.sqlite: nothing is archived since ") == 2
            most[0] = 10**6
            (text,) = has_said(client, "archived again")
            assert text.endswith(" 0 lost")
            assert is_whole(client, satellite)
            assert len(client.get("sat/sent")) == 20


def test_more_than_there_is_room_for_is_dropped_oldest_first_and_counted(tmp_path, monkeypatch):
    most = [1]
    monkeypatch.setattr(spool, "MOST_NUMBERS", 30 * 14)
    with small_satellite(pace_s=0.005) as satellite:
        limit_pages(monkeypatch, most)
        with serving(tmp_path, sat=sat(satellite)) as client:
            until(lambda: satellite.sent > 500)
            has_said(client, "not archived since")
            satellite.is_mute = True
            time.sleep(0.2)
            most[0] = 10**6
            (text,) = has_said(client, "archived again")
            lost = int(text.split()[-2])
            numbers = received(client)
            gaps = [b - a - 1 for a, b in pairwise(numbers) if b - a != 1]
            assert gaps == [lost] and lost > 200 and numbers[-1] == satellite.sent
            until(lambda: received(client)[-1] == satellite.sent)


def test_an_archive_that_is_removed(tmp_path):
    with small_satellite() as satellite, serving(tmp_path, sat=sat(satellite)) as client:
        until(lambda: received(client))
        with client.live() as socket_:
            (tmp_path / "sat.sqlite").unlink()
            has_said(client, "sat.sqlite was removed")
            assert goes_on(client, socket_)
            until(lambda: received(client)[-1:] >= [satellite.sent - 1.0])


def test_a_journal_that_is_removed(tmp_path):
    with small_satellite() as satellite, serving(tmp_path, sat=sat(satellite)) as client:
        until(lambda: len(received(client)) > 10)
        with client.live() as socket_:
            for end in ("-wal", "-shm"):
                (tmp_path / f"sat.sqlite{end}").unlink()
            has_said(client, "sat.sqlite-wal was removed")
            assert goes_on(client, socket_)
        assert is_whole(client, satellite)


def test_a_damaged_archive_is_set_aside(tmp_path, monkeypatch):
    monkeypatch.setattr(spool, "PAUSES_S", (0.05, 0.1))
    path = tmp_path / "sat.sqlite"
    with small_satellite() as satellite:
        with serving(tmp_path, sat=sat(satellite)) as client:
            until(lambda: received(client))
        with closing(sqlite3.connect(path)) as db:
            (page,) = db.execute("SELECT rootpage FROM sqlite_master WHERE name = 'parameter'")
            size = db.execute("PRAGMA page_size").fetchone()[0]
        with path.open("r+b") as file:
            file.seek((page[0] - 1) * size)
            file.write(b"\xff" * size)
        with serving(tmp_path, sat=sat(satellite)) as client, client.live() as socket_:
            assert goes_on(client, socket_)
            (text,) = has_said(client, "the archive is damaged")
            assert "sat.damaged-1.sqlite" in text and (tmp_path / "sat.damaged-1.sqlite").exists()
            until(lambda: received(client)[-1:] >= [satellite.sent - 1.0])
            numbers = received(client)
            assert numbers == [numbers[0] + n for n in range(len(numbers))]


@pytest.mark.parametrize("content", [b"nothing" * 5000, b"SQLite format 3\0" + b"\xff" * 9000])
def test_a_ground_begins_with_a_file_that_cannot_be_read(tmp_path, content):
    path = tmp_path / "sat.sqlite"
    path.write_bytes(content)
    with (
        small_satellite() as satellite,
        serving(tmp_path, sat=sat(satellite)) as client,
        client.live() as socket_,
    ):
        assert len(live_numbers(socket_, 5)) >= 5
        has_said(client, "not archived since")
        status, body, _ = client.raw("/api/sat/history/parameter/value")
        assert status == 503 and "archive: cannot be read now" in json.loads(body)["error"]
        assert "must wait until its number can be kept" in command(client)
        assert path.read_bytes() == content, "it may be somebody's"
        path.rename(tmp_path / "other")
        has_said(client, "archived again")
        assert is_whole(client, satellite)
        assert goes_on(client, socket_)


def test_trouble_of_one_satellite_is_no_other_ones(tmp_path):
    with (
        small_satellite() as one,
        small_satellite() as two,
        serving(tmp_path, sat=sat(one), other=sat(two)) as client,
    ):
        until(lambda: received(client) and received(client, "other"))
        with closing(sqlite3.connect(tmp_path / "sat.sqlite", isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            has_said(client, "not archived since")
            assert is_whole(client, two, "other")
            assert not any("archived" in text for text in client.texts("other"))
            assert command(client, "other") == "executed"
            other.execute("ROLLBACK")
        has_said(client, "archived again")


def test_a_satellite_whose_service_fails_is_served_again(tmp_path, monkeypatch):
    failing = threading.Event()
    looking = contacts.Contact._look_at

    def look_at(contact, pairs, at_ms):
        if contact.key == "sat" and failing.is_set():
            raise RuntimeError("a mistake\nof two lines")
        looking(contact, pairs, at_ms)

    monkeypatch.setattr(contacts.Contact, "_look_at", look_at)
    with (
        small_satellite() as one,
        small_satellite() as two,
        serving(tmp_path, sat=sat(one), other=sat(two)) as client,
    ):
        until(lambda: received(client) and received(client, "other"))
        failing.set()
        texts = until(
            lambda: [t for t in client.texts("sat") if "tried again in 2 s" in t],
            "no second time",
        )
        assert texts == ["service failed: RuntimeError: a mistake of two lines; tried again in 2 s"]
        assert is_whole(client, two, "other") and command(client, "other") == "executed"
        failing.clear()
        assert command(client) == "executed"
        has_said(client, "link found")


# Clocks


@pytest.mark.parametrize("by_s", [-86_400, 86_400, 3])
def test_a_clock_that_is_set_changes_nothing(tmp_path, monkeypatch, by_s):
    real = time.time_ns
    with small_satellite() as satellite, serving(tmp_path, sat=sat(satellite)) as client:
        until(lambda: received(client))
        assert command(client) == "executed"
        monkeypatch.setattr(
            ground_clock, "time", SimpleNamespace(**vars(time) | {"time_ns": set_by(real, by_s)})
        )
        assert command(client) == "executed"
        (text,) = has_said(client, "the clock of this machine was set by")
        assert f"{by_s:+} s" in text
        until(lambda: satellite.sent > 60)
        rows = client.get("sat/history/parameter/value?size=20000&latest=1")
        times = [row[1] for row in rows]
        assert times == sorted(times) and times[-1] - times[0] < 60_000
        ids = [each["id"] for each in client.get("sat/log") if each["source"] == "ground"]
        assert ids == sorted(ids, key=lambda text: int(text[1:]))
        assert {each["state"] for each in client.get("sat/sent")} == {"executed"}


def set_by(real, by_s):
    return lambda: real() + by_s * 1_000_000_000


# Processes that are killed


@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL")
def test_killed_grounds_use_no_counter_twice(tmp_path):
    with small_satellite() as satellite:
        for _ in range(3):
            process, client = ground_process(tmp_path, satellite.address)
            try:
                assert [command(client) for _ in range(5)] == ["executed"] * 5
            finally:
                process.send_signal(signal.SIGKILL)
                process.communicate()
        assert satellite.receiver.rejected == {}
        process, client = ground_process(tmp_path, satellite.address)
        try:
            ids = [each["id"] for each in client.get("sat/sent")]
            assert len(ids) == len(set(ids)) == 15
        finally:
            process.terminate()
            _, errors = process.communicate(timeout=30)
        assert process.returncode == 0 and "Traceback" not in errors


@pytest.mark.skipif(os.name == "nt", reason="no limits of files")
def test_a_disk_that_takes_no_more_and_a_start_on_it(tmp_path):
    resource = pytest.importorskip("resource")

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))

    with small_satellite(pace_s=0.005) as satellite:
        process, client = ground_process(tmp_path, satellite.address)
        until(lambda: received(client))
        process.terminate()
        process.communicate(timeout=30)
        for _ in range(2):
            process, client = ground_process(tmp_path, satellite.address, preexec_fn=limit)
            try:
                has_said(client, "not archived since")
                with client.live() as socket_:
                    assert goes_on(client, socket_)
                assert [command(client) for _ in range(12)] == ["executed"] * 12
            finally:
                process.kill()
                _, errors = process.communicate()
            assert "Traceback" not in errors
        assert satellite.receiver.rejected == {}
        with serving(tmp_path, sat=sat(satellite)) as client:
            assert command(client) == "executed"
            ids = [each["id"] for each in client.get("sat/sent")]
            assert ids == sorted(set(ids), reverse=True)
