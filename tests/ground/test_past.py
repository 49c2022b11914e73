"""What was known at an instant: by on-board time, and by what had been received until then."""

import math
import sqlite3
from contextlib import closing

import pytest
from made_archive import CHIBIS, archive_of, row

from torquer.computer.names import Names
from torquer.ground.archive import ArchiveError, dictionary_in, read_only
from torquer.ground.past import in_words, last_known, state_in_words

NAMES = Names({"stabilisation": (0, {"damping": 0, "science": 1})}, (), {}, {}, ())
DAY_MS = 86_400_000


def known(path, *asked):
    with closing(read_only(path)) as db:
        return {each["packet"]: each for each in last_known(db, CHIBIS, *asked)}


@pytest.fixture
def archive(tmp_path):
    """A pass whose rows come at once, another that a recording brings, and one a day later."""
    at_once = [row("extended", 1000 * k, 50_000 + k, digest=k, omega_x=float(k)) for k in range(20)]
    recorded = [row("extended", 30_000, digest=1, omega_x=-1.0)]
    later = [row("extended", DAY_MS, DAY_MS + 9, omega_x=math.inf, flags=3, stb_mode=1)]
    states = [row("modes", 5000, 50_005, state_0=1), row("beacon", 7000, 50_007, quality=0)]
    return archive_of(tmp_path / "sat.sqlite", at_once + recorded + later + states)


def test_by_on_board_time_it_is_what_had_been_measured(archive):
    found = known(archive, 10_400)
    assert found["extended"]["values"]["omega_x"] == 10.0
    assert (found["extended"]["age_ms"], found["extended"]["every_ms"]) == (400, 1000)
    assert not found["extended"]["stale"] and set(found) == {"extended", "modes", "beacon"}
    assert known(archive, 30_000)["extended"]["values"]["omega_x"] == -1.0
    assert known(archive, -1) == {}


def test_by_reception_it_is_what_the_ground_had(archive):
    assert known(archive, 49_999, "received") == {}
    found = known(archive, 50_008, "received")
    assert found["extended"]["values"]["omega_x"] == 8.0 and found["extended"]["age_ms"] == 0
    assert found["beacon"]["quality"] == 0
    late = known(archive, DAY_MS, "received")["extended"]  # the recording has no reception
    assert late["values"]["omega_x"] == 19.0 and late["stale"]


@pytest.mark.parametrize(("after_ms", "stale"), [(0, False), (9_999, False), (10_001, True)])
def test_what_is_older_than_its_period_is_stale(archive, after_ms, stale):
    assert known(archive, 30_000 + after_ms)["extended"]["stale"] == stale


def test_a_slow_packet_is_stale_later(tmp_path):
    slow = [row("beacon", 60_000 * k) for k in range(8)]
    path = archive_of(tmp_path / "sat.sqlite", slow)
    ages = (0, 60_000, 180_000, 180_001)
    found = [known(path, 420_000 + age)["beacon"]["stale"] for age in ages]
    assert found == [False, False, False, True]


def test_modes_flags_and_attitude_go_by_words(archive):
    with closing(read_only(archive)) as db:
        state = state_in_words(last_known(db, CHIBIS, DAY_MS), CHIBIS, NAMES)
    assert state["stabilisation"] == "science" and state["flags"] == "sunlit, attitude (3)"
    assert state["omega"] == "inf unknown unknown deg/s"
    field = next(f for f in CHIBIS.down["extended"].fields if f.name == "stb_mode")
    assert state["stb_mode"] == in_words(field, 1) != "1"
    assert state_in_words([], CHIBIS, NAMES) == {}


def test_states_that_the_mode_table_lacks_are_unknown(tmp_path):
    for number, value in enumerate((255, None, 1)):
        path = archive_of(tmp_path / f"{number}.sqlite", [row("modes", 0, state_0=value)])
        with closing(read_only(path)) as db:
            state = state_in_words(last_known(db, CHIBIS, 5), CHIBIS, NAMES)
        assert state["stabilisation"] == ("science" if value == 1 else "unknown")


def test_values_that_do_not_fit_are_not_known(archive):
    with closing(sqlite3.connect(archive)) as db, db:
        db.execute("UPDATE extended SET omega_x = x'00', aos_mode = 'much' WHERE _time_ms = 10000")
    values = known(archive, 10_000)["extended"]["values"]
    assert values["omega_x"] is values["aos_mode"] is None


def test_an_archive_without_its_tables_gets_one_line(archive):
    with closing(sqlite3.connect(archive)) as db, db:
        db.execute("DROP TABLE extended")
    with closing(read_only(archive)) as db, pytest.raises(ArchiveError, match="must be readable"):
        last_known(db, dictionary_in(db), 0)
