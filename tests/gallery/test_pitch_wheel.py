"""Pitch wheel and B-dot: FIELD (2.15), (2.16), against equations in inertial axes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp
from slow_cases import slow_after

from gallery.theory.pitch_wheel import (
    EQUILIBRIUM,
    MODELS,
    PITCH,
    PitchWheel,
    bdot_rates,
    dcm_orbital_to_body,
    equations,
    free_rates,
    orbital_field,
    pitch_offset_averaged_polar,
    pitch_offset_direct_dipole,
    pitch_wheel_response,
)
from torquer.environment.field import averaged, direct_dipole
from torquer.environment.field.tilted_dipole import b_dipole
from torquer.environment.orbit.circular import Circular
from torquer.maths.geometry import euler
from torquer.theory.periodic.poincare import departure, derivatives, remainder

SATELLITE = PitchWheel(
    inertia_kg_m2=(10.0, 13.0, 12.0),
    wheel_momentum_n_m_s=0.1,
    gain_a_m2_s_t=2.5e5,
    altitude_km=600.0,
    inclination_deg=90.0,
)


def at(inclination_deg, **changes):
    return SATELLITE.model_copy(update={"inclination_deg": inclination_deg, **changes})


@settings(max_examples=40, deadline=None)
@given(angles=st.tuples(*3 * (st.floats(-1.4, 1.4),)))
def test_direction_cosines(angles):
    """The turns about 2, 3, 1 of the Euler module."""
    expected = euler.to_dcm("231", np.array(angles)).T
    found = dcm_orbital_to_body(*angles)
    assert found == pytest.approx(expected, abs=1e-14)
    # elements of the inverse as printed in MAG (1.3.5): one off the diagonal, and the last
    (sa, sb, sg), (ca, _, cg) = np.sin(angles), np.cos(angles)
    assert found[1, 0] == pytest.approx(sa * sg - ca * sb * cg, abs=1e-14)
    assert found[2, 2] == pytest.approx(ca * cg - sa * sb * sg, abs=1e-14)


@pytest.mark.parametrize("inclination", [0.3, 1.1, 0.5 * math.pi, 2.5])
@pytest.mark.parametrize("model", MODELS)
def test_the_field_is_that_of_the_model(model, inclination):
    series = orbital_field(model, inclination)
    for u in (0.2, 1.9, 4.4):
        if model == "direct_dipole":
            motion, normal, up = direct_dipole.b_orbital(1.0, u, inclination)
        else:
            b0 = averaged.mean_of_extremes(1.0, inclination)
            cone = averaged.cone_angle(inclination)
            motion, normal, up = averaged.b_orbital(b0, u, inclination, cone)
        found = (np.exp(1j * u * np.arange(4)) @ series).real
        assert found == pytest.approx([up, motion, normal], abs=1e-14)


def naive(satellite, gained):
    """d/dt of (three body axes as rows in inertial axes, w) in SI; `gained` times the gain.

    Orbit plane through the inertial axis 1, field of the dipole -mu_e along the axis 3.
    """
    j = np.diag(satellite.inertia_kg_m2)
    orbit = Circular(altitude_km=satellite.altitude_km, inclination_deg=satellite.inclination_deg)
    omega0, radius = orbit.rate_rad_s(), orbit.radius_m
    i = math.radians(satellite.inclination_deg)
    mu, gain = satellite.mu_e_t_km3 * 1e9, gained * satellite.gain_a_m2_s_t
    h = np.array([0.0, 0.0, satellite.wheel_momentum_n_m_s])
    node, ahead = np.array([1.0, 0.0, 0.0]), np.array([0.0, math.cos(i), math.sin(i)])

    def field(t):
        e = math.cos(omega0 * t) * node + math.sin(omega0 * t) * ahead
        return np.array(b_dipole((0.0, 0.0, -mu), tuple(radius * e))), e

    def rates(t, x):
        axes, w = x[:9].reshape(3, 3), x[9:]
        b_inertial, e_inertial = field(t)
        near, far = (field(t + d)[0] - field(t - d)[0] for d in (5.0, 10.0))
        b_rate = (8.0 * near - far) / 60.0
        b, e = axes @ b_inertial, axes @ e_inertial
        b_rate_body = axes @ b_rate - np.cross(w, b)
        torque = np.cross(-gain * b_rate_body, b) + 3.0 * omega0**2 * np.cross(e, j @ e)
        w_rate = np.linalg.solve(j, torque - np.cross(w, j @ w + h))
        turning = np.cross(axes.T @ w, axes)  # d axis/dt = w x axis, in inertial components
        return np.concatenate([np.ravel(turning), w_rate])

    return rates, omega0, (node, ahead)


def naive_run(satellite, gained, x, revolutions, count=65):
    """States of `pitch_wheel` along a run of the inertial equations from its state x at u = 0."""
    rates, omega0, (node, ahead) = naive(satellite, gained)
    normal = np.cross(node, ahead)
    body = dcm_orbital_to_body(*x[3:]) @ np.stack([node, ahead, normal])
    start = np.concatenate([np.ravel(body), omega0 * np.asarray(x[:3])])
    u = np.linspace(0.0, 2.0 * math.pi * revolutions, count)
    run = solve_ivp(
        rates, (0.0, u[-1] / omega0), start, "DOP853", rtol=1e-10, atol=1e-13, t_eval=u / omega0
    )
    states = []
    for v, column in zip(u, run.y.T, strict=True):
        up, along = (
            math.cos(v) * node + math.sin(v) * ahead,
            math.cos(v) * ahead - math.sin(v) * node,
        )
        dcm = column[:9].reshape(3, 3) @ np.stack([up, along, normal]).T
        angles = euler.from_dcm("231", dcm.T)
        states.append([*(column[9:] / omega0), *angles])
    return u, np.array(states)


@pytest.mark.parametrize("gained", [0.0, 1.0])
def test_field_2_15_against_inertial_equations(gained):
    """Large angles and rates, over a revolution, at 60 deg."""
    satellite = at(60.0, gain_a_m2_s_t=5e6)
    x = np.array([0.3, -0.2, 1.4, 0.3, -0.5, 0.4])
    f, g = equations(satellite)
    eps = gained * satellite.epsilon
    u, found = naive_run(satellite, gained, x, 0.7, count=15)
    own = solve_ivp(
        lambda u, x: f(x) + eps * g(u, x), (0.0, u[-1]), x, "DOP853", rtol=1e-10, atol=1e-12,
        t_eval=u,
    )  # fmt: skip
    assert np.abs(own.y.T - found).max() < 2e-7
    assert np.abs(found - x).max() > 0.5


def test_the_equilibrium_and_its_free_motion():
    inertia, wheel = SATELLITE.inertia_kg_m2, SATELLITE.wheel

    def f(x):
        return free_rates(x, inertia, wheel)

    x0 = np.array(EQUILIBRIUM)
    assert np.all(f(x0) == 0.0)
    jacobian = derivatives(f, x0)
    assert jacobian == pytest.approx(derivatives(f, x0, "difference"), abs=1e-8)
    assert jacobian[2, PITCH] == pytest.approx(-3.0 * SATELLITE.theta_c)
    pitch = math.sqrt(3.0 * SATELLITE.theta_c)
    values = np.linalg.eigvals(jacobian)
    assert np.abs(values - 1j * pitch).min() < 1e-12
    assert np.abs(values.real).max() < 1e-12


@pytest.mark.parametrize("inclination_deg", [0.0, 30.0, 60.0, 90.0, 120.0])
def test_field_2_16(inclination_deg):
    """A constant pitch, forward for a damping gain, nothing at other harmonics."""
    satellite = at(inclination_deg)
    response = pitch_wheel_response(satellite)
    offset = satellite.epsilon * response.offset[PITCH]
    assert offset == pytest.approx(pitch_offset_direct_dipole(satellite), rel=1e-12, abs=1e-18)
    assert offset > 0.0 or inclination_deg == 0.0
    assert response.amplitudes[1:, PITCH].max() < 1e-14


def test_nine_to_eight_on_the_polar_orbit():
    """Averaged over direct dipole: 9/8, the averaged field's estimate is the less hopeful."""
    offset = SATELLITE.epsilon * pitch_wheel_response(SATELLITE, "averaged").offset[PITCH]
    assert offset == pytest.approx(pitch_offset_averaged_polar(SATELLITE), rel=1e-12)
    direct = pitch_offset_direct_dipole(SATELLITE)
    assert offset / direct == pytest.approx(9.0 / 8.0, rel=1e-12)


@pytest.mark.parametrize("inclination_deg", [80.0, 60.0, 40.0])
def test_other_inclinations_of_the_averaged_field(inclination_deg):
    """FIELD leaves them out: the mean torque by quadrature, and slight second harmonics."""
    satellite = at(inclination_deg)
    i = satellite.inclination
    b0, cone = averaged.mean_of_extremes(1.0, i), averaged.cone_angle(i)

    def field(u):
        motion, _, up = averaged.b_orbital(b0, u, i, cone)
        return np.array([up, motion])

    pulls = []
    for u in np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False):
        near, far = (field(u + h) - field(u - h) for h in (1e-3, 2e-3))
        (up, motion), (up_rate, motion_rate) = field(u), (8.0 * near - far) / 12e-3
        pulls.append(up * motion_rate - motion * up_rate)
    response = pitch_wheel_response(satellite, "averaged")
    wanted = np.mean(pulls) / (3.0 * satellite.theta_c)
    assert response.offset[PITCH] == pytest.approx(wanted, rel=1e-9)
    ratio = wanted / pitch_wheel_response(satellite).offset[PITCH]
    assert 1.0 < ratio < 9.0 / 8.0
    assert ratio == pytest.approx({60.0: 1.10, 40.0: 1.06}.get(inclination_deg, ratio), abs=5e-3)
    assert 1e-6 < response.amplitudes[2, PITCH] < 2e-3


@pytest.mark.parametrize(
    ("model", "inclination_deg"),
    slow_after(
        2,
        [("averaged", 60.0), ("direct_dipole", 90.0), ("averaged", 90.0), ("direct_dipole", 60.0)],
        names=2,
    ),
)
def test_the_remainder_is_of_the_second_order(model, inclination_deg):
    satellite = at(inclination_deg, wheel_momentum_n_m_s=0.02)
    f, g = equations(satellite, model)
    response = pitch_wheel_response(satellite, model)
    for measure in (remainder, departure):
        left = np.array([measure(f, g, response, e).max() for e in (0.02, 0.01)])
        assert np.log2(left[0] / left[1]) > 1.8
        assert left[1] < 2e-3


def test_the_offset_in_a_full_run_in_si():
    """Inertial equations, SI, three revolutions: pitch stays at the offset of (2.16)."""
    response = pitch_wheel_response(SATELLITE)
    eps = SATELLITE.epsilon
    start = np.array(EQUILIBRIUM) + eps * response.at(0.0)
    _, states = naive_run(SATELLITE, 1.0, start, 3.0)
    offset = pitch_offset_direct_dipole(SATELLITE)
    assert 0.02 < offset < 0.04
    assert states[:, PITCH] == pytest.approx(offset, rel=0.02)


def test_the_control_takes_energy_from_fast_rotation():
    """M . w < 0 where the body turns much faster than the field."""
    inertia = SATELLITE.inertia_kg_m2
    series = orbital_field("direct_dipole", 1.0)
    rng = np.random.default_rng(1)
    for _ in range(20):
        w = rng.normal(0.0, 100.0, 3)
        x = np.concatenate([w, rng.normal(0.0, 0.5, 3)])
        power = (bdot_rates(0.3, x, series, inertia)[:3] * inertia) @ w
        assert power < 0.0


def test_a_fast_wheel_brings_precession_near_resonance():
    """h >> C omega0: the wheel's axis stays in inertial space, once a turn; the field drives it.

    Told as a resonance, yet harmless: the torque over h falls as the distance does.
    """
    slow, fast = (pitch_wheel_response(at(60.0, wheel_momentum_n_m_s=h)) for h in (0.02, 1.0))
    assert slow.resonances == ()
    assert [r.harmonic for r in fast.resonances] == [1]
    assert fast.resonances[0].eigenvalue.imag == pytest.approx(1.0, abs=0.01)
    assert fast.amplitudes[1, 3] == pytest.approx(math.sin(math.radians(60.0)), rel=1e-3)
    assert fast.amplitudes[1, 3] == pytest.approx(slow.amplitudes[1, 3], rel=1e-3)
    assert pitch_wheel_response(at(90.0, wheel_momentum_n_m_s=1.0)).resonances == ()


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (lambda: orbital_field("igrf", 1.0), "one of direct_dipole, averaged; received 'igrf'"),
        (lambda: pitch_offset_averaged_polar(at(60.0)), "must be 90 for this formula; .* 60.0"),
        (
            lambda: pitch_offset_direct_dipole(at(60.0, inertia_kg_m2=(13.0, 10.0, 12.0))),
            r"B must exceed A .* received \(13.0, 10.0, 12.0\)",
        ),
        (
            lambda: PitchWheel(**{**SATELLITE.model_dump(), "inertia_kg_m2": (1.0, 1.0, 9.0)}),
            "inertia_kg_m2: the sum of two principal moments",
        ),
        (
            lambda: PitchWheel(**{**SATELLITE.model_dump(), "altitude_km": 1e30}),
            "^altitude_km: must be less than or equal to 1500000; received 1e.30$",
        ),
    ],
)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()
