"""The error log: the last entries, the count of all, and reasons that fit their byte."""

import pytest
from hypothesis import given, strategies as st

from torquer.flight.packets.reasons import Reason
from torquer.flight.software.log import Entry, Log

ENTRIES = st.tuples(
    st.integers(0, 2**63),
    st.integers(0, 255),
    st.sampled_from(Reason),
    st.integers(-(2**40), 2**40),
)


@pytest.mark.verifies("REQ-SVR-012")
@given(st.integers(1, 12), st.lists(ENTRIES))
def test_the_log_keeps_the_last_entries_and_counts_all(size, given_):
    log = Log(size)
    for entry in given_:
        log.add(*entry)
    clipped = [
        Entry(t, m, int(c), max(-(2**31), min(2**31 - 1, a))) for t, m, c, a in given_[-size:]
    ]
    assert list(log.entries) == clipped
    assert log.total == len(given_)
    other = Log(size)
    assert other.restore(log.save())
    assert (list(other.entries), other.total) == (clipped, len(given_))


@given(
    st.none() | st.binary(max_size=100).filter(lambda data: (len(data) - 4) % 14 or len(data) < 4)
)
def test_a_damaged_log_is_an_empty_one(data):
    log = Log()
    log.add(1, 2, Reason.LATE)
    assert not log.restore(data)
    assert (list(log.entries), log.total) == ([], 0)


def test_a_count_beyond_u32_is_saved_as_the_greatest():
    log = Log()
    log.total = 2**32 + 5
    assert Log().restore(saved := log.save())
    assert log.restore(saved) and log.total == 2**32 - 1


def test_a_log_from_a_longer_one_has_its_last_entries():
    long, short = Log(8), Log(3)
    for number in range(8):
        long.add(number, 1, Reason.LATE, number)
    assert short.restore(long.save())
    assert [entry.argument for entry in short.entries] == [5, 6, 7]
    assert short.total == 8


@pytest.mark.parametrize("reason", Reason)
def test_a_reason_is_a_byte_and_says_what_it_means(reason):
    assert 0 <= reason <= 255 and Reason(int(reason)) is reason
    assert reason.doc and reason.doc == reason.doc.strip() and "\n" not in reason.doc


def test_done_is_zero():
    assert Reason.DONE == 0
    assert len({reason.doc for reason in Reason}) == len(Reason)
