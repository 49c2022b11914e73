"""What holds for every field model, and the field at places on the globe."""

import numpy as np
import pytest
from own_parts import field_of
from pydantic import TypeAdapter

from torquer.environment.field import (
    FIELDS,
    AnyField,
    Averaged,
    Igrf14,
    at_geodetic,
    averaged,
    elements,
)
from torquer.maths.geometry.frames import dcm_orbital_to_inertial

RNG = np.random.default_rng(8)
EVERY = pytest.mark.parametrize("kind", FIELDS)
#: Those of the Earth: the coils of a bench give what they are set to.
NATURAL = pytest.mark.parametrize("kind", [kind for kind in FIELDS if kind != "helmholtz_coils"])


def orbit(n, seed=1):
    """Positions, velocities, and turns to Earth-fixed axes, spread at random."""
    rng = np.random.default_rng(seed)
    r = rng.normal(size=(n, 3))
    r *= rng.uniform(6.6e6, 7.5e6, (n, 1)) / np.linalg.norm(r, axis=1)[:, None]
    v = np.cross(rng.normal(size=(n, 3)), r)
    v *= 7.5e3 / np.linalg.norm(v, axis=1)[:, None]
    angle = rng.uniform(0.0, 2.0 * np.pi, n)
    dcm = np.zeros((n, 3, 3))
    dcm[:, 0, 0] = dcm[:, 1, 1] = np.cos(angle)
    dcm[:, 0, 1] = np.sin(angle)
    dcm[:, 1, 0] = -np.sin(angle)
    dcm[:, 2, 2] = 1.0
    return r, v, dcm


@EVERY
def test_kind_is_the_key_and_specs_survive_json(kind, tmp_path):
    model = field_of(kind, tmp_path)
    assert model.kind == kind
    adapter = TypeAdapter(AnyField)
    again = adapter.validate_json(adapter.dump_json(model))
    assert type(again) is type(model) and again == model
    with pytest.raises(ValueError, match="must stay as it is"):
        model.kind = "other"
    with pytest.raises(ValueError, match="kind"):
        FIELDS[kind](kind="other")


@NATURAL
def test_field_is_about_as_strong_as_the_earths(kind, tmp_path):
    model = field_of(kind, tmp_path)
    r, v, dcm = orbit(200)
    kept = r.copy()
    b = model.b_inertial(model.prepare(2026.0), r, v, dcm)
    assert np.array_equal(r, kept)
    assert b.shape == (200, 3) and b.dtype == np.float64 and b is not r
    strength = np.linalg.norm(b, axis=1)
    # 67 uT is the greatest on the ground; 230..1130 km up it is less
    assert strength.min() > 1.2e-5 and strength.max() < 6.7e-5


@EVERY
def test_points_do_not_depend_on_each_other(kind, tmp_path):
    model = field_of(kind, tmp_path)
    packed = model.prepare(2026.0)
    r, v, dcm = orbit(70)
    b = model.b_inertial(packed, r, v, dcm)
    back = model.b_inertial(packed, r[::-1], v[::-1], dcm[::-1])
    assert b == pytest.approx(back[::-1], rel=1e-14)
    for k in (0, 33, 69):
        alone = model.b_inertial(packed, r[k : k + 1], v[k : k + 1], dcm[k : k + 1])
        assert alone[0] == pytest.approx(b[k], rel=1e-13, abs=1e-19)


@EVERY
def test_field_turns_with_earth_and_orbit_about_the_axis(kind, tmp_path):
    """All models keep the Earth's axis: turn orbit and Earth about it, and the field turns."""
    model = field_of(kind, tmp_path)
    packed = model.prepare(2026.0)
    r, v, dcm = orbit(50)
    c, s = np.cos(0.8), np.sin(0.8)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    b = model.b_inertial(packed, r, v, dcm)
    turned = model.b_inertial(packed, r @ turn.T, v @ turn.T, dcm @ turn.T)
    assert np.abs(turned - b @ turn.T).max() < 1e-13 * np.abs(b).max()


@NATURAL
def test_simple_models_resemble_igrf(kind, tmp_path):
    """On a 500 km orbit all stay within 40 % of IGRF, by component (root mean square)."""
    n = 400
    u, raan = np.linspace(0.0, 20.0, n), 0.4
    node = np.array([np.cos(raan), np.sin(raan), 0.0])
    across = np.array([-np.sin(raan) * 0.6, np.cos(raan) * 0.6, 0.8])
    r = 6.87e6 * (np.cos(u)[:, None] * node + np.sin(u)[:, None] * across)
    v = 7.6e3 * (-np.sin(u)[:, None] * node + np.cos(u)[:, None] * across)
    dcm = np.tile(np.eye(3), (n, 1, 1))
    fields = [
        m.b_inertial(m.prepare(2026.0), r, v, dcm) for m in (field_of(kind, tmp_path), Igrf14())
    ]
    error = np.sqrt(np.mean((fields[0] - fields[1]) ** 2, axis=0))
    size = np.sqrt(np.mean(np.sum(fields[1] ** 2, axis=1)))
    assert (error < 0.4 * size).all()


@EVERY
def test_shapes_are_checked_before_compiled_code_runs(kind, tmp_path):
    model = field_of(kind, tmp_path)
    packed = model.prepare(2026.0)
    r, v, dcm = orbit(3)
    with pytest.raises(ValueError, match=r"r_inertial: must have shape \(n, 3\); received shape"):
        model.b_inertial(packed, r[:, :2], v, dcm)
    short = r"must have shape \(3, 3(, 3)?\); received shape \(2, 3(, 3)?\)"
    if kind != "direct_dipole":
        with pytest.raises(ValueError, match=short):
            model.b_inertial(packed, r, v[:2], dcm[:2])


def test_elements_of_known_vectors():
    e = elements(1e-9 * np.array([[3.0, 4.0, 12.0], [-1.0, 0.0, -1.0]]))
    assert e.x_nt == pytest.approx([3.0, -1.0]) and e.y_nt == pytest.approx([4.0, 0.0])
    assert e.z_nt == pytest.approx([12.0, -1.0]) and e.h_nt == pytest.approx([5.0, 1.0])
    assert e.f_nt == pytest.approx([13.0, np.sqrt(2.0)])
    assert e.d_deg == pytest.approx([np.degrees(np.arctan2(4.0, 3.0)), 180.0])
    assert e.i_deg == pytest.approx([np.degrees(np.arctan2(12.0, 5.0)), -45.0])


def test_places_broadcast_and_single_places_are_vectors():
    model = Igrf14()
    lat, lon = np.array([[-30.0], [60.0]]), np.array([0.0, 120.0, 240.0])
    b = at_geodetic(model, 2026.0, lat, lon, 400.0)
    assert b.shape == (2, 3, 3)
    one = at_geodetic(model, 2026.0, 60.0, 120.0, 400.0)
    assert one.shape == (3,)
    assert b[1, 1] == pytest.approx(one, rel=1e-12)


def test_geodetic_and_geocentric_agree_on_the_equator():
    model = Igrf14()
    geodetic = at_geodetic(model, 2026.0, 0.0, 25.0, 300.0)
    sphere_km = 6378.137 - 6371.2 + 300.0
    geocentric = at_geodetic(model, 2026.0, 0.0, 25.0, sphere_km, geocentric=True)
    assert geodetic == pytest.approx(geocentric, rel=1e-12)


def test_dipole_inclination_follows_its_latitude():
    """tan I = 2 tan(latitude) for any axial dipole; declination zero."""
    lat = np.array([-60.0, -10.0, 35.0])
    e = elements(at_geodetic(FIELDS["direct_dipole"](), 2026.0, lat, 77.0, 0.0, geocentric=True))
    assert np.tan(np.radians(e.i_deg)) == pytest.approx(2.0 * np.tan(np.radians(lat)), rel=1e-12)
    assert np.abs(e.d_deg).max() < 1e-12


def test_averaged_field_has_no_place_on_the_globe():
    line = "field model averaged: must have an Earth-fixed form; received one that is defined"
    with pytest.raises(ValueError, match=line):
        at_geodetic(Averaged(), 2026.0, 0.0, 0.0, 0.0)


def test_averaged_field_lies_along_motion_normal_and_up_as_published():
    """The inertial form, seen in X, is FIELD (1.8)."""
    r, v, dcm = orbit(20)
    model = Averaged(b0=3e-5)
    b = model.b_inertial(model.prepare(2026.0), r, v, dcm)
    for row, velocity, field in zip(r, v, b, strict=True):
        h = np.cross(row, velocity)
        h /= np.linalg.norm(h)
        i, node = np.arccos(h[2]), np.cross([0.0, 0.0, 1.0], h)
        u = np.arctan2(row @ np.cross(h, node), row @ node)
        to_x = np.array(dcm_orbital_to_inertial(tuple(row), tuple(velocity))).T
        expected = averaged.b_orbital(3e-5, u, i, averaged.cone_angle(i))
        assert np.abs(to_x @ field - expected).max() < 1e-13 * 3e-5
