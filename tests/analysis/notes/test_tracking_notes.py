"""Notes on the law `wheel_tracking`: what its slews and passes ask of the wheels."""

from pathlib import Path

import pytest

from torquer.analysis.notes.notes import write_notes
from torquer.analysis.notes.tracking_notes import tracking_notes
from torquer.scenario.load import load_scenario

EXAMPLE = load_scenario(Path(__file__).parents[3] / "examples/looks_at_a_station.toml")
LOOK = "control.laws.look."


def test_nothing_is_said_of_the_example():
    assert tracking_notes(EXAMPLE) == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        # 0.02 rad/s^2 x 0.167 kg m^2 of 3.27 mN m
        ({LOOK + "greatest_acceleration_deg_s2": 1.2}, "look: a slew at greatest_accel"),
        # 7585 m/s over 550 km is 0.79 deg/s, with 0.167 kg m^2 2.3 mN m s
        ({"spacecraft.wheels.momentum_limit_n_m_s": 0.001},
         "look: a pass over the place turns the body at up to 0.79 deg/s: 0.0023 N m s, but the "
         "wheels hold"),
        # 0.65 x 0.0138^2 x 0.167 = 2.06e-5 N m
        ({"spacecraft.wheels.torque_limit_n_m": 1e-5},
         "look: a pass over the place turns the body at up to 0.79 deg/s and takes 2.06e-05 N m, "
         "but the wheels give"),
    ],
)  # fmt: skip
def test_what_the_wheels_lack_is_said(changes, said):
    scenario = EXAMPLE
    for key, value in changes.items():
        scenario = scenario.replace(key, value)
    assert any(note.startswith(said) for note in tracking_notes(scenario))


def test_its_sampling_and_its_momentum_are_judged_as_other_laws_are():
    fast = EXAMPLE.replace(LOOK + "bandwidth_rad_s", 1.0)
    assert any(
        note.startswith("look: the wheel law has a time constant") for note in write_notes(fast)
    )
    weak = EXAMPLE.replace("spacecraft.wheels.momentum_limit_n_m_s", 0.001)
    assert any("a slew at greatest_rate_deg_s = 1 may take" in note for note in write_notes(weak))


@pytest.mark.parametrize(("raan_deg", "said"), [(0.0, True), (337.5, False), (90.0, False)])
def test_targets_along_one_line_are_said(raan_deg, said):
    """At the equinox the Sun is at the node of an orbit with its ascending node at 0 deg."""
    keys = {"target": "nadir", "second_target": "sun", "latitude_deg": None, "longitude_deg": None}
    look = EXAMPLE.control.laws["look"].model_dump(mode="json") | keys
    scenario = EXAMPLE.replace("control.laws.look", look).replace("orbit.raan_deg", raan_deg)
    lead = "look: its targets (nadir and sun) come within "
    found = [note for note in tracking_notes(scenario) if note.startswith(lead)]
    assert len(found) == said
    if said:
        assert float(found[0].removeprefix(lead).split()[0]) < 2.0
