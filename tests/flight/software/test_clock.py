"""On-board time: a grid of 10 ms without drift, set and saved, within the seconds of a u32."""

import random
from datetime import UTC, datetime, timedelta
from fractions import Fraction

import pytest
from hypothesis import given, strategies as st

from torquer.flight.packets.frames import EPOCH
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.clock import LAST_MS, Clock, timer_ms, to_ms

MONTH_S = 30 * 86400


@pytest.mark.verifies("REQ-CLK-001")
@pytest.mark.parametrize("step", ["1", "0.1", "0.01", "0.05", "0.125", "0.007"])
def test_timer_stays_on_grid_thirty_days_for_any_step(step):
    exact, at_random = Fraction(step), random.Random(step)
    last = int(MONTH_S / exact)
    for number in [
        *range(1000),
        *range(last - 1000, last + 1),
        *at_random.choices(range(last), k=20000),
    ]:
        expected = int(number * exact * 100) * 10  # whole steps of 10 ms that have passed
        assert timer_ms(number * float(step)) == expected


def test_thirty_days_of_small_steps_add_up_without_drift():
    clock, before = Clock(now_ms=to_ms(datetime(2012, 1, 25, tzinfo=UTC))), 0
    start = clock.now_ms
    for number in range(1, MONTH_S + 1):
        now = clock.run_to(number * 1.0 - 0.003)  # between two steps of the clock
        assert now - start == number * 1000 - 10 and now > before
        before = now
    assert clock.run_to(float(MONTH_S)) == start + MONTH_S * 1000


@given(st.lists(st.floats(0.0, 1e7)), st.integers(0, LAST_MS))
def test_the_clock_never_goes_back_by_itself(times, start):
    clock = Clock(now_ms=start)
    before = clock.now_ms
    for t_s in times:
        now = clock.run_to(t_s)
        assert now >= before and now % 10 == 0 and 0 <= now <= LAST_MS
        before = now


@pytest.mark.verifies("REQ-CLK-003")
@given(st.floats(0.0, 1e7), st.integers(0, LAST_MS + 9), st.floats(0.0, 1e5))
def test_a_clock_that_is_set_goes_on_from_there(t_s, to_ms, further_s):
    clock = Clock()
    clock.run_to(t_s)
    assert not clock.is_set
    assert clock.set(to_ms) is Reason.DONE and clock.is_set
    assert clock.now_ms == to_ms - to_ms % 10
    expected = clock.now_ms + timer_ms(t_s + further_s) - timer_ms(t_s)
    assert clock.run_to(t_s + further_s) == min(expected, LAST_MS)


@given(st.integers(0, LAST_MS), st.integers(-2 * LAST_MS, 2 * LAST_MS))
def test_a_shift_beyond_the_limits_changes_nothing(start, by_ms):
    clock = Clock(now_ms=start)
    start = clock.now_ms
    possible = 0 <= start + by_ms <= LAST_MS + 9
    assert clock.shift(by_ms) is (Reason.DONE if possible else Reason.VALUE)
    assert clock.now_ms == ((start + by_ms) // 10 * 10 if possible else start)
    assert clock.is_set is possible


def test_the_seconds_end_with_u32_and_do_not_wrap():
    clock = Clock(now_ms=LAST_MS - 20)
    assert [clock.run_to(t_s) for t_s in (0.01, 0.02, 0.03, 1e6)] == [LAST_MS - 10] + 3 * [LAST_MS]
    assert clock.now_s == 2**32 - 1
    assert clock.set(LAST_MS + 10) is Reason.VALUE
    assert clock.set(-1) is Reason.VALUE
    assert clock.set(float("nan")) is Reason.VALUE
    assert clock.now_ms == LAST_MS
    assert (EPOCH + timedelta(milliseconds=LAST_MS)).year == 2146


@pytest.mark.verifies("REQ-CLK-002")
@given(st.integers(0, LAST_MS), st.floats(0.0, 1e8))
def test_the_time_survives_a_reboot_less_the_time_in_between(now_ms, t_s):
    clock = Clock(now_ms=now_ms)
    after = Clock(t_s)
    assert after.restore(clock.save()) is Reason.DONE
    assert after.now_ms == clock.now_ms and not after.is_set
    assert after.run_to(t_s + 1.0) == min(
        clock.now_ms + timer_ms(t_s + 1.0) - timer_ms(t_s), LAST_MS
    )


@given(st.none() | st.binary().filter(lambda data: len(data) != 8))
def test_without_a_saved_time_the_clock_starts_at_zero(data):
    clock = Clock(now_ms=12340)
    assert clock.restore(data) is Reason.TIME_LOST
    assert clock.now_ms == 0
    assert clock.restore((LAST_MS + 10).to_bytes(8, "little")) is Reason.TIME_LOST


@given(st.datetimes(datetime(2010, 1, 1), datetime(2140, 1, 1)))
def test_civil_and_on_board_time_agree_to_the_step(civil):
    utc = civil.replace(tzinfo=UTC)
    ms = to_ms(utc)
    assert ms % 10 == 0
    assert timedelta(0) <= utc - EPOCH - timedelta(milliseconds=ms) < timedelta(milliseconds=10)
    assert to_ms(EPOCH) == 0
