"""Members side by side leave out the readings at which no law looks.

That no bit changes is tested where members fly (`test_lanes`): the tip-off's law looks at one of
five sensors with errors.
"""

import numpy as np
import pytest
from law_examples import EXAMPLES
from pydantic import TypeAdapter

import torquer
from torquer.compile import engine
from torquer.computer.interface import NUMBERS
from torquer.computer.laws import AnyLaw
from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes.group import Lanes, Pieces
from torquer.simulation.lanes.sensed import looked_at, without_unread
from torquer.simulation.loop.timetable import DELIVER, READ, all_actions
from torquer.simulation.setup.run import prepare

#: Every sensor that a member side by side may have, with errors and times of its own.
SENSORS = """
start = 2012-03-04T10:31:47Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 60 }
environment.field.kind = "averaged"
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
initial.rate_deg_s = [1.0, -0.6, 0.8]
spacecraft.coils.limit_a_m2 = 3.0
spacecraft.magnetometer = { noise_nt = 50, sample_s = 1.5, delay_s = 0.5 }
spacecraft.gyro = { noise_deg_s = 0.01, bias_drift_deg_s_sqrt_s = 1e-3 }
spacecraft.attitude_sensor = { noise_deg = 0.1, rate_limit_deg_s = 8 }
spacecraft.horizon_sensor = { axis = [0, 0, -1], half_field_deg = 80, noise_deg = 0.2 }
spacecraft.sun_cells = { normals = [[1, 0, 0], [-1, 0, 0]], half_field_deg = 80, noise = 0.01, \
sample_s = 3.0, delay_s = 1.5 }
spacecraft.sun_sensors = { axes = [[1, 0, 0], [-1, 0, 0]], half_field_deg = 70, noise_deg = 0.5 }
simulation = { duration_s = 900, record_s = 20, step_s = 0.5 }
control.sample_s = 1.0
"""
DAMPED = SENSORS + 'control.law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }\n'


@torquer.law
def seeing_the_sun(inputs, parameters, memory):
    """Names all that it takes."""
    s, b, w = inputs.sun_body, inputs.b_body_t, inputs.estimate.omega_body_rad_s
    return (1e-2 * s[0] + 1e4 * b[1], 1e-2 * s[1], 0.1 * w[2])


def _first(inputs):
    return inputs.sun_body[0]


@torquer.law
def handing_on(inputs, parameters, memory):
    """Its inputs go where its own text does not show what is read."""
    return (1e-2 * _first(inputs), 0.0, 0.0)


@torquer.law
def looking_at_times(inputs, parameters, memory):
    """The time of any reading, also of one whose numbers it does not take."""
    return (1e-4 * inputs.read_at.horizon_sensor_s, 0.0, 0.0)


@torquer.law
def blind(inputs, parameters, memory):
    """Looks at nothing but the clock."""
    return (1e-4 * inputs.t_s, 0.0, 0.0)


ALL = frozenset(NUMBERS)


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (seeing_the_sun, {"sun_sensors", "magnetometer", "gyro", "attitude_sensor"}),
        (handing_on, ALL),
        (looking_at_times, ALL),
        (blind, set()),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_a_users_law_looks_at_what_its_text_names(law, expected):
    assert looked_at(law) == expected


@pytest.mark.parametrize(
    ("need", "sensor"),
    [
        ("magnetometer", "magnetometer"),
        ("rate", "gyro"),
        ("attitude", "attitude_sensor"),
        ("sun", "sun_sensors"),
        ("search_coil", "search_coil"),
        ("tachometers", "tachometers"),
    ],
)
def test_a_law_of_the_package_looks_at_what_it_needs(need, sensor):
    """Every law, and at least one that needs it; that it reads no more is tested with the laws."""
    specs = ({"kind": kind, **keys} for kind, keys in EXAMPLES.items() if kind != "user")
    laws = [TypeAdapter(AnyLaw).validate_python(spec).law() for spec in specs]
    assert any(need in law.needs for law in laws)
    for law in laws:
        assert (sensor in looked_at(law)) == (need in law.needs), law.name


@pytest.mark.skipif(not engine.COMPILED, reason="lanes are compiled code")
def test_the_timetable_keeps_its_instants_and_what_is_looked_at():
    run = prepare(scenario_from_text(DAMPED))
    whole, left = run.plan.timetable, Lanes(run, Pieces(run)).plan.timetable
    assert np.array_equal(left.rows["step"], whole.rows["step"])
    assert np.array_equal(left.rows["hold_steps"], whole.rows["hold_steps"])
    due = {name for name, row in NUMBERS.items() if all_actions(whole) & (READ << row)}
    kept = {name for name, row in NUMBERS.items() if all_actions(left) & (READ << row)}
    assert kept == {"magnetometer"} and len(due) > 5
    delivered = all_actions(left) & (READ - 1)
    assert delivered == DELIVER << NUMBERS["magnetometer"]


def test_a_law_that_looks_at_all_keeps_all():
    whole = prepare(scenario_from_text(DAMPED)).plan.timetable
    assert np.array_equal(without_unread(whole, [handing_on]).rows, whole.rows)
