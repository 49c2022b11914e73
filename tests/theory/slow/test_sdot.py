"""Averaged motion under S-dot: closed solution, integrals, the side of the Sun, full motion."""

import math

import numpy as np
import pytest
from averaging_order import fitted_order
from hypothesis import given, settings, strategies as st
from scipy.optimize import brentq

from torquer.compile import engine
from torquer.computer.laws.sdot import SdotRate
from torquer.theory.slow.averaging import nodes
from torquer.theory.slow.equilibria import evolution_rates, find_equilibria, tends_to
from torquer.theory.slow.evolution import EVOLUTIONS, sdot
from torquer.theory.slow.evolution.model import Case, Slow
from torquer.theory.slow.full_motion import Fast, by_euler, slow_variables
from torquer.theory.slow.second_moments import averaged_moments
from torquer.theory.slow.slow_motion import evolve, map_evolution
from torquer.theory.slow.spinner import Spinner

SDOT = EVOLUTIONS["sdot"]
MANY = settings(max_examples=25, deadline=None)
U = np.linspace(0.0, 60.0, 60)
SUN = (0.36, -0.48, 0.8)
inclinations = st.floats(5.0, 175.0)
inner = st.floats(0.2, 2.9)
around = st.floats(0.0, 6.2)
ratios = st.floats(0.3, 1.9)
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="minutes without JIT")


def unit(rho, sigma):
    return (math.sin(rho) * math.cos(sigma), math.sin(rho) * math.sin(sigma), math.cos(rho))


def case_of(inclination_deg=60.0, ratio=0.7, eps=0.05, sun=SUN):
    return Case(eps, ratio, averaged_moments(math.radians(inclination_deg)), sun)


def pull_of(case):
    """v = (p S1, p S2, q S3) and a = S.v."""
    v = np.array(case.moments[:3]) * case.target
    return v, float(v @ case.target)


# ------------------------------------------------------------ the equations


@MANY
@given(inclinations, inner, around, inner, inner, around)
def test_the_equation_of_gamma_is_the_printed_one(inclination, rho, sigma, theta, to_sun, azimuth):
    """SDOT (2.11) has gamma in place of sigma: by the chain rule from ours."""
    case = case_of(inclination, sun=unit(to_sun, azimuth))
    slow, step = Slow(0.8, rho, sigma, theta), 1e-6
    rates, p, q, s3 = SDOT.rates(slow, case), case.moments[0], case.moments[2], case.target[2]

    def moved(by):
        rho_, sigma_ = slow.rho + by * rates.rho, slow.sigma + by * rates.sigma
        return sdot.sun_angle(slow._replace(rho=rho_, sigma=sigma_), case)

    gamma = float(sdot.sun_angle(slow, case))
    g = math.cos(theta) ** 2 + case.ratio * math.sin(theta) ** 2
    turning = p * math.cos(gamma) + s3 * math.cos(rho) * (q - p)
    expected = -case.eps * g * math.sin(gamma) * turning
    assert (moved(step) - moved(-step)) / (2.0 * step) == pytest.approx(expected, abs=1e-8)
    falling = (math.cos(rho) * math.cos(gamma) - s3) / math.sin(rho)
    assert rates.rho == pytest.approx(case.eps * g * falling * turning, rel=1e-9, abs=1e-12)
    braking = p * math.sin(gamma) ** 2 + (q - p) * (s3**2 - s3 * math.cos(rho) * math.cos(gamma))
    assert rates.l == pytest.approx(-case.eps * 0.8 * g * braking, rel=1e-9, abs=1e-12)
    tilting = 2.0 * ((1.0 - s3**2) * p + s3**2 * q) - p * math.sin(gamma) ** 2
    tilting += (q - p) * s3 * (math.cos(gamma) * math.cos(rho) - s3)
    half = 0.5 * case.eps * (1.0 - case.ratio) * math.sin(theta) * math.cos(theta)
    assert rates.theta == pytest.approx(half * tilting, rel=1e-9, abs=1e-12)


@MANY
@given(inclinations, inner, around, inner, ratios)
def test_theta_by_the_first_integral_has_one_half_and_not_two(
    inclination, rho, sigma, theta, ratio
):
    """SDOT (2.14) is (2.11) with cos rho by (2.12); the line before it has a second 1/2."""
    case, slow = case_of(inclination, ratio), Slow(1.0, rho, sigma, theta)
    p, q, s3 = case.moments[0], case.moments[2], case.target[2]
    gamma, first = float(sdot.sun_angle(slow, case)), float(sdot.plane_integral(slow, case))
    sine, cosine = math.sin(gamma), math.cos(gamma)
    factor = 0.5 * case.eps * (1.0 - case.ratio) * math.sin(theta) * math.cos(theta)
    a1, a2 = p + (q - p) * s3**2, first * s3 * (q - p)
    expected = factor * (a1 * (2.0 - sine**2) + a2 * sine * cosine)  # (2.14)
    assert SDOT.rates(slow, case).theta == pytest.approx(expected, rel=1e-9, abs=1e-12)
    line = 2.0 * p + 2.0 * s3**2 * (q - p) - p * sine**2
    line += (q - p) * (first * s3 * cosine * sine - s3**2 * sine**2)
    assert 0.5 * factor * line == pytest.approx(0.5 * expected, rel=1e-9, abs=1e-12)


@MANY
@given(inclinations, inner, around, inner, ratios)
def test_first_integrals_are_constant(inclination, rho, sigma, theta, ratio):
    case, start = case_of(inclination, ratio), Slow(1.0, rho, sigma, theta)
    path = evolve(SDOT, case, start, U, rtol=1e-12)
    known = [integral(path, case) for integral in SDOT.integrals.values()]
    # near the line of the Sun, and where v.e vanishes, the integrals magnify errors
    off, d = np.sin(sdot.sun_angle(path, case)), sdot.direction(path) @ sdot.pull(case)
    near = np.min([off, np.abs(d), np.abs(np.cos(path.theta)), np.sin(path.theta)])
    for values in known:
        assert np.ptp(values) <= 1e-11 / max(near, 1e-6)
    assert all(drift < 1e-8 for drift in path.drift.values())


def test_the_third_integral_as_printed_is_not_constant():
    """SDOT 2.2 prints -(2/lam)(ln sin theta - (C/A) ln cos theta): the sign must be plus."""
    case, start = case_of(), Slow(1.0, 0.9, 0.4, 1.1)
    path = evolve(SDOT, case, start, U, rtol=1e-12)
    gamma, lam = sdot.sun_angle(path, case), 1.0 - case.ratio
    i1 = sdot.plane_integral(path, case)[0]
    a1 = pull_of(case)[1]
    a2 = i1 * case.target[2] * (case.moments[2] - case.moments[0])
    path_part = np.log((1.0 - np.cos(gamma)) / (1.0 + np.cos(gamma)))
    path_part -= np.log(np.abs(4.0 * (a1 * np.cos(gamma) + a2 * np.sin(gamma))
                               / (1.0 + np.cos(gamma)) ** 2))  # fmt: skip
    nutation = np.log(np.sin(path.theta)) - case.ratio * np.log(np.abs(np.cos(path.theta)))
    assert np.ptp(path_part - 2.0 / lam * nutation) > 1.0
    corrected = path_part + 2.0 / lam * nutation
    assert np.ptp(corrected) < 1e-10
    ours = 2.0 / lam * sdot.nutation_integral(path, case)
    assert corrected == pytest.approx(ours - math.log(4.0), abs=1e-9)


# ------------------------------------------------------------ the solution


@MANY
@given(inclinations, inner, around, st.floats(0.02, 0.2))
def test_a_sphere_in_closed_form(inclination, rho, sigma, eps):
    case, start = case_of(inclination, 1.0, eps), Slow(1.3, rho, sigma, 0.8)
    path = evolve(SDOT, case, start, U, rtol=1e-12)
    vectors = path.l[:, None] * sdot.direction(path)
    assert vectors == pytest.approx(sdot.momentum_at(eps * U, start, case), abs=1e-9)


@MANY
@given(inclinations, inner, around, ratios)
def test_any_body_goes_the_same_way_at_its_own_pace(inclination, rho, sigma, ratio):
    """The phase is the integral of eps g: along the path of the sphere."""
    case, start = case_of(inclination, ratio), Slow(1.0, rho, sigma, 1.0)
    u = np.linspace(0.0, 60.0, 601)
    path = evolve(SDOT, case, start, u, rtol=1e-12)
    g = np.cos(path.theta) ** 2 + ratio * np.sin(path.theta) ** 2
    phase = case.eps * np.concatenate([[0.0], np.cumsum(0.5 * (g[1:] + g[:-1]) * np.diff(u))])
    vectors = path.l[:, None] * sdot.direction(path)
    assert vectors == pytest.approx(sdot.momentum_at(phase, start, case), abs=1e-4)


@MANY
@given(inclinations, inner, around, inner, around)
def test_the_end_is_the_printed_final_momentum(inclination, rho, sigma, to_sun, azimuth):
    """SDOT (2.18), and the side: that of v.e, not that of the Sun itself."""
    case, start = case_of(inclination, sun=unit(to_sun, azimuth)), Slow(1.0, rho, sigma, 1.0)
    p, q, s3 = case.moments[0], case.moments[2], case.target[2]
    gamma = float(sdot.sun_angle(start, case))
    printed = abs(p * math.cos(gamma) + s3 * (q - p) * math.cos(rho)) / (p + s3**2 * (q - p))
    end = float(sdot.final_momentum(start, case))
    assert abs(end) == pytest.approx(printed, rel=1e-9, abs=1e-12)
    far = evolve(SDOT, case, start, [0.0, 40.0 / (0.7 * 0.05 * pull_of(case)[1])])
    if abs(end) > 1e-3:
        assert far.l[-1] == pytest.approx(abs(end), rel=1e-5)
        line = 0.0 if end > 0.0 else math.pi
        assert float(sdot.sun_angle(far, case)[-1]) == pytest.approx(line, abs=1e-4)


def test_momentum_may_turn_to_a_sun_behind_it_and_grow():
    """The border is normal to v: at 10 deg of inclination one 100 deg off the Sun turns to it."""
    case, angle = case_of(10.0, 1.0, sun=unit(math.radians(70.0), 0.0)), math.radians(100.0)
    v, a = pull_of(case)
    across = v - a * np.array(case.target)
    e = math.cos(angle) * np.array(case.target) + math.sin(angle) * across / np.linalg.norm(across)
    start = Slow(1.0, math.acos(e[2]), math.atan2(e[1], e[0]), 0.5)
    assert math.degrees(sdot.sun_angle(start, case)) == pytest.approx(100.0)
    assert float(sdot.final_momentum(start, case)) > 1.0


@MANY
@given(inclinations, inner, around, ratios, st.floats(0.01, 1.5))
def test_the_phase_of_capture(inclination, rho, sigma, ratio, angle):
    case, start = case_of(inclination, ratio), Slow(0.9, rho, sigma, 1.0)
    end, phase = float(sdot.final_momentum(start, case)), sdot.capture_phase(start, case, angle)

    def off(s):
        vector = math.copysign(1.0, end) * sdot.momentum_at(s, start, case)
        return math.atan2(np.linalg.norm(np.cross(vector, case.target)), vector @ case.target)

    assert off(phase + 1e-9) <= angle + 1e-6
    if phase > 0.0:
        assert phase == pytest.approx(brentq(lambda s: off(s) - angle, 0.0, phase + 5.0), abs=1e-6)
    slowest = case.eps * min(1.0, ratio)
    path = evolve(SDOT, case, start, [0.0, phase / slowest + 1e-9])
    gamma = float(sdot.sun_angle(path, case)[-1])
    assert min(gamma, math.pi - gamma) <= angle + 1e-6


def test_a_momentum_normal_to_v_keeps_its_direction_and_vanishes():
    case = case_of(70.0, 1.0)
    v, a = pull_of(case)
    e = np.cross(v, (1.0, 0.0, 0.0))
    e /= np.linalg.norm(e)
    start = Slow(1.0, math.acos(e[2]), math.atan2(e[1], e[0]), 0.5)
    path = evolve(SDOT, case, start, U)
    assert path.l == pytest.approx(np.exp(-a * case.eps * U), rel=1e-9)
    assert np.ptp(path.rho) < 1e-9
    assert sdot.capture_phase(start._replace(rho=start.rho + 1e-9), case, 0.1) > 20.0


def test_numbers_without_sense_are_refused():
    start = Slow(1.0, 0.9, 0.4, 1.1)
    for angle in (0.0, 0.5 * math.pi, -1.0):
        with pytest.raises(ValueError, match=r"^angle: must lie within 0\.\.1\.5708, ends left"):
            sdot.capture_phase(start, case_of(), angle)
    for wrong in ((0.0, 0.0, 2.0), (0.0, 0.0, 0.0)):
        with pytest.raises(ValueError, match=r"^length of target: must lie within 1\.\.1 \(it is"):
            evolve(SDOT, case_of(sun=wrong), start, U)
    with pytest.raises(ValueError, match=r"^mean of cos\^2\(alpha\): must lie within 1e-09\.\.1 "):
        sdot.final_momentum(start, case_of(0.0, sun=(0.6, 0.8, 0.0)))
    grid = {"inclination_deg": [60.0], "rho_deg": [40.0]}
    fixed = {"sigma_deg": 0.0, "theta_deg": 1.0, "eps": 0.1}
    with pytest.raises(ValueError, match=r"^sun: must be given for evolution sdot; received none"):
        map_evolution(SDOT, grid, fixed, 1.0)
    with_sun = Spinner(inclination_deg=0.0, sun=(0.0, 3.0, 4.0))
    ends = [map_evolution(SDOT, grid, fixed, 9.0, **keys).rho
            for keys in ({"spinner": with_sun}, {"target": (0.0, 0.6, 0.8)})]  # fmt: skip
    assert ends[0] == pytest.approx(ends[1])


# ------------------------------------------------------------ equilibria


@pytest.mark.parametrize(("ratio", "theta"), [(1.4, 0.0), (0.7, 0.5 * math.pi)])
def test_the_stable_equilibria_are_on_the_sun_s_line(ratio, theta):
    """SDOT 2.3: gamma = 0 or pi; theta = 0 for C > A, pi/2 for C < A; rates in closed form."""
    case = case_of(70.0, ratio)
    points = tends_to(find_equilibria(evolution_rates(SDOT, case)))
    a = pull_of(case)[1]
    nutations = [theta, math.pi - theta] if theta == 0.0 else [theta]
    assert len(points) == 2 * len(nutations)
    for point in points:
        there = Slow(1.0, point.rho, point.sigma, point.theta)
        gamma = float(sdot.sun_angle(there, case))
        assert min(gamma, math.pi - gamma) == pytest.approx(0.0, abs=1e-7)
        assert min(abs(point.theta - x) for x in nutations) < 1e-7
        turning = -case.eps * a * (1.0 if theta == 0.0 else ratio)
        tilting = -case.eps * a * abs(1.0 - ratio)
        expected = np.sort([turning, turning, tilting])
        assert np.sort(point.eigenvalues.real) == pytest.approx(expected, abs=1e-8)
        assert point.length_rate == 0.0


def test_the_plane_normal_to_v_repels():
    """SDOT's gamma0 = atan(-A1/A2): eigenvalue eps a g across the plane, 0 along it."""
    case = case_of(70.0, 1.4)
    v, a = pull_of(case)
    points = find_equilibria(evolution_rates(SDOT, case))
    on_plane = [point for point in points if point.theta == 0.0 and point.length_rate < 0.0]
    assert on_plane and all(point.sigma is not None for point in points)
    for point in on_plane:
        e = np.array(unit(point.rho, point.sigma))
        assert e @ v == pytest.approx(0.0, abs=1e-8)
        assert point.stability == "unstable"
        moved = np.sort(point.eigenvalues.real)
        assert moved == pytest.approx(np.sort([case.eps * a, 0.0, -0.2 * case.eps * a]), abs=1e-8)
        i1 = sdot.plane_integral(Slow(1.0, point.rho, point.sigma, 0.0), case)
        a2 = i1 * case.target[2] * (case.moments[2] - case.moments[0])
        gamma = float(sdot.sun_angle(Slow(1.0, point.rho, point.sigma, 0.0), case))
        assert math.tan(gamma) == pytest.approx(-a / a2, rel=1e-6)


# ------------------------------------------------------------ the full motion


def spinner_of(eta1, eta2, inclination_deg=80.0):
    return Spinner(inclination_deg=inclination_deg, transverse_kg_m2=1.0 / eta2,
                   axial_kg_m2=1.0 / (eta1 + eta2), sun=SUN)  # fmt: skip


@needs_jit
@pytest.mark.parametrize("eta", [(17.3, 23.7), (-11.3, 33.7)])
def test_the_error_is_of_first_order_in_the_small_parameter(eta):
    spinner = spinner_of(*eta)
    law = SdotRate(gain_a_m2_s=spinner.axial_kg_m2).law()
    scales = [0.16, 0.08, 0.04, 0.02, 0.01]
    start, fast = Slow(1.0, 1.0, 0.3, 1.0), Fast(0.2, 0.7)
    few = {"at": nodes(3, 1, 5), "points": 100}
    order, errors = fitted_order(law, spinner, start, fast, 1.0, scales, **few)
    assert order == pytest.approx(1.0, abs=0.1)
    assert errors[-1] < 0.02


@needs_jit
def test_the_full_motion_ends_on_the_predicted_side():
    """Random directions; those whose final momentum is within eps of zero may go either way."""
    spinner, eps = spinner_of(17.3, 23.7, 51.7), 0.05
    law = SdotRate(gain_a_m2_s=eps * spinner.axial_kg_m2).law()
    case, rng = SDOT.case(eps * spinner.axial_kg_m2, spinner), np.random.default_rng(4)
    decided, off = 0, []
    for _ in range(40):
        start = Slow(1.0, math.acos(rng.uniform(-1.0, 1.0)), rng.uniform(0.0, 6.0), 0.4)
        end = float(sdot.final_momentum(start, case))
        if abs(end) < 2.0 * eps:
            continue
        u = [0.0, 16.0 / (eps * pull_of(case)[1])]
        found = slow_variables(spinner, by_euler(law, spinner, start, Fast(0.3, 0.4), u, rtol=1e-7))
        cosine = math.cos(float(sdot.sun_angle(Slow(*(x[-1] for x in found)), case)))
        assert cosine == pytest.approx(math.copysign(1.0, end), abs=1e-3)
        decided, off = decided + 1, [*off, abs(found.l[-1] - abs(end))]
    assert decided > 25
    assert max(off) < 2.0 * eps
