"""Several sensors of a kind: how files give them, what is refused, what is flown."""

import math

import numpy as np
import pytest
from scipy import stats

from torquer import simulate
from torquer.compile import engine
from torquer.scenario.load import ScenarioError, scenario_from_text
from torquer.spacecraft.sensors.device import MOST_UNITS
from torquer.spacecraft.sensors.gyro import Gyro
from torquer.spacecraft.sensors.integrating_gyro import IntegratingGyro

in_flight = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

HEAD = """
start = 2012-03-04T10:31:47Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 60 }
environment.field.kind = "averaged"
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
spacecraft.coils.limit_a_m2 = 3.0
initial.rate_deg_s = [1.0, -0.6, 0.8]
simulation = { duration_s = 60, record_s = 2, step_s = 1.0 }
"""
LAW = 'control.law = { kind = "bdot", gain_a_m2_s_per_t = 1e6 }\n'
TWO = "spacecraft.magnetometers = { main = { noise_nt = 5 }, boom = { noise_nt = 10 } }\n"
FINE = "{ boresight = [0, 0, 1], up = [0, 1, 0], half_field_deg = 60 }"
FILTER = """
control.estimator = {{ kind = "kalman_gyro", sensors = {sensors}, magnetometer_noise_nt = 10, \
angle_random_walk_deg_sqrt_s = 1e-3, rate_random_walk_deg_s_sqrt_s = 1e-5, \
gyro_bias_sigma_deg_s = 0.1, {more} }}
"""
MODES = """
control.laws.damp = {{ kind = "bdot", gain_a_m2_s_per_t = 1e6 }}
control.modes.inertia_kg_m2 = [1.0, 1.3, 1.7]
control.modes.noise = {{ magnetometer_noise_nt = 100, sun_noise_deg = 1.0, \
gyro_noise_deg_s = 0.02, rate_tolerance_deg_s = 0.1 }}
control.modes.states.a = {{ laws = ["damp"], select = {select}, \
transitions = [{{ to = "b", when = {{ {when} }} }}] }}
control.modes.states.b = {{ laws = ["damp"], final = true }}
"""


def in_list(*tables):
    """Magnetometers in a list."""
    return LAW + f"spacecraft.magnetometers = [{', '.join(tables)}]\n"


def craft(text):
    return LAW + "".join(f"spacecraft.{line}\n" for line in text.split("; "))


def selecting(text):
    return LAW + TWO + f"control.select.magnetometer = {text}\n"


def filtering(more, sensors=("magnetometer", "sun")):
    noise = "sun_noise_deg = 0.5, " if "sun" in sensors else ""
    return LAW + TWO + FILTER.format(sensors=[*sensors], more=noise + more).replace("'", '"')


def with_modes(select="{}", when='signal = "time_s", above = 30', more=TWO):
    return more + MODES.format(select=select, when=when)


#: Text of a scenario after its head -> the line that says what is wrong.
WRONG = {
    in_list("{ noise_nt = 5 }"): "spacecraft.magnetometers[0].name: must be given, text, for each "
    "of several sensors; received {'noise_nt': 5}",
    in_list('{ name = "a" }', '{ name = "a" }'): "spacecraft.magnetometers[1].name: must differ "
    "for each of several sensors; received 'a' again",
    in_list('{ name = [1], preset = "x" }'): "spacecraft.magnetometers[0].name: must be given, "
    "text, for each of several sensors; received [1]",
    in_list("1"): "spacecraft.magnetometers[0].name: must be given, text, for each of several "
    "sensors; received 1",
    in_list('{ name = "a", noise = 5 }'): "spacecraft.magnetometers.a.noise: must be a known key; "
    "received 5 (did you mean noise_nt?)",
    in_list('{ name = "a" }', '{ name = "b", noise_nt = -3 }'): "spacecraft.magnetometers.b."
    "noise_nt: must be greater than or equal to 0; received -3",
    in_list('{ name = "a", noise_nt = nan }'): "spacecraft.magnetometers.a.noise_nt: must be "
    "finite; received nan",
    in_list('{ name = "a", noise_nt = "x" }'): "spacecraft.magnetometers.a.noise_nt: must be a "
    "number; received 'x'",
    in_list('{ name = "a", preset = "dss3" }'): "spacecraft.magnetometers.a.preset: must be one "
    "of hmr2300r; received 'dss3'",
    craft("magnetometers.gyro = {}"): "spacecraft.magnetometers: must have names of letters, "
    "digits and underscores, not that of a kind of device; received 'gyro'",
    craft("magnetometers.gyros = {}"): "spacecraft.magnetometers: must have names of letters, "
    "digits and underscores, not that of a kind of device; received 'gyros'",
    craft('magnetometers."a b" = {}'): "spacecraft.magnetometers: must have names of letters, "
    "digits and underscores, not that of a kind of device; received 'a b'",
    craft("magnetometers.a = {}; gyros.a = {}"): "spacecraft.gyros.a: must have a name that no "
    "other sensor has; received that of magnetometers.a",
    craft("; ".join(f"magnetometers.m{k} = {{}}" for k in range(MOST_UNITS + 1))): "spacecraft."
    "magnetometers: must be, with all other kinds of which there are several, at most 12 sensors; "
    "received 13",
    craft("magnetometers.a = {}; magnetometer.noise_nt = 5"): "spacecraft.magnetometer: must be "
    "left out with magnetometers; received both",
    craft("gyros.a = {}; integrating_gyros.b = {}"): "spacecraft.gyro: must be left out with an "
    "integrating gyro; received both",
    craft("magnetometers = 5"): "spacecraft.magnetometers: must be a table of keys; received 5",
    craft("sun_sensors = [{ name = 'a', axes = [[1, 0, 0], [0, 1, 0]], half_field_deg = 9 }]"):
    "spacecraft.sun_heads.a: must have one axis and no blind zones, as one of several; received 2 "
    "axes, 0 blind zones",
    craft("sun_sensors = []; sun_heads = {}"): "spacecraft.sun_heads: must be left out with a list "
    "of sun_sensors; received both",
    craft("integrating_gyros.a.failures = [{ kind = 'swapped', axes = 'xy' }]"): "spacecraft."
    "integrating_gyros.a.failures[0].kind: must be one of silent, stuck, zeros, nan, infinite; "
    "received 'swapped'",
    craft("magnetometers = []"): "spacecraft.magnetometers: must hold a table for each of several "
    "sensors; received none",
    craft("sun_sensors = []"): "spacecraft.sun_sensors: must hold a table for each of several "
    "sensors; received none",
    selecting('{ kind = "vote" }'): "control.select.magnetometer.kind: must be 'mean' or 'spare' "
    "with fewer than three sensors, of which none is outvoted; received 'vote' of 2",
    LAW + 'control.select.magnetometer.kind = "vote"\n': "control.select.magnetometer: must be a "
    "kind of sensor of which laws read one for several (none); received 'magnetometer'",
    LAW + TWO + 'control.select.boom.kind = "vote"\n': "control.select.boom: must be a kind of "
    "sensor of which laws read one for several (magnetometer); received 'boom'",
    craft(f"fine_sun_sensors.a = {FINE}") + "control.select.fine_sun_sensor = {}\n": "control."
    "select.fine_sun_sensor: must be a kind of sensor of which laws read one for several (none); "
    "received 'fine_sun_sensor'",
    craft("integrating_gyros.a = {}") + "control.select.integrating_gyro = {}\n": "control.select."
    "integrating_gyro: must be a kind of sensor of which laws read one for several (gyro); "
    "received 'integrating_gyro'",
    selecting('{ kind = "median" }'): "control.select.magnetometer.kind: must be 'mean', 'vote' or "
    "'spare'; received 'median'",
    selecting('{ kind = "spare", warm_up_s = -2 }'): "control.select.magnetometer.warm_up_s: must "
    "be greater than or equal to 0; received -2",
    selecting('{ kind = "spare", warm_up_s = nan }'): "control.select.magnetometer.warm_up_s: must "
    "be finite; received nan",
    selecting('{ kind = "spare", warm_up_s = "x" }'): "control.select.magnetometer.warm_up_s: must "
    "be a number; received 'x'",
    selecting('{ kind = "vote", warm_up_s = 5 }'): "control.select.magnetometer.warm_up_s: must be "
    "left out for kind 'vote'; received 5",
    with_modes('{ magnetometer = "x" }'): "control.modes.states.a.select.magnetometer: must be one "
    "of main, boom; received 'x'",
    with_modes('{ magnetometer = "g" }', more=TWO + "spacecraft.gyros.g = {}\n"): "control.modes."
    "states.a.select.magnetometer: must be one of main, boom; received 'g'",
    with_modes('{ gyro = "gyro" }'): "control.modes.states.a.select: must be one of magnetometer; "
    "received 'gyro'",
    with_modes('{ magnetometer = "magnetometer" }', more=""): "control.modes.states.a.select: must "
    "be one of none; received 'magnetometer'",
    with_modes("{ magnetometer = 1 }"): "control.modes.states.a.select.magnetometer: must be text; "
    "received 1",
    filtering("unit_noise = { mast = 5 }"): "control.estimator.unit_noise: must be one of main, "
    "boom; received 'mast'",
    filtering("unit_noise = { boom = nan }"): "control.estimator.unit_noise.boom: must be finite; "
    "received nan",
    filtering("unit_noise = { boom = 0 }"): "control.estimator.unit_noise.boom: must be greater "
    "than 0; received 0",
    filtering("unit_noise = { boom = 5 }", ["magnetometer"]): "control.estimator.unit_noise: must "
    "be one of none; received 'boom'",
    **{
        filtering(f"{key} = 0.01", sensors): f"control.estimator.{key}: must be left out with "
        "spacecraft.magnetometers, each of which has errors of its own; received 0.01"
        for key in ("magnetometer_bias_sigma_nt", "magnetometer_scale_sigma",
                    "magnetometer_misalignment_sigma_deg")
        for sensors in (["magnetometer"], ["magnetometer", "sun"])
    },
}  # fmt: skip


@pytest.mark.parametrize(("text", "line"), WRONG.items(), ids=range(len(WRONG)))
def test_mistakes_are_one_line_that_names_the_key(text, line):
    with pytest.raises(ScenarioError) as error:
        scenario_from_text(HEAD + text)
    assert str(error.value) == line


@pytest.mark.parametrize("signal", ["reading_age_s", "sensor_suspected", "estimate_doubts"])
@pytest.mark.parametrize("sensor", ["mast", "magnetometers"])
def test_conditions_are_about_sensors_that_are_there(signal, sensor):
    text = with_modes(when=f'signal = "{signal}", sensor = "{sensor}", above = 0.5')
    with pytest.raises(ScenarioError) as error:
        scenario_from_text(HEAD + text)
    assert str(error.value).startswith(
        "control.modes.states.a.transitions[0].when[0].sensor: must be one of magnetometer, "
    )
    assert str(error.value).endswith(f", main, boom; received '{sensor}'")


def test_a_list_is_the_same_as_tables_by_name():
    listed = '{ name = "main", noise_nt = 5 }', '{ name = "boom", preset = "hmr2300r" }'
    named = craft('magnetometers.main.noise_nt = 5; magnetometers.boom.preset = "hmr2300r"')
    assert scenario_from_text(HEAD + in_list(*listed)) == scenario_from_text(HEAD + named)
    head = "axes = [[1, 0, 0]], half_field_deg = 60"
    assert scenario_from_text(
        HEAD + craft(f"sun_sensors = [{{ name = 'a', {head} }}]")
    ) == scenario_from_text(HEAD + craft(f"sun_heads.a = {{ {head} }}"))


def test_what_is_rounded_above_its_noise_may_repeat_itself():
    device = scenario_from_text(HEAD + craft("gyros.g = {}")).spacecraft.units()[0].device
    assert device.may_repeat(Gyro())
    assert device.may_repeat(Gyro(noise_deg_s=0.01, resolution_deg_s=0.02))
    assert not device.may_repeat(Gyro(noise_deg_s=0.01, resolution_deg_s=0.01))
    device = scenario_from_text(HEAD + craft("integrating_gyros.g = {}")).spacecraft.units()[0]
    quiet = {"angle_random_walk_deg_sqrt_h": 0.003, "quantum_arcsec": 1.0}
    assert device.device.may_repeat(IntegratingGyro(**quiet))
    assert not device.device.may_repeat(IntegratingGyro(**quiet | {"quantum_arcsec": 0.1}))


@in_flight
@pytest.mark.parametrize("count", [1, 4])
def test_the_noise_of_an_integrated_rate_does_not_depend_on_the_sampling(count):
    """Of the mean rate over a control step of 1 s: the angle random walk over sqrt(1 s).

    Of four gyros of the same noise the mean has half of it. Nothing turns the body, whose rate
    stays; biases are none.
    """
    walk, found = 0.2, []  # deg/sqrt(h)
    for sample_s in (0.1, 0.5, 1.0):
        own = f"{{ angle_random_walk_deg_sqrt_h = {walk}, sample_s = {sample_s} }}"
        text = "".join(f"spacecraft.integrating_gyros.g{k} = {own}\n" for k in range(count))
        head = HEAD.replace("[1.0, 1.3, 1.7]", "[1.0, 1.0, 1.0]")
        head = head.replace("step_s = 1.0", "step_s = 0.1")
        head = head.replace("duration_s = 60, record_s = 2", "duration_s = 2000, record_s = 1")
        scenario = scenario_from_text(head + 'control.law.kind = "off"\n' + text)
        result = simulate(scenario)
        error = result.omega_measured.values[2:] - result.omega_body.values[2:]
        expected = math.radians(walk) / 60.0 / math.sqrt(count)
        low, high = np.sqrt(stats.chi2.ppf([1e-7, 1.0 - 1e-7], error.size) / error.size)
        assert low < np.sqrt(np.mean(error**2)) / expected < high
        found.append(error)
    assert not np.array_equal(found[0], found[2])


@in_flight
def test_sensors_of_several_see_the_sun_though_nothing_else_needs_it():
    text = craft(
        "sun_heads.a = { axes = [[0, 0, 1]], half_field_deg = 180 }; "
        "fine_sun_sensors.b = { boresight = [0, 0, 1], up = [0, 1, 0], half_field_deg = 89 }"
    )
    scenario = scenario_from_text(HEAD + text).replace("simulation.record_inputs", True)
    result = simulate(scenario)
    sun = result["sun_heads.a"].values[1:]
    assert np.linalg.norm(sun, axis=1) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(np.diff(sun, axis=0), axis=1).max() > 0.01  # the body turns
    tangents = result["fine_sun_sensors.b"].values[1:]
    seen = tangents[:, 2] == 1.0
    assert np.array_equal(seen, (sun[:, 2] > 0.0) & (tangents[:, 2] != 0.0))
    assert tangents[seen, :2] == pytest.approx(sun[seen, :2] / sun[seen, 2:], rel=1e-9)
