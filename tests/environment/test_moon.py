"""The Moon's place against the series of Meeus in ERFA, and what it blinds in flight."""

import erfa
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.base.conventions import ASTRONOMICAL_UNIT_M
from torquer.base.time import julian_dates
from torquer.compile import engine
from torquer.environment.moon import moon_position


def by_erfa(t_s, start):
    """Position of the Moon [n, 3] m in GCRF by `erfa.moon98`, good to some arcseconds."""
    _, (day, fraction) = julian_dates(start, t_s)
    return erfa.moon98(day, fraction)["p"] * ASTRONOMICAL_UNIT_M


def apart_deg(one, other):
    """Angles [n] deg between directions [n, 3]."""
    across = np.linalg.norm(np.cross(one, other), axis=1)
    return np.degrees(np.arctan2(across, np.sum(one * other, axis=1)))


def test_the_moon_is_where_erfa_has_it():
    """Over two centuries; a satellite's own place makes up to 1 deg, which a test below has."""
    t_s, worst = np.arange(0.0, 90 * 86400.0, 21600.0), []
    for year in range(1900, 2100, 10):
        start = f"{year}-01-15T00:00:00Z"
        found, exact = moon_position(t_s, start), by_erfa(t_s, start)
        worst.append(apart_deg(found, exact))
        ratio = np.linalg.norm(found, axis=1) / np.linalg.norm(exact, axis=1)
        assert np.abs(ratio - 1.0).max() < 0.005
    assert np.max(worst) < 0.4
    assert np.sqrt(np.mean(np.square(worst))) < 0.13


def test_the_frame_of_date_is_turned_by_the_precession():
    t_s = np.arange(0.0, 30 * 86400.0, 86400.0)
    precise = moon_position(t_s, "2050-03-01T00:00:00Z")
    of_date = moon_position(t_s, "2050-03-01T00:00:00Z", "sidereal")
    turned = apart_deg(precise, of_date)
    assert turned.max() == pytest.approx(50.29 * 50.16 / 3600.0, rel=0.02)  # general precession
    with pytest.raises(ValueError, match="earth rotation: must be one of precise, sidereal"):
        moon_position(t_s, "2050-03-01T00:00:00Z", "exact")


TIMES = {"duration_s": 6000.0, "record_s": 10.0}
TRACKER = {"boresight": [0.2, -0.3, 1.0], "moon_exclusion_deg": 40.0}


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize("several", [False, True])
def test_a_tracker_is_blind_while_the_moon_is_near_its_boresight(make, several):
    craft = {"spacecraft.star_trackers": {"a": TRACKER, "b": {}}} if several else {
        "spacecraft.attitude_sensor": TRACKER}  # fmt: skip
    changes = {"simulation": TIMES | {"record_inputs": True}, "control.law": {"kind": "off"}}
    scenario = make(changes | craft)
    result = simulate(scenario)
    name = "star_trackers.a" if several else "q_measured"
    name = name if name in result else next(v for v in result.variables if "attitude" in str(v))
    is_blind = np.isnan(result[name].values).any(axis=1)[1:-1]
    t_s = result["time"].values
    r, _ = scenario.orbit_environment().state(t_s)
    to_moon = by_erfa(t_s, scenario.start) - r
    axis = np.array(TRACKER["boresight"])
    boresight = Rotation.from_quat(result["q_body_to_inertial"].values).apply(axis)
    angle = apart_deg(boresight, to_moon)[1:-1]
    assert np.all(is_blind[angle < 39.6]) and not np.any(is_blind[angle > 40.4])
    assert 0.05 < is_blind.mean() < 0.95
    from_earth = apart_deg(boresight, to_moon + r)[1:-1]
    assert np.abs(from_earth - angle).max() > 0.5  # seen from the satellite, not from the Earth
