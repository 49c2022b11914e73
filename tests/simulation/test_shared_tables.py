"""Runs on one orbit share the tables of the environment: the same bits, and no other run's."""

import pytest

import torquer
from torquer.simulation.setup.run import prepare

SCENARIO = """
start = 2025-07-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 60 }
environment = { field = { kind = "igrf14", degree = 2 } }
spacecraft.body.inertia_kg_m2 = [0.03, 0.03, 0.01]
spacecraft.coils = { limit_a_m2 = 0.2 }
initial.rate_deg_s = [3, -2, 1]
control = { law = { kind = "bdot", gain_a_m2_s_per_t = 2e4 } }
simulation = { duration_s = 600, step_s = 0.5, record_s = 10 }
"""


def end_of(run) -> bytes:
    run.advance_to(run.steps)
    return run.state.cells.tobytes()


def test_run_is_bit_identical_on_shared_and_own_tables():
    scenario = torquer.scenario_from_text(SCENARIO)
    first = prepare(scenario)
    other = scenario.replace("initial.rate_deg_s", [1.0, 1.0, -4.0]).replace("seed", 7)
    assert end_of(prepare(other, piece=first.piece)) == end_of(prepare(other))
    assert prepare(other, piece=first.piece).piece is first.piece


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("orbit.altitude_km", 560.0),
        ("start", "2025-07-02T00:00:00Z"),
        ("environment.field.degree", 3),
        ("simulation.step_s", 1.0),
        ("simulation.duration_s", 700.0),
    ],
)
def test_tables_of_another_run_are_refused(key, value):
    scenario = torquer.scenario_from_text(SCENARIO)
    piece = prepare(scenario).piece
    with pytest.raises(ValueError, match="piece: must have the orbit, environment, start and"):
        prepare(scenario.replace(key, value), piece=piece)


def test_tables_without_sun_are_refused_to_a_law_reading_it():
    scenario = torquer.scenario_from_text(SCENARIO)
    piece = prepare(scenario).piece
    seeing = {"axes": [[0, 0, 1]], "half_field_deg": 60}
    with pytest.raises(ValueError, match="piece: must have the Sun, the Moon and the air"):
        prepare(scenario.replace("spacecraft.sun_sensors", seeing), piece=piece)


def test_tables_are_shared_with_those_that_feel_the_same_light():
    scenario = torquer.scenario_from_text(SCENARIO)
    # adaptive steps in light are compiled for other tests, too
    scenario = scenario.replace("simulation", {"duration_s": 600.0, "record_s": 10.0})
    parts = [{"kind": "sphere", "radius_m": 0.2, "centre_m": [0.1, 0.0, 0.0]}]
    sunlit_fraction = scenario.replace("disturbance", {"solar_pressure": {"parts": parts}})
    piece = prepare(sunlit_fraction).piece
    other = sunlit_fraction.replace("disturbance.solar_pressure.parts[0].radius_m", 0.3)
    assert end_of(prepare(other, piece=piece)) == end_of(prepare(other))
    for mixed, own in ((scenario, piece), (sunlit_fraction, prepare(scenario).piece)):
        with pytest.raises(ValueError, match="piece: must have the Sun, the Moon and the air"):
            prepare(mixed, piece=own)
