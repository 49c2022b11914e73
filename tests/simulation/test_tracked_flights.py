"""A satellite that follows a place and unloads its wheels: in C, in lanes, resumed, to the bit."""

import numpy as np
import pytest
from flight.c99.in_c import needs_compiler
from flight.c99.test_export import built, replayed
from simulation.lanes.test_lanes import fly_both

import torquer
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.setup.prepare import make_blocks
from torquer.simulation.setup.simulate import simulate

pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT"),
    pytest.mark.slow,
]
#: The place comes into sight after two minutes: a slew from the nadir to it.
TEXT = """
start = 2012-03-04T10:31:47Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 60 }
environment.field.kind = "averaged"
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
initial = { reference = "orbital", euler_deg = [0, 5, 0], rate_deg_s = [0.05, -0.1, 0.02] }
simulation = { duration_s = 240, record_s = 4, step_s = 0.5 }
[spacecraft.wheels]
layout = { kind = "four_sided_pyramid", alpha_deg = 54.7, beta_deg = 45.0 }
momentum_limit_n_m_s = 0.4
torque_limit_n_m = 0.05
speed_limit_rpm = 6000
[spacecraft.gyro]
noise_deg_s = 0.01
[spacecraft.coils]
limit_a_m2 = 3.0
[spacecraft.magnetometer]
noise_nt = 50.0
[control]
sample_s = 2.0
[control.laws.look]
kind = "wheel_tracking"
axis = [0, 0, -1]
target = "ground"
latitude_deg = 13.0
longitude_deg = 46.0
least_elevation_deg = 30.0
second_axis = [0, 1, 0]
second_target = "orbit_normal"
bandwidth_rad_s = 0.1
greatest_rate_deg_s = 1.0
greatest_acceleration_deg_s2 = 0.1
inertia_kg_m2 = [1.0, 1.3, 1.7]
[control.laws.unload]
kind = "unloading"
gain_per_s = 1e-3
begin_n_m_s = 2e-4
dead_band_n_m_s = 1e-4
window_deg = 15.0
window_centre_deg = -10.0
"""


@pytest.fixture(scope="module")
def whole():
    """The flight in one go."""
    return simulate(scenario_from_text(TEXT))


def test_it_slews_to_the_place_when_that_comes_into_sight(whole):
    left = np.degrees(whole["look.slew_left_rad"].values)
    begun = np.flatnonzero((left[1:] > 10.0) & (left[:-1] == 0.0))
    assert len(begun) == 1 and 100.0 < whole.time.values.astype(float)[begun[0]] < 140.0
    assert left[-1] == 0.0


def test_the_coils_work_within_the_window_alone(whole):
    """Until 5 deg after the node: 80 s of 5739 s a revolution."""
    on = np.any(whole["command_body"].values != 0.0, axis=1)
    t_s = whole.time.values.astype(float)
    assert on[(t_s > 10.0) & (t_s < 76.0)].all() and not on[t_s > 84.0].any()


def test_a_run_knows_how_the_earth_stands_at_its_start():
    scenario = scenario_from_text(TEXT)
    law = make_blocks(scenario).laws["look"]
    found = scenario.orbit_environment().dcm_to_ecef(np.zeros(1))[0]
    assert np.array_equal(law.values()["to_ecef"], found)
    assert law.fixed == {"to_ecef"}  # no command may set it


def test_resumed_it_has_the_same_bits(whole):
    rest = torquer.resume(simulate(scenario_from_text(TEXT), until_s=150.0))
    for name in ("q_body_to_inertial", "look.q_commanded", "command_body", "wheel_torque"):
        assert np.array_equal(rest[name], whole[name])


@needs_compiler
def test_c_has_the_same_bits(whole, tmp_path):
    torquer.export_c(scenario_from_text(TEXT), tmp_path, steps=119)
    done = replayed(built(tmp_path, "-O2"), tmp_path)
    said = "119 control steps: the same bits in commands and state\n"
    assert (done.stdout, done.returncode) == (said, 0)
    flown = simulate(scenario_from_text(TEXT), computer=tmp_path)
    for name in ("q_body_to_inertial", "look.q_commanded", "command_body", "wheel_torque"):
        assert np.array_equal(flown[name], whole[name])


def test_in_lanes_it_has_the_same_bits():
    for beside, kept, _, _ in fly_both(scenario_from_text(TEXT), rows=(0, 7, 20)):
        assert np.array_equal(beside, kept)
