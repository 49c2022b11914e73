"""The ephemeris that a computer works out on board: against the environment of the simulation."""

import math

import numpy as np
import pytest

from torquer.base.time import parse_utc
from torquer.computer.on_board_environment import ELEMENTS, KINDS, NUMBERS, ephemeris_along
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.field import FIELDS
from torquer.environment.orbit import Circular, Kepler, Sgp4
from torquer.flight.c99.elements import find_elements
from torquer.flight.c99.ephemeris import find_models

CHIBIS = (
    "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
    "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
)
ORBITS = {
    "given": Circular(altitude_km=500.0, inclination_deg=97.4, raan_deg=20.0),
    "kepler": Kepler(perigee_altitude_km=500.0, apogee_altitude_km=4000.0, inclination_deg=63.4),
    "sgp4": Sgp4(tle=CHIBIS),
}
pytestmark = pytest.mark.filterwarnings("error::numba.NumbaExperimentalFeatureWarning")
START = parse_utc("2012-03-04T10:31:47Z")
T_S = np.arange(0.0, 86400.0, 97.0)


def along(kind: str, t_s=T_S, **environment) -> tuple[OrbitEnvironment, np.ndarray]:
    """The truth, and what is worked out on board."""
    own = OrbitEnvironment(Environment(**environment), ORBITS[kind], START)
    r, v = own.state(t_s)
    found = ephemeris_along(kind, find_models(own), find_elements(kind, own), t_s, r, v)
    return own, found


def lengths(vectors) -> np.ndarray:
    return np.linalg.norm(vectors, axis=1)


@pytest.mark.parametrize("rotation", ["precise", "sidereal"])
@pytest.mark.parametrize("kind", list(KINDS))
def test_it_is_the_environment_of_the_simulation(kind, rotation):
    own, found = along(kind, earth_rotation=rotation, ut1_minus_utc_s=-0.4)
    r, v = own.state(T_S)
    # 0.2 arcsec of the Earth's axes, at 7000 km
    assert lengths(found[:, :3] - r).max() < 7.0
    assert lengths(found[:, 3:6] - v).max() < 7e-3
    assert lengths(found[:, 6:9] - own.field(T_S, r, v)).max() < 0.2e-9
    to_sun = own.sun(T_S) - r
    assert lengths(found[:, 12:15] - to_sun / lengths(to_sun)[:, None]).max() < math.radians(0.01)
    lit = own.sunlit_fraction(T_S, r)
    assert np.abs(found[:, 15] - lit).max() < 0.03
    assert np.mean(lit) < 0.9 and np.mean((lit > 0.5) != (found[:, 15] > 0.5)) < 0.002


def test_the_rate_of_the_field_is_that_along_the_orbit():
    own, found = along("sgp4")
    before, after = (own.field(t, *own.state(t)) for t in (T_S - 0.5, T_S + 0.5))
    assert lengths(found[:, 9:12] - (after - before)).max() < 1e-12  # of 6e-8 T/s


@pytest.mark.parametrize(
    "field",
    [{"kind": "igrf14", "degree": 4}, {"kind": "igrf14", "held_at_year": 2000.0},
     {"kind": "igrf14", "degree": 1}, {"kind": "tilted_dipole"},
     {"kind": "tilted_dipole", "mu_e_t_km3": 7.8e6, "tilt_deg": 168.0, "longitude_deg": 108.0},
     {"kind": "direct_dipole"}],
    ids=str,
)  # fmt: skip
def test_other_field_models(field):
    model = FIELDS[field["kind"]](**field)
    own, found = along("given", T_S[:200], field=model, earth_rotation="sidereal")
    r, v = own.state(T_S[:200])
    assert lengths(found[:, 6:9] - own.field(T_S[:200], r, v)).max() < 0.3e-9


@pytest.mark.parametrize("eclipse", ["oblate", "cylindrical", "none"])
def test_other_shadows(eclipse):
    own, found = along("given", eclipse=eclipse)
    lit = own.sunlit_fraction(T_S, own.state(T_S)[0])
    assert np.mean(np.abs(found[:, 15] - lit) > 0.03) <= 0.002


def test_the_field_follows_the_date_that_is_sent_up():
    """Two and a half years after the date of the export, 4.8 after the epoch of its field."""
    own, _ = along("given", T_S[:1])
    later = OrbitEnvironment(own.environment, own.orbit, parse_utc("2014-11-04T00:00:00Z"))
    t_s = T_S[:50]
    r, v = later.state(t_s)
    found = ephemeris_along("given", find_models(own), find_elements("given", later), t_s, r, v)
    assert lengths(found[:, 6:9] - later.field(t_s, r, v)).max() < 0.5e-9


def test_without_a_place_nothing_is_known():
    own = OrbitEnvironment(Environment(), ORBITS["sgp4"], START)
    elements = find_elements("sgp4", own)
    elements["mean_motion_rev_day"] = 2.0
    nowhere = np.zeros((1, 3))
    found = ephemeris_along("sgp4", find_models(own), elements, [0.0], nowhere, nowhere)
    assert found.shape == (1, NUMBERS) and np.isnan(found).all()
    assert set(ELEMENTS) == set(KINDS)
