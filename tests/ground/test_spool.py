"""What tables of their own keep through the spool: the last of each key, in order, also late."""

import sqlite3
import time
from contextlib import closing

import pytest

from torquer.flight.packets.dictionary import load_dictionary
from torquer.ground import spool as spools
from torquer.ground.archive import read_only
from torquer.ground.spool import Spool

CHIBIS = load_dictionary("chibis_m")
PUT = "INSERT OR REPLACE INTO _stack (place, what, state) VALUES (?, ?, ?)"


@pytest.fixture
def spool(tmp_path):
    made = Spool(tmp_path / "sat.sqlite", CHIBIS)
    yield made
    made.close()


def stored(spool):
    with closing(read_only(spool.path)) as db:
        return db.execute("SELECT place, what, state FROM _stack ORDER BY place").fetchall()


def wait_for(condition):
    end_s = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.02)


def put(spool, place, what, state="ready"):
    spool.keep(("stack", place), PUT, (place, what, state))


def test_the_last_of_each_key_is_stored(spool):
    for state in ("ready", "going", "done"):
        put(spool, 1, "a", state)
    spool.flush()
    assert stored(spool) == [(1, "a", "done")]


@pytest.mark.parametrize("kind", ["IMMEDIATE", "EXCLUSIVE"])
def test_what_waits_for_another_program_is_stored_in_order(spool, kind):
    """Another stack is loaded while steps of the first wait: the first leaves nothing behind."""
    put(spool, 1, "old")
    spool.flush()
    assert not spool.is_behind
    with closing(sqlite3.connect(spool.path, isolation_level=None)) as other:
        other.execute(f"BEGIN {kind}")
        for place in (1, 2, 3):
            put(spool, place, "old", "done")
        wait_for(lambda: spool.is_behind)
        assert not spool.is_failing
        wait_for(lambda: spool.is_failing)
        spool.keep(("stack",), "DELETE FROM _stack", ())
        for place in (0, 1):
            put(spool, place, "new")
        began_s = time.monotonic()
        spool.flush()
        assert time.monotonic() - began_s < 0.1  # who commands does not wait for the disk
        other.execute("ROLLBACK")
    wait_for(lambda: not spool.is_failing)
    spool.flush()  # what came while the first batch was tried again is one of its own
    assert stored(spool) == [(0, "new", "ready"), (1, "new", "ready")]


def test_what_cannot_be_stored_is_said_and_keeps_nothing_else_back(spool):
    spool.keep(("odd",), "INSERT INTO _stack (place) VALUES (?)", ("text",))
    put(spool, 1, "a")
    wait_for(lambda: stored(spool))
    assert any("cannot be" in text for _, text in spool.notes())


def test_of_too_many_the_oldest_are_dropped(spool, monkeypatch):
    monkeypatch.setattr(spools, "MOST_OTHERS", 5)
    with closing(sqlite3.connect(spool.path, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        for place in range(20):
            put(spool, place, "a")
        wait_for(lambda: spool.is_failing)
        other.execute("ROLLBACK")
    wait_for(lambda: len(stored(spool)) >= 5)
    assert stored(spool)[-1][0] == 19
