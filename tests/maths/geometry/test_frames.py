"""Frames: axes where the conventions put them, against scipy and erfa, geodetic round trips."""

import math

import erfa
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer.base.conventions import EARTH_FLATTENING, EARTH_RADIUS_M
from torquer.environment.orbit import Circular
from torquer.maths.geometry import euler, frames

ANGLES = (0.0, 0.4, 1.9, -2.6, math.pi)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("axis", "xyz")
def test_elementary_turns_equal_scipy(axis, angle):
    ours = getattr(frames, f"rot_{axis}")(angle)
    assert np.allclose(ours, Rotation.from_euler(axis, angle).as_matrix(), rtol=0, atol=1e-15)


def test_product_and_transpose_equal_numpy():
    m, n = np.random.default_rng(2).normal(size=(2, 3, 3))
    rows = [tuple(map(tuple, a.tolist())) for a in (m, n)]
    assert np.allclose(frames.mat_mul(*rows), m @ n, rtol=1e-14)
    assert np.array_equal(frames.transpose(rows[0]), m.T)


def test_axes_of_the_cone_and_orbit_frames():
    angle = 1.0486
    z3 = np.array(frames.dcm_z_to_y(angle))[:, 2]
    assert np.array_equal(z3, (0.0, -math.sin(angle), math.cos(angle)))
    z2 = np.array(frames.dcm_z_to_y(angle))[:, 1]
    assert np.array_equal(z2, (0.0, math.cos(angle), math.sin(angle)))


@pytest.mark.parametrize("u", ANGLES)
def test_chain_of_orbit_frames_equals_position_and_velocity(u):
    raan, inclination = 5.1, 0.9
    chain = np.array(frames.rot_z(raan)) @ np.array(frames.dcm_s_to_y(inclination))
    r_s, v_s = (math.cos(u), math.sin(u), 0.0), (-math.sin(u), math.cos(u), 0.0)
    r, v = tuple(7e6 * chain @ r_s), tuple(7.5e3 * chain @ v_s)
    axes_in_s = np.transpose([v_s, (0.0, 0.0, 1.0), r_s])
    x_to_j = frames.dcm_orbital_to_inertial(r, v)
    assert np.allclose(x_to_j, chain @ axes_in_s, rtol=0, atol=1e-15)


def test_orbital_frame_off_a_circle():
    r, v = (7.0e6, 1.0e5, -2.0e6), (-300.0, 7.1e3, 2.0e3)
    x = np.array(frames.dcm_orbital_to_inertial(r, v))
    assert np.allclose(x @ x.T, np.eye(3), rtol=0, atol=1e-15)
    assert np.linalg.det(x) == pytest.approx(1.0, abs=1e-14)
    assert np.allclose(x[:, 2], np.array(r) / np.linalg.norm(r), rtol=0, atol=1e-15)
    assert np.dot(x[:, 1], np.cross(r, v)) > 0.0 and np.dot(x[:, 0], v) > 0.0


@pytest.mark.parametrize("inclination_deg", [0.0, 30.0, 90.0, 150.0])
@pytest.mark.parametrize("angle_deg", [-170.0, 0.0, 20.0, 100.0])
def test_argument_of_latitude_from_state_matches_the_orbit(inclination_deg, angle_deg):
    """On an equatorial orbit it counts from axis 1."""
    keys = {"altitude_km": 500.0, "inclination_deg": inclination_deg}
    raan = 0.0 if inclination_deg == 0.0 else 70.0
    orbit = Circular(**keys, raan_deg=raan, argument_of_latitude_deg=angle_deg)
    r, v = orbit.state(np.zeros(1))
    found = math.degrees(frames.argument_of_latitude(r[0], 3.0 * v[0]))
    assert found == pytest.approx(angle_deg, abs=1e-9)


def test_angular_momentum_frame():
    rho, sigma = 0.8, -2.1
    q = np.array(frames.dcm_l_to_z(rho, sigma))
    along = (math.sin(rho) * math.cos(sigma), math.sin(rho) * math.sin(sigma), math.cos(rho))
    assert np.allclose(q[:, 2], along, rtol=0, atol=1e-15)
    assert q[2, 1] == 0.0  # L2 is parallel to the plane Z1 Z2
    # SDOT (1.2), printed as MAG (1.3.1)
    printed = [
        [math.cos(rho) * math.cos(sigma), -math.sin(sigma), math.sin(rho) * math.cos(sigma)],
        [math.cos(rho) * math.sin(sigma), math.cos(sigma), math.sin(rho) * math.sin(sigma)],
        [-math.sin(rho), 0.0, math.cos(rho)],
    ]
    assert np.allclose(q, printed, rtol=0, atol=1e-15)


def test_the_body_in_the_momentum_frame_equals_its_euler_sequence():
    phi, psi, theta = 0.3, 1.1, 2.0
    expected = euler.to_dcm("313", (psi, theta, phi))
    assert np.allclose(frames.dcm_body_to_l(phi, psi, theta), expected, rtol=0, atol=1e-15)
    (cf, sf), (cs, ss), (ct, st) = ((math.cos(x), math.sin(x)) for x in (phi, psi, theta))
    printed = [  # SDOT (1.3)
        [cf * cs - ct * sf * ss, -sf * cs - ct * cf * ss, st * ss],
        [cf * ss + ct * sf * cs, -sf * ss + ct * cf * cs, -st * cs],
        [st * sf, st * cf, ct],
    ]
    assert np.allclose(expected, printed, rtol=0, atol=1e-15)
    third = (math.sin(phi) * math.sin(theta), math.cos(phi) * math.sin(theta), math.cos(theta))
    assert np.allclose(expected[2], third, rtol=0, atol=1e-15)


def geodetic_grid():
    lat = np.concatenate([[-np.pi / 2, np.pi / 2, 0.0, 1e-9, np.pi / 2 - 1e-9],
                          np.linspace(-1.57, 1.57, 181)])  # fmt: skip
    lon = np.array([-3.1, -0.4, 0.0, 2.2])
    height = np.array([-1e4, 0.0, 5e4, 3.5e5, 6e5, 2e6, 3.6e7])
    return np.meshgrid(lat, lon, height, indexing="ij")


def test_geodetic_round_trip():
    lat, lon, height = geodetic_grid()
    back = frames.geodetic_from_ecef(frames.ecef_from_geodetic(lat, lon, height))
    assert np.abs(back[0] - lat).max() < 1e-14
    assert np.abs(back[2] - height)[height < 1e7].max() < 1e-8
    off_axis = np.abs(lat) < 1.5707
    assert np.abs(back[1] - lon)[off_axis].max() < 1e-12


def test_geodetic_equals_erfa():
    lat, lon, height = geodetic_grid()
    r = frames.ecef_from_geodetic(lat, lon, height)
    assert np.abs(r - erfa.gd2gc(1, lon, lat, height)).max() < 1e-7
    _, lat_e, height_e = erfa.gc2gd(1, r)
    ours = frames.geodetic_from_ecef(r)
    # erfa's single step loses digits with height: itself off by 3e-12 rad at 2000 km
    assert np.abs(ours[0] - lat_e)[height < 1e6].max() < 1e-12
    assert np.abs(ours[0] - lat_e)[height < 1e7].max() < 5e-12
    assert np.abs(ours[2] - height_e)[height < 1e7].max() < 1e-6


def test_poles_and_equator_are_exact():
    polar = EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING)
    lat, lon, height = frames.geodetic_from_ecef(
        [[0.0, 0.0, polar + 5e5], [0.0, 0.0, -polar - 5e5], [0.0, EARTH_RADIUS_M + 7e5, 0.0]]
    )
    assert np.array_equal(lat, (np.pi / 2, -np.pi / 2, 0.0))
    assert np.array_equal(lon, (0.0, 0.0, np.pi / 2))
    assert np.abs(height - (5e5, 5e5, 7e5)).max() < 2e-9


@settings(max_examples=100, deadline=None)
@given(st.floats(-np.pi / 2, np.pi / 2), st.floats(-np.pi, np.pi), st.floats(5e4, 2e6))
def test_down_is_the_gradient_of_height(lat, lon, height):
    r = frames.ecef_from_geodetic(lat, lon, height)
    ned = frames.dcm_ecef_to_ned(lat, lon)
    assert np.allclose(ned @ ned.T, np.eye(3), rtol=0, atol=1e-14)
    assert np.linalg.det(ned) == pytest.approx(1.0, abs=1e-13)
    lower = frames.geodetic_from_ecef(r + 1000.0 * ned[2])
    assert abs(lower[2] - (height - 1000.0)) < 1e-6 and abs(lower[0] - lat) < 1e-12
    # east keeps latitude and height to first order
    east = frames.geodetic_from_ecef(r + 1.0 * ned[1])
    assert abs(east[2] - height) < 1e-6
    # north raises the latitude, by one metre over the radius of curvature
    if abs(lat) < 1.57:
        north = frames.geodetic_from_ecef(r + 1.0 * ned[0])
        assert 1.0 / 8.5e6 < north[0] - lat < 1.0 / 6.3e6


def test_north_east_down_shapes():
    assert frames.dcm_ecef_to_ned(np.zeros((4, 5)), 0.1).shape == (4, 5, 3, 3)
    assert np.array_equal(frames.dcm_ecef_to_ned(0.0, 0.0), [[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
