"""The place of a test bench: at rest on the Earth, with the field of its coils in its own axes."""

import numpy as np
import pytest

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.time import parse_utc
from torquer.environment import Environment, OrbitEnvironment
from torquer.environment.field import HelmholtzCoils, elements
from torquer.environment.field.globe import at_geodetic
from torquer.environment.orbit import Bench
from torquer.maths.geometry.frames import dcm_orbital_to_inertial

START, T_S = parse_utc("2012-01-15T09:00:00Z", "start"), np.array([0.0, 1000.0, 50000.0])
B_NT = (3e4, -5e4, 8e4)


@pytest.fixture(params=("precise", "sidereal"))
def place(request):
    environment = Environment(
        field=HelmholtzCoils(b_nt=B_NT), earth_rotation=request.param, ut1_minus_utc_s=0.4
    )
    return OrbitEnvironment(environment, Bench(latitude_deg=-33.0, longitude_deg=120.0), START)


def test_place_is_at_rest_on_the_earth(place):
    r, v = place.state(T_S)
    ecef = np.einsum("nij,nj->ni", place.dcm_to_ecef(T_S), r)
    lat, lon = np.radians([-33.0, 120.0])
    wanted = EARTH_RADIUS_M * np.array(
        [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
    )
    assert np.abs(ecef - wanted).max() < 1e-3
    later, _ = place.state(T_S + 0.5)
    earlier, _ = place.state(T_S - 0.5)
    assert np.abs(later - earlier - v).max() < 1e-3  # of 390 m


def test_field_lies_along_east_north_up_of_orbital_frame(place):
    r, v = place.state(T_S)
    field = place.field(T_S, r, v)
    for b, position, velocity in zip(field, r, v, strict=True):
        to_inertial = np.array(dcm_orbital_to_inertial(tuple(position), tuple(velocity)))
        assert 1e9 * to_inertial.T @ b == pytest.approx(B_NT, rel=1e-6)


def test_field_on_the_globe_is_the_one_that_is_set():
    found = elements(
        at_geodetic(HelmholtzCoils(b_nt=B_NT), 2012.0, 40.0, 10.0, 0.0, geocentric=True)
    )
    assert (found.y_nt, found.x_nt, -found.z_nt) == pytest.approx(B_NT, rel=1e-9)
