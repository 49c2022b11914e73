"""Full against averaged motion: two forms of the full one, order of the error, cost, resonances."""

import math
import time

import numpy as np
import pytest
from averaging_order import fitted_order
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from torquer.compile import engine
from torquer.computer.laws.bdot import BdotDerivative, BdotRate
from torquer.computer.laws.nutation_damping import NutationDampingRate
from torquer.computer.laws.spin_up import SpinUp
from torquer.theory.slow.averaging import nodes
from torquer.theory.slow.comparison import compare, resonances
from torquer.theory.slow.evolution import EVOLUTIONS
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.full_motion import Fast, by_euler, full_state, osculating, slow_variables
from torquer.theory.slow.orbit_field import field_at
from torquer.theory.slow.slow_motion import evolve
from torquer.theory.slow.spinner import Spinner

START, FAST = Slow(1.0, 1.0, 0.3, 1.0), Fast(0.2, 0.7)
#: Enough for laws of the second degree (`evolve_law` would note it); plain Python is slow.
FEW = {"at": nodes(3, 3, 5), "points": 400 if engine.COMPILED else 40}


def spinner_of(eta1=10.3, eta2=5.7, **keys):
    """A satellite with these rates of phi and psi, all other units one."""
    keys = {"inclination_deg": 80.0} | keys
    return Spinner(transverse_kg_m2=1.0 / eta2, axial_kg_m2=1.0 / (eta1 + eta2), **keys)


def b_dot(spinner, eps=0.1, law=BdotRate):
    return law(gain_a_m2_s_per_t=eps * spinner.axial_kg_m2).law()


def test_the_spinner_has_the_rates_asked_for():
    assert spinner_of(3.0, 7.0).eta == pytest.approx((3.0, 7.0))


@pytest.mark.parametrize("model", ["averaged", "direct_dipole", "tilted_dipole"])
def test_both_forms_of_the_full_motion_agree(model):
    """With the field's own turn in dB/dt, and the Earth's day."""
    spinner = spinner_of(field=model, field_turn=True, tilt_deg=150.0, earth_rate_rad_s=0.07)
    law, u = b_dot(spinner, law=BdotDerivative), np.linspace(0.0, 12.0, 40)
    slow, fast = osculating(law, spinner, START, FAST, u, day=0.4, rtol=1e-11)
    states = by_euler(law, spinner, START, FAST, u, day=0.4, rtol=1e-11)
    assert np.linalg.norm(states[:, :4], axis=1) == pytest.approx(np.ones(40), abs=1e-9)
    found = slow_variables(spinner, states)
    wrapped = np.unwrap(found.sigma)
    for one, other in zip(slow, found._replace(sigma=wrapped), strict=True):
        assert one == pytest.approx(other, abs=1e-8)
    for i in (0, 17, 39):
        again = full_state(spinner, Slow(*(v[i] for v in slow)), Fast(fast.phi[i], fast.psi[i]))
        assert abs(np.dot(again[:4], states[i, :4])) == pytest.approx(1.0, abs=1e-9)
        assert again[4:] == pytest.approx(states[i, 4:], abs=1e-7)


def test_the_full_motion_is_that_of_an_independent_integrator():
    """B-dot written down independently, with scipy's rotation and solver."""
    spinner, eps = spinner_of(field="direct_dipole"), 0.1
    field, gain = spinner.orbit_field(), eps * spinner.axial_kg_m2
    inertia = np.array([spinner.transverse_kg_m2] * 2 + [spinner.axial_kg_m2])

    def rates(u, y):
        turn, omega = Rotation.from_quat(y[:4]), y[4:]
        b = turn.inv().apply(field_at(field, u, 0.0))
        torque = np.cross(gain * np.cross(omega, b), b) - np.cross(omega, inertia * omega)
        x, y_, z, w = y[:4]
        p, q, r = omega
        spin = 0.5 * np.array(
            [
                w * p + y_ * r - z * q,
                w * q + z * p - x * r,
                w * r + x * q - y_ * p,
                -x * p - y_ * q - z * r,
            ]
        )
        return np.concatenate([spin, torque / inertia])

    end = [0.0, 5.0]
    found = by_euler(b_dot(spinner, eps), spinner, START, FAST, end, rtol=1e-11)
    first = full_state(spinner, START, FAST)
    other = solve_ivp(rates, end, first, method="DOP853", rtol=1e-10, atol=1e-12)
    assert found[-1] == pytest.approx(other.y[:, -1], abs=1e-7)


@pytest.mark.parametrize(
    "make",
    [
        lambda spinner: b_dot(spinner, 1.0),
        lambda spinner: NutationDampingRate(gain_a_m2_s_per_t=spinner.transverse_kg_m2).law(),
        lambda spinner: SpinUp(gain_a_m2_per_t=1.0).law(),
    ],
    ids=["bdot", "nutation_damping", "spin_up"],
)
def test_the_error_is_of_first_order_in_the_small_parameter(make):
    """Away from resonances: psi' = 23.7 l stays above the highest harmonic of the field."""
    spinner = spinner_of(17.3, 23.7)
    order, errors = fitted_order(
        make(spinner), spinner, START, FAST, 1.0, [0.16, 0.08, 0.04, 0.02, 0.01], **FEW
    )
    assert order == pytest.approx(1.0, abs=0.1)
    assert errors[-1] < 0.02


def test_figure_2_1_4_full_and_averaged_agree_to_eps():
    """MAG, Fig. 2.1.4: eps = 0.1, eta1 = 10, eta2 = 5, rho0 = theta0 = 1, i = 80 deg."""
    spinner = spinner_of(10.0, 5.0)
    found = compare(b_dot(spinner), spinner, Slow(1.0, 1.0, 0.0, 1.0), FAST, 6.0 * math.pi, **FEW)
    assert found.full.l[-1] < 0.65
    assert found.error < 0.1


def test_slow_equations_are_faster_than_full_ones():
    """Of a quick spin over ten revolutions, to the same tolerance; with the spin grows the gain."""
    spinner, u = spinner_of(103.0, 57.0), [0.0, 20.0 * math.pi]
    law, evolution = b_dot(spinner, 0.02), EVOLUTIONS["bdot"]
    case = evolution.case(0.02 * spinner.axial_kg_m2, spinner)

    def least(run):
        times = []
        for _ in range(4):
            start = time.perf_counter()
            run()
            times.append(time.perf_counter() - start)
        return min(times)

    slow = least(lambda: evolve(evolution, case, START, u))
    full = least(lambda: by_euler(law, spinner, START, FAST, u))
    assert full > 10.0 * slow


def test_resonances_are_found_and_only_those():
    near = resonances(spinner_of(10.0, 5.0), Slow(1.0, 1.0, 0.0, 0.0), greatest=4)
    assert near[0] == (1, -2, 0)  # phi' = 10, psi' = 5
    assert resonances(spinner_of(10.3, 5.7), Slow(1.0, 1.0, 0.0, 0.0), greatest=1) == []
    slow = Slow(0.5, 1.0, 0.0, math.pi / 3.0)  # phi' = 2.5, psi' = 2.5
    assert (1, -1, 0) in resonances(spinner_of(10.0, 5.0), slow)
    for numbers in resonances(spinner_of(10.3, 5.7), slow, greatest=3, width=0.2):
        assert numbers > (0, 0, 0)
        rate = numbers[0] * 10.3 * 0.25 + numbers[1] * 5.7 * 0.5 + numbers[2]
        assert abs(rate) < 0.2
    with pytest.raises(ValueError, match=r"^greatest: must lie within 1\.\.50; received 0"):
        resonances(spinner_of(), START, greatest=0)


def test_through_a_resonance_the_order_falls_below_one():
    """psi' = 5.7 l meets 4 u' as l falls: the error of a passage is of order one half."""
    spinner = spinner_of(10.3, 5.7)
    scales = [0.16, 0.08, 0.04, 0.02, 0.01]
    order, _ = fitted_order(b_dot(spinner, 1.0), spinner, START, FAST, 1.0, scales, **FEW)
    assert 0.5 < order < 0.9


def test_at_a_resonance_the_averages_may_fail():
    """The body turns with a multiple of the field's rate: spin-up acts on a fixed phase."""
    law = SpinUp(gain_a_m2_per_t=0.02).law()
    start = Slow(1.0, 1.0, 0.3, 1.0)
    clear, locked = spinner_of(10.3, 5.7), spinner_of(2.0 / math.cos(1.0) - 2.0, 2.0)
    usual = compare(law, clear, start, FAST, 20.0, **FEW).error
    assert resonances(locked, start, width=0.5)
    assert compare(law, locked, start, FAST, 20.0, **FEW).error > 2.0 * usual
