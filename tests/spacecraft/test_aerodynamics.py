"""Air on a body: WHEEL's own formula, areas by ray casting, symmetry, every error."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.spacecraft.aerodynamics import Aerodynamics, aerodynamic_force_and_torque, flow
from torquer.spacecraft.disturbance.solar_pressure import SolarPressure
from torquer.spacecraft.parts import Box, Cylinder, Plate, Sphere, box

#: The satellite of WHEEL, section 3: cylinder and panels, centres on the first axis.
FOTON = Aerodynamics(
    parts=(
        Cylinder(axis=(1, 0, 0), radius_m=1.3, length_m=5.0, centre_m=(-1.0, 0, 0)),
        Plate(axis=(0, 0, 1), area_m2=33.0, centre_m=(0.3, 0, 0)),
    )
)
RHO = 4e-12
directions = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)


def unit(v):
    return np.array(v) / np.linalg.norm(v)


def on(body, velocity):
    return aerodynamic_force_and_torque(body.pack(), flow(RHO, tuple(velocity)))


@given(directions)
@settings(max_examples=60, deadline=None)
def test_the_formula_of_the_source(direction):
    v = unit(direction)
    cylinder = math.pi * 1.3**2 * abs(v[0]) + 2 * 1.3 * 5.0 * math.hypot(v[1], v[2])
    panels = 33.0 * abs(v[2])
    pressure = RHO * 7600.0**2
    arm = -1.0 * cylinder + 0.3 * panels
    force, torque = on(FOTON, 7600.0 * v)
    assert np.array(force) == pytest.approx(
        -pressure * (cylinder + panels) * v, rel=1e-12, abs=1e-18
    )
    expected = -pressure * arm * np.cross([1.0, 0.0, 0.0], v)
    assert np.array(torque) == pytest.approx(expected, rel=1e-12, abs=1e-16)
    assert FOTON.area_m2(direction) == pytest.approx(cylinder + panels, rel=1e-12)


@given(directions)
@settings(max_examples=60, deadline=None)
def test_force_brakes_and_torque_is_across_the_flow(direction):
    v = 7600.0 * unit(direction)
    force, torque = on(FOTON, v)
    assert np.dot(force, v) < 0.0
    assert np.linalg.norm(np.cross(force, v)) <= 1e-12 * np.linalg.norm(force) * 7600.0
    assert abs(np.dot(torque, v)) <= 1e-12 * (np.linalg.norm(torque) + 1e-9) * 7600.0


def shadow(inside, direction, extent, n=600):
    """Projected area of a shape by rays: `inside(points)` tells which are within it."""
    v = unit(direction)
    across = unit(np.cross(v, [0.3, -0.5, 0.8]))
    up = np.cross(v, across)
    side = np.linspace(-extent, extent, n)
    hit = np.zeros((n, n), bool)
    for depth in np.linspace(-extent, extent, 161):
        grid = depth * v + side[:, None, None] * across + side[None, :, None] * up
        hit |= inside(grid)
    return hit.sum() * (side[1] - side[0]) ** 2


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 1, 0), (0.6, 0.0, 0.8), (-1, 2, 0.5)])
def test_areas_are_those_that_rays_see(direction):
    cylinder = Aerodynamics(parts=(Cylinder(axis=(0, 0, 2), radius_m=0.5, length_m=1.0),))
    cube = Aerodynamics(parts=box((1.0, 0.6, 0.4)))

    def in_cylinder(p):
        return (np.hypot(p[..., 0], p[..., 1]) < 0.5) & (np.abs(p[..., 2]) < 0.5)

    def in_box(p):
        return np.all(np.abs(p) < [0.5, 0.3, 0.2], axis=-1)

    for body, inside in ((cylinder, in_cylinder), (cube, in_box)):
        seen = shadow(inside, direction, 1.0, n=300)
        assert body.area_m2(direction) == pytest.approx(seen, rel=0.02)


def test_a_box_is_its_six_faces():
    keys = {"size_m": (1.0, 0.6, 0.4), "centre_m": (0.1, 0.0, -0.2), "drag_coefficient": 2.4}
    faces = box(keys["size_m"], keys["centre_m"])
    faces = [face.model_copy(update={"drag_coefficient": 2.4}) for face in faces]
    whole, parted = Aerodynamics(parts=(Box(**keys),)), Aerodynamics(parts=tuple(faces))
    assert whole.pack().rows.tolist() == parted.pack().rows.tolist()
    lit, of_faces = SolarPressure().pack(whole.parts), SolarPressure().pack(parted.parts)
    assert lit.rows.tolist() == of_faces.rows.tolist()
    with pytest.raises(ValueError, match="greater than 0"):
        Box(size_m=(1.0, 0.0, 0.4))


def test_centred_cylinder_and_box_feel_no_torque_along_axes():
    cube = Aerodynamics(parts=box((1.0, 0.6, 0.4)))
    for axis in np.eye(3):
        assert np.abs(on(cube, 7600.0 * axis)[1]).max() < 1e-20


def test_box_faces_lie_on_its_ends_and_look_outwards():
    size, centre = np.array([1.0, 0.6, 0.4]), np.array([0.1, 0.2, -0.3])
    faces = box(tuple(size), tuple(centre))
    assert len({face.axis for face in faces}) == 6
    for face in faces:
        assert face.centre_m == pytest.approx(centre + 0.5 * size * face.axis)


@given(directions)
@settings(max_examples=40, deadline=None)
def test_a_sphere_off_the_centre(direction):
    ball = Aerodynamics(parts=(Sphere(radius_m=0.5, centre_m=(0.1, -0.2, 0.3)),))
    v = 7600.0 * unit(direction)
    force, torque = on(ball, v)
    expected = -RHO * 7600.0 * math.pi * 0.25 * v
    assert np.array(force) == pytest.approx(expected, rel=1e-12)
    assert np.array(torque) == pytest.approx(np.cross([0.1, -0.2, 0.3], expected), abs=1e-15)


def test_drag_coefficient_scales_and_two_is_inelastic():
    plain = Aerodynamics(parts=(Plate(axis=(1, 0, 0), area_m2=2.0),))
    rough = Aerodynamics(parts=(Plate(axis=(1, 0, 0), area_m2=2.0, drag_coefficient=2.6),))
    first, second = (on(body, (7600.0, 0, 0))[0][0] for body in (plain, rough))
    assert first == pytest.approx(-RHO * 7600.0**2 * 2.0)
    assert second / first == pytest.approx(1.3)
    assert rough.area_m2((1, 0, 0)) == pytest.approx(2.0)


def test_a_face_meets_only_what_comes_from_its_side():
    face = Aerodynamics(parts=(Plate(axis=(0, 3, 0), area_m2=1.0, one_sided=True),))
    assert face.area_m2((0, 1, 0)) == pytest.approx(1.0)
    assert face.area_m2((0, -1, 0)) == 0.0
    assert on(face, (0.0, -7600.0, 0.0)) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_still_air_does_nothing():
    assert on(FOTON, (0.0, 0.0, 0.0)) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_the_arrow_turns_into_the_wind():
    """A plate behind the centre of mass: a small angle off the motion is turned back."""
    arrow = Aerodynamics(parts=(Sphere(radius_m=1.0, centre_m=(-1.0, 0, 0)),))
    for angle in (0.01, -0.01):
        _, torque = on(arrow, (7600.0 * math.cos(angle), -7600.0 * math.sin(angle), 0.0))
        assert torque[2] * angle < 0.0


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ({"kind": "plate", "axis": (0, 0, 0), "area_m2": 1}, "axis: must be non-zero vectors"),
        ({"kind": "plate", "axis": (0, 0, 1), "area_m2": 0}, "area_m2"),
        ({"kind": "cylinder", "axis": (0, 0, 1), "radius_m": 1}, "length_m"),
        ({"kind": "sphere", "radius_m": -1}, "radius_m"),
        ({"kind": "sphere", "radius_m": 1, "drag_coefficient": 0}, "drag_coefficient"),
        ({"kind": "cone"}, "cone"),
    ],
)
def test_wrong_parts_are_errors(part, message):
    with pytest.raises(ValueError, match=message):
        Aerodynamics(parts=(part,))


def test_no_parts_and_no_box_are_errors():
    with pytest.raises(ValueError, match="parts"):
        Aerodynamics(parts=())
    with pytest.raises(ValueError, match="size_m: must be positive"):
        box((1.0, 0.0, 1.0))
    with pytest.raises(ValueError, match="direction: must be non-zero"):
        FOTON.area_m2((0, 0, 0))
