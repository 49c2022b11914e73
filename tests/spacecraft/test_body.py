"""The body: what inertia is physical, principal axes, Euler's equations, Jacobi's integral."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from torquer.environment.earth.gravity import gravity_gradient_torque
from torquer.environment.local import LocalEnvironment
from torquer.maths.geometry.motion import Motion
from torquer.spacecraft.body import (
    Body,
    momentum_body,
    motion_rates,
    torque_body,
)

FULL = [[1.0, 0.05, -0.08], [0.05, 1.3, 0.04], [-0.08, 0.04, 1.7]]
OMEGA0 = 1.1e-3
ZERO = (0.0, 0.0, 0.0)


def turned(moments, seed):
    turn = Rotation.random(random_state=seed).as_matrix()
    return turn @ np.diag(moments) @ turn.T


@pytest.mark.parametrize(
    ("inertia", "expected"),
    [
        ((1.0, 1.0, -0.5), "must be positive definite; received principal moments -0.5, 1, 1"),
        ((0.0, 1.0, 1.0), "must be positive definite; received principal moments 0, 1, 1"),
        (np.zeros((3, 3)).tolist(), "must be positive definite; received principal moments 0"),
        ([[1, 2, 0], [2, 1, 0], [0, 0, 1]], "must be positive definite; received"),
        ([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], r"must be symmetric; received \[\[1.0, 0.1, 0.0\]"),
        (
            (1.0, 1.0, 2.1),
            r"the sum of two principal moments must not be below the third "
            r"\(triangle inequality\); received 1, 1, 2.1 kg m\^2",
        ),
        (turned((1.0, 1.0, 2.1), 1).tolist(), "triangle inequality"),
        ((1.0, float("nan"), 1.0), "must be finite"),
        ((1.0, float("inf"), 1.0), "must be finite"),
        ((1.0, 2.0), "must have 3 values"),
    ],
)
def test_unphysical_inertia_is_reported_in_words(inertia, expected):
    with pytest.raises(ValueError, match=expected):
        Body(inertia_kg_m2=inertia)


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("mass_kg", 0.0, "greater than 0"),
        ("mass_kg", -3.0, "greater than 0"),
        ("wheel_momentum_n_m_s", (0.0, 1.0), "wheel_momentum_n_m_s"),
        ("wheel_momentum_n_m_s", (0.0, 1.0, float("inf")), "must be finite"),
        (
            "wheel_momentum_n_m_s",
            (0.0, 2e4, 0.0),
            r"wheel_momentum_n_m_s: must be at most 1.75e\+04 N m s for this inertia",
        ),
        ("colour", "red", "must be a known key"),
    ],
)
def test_other_keys_are_checked(key, value, expected):
    with pytest.raises(ValueError, match=expected):
        Body(**{"inertia_kg_m2": (1.0, 1.2, 1.4), key: value})


def test_the_limits_of_physical_are_physical():
    """A flat plate (the third moment is the sum) and a thin rod, in any axes."""
    for moments in ((1.0, 1.0, 2.0), (1e-9, 1.0, 1.0)):
        Body(inertia_kg_m2=moments)
        Body(inertia_kg_m2=turned(moments, 5).tolist())


def test_a_body_is_frozen_and_survives_json():
    body = Body(inertia_kg_m2=FULL, wheel_momentum_n_m_s=(0.1, 0.2, 0.3), mass_kg=40.0)
    assert Body.model_validate_json(body.model_dump_json()) == body
    with pytest.raises(ValueError, match="must stay as it is"):
        body.mass_kg = 1.0


def test_three_moments_are_a_diagonal_tensor():
    tensor = np.diag([1.0, 1.2, 1.4]).tolist()
    assert Body(inertia_kg_m2=(1.0, 1.2, 1.4)) == Body(inertia_kg_m2=tensor)


def test_asymmetry_of_the_size_of_rounding_is_taken_out():
    body = Body(inertia_kg_m2=[[1.0, 0.1 + 4e-10, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]])
    tensor = np.array(body.inertia_kg_m2)
    assert np.array_equal(tensor, tensor.T)
    assert tensor[0, 1] == pytest.approx(0.1 + 2e-10, abs=1e-16)


@settings(max_examples=80, deadline=None)
@given(
    st.tuples(*[st.floats(1e-3, 10.0)] * 3),
    st.integers(0, 10_000),
    st.sampled_from(["any", "two alike", "sphere"]),
)
def test_principal_axes_are_right_handed_and_rebuild_the_tensor(parts, seed, shape):
    x, y, z = parts
    if shape == "two alike":
        y = x
    elif shape == "sphere":
        y = z = x
    tensor = turned((y + z, x + z, x + y), seed)
    body = Body(inertia_kg_m2=tensor.tolist())
    moments, axes = body.principal()
    assert np.all(np.diff(moments) >= 0.0)
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-14)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-14)
    assert axes @ np.diag(moments) @ axes.T == pytest.approx(tensor, abs=1e-13)
    packed = body.pack_principal()
    assert packed.moments == pytest.approx(moments, abs=0.0)
    turn = Rotation.from_quat(packed.q_principal_to_body).as_matrix()
    assert turn == pytest.approx(axes, abs=1e-14)


def test_constants_for_kernels():
    rigid = Body(inertia_kg_m2=FULL, wheel_momentum_n_m_s=(0.1, 0.2, 0.3)).pack()
    assert rigid.inertia == (1.0, 1.3, 1.7, 0.05, -0.08, 0.04)
    xx, yy, zz, xy, xz, yz = rigid.inverse_inertia
    inverse = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    assert inverse @ FULL == pytest.approx(np.eye(3), abs=1e-15)
    assert rigid.wheel_momentum == (0.1, 0.2, 0.3)


vectors = st.tuples(*[st.floats(-2.0, 2.0)] * 3)
attitudes = st.integers(0, 10_000).map(lambda n: tuple(Rotation.random(random_state=n).as_quat()))


@settings(max_examples=60, deadline=None)
@given(attitudes, vectors, vectors, vectors, vectors)
def test_motion_satisfies_eulers_equations_and_kinematics(q, omega, wheels, dipole, b):
    """Residual of d/dt (J w + h) in inertial axes = m x B + 3 mu/r^3 e x J e."""
    rigid = Body(inertia_kg_m2=FULL, wheel_momentum_n_m_s=wheels).pack()
    up = (0.6, 0.0, -0.8)
    world = LocalEnvironment(b, tuple(np.sqrt(0.7) * np.array(up)), ())
    rate = motion_rates(rigid, world, dipole, Motion(q, omega), ())
    to_body = Rotation.from_quat(q).as_matrix().T
    e, field = to_body @ up, to_body @ b
    torque = np.cross(dipole, field) + 0.7 * np.cross(e, np.array(FULL) @ e)
    momentum = np.array(FULL) @ omega + wheels
    residual = np.array(FULL) @ rate.omega + np.cross(omega, momentum) - torque
    assert residual == pytest.approx(np.zeros(3), abs=1e-13)
    assert momentum_body(rigid, omega) == pytest.approx(momentum, abs=1e-14)
    assert torque_body(rigid, world, dipole, Motion(q, omega), ()) == pytest.approx(
        torque, abs=1e-13
    )
    v, s = np.array(q[:3]), q[3]
    expected = np.r_[0.5 * (s * np.array(omega) + np.cross(v, omega)), -0.5 * v @ omega]
    assert rate.q == pytest.approx(expected, abs=1e-15)
    # the turn of the body's axes: dR/dt = R [w]x, by a small step
    step = 1e-6
    ahead = Rotation.from_quat(np.add(q, step * np.array(rate.q))).as_matrix()
    behind = Rotation.from_quat(np.subtract(q, step * np.array(rate.q))).as_matrix()
    turn = (ahead - behind) / (2.0 * step)
    x, y, z = omega
    assert turn == pytest.approx(
        to_body.T @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]), abs=1e-8
    )


def cloud(seed):
    """Point masses about their centre of mass, and their inertia tensor."""
    rng = np.random.default_rng(seed)
    masses, places = rng.uniform(0.5, 2.0, 12), rng.normal(size=(12, 3))
    places -= masses @ places / masses.sum()
    square = np.sum(places**2, axis=1)
    tensor = np.einsum("n,nij->ij", masses, square[:, None, None] * np.eye(3)) - np.einsum(
        "n,ni,nj->ij", masses, places, places
    )
    return masses, places, tensor


@pytest.mark.parametrize("seed", range(5))
def test_gravity_gradient_is_the_sum_of_point_mass_forces(seed):
    """Exact sum of forces; what is left is of the next order in size over distance."""
    masses, places, tensor = cloud(seed)
    rng = np.random.default_rng(100 + seed)
    up = rng.normal(size=3)
    up /= np.linalg.norm(up)
    mu, r = 3.0, 1e4
    away = r * up + places
    forces = -mu * masses[:, None] * away / np.linalg.norm(away, axis=1)[:, None] ** 3
    exact = np.cross(places, forces).sum(axis=0)
    rigid = Body(inertia_kg_m2=tensor.tolist()).pack()
    torque = gravity_gradient_torque(rigid.inertia, tuple(np.sqrt(3.0 * mu / r**3) * up))
    size = 3.0 * mu / r**3 * np.linalg.norm(tensor)
    assert torque == pytest.approx(exact, abs=1e-3 * size)
    assert np.linalg.norm(exact) > 2e-2 * size


def test_gravity_gradient_turns_a_dumbbell_towards_the_vertical():
    """Two masses on x, the vertical a little towards y: the torque turns x towards y."""
    rigid = Body(inertia_kg_m2=(0.01, 1.0, 1.0)).pack()
    angle = 0.1
    gravity_gradient = (np.sqrt(3.0) * np.cos(angle), np.sqrt(3.0) * np.sin(angle), 0.0)
    torque = gravity_gradient_torque(rigid.inertia, gravity_gradient)
    assert torque[2] == pytest.approx(1.5 * (1.0 - 0.01) * np.sin(2.0 * angle))
    assert torque[:2] == (0.0, 0.0)


def on_circular_orbit(rigid, q, omega, seconds):
    """Attitude motion with gravity gradient on a circular orbit in the inertial plane xy."""

    def rates(t, y):
        u = OMEGA0 * t
        pull = np.sqrt(3.0) * OMEGA0
        world = LocalEnvironment((0.0, 0.0, 0.0), (pull * np.cos(u), pull * np.sin(u), 0.0), ())
        rate = motion_rates(rigid, world, (0.0, 0.0, 0.0), Motion(tuple(y[:4]), tuple(y[4:])), ())
        return np.r_[rate.q, rate.omega]

    times = np.linspace(0.0, seconds, 60)
    found = solve_ivp(
        rates, (0.0, seconds), np.r_[q, omega], "DOP853", times, rtol=1e-11, atol=1e-14
    )
    return times, found.y.T


@pytest.mark.parametrize("wheels", [(0.0, 0.0, 0.0), (2e-3, -3e-3, 1e-3)])
@pytest.mark.parametrize("inertia", [(1.0, 1.3, 1.7), FULL])
def test_jacobi_integral_stays_on_a_circular_orbit(inertia, wheels):
    rigid = Body(inertia_kg_m2=inertia, wheel_momentum_n_m_s=wheels).pack()
    q = Rotation.from_euler("xyz", [0.5, -0.8, 1.1]).as_quat()
    times, states = on_circular_orbit(rigid, q, (2e-3, -1e-3, 2.5e-3), 12_000.0)
    values, kinetic = [], []
    tensor = np.array(FULL) if inertia is FULL else np.diag(inertia)
    for t, y in zip(times, states, strict=True):
        to_body = Rotation.from_quat(y[:4]).as_matrix().T
        up = to_body @ [np.cos(OMEGA0 * t), np.sin(OMEGA0 * t), 0.0]
        normal = to_body @ [0.0, 0.0, 1.0]
        momentum = tensor @ y[4:] + wheels
        kinetic.append(0.5 * y[4:] @ tensor @ y[4:])
        gravity = 1.5 * OMEGA0**2 * up @ tensor @ up
        values.append(kinetic[-1] + gravity - OMEGA0 * normal @ momentum)
    assert values == pytest.approx([values[0]] * len(values), abs=1e-8 * max(kinetic))
    assert np.ptp(kinetic) > 1e-2 * max(kinetic)  # it is not the energy that stays
