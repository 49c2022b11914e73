"""Every mistake in a scenario is one line: the user's key, what must hold, what was received."""

import copy
import re
from pathlib import Path

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings
from messages import message_of

from torquer.computer.estimation import ESTIMATORS
from torquer.computer.laws import BUILT_IN, LAWS
from torquer.environment.orbit import ORBITS
from torquer.scenario.load import (
    ScenarioError,
    load_scenario,
    presets,
    scenario_from_data,
    scenario_from_text,
)
from torquer.scenario.spec import Scenario

TLE = (
    "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
    "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
)
INERTIA, LIMIT = "spacecraft.body.inertia_kg_m2", "spacecraft.coils.limit_a_m2"
USER = {"kind": "user", "file": "law.py"}

#: (change, line): the line must be the whole answer.
CASES = [
    # missing and unknown keys at every level
    ({"start": None}, "start: must be given; received nothing"),
    ({"orbit": None}, "orbit: must be given; received nothing"),
    ({"spacecraft.body": None}, "spacecraft.body: must be given; received nothing"),
    ({LIMIT: None}, f"{LIMIT}: must be given without windings; received none"),
    ({"orbit.inclination_deg": None}, "orbit.inclination_deg: must be given; received nothing"),
    ({"control.law": {"kind": "bdot"}},
     "control.law.gain_a_m2_s_per_t: must be given; received nothing"),
    ({"orbits": 3}, "orbits: must be a known key; received 3 (did you mean orbit?)"),
    ({"orbit.altitud_km": 3},
     "orbit.altitud_km: must be a known key; received 3 (did you mean altitude_km?)"),
    ({"control.law.gain": 3}, "control.law.gain: must be a known key; received 3 (known: kind)"),
    ({"control.law.off": 3}, "control.law.off: must be a known key; received 3 (known: kind)"),
    ({"spacecraft.coils.limits": [1]},
     "spacecraft.coils.limits: must be a known key; received [1] (did you mean limit_a_m2?)"),
    ({"environment.field.degree": 3},
     "environment.field.degree: must be a known key; received 3 (known: kind, mu_e_t_km3, b0)"),
    ({"control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1.0, "gain": 1}},
     "control.law.gain: must be a known key; received 1 (did you mean gain_a_m2_s_per_t?)"),
    ({"disturbance.solar_pressure": {"parts": [{"kind": "sphere", "radius_m": 1, "radius": 1}]}},
     "disturbance.solar_pressure.parts[0].radius: must be a known key; received 1 "
     "(did you mean radius_m?)"),
    # kinds
    ({"orbit.kind": None},
     f"orbit.kind: must be one of {', '.join(ORBITS)}; received nothing"),
    ({"orbit.kind": "round"},
     f"orbit.kind: must be one of {', '.join(ORBITS)}; received 'round'"),
    ({"orbit": {"kind": "numerical"}, "orbit.start": {}},
     "orbit.start.kind: must be one of kepler, circular, state_vector, sgp4; received nothing"),
    ({"orbit": {"kind": "numerical", "start": {"kind": "circular", "altitude_km": 400,
                                               "inclination_deg": 50}},
      "orbit.drag": {"mass_kg": 1, "area_m2": 1, "atmosphere": {"kind": "thin"}}},
     "orbit.drag.atmosphere.kind: must be one of gost, exponential, nrlmsis, user; "
     "received 'thin'"),
    ({"spacecraft.body.inertia_kg_m2": {}},
     "spacecraft.body.inertia_kg_m2: must be a list; received {}"),
    ({"spacecraft.aerodynamics": {"parts": [{"kind": "ball"}]}},
     "spacecraft.aerodynamics.parts[0].kind: must be one of box, cylinder, plate, sphere; "
     "received 'ball'"),
    ({"spacecraft.aerodynamics": {"parts": [{"size_m": [1, 1, 1]}]}},
     "spacecraft.aerodynamics.parts[0].kind: must be one of box, cylinder, plate, sphere; "
     "received nothing"),
    ({"spacecraft.body": {"parts": [{"mass_kg": 1, "size_m": [1, 1, 1]}]}},
     "spacecraft.body.parts[0].kind: must be one of box, cylinder, plate, sphere, tensor; "
     "received nothing"),
    ({"spacecraft.aerodynamics": {"parts": []}},
     "spacecraft.aerodynamics.parts: must have 1 or more values; received []"),
    ({"initial.quaternion": [0, 0, 0, 1], "initial.euler_deg": [90, 0, 0]},
     "initial.quaternion: either it or euler_deg must be given; received both, euler_deg = "
     "[90.0, 0.0, 0.0]"),
    ({"control.law.kind": 3},
     f"control.law.kind: must be one of {', '.join(BUILT_IN)}, user, scheme; received 3"),
    ({"control": {"laws": {"field": {"kind": "scheme"}}}},
     f"control.laws.field.kind: must be one of {', '.join(LAWS)}; received 'scheme'"),
    ({"control.estimator": {"kind": "kalman"}},
     f"control.estimator.kind: must be one of {', '.join(ESTIMATORS)}; received 'kalman' "
     "(did you mean kalman_gyro?)"),
    ({"control.estimators": {"law": {"kind": 3}}},
     f"control.estimators.law.kind: must be one of {', '.join(ESTIMATORS)}; received 3"),
    # sensors at a rate of their own
    ({"spacecraft.magnetometer.sample_s": 0.0},
     "spacecraft.magnetometer.sample_s: must be greater than 0; received 0.0"),
    ({"spacecraft.gyro.delay_s": 0.5},
     "spacecraft.gyro.sample_s: must be given with delay_s; received none"),
    ({"spacecraft.sun_sensors": {"axes": [[1, 0, 0]], "half_field_deg": 60, "sample_s": 1.0,
                                 "delay_s": 1.5}},
     "spacecraft.sun_sensors.delay_s: must not exceed sample_s = 1 s; received 1.5 s"),
    ({"spacecraft.attitude_sensor": {"sample_s": 2.0, "delay_s": -1.0}},
     "spacecraft.attitude_sensor.delay_s: must be greater than or equal to 0; received -1.0"),
    ({"spacecraft.magnetometer.sample_s": 1.5},
     "spacecraft.magnetometer.sample_s: must be a whole multiple of step_s = 1 s; received 1.5 s"),
    ({"spacecraft.magnetometer": {"sample_s": 2.0, "delay_s": 0.5}},
     "spacecraft.magnetometer.delay_s: must be a whole multiple of step_s = 1 s; received 0.5 s"),
    # times of readings
    ({"simulation.step_s": 0.001, "control.sample_s": 100.003, "simulation.record_s": 100.003,
      "spacecraft.gyro": {"sample_s": 99.991}},
     "spacecraft.gyro.sample_s: must let control steps and readings repeat after at most 100000 "
     "of them; received a common multiple of 9.9994e+06 s"),
    ({"simulation.step_s": 0.001, "control.sample_s": 0.001, "control.measure_s": 1000.0,
      "control.actuate_s": 1.0, "simulation.record_s": 1001.0},
     "control.sample_s: must let control steps and readings repeat after at most 100000 of them; "
     "received a common multiple of 1001 s"),
    # modes
    ({"control.modes": {"states": {"a": {"final": True}}}},
     "control.laws: must be given with modes, by the names that states use"),
    ({"control": {"laws": {"x": {"kind": "off"}}, "modes": {"states": {"a": {"final": True}}}}},
     "control.laws.x: must be named by a state of modes; received no such state"),
    ({"control.estimators": {"none": {"kind": "rate_from_field"}}},
     "control.estimators.none: must not be named attitude_sensor, none, estimator: these exist "
     "already; received 'none'"),
    ({"control": {"laws": {"x": {"kind": "off"}},
                  "estimators": {"x": {"kind": "rate_from_field"}},
                  "modes": {"states": {"a": {"laws": ["x"], "final": True}}}}},
     "control.laws.x: must have a name that no estimator has; received 'x'"),
    ({"control": {"laws": {"a.b": {"kind": "off"}}}},
     "control.laws: a name must be of letters, digits, '_' and '-' (not first), to be stored; "
     "received 'a.b'"),
    ({"control.estimators": {"a b": {"kind": "rate_from_field"}}},
     "control.estimators: a name must be of letters, digits, '_' and '-' (not first), to be "
     "stored; received 'a b'"),
    ({"control": {"laws": {"estimator": {"kind": "off"}}}},
     "control.laws.estimator: must have a name that no estimator has; received 'estimator'"),
    ({"environment.field": {}}, "environment.field.kind: must be one of igrf14, wmm2025, "
     "tilted_dipole, direct_dipole, averaged, helmholtz_coils, user; "
     "received nothing"),
    ({"orbit": "circular"}, "orbit: must be a table of keys; received 'circular'"),
    ({"orbit": [1]}, "orbit: must be a table of keys; received [1]"),
    ({"spacecraft": 3}, "spacecraft: must be a table of keys; received 3"),
    # wrong types
    ({"simulation.step_s": "fast"}, "simulation.step_s: must be a number; received 'fast'"),
    ({"simulation.step_s": [1]}, "simulation.step_s: must be a number; received [1]"),
    ({"simulation.step_s": float("nan")}, "simulation.step_s: must be finite; received nan"),
    ({"initial.rate_deg_s": 3}, "initial.rate_deg_s: must be a list; received 3"),
    ({"initial.rate_deg_s": []}, "initial.rate_deg_s: must have 3 values; received []"),
    ({"initial.rate_deg_s": [1, 2]}, "initial.rate_deg_s: must have 3 values; received [1, 2]"),
    ({"initial.rate_deg_s": [1, 2, 3, 4]},
     "initial.rate_deg_s: must have 3 values; received [1, 2, 3, 4]"),
    ({"initial.rate_deg_s": [1, "two", 3]},
     "initial.rate_deg_s[1]: must be a number; received 'two'"),
    ({"environment.gravity_gradient": "perhaps"},
     "environment.gravity_gradient: must be true or false; received 'perhaps'"),
    ({"environment.gravity_gradient": "yes"},
     "environment.gravity_gradient: must be true or false; received 'yes'"),
    ({"environment.gravity_gradient": 1},
     "environment.gravity_gradient: must be true or false; received 1"),
    ({"seed": 1.5}, "seed: must be a whole number; received 1.5"),
    ({"seed": -1}, "seed: must be greater than or equal to 0; received -1"),
    ({"seed": 2**63}, f"seed: must be less than {2**63}; received {2**63}"),
    ({"description": 3}, "description: must be text; received 3"),
    ({"control.law": USER | {"file": 3}},
     "control.law.file: must be the path of a file; received 3"),
    ({"control.law": USER | {"parameters": 3}},
     "control.law.parameters: must be a table of keys; received 3"),
    ({"control.law": USER | {"parameters": {"k": "b"}}},
     "control.law.parameters.k: must be a number; received 'b'"),
    ({"name": "../elsewhere"}, "name: must begin with a letter, digit or '_' and hold only these, "
     "'-' and '.'; received '../elsewhere'"),
    ({"name": ".."}, "name: must begin with a letter, digit or '_' and hold only these, "
     "'-' and '.'; received '..'"),
    # unions that no key tells apart
    ({INERTIA: "heavy"}, f"{INERTIA}: must be a list; received 'heavy'"),
    ({INERTIA: [1, 2]}, f"{INERTIA}: must have 3 values; received [1, 2]"),
    ({INERTIA: [1, "a", 3]}, f"{INERTIA}[1]: must be a number; received 'a'"),
    ({INERTIA: [[1, 0, 0], [0, "a", 0], [0, 0, 1]]},
     f"{INERTIA}[1][1]: must be a number; received 'a'"),
    ({INERTIA: [[1, 0, 0], [0, 1], [0, 0, 1]]},
     f"{INERTIA}[1]: must have 3 values; received [0, 1]"),
    ({LIMIT: "strong"}, f"{LIMIT}: must be a number; received 'strong'"),
    ({LIMIT: -1}, f"{LIMIT}: must be greater than 0; received -1"),
    ({LIMIT: [1, -2, 3]}, f"{LIMIT}[1]: must be greater than 0; received -2"),
    # physics
    ({INERTIA: [1, -1, 3]},
     f"{INERTIA}: must be positive definite; received principal moments -1, 1, 3 kg m^2"),
    ({INERTIA: [1, 2, 5]}, f"{INERTIA}: the sum of two principal moments must not be below the "
     "third (triangle inequality); received 1, 2, 5 kg m^2"),
    ({LIMIT: [1, 2]}, f"{LIMIT}: must be one number or one per coil (3 axes); received 2 numbers"),
    ({"spacecraft.coils.axes": [[0, 0, 0]]}, "spacecraft.coils.axes: must be non-zero vectors of "
     "3 numbers; received [[0.0, 0.0, 0.0]]"),
    ({"initial.quaternion": [1, 1, 0, 0]},
     "initial.quaternion: must have length 1 within 1e-6; received [1.0, 1.0, 0.0, 0.0]"),
    ({"initial.sequence": "11"}, "initial.sequence: must be three axes out of 1, 2, 3 with no axis "
     "twice in a row, such as \"313\" or \"321\"; received '11'"),
    ({"initial.reference": "body"},
     "initial.reference: must be 'inertial' or 'orbital'; received 'body'"),
    ({"orbit.inclination_deg": 200},
     "orbit.inclination_deg: must be less than or equal to 180; received 200"),
    ({"orbit.altitude_km": None},
     "orbit: must have altitude_km or radius_km; received none of them"),
    ({"orbit.altitude_km": 1e30},
     "orbit.altitude_km: must be less than or equal to 1500000; received 1e+30"),
    ({"orbit": {"kind": "numerical", "start": {"kind": "state_vector", "position_km": [1e30, 0, 0],
                                               "velocity_km_s": [0, 0, 0]}}},
     "orbit.start: must stay within 1500000 km of the Earth's centre, its Hill sphere; "
     "received one that goes out to 1e+30 km"),
    ({"orbit": {"kind": "numerical", "start": {"kind": "circular", "inclination_deg": 5}}},
     "orbit.start: must have altitude_km or radius_km; received none of them"),
    ({"orbit.radius_km": 7000}, "orbit: must have altitude_km or radius_km; received both"),
    ({"environment.field": {"kind": "igrf14", "degree": 14}},
     "environment.field.degree: must lie within 1..13 for igrf14; received 14"),
    ({"environment.field.b0": -1}, "environment.field.b0: must be 'arithmetic', 'integral' or a "
     "positive number (T); received -1"),
    ({"orbit": {"kind": "sgp4", "tle": [TLE[0], TLE[1][:-1] + "1"]}},
     "orbit.tle: tle line 2: checksum must be 0; received 1"),
    ({"orbit": {"kind": "sgp4", "tle": [TLE[0]]}},
     "orbit.tle: must have two lines, or three with a name; received 1"),
    # time
    ({"start": "2012-03-04T10:31:47"}, "start: must be a time with a zone, such as "
     "2012-03-04T10:31:47Z; received '2012-03-04T10:31:47'"),
    ({"start": "2012-03-04"}, "start: must be a time with a zone, such as "
     "2012-03-04T10:31:47Z; received '2012-03-04'"),
    ({"start": 3}, "start: must be a time with a zone, such as 2012-03-04T10:31:47Z; received '3'"),
    ({"start": "1899-12-31T23:59:59Z"},
     "start: must lie within the years 1900 to 2099; received '1899-12-31T23:59:59Z'"),
    ({"start": "0001-01-01T00:00:00+05:00"},
     "start: must lie within the years 1900 to 2099; received '0001-01-01T00:00:00+05:00'"),
    # steps and windows
    ({"simulation.step_s": 0}, "simulation.step_s: must be greater than 0; received 0"),
    ({"simulation.step_s": 0.3},
     "control.sample_s: must be a whole multiple of step_s = 0.3 s; received 1 s"),
    ({"simulation.record_s": 1.5},
     "simulation.record_s: must be a whole multiple of step_s = 1 s; received 1.5 s"),
    ({"simulation.record_s": 0.5},
     "simulation.record_s: must be a whole multiple of step_s = 1 s; received 0.5 s"),
    ({"control.measure_s": 2}, "control.actuate_s: must be given with measure_s; received none"),
    ({"control.measure_s": 2.5, "control.actuate_s": 1},
     "control.measure_s: must be a whole multiple of sample_s = 1 s; received 2.5 s"),
    ({"control.measure_s": 2, "control.actuate_s": 1.5},
     "control: measure_s + actuate_s: must be a whole multiple of step_s = 1 s; received 3.5 s"),
    ({"control.actuate_s": 3}, "control.actuate_s: without measure_s the dipole is held for "
     "sample_s = 1 s; received 3 s"),
    ({"simulation.duration_s": None},
     "simulation.duration_s: either it or revolutions must be given; received none"),
    ({"simulation.revolutions": 1},
     "simulation.duration_s: either it or revolutions must be given; received both"),
    ({"simulation.duration_s": 1e300},
     "simulation.duration_s: must be at most 1e+10; received 1e+300"),
    ({"simulation.duration_s": 1e10, "simulation.step_s": 1e-5},
     "simulation: a run must have 1 to 1e+13 steps; received 1e+15"),
    ({"simulation.duration_s": 4e9},
     "simulation: the run must end before 2101; received a length of 46296.3 days from "
     "2012-03-04T10:31:47+00:00"),
    ({"simulation.duration_s": 1e-6},
     "simulation.record_s: must not exceed the duration of 1e-06 s; received 10 s"),
    ({"simulation.step_s": 1e-320}, "simulation.step_s: must be at least 1e-09; received 1e-320"),
    ({"environment.table_tolerance": 0, "simulation.integrator": "splitting"},
     "environment.table_tolerance: 0 (no table) needs simulation.integrator 'rk4'; "
     "received 'splitting'"),
    ({"simulation.integrator": "euler"},
     "simulation.integrator: must be 'auto', 'rk4' or 'splitting'; received 'euler'"),
    # presets
    ({"spacecraft.magnetometer.preset": "fancy"},
     "spacecraft.magnetometer.preset: must be one of hmr2300r; received 'fancy'"),
    ({"spacecraft.magnetometer.preset": 3},
     "spacecraft.magnetometer.preset: must be one of hmr2300r; received 3"),
    ({"spacecraft.magnetometer.preset": ["hmr2300r"]},
     "spacecraft.magnetometer.preset: must be one of hmr2300r; received ['hmr2300r']"),
    ({"spacecraft.magnetometer": {"preset": "dss3", "noise_nt": 5.0}},
     "spacecraft.magnetometer.preset: must be one of hmr2300r; received 'dss3'"),
    ({"spacecraft.body.preset": "chibis_m_coils"},
     "spacecraft.body.preset: must be one of chibis_m_body; received 'chibis_m_coils'"),
    ({"orbit.preset": "dss3"},
     "orbit.preset: must not be given: none fits this table; received 'dss3'"),
    ({"preset": "dss3"}, "preset: must not be given: none fits this table; received 'dss3'"),
]  # fmt: skip


def test_every_single_mistake_is_one_line(plain_data):
    found = [message_of(scenario_from_data, plain_data(change)) for change, _ in CASES]
    assert found == [line for _, line in CASES]


def test_every_mistake_has_its_line(plain_data):
    data = plain_data({"seed": -1, "orbits": 3, "initial.rate_deg_s": [1]})
    with pytest.raises(ScenarioError) as caught:
        scenario_from_data(data)
    assert str(caught.value).splitlines() == [
        "seed: must be greater than or equal to 0; received -1",
        "initial.rate_deg_s: must have 3 values; received [1]",
        "orbits: must be a known key; received 3 (did you mean orbit?)",
    ]


def test_a_long_value_is_cut():
    with pytest.raises(ScenarioError) as caught:
        scenario_from_data({"start": "x" * 10000})
    assert max(map(len, str(caught.value).splitlines())) < 20000
    with pytest.raises(ScenarioError) as caught:
        scenario_from_data({"mistaken": {str(k): k for k in range(1000)}})
    assert max(map(len, str(caught.value).splitlines())) < 300


def test_files_that_are_no_scenarios(tmp_path):
    with pytest.raises(ScenarioError, match=r"readable file; received .* \(No such file"):
        load_scenario(tmp_path / "nowhere.toml")
    with pytest.raises(ScenarioError, match=r"readable file; received .* \(Is a directory\)"):
        load_scenario(tmp_path)
    (tmp_path / "latin.toml").write_bytes("description = 'Größe'".encode("latin-1"))
    with pytest.raises(ScenarioError, match="not UTF-8 text"):
        load_scenario(tmp_path / "latin.toml")
    with pytest.raises(ScenarioError, match=r"must be TOML; received: .* \(at line 2, column 7\)"):
        scenario_from_text("a = 1\nb = [ = ]")


ODD = st.one_of(
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    st.datetimes(),
    st.lists(st.floats() | st.text(max_size=5) | st.lists(st.floats(), max_size=4), max_size=5),
    st.dictionaries(st.text(max_size=8), st.integers(), max_size=3),
    st.sampled_from(["user", "bdot", "igrf14", "sgp4", "kepler", "orbital", 1e300, 5e-324, 0, -1]),
)


def tables(data, place=()):
    """Every (place, key) of a nested dict."""
    for key, value in data.items():
        yield (*place, key)
        if isinstance(value, dict):
            yield from tables(value, (*place, key))


FULL = {
    "spacecraft.magnetometer": {"noise_nt": 5.0, "bias_nt": [1.0, 2.0, 3.0]},
    "spacecraft.sun_sensors": {"axes": [[1.0, 0.0, 0.0]], "half_field_deg": 30.0},
    "spacecraft.gyro.preset": "adis16130",
    "control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e5},
    "orbit": {"kind": "kepler", "semi_major_axis_km": 7000.0, "eccentricity": 0.01,
              "inclination_deg": 50.0},
}  # fmt: skip


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_no_mutation_gives_anything_but_a_scenario_or_its_error(plain_data, data):
    scenario = copy.deepcopy(plain_data(FULL))
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.sampled_from(sorted(tables(scenario))))
        table = scenario
        for key in place[:-1]:
            table = table[key]
        action = data.draw(st.sampled_from(["replace", "remove", "add"]))
        if action == "replace":
            table[place[-1]] = data.draw(ODD)
        elif action == "remove":
            del table[place[-1]]
        else:
            table[data.draw(st.text(max_size=10))] = data.draw(ODD)
    try:
        assert isinstance(scenario_from_data(scenario), Scenario)
    except ScenarioError as error:
        assert str(error)
        for line in str(error).split("\n"):
            assert re.search(r": .*(must|without|either|the sum)", line, re.DOTALL), line
            assert "function-" not in line and "pydantic" not in line, line


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=200))
def test_no_text_gives_anything_but_an_error(text):
    with pytest.raises(ScenarioError):
        scenario_from_text(text)


def test_hypothesis_starts_from_a_valid_scenario(plain_data):
    assert isinstance(scenario_from_data(plain_data(FULL)), Scenario)


def test_the_scenario_given_is_left_alone(plain_data):
    data = plain_data(FULL | {"control.law": USER})
    before = copy.deepcopy(data)
    scenario_from_data(data, Path("/somewhere"))
    assert data == before
    assert "adis16130" in presets()
