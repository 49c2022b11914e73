"""SGP4 as kernels: against the package `sgp4` over many element sets."""

import math

import numpy as np
import pytest
from sgp4.api import WGS72, Satrec

from torquer.computer.on_board_environment import ELEMENTS
from torquer.environment.orbit.near_earth import cube_root, sgp4_state

MINUTES = (0.0, -1440.0, 33.3, 720.0, 1440.0, 10080.0)


def both(motion, e, inclination, node, perigee, anomaly, drag):
    """The package's satellite and the elements of the kernel; angles [deg], revolutions a day."""
    satellite = Satrec()
    angles = [math.radians(each) for each in (perigee, inclination, anomaly, node)]
    satellite.sgp4init(
        WGS72, "i", 1, 22000.0, drag, 0.0, 0.0, e, *angles[:3], motion * 2.0 * math.pi / 1440.0,
        angles[3],
    )  # fmt: skip
    row = np.zeros(1, ELEMENTS["sgp4"])
    values = (motion, e, inclination, node, perigee, anomaly, drag)
    for name, value in zip(row.dtype.names[2:9], values, strict=True):
        row[name] = value
    return satellite, row


def compared(satellite, row) -> tuple[float, int]:
    """Greatest distance [m] over `MINUTES`, and at how many of them the package has a place."""
    worst, known = 0.0, 0
    for t in MINUTES:
        code, r_km, v_km_s = satellite.sgp4_tsince(t)
        r, v = sgp4_state(row[0], 60.0 * t)
        if code:
            assert all(math.isnan(x) for x in (*r, *v)), (code, t)
            continue
        known += 1
        worst = max(worst, np.abs(np.array(r) - 1e3 * np.array(r_km)).max())
        assert np.abs(np.array(v) - 1e3 * np.array(v_km_s)).max() < 1e-5
    return worst, known


@pytest.mark.parametrize("days", [3.78, -4.2])
def test_a_satellite_that_has_come_down_does_not_rise_again(days):
    """The package has a place for it, near the orbit that it had."""
    satellite, row = both(15.92146194, 0.0014449, 98.5849, 110.9278, 269.2407, 90.7207, 0.044853)
    code, r_km, _ = satellite.sgp4_tsince(1440.0 * days)
    assert code == 0 and 0.8 < np.linalg.norm(r_km) / 6670.0 < 1.2
    assert all(math.isnan(x) for part in sgp4_state(row[0], 86400.0 * days) for x in part)
    assert all(math.isfinite(x) for part in sgp4_state(row[0], 43200.0) for x in part)


def random_elements(seed: int):
    rng = np.random.default_rng(seed)
    perigee_km = rng.choice([rng.uniform(80, 230), rng.uniform(230, 900), rng.uniform(900, 3000)])
    e = rng.choice([0.0, 1e-5, rng.uniform(0.0, 0.02), rng.uniform(0.0, 0.3)])
    axis_km = (6378.135 + perigee_km) / (1.0 - e)
    motion = 86400.0 / (2.0 * math.pi) * math.sqrt(398600.8 / axis_km**3)
    angles = rng.uniform(0.0, 360.0, 3)
    inclination = rng.choice([0.0, 180.0, 63.435, 98.0, rng.uniform(0.0, 180.0)])
    drag = rng.choice([0.0, rng.uniform(-1e-4, 1e-3), 10 ** rng.uniform(-6, -2)])
    return motion, e, inclination, angles[0], angles[1], angles[2], drag


def test_many_element_sets_are_where_the_package_has_them():
    low, places = 0, 0
    for seed in range(400):
        given = random_elements(seed)
        if 1440.0 / given[0] > 224.0:
            continue
        satellite, row = both(*given)
        worst, known = compared(satellite, row)
        assert worst < 1e-4, (seed, given)
        low, places = low + (satellite.altp * 6378.135 < 219.0), places + known
    assert low > 50 and places > 1500


@pytest.mark.parametrize("perigee_km", [85.0, 120.0, 155.9, 156.1, 219.0, 221.0, 500.0])
def test_all_heights_of_the_perigee(perigee_km):
    motion = 86400.0 / (2.0 * math.pi) * math.sqrt(398600.8 / (6378.135 + perigee_km + 40.0) ** 3)
    e = 40.0 / (6378.135 + perigee_km + 40.0)
    satellite, row = both(motion, e, 51.6, 20.0, 30.0, 40.0, 1e-5)
    worst, known = compared(satellite, row)
    assert worst < 0.01 and known > 3


@pytest.mark.parametrize("period_min", [225.5, 717.9, 1436.1])
def test_deep_space_has_no_place(period_min):
    satellite, row = both(1440.0 / period_min, 0.01, 55.0, 1.0, 2.0, 3.0, 0.0)
    assert satellite.method == "d"
    r, v = sgp4_state(row[0], 0.0)
    assert all(math.isnan(x) for x in (*r, *v))


@pytest.mark.parametrize(
    "given",
    [(0.0, 0.001), (-15.0, 0.001), (math.nan, 0.001), (15.0, 1.0), (15.0, -0.01), (15.0, math.nan)],
)
def test_elements_of_no_orbit_have_no_place(given):
    row = np.zeros(1, ELEMENTS["sgp4"])
    row["mean_motion_rev_day"], row["eccentricity"] = given
    r, v = sgp4_state(row[0], 60.0)
    assert all(math.isnan(x) for x in (*r, *v))


@pytest.mark.parametrize("x", [1e-9, 0.3, 1.0, 8.0, 1.7e3, 1e9])
def test_cube_root(x):
    assert cube_root(x) == pytest.approx(x ** (1.0 / 3.0), rel=4e-16)
