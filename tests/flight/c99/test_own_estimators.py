"""Estimates of the user's that cannot be used: none in flight, the end of a run in the loop."""

import math

import numpy as np
import pytest
from flight.c99.in_c import needs_compiler
from flight.c99.test_gate import Exported

import torquer
from torquer.computer import gate as gates
from torquer.computer.interface import GYRO, PLACES
from torquer.spacecraft.sensors.device import MOST_PARTS

OWN = """
import math
import torquer

ZERO = (0.0, 0.0, 0.0)
LIMIT, UNTIL_S = 1.0, 450.0


@torquer.estimator
def as_read(inputs, parameters, memory):
    q, read = inputs.q_body_to_inertial, inputs.omega_body_rad_s
    return torquer.Estimate(inputs.t_s, q, read, ZERO, 0.0, 0.0)


@torquer.estimator
def no_time(inputs, parameters, memory):
    q, read = inputs.q_body_to_inertial, inputs.omega_body_rad_s
    t_s = inputs.t_s if abs(read[0]) < LIMIT and inputs.t_s < UNTIL_S else math.inf
    return torquer.Estimate(t_s, q, ZERO, ZERO, 0.0, 0.0)


@torquer.estimator
def boundless(inputs, parameters, memory):
    q, read = inputs.q_body_to_inertial, inputs.omega_body_rad_s
    sigma = 0.0 if abs(read[0]) < LIMIT and inputs.t_s < UNTIL_S else math.inf
    return torquer.Estimate(inputs.t_s, q, read if sigma == 0.0 else ZERO, ZERO, 0.0, sigma)


@torquer.estimator
def goes_on(inputs, parameters, memory):
    before, read = inputs.estimate.omega_body_rad_s, inputs.omega_body_rad_s
    omega = read if math.isnan(before[0]) else (
        before[0] + 0.5 * (read[0] - before[0]),
        before[1] + 0.5 * (read[1] - before[1]),
        before[2] + 0.5 * (read[2] - before[2]),
    )
    q, isolated = inputs.q_body_to_inertial, inputs.estimate.isolated
    return torquer.Estimate(inputs.t_s, q, omega, ZERO, 0.0, 0.0, isolated)


@torquer.estimator
def divides(inputs, parameters, memory):
    q, read = inputs.q_body_to_inertial, inputs.omega_body_rad_s
    sigma = 1.0 / (1.0 if abs(read[0]) < LIMIT and inputs.t_s < UNTIL_S else 0.0)
    return torquer.Estimate(inputs.t_s, q, read, ZERO, 0.0, sigma)
"""
SCENARIO = """
start = 2025-07-01T00:00:00Z
[orbit]
kind = "circular"
altitude_km = 550
inclination_deg = 97.6
[spacecraft.body]
inertia_kg_m2 = [0.03, 0.03, 0.01]
[spacecraft.coils]
limit_a_m2 = 0.2
[spacecraft.gyro]
noise_deg_s = 0.02
[initial]
rate_deg_s = [8, -5, 3]
[control]
sample_s = 1.0
[control.law]
kind = "bdot_rate"
gain_a_m2_s_per_t = 1e4
[control.estimator]
kind = "user"
file = "own.py"
function = "{name}"
[simulation]
revolutions = 1
record_s = 5.0
"""
#: What a gyro reads at one step, by the estimator whose answer cannot be used then.
SPOILED = {
    "as_read": math.nan, "boundless": 2.0, "goes_on": math.inf, "no_time": 2.0,
}  # fmt: skip
BAD = 60


def written(name: str, folder) -> str:
    """The path of a scenario with one of the estimators, without its ending."""
    (folder / "own.py").write_text(OWN)
    text = SCENARIO.replace("{name}", name)
    (folder / f"{name}.toml").write_text(text)
    return str(folder / name)


@needs_compiler
@pytest.mark.verifies("REQ-BRD-002")
@pytest.mark.parametrize("name", SPOILED)
def test_an_estimate_that_cannot_be_used_is_none_and_is_not_kept(name, tmp_path):
    own = Exported(written(name, tmp_path), tmp_path / "out")
    rows = own.inputs[:120].copy()
    place = own.places.index(PLACES["readings"].start + MOST_PARTS * GYRO)
    rows[BAD, place] = SPOILED[name]
    commands, statuses = own.both(rows)
    sound, _ = own.both(own.inputs[:120])
    assert not commands[BAD].any() and statuses[BAD] & gates.NO_ESTIMATE
    assert not (statuses & gates.NO_ESTIMATE)[BAD + 1 :].any()
    assert commands[:BAD].tobytes() == sound[:BAD].tobytes()
    assert np.abs(commands - sound)[BAD + 30 :].max() <= 1e-6 * np.abs(sound).max()


@needs_compiler
@pytest.mark.parametrize("name", ["boundless", "divides", "no_time"])
def test_a_run_in_c_ends_where_that_in_python_does(name, tmp_path):
    scenario = torquer.load_scenario(f"{written(name, tmp_path)}.toml")
    torquer.export_c(scenario, tmp_path / "out", steps=1)
    said = []
    for computer in (None, tmp_path / "out"):
        with pytest.raises(torquer.RunStopped) as stopped:
            torquer.simulate(scenario, computer=computer)
        said.append(str(stopped.value))
    assert said[0] == said[1]
