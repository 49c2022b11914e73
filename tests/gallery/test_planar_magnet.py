"""The magnet satellite on a polar orbit: FIELD (2.6)-(2.8) from vectors, tongues, and the motion.

What comes out for the direct dipole: the published tongue, about the even turn, shuts where that
of the motion does to 1 %; a linearisation about the field's own direction is off by 10 % and more.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_b

from gallery.theory.mathieu import first_tongue, half_trace, mathieu_equation
from gallery.theory.planar_magnet import (
    STRENGTH,
    PlanarMagnet,
    along_field,
    closed_tongue,
    dipole_direction,
    motion_edges,
    pitch_acceleration,
    tongue_edges,
    tracking_half_trace,
    tracking_motion,
    uniform_rotation,
    uniform_rotation_forcing,
)
from torquer.environment.field import averaged, direct_dipole
from torquer.theory.periodic.floquet import chart, monodromy
from torquer.theory.periodic.poincare import equidistant_points

ANGLES = st.floats(-10.0, 10.0)
dipole_turn = uniform_rotation.with_parameters(mu=1.0)


def field_up_and_along(u, mu):
    """B / B0 of a polar orbit along (up, motion), B0 the averaged field's strength."""
    right = 0.5 * math.pi
    if mu:
        motion, _, up = direct_dipole.b_orbital(2.0 / 3.0, u, right)
    else:
        motion, _, up = averaged.b_orbital(1.0, u, right, right)
    return np.array([up, motion])


@settings(max_examples=60, deadline=None)
@given(u=ANGLES, alpha=ANGLES, eta=st.floats(-2.0, 2.0), lambda2=st.floats(0.0, 9.0))
@pytest.mark.parametrize("mu", [0, 1])
def test_field_2_6_from_vectors(mu, u, alpha, eta, lambda2):
    """m x B and 3 e x J e about the normal, with vectors in the plane (up, motion)."""
    b = field_up_and_along(u, mu)
    magnet = np.array([math.cos(alpha), math.sin(alpha)])
    magnetic = lambda2 * (magnet[0] * b[1] - magnet[1] * b[0])
    # e = (cos alpha, -sin alpha) in the body, A - B = eta C / 3
    a, b_moment, c = 2.0 + eta / 3.0, 2.0, 1.0
    e = np.array([math.cos(alpha), -math.sin(alpha)])
    gravity = 3.0 * (e[0] * b_moment * e[1] - e[1] * a * e[0]) / c
    found = pitch_acceleration(u, alpha, eta, lambda2, mu)
    assert found == pytest.approx(magnetic + gravity, abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(u=ANGLES, eta=st.floats(-2.0, 2.0), lambda2=st.floats(0.0, 9.0))
@pytest.mark.parametrize("mu", [0, 1])
def test_field_2_7_is_linear_part_about_the_even_turn(mu, u, eta, lambda2):
    """At any u, for the direct dipole as well: nothing about it is bound to the nodes."""
    even = 0.5 * math.pi + u
    forcing = uniform_rotation_forcing(u, eta, lambda2, mu)
    assert pitch_acceleration(u, even, eta, lambda2, mu) == pytest.approx(forcing, abs=1e-12)
    slope = np.imag(pitch_acceleration(u, even + 1e-30j, eta, lambda2, mu)) / 1e-30
    system = uniform_rotation.with_parameters(eta=eta, lambda2=lambda2, mu=mu)
    assert system.matrix(u)[1, 0] == pytest.approx(slope, abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(u=ANGLES, eta=st.floats(-2.0, 2.0), lambda2=st.floats(0.0, 9.0))
def test_the_linear_part_about_the_dipole_field(u, eta, lambda2):
    direction = float(dipole_direction(u))
    up, motion = field_up_and_along(u, 1)
    assert math.cos(direction - math.atan2(motion, up)) == pytest.approx(1.0, abs=1e-14)
    slope = np.imag(pitch_acceleration(u, direction + 1e-30j, eta, lambda2, 1)) / 1e-30
    system = along_field.with_parameters(eta=eta, lambda2=lambda2)
    assert system.matrix(u)[1, 0] == pytest.approx(slope, abs=1e-12)


def test_dipole_field_turns_by_2u_not_u_near_a_node():
    u = np.array([0.02, 0.01])
    assert dipole_direction(u) - 0.5 * math.pi == pytest.approx(2.0 * u, rel=1e-3)
    whole = dipole_direction(np.linspace(0.0, 2.0 * math.pi, 721))
    assert whole[-1] - whole[0] == pytest.approx(2.0 * math.pi)
    ahead = whole - 0.5 * math.pi - np.linspace(0.0, 2.0 * math.pi, 721)
    assert math.degrees(np.abs(ahead).max()) == pytest.approx(19.471, abs=1e-3)


def test_the_averaged_tongue_is_mathieus():
    for eta in (-0.8, 0.3, 1.0):
        known = [float(mathieu_b(1, abs(eta) / 2)), float(mathieu_a(1, abs(eta) / 2))]
        found = tongue_edges(uniform_rotation, eta)
        assert found == pytest.approx(known if eta > 0.0 else known[::-1], abs=1e-10)
    u, eta, lambda2 = 0.4, 0.7, 1.2
    system = mathieu_equation.with_parameters(a=lambda2, q=-0.5 * eta)
    here = uniform_rotation.with_parameters(eta=eta, lambda2=lambda2)
    assert here.matrix(u) == pytest.approx(system.matrix(u), abs=1e-15)


def test_edges_of_both_models_by_the_published_series():
    """FIELD after (2.14): chi = eta/lambda2 for the averaged field, less 1/3 for the dipole."""
    for mu, system in ((0, uniform_rotation), (1, dipole_turn)):
        for eta in (0.25, 0.35, 0.45):
            cosine, sine = tongue_edges(system, eta)
            for place, exact in enumerate((cosine, sine)):
                chi = eta / exact - mu / 3.0
                assert first_tongue(chi)[place] == pytest.approx(exact, abs=0.12 * abs(chi) ** 3)


def test_where_the_tongues_shut():
    """Averaged: A = B. Dipole: (A - B) omega0^2 = m mu_e/r^3 / 6, that is eta = lambda2 / 3."""
    eta, lambda2 = closed_tongue(lambda eta: tongue_edges(uniform_rotation, eta), -0.3, 0.2)
    assert (eta, lambda2) == pytest.approx((0.0, 1.0), abs=1e-9)
    eta, lambda2 = closed_tongue(lambda eta: tongue_edges(dipole_turn, eta), 0.1, 0.6)
    assert (eta, lambda2) == pytest.approx((1.0 / 3.0, 1.0), abs=1e-9)
    c, omega0, strength = 3.1, 1.1e-3, 2.9e-5
    a_minus_b = eta * c / 3.0
    moment = lambda2 * c * omega0**2 / (strength / STRENGTH[1])
    assert a_minus_b * omega0**2 == pytest.approx(moment * strength / 6.0, rel=1e-8)


def test_where_the_tongue_of_the_motion_itself_shuts():
    """The published point, 0.333, is that of the motion (0.331) to 1 %; along the field eta is
    0.408, 23 % away.
    """
    eta, lambda2 = closed_tongue(lambda eta: motion_edges(eta, 1, (0.5, 1.7)), 0.28, 0.38)
    assert (eta, lambda2) == pytest.approx((0.330929, 0.991661), abs=1e-5)
    assert eta / lambda2 == pytest.approx(1.0 / 3.0, rel=2e-3)
    assert eta / lambda2 == pytest.approx(0.3337, abs=5e-5)
    eta, lambda2 = closed_tongue(lambda eta: tongue_edges(along_field, eta), 0.1, 0.9)
    assert (eta, lambda2) == pytest.approx((0.408311, 1.104827), abs=1e-5)
    assert eta / lambda2 == pytest.approx(0.3696, abs=5e-5)  # 11 % from 0.3333


def grown(eta, lambda2, mu, revolutions=60):
    """How far a small push (1e-6) at the periodic motion has gone in the full equation (2.6)."""
    y = tracking_motion(eta, lambda2, mu)[0]
    start = [0.5 * math.pi + y[0] + 1e-6, 1.0 + y[1]]

    def rates(u, x):
        return [x[1], pitch_acceleration(u, x[0], eta, lambda2, mu)]

    end = revolutions * 2.0 * math.pi
    run = solve_ivp(rates, (0.0, end), start, "DOP853", rtol=1e-11, atol=1e-12, t_eval=[end])
    return abs(run.y[0, 0] - start[0] - end + 1e-6)


@pytest.mark.parametrize(
    ("eta", "lambda2", "stable"),
    [
        (1.0 / 3.0, 1.08, True),  # unstable about the field, stable in truth
        (0.0, 0.92, False),
        (0.0, 1.19, False),
        (0.0, 0.80, True),
        (0.3, 1.05, True),  # unstable about the field, stable in truth
    ],
)
def test_the_full_equation_decides(eta, lambda2, stable):
    """Integration of (2.6) agrees with the multipliers of the periodic motion."""
    assert (abs(tracking_half_trace(eta, lambda2, 1)) < 1.0) == stable
    assert (grown(eta, lambda2, 1) < 1e-4) == stable
    if eta > 0.0:
        about_field = half_trace(monodromy(along_field, eta=eta, lambda2=lambda2))
        assert abs(float(about_field)) > 1.0


@pytest.mark.parametrize(("eta", "mu"), [(0.5, 0), (-0.5, 0), (0.4, 1), (0.0, 1)])
def test_motion_edges_bound_the_instability(eta, mu):
    low, high = sorted(motion_edges(eta, mu, (0.4, 1.8)))
    step = 0.05 * (high - low)
    inside = [abs(tracking_half_trace(eta, x, mu)) for x in (low + step, high - step)]
    outside = [abs(tracking_half_trace(eta, x, mu)) for x in (low - step, high + step)]
    assert min(inside) > 1.0 > max(outside)


@pytest.mark.parametrize("mu", [0, 1])
def test_the_tracking_motion_is_a_motion(mu):
    """It solves (2.6), is odd, and for a strong magnet follows the field."""
    y = tracking_motion(0.5, 2.0, mu)
    u = equidistant_points(math.pi, 63)
    start = [0.5 * math.pi + y[0, 0], 1.0 + y[0, 1]]
    run = solve_ivp(
        lambda u, x: [x[1], pitch_acceleration(u, x[0], 0.5, 2.0, mu)],
        (0.0, u[-1]), start, "DOP853", rtol=1e-12, atol=1e-13, t_eval=u,
    )  # fmt: skip
    assert run.y[0] - 0.5 * math.pi - u == pytest.approx(y[:, 0], abs=1e-9)
    assert y[1:, 0] == pytest.approx(-y[:0:-1, 0], abs=1e-10)


def test_a_strong_magnet_follows_the_field():
    u = equidistant_points(math.pi, 63)
    ahead = dipole_direction(u) - 0.5 * math.pi - u
    errors = [np.abs(tracking_motion(0.5, x, 1)[:, 0] - ahead).max() for x in (3000.0, 12000.0)]
    assert errors[0] < 0.002
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_the_chart_of_both_models():
    """Along eta = 0 the averaged field holds at every lambda2, the dipole loses its tongue."""
    lambda2, eta = np.linspace(0.7, 1.5, 41), np.array([0.0, 0.6])
    for mu, widest in ((0, 1e-5), (1, 0.2)):
        system = uniform_rotation.with_parameters(mu=float(mu))
        found = chart(system, ("lambda2", lambda2), ("eta", eta))
        greatest = found.largest_multiplier.max("lambda2").values - 1.0
        assert (greatest[0] > 1e-3) == bool(mu)
        assert greatest[0] < 3.0 * widest
        assert greatest[1] > 0.1


def test_numbers_of_a_satellite():
    satellite = PlanarMagnet(inertia_kg_m2=(1.0, 1.2, 1.1), dipole_a_m2=0.2, altitude_km=500.0)
    assert satellite.eta == pytest.approx(3.0 * (1.0 - 1.2) / 1.1)
    radius = 6378.137e3 + 500e3
    omega0 = math.sqrt(3.986004415e14 / radius**3)
    b0 = 1.5 * 7.812e6 * 1e9 / radius**3
    assert satellite.lambda2 == pytest.approx(0.2 * b0 / (1.1 * omega0**2), rel=1e-9)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (
            lambda: PlanarMagnet(inertia_kg_m2=(1.0, 1.0, 3.0), dipole_a_m2=1.0, altitude_km=1.0),
            "inertia_kg_m2: the sum of two principal moments",
        ),
        (
            lambda: PlanarMagnet(inertia_kg_m2=(1.0, 1.0, 1.0), dipole_a_m2=0.0, altitude_km=1.0),
            "dipole_a_m2: must be greater than 0; received",
        ),
        (
            lambda: PlanarMagnet(inertia_kg_m2=(1.0, 1.0, 1.0), dipole_a_m2=1.0, altitude_km=1e30),
            "altitude_km: must be less than or equal to 1500000",
        ),
        (
            lambda: tongue_edges(uniform_rotation, 0.1, (2.0, 3.0)),
            r"lambda2 must hold the first tongue at eta = 0.1; received \(2.0, 3.0\)",
        ),
        (lambda: motion_edges(0.1, 0, (1.3, 1.4)), r"must hold both edges; received \(1.3, 1.4\)"),
    ],
)
def test_messages(action, message):
    with pytest.raises(ValueError, match=message):
        action()
