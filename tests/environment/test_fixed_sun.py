"""The Sun of theory: held in one inertial direction, and shining through the Earth."""

import numpy as np
import pytest

from torquer.base.conventions import ASTRONOMICAL_UNIT_M, EARTH_RADIUS_M
from torquer.base.time import parse_utc
from torquer.environment import sun
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit import Circular
from torquer.environment.table import lookup3
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.simulate import simulate

START = "2026-06-01T00:00:00Z"
EQUATORIAL = Circular(altitude_km=600.0, inclination_deg=0.0)
#: From a satellite at 600 km, 1 au away: how far the Sun strays from its direction [rad].
PARALLAX = EQUATORIAL.radius_m / ASTRONOMICAL_UNIT_M


def met(**keys):
    return OrbitEnvironment(Environment(**keys), EQUATORIAL, parse_utc(START))


def test_fixed_sun_stays_in_its_direction_for_a_year():
    environment = met(sun_direction=(2.0, -1.0, 2.0))
    t = np.linspace(0.0, 365.25 * 86400.0, 50)
    expected = ASTRONOMICAL_UNIT_M * np.array([2.0, -1.0, 2.0]) / 3.0
    assert np.allclose(environment.sun(t), expected, rtol=1e-15, atol=0.0)
    table = environment.sun_table(30 * 86400.0)
    read = np.array([lookup3(table, s) for s in np.linspace(0.0, 30 * 86400.0, 200)])
    assert np.allclose(read, expected, rtol=1e-13, atol=0.0)


def test_sun_left_alone_follows_its_true_path():
    t = np.linspace(0.0, 365.25 * 86400.0, 50)
    assert np.array_equal(met().sun(t), sun.sun_position(t, parse_utc(START)))


def test_no_eclipse_is_light_everywhere_even_inside_the_earth():
    rng = np.random.default_rng(5)
    r = rng.normal(size=(2000, 3)) * np.geomspace(1e3, 1e9, 2000)[:, None]
    s = ASTRONOMICAL_UNIT_M * np.array([0.6, 0.0, -0.8])
    assert np.all(sun.sunlit_fraction(r, s, "none") == 1.0)
    assert np.any(sun.sunlit_fraction(r, s) == 0.0)  # the test can tell


@pytest.mark.parametrize("eclipse", ["conical", "oblate", "cylindrical"])
def test_shadow_of_a_fixed_sun_lies_opposite_to_it(eclipse):
    environment = met(sun_direction=(0.0, 1.0, 0.0), eclipse=eclipse, earth_rotation="sidereal")
    t = np.arange(0.0, EQUATORIAL.period_s, 1.0)
    r, _ = environment.state(t)
    dark = environment.sunlit_fraction(t, r) < 0.5
    half = np.arcsin(EARTH_RADIUS_M / EQUATORIAL.radius_m)
    assert dark.mean() == pytest.approx(half / np.pi, abs=2e-3)
    angle = np.unwrap(np.arctan2(r[dark, 1], r[dark, 0]))
    assert angle.mean() % (2.0 * np.pi) == pytest.approx(1.5 * np.pi, abs=2e-3)


def spinner(**environment):
    """Ten revolutions of free rotation about the third axis, which is inertial axis 3."""
    axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    return simulate(
        Scenario.model_validate(
            {
                "start": START,
                "orbit": {"kind": "circular", "altitude_km": 600, "inclination_deg": 0},
                "environment": {"gravity_gradient": False, **environment},
                "spacecraft": {
                    "body": {"inertia_kg_m2": (1.0, 1.0, 1.5)},
                    "sun_sensors": {"axes": axes, "half_field_deg": 80},
                },
                "initial": {"rate_deg_s": (0, 0, 3)},
                "control": {"law": {"kind": "off"}, "sample_s": 10.0},
                "simulation": {"revolutions": 10, "record_s": 10.0},
            }
        )
    )


def test_spinner_sees_fixed_sun_at_fixed_angle_to_its_axis():
    fixed = spinner(sun_direction=(0.8, 0.0, 0.6), eclipse="none")
    seen = fixed["sun_measured"].values[:-1]
    assert np.all(fixed["sunlit_fraction"].values == 1.0)
    assert np.allclose(np.linalg.norm(seen, axis=1), 1.0, atol=1e-12)
    assert np.abs(seen[:, 2] - 0.6).max() < PARALLAX
    true = spinner(eclipse="none")["sun_measured"].values[:-1]
    assert np.ptp(true[:, 2]) > 10.0 * PARALLAX  # half a day of the Sun's path


def test_spinner_behind_the_earth_sees_no_fixed_sun():
    run = spinner(sun_direction=(1.0, 0.0, 0.0))
    sees = np.linalg.norm(run["sun_measured"].values[:-1], axis=1) > 0.5
    assert 0.6 < sees.mean() < 0.7


def test_sun_without_a_direction_is_one_clear_line():
    with pytest.raises(ValueError, match="sun_direction: must be non-zero vectors"):
        Environment(sun_direction=(0.0, 0.0, 0.0))
