"""Limits within the motion that remains: noticed from flights, and a clear one proposed."""

import numpy as np
import pytest

from torquer.design.gain_flights import GainFlights, Stops
from torquer.design.residual_rate import (
    Residual,
    clear_limit,
    common_residual,
    limits_from,
    residual_of,
)

BELOW, LATE_S = 0.2, 8000.0


def flights(gain=1.0, first=1000.0, settled=9500.0, late=0.25, runs=8):
    def all_of(value):
        return np.full(runs, float(value))

    return GainFlights(
        gain, all_of(first), all_of(settled), all_of(1.0), all_of(0.1), all_of(late),
        all_of(0.6 * late), (Stops(BELOW, all_of(first), all_of(settled)),
                             Stops(0.5, all_of(500.0), all_of(500.0))),
    )  # fmt: skip


def test_a_limit_that_is_crossed_again_by_what_remains_lies_within_it():
    assert residual_of(flights(), BELOW, LATE_S) == pytest.approx((0.15, 0.25))
    assert residual_of(flights(settled=np.inf), BELOW, LATE_S) is not None
    # crossed again, but the motion went on to decay; never crossed again; only below at the end
    assert residual_of(flights(late=0.1), BELOW, LATE_S) is None
    assert residual_of(flights(settled=1000.0), BELOW, LATE_S) is None
    assert residual_of(flights(first=9000.0), BELOW, LATE_S) is None


def test_one_gain_that_settles_clearly_makes_the_limit_a_good_one():
    within, clear = flights(1.0), flights(2.0, settled=1000.0, late=0.1)
    assert common_residual([within, flights(3.0, late=0.22)], 10.0, BELOW, LATE_S).greatest == 0.22
    assert common_residual([within, clear], 10.0, BELOW, LATE_S) is None
    assert common_residual([within, clear], 1.5, BELOW, LATE_S) is not None  # too great a gain
    slow = flights(0.5, first=np.inf, settled=np.inf, late=5.0)  # says nothing of what remains
    assert common_residual([slow, within], 10.0, BELOW, LATE_S).greatest == 0.25
    assert common_residual([slow], 10.0, BELOW, LATE_S) is None


def test_a_clear_limit_is_the_least_above_one_and_a_half_times_what_remains():
    limits = limits_from(0.2, 20.0)
    assert limits[0] == 0.2 and max(limits) < 10.0
    assert limits[1:] == pytest.approx([0.2 * 1.25**k for k in range(1, len(limits))])
    limit = clear_limit(Residual(0.15, 0.25), limits)
    assert limit == min(each for each in limits if each >= 0.375)
    assert clear_limit(Residual(5.0, 9.0), limits) is None
    assert limits_from(0.2, 0.3) == [0.2]


def test_flights_are_counted_with_another_limit():
    other = flights().with_limit(0.5)
    assert other.settled_by(0.9) == other.first_by(0.5) == 500.0
    assert flights().settled_by(0.9) == 9500.0
