"""MAG 2.2: formulas against the method of the small parameter, whole equations, a naive twin."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gallery.theory.steady_bdot import (
    PITCH,
    REST,
    ROLL,
    YAW,
    SteadyBdot,
    gravity_rates,
    mean_offset,
    motion_from_rest,
    published_offset,
    published_swing,
    steady_bdot_response,
)
from torquer.environment.field.averaged import b_orbital

CASE = SteadyBdot(ratio=0.5, eps=0.1, inclination_deg=50.0)
PRINTED = CASE.as_published()


def test_the_published_number():
    """'about 2.3 deg': 2.24."""
    assert math.degrees(published_offset(CASE).pitch) == pytest.approx(2.2415, abs=1e-4)


@pytest.mark.parametrize("ratio", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("inclination", [10.0, 60.0, 120.0])
def test_formula_agrees_with_the_small_parameter_method(ratio, inclination):
    case = SteadyBdot(ratio=ratio, eps=0.1, inclination_deg=inclination).as_published()
    response = steady_bdot_response(case)
    assert 0.1 * response.offset[PITCH] == pytest.approx(published_offset(case).pitch, rel=1e-9)
    assert response.offset[ROLL] == pytest.approx(0.0, abs=1e-9)
    free = sorted(abs(response.eigenvalues.imag))[-4:]
    expected = [math.sqrt(3.0 - 3.0 * ratio)] * 2 + [math.sqrt(4.0 - 3.0 * ratio)] * 2
    assert free == pytest.approx(expected, rel=1e-6)


def test_swing_from_rest_errs_by_second_power_of_eps():
    errors = []
    for eps in (4e-3, 2e-3, 1e-3):
        case = PRINTED.model_copy(update={"eps": eps})
        u, x = motion_from_rest(case, 2.0)
        pitch, roll, _ = published_swing(case, u)
        errors.append(max(np.abs(x[:, PITCH] - pitch).max(), np.abs(x[:, ROLL] - roll).max()))
    assert np.diff(np.log2(errors)) == pytest.approx([-2.0, -2.0], abs=0.1)


def test_the_whole_equations_keep_the_pitch_and_lose_the_roll():
    offset, formula = mean_offset(PRINTED), published_offset(PRINTED)
    assert offset.pitch == pytest.approx(formula.pitch, rel=0.02)
    assert abs(offset.roll) < 0.01 * abs(formula.roll)


def test_the_true_cone_leans_more():
    """Theta = 58.6 deg and not 50: the field turns farther."""
    ratio = steady_bdot_response(CASE).offset[PITCH] / steady_bdot_response(PRINTED).offset[PITCH]
    assert ratio == pytest.approx(1.2175, abs=1e-3)


def _naive(case, end):
    """Euler's equations in the body, quaternion to the inertial frame; dB/dt by differences."""
    inclination, cone = case.angles
    inertia = np.array([1.0, 1.0, case.ratio])

    def frame(u):  # X (motion, normal, up) to inertial axes on the orbit plane
        c, s = math.cos(u), math.sin(u)
        return np.array([[-s, 0.0, c], [c, 0.0, s], [0.0, 1.0, 0.0]])

    def field(u):
        return frame(u) @ np.array(b_orbital(1.0, u, inclination, cone))

    def rates(u, y):
        q, w = Rotation.from_quat(y[:4]), y[4:]
        b = q.inv().apply(field(u))
        slope = q.inv().apply((field(u + 1e-4) - field(u - 1e-4)) / 2e-4) - np.cross(w, b)
        up = q.inv().apply(frame(u)[:, 2])
        torque = case.eps * np.cross(-slope, b) + 3.0 * np.cross(up, inertia * up)
        turn = (q * Rotation.from_quat([*w, 0.0])).as_quat() if np.any(w) else np.zeros(4)
        turn = turn * 0.5 * np.linalg.norm(w)
        return [*turn, *((torque - np.cross(w, inertia * w)) / inertia)]

    first = Rotation.from_matrix(frame(0.0)).as_quat()
    run = solve_ivp(rates, (0.0, end), [*first, 0.0, 1.0, 0.0], rtol=1e-9, atol=1e-11)
    to_x = frame(end).T @ Rotation.from_quat(run.y[:4, -1]).as_matrix()
    return to_x[:, 2], run.y[4:, -1]


def test_the_equations_in_resal_axes_are_those_of_the_body():
    case = SteadyBdot(ratio=0.7, eps=0.3, inclination_deg=65.0)
    u, x = motion_from_rest(case, 0.8, per_revolution=10)
    axis, omega = _naive(case, u[-1])
    alpha, beta, gamma = x[-1, [PITCH, ROLL, YAW]]
    expected = [math.sin(alpha) * math.cos(beta), -math.sin(beta), math.cos(alpha) * math.cos(beta)]
    assert axis == pytest.approx(expected, abs=1e-6)
    c, s = math.cos(gamma), math.sin(gamma)
    w1, w2, w3 = x[-1, :3]
    assert omega == pytest.approx([c * w1 + s * w2, c * w2 - s * w1, w3], abs=1e-6)


def test_gravity_alone_keeps_the_vertical():
    assert not gravity_rates(0.5, REST).any()


@pytest.mark.parametrize(
    ("keys", "where"),
    [({"ratio": 1.0}, "ratio"), ({"eps": 0.0}, "eps"), ({"inclination_deg": 181.0}, "inclination")],
)
def test_input_without_sense_is_refused(keys, where):
    given = {"ratio": 0.5, "eps": 0.1, "inclination_deg": 50.0}
    with pytest.raises(ValueError, match=where):
        SteadyBdot(**(given | keys))
