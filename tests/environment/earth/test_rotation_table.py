"""The tabulated rotation of the Earth is that of `earth.rotation`; days of the year."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from torquer.environment import sun
from torquer.environment.earth import rotation, rotation_table as room

STARTS = ("2007-09-21T09:10:34Z", "2016-12-30T22:00:00Z", "2031-05-05T00:00:00Z")


@pytest.mark.parametrize("mode", ["precise", "sidereal"])
@pytest.mark.parametrize("start", STARTS)
def test_turn_and_sun_are_those_of_the_environment(start, mode):
    times = np.linspace(-2.0e5, 9.0e5, 60)
    table = room.rotation_table(start, times[0], times[-1], mode)
    expected = rotation.dcm_inertial_to_ecef(times, start, mode)
    sun_m = sun.sun_position(times, start, mode)
    for t, dcm, towards in zip(times, expected, sun_m, strict=True):
        found, found_sun = room.rotation_at(table, t)
        assert np.abs(np.array(found) - dcm).max() < 2e-13
        assert np.abs(np.array(found) @ np.array(found).T - np.eye(3)).max() < 2e-15
        assert np.abs(found_sun - towards / np.linalg.norm(towards)).max() < 1e-11


@pytest.mark.parametrize("start", STARTS)
def test_teme_is_that_of_the_environment(start):
    expected = rotation.teme_to_gcrf([0.0], start)[0]
    assert np.abs(room.teme_to_gcrf_at(start) - expected).max() < 1e-12


def test_a_longer_table_has_the_same_numbers():
    start = STARTS[0]
    short, long = (room.rotation_table(start, a, b, "precise") for a, b in ((0, 100), (-9e5, 9e5)))
    assert room.rotation_at(short, 50.0) == room.rotation_at(long, 50.0)


def test_days_of_the_year_follow_the_calendar():
    start = datetime(2016, 12, 30, 22, tzinfo=UTC)
    table = room.rotation_table(start, 0.0, 1.0, "precise")
    for hours in range(-24 * 800, 24 * 800, 37):
        day = (start + timedelta(hours=hours)).timetuple().tm_yday
        assert room.day_of_year_at(table, 3600.0 * hours) == day


def test_unknown_mode_is_an_error():
    message = "earth rotation: must be one of precise, sidereal; received 'flat'"
    with pytest.raises(ValueError, match=message):
        room.rotation_table(STARTS[0], 0.0, 1.0, "flat")
