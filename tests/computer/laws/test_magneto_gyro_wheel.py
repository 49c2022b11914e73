"""The wheel of the magneto-gyroscopic system: spun up in flight, or stopped by its friction."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer.analysis.attitude import find_attitude_error
from torquer.computer.laws.off import Off
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate

EXAMPLE = load_scenario(Path(__file__).parents[3] / "examples/magneto_gyro.toml")
PERIOD_S = EXAMPLE.orbit.period_s
#: One wheel, along pitch: 30 N m s at 5000 rpm. The other two are dead and at rest.
WHEELS = {
    "layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 36.0, "torque_limit_n_m": 0.05,
    "speed_limit_rpm": 6000.0, "lost": (0, 2),
}  # fmt: skip


@torquer.law(parameters={"momentum": 30.0, "gain_per_s": 0.01, "from_s": 0.0}, answers="torque")
def hold_wheel(inputs, parameters, memory):
    """Torque on the body by which the pitch wheel comes to its momentum, from a time on."""
    if inputs.t_s < parameters.from_s:
        return 0.0, 0.0, 0.0
    lack = parameters.momentum - inputs.wheel_momentum_body_n_m_s[1]
    return 0.0, -parameters.gain_per_s * lack, 0.0


def error_deg(seed, orbits, from_s=0.0, **wheels):
    """(Time [orbits], attitude error [deg]) from 3 deg/s in any attitude."""
    rng = np.random.default_rng(seed)
    rate, attitude = rng.normal(size=3), Rotation.random(random_state=rng)
    both = {"law": None, "laws": {"gyro": EXAMPLE.control.law, "wheel": Off()}}
    changes = {
        "simulation.revolutions": orbits,
        "initial.euler_deg": tuple(attitude.as_euler("ZYX", degrees=True).tolist()),
        "initial.rate_deg_s": tuple((3.0 * rate / np.linalg.norm(rate)).tolist()),
        "spacecraft.wheels": {**WHEELS, **wheels},
        "spacecraft.body.wheel_momentum_n_m_s": (0.0, 0.0, 0.0),
        "control": EXAMPLE.control.model_copy(update=both),
    }
    scenario = EXAMPLE
    for key, value in changes.items():
        scenario = scenario.replace(key, value)
    result = simulate(scenario, laws={"wheel": hold_wheel.with_parameters(from_s=from_s)})
    size = np.linalg.norm(find_attitude_error(result).error_deg, axis=1)
    return result.time.values / PERIOD_S, size


@pytest.mark.slow
@pytest.mark.parametrize("from_orbit", [0.0, 2.0, 5.0])
def test_the_wheel_may_be_spun_up_in_flight(from_orbit):
    """0.05 N m takes 10 minutes to 30 N m s."""
    for seed in range(8):
        orbits, error = error_deg(seed, 13.0, from_orbit * PERIOD_S)
        assert error[orbits > from_orbit + 8.0].max() < 1.0, seed


@pytest.mark.slow
def test_without_the_wheel_it_does_not_point():
    """The motor fails after nine orbits, and friction stops the wheel within 50 minutes."""
    dead = {"failures": ({"wheel": 1, "time_s": 9.0 * PERIOD_S},), "coulomb_friction_n_m": 0.01}
    for seed in range(8):
        orbits, error = error_deg(seed, 16.0, initial_speed_rpm=(0.0, 5000.0, 0.0), **dead)
        assert error[(orbits > 8.5) & (orbits < 9.0)].max() < 1.0
        assert error[orbits > 14.0].max() > 90.0, seed
