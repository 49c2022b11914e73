"""B-dot in its three forms: formulas, what cancels, and that it only ever brakes."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from law_cases import ZERO, inputs
from scipy.spatial.transform import Rotation

from torquer.computer.laws.bdot import (
    PREVIOUS_READING,
    Bdot,
    BdotDerivative,
    BdotRate,
    Gain,
    bdot_derivative,
    bdot_difference,
    bdot_rate,
)

MANY = settings(max_examples=80, deadline=None)
#: Whole nanoteslas and microradians per second: zero or not, but nothing whose square vanishes.
fields = st.tuples(*[st.integers(-60_000, 60_000).map(lambda n: 1e-9 * n)] * 3)
rates = st.tuples(*[st.integers(-500_000, 500_000).map(lambda n: 1e-6 * n)] * 3)
gains = st.floats(1.0, 1e6)


def lever_of(b, omega):
    """Size that a cross product can have."""
    return np.linalg.norm(b) * np.linalg.norm(omega)


def no_reading():
    """Memory of the finite difference at the start."""
    law = Bdot(gain_a_m2_s_per_t=1.0).law()
    return law.record_of(law.first_memory())


@MANY
@given(fields, rates, gains)
def test_rate_form_is_the_formula_and_its_torque_only_brakes(b, omega, gain):
    m = bdot_rate(inputs(b=b, omega=omega), Gain(gain), ())
    lever = lever_of(b, omega)
    assert m == pytest.approx(gain * np.cross(omega, b), rel=0.0, abs=1e-15 * gain * lever)
    power = np.dot(np.cross(m, b), omega)
    size = gain * lever**2
    assert power <= 1e-14 * size
    expected = -gain * np.sum(np.cross(omega, b) ** 2)
    assert power == pytest.approx(expected, rel=0.0, abs=1e-14 * size)


@MANY
@given(fields, rates, gains)
def test_torque_removes_only_the_rate_across_the_field(b, omega, gain):
    """-k (B^2 omega - B (B.omega)), as the module says."""
    torque = np.cross(bdot_rate(inputs(b=b, omega=omega), Gain(gain), ()), b)
    expected = -gain * (np.dot(b, b) * np.array(omega) - np.array(b) * np.dot(b, omega))
    size = gain * np.linalg.norm(b) * lever_of(b, omega)
    assert torque == pytest.approx(expected, rel=0.0, abs=1e-14 * size)


@MANY
@given(fields, rates, gains)
def test_derivative_follows_its_formula_and_rate_form_in_steady_field(b, omega, gain):
    b_rate = tuple(-np.cross(omega, b))
    m = bdot_derivative(inputs(b=b, b_rate=b_rate, omega=omega), Gain(gain), ())
    assert m == pytest.approx(-gain * np.array(b_rate), abs=0.0)
    same = bdot_rate(inputs(b=b, omega=omega), Gain(gain), ())
    assert m == pytest.approx(same, rel=0.0, abs=1e-15 * gain * lever_of(b, omega))


@MANY
@given(fields, fields, gains, st.floats(0.01, 100.0), st.floats(0.0, 1e6))
def test_difference_form_is_the_formula(before, b, gain, dt, t):
    memory = no_reading()
    assert bdot_difference(inputs(t, before), Gain(gain), memory) == ZERO
    m = bdot_difference(inputs(t + dt, b), Gain(gain), memory)
    steps = (t + dt) - t
    expected = -gain * np.subtract(b, before) / steps
    assert m == pytest.approx(expected, rel=1e-12, abs=1e-22 * gain)


@MANY
@given(fields, fields, fields, gains)
def test_a_constant_bias_cancels_in_the_difference(before, b, bias, gain):
    def answer(add):
        memory = no_reading()
        bdot_difference(inputs(0.0, np.add(before, add)), Gain(gain), memory)
        return bdot_difference(inputs(1.0, np.add(b, add)), Gain(gain), memory)

    assert answer(bias) == pytest.approx(answer(ZERO), abs=1e-19 * gain)


def test_difference_tends_linearly_to_the_derivative_with_the_interval():
    b0, omega, gain = np.array([2e-5, -1e-5, 3e-5]), np.array([0.02, 0.05, -0.03]), 1e5

    def field(t):  # a steady field seen from the turning body
        return Rotation.from_rotvec(-omega * t).apply(b0)

    errors = []
    for dt in (0.4, 0.2, 0.1):
        memory = no_reading()
        bdot_difference(inputs(10.0 - dt, field(10.0 - dt)), Gain(gain), memory)
        m = bdot_difference(inputs(10.0, field(10.0)), Gain(gain), memory)
        exact = gain * np.cross(omega, field(10.0))
        errors.append(np.linalg.norm(m - exact))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.05)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(1.0, abs=0.05)


def test_difference_remembers_the_last_reading_only():
    memory, gain = no_reading(), Gain(2.0)
    for t, b in ((0.0, 1.0), (1.0, 2.0), (3.0, 8.0)):
        m = bdot_difference(inputs(t, (b, 0.0, -b)), gain, memory)
    assert m == (-6.0, -0.0, 6.0)
    assert (memory.has_reading, memory.t_s) == (1.0, 3.0)
    assert memory.b_body_t.tolist() == [8.0, 0.0, -8.0]


@pytest.mark.parametrize(("gap_s", "taken"), [(2.0, True), (2.5, True), (2.6, False), (6e3, False)])
def test_no_difference_is_taken_across_a_gap(gap_s, taken):
    """The law not called through a mode, or a magnetometer that was silent: it starts afresh."""
    memory, gain = no_reading(), Gain(1e5)
    rows = [(0.0, 1e-5), (1.0, 2e-5), (1.0 + gap_s, -3e-5), (2.0 + gap_s, 1e-5)]
    found = [bdot_difference(inputs(t, (b, 0.0, 0.0)), gain, memory)[0] for t, b in rows]
    assert found[1] == pytest.approx(-1.0, rel=1e-12)
    assert found[2] == pytest.approx(5.0 / gap_s if taken else 0.0, rel=1e-12)
    assert found[3] == pytest.approx(-4.0, rel=1e-12)


def test_readings_at_uneven_intervals_are_all_used():
    """A magnetometer read every 0.7 s at control steps of 1 s: intervals of 0.7 and 1.4 s."""
    times = np.array([0.0, 0.7, 1.4, 2.8, 3.5, 4.9, 5.6])
    fields = 3e-5 * np.sin(0.3 * times)
    memory = no_reading()
    rows = zip(times, fields, strict=True)
    found = [bdot_difference(inputs(t, (b, 0.0, 0.0)), Gain(1.0), memory)[0] for t, b in rows]
    assert found[1:] == pytest.approx(-np.diff(fields) / np.diff(times), rel=1e-12)


@pytest.mark.parametrize("law", [bdot_rate, bdot_derivative, bdot_difference])
def test_no_field_no_dipole(law):
    memory = no_reading()
    for t in (0.0, 1.0, 2.0):
        m = law(inputs(t, ZERO, ZERO, (0.1, 0.2, 0.3)), Gain(1e5), memory)
        assert np.array_equal(np.abs(m), np.zeros(3))


@pytest.mark.parametrize(
    ("spec", "kernel", "memory"),
    [
        (Bdot, bdot_difference, PREVIOUS_READING),
        (BdotRate, bdot_rate, ()),
        (BdotDerivative, bdot_derivative, ()),
    ],
)
def test_specs_make_the_law_of_their_kind(spec, kernel, memory):
    law = spec(gain_a_m2_s_per_t=1e5).law()
    assert law.function is kernel
    assert law.memory == memory
    assert law.pack().tolist() == [1e5]
    assert spec(gain_a_m2_s_per_t=2e5).law().function is law.function  # compiled once for all gains
    for wrong in (0.0, -1.0):
        with pytest.raises(ValueError, match="greater than 0"):
            spec(gain_a_m2_s_per_t=wrong)
    with pytest.raises(ValueError, match="must be finite"):
        spec(gain_a_m2_s_per_t=float("nan"))
    with pytest.raises(ValueError, match="must be given; received nothing"):
        spec()
