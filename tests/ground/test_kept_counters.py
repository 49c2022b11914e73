"""Counters that are never used twice: crashes, torn files, files that cannot be written."""

import errno
import os
import time
from contextlib import closing, contextmanager
from itertools import pairwise
from types import MappingProxyType

import pytest

from torquer.ground import kept_counters
from torquer.ground.kept_counters import AHEAD, COMMAND, KEY, RECOVERY, SEQUENCE, UP, KeptCounters


@pytest.fixture
def path(tmp_path):
    return tmp_path / "sat.counters"


@contextmanager
def counting(path, known=MappingProxyType({}), mirror=lambda state: None):
    """Counters that begin; they are not closed, as by a ground that is killed."""
    made = KeptCounters(path, known, mirror)
    made.begin()
    yield made
    made._writer.shutdown(wait=True)


def take(counters, name=UP):
    """The next number, once one is kept."""
    end_s = time.monotonic() + 10.0
    while (number := counters.take(name)) is None:
        assert time.monotonic() < end_s, "no number is kept"
        time.sleep(0.001)
    return number


def test_numbers_go_on_where_a_ground_has_ended(path):
    with counting(path) as counters:
        assert [take(counters) for _ in range(20)] == [*range(1, 21)]
        counters.down = 77
        counters.close()
    with counting(path) as counters:
        assert (take(counters), take(counters, RECOVERY), take(counters, COMMAND)) == (21, 1, 1)
        assert counters.down == 77


def test_a_ground_that_is_killed_uses_none_twice_and_leaps_a_little(path):
    used = []
    for _ in range(20):
        with counting(path) as counters:
            used += [take(counters) for _ in range(3)]
    assert len(set(used)) == len(used) == 60 and used == sorted(used)
    assert max(b - a for a, b in pairwise(used)) <= AHEAD[UP]


def test_grounds_that_are_killed_without_a_command_leap_by_nothing(path):
    for _ in range(20):
        with counting(path):
            pass
    with counting(path) as counters:
        assert take(counters) == 1


@pytest.mark.parametrize("cut", [0, 100, 4096, 5000, 8000])
def test_a_file_that_is_damaged_is_known_by_the_archive(path, cut):
    mirrored = {}
    with counting(path, mirror=mirrored.update) as counters:
        last = [take(counters) for _ in range(5)][-1]
    path.write_bytes(path.read_bytes()[:cut])
    with counting(path, dict(mirrored)) as counters:
        assert take(counters) > last


@pytest.mark.parametrize("place", [0, 1])
def test_a_torn_place_leaves_the_other(path, place):
    with counting(path) as counters:
        last = [take(counters) for _ in range(AHEAD[UP] // 2)][-1]
        counters.close()
    data = bytearray(path.read_bytes())
    newest = max((0, 1), key=lambda n: sequence(bytes(data[4096 * n : 4096 * n + 4096])))
    data[4096 * place + 20] ^= 0xFF
    path.write_bytes(data)
    with counting(path) as counters:
        assert take(counters) > last
        assert (place == newest) == (counters.last(UP) > last + 1)


def sequence(place):
    return kept_counters._state(place)[SEQUENCE]


def test_without_a_disk_those_that_were_kept_go_up_and_then_none(path, monkeypatch):
    with counting(path) as counters:
        take(counters)

        def full(*_):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        monkeypatch.setattr(kept_counters.os, "write", full)
        monkeypatch.setattr(kept_counters, "_PAUSE_S", 0.01)
        assert [counters.take(UP) for _ in range(AHEAD[UP] - 1)] == [*range(2, AHEAD[UP] + 1)]
        for _ in range(50):
            assert counters.take(UP) is None
            time.sleep(0.002)
        assert counters.trouble() == os.strerror(errno.ENOSPC)
        monkeypatch.undo()
        assert take(counters) == AHEAD[UP] + 1 and counters.trouble() is None


def test_a_file_that_is_removed_is_made_again(path):
    with counting(path) as counters:
        take(counters)
        path.unlink()
        last = [take(counters) for _ in range(3 * AHEAD[UP])][-1]
    with counting(path) as counters:
        assert take(counters) > last


def test_a_full_disk_does_not_hold_up_a_file_that_is_there(path):
    with counting(path) as counters:
        size = path.stat().st_size
        for _ in range(100):
            take(counters)
        assert path.stat().st_size == size == 8192


def test_counters_that_nobody_knows_are_not_guessed(path):
    with counting(path, None) as counters:
        assert counters.take(UP) is None and counters.take(COMMAND) is None
        assert "neither sat.counters nor the archive tells it" in counters.trouble()
        counters.learn({UP: 40, KEY: 3}, 12)
        assert (take(counters), take(counters, COMMAND), counters.key) == (41, 13, 3)
    with counting(path, None) as counters:
        assert take(counters) > 41, "the file tells it now"


def test_a_counter_that_is_given_is_known(path):
    with closing(KeptCounters(path, None)) as counters:
        counters.at_least(up=1000)
        counters.begin()
        assert take(counters) == 1001


def test_another_key_counts_from_the_beginning_whatever_is_being_written(path):
    with counting(path) as counters:
        for key in range(1, 30):
            take(counters)
            counters.change_key(key)
            assert (take(counters), take(counters), counters.key) == (1, 2, key)
        counters.close()
    with counting(path) as counters:
        assert (take(counters), counters.key) == (3, 29)


def test_the_later_state_counts_of_file_and_archive(path):
    with counting(path) as counters:
        take(counters)
        counters.close()
    with counting(path, {UP: 500, SEQUENCE: 1}) as counters:
        assert take(counters) == 2, "the archive is an old copy"
    with counting(path, {UP: 500, SEQUENCE: 10**6}) as counters:
        assert take(counters) == 501, "the file is an old copy"


def test_the_counter_of_telemetry_never_goes_back(path):
    mirrored = []
    with counting(path, mirror=mirrored.append) as counters:
        counters.down = 50
        take(counters)
    assert mirrored and not any("down" in state for state in mirrored), "it is with its rows"
    for known, last in (({"down": 80, SEQUENCE: 0}, 80), ({"down": 20, SEQUENCE: 10**6}, 50)):
        with counting(path, known) as counters:
            assert counters.down == last
            counters.down = 50
            counters.close()
