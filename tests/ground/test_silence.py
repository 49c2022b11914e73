"""A satellite falls silent by the pace of its own link."""

import pytest

from torquer.ground.silence import INTERVALS, LEAST_S, UNKNOWN_S, Pace


def heard(times_s):
    pace = Pace()
    for time_s in times_s:
        pace.hear(time_s)
    return pace


@pytest.mark.parametrize("pace_s", [0.01, 0.5, 1.0, 10.0, 60.0])
def test_silence_is_some_intervals_of_the_link(pace_s):
    pace = heard(k * pace_s for k in range(20))
    allowed_s = max(LEAST_S, INTERVALS * pace_s)
    assert not pace.is_silent(19 * pace_s + 0.99 * allowed_s)
    assert pace.is_silent(19 * pace_s + 1.01 * allowed_s)


def test_a_gap_changes_nothing_and_another_pace_is_learnt():
    times_s = [*range(20), 5000, *range(5001, 5003)]
    assert heard(times_s).allowed_s() == INTERVALS
    assert heard([*times_s, *range(5062, 6000, 60)]).allowed_s() == 60.0 * INTERVALS


def test_what_was_never_heard_is_not_silent_and_one_frame_tells_no_pace():
    assert not Pace().is_silent(1e9)
    once = heard([5.0])
    assert not once.is_silent(5.0 + UNKNOWN_S) and once.is_silent(5.1 + UNKNOWN_S)
