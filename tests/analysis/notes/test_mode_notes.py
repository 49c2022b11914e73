"""What the checker of mode tables is told of the sensors that are read."""

import pytest

from torquer.analysis.notes.mode_notes import mode_notes
from torquer.computer.interface import SENSORS
from torquer.scenario.load import scenario_from_text
from torquer.simulation.loop.timetable import READ, all_actions
from torquer.simulation.setup.run import prepare

CASE = """
start = 2025-06-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 500, inclination_deg = 97.4 }
simulation = { duration_s = 300 }
spacecraft.body.inertia_kg_m2 = [0.03, 0.04, 0.02]
spacecraft.coils.limit_a_m2 = 0.2
spacecraft.magnetometers = { p = { noise_nt = 10 }, q = { noise_nt = 10 } }
initial.rate_deg_s = [0.2, -0.15, 0.1]
control.sample_s = 1.0
control.laws.l = { kind = "bdot", gain_a_m2_s_per_t = 1e4 }
[control.modes.regions.main.states.one]
laws = ["l"]
transitions = [{ to = "two", when = { signal = "reading_age_s", sensor = "SENSOR", above = 5 } }]
[control.modes.regions.main.states.two]
laws = ["l"]
transitions = [{ to = "one", at_most_s = 50 }]
"""


@pytest.mark.parametrize("sensor", ["p", "q", "magnetometer", "gyro"])
def test_a_sensor_that_is_read_may_fall_silent(sensor):
    assert mode_notes(scenario_from_text(CASE.replace("SENSOR", sensor))) == []


@pytest.mark.parametrize(
    "sensor",
    ["search_coil", "tachometers", "horizon_sensor", "sun_cells", "sun_sensors", "integrating_gyro",
     "fine_sun_sensor"],
)  # fmt: skip
def test_of_a_sensor_that_is_not_there_no_reading_comes(sensor):
    scenario = scenario_from_text(CASE.replace("SENSOR", sensor))
    row = SENSORS.index(sensor)
    assert not all_actions(prepare(scenario).plan.timetable) & (READ << row)
    (note,) = mode_notes(scenario)
    assert f"the computer has no readings of the {sensor.replace('_', ' ')}" in note


def test_an_ideal_sensor_is_read_where_a_law_or_an_estimator_needs_it():
    text = CASE.replace("SENSOR", "sun_sensors")
    pointing = '{ kind = "preliminary_1", gain_a_m2_per_t = 1e3, axis = [0, 0, 1], target = "sun" }'
    by_law = text.replace('{ kind = "bdot", gain_a_m2_s_per_t = 1e4 }', pointing)
    keys = '{ kind = "triad", magnetometer_noise_nt = 100, sun_noise_deg = 1 }'
    estimator = f"control.estimator = {keys}\n[control.modes"
    by_estimator = text.replace("[control.modes", estimator, 1)
    for changed in (by_law, by_estimator):
        assert changed != text and mode_notes(scenario_from_text(changed)) == []
