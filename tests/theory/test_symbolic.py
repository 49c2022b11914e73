"""Symbolic averages of the laws that fly: they are the equations of the books."""

import math

import numpy as np
import pytest

import torquer
from torquer.computer.laws.bdot import Bdot, BdotDerivative, BdotRate
from torquer.computer.laws.nutation_damping import NutationDampingRate
from torquer.computer.laws.preliminary_1 import Preliminary1
from torquer.computer.laws.preliminary_2 import Preliminary2
from torquer.computer.laws.reorientation import Reorientation
from torquer.computer.laws.spin_up import SpinUp
from torquer.environment.field.averaged import cone_angle
from torquer.theory.slow.averaging import averaged_rates, nodes
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.spinner import Spinner

sympy = pytest.importorskip("sympy")
from torquer.theory.symbolic import (  # noqa: E402
    as_latex,
    averaged_equations,
    axial,
    length,
    momentum,
    p,
    rate,
    rho,
    sigma,
    strength,
    theta,
    transverse,
)

K, L1, L2, L3 = sympy.symbols("k L1 L2 L3", real=True)
ACROSS = 2 * p + (1 - 3 * p) * sympy.sin(rho) ** 2
PATH = (3 * p - 1) * sympy.sin(rho) * sympy.cos(rho)
SIN, COS = sympy.sin(theta), sympy.cos(theta)
INERTIA = {"inertia": (transverse, transverse, axial, 0.0, 0.0, 0.0)}
ROUND = {"inertia_kg_m2": (1.0, 1.0, 1.0)}
UP = {"target": (0, 0, 1)}


def assert_zero(expression):
    assert sympy.simplify(sympy.expand_trig(expression)) == 0


def assert_equations(found, eps, *expected):
    """l', rho', theta' are eps times these, and sigma' = 0."""
    for one, other in zip((found.l, found.rho, found.theta), expected, strict=True):
        assert_zero(one - eps * other)
    assert found.sigma == 0


def test_b_dot():
    """MAG (2.1.9)."""
    eps = K * strength**2 / (rate * axial)
    g = COS**2 + axial / transverse * SIN**2
    half = (1 - axial / transverse) / 2
    expected = (-length * ACROSS * g, PATH * g, half * (2 - ACROSS) * SIN * COS)
    for spec in (BdotRate, BdotDerivative):
        found = averaged_equations(spec(gain_a_m2_s_per_t=1.0).law(), {"gain": K})
        assert_equations(found, eps, *expected)


def test_nutation_damping():
    """MAG (3.1.3)."""
    found = averaged_equations(NutationDampingRate(gain_a_m2_s_per_t=1.0).law(), {"gain": K})
    eps, half = K * strength**2 / (rate * transverse), sympy.Rational(1, 2)
    expected = (-half * length * ACROSS * SIN**2, half * PATH * SIN**2, -half * ACROSS * SIN * COS)
    assert_equations(found, eps, *expected)


def test_spin_up():
    """MAG (3.2.2)."""
    found = averaged_equations(SpinUp(gain_a_m2_per_t=1.0).law(), {"gain": K})
    eps = K * strength**2 / (rate * momentum)
    turn = -(2 - ACROSS) * SIN / (2 * length)
    assert_equations(found, eps, ACROSS * COS, -PATH * COS / length, turn)


def test_preliminary_1():
    """MAG (3.4.3)."""
    found = averaged_equations(Preliminary1(gain_a_m2_per_t=1.0, **UP).law(), {"gain": K})
    eps = K * strength**2 / (rate * momentum)
    cr, sr = sympy.cos(rho), sympy.sin(rho)
    fall = -p * (1 - SIN**2 / 2) * sr / length
    assert_equations(found, eps, p * cr * SIN**2, fall, p * SIN * COS * cr / length)


def test_preliminary_2():
    """MAG (3.5.2), of the law with L/|L|."""
    law = Preliminary2(gain_a_m2_per_t=1.0, **UP, **ROUND).law()
    found = averaged_equations(law, {"gain": K, **INERTIA})
    eps = K * strength**2 / (rate * momentum)
    pull = p * sympy.cos(rho) - ACROSS / 2
    fall = -p * (1 - SIN**2 / 2) * sympy.sin(rho) + PATH * SIN**2 / 2
    expected = (SIN**2 * pull, fall / length, SIN * COS * pull / length)
    assert_equations(found, eps, *expected)


def test_pure_spin_reorientation_contradicts_the_printed_second_equation():
    """MAG (3.3.2): p stands where p cos^2 rho + q sin^2 rho comes out."""
    law = Reorientation(gain_a_m2_per_n_m_s_t=1.0, momentum_n_m_s=1.0, **UP, **ROUND).law()
    target = {"target": (L1, L2, L3), "momentum": momentum}
    found = averaged_equations(law, {"gain": K, **INERTIA, **target})
    eps = K * strength**2 / rate
    cs, ss, cr, sr = sympy.cos(sigma), sympy.sin(sigma), sympy.cos(rho), sympy.sin(rho)
    a, b = L1 * cr * cs + L2 * cr * ss - L3 * sr, L2 * cs - L1 * ss
    pure = {theta: 0}
    assert_zero(found.l.subs(pure))
    assert_zero(found.rho.subs(pure) - eps * p * a / length)
    open_part = p * cr**2 + (1 - 2 * p) * sr**2
    assert_zero(found.sigma.subs(pure) - eps * open_part * b / (length * sr))
    printed = sympy.simplify(found.sigma.subs(pure) - eps * p * b / (length * sr))
    assert printed != 0


def test_any_polynomial_law_agrees_with_its_numeric_average():
    """A law of the user's own, that singles out body axes."""

    @torquer.law(parameters={"gain": 3.0})
    def mine(inputs, parameters, memory):
        x, y, z = inputs.omega_body_rad_s
        bx, by, bz = inputs.b_body_t
        return (parameters.gain * bx * by, 0.5 * (z * bx - x * bz), y * bz)

    spinner = Spinner(inclination_deg=63.0, transverse_kg_m2=1.7, axial_kg_m2=1.2)
    slow = Slow(0.8, 0.9, 0.4, 1.1)
    found = averaged_equations(mine)
    square = 0.5 * math.sin(cone_angle(math.radians(63.0))) ** 2
    numbers = {length: 0.8, rho: 0.9, sigma: 0.4, theta: 1.1, p: square}
    numbers |= {momentum: 1, strength: 1, transverse: 1.7, axial: 1.2, rate: 1}
    by_formula = [float(equation.subs(numbers)) for equation in found]
    expected = averaged_rates(mine, spinner, slow, nodes(16, 16, 16))
    assert np.abs(expected).max() > 0.01
    assert by_formula == pytest.approx(tuple(expected), rel=1e-10, abs=1e-12)


def test_latex():
    found = averaged_equations(SpinUp(gain_a_m2_per_t=1.0).law(), {"gain": K})
    text = as_latex(found)
    lines = text.splitlines()
    assert lines[0] == r"\begin{aligned}" and lines[-1] == r"\end{aligned}"
    assert [line.split("'")[0] for line in lines[1:-1]] == ["l", r"\rho", r"\sigma", r"\theta"]
    assert lines[3] == r"\sigma' &= 0 \\"
    assert r"\frac{B_{0}^{2} k" in lines[1] and r"L_{0} l \omega_{0}" in lines[2]


@torquer.law
def rooted(inputs, parameters, memory):
    x = inputs.b_body_t[0]
    return (math.sqrt(x * x + 1.0), 0.0, 0.0)


@torquer.law
def divided(inputs, parameters, memory):
    return (inputs.b_body_t[0] / inputs.b_body_t[1], 0.0, 0.0)


@pytest.mark.parametrize("law", [rooted, divided], ids=["root", "quotient"])
def test_other_laws_are_refused(law):
    message = f"^law {law.name}: must be a polynomial in field, rate and direction cosines"
    with pytest.raises(ValueError, match=message):
        averaged_equations(law)


def test_memory_and_unknown_symbols_are_refused():
    with pytest.raises(ValueError, match=r"^law bdot: must have no memory to be averaged"):
        averaged_equations(Bdot(gain_a_m2_s_per_t=1.0).law())
    law = BdotRate(gain_a_m2_s_per_t=1.0).law()
    with pytest.raises(ValueError, match=r"^law bdot_rate: must have the parameters speed"):
        averaged_equations(law, {"speed": K})
