"""What a data sheet lacks: inertia, surfaces and dipole from size, mass and class."""

import re

import numpy as np
import pytest

from torquer.design.left_out import (
    centre_covariance,
    equal_box_m,
    exposed_parts,
    masses_of_box,
    residual_dipole_a_m2,
    sheet_rules,
    size_classes,
)
from torquer.design.requests import SheetRequest
from torquer.maths.geometry.vec3 import as_vector
from torquer.spacecraft.aerodynamics import Aerodynamics, aerodynamic_force_and_torque
from torquer.spacecraft.disturbance.solar_pressure import SolarPressure, _torque_by
from torquer.spacecraft.masses import BoxMass, mass_properties

SIZES = ((0.1, 0.1, 0.1135), (0.2263, 0.1, 0.366))


def points_of(edges, centre, mass_kg: float, count: int = 40):
    """Masses [kg] at places (n, 3) that fill a box, or a plate where an edge is 0."""
    axes = [
        np.array([0.0]) if e == 0.0 else ((np.arange(count) + 0.5) / count - 0.5) * e for e in edges
    ]
    places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3) + centre
    return np.full(len(places), mass_kg / len(places)), places


def integrated(masses_places) -> np.ndarray:
    """Inertia (3, 3) about the centre of mass of points, from its definition."""
    masses, places = (np.concatenate(each) for each in zip(*masses_places, strict=True))
    r = places - masses @ places / masses.sum()
    return np.einsum(
        "n,nij->ij",
        masses,
        np.einsum("nk,nk,ij->nij", r, r, np.eye(3)) - r[:, :, None] * r[:, None, :],
    )


@pytest.mark.parametrize("panels", [0, 2, 4])
@pytest.mark.parametrize("size", SIZES)
def test_inertia_is_the_integral_over_box_and_panels(size, panels):
    mass_kg, (x, y, z) = 4.0, size
    each_kg = sheet_rules()["panel"]["mass_per_area"] * y * z
    points = [points_of(size, (0.0, 0.0, 0.0), mass_kg - panels * each_kg)]
    for side in (1, -1):
        points += [
            points_of((y, 0.0, z), (side * (x / 2 + (k + 0.5) * y), y / 2, 0.0), each_kg)
            for k in range(panels // 2)
        ]
    found = mass_properties(masses_of_box(size, mass_kg, panels))
    assert found.mass_kg == pytest.approx(mass_kg)
    assert found.inertia == pytest.approx(integrated(points), rel=1e-3, abs=1e-9)


@pytest.mark.parametrize("panels", [0, 2, 4])
@pytest.mark.parametrize("size", SIZES)
def test_the_equal_box_has_the_same_inertia(size, panels):
    inertia = mass_properties(masses_of_box(size, 4.0, panels)).inertia
    edges = equal_box_m(inertia, 4.0)
    assert BoxMass(mass_kg=4.0, size_m=edges).own_inertia() == pytest.approx(inertia, abs=1e-12)
    assert panels or edges == pytest.approx(size)


def test_thin_walls_have_five_thirds_of_a_solid_cube():
    """What the source of the spread says: six plates of a cube against the cube."""
    walls = []
    for axis in np.eye(3):
        for sign in (0.5, -0.5):
            walls.append(points_of(1.0 - axis, sign * axis, 1.0 / 6.0))
    solid = mass_properties(masses_of_box((1, 1, 1), 1.0)).inertia[0, 0]
    assert integrated(walls)[0, 0] / solid == pytest.approx(5.0 / 3.0, rel=1e-3)
    low, high = sheet_rules()["inertia"]["edges"]
    assert low**2 == pytest.approx(0.81) and high**2 == pytest.approx(1.32, abs=0.003)


def plates_of(size, panels, middle):
    """(area, normal, centre, two sides) of all flat surfaces, from geometry alone."""
    faces = []
    for k in range(3):
        for sign in (1.0, -1.0):
            normal = sign * np.eye(3)[k]
            faces.append((np.prod(size) / size[k], normal, middle + 0.5 * size[k] * normal, False))
    for side in (1, -1):
        for k in range(panels // 2):
            centre = (side * (size[0] / 2 + (k + 0.5) * size[1]), size[1] / 2, 0.0)
            faces.append((size[1] * size[2], np.array([0, 1.0, 0]), middle + centre, True))
    return faces


DIRECTIONS = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.6, 0.48, -0.64))


@pytest.mark.parametrize("towards", DIRECTIONS)
@pytest.mark.parametrize("panels", [0, 2, 4])
def test_air_and_light_push_each_face_where_it_is(panels, towards):
    size, rules, towards = SIZES[1], sheet_rules()["surface"], np.array(towards)
    parts = exposed_parts(size, 8.0, panels)
    middle = -mass_properties(masses_of_box(size, 8.0, panels)).centre_m
    air, light = np.zeros(3), np.zeros(3)
    specular, diffuse = rules["specular_reflectivity"], rules["diffuse_reflectivity"]
    for area, normal, centre, both in plates_of(size, panels, middle):
        cosine = normal @ towards
        facing = normal * np.sign(cosine) if both else normal
        cosine = abs(cosine) if both else max(cosine, 0.0)
        force = -0.5 * rules["drag_coefficient"] * area * cosine * towards
        air += np.cross(centre, force)
        push = (1 - specular) * towards + 2 * (specular * cosine + diffuse / 3) * facing
        light += np.cross(centre, -area * cosine * push)
    surface = Aerodynamics(parts=parts).pack()
    assert aerodynamic_force_and_torque(surface, as_vector(towards))[1] == pytest.approx(air)
    rows = SolarPressure().pack(parts).rows
    assert _torque_by(rows, as_vector(towards)) == pytest.approx(light)
    assert panels or np.abs(air).max() < 1e-15


def test_residual_dipole_goes_with_the_mass_or_is_measured():
    assert residual_dipole_a_m2(4.0) == pytest.approx((0.004, 0.014, 0.04))
    assert residual_dipole_a_m2(4.0, 0.005) == pytest.approx((0.004, 0.005, 0.006))
    assert "NASA SP-8018" in sheet_rules()["dipole"]["source"]


def test_one_shift_moves_all_parts():
    covariance = np.array(centre_covariance((0.01, 0.02, 0.03), 3))
    assert np.linalg.matrix_rank(covariance) == 3
    together = np.kron(np.ones((3, 1)), np.eye(3))
    assert covariance == pytest.approx(together @ np.diag([1e-4, 4e-4, 9e-4]) @ together.T)


def test_classes_are_ordered_complete_and_in_the_help():
    classes = size_classes()
    masses = [each.mass_kg for each in classes.values()]
    assert masses == sorted(masses) and all(each.source for each in classes.values())
    assert all(max(each.size_m) == each.size_m[2] for each in classes.values())
    named = re.search(r"of this size: (.*)\.", SheetRequest.__doc__)[1]
    assert named.split(", ") == [*classes]


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: masses_of_box((0.1, 0.1, 0.0), 1.0), "size_m: must be three positive numbers; re"),
        (lambda: masses_of_box((0.1, 0.1), 1.0), "size_m: must have shape"),
        (lambda: masses_of_box((0.1, 0.1, 0.3), 0.1, 2), "mass_kg: must be above 0.18 kg, the mas"),
        (lambda: masses_of_box((0.1, 0.1, 0.3), 4.0, 3), "panels: must be an even number, 0 or mo"),
        (lambda: exposed_parts((0.1, -0.1, 0.3), 4.0), "size_m: must be three positive numbers; r"),
        (lambda: equal_box_m([[1, 0.1, 0], [0.1, 1, 0], [0, 0, 1]], 1), "inertia: must have no "),
        (lambda: equal_box_m([1, 1, 3], 1), "inertia: the sum of two principal"),
    ],
)  # fmt: skip
def test_refusals(call, says):
    with pytest.raises(ValueError, match=f"^{re.escape(says)}"):
        call()
