"""No note fails, whichever of the documented keys a scenario is written with."""

import pytest
from conftest import PLAIN, changed
from law_examples import EXAMPLES
from spellings import TLE, tables

from torquer.analysis.notes.notes import write_notes
from torquer.base.user_code import OwnFile
from torquer.computer.estimation import ESTIMATORS
from torquer.environment.orbit import ORBITS
from torquer.scenario.control import Control
from torquer.scenario.load import check_orbit_environment, scenario_from_data
from torquer.scenario.spec import (
    Environment,
    InitialMotion,
    Mission,
    Scenario,
    Simulation,
    Spacecraft,
)
from torquer.spacecraft.disturbance import Disturbance

WHEELS = {"layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 0.05,
          "torque_limit_n_m": 1e-3, "speed_limit_rpm": 6000.0}  # fmt: skip
#: With what every law and torque needs.
WHOLE = {
    "start": "2022-12-12T16:40:00Z",
    "spacecraft.wheels": WHEELS,
    "spacecraft.body.mass_kg": 10.0,
    "environment.atmosphere": {"kind": "exponential"},
    "simulation": {"duration_s": 600.0, "record_s": 10.0},
}
B_DOT = {"control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5}}
BENCH = {"kind": "bench", "latitude_deg": 50.0}


def scenarios(changes):
    """The scenarios that these changes of a whole one make, if they can be run."""
    for change in changes:
        try:
            scenario = scenario_from_data(changed(PLAIN, {**WHOLE, **B_DOT, **change}))
            check_orbit_environment(scenario)
        except ValueError:
            continue
        yield scenario


def keys_in(value):
    """All keys at any depth."""
    if isinstance(value, dict):
        return {*value} | {key for part in value.values() for key in keys_in(part)}
    return {key for part in value for key in keys_in(part)} if isinstance(value, list) else set()


def check(changes):
    """Every note is assessed; the number of scenarios that were accepted."""
    count = 0
    for scenario in scenarios(changes):
        failed = [note for note in write_notes(scenario) if "could not be assessed" in note]
        assert not failed, (scenario.model_dump(exclude_unset=True), failed)
        count += 1
    return count


#: Those that need no file.
WRITTEN = [kind for kind, orbit in ORBITS.items() if not issubclass(orbit, OwnFile)]


@pytest.mark.parametrize("kind", WRITTEN)
def test_notes_know_every_spelling_of_an_orbit(kind):
    written = tables(ORBITS[kind])
    assert keys_in(written) >= {*ORBITS[kind].model_fields}
    assert check({"orbit": table} for table in written) > 0.8 * len(written)


def test_both_sizes_of_an_orbit_are_written():
    """What the other tests rest on: keys that stand for each other are found in the spec."""
    shapes = [{key for key in table if key.endswith("_km")} for table in tables(ORBITS["circular"])]
    assert {"altitude_km"} in shapes and {"radius_km"} in shapes
    shapes = [{*table} for table in tables(ORBITS["kepler"])]
    assert any({"semi_major_axis_km", "eccentricity"} <= keys for keys in shapes)
    assert any({"perigee_altitude_km", "apogee_altitude_km"} <= keys for keys in shapes)
    starts = {table["start"]["kind"] for table in tables(ORBITS["numerical"])}
    assert starts == {"kepler", "circular", "state_vector", "sgp4"}


@pytest.mark.parametrize(
    ("place", "spec", "others"),
    [
        ("environment", Environment, {"orbit": {"kind": "sgp4", "tle": TLE}}),
        ("environment", Environment, {"orbit": BENCH}),
        ("spacecraft", Spacecraft, {}),
        ("disturbance", Disturbance, {}),
        ("disturbance", Disturbance, {"orbit": BENCH}),
        ("initial", InitialMotion, {}),
        ("mission", Mission, {}),
        ("simulation", Simulation, {}),
        ("control", Control, {}),
    ],
)
def test_notes_know_every_key(place, spec, others):
    written = tables(spec)
    assert {key for table in written for key in table} >= {*spec.model_fields} - {
        "modes",
        "estimators",
        *("own", "own_sensor"),  # which need files
    }
    whole = WHOLE.get("spacecraft.wheels") if place == "spacecraft" else None
    more = {"wheels": whole, "coils": {"limit_a_m2": 3.0}} if whole else {}
    assert check({place: more | table, **others} for table in written) > 0.5 * len(written)


@pytest.mark.parametrize("kind", [kind for kind in EXAMPLES if kind != "user"])
def test_notes_know_every_law(kind):
    law = {"control.law": {"kind": kind, **EXAMPLES[kind]}}
    estimators = [
        {"kind": "attitude_sensor"},
        *(t for k in ESTIMATORS for t in tables(ESTIMATORS[k])[:1]),
    ]
    assert check({**law, "control.estimator": each} for each in estimators) >= 1


def test_keys_of_a_scenario_are_all_tried():
    tried = {"orbit", "environment", "spacecraft", "disturbance", "initial", "mission",
             "simulation", "control"}  # fmt: skip
    assert {*Scenario.model_fields} - tried == {"name", "description", "start", "seed"}
