"""Averages of the laws that fly, by brute force, against the closed equations of the books."""

import math

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys
from scipy.optimize import brentq

import torquer
from torquer.compile import engine
from torquer.compile.engine import kernel
from torquer.computer.blocks.law import Law
from torquer.computer.laws.bdot import Bdot, BdotDerivative, BdotModel, BdotRate, bdot_rate
from torquer.computer.laws.nutation_damping import NutationDampingRate
from torquer.computer.laws.preliminary_1 import Preliminary1
from torquer.computer.laws.reorientation import Reorientation
from torquer.computer.laws.sdot import SdotRate
from torquer.environment.field.averaged import cone_angle
from torquer.theory.slow.averaging import (
    averaged_motion,
    averaged_rates,
    converged_nodes,
    mean_rates,
    nodes,
)
from torquer.theory.slow.evolution import EVOLUTIONS
from torquer.theory.slow.evolution.model import Slow, compile_rates
from torquer.theory.slow.evolution.reorientation import REORIENTATION_AS_PRINTED

LAWS = sorted(set(EVOLUTIONS) - {"reorientation_as_printed"})
GAIN = 2e5
#: Inclination at which 3p = 1: the field is even in all directions.
EVEN_DEG = math.degrees(
    brentq(lambda i: math.tan(cone_angle(i)) - math.sqrt(2.0), 0.1, 1.5, xtol=1e-15)
)


def random_points(count, seed=5):
    """(inclination [deg], slow variables), away from the singular points."""
    rng = np.random.default_rng(seed)
    low, high = (5.0, 0.2, 0.1, 0.0, 0.1), (175.0, 2.0, 3.0, 2.0 * math.pi, 3.0)
    for row in rng.uniform(low, high, (count, 5)):
        yield row[0], Slow(*row[1:].tolist())


def assert_same(found, expected, tolerance=1e-12):
    size = np.abs(expected).max()
    assert size > 0.0
    assert found == pytest.approx(expected, rel=0.0, abs=tolerance * size)


@pytest.mark.parametrize("name", LAWS)
def test_closed_equations_are_the_averages_of_the_law(name, spin_laws, satellite):
    law, target = spin_laws(GAIN)[name]
    models = ("averaged", "direct_dipole", "tilted_dipole")
    for model in models if EVOLUTIONS[name].any_field else models[:1]:
        for inclination, slow in random_points(8):
            spinner = satellite(inclination, field=model, tilt_deg=160.0)
            if name == "reorientation":  # its closed equations are those of a pure spin
                slow = slow._replace(theta=0.0)
            closed = np.array(
                EVOLUTIONS[name].rates(slow, EVOLUTIONS[name].case(GAIN, spinner, target))
            )
            found = np.array(averaged_rates(law, spinner, slow))
            if name == "reorientation":
                found[3] = 0.0  # theta has no average where it vanishes
            assert_same(found, closed)


def test_general_and_special_form_of_b_dot_agree(satellite):
    for inclination, slow in random_points(20):
        case = EVOLUTIONS["bdot"].case(GAIN, satellite(inclination))
        assert_same(
            np.array(EVOLUTIONS["bdot_any_field"].rates(slow, case)),
            np.array(EVOLUTIONS["bdot"].rates(slow, case)),
        )


def test_reorientation_as_printed_is_not_the_average(satellite, spin_laws):
    """The second equation is off unless the target lies along the cone axis, or p = q."""
    law, target = spin_laws(GAIN)["reorientation"]
    slow = Slow(1.0, 0.9, 0.4, 0.0)
    for inclination, agrees in ((80.0, False), (EVEN_DEG, True), (20.0, False)):
        spinner = satellite(inclination)
        printed = REORIENTATION_AS_PRINTED.rates(
            slow, REORIENTATION_AS_PRINTED.case(GAIN, spinner, target)
        )
        found = averaged_rates(law, spinner, slow)
        assert found.rho == pytest.approx(printed.rho, rel=1e-12)
        assert (found.sigma == pytest.approx(printed.sigma, rel=1e-9)) == agrees


def test_printed_second_law_with_unnormalised_momentum_averages_differently(satellite):
    """MAG (3.5.1) as printed has L in place of L/|L|: then (3.5.2) would hold at l = 1 alone."""
    inertia = (1.7, 1.7, 1.2)
    law = Reorientation(
        gain_a_m2_per_n_m_s_t=GAIN / 0.3,
        target=(0, 0, 1),
        momentum_n_m_s=0.3,
        inertia_kg_m2=inertia,
    ).law()
    spinner = satellite(30.0)
    evolution = EVOLUTIONS["preliminary_2"]
    case = evolution.case(GAIN, spinner)
    for length, agrees in ((1.0, True), (0.5, False)):
        slow = Slow(length, 0.8, 0.2, 0.9)
        closed = np.array(evolution.rates(slow, case))
        found = np.array(averaged_rates(law, spinner, slow))
        assert (found == pytest.approx(closed, rel=1e-9, abs=1e-15)) == agrees


def test_rate_and_derivative_forms_agree_in_fast_rotation_only(satellite):
    rate, derivative = BdotRate(gain_a_m2_s_per_t=GAIN), BdotDerivative(gain_a_m2_s_per_t=GAIN)
    slow = Slow(0.7, 0.9, 0.4, 1.1)
    for model in ("averaged", "direct_dipole", "tilted_dipole"):
        fast, slower = (satellite(50.0, field=model, field_turn=turn) for turn in (False, True))
        expected = np.array(averaged_rates(rate.law(), fast, slow))
        assert_same(np.array(averaged_rates(derivative.law(), fast, slow)), expected)
        assert_same(np.array(averaged_rates(rate.law(), slower, slow)), expected)
        off = np.array(averaged_rates(derivative.law(), slower, slow)) - expected
        # the field's turn, 2 omega0, against the rate of the body, L/A
        part = np.abs(off).max() / np.abs(expected).max()
        assert 1e-3 < part < 10.0 * 2.0 * 1.1e-3 / (0.7 * 0.3 / 1.7)


def test_the_field_turn_is_what_b_dot_ends_with(satellite):
    """A body at rest is spun up: torque -k <B x dB/dt>, dB/dt the field's own, by quadrature."""
    law = BdotDerivative(gain_a_m2_s_per_t=GAIN).law()
    spinner = satellite(50.0, field_turn=True)
    p, b0, rate = spinner.moments()[0], spinner.strength_t, spinner.orbital_rate_rad_s
    # B turns about Z3 at 2 omega0: <B x B'> = 2 omega0 B0^2 sin^2 Theta along Z3 after averaging
    torque = GAIN * b0**2 * 2.0 * rate * 2.0 * p
    slow = Slow(1e-9, 1e-3, 0.0, 1.0)
    found = averaged_rates(law, spinner, slow)
    assert found.l == pytest.approx(torque / (0.3 * rate), rel=1e-5)


def polynomial_cases():
    yield BdotRate(gain_a_m2_s_per_t=1.0).law(), [3, 1, 3, 3]
    yield NutationDampingRate(gain_a_m2_s_per_t=1.0).law(), [3, 1, 3, 3]
    yield NutationDampingRate(gain_a_m2_s_per_t=1.0, axis=(0.1, 0.0, 1.0)).law(), [3, 3, 3, 3]


@pytest.mark.parametrize(("law", "counts"), list(polynomial_cases()))
@pytest.mark.parametrize("model", ["averaged", "direct_dipole", "tilted_dipole"])
def test_settled_nodes_are_few_and_enough(law, counts, model, satellite):
    spinner = satellite(70.0, field=model)
    found = converged_nodes(law, spinner)
    expected = counts if model == "tilted_dipole" else [*counts[:3], 1]
    assert [len(at) for at in found] == expected
    for inclination, slow in random_points(4, seed=8):
        here = satellite(inclination, field=model)
        many = nodes(16, 16, 16, 16 if model == "tilted_dipole" else 1)
        by_many = np.array(averaged_rates(law, here, slow, many))
        assert_same(np.array(averaged_rates(law, here, slow, found)), by_many, 1e-11)


def test_laws_that_switch_need_a_coarser_tolerance(satellite):
    law, spinner = Preliminary1(relay_dipole_a_m2=0.8, target=(0, 0, 1)).law(), satellite(60.0)
    message = (
        "law preliminary_1: averages must converge to 1e-09 within 40 nodes per angle; the last"
    )
    with pytest.raises(ValueError, match=f"^{message} doubling changed them by 0.0"):
        converged_nodes(law, spinner, most=40)
    assert len(converged_nodes(law, spinner, tolerance=0.2, most=40).half_psi) > 3


def test_a_user_law_is_averaged_as_any_other(satellite):
    @torquer.law(parameters={"gain": GAIN})
    def mine(inputs, parameters, memory):
        x, y, z = inputs.omega_body_rad_s
        bx, by, bz = inputs.b_body_t
        k = parameters.gain
        return (k * (y * bz - z * by), k * (z * bx - x * bz), k * (x * by - y * bx))

    slow, spinner = Slow(0.7, 0.9, 0.4, 1.1), satellite(50.0)
    bdot = np.array(averaged_rates(BdotRate(gain_a_m2_s_per_t=GAIN).law(), spinner, slow))
    assert_same(np.array(averaged_rates(mine, spinner, slow)), bdot)


@kernel
def averages_often(problem, times):
    total = 0.0
    for i in range(times):
        total += mean_rates(problem, Slow(1.0, 0.5 + 1e-4 * i, 0.2, 0.9)).l
    return total


@pytest.mark.skipif(not engine.COMPILED, reason="counts what compiled code allocates")
def test_averaging_allocates_nothing(satellite):
    problem = averaged_motion(
        BdotRate(gain_a_m2_s_per_t=1.0).law(), satellite(50.0), nodes(3, 3, 3)
    )
    averages_often(problem, 2)
    on = _nrt_python.memsys_stats_enabled()
    _nrt_python.memsys_enable_stats()
    counts = []
    try:
        for times in (10, 1000):
            before = rtsys.get_allocation_stats().alloc
            averages_often(problem, times)
            counts.append(rtsys.get_allocation_stats().alloc - before)
    finally:
        if not on:
            _nrt_python.memsys_disable_stats()
    assert counts[0] == counts[1] <= 8


def navigating(inputs, parameters, memory):
    return inputs.ephemeris.r_inertial_m


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (
            Bdot(gain_a_m2_s_per_t=1.0).law(),
            r"law bdot: must have no memory to be averaged .* received 9 cells",
        ),
        (
            Law("far", navigating, needs={"ephemeris"}),
            r"law far: must be defined by field, Sun, rate and attitude alone .* received \(nan",
        ),
    ],
)
def test_laws_without_an_average_are_refused(law, message, satellite):
    with pytest.raises(ValueError, match=f"^{message}"):
        averaged_motion(law, satellite(50.0))


def test_laws_that_need_the_sun_are_refused_without_it(satellite):
    law, dark = SdotRate(gain_a_m2_s=1.0).law(), satellite(50.0, sun=None)
    with pytest.raises(ValueError, match=r"^sun: must be given for law sdot_rate; received none"):
        averaged_motion(law, dark)
    with pytest.raises(ValueError, match=r"^sun: must be given for evolution sdot; received none"):
        EVOLUTIONS["sdot"].case(1.0, dark)
    assert EVOLUTIONS["sdot"].case(1.0, satellite(50.0)).target == (0.36, -0.48, 0.8)


def test_law_that_ignores_an_allowed_sun_needs_none(satellite):
    """It hands its inputs on, so that its needs are all that there is."""

    @torquer.law(parameters={"gain": GAIN})
    def mine(inputs, parameters, memory):
        return bdot_rate(inputs, parameters, memory)

    slow, dark = Slow(0.7, 0.9, 0.4, 1.1), satellite(50.0, sun=None)
    assert "sun" in mine.needs
    bdot = np.array(averaged_rates(BdotRate(gain_a_m2_s_per_t=GAIN).law(), dark, slow))
    assert_same(np.array(averaged_rates(mine, dark, slow)), bdot)


def test_law_with_on_board_models_averages_like_one_with_sensors(satellite):
    """B-dot by the field model and the attitude: the model is exact."""
    slow = Slow(0.7, 0.9, 0.4, 1.1)
    for field_turn in (False, True):
        spinner = satellite(50.0, field_turn=field_turn)
        laws = (spec(gain_a_m2_s_per_t=GAIN).law() for spec in (BdotModel, BdotDerivative))
        one, other = (np.array(averaged_rates(law, spinner, slow)) for law in laws)
        assert_same(one, other)


def test_numbers_without_sense_are_refused(satellite):
    with pytest.raises(ValueError, match=r"^nodes: phi must be at least 1; received 0"):
        nodes(phi=0)
    with pytest.raises(ValueError, match="axial_kg_m2: must not exceed twice transverse_kg_m2"):
        satellite(50.0, axial_kg_m2=3.5)
    with pytest.raises(ValueError, match=r"evolution spin_up: field must be averaged .* direct"):
        EVOLUTIONS["spin_up"].case(1.0, satellite(50.0, field="direct_dipole"))


def test_compiled_equations_are_the_plain_ones(satellite):
    slow = Slow(0.7, 0.9, 0.4, 1.1)
    for evolution in EVOLUTIONS.values():
        case = evolution.case(GAIN, satellite(50.0), (0.2, 0.5, 0.7))
        compiled = compile_rates(evolution.rates)
        by_machine = getattr(compiled, "compiled", compiled)(slow, case)
        plain = getattr(evolution.rates, "py_func", evolution.rates)
        assert tuple(by_machine) == pytest.approx(tuple(plain(slow, case)), rel=1e-13, abs=1e-20)
