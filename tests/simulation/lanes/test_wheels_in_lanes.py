"""Members with wheels side by side: each flies as alone, to the bit."""

import numpy as np
import pytest
from simulation.lanes.test_lanes import HEAD
from slow_cases import slow_after
from tip_off import TABLE, campaign

from torquer.campaign.fleet import Fleet
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes.group import Lanes, Pieces
from torquer.simulation.loop.state import CELLS
from torquer.simulation.setup.run import prepare

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="lanes are compiled code")

RATES = np.linspace(0.1, 1.5, 21)
FOUR = """
[spacecraft.wheels]
layout = { kind = "regular_pyramid", count = 4, gamma_deg = 54.7 }
momentum_limit_n_m_s = 0.02
torque_limit_n_m = [1e-3, 2e-3, 1e-3, 2e-3]
coulomb_friction_n_m = 1e-4
viscous_friction_n_m_s = 1e-7
stiction_n_m = 2e-4
speed_noise_rpm = 1.0
initial_speed_rpm = [2000, 0, -300, 60]
minimum_speed_fraction = 0.1
failures = [{ wheel = 1, time_s = 101.0, noticed_after_s = 20.0 }]
"""
#: No friction, no noise; least squares drives them up to their limits.
THREE = """
[spacecraft.wheels]
layout = { kind = "axes", axes = [[1, 0, 0], [0.3, 1, 0], [0.1, -0.2, 1]] }
momentum_limit_n_m_s = 0.05
torque_limit_n_m = 1e-3
allocation = "least_squares"
initial_speed_rpm = [100, 0, -40]
"""
#: From a stand, up to what the computer lets them hold.
ROUGH = """
[spacecraft.wheels]
layout = { kind = "axes", axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }
momentum_limit_n_m_s = 3e-3
torque_limit_n_m = 2e-3
coulomb_friction_n_m = 3e-4
stiction_n_m = 5e-4
"""
#: In planes that the axes of the body do not lie in; two of them nearly one.
SKEW = """
[spacecraft.wheels]
layout = { kind = "axes", axes = [[1, 2, 3], [-2, 1, 0.5], [0.2, -1, 1.5], [1, 1, -0.4], \
[1, 1.1, -0.5]] }
momentum_limit_n_m_s = [0.02, 0.03, 0.04, 0.01, 0.02]
torque_limit_n_m = 1e-3
viscous_friction_n_m_s = 2e-7
speed_noise_rpm = 3.0
initial_speed_rpm = [500, -2000, 10, 900, 0]
minimum_speed_fraction = 0.05
"""
COILS = """
[spacecraft.coils]
limit_a_m2 = 1.0
lag_s = 0.4
[spacecraft.magnetometer]
noise_nt = 50
"""
HELD = """
[control]
sample_s = 2.0
[control.laws.held]
kind = "wheel_pd"
bandwidth_rad_s = 0.05
reference = "inertial"
inertia_kg_m2 = [1.0, 1.3, 1.7]
"""
UNLOADED = """
[control.laws.coils]
kind = "unloading"
gain_per_s = 2e-3
"""
#: Of the wheels, of coils alone.
MODES = """
[control.modes.states.braking]
laws = ["coils"]
wheels = "off"
transitions = [{ to = "holding", when = { signal = "rate_deg_s", below = 0.9 } }]
[control.modes.states.holding]
laws = ["held", "coils"]
transitions = [{ to = "braking", at_least_s = 60 }]
"""
RK4 = """
[simulation]
duration_s = 240
record_s = 10
step_s = 0.5
"""
AUTO = RK4.replace("step_s = 0.5\n", "")
SCENARIOS = {
    "RK4, four": FOUR + COILS + HELD + UNLOADED + RK4,
    "adaptive, four": FOUR + COILS + HELD + UNLOADED + AUTO,
    "RK4, three": THREE + HELD + RK4,
    "adaptive, three": THREE + HELD + AUTO,
    "RK4, rough": ROUGH + HELD + RK4,
    "adaptive, rough": ROUGH + HELD + AUTO,
    "RK4, skew": SKEW + HELD + RK4,
    "adaptive, skew": SKEW + COILS + HELD + UNLOADED + AUTO,
    "RK4, modes": FOUR + COILS + HELD + UNLOADED + MODES + RK4,
}


def members(scenario):
    """The members' own scenarios: rates and seeds differ."""
    rate = np.array(scenario.initial.rate_deg_s)
    own = [scenario.replace("initial.rate_deg_s", (rate * part).tolist()) for part in RATES]
    return [each.replace("seed", 100 + number) for number, each in enumerate(own)]


def alone(scenario, run, laws=None):
    """Attitude and rate at the records, cells at the end, speeds as momenta of a single run."""
    own = prepare(scenario, laws=laws, piece=run.piece)
    assert own.advance_to(own.steps) == 0
    record = own.rows()
    kept = np.column_stack([record.rows[name] for name in record.rows.dtype.names[1:8]])
    return kept, own.state.cells[0], record.wheels[:, : len(own.state.rotors)], own.state.rotors


def assert_equal_to_alone(scenario, laws=None, rows=(0, 7, 15, 16, 20)):
    """Fly members in lanes, and some of them alone; momenta and rotors of these."""
    run, each = prepare(scenario, laws=laws), members(scenario)
    lanes = Lanes(run, Pieces(run))
    motions = np.array([own.motion_at_start() for own in each])
    flown = lanes.fly(lanes.numbers_of(motions), np.arange(100, 121))
    assert not flown.failed.any()
    found = []
    for row in rows:
        kept, cells, *rotors = alone(each[row], run, laws)
        assert np.array_equal(flown.motion[: len(kept), :, row], kept), row
        for name in CELLS.names:
            assert flown.cells[row][name] == cells[name], (row, name)
        found.append(rotors)
    return found


@pytest.mark.parametrize("name", slow_after(2, SCENARIOS))
def test_members_with_wheels_have_the_bits_of_their_own_flights(name):
    found = assert_equal_to_alone(scenario_from_text(HEAD + SCENARIOS[name]))
    momenta = np.concatenate([momenta for momenta, _ in found])
    if "three" not in name and "skew" not in name:
        assert np.any(momenta == 0.0)  # a rotor stands
    if "three" in name:
        assert np.abs(momenta).max() >= 0.05 * (1.0 - 1e-6)  # one is as fast as it may be


VARIED = {
    "spacecraft.wheels.coulomb_friction_n_m": {"uniform": [0.0, 1e-4]},
    "spacecraft.wheels.torque_limit_n_m": {"uniform": [5e-4, 2e-3]},
    "control.laws.held.bandwidth_rad_s": {"uniform": [0.02, 0.06]},
}


def test_wheels_and_gains_of_members_differ():
    """In friction, limits and gains."""
    scenario = scenario_from_text(HEAD + SCENARIOS["RK4, four"])
    made = campaign(scenario, runs=20, vary=TABLE["vary"] | VARIED)
    flying, members = Fleet(scenario, made), np.arange(20)
    assert flying.why_not_in_lanes == ""
    in_lanes = flying.fly(members)
    flying._lanes = None
    alone = flying.fly(members)
    assert in_lanes.ended == alone.ended
    for kind in ("outcomes", "series"):
        for name, values in getattr(alone, kind).items():
            assert np.isfinite(values).any()  # some never settle
            assert np.array_equal(getattr(in_lanes, kind)[name], values, equal_nan=True), name


def test_members_whose_allocation_differs_fly_alone():
    """In the layout, or in what is noticed when; limits and bias are numbers of each one."""
    scenario = scenario_from_text(HEAD + SCENARIOS["RK4, four"])
    lanes = Lanes(prepare(scenario), Pieces(prepare(scenario)))
    wheels = "spacecraft.wheels."
    for key, value, fits in (
        ("torque_limit_n_m", 3e-3, True),
        ("viscous_friction_n_m_s", 0.0, True),
        ("momentum_limit_n_m_s", 0.03, True),
        ("speed_noise_rpm", 2.0, False),
        ("layout.gamma_deg", 50.0, False),
        ("minimum_speed_fraction", 0.2, True),
        ("failures", [{"wheel": 1, "time_s": 101.0, "noticed_after_s": 30.0}], False),
        ("failures", [{"wheel": 1, "time_s": 111.0, "noticed_after_s": 10.0}], True),
    ):
        other = prepare(scenario.replace(wheels + key, value))
        assert (lanes.takes(other) is not None) == fits, (key, value)
