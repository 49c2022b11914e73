"""Earth rotation: against erfa evaluated at every time, skyfield, and the classical chain."""

import erfa
import numpy as np
import pytest
from skyfield.api import load
from skyfield.framelib import itrs
from skyfield.sgp4lib import TEME

from torquer.base.conventions import EARTH_RATE_RAD_S
from torquer.base.time import julian_dates
from torquer.environment.earth import rotation

START = "2012-03-04T10:31:47Z"
TEN_REVOLUTIONS = np.linspace(0.0, 57000.0, 400)
THIRTY_DAYS = np.linspace(-86400.0, 30 * 86400.0, 700)


@pytest.mark.parametrize("t", (TEN_REVOLUTIONS, THIRTY_DAYS), ids=("revolutions", "month"))
@pytest.mark.parametrize("start", (START, "1985-06-06T00:00:00Z", "2029-11-30T23:00:00Z"))
def test_precise_rotation_equals_erfa_at_every_time(t, start):
    ut1, tt = julian_dates(start, t, dut1_s=0.3)
    every_time = erfa.c2tcio(erfa.c2i06a(*tt), erfa.era00(*ut1), np.eye(3))
    ours = rotation.dcm_inertial_to_ecef(t, start, "precise", dut1_s=0.3)
    assert np.abs(ours - every_time).max() < 1e-11


def test_costly_series_is_evaluated_at_few_dates(monkeypatch):
    calls = []
    series = erfa.c2i06a
    monkeypatch.setattr(erfa, "c2i06a", lambda *date: calls.append(date[1].size) or series(*date))
    rotation.dcm_inertial_to_ecef(np.linspace(0.0, 57000.0, 4000), START)
    assert len(calls) == 1 and calls[0] <= 8


def test_a_date_has_one_matrix_in_every_run():
    later = "2012-03-14T10:31:47Z"
    alone = rotation.dcm_inertial_to_ecef([5.0], later)
    in_a_long_run = rotation.dcm_inertial_to_ecef(np.array([0.0, 864005.0]), START)
    assert np.abs(alone[0] - in_a_long_run[1]).max() < 2e-14


def test_degree_five_polynomials_are_exact():
    powers = np.arange(6)

    def polynomial(day, fraction):
        return ((day - 100.0 + fraction)[:, None] / 3.0) ** powers

    fraction = np.random.default_rng(4).uniform(-3.0, 9.0, 50)
    found = rotation.interpolate_slow(polynomial, 100.0, fraction)
    assert np.abs(found - polynomial(100.0, fraction)).max() < 1e-11


def skyfield_times(seconds):
    # a constant TT - UT1 makes UT1 = UTC there too
    scale = load.timescale(builtin=True, delta_t=32.184 + 34.0)
    return scale.utc(2012, 3, 4, 10, 31, 47.0 + seconds)


def test_precise_rotation_equals_skyfield():
    theirs = np.moveaxis(itrs.rotation_at(skyfield_times(TEN_REVOLUTIONS)), -1, 0)
    ours = rotation.dcm_inertial_to_ecef(TEN_REVOLUTIONS, START)
    assert np.abs(ours - theirs).max() < 1e-10  # 20 microarcseconds


def test_teme_equals_skyfield():
    times = skyfield_times(TEN_REVOLUTIONS[::40])
    theirs = np.stack([TEME.rotation_at(t) for t in times])
    ours = np.swapaxes(rotation.teme_to_gcrf(TEN_REVOLUTIONS[::40], START), 1, 2)
    assert np.abs(ours - theirs).max() < 1e-10


def test_teme_equals_the_classical_chain():
    """Precession IAU 1976, nutation 1980, equation of the equinoxes: to 0.2 arcsec."""
    _, tt = julian_dates(START, TEN_REVOLUTIONS)
    of_date_to_teme = erfa.rz(erfa.eqeq94(*tt), np.eye(3))
    teme = of_date_to_teme @ erfa.pnm80(*tt)
    ours = np.swapaxes(rotation.teme_to_gcrf(TEN_REVOLUTIONS, START), 1, 2)
    assert np.abs(ours - teme).max() < 1e-6
    # and without the equation of the equinoxes it would not: the test can tell
    assert np.abs(ours - erfa.pnm80(*tt)).max() > 1e-5


def test_both_models_put_a_teme_position_at_one_place():
    r_teme = np.array([4.1e6, -3.3e6, 4.4e6])
    precise = rotation.dcm_inertial_to_ecef(TEN_REVOLUTIONS, START, "precise")
    precise = precise @ rotation.teme_to_gcrf(TEN_REVOLUTIONS, START) @ r_teme
    sidereal = rotation.dcm_inertial_to_ecef(TEN_REVOLUTIONS, START, "sidereal") @ r_teme
    assert np.abs(precise - sidereal).max() < 1e-4


def test_sidereal_angle_of_a_published_example():
    # Meeus, Astronomical Algorithms, example 12.b: 1987 April 10, 19:21:00 UT, 8h 34m 57.0896s
    m = rotation.dcm_inertial_to_ecef([0.0], "1987-04-10T19:21:00Z", "sidereal")[0]
    seconds = np.degrees(np.arctan2(m[0, 1], m[0, 0])) * 240.0
    assert seconds == pytest.approx(8 * 3600 + 34 * 60 + 57.0896, abs=5.1e-5)
    assert np.array_equal(m[2], (0.0, 0.0, 1.0))


@pytest.mark.parametrize("mode", rotation.MODES)
def test_rotations_are_proper_and_turn_at_the_earths_rate(mode):
    t = np.array([0.0, 100.0])
    m = rotation.dcm_inertial_to_ecef(t, START, mode)
    assert np.abs(m @ np.swapaxes(m, 1, 2) - np.eye(3)).max() < 1e-11
    assert np.allclose(np.linalg.det(m), 1.0, rtol=0, atol=1e-11)
    step = m[1] @ m[0].T
    angle = np.arctan2(step[0, 1] - step[1, 0], step[0, 0] + step[1, 1])
    # eastward; TEME's equinox drifts by 7e-12 rad/s against an inertial frame
    assert angle / 100.0 == pytest.approx(EARTH_RATE_RAD_S, abs=1e-11)


def test_one_second_of_ut1():
    base, moved = (rotation.dcm_inertial_to_ecef([0.0], START, "precise", d)[0] for d in (0.0, 1.0))
    step = moved @ base.T
    assert step[0, 1] == pytest.approx(EARTH_RATE_RAD_S, rel=1e-6)


def test_an_unknown_model_is_one_clear_line():
    message = "earth rotation: must be one of precise, sidereal; received 'flat'"
    with pytest.raises(ValueError) as error:
        rotation.dcm_inertial_to_ecef([0.0], START, "flat")
    assert str(error.value) == message


def test_runs_of_the_same_days_share_the_costly_series(monkeypatch):
    """The same half days around both: the series once, and to the bit what a first run has."""
    t, calls, series = np.linspace(0.0, 600.0, 7), [], erfa.c2i06a
    rotation._on_grid.cache_clear()
    first = rotation.dcm_inertial_to_ecef(t, START)
    monkeypatch.setattr(erfa, "c2i06a", lambda *date: calls.append(date) or series(*date))
    for start in (START, "2012-03-04T09:00:00Z", START):
        again = rotation.dcm_inertial_to_ecef(t, start)
    assert len(calls) == 1 and np.array_equal(again, first)
    rotation.dcm_inertial_to_ecef(t, "2012-03-05T10:31:47Z")
    assert len(calls) == 2
