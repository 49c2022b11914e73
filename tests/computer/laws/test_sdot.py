"""S-dot: the formulas, what it does without the Sun, and in flight through eclipses."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from law_cases import ZERO, inputs
from scipy.spatial.transform import Rotation

from torquer.compile import engine
from torquer.computer.laws.bdot import Gain as BdotGain, bdot_rate
from torquer.computer.laws.sdot import Gain, Sdot, SdotRate, cos_alpha, sdot_difference, sdot_rate
from torquer.simulation.setup.simulate import simulate

MANY = settings(max_examples=30, deadline=None)
numbers = st.floats(-1.0, 1.0)
vectors = st.tuples(numbers, numbers, numbers).filter(lambda v: np.linalg.norm(v) > 0.01)
gains = st.floats(1.0, 1e5)
MODELS = {"model_b": (2e-5, -1e-5, 3e-5), "model_sun": (0.6, 0.0, 0.8)}
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
COS_ALPHA = (0.6 * 2.0 + 0.8 * 3.0) / np.sqrt(14.0)
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="a flight of hours")


def unit(v):
    return np.array(v) / np.linalg.norm(v)


def no_reading():
    law = Sdot(gain_a_m2_s=1.0).law()
    return law.record_of(law.first_memory())


def answers(gain, *rows, memory=None):
    """Answers to (time, direction to the Sun) one after another."""
    memory = no_reading() if memory is None else memory
    known = [inputs(t, sun=sun, **MODELS) for t, sun in rows]
    return np.array([sdot_difference(row, Gain(gain), memory) for row in known])


# ------------------------------------------------------------ formulas


@MANY
@given(vectors, vectors, vectors, vectors, gains)
def test_rate_form_is_the_formula(omega, sun, b, model_sun, gain):
    """SDOT (1.16) in NumPy, the angle alpha by its cosine."""
    sun, model_sun = unit(sun), unit(model_sun)
    found = sdot_rate(inputs(omega=omega, sun=sun, model_b=b, model_sun=model_sun), Gain(gain), ())
    alpha = np.arccos(np.clip(unit(b) @ model_sun, -1.0, 1.0))
    expected = gain * np.cos(alpha) * np.cross(omega, sun)
    assert found == pytest.approx(expected, rel=0.0, abs=1e-14 * gain)


@MANY
@given(vectors, vectors, gains)
def test_s_dot_with_field_for_sun_is_b_dot(omega, b, gain):
    """SDOT 1.5: S = B, alpha = 0 makes it (1.14), here per unit of the field's strength."""
    row = inputs(b=b, omega=omega, sun=unit(b), model_b=b, model_sun=unit(b))
    expected = np.array(bdot_rate(row, BdotGain(gain), ())) / np.linalg.norm(b)
    assert sdot_rate(row, Gain(gain), ()) == pytest.approx(expected, rel=0.0, abs=1e-14 * gain)


@MANY
@given(vectors, vectors, vectors, gains, st.floats(0.01, 100.0))
def test_difference_form_is_the_formula(first, before, now, gain, dt):
    """SDOT (1.17); the first interval tells how long one lasts."""
    rows = [(k * dt, unit(v)) for k, v in enumerate((first, before, now))]
    found = answers(gain, *rows)
    expected = -gain * COS_ALPHA * (unit(now) - unit(before)) / (2.0 * dt - dt)
    assert np.array_equal(found[:2], np.zeros((2, 3)))
    assert found[2] == pytest.approx(expected, rel=1e-12, abs=1e-13 * gain / dt)


def test_difference_tends_linearly_to_rate_form_with_the_interval():
    omega, sun, gain = np.array([0.02, 0.05, -0.03]), unit([1.0, -2.0, 0.5]), 1e3

    def seen(t):  # a Sun at rest seen from the turning body
        return Rotation.from_rotvec(-omega * t).apply(sun)

    errors = []
    for dt in (0.4, 0.2, 0.1):
        m = answers(gain, *((10.0 - k * dt, seen(10.0 - k * dt)) for k in (2, 1, 0)))[-1]
        exact = sdot_rate(inputs(omega=omega, sun=seen(10.0), **MODELS), Gain(gain), ())
        errors.append(np.linalg.norm(m - exact))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.05)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(1.0, abs=0.05)


def test_alpha_goes_on_between_two_readings():
    memory, gain = no_reading(), 1e3
    first = answers(gain, (0.0, (1.0, 0.0, 0.0)), (1.0, (0.8, 0.6, 0.0)), (2.0, (0.6, 0.8, 0.0)),
                 memory=memory)[-1]  # fmt: skip
    later = inputs(2.0, sun=(0.6, 0.8, 0.0), model_b=(0.0, 0.0, 2e-5), model_sun=(0.6, 0.0, 0.8))
    m = sdot_difference(later._replace(t_s=2.5), Gain(gain), memory)
    assert m == pytest.approx(first * 0.8 / COS_ALPHA, rel=1e-12)


def test_no_field_in_the_model_no_dipole():
    row = inputs(omega=(0.1, 0.2, 0.3), sun=X, model_b=ZERO, model_sun=Z)
    assert cos_alpha(row.ephemeris) == 0.0
    assert np.array_equal(np.abs(sdot_rate(row, Gain(1e3), ())), np.zeros(3))


# ------------------------------------------------------------ without the Sun


def test_without_the_sun_there_is_no_dipole():
    assert np.all(sdot_rate(inputs(omega=(0.1, 0.2, 0.3), **MODELS), Gain(1e3), ()) == np.zeros(3))
    found = answers(1e3, (0.0, X), (1.0, Y), (2.0, Z), (3.0, ZERO), (4.0, ZERO))
    assert np.abs(found[2]).max() > 100.0 and np.all(found[3:] == 0.0)


def test_the_difference_starts_afresh_after_a_reading_without_the_sun():
    """However short the loss: the reading after it has none before it to be compared with."""
    found = answers(1e3, (0.0, X), (1.0, Y), (2.0, Z), (3.0, ZERO), (4.0, Y), (5.0, X))
    assert np.all(found[4] == 0.0)
    assert found[5] == pytest.approx(-1e3 * COS_ALPHA * np.array([1.0, -1.0, 0.0]), rel=1e-12)


@pytest.mark.parametrize(("gap_s", "taken"), [(2.0, True), (2.5, True), (2.6, False), (2e3, False)])
def test_no_difference_is_taken_across_a_gap(gap_s, taken):
    """The law not called through an eclipse: it does not know of the loss of the Sun."""
    found = answers(1e3, (0.0, X), (1.0, Y), (2.0, X), (2.0 + gap_s, Y), (3.0 + gap_s, Z))
    assert np.any(found[3] != 0.0) == taken
    assert np.any(found[4] != 0.0)


def test_single_call_before_a_gap_is_not_an_interval():
    found = answers(1e3, (0.0, X), (2e3, Y), (2001.0, Z))
    assert np.all(found[:2] == 0.0) and np.any(found[2] != 0.0)


def test_readings_at_uneven_intervals_are_all_used():
    """A sensor read every 0.7 s at control steps of 1 s: intervals of 0.7 and 1.4 s."""
    times = np.array([0.0, 0.7, 1.4, 2.8, 3.5, 4.9, 5.6])
    suns = [(np.cos(0.1 * t), np.sin(0.1 * t), 0.0) for t in times]
    found = answers(1.0, *zip(times, suns, strict=True))
    expected = -COS_ALPHA * np.diff(suns, axis=0) / np.diff(times)[:, None]
    assert found[2:] == pytest.approx(expected[1:], rel=1e-12)


def test_between_two_readings_the_difference_stays():
    memory, rows = no_reading(), [(0.0, X), (1.0, Y), (2.0, Z)]
    last = answers(1e3, *rows, memory=memory)[-1]
    again = inputs(2.0, sun=Z, **MODELS)._replace(t_s=2.4)
    assert sdot_difference(again, Gain(1e3), memory) == pytest.approx(last, rel=1e-15)


# ------------------------------------------------------------ in flight

FLIGHT = {
    "orbit.altitude_km": 550.0,
    "orbit.inclination_deg": 20.0,
    "environment.sun_direction": [1.0, 0.0, 0.0],
    "initial.rate_deg_s": [0.3, -0.4, 0.5],
    "simulation": {"duration_s": 7200.0, "record_s": 1.0, "step_s": 1.0},
}
DIFFERENCE = {"kind": "sdot", "gain_a_m2_s": 500.0}
#: The law is called in sunlight alone.
IN_THE_LIGHT = {
    "laws": {"sdot": DIFFERENCE},
    "modes": {
        "states": {
            "pointing": {
                "laws": ["sdot"],
                "transitions": [{"to": "shadow", "when": {"signal": "sun_in_view", "below": 0.5}}],
            },
            "shadow": {
                "transitions": [{"to": "pointing", "when": {"signal": "sun_in_view", "above": 0.5}}]
            },
        }
    },
}


@needs_jit
@pytest.mark.parametrize("control", [{"law": DIFFERENCE}, IN_THE_LIGHT], ids=["always", "by modes"])
def test_through_an_eclipse(make, control):
    """Every command is the formula of the readings; none is from a difference across the dark."""
    run = simulate(make({**FLIGHT, "control": control}))
    command, sun = run["command_body"].values, run["sun_measured"].values
    b, to_sun = run["b_inertial"].values, run["sun_inertial"].values
    alpha = np.sum(b * to_sun, axis=1) / np.linalg.norm(b, axis=1)
    expected = np.zeros_like(command)
    expected[1:] = -500.0 * alpha[1:, None] * np.diff(sun, axis=0)
    seen = np.any(sun != 0.0, axis=1)
    (lost,), (back,) = (np.flatnonzero(np.diff(seen.astype(int)) == k) + 1 for k in (-1, 1))
    assert back - lost > 1500
    expected[:2] = expected[lost : back + 1] = 0.0
    assert command[:-1] == pytest.approx(expected[:-1], abs=1e-10)  # nothing is read at the end
    assert np.abs(command[[lost - 1, back + 1]]).max(axis=1).min() > 0.1


def test_specs_make_the_law_of_their_kind():
    for spec, kernel in ((Sdot, sdot_difference), (SdotRate, sdot_rate)):
        law = spec(gain_a_m2_s=60.0).law()
        assert law.function is kernel and law.pack().tolist() == [60.0]
        assert {"sun", "ephemeris"} <= law.needs
        with pytest.raises(ValueError, match="greater than 0"):
            spec(gain_a_m2_s=0.0)
    assert "rate" not in Sdot(gain_a_m2_s=1.0).law().needs
