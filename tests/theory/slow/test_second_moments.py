"""Averaged second moments: closed forms, quadrature, and what FIELD prints on its page 17."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gallery.theory.field_products import mean_products
from torquer.environment.field.averaged import b_z
from torquer.environment.field.direct_dipole import b_s, b_y
from torquer.environment.field.tilted_dipole import b_dipole
from torquer.maths.geometry.frames import dcm_s_to_y
from torquer.theory.slow.orbit_field import field_at, field_rate
from torquer.theory.slow.second_moments import (
    averaged_moments,
    direct_dipole_moments,
    tilted_dipole_moments,
)
from torquer.theory.slow.spinner import Spinner

MANY = settings(max_examples=50, deadline=None)
degrees = st.floats(0.0, 180.0)
MODELS = ("averaged", "direct_dipole", "tilted_dipole")


def matrix(m):
    xx, yy, zz, xy, xz, yz = m
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def moments_by_quadrature(spinner, nodes_u, nodes_day):
    products = mean_products(spinner.orbit_field(), nodes_u, nodes_day)
    return [product / spinner.strength_t**2 for product in products]


@MANY
@given(st.sampled_from(MODELS), degrees, degrees)
def test_closed_forms_are_the_quadrature(model, inclination, tilt):
    spinner = Spinner(inclination_deg=inclination, field=model, strength_t=3e-5, tilt_deg=tilt)
    for nodes_u, nodes_day in ((5, 3), (40, 30)):
        found = moments_by_quadrature(spinner, nodes_u, nodes_day)
        assert spinner.moments() == pytest.approx(found, rel=0.0, abs=1e-12)


def test_four_nodes_are_too_few():
    field = Spinner(inclination_deg=60.0, field="direct_dipole").orbit_field()
    four, five = (np.array(mean_products(field, count, 1)) for count in (4, 5))
    assert np.abs(four - five).max() > 0.1
    tilted = Spinner(inclination_deg=60.0, field="tilted_dipole", tilt_deg=10.0).orbit_field()
    two, three = (np.array(mean_products(tilted, 5, count)) for count in (2, 3))
    assert np.abs(two - three).max() > 1e-3


@pytest.mark.parametrize("inclination_deg", [10.0, 51.7, 82.5, 98.0])
def test_the_sign_of_the_mixed_moment_of_the_direct_dipole(inclination_deg):
    """By the mean of (1.5) over many points, in S and turned there from Y: -1/2 sin i cos i."""
    i = math.radians(inclination_deg)
    u = np.linspace(0.0, 2.0 * math.pi, 1000, endpoint=False)
    by_s = np.array([b_s(1.0, x, i) for x in u])
    by_y = np.array([b_y(1.0, x, i) for x in u]) @ np.array(dcm_s_to_y(i))
    for b in (by_s, by_y):
        mixed = np.mean(b[:, 1] * b[:, 2])
        assert mixed == pytest.approx(-0.5 * math.sin(i) * math.cos(i), abs=1e-12)
        assert matrix(direct_dipole_moments(i)) == pytest.approx(b.T @ b / len(u), abs=1e-12)


def test_limits():
    polar = averaged_moments(math.pi / 2.0)
    assert polar == pytest.approx((0.5, 0.5, 0.0, 0.0, 0.0, 0.0), abs=1e-15)
    assert direct_dipole_moments(0.0) == (0.0, 0.0, 1.0, 0.0, 0.0, -0.0)
    # without tilt: the direct dipole, turned from S to Y
    for inclination in (0.3, 1.1, 2.5):
        turn = np.array(dcm_s_to_y(inclination))
        expected = turn @ matrix(direct_dipole_moments(inclination)) @ turn.T
        for tilt in (0.0, math.pi):
            found = matrix(tilted_dipole_moments(inclination, tilt))
            assert found == pytest.approx(expected, abs=1e-15)


@MANY
@given(degrees, degrees)
def test_of_the_tilted_dipole_as_field_prints_them(inclination_deg, tilt_deg):
    """FIELD p. 17 (no number), read as signs and places allow: all six agree.

    With w = sin^2 i cos^2 d + cos^2 i sin^2 d / 2, d the tilt.
    """
    i, d = math.radians(inclination_deg), math.radians(tilt_deg)
    si, ci, sd, cd = math.sin(i) ** 2, math.cos(i) ** 2, math.sin(d) ** 2, math.cos(d) ** 2
    w = si * cd + 0.5 * ci * sd
    found = tilted_dipole_moments(i, d)
    assert found[0] == pytest.approx(11.0 / 16.0 * sd + 9.0 / 8.0 * w, abs=1e-14)
    printed = 0.5 * sd - 15.0 / 16.0 * ci * sd + 27.0 / 8.0 * ci * w
    assert found[1] == pytest.approx(printed, abs=1e-14)
    printed = cd + 9.0 / 16.0 * si * sd - 3.0 * cd * si + 27.0 / 8.0 * si * w
    assert found[2] == pytest.approx(printed, abs=1e-14)
    half = math.sin(i) * math.cos(i)
    printed = half * (-1.5 * (cd + sd / 8.0) + 27.0 / 8.0 * w)
    assert found[5] == pytest.approx(printed, abs=1e-14)
    assert found[3:5] == (0.0, 0.0)


@MANY
@given(degrees, st.floats(-7.0, 7.0), st.floats(-7.0, 7.0))
def test_field_on_the_orbit_is_that_of_field_models(inclination_deg, u, day):
    i = math.radians(inclination_deg)
    cone = Spinner(inclination_deg=inclination_deg, strength_t=2.0).orbit_field()
    assert field_at(cone, u, day) == b_z(2.0, u, cone.angle)
    keys = {"inclination_deg": inclination_deg, "strength_t": 2.0}
    direct = Spinner(field="direct_dipole", **keys).orbit_field()
    assert field_at(direct, u, day) == b_s(2.0, u, i)
    tilted = Spinner(field="tilted_dipole", tilt_deg=180.0, **keys).orbit_field()
    assert field_at(tilted, u, day) == pytest.approx(b_y(2.0, u, i), abs=1e-13)
    tilted = Spinner(field="tilted_dipole", tilt_deg=140.0, **keys).orbit_field()
    k = np.array([math.cos(day), math.sin(day), 0.0]) * math.sin(math.radians(140.0))
    k[2] = math.cos(math.radians(140.0))
    r = np.array(dcm_s_to_y(i)) @ [math.cos(u), math.sin(u), 0.0]
    found = b_dipole(tuple((2.0 * k).tolist()), tuple(r.tolist()))
    assert field_at(tilted, u, day) == pytest.approx(found, abs=1e-13)


@MANY
@given(st.sampled_from(MODELS), degrees, st.floats(-7.0, 7.0), st.floats(-7.0, 7.0))
def test_its_rate_is_its_derivative(model, inclination_deg, u, day):
    field = Spinner(inclination_deg=inclination_deg, field=model, tilt_deg=150.0).orbit_field()
    gain, h = 0.07, 1e-3

    def at(step):
        return np.array(field_at(field, u + step * h, day + step * h * gain))

    expected = (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * h)
    assert field_rate(field, u, day, gain) == pytest.approx(expected, abs=1e-9)
