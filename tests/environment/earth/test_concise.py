"""Short series of the Earth's rotation and the Sun: against erfa's long ones."""

import math

import numpy as np
import pytest

from torquer.base.time import julian_dates
from torquer.environment.earth.concise import J2000_DAY, earth_at
from torquer.environment.earth.rotation import dcm_inertial_to_ecef, teme_to_gcrf
from torquer.environment.sun import sun_position

ARCSEC = math.pi / 648000.0
#: From 1990 to 2060, at all seasons and hours.
DATES = [
    f"{1990 + k % 71}-{1 + k % 12:02}-{1 + 7 * k % 28:02}T{5 * k % 24:02}:{11 * k % 60:02}:00Z"
    for k in range(0, 71 * 12, 5)
]


def earth(start: str, mode: str, dut1_s: float = 0.0, t_s: float = 0.0):
    (day, ut1), (_, tt) = julian_dates(start, t_s, dut1_s)
    return earth_at(float(day - J2000_DAY + ut1), float(86400.0 * (tt - ut1)), mode == "precise")


def angle_between(a, b) -> float:
    """Angle [rad] of the turn between two matrices that are nearly the same."""
    return float(np.linalg.norm(np.array(a) - b) / math.sqrt(2.0))


@pytest.mark.parametrize("mode", ["precise", "sidereal"])
def test_axes_and_sun_are_those_of_the_long_series(mode):
    axes, suns, distances = [], [], []
    for start in DATES:
        found = earth(start, mode)
        axes.append(angle_between(found.to_ecef, dcm_inertial_to_ecef([0.0], start, mode)[0]))
        sun = sun_position([0.0], start, mode)[0]
        off = np.linalg.norm(np.cross(found.sun, sun)) / (sun @ sun)
        suns.append(math.degrees(off))
        distances.append(abs(np.linalg.norm(found.sun) / np.linalg.norm(sun) - 1.0))
    assert max(axes) < (0.2 * ARCSEC if mode == "precise" else 1e-10)
    assert max(suns) < 0.01
    assert max(distances) < 1e-4


def test_teme_is_that_of_the_long_series():
    off = [angle_between(earth(s, "precise").to_teme, teme_to_gcrf([0.0], s)[0].T) for s in DATES]
    assert max(off) < 0.2 * ARCSEC
    assert np.array_equal(earth(DATES[0], "sidereal").to_teme, np.eye(3))


def test_ut1_turns_the_earth_and_not_the_sun():
    start = "2024-06-21T12:00:00Z"
    one, other = earth(start, "precise"), earth(start, "precise", dut1_s=0.5)
    turned = angle_between(one.to_ecef, np.array(other.to_ecef))
    assert turned == pytest.approx(0.5 * 7.2921e-5, rel=1e-4)
    assert np.allclose(one.sun, other.sun, rtol=1e-9)


def test_matrices_are_rotations():
    for matrix in earth("2031-02-03T04:05:06Z", "precise")[:2]:
        m = np.array(matrix)
        assert np.abs(m @ m.T - np.eye(3)).max() < 1e-15
        assert np.linalg.det(m) == pytest.approx(1.0)
