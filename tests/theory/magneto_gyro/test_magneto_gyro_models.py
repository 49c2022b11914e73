"""Models of the magneto-gyroscopic system: the text's rows against the exact periodic loops."""

import math

import numpy as np
import pytest

from torquer.computer.laws.magneto_gyro.stage_2 import Gyrostat, Stage2Gains
from torquer.theory.magneto_gyro.frozen import (
    STATES_1,
    STATES_2,
    frozen_1,
    frozen_1_inputs,
    frozen_2,
    frozen_2_inputs,
)
from torquer.theory.magneto_gyro.loop import CONE, Satellite
from torquer.theory.magneto_gyro.stage_1 import STAGE_1, stage_1_driven_by
from torquer.theory.magneto_gyro.stage_2 import driven_by, stage_2_loop

CRAFT = Gyrostat(stiffness=6.46, pitch_inertia=0.595)
AXISYMMETRIC = Satellite(1.0, 0.595, 1.0, 6.46 + 2.0 - 0.595, 0.0)
TAUS = np.linspace(0.1, 6.2, 7)


def pair(t, first, second, cos, sin):
    """Rows t[first], t[second]: components along t' and s' of those along t and s, at columns."""
    t[0, first], t[0, second] = cos, -sin
    t[1, first], t[1, second] = sin, cos


def turn(tau, size, places):
    """Rows by the names of `places`: (t' part, s' part) of each pair (t column, s column)."""
    rows = {}
    for (across, along), (first, second) in places.items():
        part = np.zeros((2, size))
        pair(part, first, second, math.cos(tau), math.sin(tau))
        rows[across], rows[along] = part
    return rows


def to_states_2(tau):
    """The text's states of stage 2 from the loop's."""
    pairs = {("phi", "chi"): (0, 2), ("phi'", "chi'"): (3, 5), ("X1", "Z1"): (6, 8),
             ("X2", "Z2"): (9, 11), ("Y3", "Y4"): (12, 14)}  # fmt: skip
    rows, one = turn(tau, 15, pairs), np.eye(15)
    for first, other, sign in (("phi", "chi", -1.0), ("chi", "phi", 1.0)):
        rows[first + "'"] = rows[first + "'"] + sign * rows[other]
    rows["X2"], rows["Z2"] = rows["X2"] - rows["Z1"], rows["Z2"] + rows["X1"]
    for estimate, truth in (("X1", "phi"), ("Z1", "chi"), ("X2", "phi'"), ("Z2", "chi'")):
        rows[estimate] = rows[estimate] - rows[truth]
    rows |= {"theta": one[1], "theta'": one[4], "Y1": one[7] - one[1], "Y2": one[10] - one[4]}
    rows["Z3"] = -one[13]
    return np.array([rows[name] for name in STATES_2])


def to_states_1(tau, frequency, damping):
    """The text's states of stage 1 from the loop's: q1 = -w^2 (low pass) - 2 z w (its rate)."""
    second = np.zeros((3, 12))
    second[:, 6:9] = -(frequency**2) * np.eye(3)
    second[:, 9:12] = -2.0 * damping * frequency * np.eye(3)
    pairs = {("phi", "chi"): (0, 2), ("phi'", "chi'"): (3, 5), ("Z", "X"): (9, 11)}
    rows, one = turn(tau, 12, pairs), np.eye(12)
    rows["phi'"], rows["chi'"] = rows["phi'"] - rows["chi"], rows["chi'"] + rows["phi"]
    cos, sin = math.cos(tau), math.sin(tau)
    rows |= {"Z1": cos * second[0] - sin * second[2], "X1": sin * second[0] + cos * second[2]}
    rows |= {"theta": one[1], "theta'": one[4], "Y": one[10], "Y1": second[1]}
    return np.array([rows[name] for name in STATES_1])


def turned_loop(matrix, to_states, tau):
    """T A T^-1 + T' T^-1, T' by differences of order 4."""
    t, h = to_states(tau), 1e-3
    slope = (8.0 * (to_states(tau + h) - to_states(tau - h))
             - (to_states(tau + 2 * h) - to_states(tau - 2 * h))) / (12.0 * h)  # fmt: skip
    return (t @ matrix + slope) @ np.linalg.inv(t)


def turned_inputs(inputs, to_states, tau):
    """Inputs along t', w, s' in the text's states."""
    c, s = math.cos(tau), math.sin(tau)
    back = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return to_states(tau) @ inputs @ np.kron(np.eye(2), back)


@pytest.mark.parametrize("form", ["field", "text"])
@pytest.mark.parametrize("b", [0.0, 0.37, -0.2])
def test_order_15_rows_match_the_exact_loop_in_computed_field(form, b):
    gains = Stage2Gains(*np.random.default_rng(1).normal(size=15))
    loop = stage_2_loop(AXISYMMETRIC, CRAFT, gains, normal=b, form=form, field=CONE)
    h, pitch_inertia = CRAFT
    want = frozen_2(gains, stiffness=h, pitch_inertia=pitch_inertia, b=b)
    forced = frozen_2_inputs(gains, pitch_inertia=pitch_inertia)
    for tau in TAUS:
        assert turned_loop(loop.matrix(tau), to_states_2, tau) == pytest.approx(want, abs=1e-9)
        found = turned_inputs(driven_by(loop, tau), to_states_2, tau)
        assert found == pytest.approx(forced, abs=1e-12)


@pytest.mark.parametrize("b", [0.0, 0.37, -0.2])
def test_order_12_rows_match_the_exact_loop_in_computed_field(b):
    k, n, damping, frequency = 1.7, 2.3, 0.6, 3.1
    h, pitch_inertia = CRAFT
    loop = STAGE_1.with_parameters(
        **AXISYMMETRIC._asdict(), **{**CONE, "normal": b}, angle_gain=k * (1 + b * b),
        rate_gain=n * (1 + b * b), frequency=frequency, damping=damping, ideal=1.0,
    )  # fmt: skip
    want = frozen_1(k, n, damping, frequency, stiffness=h, pitch_inertia=pitch_inertia, b=b)
    forced = frozen_1_inputs(k, n, damping, frequency, pitch_inertia=pitch_inertia, b=b)

    def to_states(tau):
        return to_states_1(tau, frequency, damping)

    for tau in TAUS:
        assert turned_loop(loop.matrix(tau), to_states, tau) == pytest.approx(want, abs=1e-9)
        found = turned_inputs(stage_1_driven_by(loop, tau), to_states, tau)
        assert found == pytest.approx(forced, abs=1e-12)
