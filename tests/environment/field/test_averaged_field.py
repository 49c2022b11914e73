"""Averaged field: the cone, its strength, its forms in all frames, its distance to the dipole."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.special import ellipe

from torquer.environment.field import Averaged, averaged as avg, direct_dipole as direct
from torquer.maths.geometry.frames import dcm_orbital_to_inertial, dcm_s_to_y, dcm_z_to_y, rot_z
from torquer.maths.geometry.vec3 import mat_vec

ANGLES = st.floats(0.0, 2.0 * math.pi)
INCLINATIONS = st.floats(0.0, math.pi)
GRID = np.radians(np.linspace(0.0, 90.0, 901))


def interpreted(kernel):
    """The plain Python behind a kernel (the kernel itself where compilation is off)."""
    return getattr(kernel, "py_func", kernel)


def angle_deg(a, b):
    """Angle between two vectors, good for small ones too."""
    return math.degrees(math.atan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def x_to_s(u):
    """Orbital axes in S, of the position and velocity there."""
    c, s = math.cos(u), math.sin(u)
    return dcm_orbital_to_inertial((c, s, 0.0), (-s, c, 0.0))


def close(a, b):
    """Vectors of length about one equal to rounding."""
    return np.abs(np.subtract(a, b)).max() < 1e-14


@settings(max_examples=100, deadline=None)
@given(u=ANGLES, i=INCLINATIONS)
def test_forms_agree_through_the_frame_turns(u, i):
    cone = avg.cone_angle(i)
    in_z, in_y = avg.b_z(1.0, u, cone), avg.b_y(1.0, u, cone)
    in_s = avg.b_s(1.0, u, i, cone)
    assert np.linalg.norm(in_z) == pytest.approx(1.0, rel=1e-14)
    assert close(in_y, mat_vec(dcm_z_to_y(cone), in_z))
    assert close(in_y, mat_vec(dcm_s_to_y(i), in_s))
    assert close(in_s, mat_vec(x_to_s(u), avg.b_orbital(1.0, u, i, cone)))


@settings(max_examples=100, deadline=None)
@given(i=st.floats(0.0, math.radians(89.0)))
def test_cone_angle_is_the_published_quotient(i):
    s = math.sin(i)
    quotient = 3.0 * math.sin(2.0 * i) / (2.0 * (1.0 - 3.0 * s * s + math.sqrt(1.0 + 3.0 * s * s)))
    assert avg.cone_angle(i) == pytest.approx(math.atan(quotient), rel=1e-11, abs=1e-15)


def test_cone_angle_of_known_orbits():
    assert math.degrees(avg.cone_angle(math.radians(51.7))) == pytest.approx(60.08, abs=0.005)
    assert avg.cone_angle(0.0) == 0.0
    assert avg.cone_angle(math.pi / 2.0) == pytest.approx(math.pi / 2.0, abs=1e-15)
    for i in GRID:
        assert avg.cone_angle(math.pi - i) == pytest.approx(math.pi - avg.cone_angle(i), abs=1e-14)


def test_cone_exceeds_inclination_by_less_than_ten_degrees():
    ahead = np.degrees([avg.cone_angle(i) - i for i in GRID])
    assert ahead.min() >= 0.0
    assert ahead.max() == pytest.approx(9.7356, abs=1e-4)
    assert math.degrees(GRID[ahead.argmax()]) == pytest.approx(35.3, abs=0.11)


@settings(max_examples=50, deadline=None)
@given(i=INCLINATIONS)
def test_cone_touches_dipole_field_at_and_farthest_from_the_equator(i):
    cone = avg.cone_angle(i)
    for u in (0.0, math.pi / 2.0, math.pi, -math.pi / 2.0):
        assert angle_deg(avg.b_y(1.0, u, cone), direct.b_y(1.0, u, i)) < 1e-12


def deviation_from_cone_deg(i):
    """Angle of the direct dipole's vector to the cone's axis, less Theta, along the orbit."""
    cone = avg.cone_angle(i)
    axis = (0.0, -math.sin(cone), math.cos(cone))
    orbit = np.linspace(0.0, math.pi, 401)
    return np.array([angle_deg(axis, direct.b_y(1.0, u, i)) for u in orbit]) - math.degrees(cone)


def test_dipole_field_stays_outside_and_close_to_the_cone():
    """FIELD figure 5, MAG figure 1.2.2: never inside; at most 1.09 deg, at 52 deg."""
    degrees = np.arange(0.0, 91.0, 2.0)
    greatest = []
    for i in np.radians(degrees):
        deviation = deviation_from_cone_deg(i)
        assert deviation.min() > -1e-10
        greatest.append(deviation.max())
    assert max(greatest) == pytest.approx(1.091, abs=1e-3)
    assert degrees[np.argmax(greatest)] == 52.0


@pytest.mark.parametrize("degrees", [20.0, 51.7, 82.5, 98.0])
def test_second_moments_are_diagonal_in_z(degrees):
    cone = avg.cone_angle(math.radians(degrees))
    orbit = np.arange(16) * (2.0 * math.pi / 16)
    b = np.array([avg.b_z(3e-5, u, cone) for u in orbit])
    p = math.sin(cone) ** 2 / 2.0
    expected = 9e-10 * np.diag([p, p, 1.0 - 2.0 * p])
    assert np.abs(b.T @ b / 16 - expected).max() < 1e-24


def test_mean_strengths():
    for i in GRID[::50]:
        s = math.sin(i)
        integral = 2.0 / math.pi * ellipe(-3.0 * s * s)
        assert avg.mean_over_orbit(1.0, i) == pytest.approx(integral, rel=1e-15)
        ends = [direct.strength(2e-5, u, i) for u in (0.0, math.pi / 2.0)]
        assert avg.mean_of_extremes(2e-5, i) == pytest.approx(sum(ends) / 2.0, rel=1e-15)


@pytest.mark.parametrize(("radius_km", "most_nt"), [(6371.2, 1079.7), (6378.137, 1076.4)])
def test_both_means_differ_most_on_the_polar_orbit(radius_km, most_nt):
    """FIELD figure 3, 350 km: the text says about 1250 nT; (1.10) and (1.11) give 1080 nT above the
    mean radius, 1076 nT above the equatorial one, 2.7 %.
    """
    equatorial = 7.812e6 / (radius_km + 350.0) ** 3
    integral = np.array([avg.mean_over_orbit(equatorial, i) for i in GRID])
    difference = 1e9 * (integral - [avg.mean_of_extremes(equatorial, i) for i in GRID])
    assert difference.argmax() == len(GRID) - 1
    assert difference[-1] == pytest.approx(most_nt, abs=0.1)
    assert difference[-1] < 1250.0
    assert difference[-1] * 1e-9 / integral[-1] == pytest.approx(0.0272, abs=1e-4)


@settings(max_examples=50, deadline=None)
@given(u=ANGLES, i=INCLINATIONS)
def test_printed_cosine_holds_for_cone_as_wide_as_inclination(u, i):
    dipole = np.array(direct.b_y(1.0, u, i))
    cosine = np.dot(avg.b_y(1.0, u, i), dipole) / np.linalg.norm(dipole)
    assert avg.cos_to_direct_dipole(u, i) == pytest.approx(cosine, abs=1e-14)


def test_printed_cosine_has_its_plateau():
    """FIELD (1.12), figure 6: acos(2 sqrt 2 / 3) = 19.47 deg above 35 deg of inclination."""
    for degrees in (35.3, 45.0, 60.0, 90.0):
        s = math.sin(math.radians(degrees))
        u = math.asin(1.0 / (math.sqrt(3.0) * s))
        zeta = math.degrees(math.acos(avg.cos_to_direct_dipole(u, math.radians(degrees))))
        assert zeta == pytest.approx(19.4712, abs=1e-4)
        for aside in (-0.05, 0.05):
            other = avg.cos_to_direct_dipole(u + aside, math.radians(degrees))
            assert other > avg.cos_to_direct_dipole(u, math.radians(degrees))


@pytest.mark.parametrize(
    ("degrees", "greatest"), [(20.0, 2.070), (51.7, 12.963), (82.5, 19.211), (90.0, 19.471)]
)
def test_true_angle_to_the_dipole_field_has_no_plateau(degrees, greatest):
    """With the cone of MAG (1.2.1) the greatest angle grows to the plateau's value at the pole."""
    i = math.radians(degrees)
    cone = avg.cone_angle(i)
    zeta = [
        angle_deg(avg.b_y(1.0, u, cone), direct.b_y(1.0, u, i))
        for u in np.linspace(0.0, math.pi, 2001)
    ]
    assert max(zeta) == pytest.approx(greatest, abs=1e-3)


def circular_state(raan, i, u):
    """Position and direction of motion in the inertial frame, from the frame turns."""
    turn = np.array(rot_z(raan)) @ np.array(dcm_s_to_y(i)) @ np.array(x_to_s(u))
    return 7e6 * turn[:, 2], 7.5e3 * turn[:, 0]


@settings(max_examples=100, deadline=None)
@given(raan=ANGLES, i=st.floats(0.001, math.pi - 0.001), u=ANGLES)
@pytest.mark.parametrize("b0", ["arithmetic", "integral", 2.656e-5])
def test_inertial_form_finds_the_orbit_plane(b0, raan, i, u):
    model = Averaged(b0=b0)
    r, v = circular_state(raan, i, u)
    # a radial part of the velocity (an ellipse) leaves the plane, and so the field, as they are
    b = model.b_inertial(model.prepare(2026.0), [r], [v + 3e-5 * r], None)[0]
    equatorial = 7.812e15 / 7e6**3
    strength = {
        "arithmetic": avg.mean_of_extremes(equatorial, i),
        "integral": avg.mean_over_orbit(equatorial, i),
        2.656e-5: 2.656e-5,
    }[b0]
    expected = mat_vec(rot_z(raan), avg.b_y(strength, u, avg.cone_angle(i)))
    assert np.abs(b - expected).max() < 1e-11 * strength


@pytest.mark.parametrize("i", [0.0, math.pi])
def test_equatorial_orbits_have_a_field_along_the_axis(i):
    model = Averaged(b0=3e-5)
    states = [circular_state(0.0, i, u) for u in (0.0, 1.0, 2.5)]
    # exactly equatorial: without the rounding of sin(pi)
    r, v = (np.array([state[k] for state in states]) * [1.0, 1.0, 0.0] for k in (0, 1))
    b = model.b_inertial(model.prepare(2026.0), r, v, None)
    assert b == pytest.approx(np.array([[0.0, 0.0, 3e-5]] * 3), abs=1e-19)


def test_compiled_equals_interpreted():
    field = Averaged(b0="integral").prepare(2026.0)
    for kernel, arguments in (
        (avg.cone_angle, (0.9,)),
        (avg.mean_of_extremes, (2e-5, 0.9)),
        (avg.mean_over_orbit, (2e-5, 0.9)),
        (avg.b_z, (2e-5, 1.2, 0.9)),
        (avg.b_y, (2e-5, 1.2, 0.9)),
        (avg.b_s, (2e-5, 1.2, 0.9, 1.0)),
        (avg.b_orbital, (2e-5, 1.2, 0.9, 1.0)),
        (avg.cos_to_direct_dipole, (1.2, 0.9)),
        (avg.mean_strength, (field, 7e6, 0.9)),
        (avg.b_inertial, (field, (5e6, 3e6, -4e6), (1e3, 5e3, 3e3))),
    ):
        assert interpreted(kernel)(*arguments) == pytest.approx(kernel(*arguments), rel=1e-13)
    r, v = np.array([[5e6, 3e6, -4e6]]), np.array([[1e3, 5e3, 3e3]])
    out = np.empty((1, 3))
    interpreted(avg.b_inertial_many)(field, r, v, out)
    assert out[0] == pytest.approx(avg.b_inertial(field, tuple(r[0]), tuple(v[0])), rel=1e-13)


@pytest.mark.parametrize("bad", ["geometric", 0.0, -1e-5, True, math.nan, math.inf])
def test_strength_is_a_rule_or_a_positive_number(bad):
    line = r"b0: must be 'arithmetic', 'integral' or a positive number \(T\); received "
    with pytest.raises(ValueError, match=line):
        Averaged(b0=bad)
