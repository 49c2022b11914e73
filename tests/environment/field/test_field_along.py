"""Fields along an orbit: the theory's own formulas, invariants, and frames."""

import numpy as np
import pytest

from torquer.base.time import parse_utc
from torquer.environment.field import (
    Averaged,
    DirectDipole,
    Igrf14,
    TiltedDipole,
    averaged,
    direct_dipole,
)
from torquer.environment.field.along import angles_deg, fields_along
from torquer.environment.orbit import Circular, Kepler

START = parse_utc("2025-07-01T00:00:00Z")
MODELS = (Igrf14(degree=4), DirectDipole(), Averaged(), TiltedDipole())


@pytest.fixture(scope="module")
def orbit():
    return Circular(altitude_km=550.0, inclination_deg=51.7, raan_deg=40.0)


@pytest.fixture(scope="module")
def along(orbit):
    t_s = np.linspace(0.0, 1.4 * orbit.period_s, 41)
    return fields_along(MODELS, orbit, START, t_s, "sidereal")


def test_dipole_and_cone_are_those_of_the_published_formulas(orbit, along):
    i, u = np.radians(orbit.inclination_deg), np.radians(along.u_deg)
    equatorial = 7.812e15 / orbit.radius_m**3
    b0, cone = averaged.mean_of_extremes(equatorial, i), averaged.cone_angle(i)
    expected = {
        "b_y": ([direct_dipole.b_y(equatorial, x, i) for x in u],
                [averaged.b_y(b0, x, cone) for x in u]),
        "b_orbital": ([direct_dipole.b_orbital(equatorial, x, i) for x in u],
                      [averaged.b_orbital(b0, x, i, cone) for x in u]),
    }  # fmt: skip
    for name, vectors in expected.items():
        found = getattr(along, name)[1:3]
        assert np.abs(found - np.array(vectors)).max() < 1e-12 * equatorial, name


def test_argument_of_latitude_runs_evenly_from_the_node(orbit, along):
    turns = along.t_s / orbit.period_s
    assert along.u_deg == pytest.approx(360.0 * (turns % 1.0), abs=1e-7)
    assert along.u_deg[0] == 0.0 and along.u_deg.max() < 360.0
    assert along.lat_deg[0] == pytest.approx(0.0, abs=1e-9)
    assert along.node == pytest.approx([np.cos(np.radians(40.0)), np.sin(np.radians(40.0)), 0.0])


def test_lengths_do_not_depend_on_the_axes(along):
    for vectors in (along.b_inertial, along.b_orbital, along.b_y):
        assert np.linalg.norm(vectors, axis=-1) == pytest.approx(along.strength, rel=1e-13)
    axes = along.axes_of_x
    assert np.einsum("nij,nkj->nik", axes, axes) == pytest.approx(
        np.broadcast_to(np.eye(3), axes.shape), abs=1e-14
    )
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_orbital_axes_are_motion_normal_and_up(along):
    motion, normal, up = np.moveaxis(along.axes_of_x, 1, 0)
    speed = np.linalg.norm(along.v_inertial, axis=1)
    assert np.sum(motion * along.v_inertial, axis=1) == pytest.approx(speed, rel=1e-13)
    assert np.sum(up * along.r_inertial, axis=1) == pytest.approx(6928137.0, rel=1e-13)
    assert normal[:, 2] == pytest.approx(np.cos(np.radians(51.7)))


def test_angle_to_the_first_model(along):
    assert np.all(along.angle_to_first_deg[0] == 0.0)
    a, b = along.b_inertial[0, 7], along.b_inertial[2, 7]
    cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
    assert along.angle_to_first_deg[2, 7] == pytest.approx(np.degrees(np.arccos(cosine)), rel=1e-9)
    assert angles_deg(np.array([1.0, 0.0, 0.0]), np.array([1.0, 1e-9, 0.0])) == pytest.approx(
        np.degrees(1e-9), rel=1e-12
    )


def test_first_degree_along_the_orbit_is_the_tilted_dipole(orbit):
    t_s = np.linspace(0.0, orbit.period_s, 9)
    one = fields_along((Igrf14(degree=1), TiltedDipole()), orbit, START, t_s)
    assert one.angle_to_first_deg[1].max() < 1e-10
    assert one.strength[0] == pytest.approx(one.strength[1], rel=1e-12)


def test_height_and_equatorial_orbit():
    flat = Kepler(perigee_altitude_km=300.0, apogee_altitude_km=900.0, inclination_deg=0.0)
    along = fields_along((DirectDipole(),), flat, START, [0.0, 0.5 * flat.period_s], "sidereal")
    assert along.height_km == pytest.approx([300.0, 900.0], abs=1e-6)
    assert along.node.tolist() == [1.0, 0.0, 0.0]
    assert along.b_orbital[0, :, 1] == pytest.approx(along.strength[0], rel=1e-13)


def test_a_date_outside_the_model_is_one_line(orbit):
    late = parse_utc("2031-01-01T00:00:00Z")
    with pytest.raises(ValueError, match=r"igrf14: date must lie within 1900.0..2030.0"):
        fields_along((Igrf14(),), orbit, late, [0.0])
