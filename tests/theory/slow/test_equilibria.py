"""Where the averaged motion leads: the books' words, closed Jacobians, the motion itself."""

import math

import numpy as np
import pytest

from torquer.computer.laws.bdot import BdotRate
from torquer.theory.slow.equilibria import (
    evolution_rates,
    find_equilibria,
    law_rates,
    tends_to,
)
from torquer.theory.slow.evolution import EVOLUTIONS
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.slow_motion import evolve
from torquer.theory.slow.spinner import Spinner

EPS = 0.1
PROLATE = {"transverse_kg_m2": 3.0, "axial_kg_m2": 2.0}


def case_of(name, inclination_deg, target=(0.0, 0.0, 1.0), **keys):
    spinner = Spinner(inclination_deg=inclination_deg, **(PROLATE | keys))
    return EVOLUTIONS[name].case(EPS, spinner, target)._replace(eps=EPS)


def found(name, case):
    return find_equilibria(evolution_rates(EVOLUTIONS[name], case))


def angles(points):
    return [(p.rho, p.sigma, p.theta) for p in points]


def test_b_dot_turns_over_at_45_577_deg():
    """MAG 2.1: below i0 the momentum tends to the cone axis, above it to the plane across."""
    below, above = found("bdot", case_of("bdot", 45.57)), found("bdot", case_of("bdot", 45.585))
    half = pytest.approx(math.pi / 2.0)
    assert angles(tends_to(below)) == [(0.0, None, half), (math.pi, None, half)]
    assert angles(tends_to(above)) == [(half, None, half)]
    assert len(below) == len(above) == 9


def test_oblate_body_under_b_dot_tends_to_axial_spin():
    case = case_of("bdot", 70.0, transverse_kg_m2=2.0, axial_kg_m2=3.0)
    half = pytest.approx(math.pi / 2.0)
    assert angles(tends_to(found("bdot", case))) == [(half, None, 0.0), (half, None, math.pi)]


@pytest.mark.parametrize("inclination", [20.0, 60.0])
def test_jacobian_of_b_dot_on_the_cone_axis(inclination):
    """Along rho eps (3p - 1) g, of theta (eps/2) (1 - C/A) (1 + q) cos 2 theta; l' = -2p eps g."""
    case = case_of("bdot", inclination)
    p, ratio = case.moments[0], 2.0 / 3.0
    for point in found("bdot", case):
        if point.rho != 0.0:
            continue
        g = 1.0 if math.sin(point.theta) < 0.5 else ratio
        turning = 0.5 * EPS * (1.0 - ratio) * (2.0 - 2.0 * p) * math.cos(2.0 * point.theta)
        expected = np.diag([EPS * (3.0 * p - 1.0) * g] * 2 + [turning])
        assert point.jacobian == pytest.approx(expected, abs=1e-10)
        assert point.length_rate == pytest.approx(-2.0 * p * EPS * g, rel=1e-12)


@pytest.mark.parametrize("field", ["direct_dipole", "tilted_dipole"])
@pytest.mark.parametrize("inclination", [30.0, 75.0])
def test_dipole_b_dot_tends_to_greatest_moment_of_the_field(field, inclination):
    """n' = eps g (M n - (n M n) n): the eigenvector of M with the greatest eigenvalue attracts."""
    case = case_of("bdot_any_field", inclination, field=field)
    xx, yy, zz, xy, xz, yz = case.moments
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    values, axes = np.linalg.eigh(matrix)
    points = found("bdot_any_field", case)
    assert len(points) == 18  # six directions, three nutations
    for point in tends_to(points):
        r, s = point.rho, point.sigma
        n = np.array([math.sin(r) * math.cos(s), math.sin(r) * math.sin(s), math.cos(r)])
        assert abs(n @ axes[:, 2]) == pytest.approx(1.0, abs=1e-9)
        expected = sorted(EPS * 2.0 / 3.0 * (values[:2] - values[2]))
        assert sorted(point.eigenvalues.real)[:3] == pytest.approx(
            sorted([*expected, -0.5 * EPS / 3.0 * (values.sum() + values[2])]), abs=1e-9
        )
    assert len(tends_to(points)) == 2


def test_nutation_damping_leaves_any_direction_and_no_nutation():
    points = found("nutation_damping", case_of("nutation_damping", 60.0))
    assert angles(tends_to(points)) == [(None, None, 0.0), (None, None, pytest.approx(math.pi))]
    assert all(point.length_rate == 0.0 for point in tends_to(points))
    assert tends_to(points)[0].description == "momentum in any direction, nutation 0 deg"


def test_preliminary_1_has_one_stable_equilibrium():
    """MAG 3.4: of all, (theta, rho) = (pi/2, 0) alone is stable; the momentum grows there."""
    points = found("preliminary_1", case_of("preliminary_1", 60.0))
    (stable,) = tends_to(points)
    assert (stable.rho, stable.theta) == (0.0, pytest.approx(math.pi / 2.0))
    assert stable.length_rate > 0.0
    assert {(p.rho, round(math.degrees(p.theta))) for p in points} == {
        (rho, theta) for rho in (0.0, math.pi) for theta in (0, 90, 180)
    }


def test_preliminary_2_ends_on_the_target_with_any_nutation():
    (stable,) = tends_to(found("preliminary_2", case_of("preliminary_2", 60.0)))
    assert (stable.rho, stable.theta, stable.length_rate) == (0.0, None, 0.0)


def test_spin_up_tends_across_axis_when_low_along_when_high():
    low, high = (tends_to(found("spin_up", case_of("spin_up", i))) for i in (30.0, 60.0))
    assert angles(low) == [(pytest.approx(math.pi / 2.0), None, 0.0)]
    assert angles(high) == [(0.0, None, 0.0), (math.pi, None, 0.0)]


def test_reorientation_tends_to_its_target():
    target = (0.36, -0.48, 0.8)
    case = case_of("reorientation", 75.0, target)
    stable, unstable = found("reorientation", case)
    assert (stable.stability, unstable.stability) == ("stable", "unstable")
    assert stable.rho == pytest.approx(math.acos(0.8))
    assert stable.sigma == pytest.approx(math.atan2(-0.48, 0.36))
    assert unstable.rho == pytest.approx(math.pi - stable.rho)
    p, q = case.moments[0], case.moments[2]
    around = p * 0.64 + q * 0.36
    assert np.diag(stable.jacobian) == pytest.approx([-EPS * p, -EPS * around, 0.0], abs=1e-9)
    assert stable.description == "momentum 36.87 deg off it, azimuth -53.13 deg, any nutation"


@pytest.mark.parametrize(
    ("name", "end"), [("bdot", 300.0), ("spin_up", 3e4), ("preliminary_1", 3e4)]
)
def test_the_motion_itself_comes_to_a_stable_equilibrium(name, end):
    case = case_of(name, 70.0)
    stable = [(p.rho, p.theta) for p in tends_to(found(name, case))]
    rng = np.random.default_rng(1)
    for rho, theta in rng.uniform(0.2, 1.4, (4, 2)):
        start = Slow(1.0, rho, 0.3, theta)
        path = evolve(EVOLUTIONS[name], case, start, [0.0, end], rtol=1e-9)
        last = np.array([path.rho[-1], path.theta[-1]])
        assert min(np.abs(last - point).max() for point in stable) < 0.1


def test_directly_averaged_law_has_the_equilibria_of_its_closed_equations():
    spinner = Spinner(inclination_deg=60.0, **PROLATE)
    law = BdotRate(gain_a_m2_s_per_t=EPS * spinner.axial_kg_m2).law()
    points = find_equilibria(law_rates(law, spinner))
    expected = found("bdot", case_of("bdot", 60.0))
    assert len(points) == len(expected)
    (one,), (other,) = tends_to(points), tends_to(expected)
    assert (one.rho, one.sigma) == (pytest.approx(other.rho), None)
    assert one.jacobian == pytest.approx(other.jacobian, abs=1e-9)
    assert one.description == "momentum across the third axis, nutation 90 deg"


def test_input_without_sense_is_refused():
    rates = evolution_rates(EVOLUTIONS["bdot"], case_of("bdot", 60.0))
    with pytest.raises(ValueError, match=r"^length: must be positive and finite; received 0"):
        find_equilibria(rates, 0.0)
    with pytest.raises(ValueError, match=r"^rates: must be finite and not all zero; received up "):
        find_equilibria(lambda slow: Slow(0.0, 0.0, 0.0, 0.0))
