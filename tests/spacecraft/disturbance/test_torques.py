"""Disturbance torques: what holds of all of them, and each against a plain twin and its physics."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats
from scipy.spatial.transform import Rotation

from torquer.base import noise
from torquer.compile.engine import kernel
from torquer.environment.local import LocalEnvironment
from torquer.spacecraft.body import Body
from torquer.spacecraft.disturbance import TORQUES, Disturbance
from torquer.spacecraft.disturbance.acting import add_torques
from torquer.spacecraft.disturbance.eddy_currents import EddyCurrents
from torquer.spacecraft.disturbance.energy_sink import EnergySink
from torquer.spacecraft.disturbance.held import NO_HELD_TORQUE
from torquer.spacecraft.disturbance.residual_dipole import ResidualDipole
from torquer.spacecraft.disturbance.solar_pressure import SolarPressure
from torquer.spacecraft.disturbance.unmodelled import (
    CELLS,
    Harmonics,
    UnmodelledTorque,
    draw_coefficients,
    next_jump,
)
from torquer.spacecraft.parts import Cylinder, Plate, Sphere, box

#: Pressure of sunlight in these tests [Pa].
P = 4.5e-6
ZERO = (0.0, 0.0, 0.0)
parts = st.floats(-1.0, 1.0)
vectors = st.tuples(parts, parts, parts)
directions = vectors.filter(lambda v: np.linalg.norm(v) > 0.1)
angles = st.floats(-100.0, 100.0)


def unit(v):
    return np.array(v) / np.linalg.norm(v)


def here(b=ZERO, light=ZERO, angle=0.0):
    """Surroundings in body axes."""
    vectors = (tuple(np.array(v, dtype=float).tolist()) for v in (b, light))
    b, light = vectors
    return LocalEnvironment(b, ZERO, (), light, (float(angle),))


def torque(name, constants, environment, omega=ZERO):
    return np.array(TORQUES[name].kernel(constants, environment, tuple(map(float, omega))))


# ------------------------------------------------------------------ all torques

HARMONICS = ((1e-6, -2e-6, 0.5e-6), (3e-6, 1e-6, 0.0), ZERO, (0.0, 1e-6, -1e-6), (2e-6, 0.0, 1e-6))


def turned(turn: Rotation, *vectors):
    return [tuple(turn.apply(v).tolist()) for v in vectors]


def solar(turn):
    axis, centre = turned(turn, (0.0, 0.6, 0.8), (0.2, -0.1, 0.3))
    optics = {"specular_reflectivity": 0.3, "diffuse_reflectivity": 0.2, "centre_m": centre}
    made = (
        Plate(axis=axis, area_m2=0.7, **optics),
        Plate(axis=axis, area_m2=0.3, one_sided=True, **optics),
        Cylinder(axis=axis, radius_m=0.4, length_m=1.1, **optics),
        Sphere(radius_m=0.3, **optics),
    )
    return SolarPressure(parts=made).pack(())


def dipole(turn):
    constant, swing = turned(turn, (0.1, -0.2, 0.3), (-0.2, 0.1, 0.1))
    return ResidualDipole(
        constant_a_m2=constant, amplitude_a_m2=swing, cycles_per_orbit=0.5, phase_deg=20.0
    ).pack(())


def eddies(turn):
    m = turn.as_matrix() @ np.diag([2e3, 1e3, 5e3]) @ turn.as_matrix().T
    tensor = tuple(map(tuple, (0.5 * (m + m.T)).tolist()))
    return EddyCurrents(damping_n_m_s_per_t2=tensor).pack(())


def sink(turn):
    tensors = [turn.as_matrix() @ np.diag(each) @ turn.as_matrix().T
               for each in ([3e-4, 1e-4, 2e-4], [1e-5, 3e-5, 2e-5])]  # fmt: skip
    inertia, damper = (tuple(map(tuple, (0.5 * (m + m.T)).tolist())) for m in tensors)
    momentum = turned(turn, (1e-6, -2e-6, 5e-7))[0]
    body = Body(inertia_kg_m2=inertia, wheel_momentum_n_m_s=momentum)
    return EnergySink(damper_kg_m2=damper, time_constant_s=0.5).pack((), body)


def harmonics(turn):
    return Harmonics(1.0, *turned(turn, *HARMONICS))


#: Constants of each torque, of a body whose axes are turned.
EXAMPLES = {
    "solar_pressure": solar,
    "residual_dipole": dipole,
    "eddy_currents": eddies,
    "energy_sink": sink,
    "unmodelled": harmonics,
}
STRAIGHT = Rotation.identity()


def test_every_torque_has_its_example_and_its_key():
    """The unmodelled torque stands last, as `with_coefficients` takes it."""
    assert list(TORQUES) == list(EXAMPLES)
    assert list(TORQUES)[-1] == "unmodelled"
    assert set(TORQUES) <= set(Disturbance.model_fields)
    for name, each in TORQUES.items():
        assert type(EXAMPLES[name](STRAIGHT)) is type(each.none)


@pytest.mark.parametrize("name", TORQUES)
@given(directions, directions, vectors, angles)
@settings(max_examples=30, deadline=None)
def test_torques_do_not_depend_on_the_choice_of_body_axes(name, b, light, omega, angle):
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7])
    b, light, omega = 4e-5 * unit(b), P * unit(light), 0.1 * np.array(omega)
    one = torque(name, EXAMPLES[name](STRAIGHT), here(b, light, angle), omega)
    environment = here(turn.apply(b), turn.apply(light), angle)
    other = torque(name, EXAMPLES[name](turn), environment, turn.apply(omega))
    assert np.all(np.isfinite(one))
    assert other == pytest.approx(turn.apply(one), rel=0.0, abs=1e-19)


@pytest.mark.parametrize("name", TORQUES)
def test_without_its_cause_there_is_no_torque(name):
    """None of its kind, no field, no light, no rotation."""
    sunlit_fraction = here((2e-5, -3e-5, 1e-5), (P, 0.0, 0.0), 0.7)
    assert np.array_equal(torque(name, TORQUES[name].none, sunlit_fraction, (0.1, 0.2, 0.3)), ZERO)
    causes = {
        "solar_pressure": here((2e-5, -3e-5, 1e-5)),
        "residual_dipole": here(light=(P, 0.0, 0.0)),
        "eddy_currents": sunlit_fraction,
        "energy_sink": sunlit_fraction,
        "unmodelled": None,
    }
    if causes[name]:
        assert np.array_equal(torque(name, EXAMPLES[name](STRAIGHT), causes[name]), ZERO)
        assert (
            np.linalg.norm(torque(name, EXAMPLES[name](STRAIGHT), sunlit_fraction, (0.1, 0.2, 0.3)))
            > 1e-9
        )


def test_torques_add_up():
    environment, omega = here((2e-5, -3e-5, 1e-5), (P, 1e-6, 0.0), 0.7), (0.1, 0.2, 0.3)
    constants = tuple(make(STRAIGHT) for make in EXAMPLES.values())
    each = [torque(name, c, environment, omega) for name, c in zip(TORQUES, constants, strict=True)]
    start = np.array([1e-6, 2e-6, 3e-6])
    total = sum_of_all(tuple(start.tolist()), constants, environment, omega)
    assert total == pytest.approx(start + np.sum(each, axis=0), rel=1e-14)


@kernel
def sum_of_all(start, constants, environment, omega):
    return add_torques(start, constants, environment, omega)


def test_a_table_of_disturbances_packs_what_it_has():
    assert Disturbance().pack(()) == ()
    assert Disturbance().pack_held(3) == NO_HELD_TORQUE
    one = Disturbance(eddy_currents={"damping_n_m_s_per_t2": 1.0}).pack(())
    others = [*TORQUES.values()][1:]
    kept = [packed == torque.none for packed, torque in zip(one[1:], others, strict=True)]
    assert kept == [True, False, True, True]
    given_parts = Disturbance(solar_pressure={}).pack((Sphere(radius_m=0.5, centre_m=(1, 0, 0)),))
    assert len(given_parts[0].rows) == 1


# ------------------------------------------------------------------ solar pressure


def on_facets(to_sun, normals, areas, places, specular, diffuse):
    """Force and torque of light on small facets, each by the law of a flat plate."""
    cosine = np.maximum(normals @ to_sun, 0.0)
    straight = (1.0 - specular) * to_sun
    outwards = 2.0 * (specular * cosine + diffuse / 3.0)[:, None] * normals
    forces = -P * (areas * cosine)[:, None] * (straight + outwards)
    return forces.sum(axis=0), np.cross(places, forces).sum(axis=0)


def facets_of(part, n=300):
    """Normals, areas and places of a fine mesh of a part."""
    azimuth = (np.arange(2 * n) + 0.5) * np.pi / n
    if isinstance(part, Sphere):
        z, a = np.meshgrid((np.arange(n) + 0.5) * 2.0 / n - 1.0, azimuth, indexing="ij")
        rho = np.sqrt(1.0 - z**2)
        normals = np.stack([rho * np.cos(a), rho * np.sin(a), z], axis=-1).reshape(-1, 3)
        areas = np.full(len(normals), 4.0 * np.pi * part.radius_m**2 / len(normals))
        return normals, areas, part.radius_m * normals + part.centre_m
    axis = np.array(part.axis)
    across = unit(np.cross(axis, [0.3, -0.5, 0.8]))
    beside = np.cross(axis, across)
    if isinstance(part, Plate):
        normals = np.array([axis] if part.one_sided else [axis, -axis])
        areas = np.full(len(normals), part.area_m2)
        return normals, areas, np.tile(part.centre_m, (len(normals), 1))
    out = np.cos(azimuth)[:, None] * across + np.sin(azimuth)[:, None] * beside
    side = 2.0 * np.pi * part.radius_m * part.length_m / len(out)
    end = np.pi * part.radius_m**2
    normals = np.vstack([out, axis, -axis])
    areas = np.r_[np.full(len(out), side), end, end]
    places = np.vstack(
        [part.radius_m * out, 0.5 * part.length_m * axis, -0.5 * part.length_m * axis]
    )
    return normals, areas, places + part.centre_m


def force_on(part, to_sun):
    """Force on a part, from its torques about three points."""
    arms = np.eye(3)
    torques = []
    for arm in arms:
        packed = SolarPressure(parts=(part.model_copy(update={"centre_m": arm}),)).pack(())
        torques.append(torque("solar_pressure", packed, here(light=P * np.array(to_sun))))
    # e_k x F for the unit vectors e_k
    return np.array([torques[2][1], torques[0][2], torques[1][0]])


OPTICS = {"specular_reflectivity": 0.45, "diffuse_reflectivity": 0.25}
SHAPES = (
    Plate(axis=(0.0, 0.6, 0.8), area_m2=0.7, centre_m=(0.2, 0.1, -0.3), **OPTICS),
    Plate(axis=(0.0, 0.6, 0.8), area_m2=0.7, one_sided=True, centre_m=(0.2, 0.0, 0.0), **OPTICS),
    Cylinder(axis=(1.0, 2.0, 2.0), radius_m=0.4, length_m=1.1, centre_m=(0.2, 0.1, -0.3), **OPTICS),
    Sphere(radius_m=0.3, centre_m=(0.2, 0.1, -0.3), **OPTICS),
)


@pytest.mark.parametrize("part", SHAPES, ids=lambda part: part.kind)
@given(directions)
@settings(max_examples=25, deadline=None)
def test_light_on_a_part_is_that_on_its_facets(part, sun):
    to_sun = unit(sun)
    force, moment = on_facets(to_sun, *facets_of(part), *OPTICS.values())
    size = P * sum(part.areas_m2())
    assert force_on(part, to_sun) == pytest.approx(force, rel=0.0, abs=1e-4 * size)
    found = torque("solar_pressure", SolarPressure(parts=(part,)).pack(()), here(light=P * to_sun))
    assert found == pytest.approx(moment, rel=0.0, abs=1e-4 * size)


def test_forces_in_closed_form():
    """Black sphere P pi r^2; mirror facing the Sun 2 P A; black plate P A cos, along the light."""
    sun = unit((1.0, -2.0, 0.5))
    black, grey = Sphere(radius_m=0.5), Sphere(radius_m=0.5, diffuse_reflectivity=1.0)
    assert force_on(black, sun) == pytest.approx(-P * np.pi * 0.25 * sun, rel=1e-12)
    assert force_on(grey, sun) == pytest.approx(-P * np.pi * 0.25 * 13.0 / 9.0 * sun, rel=1e-12)
    mirror = Plate(axis=tuple(sun), area_m2=2.0, specular_reflectivity=1.0)
    assert force_on(mirror, sun) == pytest.approx(-4.0 * P * sun, rel=1e-12)
    plate = Plate(axis=(0.0, 0.0, 1.0), area_m2=2.0)
    tilted = np.array([0.6, 0.0, 0.8])
    assert force_on(plate, tilted) == pytest.approx(-1.6 * P * tilted, rel=1e-12)


def test_a_tilted_mirror_is_pushed_along_its_normal():
    mirror = Plate(axis=(0.0, 0.0, 1.0), area_m2=1.0, specular_reflectivity=1.0)
    force = force_on(mirror, (0.6, 0.0, 0.8))
    assert force == pytest.approx([0.0, 0.0, -2.0 * P * 0.64], abs=1e-20)


@given(directions)
@settings(max_examples=40, deadline=None)
def test_coincident_centres_of_pressure_and_mass_give_no_torque(sun):
    """A cube of equal faces, black or mirroring, and whole shapes about their centres."""
    light = here(light=P * unit(sun))
    for optics in ({}, {"specular_reflectivity": 1.0}):
        whole = (
            tuple(face.model_copy(update=optics) for face in box((0.4, 0.4, 0.4))),
            (Sphere(radius_m=0.5, **optics),),
            (Cylinder(axis=(0, 1, 1), radius_m=0.2, length_m=0.7, **optics),),
        )
        for made in whole:
            found = torque("solar_pressure", SolarPressure(parts=made).pack(()), light)
            assert np.abs(found).max() < 1e-15 * P


def test_parts_reflect_no_more_than_they_get():
    with pytest.raises(ValueError, match=r"diffuse_reflectivity: must be at most 0.3"):
        Sphere(radius_m=1.0, specular_reflectivity=0.7, diffuse_reflectivity=0.4)
    with pytest.raises(ValueError, match="less than or equal to 1"):
        Sphere(radius_m=1.0, specular_reflectivity=1.1)
    with pytest.raises(ValueError, match="parts"):
        SolarPressure(parts=())


# ------------------------------------------------------------------ dipole, eddy currents


@given(vectors, vectors, vectors, st.floats(0.1, 20.0), angles, angles)
@settings(max_examples=60, deadline=None)
def test_the_dipole_swings_with_the_orbit(constant, amplitude, b, cycles, phase_deg, u):
    made = ResidualDipole(
        constant_a_m2=constant,
        amplitude_a_m2=amplitude,
        cycles_per_orbit=cycles,
        phase_deg=phase_deg,
    )
    m = constant + np.array(amplitude) * np.sin(cycles * u + np.radians(phase_deg))
    b = 4e-5 * np.array(b)
    found = torque("residual_dipole", made.pack(()), here(b, angle=u))
    assert found == pytest.approx(np.cross(m, b), abs=1e-16)


def test_half_a_cycle_per_orbit_takes_two_orbits():
    made = ResidualDipole(amplitude_a_m2=(0.01, 0.0, 0.0), cycles_per_orbit=0.5).pack(())
    b = (0.0, 3e-5, 0.0)
    z = [torque("residual_dipole", made, here(b, angle=u))[2] for u in np.pi * np.arange(5)]
    assert z == pytest.approx([0.0, 3e-7, 0.0, -3e-7, 0.0], abs=1e-20)


@given(vectors, vectors)
@settings(max_examples=100, deadline=None)
def test_eddy_currents_dissipate_and_give_no_torque_along_field(omega, b):
    b = 4e-5 * np.array(b)
    found = torque("eddy_currents", eddies(STRAIGHT), here(b), omega)
    turning = np.cross(omega, b)
    tensor = np.diag([2e3, 1e3, 5e3])
    assert found == pytest.approx(np.cross(tensor @ turning, b), abs=1e-18)
    assert np.dot(omega, found) == pytest.approx(-turning @ tensor @ turning, abs=1e-18)
    assert np.dot(omega, found) <= 1e-22
    assert abs(np.dot(b, found)) < 1e-22


def test_a_tensor_is_a_number_three_or_nine():
    forms = (2.0, (2.0, 2.0, 2.0), ((2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 2.0)))
    packed = [EddyCurrents(damping_n_m_s_per_t2=form).pack(()) for form in forms]
    assert packed[0] == packed[1] == packed[2]
    for wrong, message in (
        (-1.0, "greater than or equal to 0"),
        ((1.0, 1.0, -1.0), "must have no negative principal value"),
        (((1.0, 2.0, 0.0), (2.0, 1.0, 0.0), (0.0, 0.0, 1.0)), "no negative principal value"),
        (((1.0, 0.5, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), "must be symmetric"),
    ):
        with pytest.raises(ValueError, match=message):
            EddyCurrents(damping_n_m_s_per_t2=wrong)


# ------------------------------------------------------------------ the unmodelled torque


@given(angles)
@settings(max_examples=60, deadline=None)
def test_the_unmodelled_torque_is_its_harmonics(u):
    a0, a1, b1, a2, b2 = map(np.array, HARMONICS)
    expected = a0 + a1 * np.sin(u) + b1 * np.cos(u) + a2 * np.sin(2 * u) + b2 * np.cos(2 * u)
    assert torque("unmodelled", harmonics(STRAIGHT), here(angle=u)) == pytest.approx(
        expected, abs=1e-20
    )


@kernel
def coefficients_at(unmodelled, seed, steps, out):
    for k in range(steps.size):
        draw_coefficients(unmodelled, seed, steps[k], out[k])


@kernel
def jumps(unmodelled, steps, last, out):
    for k in range(steps.size):
        out[k] = next_jump(unmodelled, steps[k], last)


def test_coefficients_are_normal_of_the_sizes_asked_for_and_independent():
    made = UnmodelledTorque(
        constant_n_m=1e-6, harmonic_1_n_m=2e-6, harmonic_2_n_m=3e-6, hold_s=1.0
    ).pack_sizes(7)
    out = np.full((4000, CELLS), np.nan)
    coefficients_at(made, 5, 7 * np.arange(4000), out)
    sizes = np.repeat([1e-6, 2e-6, 2e-6, 3e-6, 3e-6], 3)
    for column, size in zip(out.T, sizes, strict=True):
        assert stats.kstest(column / size, "norm").pvalue > 1e-4
    between = np.corrcoef(np.hstack([out[1:], out[:-1]]).T) - np.eye(2 * CELLS)
    assert np.abs(between).max() < 5.0 / np.sqrt(4000)
    again = np.full((4000, CELLS), np.nan)
    coefficients_at(made, 6, 7 * np.arange(4000), again)
    assert abs(np.mean(out / sizes * again / sizes)) < 5.0 / np.sqrt(4000 * CELLS)


def test_coefficients_jump_at_multiples_of_their_hold_alone():
    made = UnmodelledTorque(constant_n_m=1e-6, hold_s=1.0).pack_sizes(4)
    out, steps = np.zeros((12, CELLS)), np.arange(12)
    coefficients_at(made, 5, steps, out)
    assert (np.any(out != 0.0, axis=1) == (steps % 4 == 0)).all()
    x = noise.normal3(5, 8, 5)  # the first of the second five vectors
    assert out[4, :3] == pytest.approx(1e-6 * np.array(x), rel=1e-15)
    assert np.all(out[:, 3:] == 0.0)
    found = np.zeros(12, dtype=np.int64)
    jumps(made, steps, 10, found)
    assert found.tolist() == [4, 4, 4, 4, 8, 8, 8, 8, 10, 10, 10, 10]
