"""Several devices of a kind become one: means, votes, spares, and which readings count."""

import math

import numpy as np
import pytest

from torquer.compile.engine import records
from torquer.computer.interface import nothing_known
from torquer.computer.selection import (
    ANGLES,
    ATTITUDE,
    DIRECTION,
    FAILED,
    MEAN,
    SELECTED,
    SOURCE,
    SPARE,
    VECTOR,
    VOTE,
    WANTED,
    Selection,
    SelectionSpec,
    nothing_kept,
    select,
    silent_after_s,
    stuck_after_s,
)

KIND, FIRST = 0, 10
NAN, INF = math.nan, math.inf


class Board:
    """A computer with several devices of one kind, read at each call."""

    def __init__(self, how, form=VECTOR, weights=(1.0, 1.0, 1.0), warm_up_s=0.0, stuck_s=10.0):
        count, sources = len(weights), np.zeros(FIRST + 12, SOURCE)
        for k, weight in enumerate(weights):
            sources[FIRST + k] = (weight, silent_after_s(1.0), stuck_s)
        parts = 4 if form == ATTITUDE else 3
        kinds = np.array([(KIND, FIRST, count, how, form, parts, warm_up_s)], SELECTED)
        self.selection = records(Selection(kinds, sources))
        self.known, self.kept = records(nothing_known()), nothing_kept(self.selection)

    def read(self, t_s, *readings, wanted=-1):
        """(Time, numbers) that laws read when these have been sent now; None: nothing sent."""
        k = self.known[0]
        k["t_s"] = t_s
        for unit, reading in enumerate(readings):
            if reading is not None:
                k["readings"][FIRST + unit, : len(reading)] = reading
                k["read_s"][FIRST + unit] = t_s
        self.kept[KIND, WANTED] = wanted if wanted < 0 else FIRST + wanted
        select(self.selection, self.kept, k)
        return k["read_s"][KIND], k["readings"][KIND, :4].copy()


def three(*units):
    """Readings along x."""
    return [None if x is None else (x, 0.0, 0.0) for x in units]


def test_a_mean_is_weighted():
    t_s, v = Board(MEAN, weights=(4.0, 1.0)).read(5.0, (1.0, 0.0, -1.0), (2.0, 5.0, 4.0))
    assert t_s == 5.0
    assert v[:3] == pytest.approx([1.2, 1.0, 0.0])


@pytest.mark.parametrize("wrong", [NAN, INF, -INF])
@pytest.mark.parametrize("how", [MEAN, VOTE, SPARE])
def test_what_is_no_number_takes_no_part(how, wrong):
    _, v = Board(how).read(0.0, (wrong, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    assert v[0] == 2.0


@pytest.mark.parametrize("lie", [1e-3, 1.0, 1e10, -1e100, 1e200, 1.7e308, -1.7e308])
@pytest.mark.parametrize("liar", range(3))
def test_one_liar_never_wins_a_vote(liar, lie):
    readings = [(1.0, 2.0, 3.0), (1.0, 2.0, 3.0), (1.0, 2.0, 3.0)]
    readings[liar] = (1.0 + lie, 2.0, -lie)
    _, v = Board(VOTE).read(0.0, *readings)
    assert v[:3] == pytest.approx([1.0, 2.0, 3.0], abs=1e-9)


def test_two_liars_that_do_not_agree_lose_against_three():
    _, v = Board(VOTE, weights=(1.0,) * 5).read(0.0, *three(1e200, 1.0, -1e150, 1.1, 0.9))
    assert v[0] == 1.0


def test_a_vote_of_two_is_their_mean():
    board = Board(VOTE)
    assert board.read(0.0, *three(1.0, 2.0, None))[1][0] == 1.5
    assert board.read(1.0, *three(1.0, 2.0, 2.1))[1][0] == 2.0


def test_a_spare_stands_in_for_a_silent_device_and_stays():
    board = Board(SPARE)
    assert board.read(0.0, *three(1.0, 2.0, 3.0))[1][0] == 1.0
    for t_s in (1.0, 2.0, 3.0):
        assert board.read(t_s, *three(None, 2.0 + t_s, 3.0 + t_s))[1][0] == 1.0
    assert board.read(4.0, *three(None, 6.0, 7.0)) == (4.0, pytest.approx([6.0, 0.0, 0.0, 0.0]))
    for t_s in (5.0, 6.0):
        assert board.read(t_s, *three(1.0 + t_s, 6.0 + t_s, 0.1 * t_s))[1][0] == 6.0 + t_s
    assert board.read(7.0, *three(9.0, NAN, 8.0))[1][0] == 8.0  # the next one, not the first
    assert board.read(8.0, *three(9.5, 9.0, NAN))[1][0] == 9.5  # in a circle


def test_a_spare_is_left_alone_where_none_is_better():
    board = Board(SPARE, weights=(1.0, 1.0))
    board.read(0.0, *three(1.0, 2.0))
    assert board.read(9.0) == (0.0, pytest.approx([1.0, 0.0, 0.0, 0.0]))
    assert board.read(10.0, *three(1.5, None))[1][0] == 1.5


def test_a_late_main_device_is_waited_for_at_the_start():
    """Its spare, which is faster, must not take its place before it could say anything."""
    board = Board(SPARE, weights=(1.0, 1.0))
    assert board.read(0.0, *three(None, 2.0))[0] == -INF
    assert board.read(1.0, *three(1.0, 2.0))[1][0] == 1.0
    board = Board(SPARE, weights=(1.0, 1.0))
    for t_s in range(5):
        read_s, v = board.read(float(t_s), *three(None, 2.0 + t_s))
        assert read_s == (-INF if t_s < 4 else 4.0)
    assert v[0] == 6.0


def test_a_cold_spare_warms_up():
    board = Board(SPARE, weights=(1.0, 1.0), warm_up_s=5.0)
    assert board.read(0.0, *three(1.0, 2.0))[1][0] == 1.0
    for t_s in (1.0, 2.0, 5.0):
        assert board.read(t_s, *three(NAN, 2.0 + t_s)) == (0.0, pytest.approx([1.0, 0, 0, 0]))
    assert board.read(6.0, *three(NAN, 9.0)) == (6.0, pytest.approx([9.0, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize("how", [MEAN, SPARE, VOTE])
def test_the_same_numbers_again_are_those_of_a_stuck_device(how):
    board = Board(how, weights=(1.0, 1.0))
    for t_s in range(11):
        _, v = board.read(float(t_s), *three(1.0, 2.0 + t_s))
        assert v[0] == (1.0 if how == SPARE else 0.5 * (3.0 + t_s))
    assert board.read(11.0, *three(1.0, 20.0))[1][0] == 20.0
    assert board.read(12.0, *three(1.1, 21.0))[1][0] == (21.0 if how == SPARE else 11.05)


def test_a_device_that_may_repeat_itself_is_not_stuck():
    board = Board(SPARE, weights=(1.0, 1.0), stuck_s=INF)
    for t_s in range(100):
        assert board.read(float(t_s), *three(1.0, float(t_s)))[1][0] == 1.0


def test_a_first_reading_of_zeros_is_not_stuck():
    board = Board(SPARE, weights=(1.0, 1.0))
    board.read(0.0, *three(0.0, 1.0))
    assert board.read(1.0, *three(0.0, 2.0))[1][0] == 0.0


def test_old_readings_are_better_than_none():
    board = Board(MEAN, weights=(1.0, 1.0))
    board.read(0.0, *three(1.0, 3.0))
    assert board.read(20.0, *three(None, NAN)) == (0.0, pytest.approx([1.0, 0.0, 0.0, 0.0]))
    assert board.read(21.0, *three(NAN, NAN)) == (0.0, pytest.approx([1.0, 0.0, 0.0, 0.0]))


def test_the_sign_of_a_quaternion_does_not_matter():
    q = np.array([0.1, -0.7, 0.5, 0.5])
    q /= np.linalg.norm(q)
    near = q + np.array([1e-3, 0.0, 0.0, 0.0])
    near /= np.linalg.norm(near)
    for how in (MEAN, VOTE):
        _, v = Board(how, ATTITUDE).read(0.0, q, -q, -near)
        assert abs(abs(v @ q) - 1.0) < 1e-6
        assert np.linalg.norm(v) == pytest.approx(1.0, abs=1e-12)
    _, v = Board(VOTE, ATTITUDE).read(0.0, (0.0, 0.0, 0.0, 1.0), -q, q)
    assert abs(abs(v @ q) - 1.0) < 1e-12


@pytest.mark.parametrize("how", [MEAN, VOTE])
def test_heads_that_see_nothing_do_not_count_while_one_sees(how):
    nothing, sun = (0.0, 0.0, 0.0), np.array([0.6, 0.0, 0.8])
    _, v = Board(how, DIRECTION).read(0.0, nothing, sun, nothing)
    assert v[:3] == pytest.approx(sun)
    assert Board(how, DIRECTION).read(0.0, nothing, nothing, nothing)[1][:3] == pytest.approx(
        nothing
    )


def test_nothing_seen_for_long_is_not_stuck():
    board = Board(SPARE, DIRECTION, weights=(1.0, 1.0))
    for t_s in range(50):
        _, v = board.read(float(t_s), (0.0, 0.0, 0.0), (0.0, 0.6, 0.8))
        assert not v.any()


def test_directions_have_length_one():
    _, v = Board(MEAN, DIRECTION, weights=(1.0, 1.0)).read(0.0, (1.0, 0, 0), (0, 1.0, 0))
    assert v[:3] == pytest.approx([math.sqrt(0.5), math.sqrt(0.5), 0.0])


def test_angles_are_read_as_the_rate_between_readings():
    board = Board(MEAN, ANGLES, weights=(1.0, 1.0))
    assert board.read(0.0, *three(0.0, 100.0))[0] == -INF
    assert board.read(2.0, *three(0.2, 100.4)) == (1.0, pytest.approx([0.15, 0.0, 0.0, 0.0]))
    board.read(3.0, *three(NAN, 100.6))
    read_s, v = board.read(4.0, *three(0.6, 100.8))  # across the one that is lost
    assert (read_s, v[0]) == (3.5, pytest.approx(0.2))


def test_a_state_selects_one_whatever_it_reads():
    board = Board(MEAN)
    assert board.read(0.0, *three(1.0, 2.0, 3.0), wanted=1)[1][0] == 2.0
    assert math.isnan(board.read(1.0, *three(1.0, NAN, 3.0), wanted=1)[1][0])
    assert board.read(2.0, *three(1.0, NAN, 3.0))[1][0] == 2.0


@pytest.mark.parametrize("how", [MEAN, SPARE])
def test_readings_do_not_go_back_in_time(how):
    """Laws of differences divide by the time between two."""
    board = Board(how, weights=(1.0, 1.0))
    board.read(0.0, *three(1.0, 2.0))
    assert board.read(2.0, *three(3.0, None))[0] == 2.0
    kept = 3.0 if how == SPARE else 2.5
    assert board.read(3.0, *three(NAN, None)) == (2.0, pytest.approx([kept, 0, 0, 0]))
    assert board.read(4.0, *three(NAN, 5.0)) == (4.0, pytest.approx([5.0, 0, 0, 0]))


def test_a_state_that_selects_what_has_sent_nothing_waits_for_it():
    board = Board(MEAN, weights=(1.0, 1.0))
    board.read(0.0, *three(1.0, None))
    assert board.read(1.0, *three(1.5, None), wanted=1) == (0.0, pytest.approx([1.0, 0, 0, 0]))
    assert board.read(2.0, *three(1.5, 2.0), wanted=1) == (2.0, pytest.approx([2.0, 0, 0, 0]))


def test_times_after_which_devices_are_doubted():
    assert silent_after_s(0.5) == 1.5
    assert stuck_after_s(0.5, may_repeat=False) == 10.0
    assert stuck_after_s(4.0, may_repeat=False) == 20.0
    assert stuck_after_s(4.0, may_repeat=True) == INF


def test_only_spares_warm_up():
    assert SelectionSpec(kind="spare", warm_up_s=3.0).warm_up_s == 3.0
    with pytest.raises(ValueError, match="warm_up_s: must be left out for kind 'mean'; received 3"):
        SelectionSpec(warm_up_s=3.0)


def failed(board):
    """Which of the three have failed."""
    return board.kept[FIRST : FIRST + 3, FAILED].tolist()


@pytest.mark.parametrize("how", [MEAN, VOTE, SPARE])
def test_what_is_silent_stuck_or_no_number_has_failed(how):
    board = Board(how)
    for t_s in range(20):
        silent = None if t_s > 12 else (t_s, 1.0, 0.0)
        stuck = (2.0, 0.0, 0.0)
        wrong = (NAN if t_s == 19 else t_s, 0.0, 0.0)
        board.read(float(t_s), silent, stuck, wrong)
        assert failed(board) == [float(t_s > 15), float(t_s > 10), float(t_s == 19)]


def test_a_blinded_star_tracker_has_not_failed():
    board = Board(MEAN, form=ATTITUDE)
    for t_s in range(5):
        q = (0.1 * t_s, 0.0, 0.0, 1.0)
        board.read(float(t_s), (NAN,) * 4, q, q)
    assert failed(board) == [0.0, 0.0, 0.0]


def test_one_that_has_never_been_read_has_not_failed():
    board = Board(MEAN)
    board.read(100.0, None, (1.0, 0.0, 0.0), None)
    assert failed(board) == [0.0, 0.0, 0.0]
