"""Control steps while the coils act: wheels and estimators go on, coils and magnetometer do not."""

import itertools

import numpy as np
import pytest

from torquer import Command, law, simulate
from torquer.compile import engine
from torquer.scenario.load import ScenarioError

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

#: Readings at 0, 2, 4 s of the window and at its end, 4 s; 6 s of actuation with two steps in it.
ACTING = {
    "control.sample_s": 2.0,
    "control.measure_s": 4.0,
    "control.actuate_s": 6.0,
    "control.control_while_actuating": True,
    "spacecraft.coils": {"limit_a_m2": 100.0},
    "spacecraft.magnetometer.coil_disturbance_nt_per_a_m2": 500.0,
    "spacecraft.wheels": {
        "layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 1.0, "torque_limit_n_m": 1.0,
    },
    "environment.gravity_gradient": False,
    "simulation": {"duration_s": 60.0, "record_s": 1.0},
}  # fmt: skip


@law(
    memory={"calls": 0.0, "field_s": 0.0, "gyro_s": 0.0, "stated": 0.0},
    log={"field_s": "s", "gyro_s": "s", "stated": "A m2"},
    answers="command",
)
def counting(inputs, parameters, memory):
    """Asks for more from call to call, of coils and wheels; logs the times of readings."""
    memory.field_s, memory.gyro_s = inputs.read_at.magnetometer_s, inputs.read_at.gyro_s
    memory.stated = inputs.coil_dipole_body_a_m2[0]
    memory.calls += 1.0
    return Command((memory.calls, 0.0, 0.0), (0.0, 0.0, 1e-6 * memory.calls))


@pytest.fixture(scope="module")
def result(make):
    return simulate(make(ACTING), counting)


STEPS = np.arange(0, 60, 2)
PHASE = STEPS % 10


def test_wheels_follow_every_control_step(result):
    asked = result.wheel_torque.values[:60, 2]
    assert asked == pytest.approx(-1e-6 * np.repeat(np.arange(1.0, 31.0), 2), rel=1e-12)


def test_coils_hold_the_dipole_of_the_end_of_the_window(result):
    dipole = result.dipole_body.values[:60, 0]
    for cycle in range(6):
        held = 5.0 * cycle + 3.0  # the third of five commands
        expected = [0.0] * 4 + [held] * 6
        assert dipole[10 * cycle : 10 * cycle + 10] == pytest.approx(expected)


def test_magnetometer_is_read_only_in_the_window_and_gyro_always(result):
    field_s, gyro_s = result["law.field_s"].values[STEPS], result["law.gyro_s"].values[STEPS]
    assert np.array_equal(gyro_s, STEPS)
    assert np.array_equal(field_s, np.where(PHASE <= 4, STEPS, STEPS - PHASE + 4))


def test_the_computer_knows_that_the_coils_go_on(result):
    """Mean dipole since the step before: what the plant has done."""
    stated, acting = result["law.stated"].values, result.dipole_body.values[:, 0]
    for before, now in itertools.pairwise(STEPS):
        assert stated[now] == pytest.approx(acting[before:now].mean(), abs=1e-12)
    assert stated.max() > 20.0


def test_without_it_wheels_wait_for_the_next_window(make):
    result = simulate(make(ACTING | {"control.control_while_actuating": False}), counting)
    asked = result.wheel_torque.values[:60, 2]
    steps = np.repeat(np.arange(1.0, 19.0), [2, 2, 6] * 6)
    assert asked == pytest.approx(-1e-6 * steps, rel=1e-12)


def test_a_sensor_with_a_rate_of_its_own_keeps_it(make):
    result = simulate(make(ACTING | {"spacecraft.magnetometer.sample_s": 1.0}), counting)
    assert np.array_equal(result["law.field_s"].values[STEPS], STEPS)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"control.measure_s": 0.0, "control.actuate_s": 2.0}, "control_while_actuating: must be"),
        ({"control.actuate_s": 5.0}, "actuate_s: must be a whole multiple of sample_s = 2 s"),
    ],
)
def test_mistakes_are_reported(make, changes, message):
    with pytest.raises(ScenarioError, match=message):
        make(ACTING | changes)
