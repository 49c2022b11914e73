"""Slow motion by the closed equations: first integrals, closed solutions, what the books tell."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import brentq

from torquer.environment.field.averaged import cone_angle
from torquer.theory.slow.evolution import EVOLUTIONS, bdot, nutation_damping, reorientation, spin_up
from torquer.theory.slow.evolution.model import Case, Slow
from torquer.theory.slow.second_moments import averaged_moments, direct_dipole_moments
from torquer.theory.slow.slow_motion import evolve

MANY = settings(max_examples=25, deadline=None)
U = np.linspace(0.0, 60.0, 60)
inclinations = st.floats(5.0, 175.0)
angles = st.floats(0.1, 3.0).filter(lambda x: abs(x - math.pi / 2.0) > 0.05)
below = st.floats(0.1, 1.5)
ratios = st.floats(0.3, 1.9)
EVEN = brentq(lambda i: math.tan(cone_angle(i)) - math.sqrt(2.0), 0.1, 1.5, xtol=1e-15)


def case_of(inclination_deg, ratio=0.7, eps=0.05, target=(0.0, 0.0, 1.0)):
    return Case(eps, ratio, averaged_moments(math.radians(inclination_deg)), target)


def assert_constant(values, tolerance=1e-10):
    assert np.all(np.isfinite(values))
    assert np.ptp(values) <= tolerance * max(1.0, np.abs(values).max())


WITH_INTEGRALS = {
    "bdot": (1.0, 0.0, 0.0),
    "nutation_damping": (1.0, 0.0, 0.0),
    "preliminary_1": (1.0, 0.0, 0.0),
    "preliminary_2": (1.0, 0.0, 0.0),
    "spin_up": (1.0, 0.0, 0.0),
}


@pytest.mark.parametrize("name", WITH_INTEGRALS)
@MANY
@given(inclinations, below, below, ratios)
def test_first_integrals_are_constant(name, inclination, rho, theta, ratio):
    evolution, case = EVOLUTIONS[name], case_of(inclination, ratio)
    start = Slow(1.0, rho, 0.4, theta)
    path = evolve(evolution, case, start, U, rtol=1e-12)
    moved = max(np.ptp(path.l), np.ptp(path.rho), np.ptp(path.theta))
    assert moved > 1e-3  # else nothing is shown
    assert np.ptp(path.sigma) == 0.0
    for integral in evolution.integrals.values():
        assert_constant(integral(path, case))


@pytest.mark.parametrize("name", ["reorientation", "reorientation_as_printed"])
@MANY
@given(inclinations, below, st.floats(0.3, 2.8))
def test_integrals_of_reorientation_to_the_node(name, inclination, rho, sigma):
    """Each system has its own; that of the print is not constant in the corrected one."""
    case = case_of(inclination, target=(1.0, 0.0, 0.0))
    path = evolve(EVOLUTIONS[name], case, Slow(1.0, rho, sigma, 0.0), U, rtol=1e-12)
    (integral,) = EVOLUTIONS[name].integrals.values()
    # through logarithms: it may be huge where the start lies near the equator of Z
    assert_constant(np.log(integral(path, case)), 1e-10)
    p, _, q = case.moments[:3]
    if abs(p - q) > 0.1 and np.ptp(path.rho) > 0.1:
        other = ({"reorientation", "reorientation_as_printed"} - {name}).pop()
        (wrong,) = EVOLUTIONS[other].integrals.values()
        assert np.ptp(np.log(wrong(path, case))) > 1e-4


@MANY
@given(inclinations, below, st.floats(0.02, 0.2))
def test_b_dot_of_a_sphere_in_closed_form(inclination, rho0, eps):
    case = case_of(inclination, 1.0, eps)
    path = evolve(EVOLUTIONS["bdot"], case, Slow(1.0, rho0, 0.2, 0.8), U, rtol=1e-12)
    length, rho = bdot.sphere(U, case, rho0)
    assert path.l == pytest.approx(length, rel=1e-10, abs=1e-12)
    assert path.rho == pytest.approx(rho, abs=1e-10)
    assert np.ptp(path.theta) == 0.0


def test_b_dot_of_a_sphere_at_the_ends_of_rho():
    case = case_of(70.0, 1.0, 0.1)
    p = case.moments[0]
    along, _ = bdot.sphere(U, case, 0.0)
    across, rho = bdot.sphere(U, case, math.pi / 2.0)
    assert along == pytest.approx(np.exp(-0.1 * 2.0 * p * U), rel=1e-12)
    assert across == pytest.approx(np.exp(-0.1 * (1.0 - p) * U), rel=1e-9)
    assert rho == pytest.approx(np.full_like(U, math.pi / 2.0), abs=1e-9)


@MANY
@given(below, ratios)
def test_b_dot_where_the_field_is_even_in_closed_form(theta0, ratio):
    case = Case(0.05, ratio, averaged_moments(EVEN))
    path = evolve(EVOLUTIONS["bdot"], case, Slow(1.0, 0.7, 0.2, theta0), U, rtol=1e-12)
    length, theta = bdot.even_field(U, case, theta0)
    assert path.l == pytest.approx(length, rel=1e-10, abs=1e-12)
    assert path.theta == pytest.approx(theta, abs=1e-10)
    assert np.ptp(path.rho) < 1e-12


@pytest.mark.parametrize(("inclination", "end"), [(40.0, 0.0), (50.0, math.pi / 2.0)])
def test_momentum_tends_to_cone_axis_only_below_46_degrees(inclination, end):
    """MAG 2.1, from (2.1.11); the bound itself is the root of 3p = 1, 45.577 deg."""
    assert math.degrees(EVEN) == pytest.approx(45.577, abs=1e-3)
    path = evolve(EVOLUTIONS["bdot"], case_of(inclination), Slow(1.0, 0.8, 0.0, 0.5), [0.0, 2e3])
    assert path.rho[-1] == pytest.approx(end, abs=0.02)


@MANY
@given(inclinations, below, st.booleans())
def test_nutation_damping_of_the_two_special_cases(inclination, theta0, across):
    case, rho0 = case_of(inclination), math.pi / 2.0 if across else 1e-9
    start = Slow(1.0, rho0, 0.0, theta0)
    path = evolve(EVOLUTIONS["nutation_damping"], case, start, U, rtol=1e-12)
    length, theta = nutation_damping.special_case(U, case, theta0, across)
    assert path.theta == pytest.approx(theta, abs=1e-10)
    assert path.l == pytest.approx(length, rel=1e-10)


@MANY
@given(inclinations, st.booleans())
def test_spin_up_of_the_two_special_cases(inclination, across):
    case, rho0 = case_of(inclination), math.pi / 2.0 if across else 1e-12
    path = evolve(EVOLUTIONS["spin_up"], case, Slow(1.0, rho0, 0.0, 0.0), U, rtol=1e-12)
    assert path.l == pytest.approx(spin_up.special_case(U, case, across), rel=1e-10)


def test_small_nutation_spin_up_is_the_limit_of_the_whole():
    """The printed limit, MAG (3.2.3): cos theta is 1, sin theta is theta."""
    case = case_of(70.0)
    differences = []
    for theta in (0.1, 0.05, 0.025):
        slow, p = Slow(0.9, 0.8, 0.0, theta), case.moments[0]
        whole, sine = spin_up.spin_up_rates(slow, case), math.sin(slow.rho)
        across = 2.0 * p + (1.0 - 3.0 * p) * sine**2
        rho_rate = case.eps * (1.0 - 3.0 * p) * sine * math.cos(slow.rho) / slow.l
        differences.append(abs(whole.l - case.eps * across) + abs(whole.rho - rho_rate))
        theta_rate = -0.5 * case.eps * (2.0 - across) * theta / slow.l
        assert whole.theta == pytest.approx(theta_rate, rel=theta**2)
    assert np.log2(differences[0] / differences[1]) == pytest.approx(2.0, abs=0.05)
    assert np.log2(differences[1] / differences[2]) == pytest.approx(2.0, abs=0.05)


@MANY
@given(inclinations, st.floats(0.1, 3.0), st.sampled_from([0.8, 1.3]))
def test_reorientation_to_the_cone_axis_in_closed_form(inclination, rho0, length):
    case = case_of(inclination, target=(0.0, 0.0, length))
    expected = reorientation.to_cone_axis(U, case, rho0)
    for name in ("reorientation", "reorientation_as_printed"):  # here both are the same
        path = evolve(EVOLUTIONS[name], case, Slow(1.0, rho0, 0.3, 0.0), U, rtol=1e-12)
        assert path.rho == pytest.approx(expected, abs=1e-10)


def test_reorientation_reaches_any_target():
    target = np.array([0.36, 0.48, 0.8])
    path = evolve(
        EVOLUTIONS["reorientation"],
        case_of(60.0, target=tuple(target.tolist())),
        Slow(1.0, 2.0, 3.0, 0.0),
        [0.0, 1000.0],
    )
    rho, sigma = path.rho[-1], path.sigma[-1]
    reached = [math.sin(rho) * math.cos(sigma), math.sin(rho) * math.sin(sigma), math.cos(rho)]
    assert reached == pytest.approx(target, abs=1e-6)


def test_preliminary_1_ends_at_the_target_with_its_nutation_grown():
    """MAG 3.4: the only stable equilibrium is rho = 0, theta = 90 deg; the spin is kept."""
    path = evolve(EVOLUTIONS["preliminary_1"], case_of(60.0), Slow(1.0, 0.9, 0.0, 0.35), U)
    assert np.all(np.diff(path.rho) < 0.0) and np.all(np.diff(path.theta) > 0.0)
    assert np.all(np.diff(path.l) > 0.0)
    assert path.l * np.cos(path.theta) == pytest.approx(np.full_like(U, math.cos(0.35)), rel=1e-9)


def test_preliminary_2_damps_nutation_where_the_first_lets_it_grow():
    start, case = Slow(1.0, 1.2, 0.0, 0.7), case_of(20.0)
    first = evolve(EVOLUTIONS["preliminary_1"], case, start, U)
    second = evolve(EVOLUTIONS["preliminary_2"], case, start, U)
    assert second.theta[-1] < start.theta < first.theta[-1]


@MANY
@given(st.floats(10.0, 80.0), st.floats(0.2, 1.4), st.floats(0.0, 6.0))
def test_b_dot_in_the_direct_dipole_as_field_prints_it(inclination_deg, rho, sigma):
    """FIELD 2.1 (no number), with a = 9/8 sin^2 i, c = cos^2 i, d = <b2 b3>: l' of the print."""
    i = math.radians(inclination_deg)
    moments = direct_dipole_moments(i)
    a, c, d = moments[0], moments[2], moments[5]
    theta, ratio = 0.8, 0.7
    g = math.cos(theta) ** 2 + ratio * math.sin(theta) ** 2
    found = bdot.bdot_any_field(Slow(0.9, rho, sigma, theta), Case(0.1, ratio, moments))
    sr, cr, cs, ss = math.sin(rho), math.cos(rho), math.cos(sigma), math.sin(sigma)
    b33 = a * sr**2 * cs**2 + 11 / 9 * a * sr**2 * ss**2 + c * cr**2 + d * math.sin(2 * rho) * ss
    assert found.l == pytest.approx(-0.1 * 0.9 * (20 / 9 * a + c - b33) * g, rel=1e-12)
    around = (2 / 9 * a * ss * cs + d * cs * cr / sr) * g
    assert found.sigma == pytest.approx(0.1 * around, rel=1e-10, abs=1e-13)
    tilting = (a * cs**2 + 11 / 9 * a * ss**2 - c) * sr * cr + d * ss * math.cos(2 * rho)
    assert found.rho == pytest.approx(0.1 * tilting * g, rel=1e-10, abs=1e-13)
