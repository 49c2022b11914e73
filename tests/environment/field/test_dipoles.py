"""Tilted and direct dipole: limits, published forms, consistency of the forms in all frames."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.environment.field import DirectDipole, TiltedDipole, direct_dipole as direct
from torquer.environment.field.tilted_dipole import b_dipole, b_dipole_many, b_turning_many
from torquer.maths.geometry.frames import dcm_ecef_to_ned, dcm_orbital_to_inertial, dcm_s_to_y
from torquer.maths.geometry.vec3 import mat_vec

ANGLES = st.floats(0.0, 2.0 * math.pi)
INCLINATIONS = st.floats(0.0, math.pi)
RNG = np.random.default_rng(3)


def interpreted(kernel):
    """The plain Python behind a kernel (the kernel itself where compilation is off)."""
    return getattr(kernel, "py_func", kernel)


def radius_y(u, i):
    """Unit radius vector of a circular orbit in Y."""
    return np.array([math.cos(u), math.sin(u) * math.cos(i), math.sin(u) * math.sin(i)])


def x_to_s(u):
    """Orbital axes in S, of the position and velocity there."""
    c, s = math.cos(u), math.sin(u)
    return dcm_orbital_to_inertial((c, s, 0.0), (-s, c, 0.0))


def close(a, b):
    """Vectors of length about one equal to rounding."""
    return np.abs(np.subtract(a, b)).max() < 1e-14


@settings(max_examples=100, deadline=None)
@given(u=ANGLES, i=INCLINATIONS)
def test_circular_forms_are_the_vector_form_in_their_frames(u, i):
    in_y = direct.b_y(1.0, u, i)
    assert close(in_y, b_dipole((0.0, 0.0, -1.0), tuple(radius_y(u, i))))
    in_s = direct.b_s(1.0, u, i)
    assert close(in_y, mat_vec(dcm_s_to_y(i), in_s))
    assert close(in_s, mat_vec(x_to_s(u), direct.b_orbital(1.0, u, i)))
    assert direct.strength(1.0, u, i) == pytest.approx(np.linalg.norm(in_y), rel=1e-14)


def test_printed_s_form_is_y_form_turned_by_inclination():
    """FIELD (1.5), derived: B_S = A_YS B_Y collapses to sin i - 3 sin i sin^2 u, cos i."""
    for u, i in RNG.uniform(0.0, 3.0, (50, 2)):
        c, s = math.cos(i), math.sin(i)
        turn = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
        printed = (
            -1.5 * math.sin(2.0 * u) * s,
            s - 3.0 * math.sin(u) ** 2 * s,
            c,
        )
        assert close(turn @ direct.b_y(1.0, u, i), printed)
        assert close(direct.b_s(1.0, u, i), printed)


def test_printed_components_of_the_tilted_dipole():
    """FIELD (1.1) in Y, with the signs that the text has: its lambda2 counts from -Y2."""
    d1, l2, u, i = math.radians(168.3), 0.7, 1.1, math.radians(63.0)
    k = np.array([math.sin(l2) * math.sin(d1), -math.cos(l2) * math.sin(d1), math.cos(d1)])
    xi = (
        math.cos(u) * math.sin(l2) * math.sin(d1)
        - math.sin(u) * math.cos(i) * math.cos(l2) * math.sin(d1)
        + math.sin(u) * math.sin(i) * math.cos(d1)
    )
    printed = 3.0 * xi * radius_y(u, i) - k
    model = TiltedDipole(mu_e_t_km3=1e-9, tilt_deg=168.3, longitude_deg=math.degrees(l2) - 90.0)
    moment = model.prepare(2026.0)
    assert close(b_dipole(moment, tuple(radius_y(u, i))), printed)


def test_field_of_the_dipole_at_its_equator_and_poles():
    model = DirectDipole()
    r = 7e6
    b = model.b_earth_fixed(model.prepare(2026.0), [[r, 0, 0], [0, r, 0], [0, 0, r], [0, 0, -r]])
    equatorial = 7.812e6 / 7000.0**3
    expected = equatorial * np.array([[0, 0, 1], [0, 0, 1], [0, 0, -2], [0, 0, -2]])
    assert b == pytest.approx(expected, rel=1e-14)


def test_dipole_has_no_divergence_and_no_curl():
    moment, step = (1e6, -2e6, 7.7e6), 1e-3
    for r in RNG.normal(size=(20, 3)):
        r /= np.linalg.norm(r)
        columns = []
        for axis in np.eye(3) * step:
            b = [np.array(b_dipole(moment, tuple(r + k * axis))) for k in (-2, -1, 1, 2)]
            columns.append((b[0] - 8.0 * b[1] + 8.0 * b[2] - b[3]) / (12.0 * step))
        slopes = np.stack(columns, axis=-1)
        assert abs(np.trace(slopes)) < 1e-8 * np.abs(slopes).max()
        assert np.abs(slopes - slopes.T).max() < 1e-8 * np.abs(slopes).max()


def test_strength_along_an_orbit_varies_as_published():
    i = math.radians(51.7)
    assert direct.strength(2e-5, 0.0, i) == pytest.approx(2e-5, rel=1e-15)
    highest = 2e-5 * math.sqrt(1.0 + 3.0 * math.sin(i) ** 2)
    assert direct.strength(2e-5, math.pi / 2.0, i) == pytest.approx(highest, rel=1e-15)


@pytest.mark.parametrize(("source", "year"), [("igrf14", 2025.0), ("wmm2025", 2026.5)])
def test_tilted_dipole_of_a_date(source, year):
    moment = np.array(TiltedDipole(source=source).prepare(year))
    mu_t_km3 = np.linalg.norm(moment) / 1e9
    # today's dipole: 7.69e6 T km^3, pointing south, its northern end near 80.8 N, 72.8 W
    assert mu_t_km3 == pytest.approx(7.69e6, rel=2e-3)
    axis = -moment / np.linalg.norm(moment)
    assert math.degrees(math.asin(axis[2])) == pytest.approx(80.8, abs=0.2)
    assert math.degrees(math.atan2(axis[1], axis[0])) == pytest.approx(-72.8, abs=0.5)


def test_tilted_dipole_of_three_numbers():
    model = TiltedDipole(mu_e_t_km3=7.812e6, tilt_deg=168.3, longitude_deg=107.0)
    moment = np.array(model.prepare(1800.0))
    assert np.linalg.norm(moment) == pytest.approx(7.812e15, rel=1e-15)
    assert math.degrees(math.acos(moment[2] / 7.812e15)) == pytest.approx(168.3, abs=1e-10)
    assert math.degrees(math.atan2(moment[1], moment[0])) == pytest.approx(107.0, abs=1e-10)


def test_tilted_dipole_against_the_axis_is_the_direct_dipole():
    tilted = TiltedDipole(mu_e_t_km3=7.812e6, tilt_deg=180.0, longitude_deg=33.0)
    r = RNG.normal(size=(50, 3)) * 7e6
    b = tilted.b_earth_fixed(tilted.prepare(2026.0), r)
    plain = DirectDipole()
    expected = plain.b_earth_fixed(plain.prepare(2026.0), r)
    assert np.abs(b - expected).max() < 1e-14 * np.abs(expected).max()


def test_tilted_dipole_turns_with_the_earth():
    model, r = TiltedDipole(), RNG.normal(size=(40, 3)) * 7e6
    packed = model.prepare(2026.0)
    dcm = dcm_ecef_to_ned(RNG.uniform(-1.5, 1.5, 40), RNG.uniform(-3.0, 3.0, 40))
    b = model.b_inertial(packed, r, None, dcm)
    expected = model.b_earth_fixed(packed, np.einsum("nij,nj->ni", dcm, r))
    turned = np.einsum("nij,nj->ni", dcm, b)
    assert np.abs(turned - expected).max() < 1e-14 * np.abs(expected).max()


def test_compiled_equals_interpreted():
    moment, r = (1e15, -2e15, -7e15), RNG.normal(size=(5, 3)) * 7e6
    dcm = dcm_ecef_to_ned(RNG.uniform(-1.5, 1.5, 5), RNG.uniform(-3.0, 3.0, 5))
    for kernel, arguments in (
        (b_dipole, (moment, (5e6, 3e6, -4e6))),
        (direct.b_y, (2e-5, 1.2, 0.9)),
        (direct.b_s, (2e-5, 1.2, 0.9)),
        (direct.b_orbital, (2e-5, 1.2, 0.9)),
        (direct.strength, (2e-5, 1.2, 0.9)),
    ):
        assert interpreted(kernel)(*arguments) == pytest.approx(kernel(*arguments), rel=1e-13)
    for kernel, arguments in ((b_dipole_many, (moment, r)), (b_turning_many, (moment, r, dcm))):
        compiled, plain = np.empty((5, 3)), np.empty((5, 3))
        kernel(*arguments, compiled)
        interpreted(kernel)(*arguments, plain)
        assert plain == pytest.approx(compiled, rel=1e-13)


def test_errors_say_what_must_hold():
    line = "must be given together or not at all; received mu_e_t_km3, tilt_deg$"
    with pytest.raises(ValueError, match="mu_e_t_km3, tilt_deg, longitude_deg: must be given tog"):
        TiltedDipole(tilt_deg=168.3)
    with pytest.raises(ValueError) as error:
        TiltedDipole(mu_e_t_km3=7.8e6, tilt_deg=168.3)
    assert line[:-1] in str(error.value)
    for bad in (dict(tilt_deg=181.0), dict(mu_e_t_km3=0.0), dict(longitude_deg=math.inf)):
        whole = dict(mu_e_t_km3=7.8e6, tilt_deg=168.3, longitude_deg=0.0) | bad
        with pytest.raises(ValueError, match=next(iter(bad))):
            TiltedDipole(**whole)
    with pytest.raises(ValueError, match="mu_e_t_km3"):
        DirectDipole(mu_e_t_km3=-1.0)
