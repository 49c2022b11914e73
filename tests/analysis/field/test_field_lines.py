"""Field lines: along the field, and those of a dipole in closed form."""

import numpy as np
import pytest

from torquer.analysis.field.lines import field_lines
from torquer.base.time import parse_utc
from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.field import FIELDS
from torquer.environment.orbit.circular import Circular

T = np.linspace(0.0, 4000.0, 5)


def orbit_environment(kind):
    environment = Environment(field=FIELDS[kind](), earth_rotation="sidereal")
    orbit = Circular(altitude_km=700.0, inclination_deg=60.0, argument_of_latitude_deg=20.0)
    return OrbitEnvironment(environment, orbit, parse_utc("2020-03-01T00:00:00Z", "start"))


def test_dipole_lines_have_one_parameter_and_stay_in_their_meridian():
    """r = L cos^2(latitude), at one longitude; Source of the closed form: any textbook."""
    place = orbit_environment("direct_dipole")
    r, v = place.state(T)
    for n, line in enumerate(field_lines(place, T, r, v)):
        x, y, z = line[np.isfinite(line[:, 0])].T
        size = np.sqrt(x * x + y * y + z * z)
        parameter = size**3 / (x * x + y * y)
        assert np.ptp(parameter) < 2e-3 * parameter.mean(), n  # midpoint rule: 0.04^2
        # the meridian of the place: no component across it
        east = np.array([-r[n, 1], r[n, 0], 0.0]) / np.hypot(r[n, 0], r[n, 1])
        assert np.abs(x * east[0] + y * east[1]).max() < 1.0  # m
        assert size.min() > 6.37e6 and len(size) > 20


@pytest.mark.parametrize("kind", ["igrf14", "tilted_dipole"])
def test_lines_are_tangent_to_the_field_and_lead_north(kind):
    place = orbit_environment(kind)
    r, v = place.state(T[:1])
    (line,) = field_lines(place, T[:1], r, v)
    points = line[np.isfinite(line[:, 0])]
    middle, chord = 0.5 * (points[1:] + points[:-1]), np.diff(points, axis=0)
    when = np.zeros(len(middle))
    b = place.field(when, middle, np.broadcast_to(v, middle.shape))
    cosine = np.sum(b * chord, axis=1) / np.linalg.norm(b, axis=1) / np.linalg.norm(chord, axis=1)
    assert cosine.min() > 1.0 - 1e-4
    assert points[-1, 2] > points[0, 2]  # the field leads from the southern ground to the northern


def test_a_field_along_the_orbit_only_has_no_lines():
    place = orbit_environment("averaged")
    assert field_lines(place, T, *place.state(T)) is None
