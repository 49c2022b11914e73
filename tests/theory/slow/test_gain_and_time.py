"""From gain to time and back: closed solutions, scaling, the full motion of a satellite."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.computer.laws.nutation_damping import NutationDampingRate
from torquer.theory.slow.evolution import EVOLUTIONS, bdot, nutation_damping, reorientation
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.full_motion import Fast, by_euler, slow_variables
from torquer.theory.slow.gain_and_time import (
    GOALS,
    Times,
    design_table,
    even_directions,
    gain_at,
    gain_for,
    slow_time,
    times_over_directions,
)
from torquer.theory.slow.spinner import Spinner

MANY = settings(max_examples=25, deadline=None)


def case_of(name, inclination_deg, eps=1.0, **keys):
    evolution = EVOLUTIONS[name]
    return evolution.case(1.0, Spinner(inclination_deg=inclination_deg, **keys))._replace(eps=eps)


@MANY
@given(st.floats(10.0, 90.0), st.floats(0.1, 1.5), st.floats(0.02, 0.9))
def test_time_of_b_dot_on_a_sphere(inclination, rho, part):
    case = case_of("bdot", inclination)
    s = slow_time(EVOLUTIONS["bdot"], case, Slow(1.0, rho, 0.3, 0.5), part)
    assert bdot.sphere(np.array([s]), case, rho)[0] == pytest.approx([part], rel=1e-7)


@MANY
@given(st.floats(10.0, 90.0), st.floats(0.2, 3.0), st.floats(0.02, 0.9))
def test_time_of_reorientation_to_the_cone_axis(inclination, rho, part):
    case = case_of("reorientation", inclination)
    s = slow_time(EVOLUTIONS["reorientation"], case, Slow(1.0, rho, 0.0, 0.0), part)
    assert reorientation.to_cone_axis(s, case, rho) == pytest.approx(part * rho, rel=1e-7)


def test_time_of_nutation_damping_in_the_special_cases():
    for across, rho in ((False, 0.0), (True, math.pi / 2.0)):
        case = case_of("nutation_damping", 40.0)
        evolution = EVOLUTIONS["nutation_damping"]
        s = slow_time(evolution, case, Slow(1.0, rho, 0.0, 1.2), 0.1)
        length, theta = nutation_damping.special_case(s, case, 1.2, across)
        assert length * math.sin(theta) == pytest.approx(0.1 * math.sin(1.2), rel=1e-7)


def test_growth_is_timed_too():
    case = case_of("spin_up", 90.0)  # 2p = 1
    s = slow_time(EVOLUTIONS["spin_up"], case, Slow(1.0, 0.0, 0.0, 0.0), 3.0)
    assert s == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "inclination", "start", "part"),
    [
        ("bdot", 0.0, Slow(1.0, 0.0, 0.0, 0.5), 0.1),  # no torque along the field
        ("bdot", 60.0, Slow(1.0, 0.5, 0.0, 0.5), 2.0),  # never grows
        ("spin_up", 90.0, Slow(1.0, 0.0, 0.0, math.pi), 2.0),  # the momentum vanishes
        ("reorientation", 60.0, Slow(1.0, math.pi, 0.0, 0.0), 0.1),  # unstable opposite
    ],
)
def test_never_is_infinite(name, inclination, start, part):
    assert slow_time(EVOLUTIONS[name], case_of(name, inclination), start, part) == math.inf


def test_what_has_nothing_to_damp_is_there_at_once():
    case, start = case_of("nutation_damping", 60.0), Slow(1.0, 0.5, 0.0, 0.0)
    assert slow_time(EVOLUTIONS["nutation_damping"], case, start, 0.1) == 0.0


def test_directions_are_even_over_the_sphere():
    rho, sigma = np.array(even_directions(400)).T
    n = np.column_stack([np.sin(rho) * np.cos(sigma), np.sin(rho) * np.sin(sigma), np.cos(rho)])
    assert n.mean(axis=0) == pytest.approx(np.zeros(3), abs=3e-3)
    assert n.T @ n / 400 == pytest.approx(np.eye(3) / 3.0, abs=3e-3)


def test_times_over_directions_are_ordered_and_within_the_special_cases():
    case = case_of("nutation_damping", 80.0)
    evolution = EVOLUTIONS["nutation_damping"]
    times = times_over_directions(evolution, case, 1.2, 0.1)
    along, across = (
        slow_time(evolution, case, Slow(1.0, rho, 0.0, 1.2), 0.1) for rho in (0.0, math.pi / 2.0)
    )
    assert along <= times.least < times.median < times.greatest <= across


def test_gain_and_time_are_inverse():
    evolution, times = EVOLUTIONS["bdot"], Times(3.0, 5.0, math.inf)
    spinner = Spinner(
        inclination_deg=60.0, strength_t=3e-5, axial_kg_m2=1.2, orbital_rate_rad_s=1.1e-3
    )
    gains = gain_for(evolution, spinner, times, 4.0)
    assert gains.greatest == math.inf
    row, other = design_table(evolution, spinner, times, [gains.least, gains.median])
    assert row.revolutions.least == pytest.approx(4.0, rel=1e-12)
    assert other.revolutions.median == pytest.approx(4.0, rel=1e-12)
    assert row.eps == pytest.approx(gains.least * 9e-10 / (1.1e-3 * 1.2), rel=1e-12)
    assert gain_at(evolution, spinner, row.eps) == pytest.approx(row.gain, rel=1e-12)


def test_table_gain_keeps_its_promise_in_the_full_motion():
    """Nutation of a real satellite down to 20 % in 8 revolutions, by Euler's equations."""
    spinner = Spinner(
        inclination_deg=60.0, strength_t=3e-5, transverse_kg_m2=1.5, axial_kg_m2=1.8,
        momentum_n_m_s=0.1, orbital_rate_rad_s=1.1e-3,
    )  # fmt: skip
    evolution, start = EVOLUTIONS["nutation_damping"], Slow(1.0, 0.8, 0.0, 0.7)
    s = slow_time(evolution, evolution.case(1.0, spinner), start, 0.2)
    gain = gain_for(evolution, spinner, Times(s, s, s), 8.0).median
    law = NutationDampingRate(gain_a_m2_s_per_t=gain).law()
    states = by_euler(law, spinner, start, Fast(0.3, 0.4), [0.0, 16.0 * math.pi], rtol=1e-8)
    end = slow_variables(spinner, states)
    left = end.l[-1] * math.sin(end.theta[-1]) / math.sin(0.7)
    eps = evolution.small_parameter(gain, spinner)
    assert left == pytest.approx(0.2, abs=eps * 0.2)


def test_every_closed_law_has_a_goal():
    assert set(GOALS) == set(EVOLUTIONS)


def test_input_without_sense_is_refused():
    evolution, case = EVOLUTIONS["bdot"], case_of("bdot", 60.0)
    for part in (0.0, 1.0, math.inf, -2.0):
        with pytest.raises(ValueError, match=r"^part: must be positive, finite and not 1; rec"):
            slow_time(evolution, case, Slow(1.0, 0.5, 0.0, 0.5), part)
    spinner, times = Spinner(inclination_deg=60.0), Times(1.0, 1.0, 1.0)
    with pytest.raises(ValueError, match=r"^gain: must be positive and finite; received 0"):
        design_table(evolution, spinner, times, [0.0])
    with pytest.raises(ValueError, match=r"^revolutions: must be positive and finite; received"):
        gain_for(evolution, spinner, times, -1.0)
    with pytest.raises(ValueError, match=r"^count: must be at least 1; received 0"):
        even_directions(0)
