"""The estimate that a law states: in the result, in modes, after a stop, and when there is none."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import resume, simulate

#: Nearly pointed; field and model without error; the law's estimate is that of the computer.
STATED = load_scenario(Path(__file__).parents[3] / "examples/magneto_gyro.toml")
for key, value in {
    "control.estimator": {"kind": "law"},
    "control.ephemeris.field": None,
    "spacecraft.magnetometer.noise_nt": 0.0,
    "initial.euler_deg": (5.0, -4.0, 5.0),
    "initial.rate_deg_s": (0.0, 0.0, 0.0),
    "initial.rate_relative_to": "orbital",
    "simulation.revolutions": 2.0,
}.items():
    STATED = STATED.replace(key, value)
#: The law in two states, by what it states; then no law.
MODES = {
    "attitude": {"reference": "orbital"},
    "states": {
        "capture": {
            "laws": ["gyro"],
            "transitions": [
                {"to": "pointing", "when": {"signal": "attitude_error_deg", "below": 2.0}}
            ],
        },
        "pointing": {
            "laws": ["gyro"],
            "transitions": [
                {"to": "silent", "when": {"signal": "time_in_state_s", "above": 600.0}}
            ],
        },
        "silent": {"laws": ["idle"]},
    },
}


def off_deg(result):
    """Angle between the true attitude and the estimated one; NaN where that is unknown."""
    q, estimated = result.q_body_to_inertial.values, result.q_estimated.values
    known, angle = np.isfinite(estimated[:, 0]), np.full(len(q), np.nan)
    turn = Rotation.from_quat(q[known]).inv() * Rotation.from_quat(estimated[known])
    angle[known] = np.degrees(turn.magnitude())
    return angle


@pytest.mark.parametrize("euler_deg", [(0.0, 0.0, 0.0), (90.0, 0.0, 0.0)])
def test_it_is_the_attitude_and_the_absolute_rate(euler_deg):
    """Of a body whose axes stand otherwise in the orbital frame, too."""
    changed = STATED.replace("simulation.revolutions", 9.0)
    turn = Rotation.from_euler("ZYX", euler_deg, degrees=True).inv()
    moments = tuple(np.abs(turn.apply((3800.0, 2200.0, 3600.0))).round(9).tolist())
    wheel = tuple(turn.apply((0.0, 30.0, 0.0)).round(9).tolist())
    for key, value in {
        "spacecraft.body.inertia_kg_m2": moments,
        "spacecraft.body.wheel_momentum_n_m_s": wheel,
        "control.law.inertia_kg_m2": moments,
        "control.law.euler_deg": euler_deg,
        "initial.euler_deg": euler_deg,
    }.items():
        changed = changed.replace(key, value)
    result = simulate(changed)
    # the run ends before the last control step
    off, late = off_deg(result), result.time.values > 8.0 * changed.orbit.period_s
    late[-1] = False
    assert off[late].max() < 1e-4
    rate = result.omega_estimated.values - result.omega_body.values
    assert np.degrees(np.abs(rate[late])).max() < 1e-6
    assert np.isnan(result.attitude_sigma.values).all()


def test_stage_1_states_none():
    result = simulate(STATED)
    second = result["law.stage"].values == 2.0
    assert np.array_equal(np.isfinite(off_deg(result)), second)
    assert np.isneginf(result.estimate_time.values[~second]).all()
    age = result.time.values - result.estimate_time.values
    assert age[second].max() <= STATED.control.sample_s


def with_modes():
    """The example with `MODES`."""
    laws = {"gyro": STATED.control.law.model_dump(exclude_none=True), "idle": {"kind": "off"}}
    control = STATED.control.model_dump(exclude_unset=True) | {"laws": laws, "modes": MODES}
    control.pop("law")
    return STATED.replace("control", control)


def test_modes_read_it_until_the_law_stops():
    result = simulate(with_modes())
    state, stage = result["mode_main"].values, result["gyro.stage"].values
    names = list(MODES["states"])
    assert np.all(stage[state > names.index("capture")] == 2.0)
    error = off_deg(result)
    assert np.isnan(error[state == names.index("silent")][1:]).all()
    assert np.isfinite(error[state == names.index("pointing")]).all()


def test_a_stopped_run_goes_on_with_it_to_the_bit():
    whole = simulate(STATED)
    stop_s = 0.75 * STATED.simulation.revolutions * STATED.orbit.period_s
    part = simulate(STATED, until_s=stop_s)
    assert np.isfinite(off_deg(part)[-1])
    rest = resume(part)
    for name in ("q_estimated", "omega_estimated", "estimate_time", "q_body_to_inertial"):
        assert np.array_equal(rest[name].values, whole[name].values, equal_nan=True)


def test_other_laws_state_none():
    bdot = {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}
    with pytest.raises(ValueError, match=re.escape("control.estimator: must be of another kind")):
        simulate(STATED.replace("control.law", bdot))
