"""What the computer assumes of devices: walks over all that is assumed, and the cases of it."""

import math

import pytest
from device_cases import DEVICES, DIRECTIONS, keys_of, least_keys, pairs, spec_with, users

from torquer.analysis.notes.assumption_notes import assumption_notes
from torquer.analysis.notes.notes import write_notes
from torquer.scenario.load import scenario_from_text

LATER = {"to": "on", "at_least_s": 9.0}
#: States of a mode table that has checks.
STATES = {"states": {"on": {"laws": ["law"]}}}


def notes_of(make, kind, keys, device="", own=(), **changes):
    """Notes with one user of devices, and with one device."""
    control = {"law": {"kind": "off"}, "estimator": {"kind": kind, **keys}}
    if kind == "noise":
        control = {"laws": {"law": {"kind": "off"}}, "modes": {**STATES, "noise": keys}}
        control["modes"]["inertia_kg_m2"] = [1.0, 1.3, 1.7]
    given = {"control": control, "initial": {"rate_deg_s": [0.5, -0.3, 0.4]}} | changes
    if device:
        given[f"spacecraft.{device}"] = dict(own)
    return assumption_notes(make(given))


def place(kind):
    return "control.modes.noise" if kind == "noise" else "control.estimator"


def stated(kind, assumed):
    return float(users()[kind][assumed.key])


NOISY = pairs("noise", "noise_about", "white", "drift")
SIZED = [each for each in pairs("*") if each[1].sigmas and each[1].device != "initial"]


@pytest.mark.parametrize("kind", users())
def test_nothing_is_said_of_what_fits(make, kind):
    assert notes_of(make, kind, users()[kind]) == []


@pytest.mark.parametrize("kind", users())
def test_all_that_is_assumed_is_of_something_that_a_device_has(kind):
    for assumed in spec_with(kind, users()[kind]).assumes:
        if assumed.device != "initial":
            what = "noise" if assumed.what == "white" else assumed.what
            assert getattr(DEVICES[assumed.device].sheet, what)


@pytest.mark.parametrize("kind", users())
def test_every_key_about_noise_or_an_error_is_declared(kind):
    """So that no key of an estimator or check escapes the rules."""
    keys = users()[kind]
    declared = {assumed.key for assumed in spec_with(kind, keys).assumes}
    of_motion = {"torque_noise_n_m_sqrt_s"}  # of no device
    for key in keys.keys() - of_motion:
        assert key in declared or not {"noise", "sigma", "walk"} & {*key.split("_")}, key


@pytest.mark.parametrize(("kind", "assumed"), NOISY)
def test_a_noise_stated_far_below_the_devices_is_noted(make, kind, assumed):
    """From twice on; below it the filter may be a little off, above it covers other errors."""
    what = {"white": "noise"}.get(assumed.what, assumed.what)
    for factor, expected in ((5.0, True), (1.5, False), (0.1, False)):
        own = keys_of(assumed.device, what, factor * stated(kind, assumed))
        notes = notes_of(make, kind, users()[kind], assumed.device, own)
        said = [n for n in notes if n.startswith(f"{place(kind)}.{assumed.key} of ")]
        assert [("must not be far below" in note) for note in said] == [True] * expected
        if expected:
            sheet = DEVICES[assumed.device].sheet
            assert f"of spacecraft.{assumed.device}.{getattr(sheet, what)}" in said[0]


@pytest.mark.parametrize(("kind", "assumed"), NOISY)
def test_a_noise_stated_absurdly_above_the_devices_is_noted(make, kind, assumed):
    what = {"white": "noise"}.get(assumed.what, assumed.what)
    keys = users()[kind]
    for factor, expected in ((2000.0, True), (10.0, False)):
        own = keys_of(assumed.device, what, stated(kind, assumed) / factor)
        notes = notes_of(make, kind, keys, assumed.device, own)
        said = [n for n in notes if n.startswith(f"{place(kind)}.{assumed.key} of ")]
        assert [(" is far above the " in note) for note in said] == [True] * expected


@pytest.mark.parametrize(("kind", "assumed"), SIZED)
def test_a_fixed_error_outside_of_what_is_stated_is_noted(make, kind, assumed):
    sheet = DEVICES[assumed.device].sheet
    for factor, expected in ((3.0, True), (0.5, False)):
        error = factor * assumed.sigmas * stated(kind, assumed)
        own = keys_of(assumed.device, assumed.what, error)
        notes = notes_of(make, kind, users()[kind], assumed.device, own)
        begins = f"spacecraft.{assumed.device}.{getattr(sheet, assumed.what)} of "
        said = [n for n in notes if n.startswith(begins) and assumed.key in n]
        assert len(said) == expected, notes


def test_a_rate_outside_of_what_a_filter_states_is_noted_where_it_works_at_the_start(make):
    keys = users()["kalman_dynamics"]
    fast = {"initial": {"rate_deg_s": [3.0, 0.0, 0.0]}}
    (note,) = notes_of(make, "kalman_dynamics", keys, **fast)
    assert note.startswith("the initial rate of 3 deg/s lies 6 sigma outside of ")
    states = {
        "first": {
            "laws": ["law"],
            "estimator": "none",
            "transitions": [{"to": "on", "at_least_s": 9.0}],
        },
        "on": {"laws": ["law"]},
    }
    later = {"control": {"laws": {"law": {"kind": "off"}},
                         "estimator": {"kind": "kalman_dynamics", **keys},
                         "modes": {"states": states}}}  # fmt: skip
    assert notes_of(make, "kalman_dynamics", keys, **(fast | later)) == []


#: Errors that stay, of devices of whose noise something is assumed, where a filter has no state.
LASTING = [
    (kind, assumed, what)
    for kind, assumed in pairs("noise")
    if kind != "noise"
    for what in ("bias", "scale", "misalignment")
    if getattr(DEVICES[assumed.device].sheet, what)
]


@pytest.mark.parametrize(("kind", "assumed", "what"), LASTING)
def test_a_fixed_error_without_noise_or_state_for_it_is_noted(make, kind, assumed, what):
    keys = {key: value for key, value in users()[kind].items() if "_sigma" not in key}
    kept = {"gyro_bias_sigma_deg_s", "rate_sigma_deg_s"} & users()[kind].keys()
    keys |= {key: users()[kind][key] for key in kept}
    size = {"field": 3e4, "light": 1.0}.get(DEVICES[assumed.device].sheet.senses, math.degrees(1.0))
    per = {"scale": size, "misalignment": size * math.radians(1.0)}.get(what, 1.0)
    for factor, expected in ((10.0, True), (0.2, False)):
        own = keys_of(assumed.device, what, factor * stated(kind, assumed) / per)
        notes = notes_of(make, kind, keys, assumed.device, own)
        begins = f"control.estimator leaves no room for errors of spacecraft.{assumed.device} "
        said = [note for note in notes if note.startswith(begins)]
        assert len(said) == expected, notes
        assert all(DEVICES[assumed.device].sheet.in_words(what) in note for note in said)


SEEING = [each for each in pairs("noise") if DEVICES[each[1].device].sheet.albedo]


@pytest.mark.parametrize(("kind", "assumed"), [each for each in SEEING if each[0] != "noise"])
def test_the_earths_light_that_a_filter_takes_for_the_suns_is_noted(make, kind, assumed):
    name = assumed.device
    own = least_keys(DEVICES[name]) | {DEVICES[name].sheet.albedo: 0.3}
    notes = notes_of(make, kind, users()[kind], name, own)
    (note,) = notes
    assert note.startswith(
        f"control.estimator takes the readings of spacecraft.{name} for sunlight"
    )
    own = least_keys(DEVICES[name]) | {DEVICES[name].sheet.albedo: 0.0}
    assert notes_of(make, kind, users()[kind], name, own) == []


def test_an_albedo_that_a_filter_takes_off_is_that_of_the_earth(make):
    keys = users()["kalman_gyro"] | {"cell_albedo": 0.3, "cell_albedo_error": 0.0}
    cells = least_keys(DEVICES["sun_cells"])
    assert notes_of(make, "kalman_gyro", keys, "sun_cells", cells | {"albedo": 0.3}) == []
    for albedo in (0.0, 0.1):
        (note,) = notes_of(make, "kalman_gyro", keys, "sun_cells", cells | {"albedo": albedo})
        assert "cell_albedo of 0.3 takes off other light than the Earth's" in note
    unsure = keys | {"cell_albedo_error": 0.5}
    assert notes_of(make, "kalman_gyro", unsure, "sun_cells", cells | {"albedo": 0.1}) == []


@pytest.mark.parametrize(("kind", "assumed"), pairs("axes"))
def test_directions_on_board_are_those_of_the_device(make, kind, assumed):
    axes, name = DEVICES[assumed.device].sheet.axes, assumed.device
    value = users()[kind][assumed.key]
    one = value if isinstance(value[0], int) else None
    turned = [0, 1, 1] if one else [[0.2, 1, 0], *value[1:]]
    for mounted, expected in ((value, 0), (turned, 1)):
        own = least_keys(DEVICES[name]) | {axes: mounted}
        if name == "horizon_sensor":
            own |= {"half_field_deg": 70.0}
        notes = notes_of(make, kind, users()[kind], name, own)
        assert len(notes) == expected and all("more than any error of mounting" in n for n in notes)
    if not one:
        own = least_keys(DEVICES[name]) | {axes: DIRECTIONS[:3]}
        (note,) = notes_of(make, kind, users()[kind], name, own)
        assert "has 6 directions, " in note and " has 3: " in note


@pytest.mark.parametrize(
    ("key", "value"),
    [("inertia_kg_m2", [0.3, 0.4, 0.5]), ("wheel_momentum_n_m_s", [0.0, 0.1, 0.0])],
)
def test_the_body_on_board_is_that_of_the_satellite(make, key, value):
    """A key that a part of the computer and the body both have."""
    keys = users()["kalman_dynamics"]
    notes = notes_of(make, "kalman_dynamics", keys, **{f"spacecraft.body.{key}": value})
    (note,) = notes
    assert note.startswith(f"control.estimator.{key} is not that of spacecraft.body: of size ")
    both = {f"spacecraft.body.{key}": value}
    assert notes_of(make, "kalman_dynamics", keys | {key: value}, **both) == []


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_a_body_that_is_known_roughly_is_left_alone(make, factor):
    keys = users()["kalman_dynamics"] | {"inertia_kg_m2": [factor, 1.3 * factor, 1.7 * factor]}
    assert notes_of(make, "kalman_dynamics", keys) == []


GOALS = {
    "rate_below_deg_s": ("gyro", {"resolution_deg_s": 1.0}, {"resolution_deg_s": 0.1}),
    "rate_orbital_below_deg_s": ("gyro", {"bias_deg_s": [0.5, 0, 0]}, {"bias_deg_s": [0.05, 0, 0]}),
    "attitude_error_below_deg": (
        "attitude_sensor", {"error_deg": [0.5, 0, 0]}, {"error_deg": [0.05, 0, 0]},
    ),
}  # fmt: skip


@pytest.mark.parametrize("goal", GOALS)
def test_a_goal_below_what_a_sensor_shows_is_noted(make, goal):
    name, bad, good = GOALS[goal]
    hold = {"kind": "wheel_pd", "bandwidth_rad_s": 0.05, "inertia_kg_m2": [1.0, 1.3, 1.7]}
    wheels = {"spacecraft.wheels": least_keys(DEVICES["wheels"])}
    flown = {"control.law": hold, "mission": {goal: 0.2}} | wheels
    (note,) = assumption_notes(make(flown | {f"spacecraft.{name}": bad}))
    assert note.startswith(f"mission.{goal} of 0.2 ") and f"spacecraft.{name}." in note
    assert assumption_notes(make(flown | {f"spacecraft.{name}": good})) == []
    filter_ = {"kind": "kalman_gyro", **users()["kalman_gyro"]}
    assert not any("mission" in n for n in assumption_notes(make(
        flown | {f"spacecraft.{name}": bad, "control.estimator": filter_}
    )))  # fmt: skip


def test_albedo_is_an_error_of_pointing_to_the_sun(make):
    sensors = least_keys(DEVICES["sun_sensors"]) | {"albedo": 0.3}
    flown = {
        "spacecraft.sun_sensors": sensors,
        "control.law": {"kind": "sun_cross", "gain_n_m": 1e-6},
    }
    (note,) = assumption_notes(make(flown | {"mission": {"sun_angle_below_deg": 5.0}}))
    assert note == (
        "mission.sun_angle_below_deg of 5 deg is below the error of 14.7 deg that "
        "spacecraft.sun_sensors.albedo leaves in every reading"
    )
    assert assumption_notes(make(flown | {"mission": {"sun_angle_below_deg": 20.0}})) == []


#: The satellite of the cases.
CASE = """
start = 2025-07-01T00:00:00Z
seed = 3
orbit = { kind = "circular", altitude_km = 500, inclination_deg = 97.4 }
environment.field = { kind = "igrf14", degree = 8 }
spacecraft.body.inertia_kg_m2 = [0.04, 0.05, 0.02]
spacecraft.magnetometer = { noise_nt = 200 }
[spacecraft.gyro]
noise_deg_s = 0.011
bias_drift_deg_s_sqrt_s = 1e-4
bias_deg_s = [0.05, -0.03, 0.02]
[spacecraft.sun_sensors]
axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
half_field_deg = 85
noise_deg = 0.5
albedo = 0
[initial]
euler_deg = [20, 30, 40]
rate_deg_s = [0.1, -0.05, 0.06]
[control]
sample_s = 1.0
[control.law]
kind = "off"
[control.estimator]
kind = "kalman_gyro"
magnetometer_noise_nt = 200
sun_noise_deg = 0.5
angle_random_walk_deg_sqrt_s = 0.011
rate_random_walk_deg_s_sqrt_s = 0.0001
gyro_bias_sigma_deg_s = 0.1
[simulation]
revolutions = 2
record_s = 10.0
"""
WORSE = "the estimate will be less certain than it states, and sound readings rejected"
FALSE = "it will be wrong and sure of itself"
SAID = [
    (
        ("magnetometer_noise_nt = 200", "magnetometer_noise_nt = 0.2"),
        "control.estimator.magnetometer_noise_nt of 0.2 nT must not be far below the 200 nT of "
        f"spacecraft.magnetometer.noise_nt: {WORSE}",
    ),
    (
        ("noise_deg_s = 0.011", "noise_deg_s = 0.5"),
        "control.estimator.angle_random_walk_deg_sqrt_s of 0.011 deg/sqrt(s) must not be far below "
        "the 0.5 deg/sqrt(s) of spacecraft.gyro.noise_deg_s (noise times the root of 1 s): "
        f"{WORSE}",
    ),
    (
        ("angle_random_walk_deg_sqrt_s = 0.011", "angle_random_walk_deg_sqrt_s = 0.66"),
        "control.estimator.angle_random_walk_deg_sqrt_s of 0.66 deg/sqrt(s) is far above the "
        "0.011 deg/sqrt(s) of spacecraft.gyro.noise_deg_s (noise times the root of 1 s): readings "
        "will hardly be used; is it in another unit?",
    ),
    (
        ("bias_drift_deg_s_sqrt_s = 1e-4", "bias_drift_deg_s_sqrt_s = 1e-2"),
        "control.estimator.rate_random_walk_deg_s_sqrt_s of 0.0001 deg/s/sqrt(s) must not be far "
        f"below the 0.01 deg/s/sqrt(s) of spacecraft.gyro.bias_drift_deg_s_sqrt_s: {WORSE}",
    ),
    (
        ("albedo = 0\n", "albedo = 0.3\n"),
        "control.estimator takes the readings of spacecraft.sun_sensors for sunlight alone, but "
        "they see an Earth of albedo 0.3, which turns readings by up to 15 deg, with a noise of "
        f"0.5 (sun_noise_deg): {FALSE}",
    ),
    (
        ("[0.05, -0.03, 0.02]", "[3, -2, 1]"),
        "spacecraft.gyro.bias_deg_s of 3.74 deg/s lies 37.4 sigma outside of "
        "control.estimator.gyro_bias_sigma_deg_s of 0.1 deg/s: the filter starts surer than it is "
        "right, and may reject sound readings",
    ),
]


@pytest.mark.parametrize(("change", "note"), SAID, ids=[change[1] for change, _ in SAID])
def test_a_contradiction_has_one_plain_line(change, note):
    assert CASE.count(change[0]) == 1
    assert write_notes(scenario_from_text(CASE.replace(*change))) == [note]


@pytest.mark.parametrize("factor", [1, 3, 20])
def test_a_filter_may_state_more_noise_than_its_sensors_have(factor):
    """For errors of the field model, of mounting, of the horizon."""
    text = CASE.replace("magnetometer_noise_nt = 200", f"magnetometer_noise_nt = {200 * factor}")
    text = text.replace("sun_noise_deg = 0.5", f"sun_noise_deg = {0.5 * factor}")
    assert write_notes(scenario_from_text(text)) == []


def test_a_drift_that_the_white_noise_hides_is_left_alone():
    """2e-7 deg/s a root second over 11 400 s: 2e-5 deg/s at its end, under 1e-4 of the mean."""
    text = CASE.replace("bias_drift_deg_s_sqrt_s = 1e-4", "bias_drift_deg_s_sqrt_s = 2e-7")
    text = text.replace(
        "rate_random_walk_deg_s_sqrt_s = 0.0001", "rate_random_walk_deg_s_sqrt_s = 0"
    )
    assert write_notes(scenario_from_text(text)) == []


@pytest.mark.parametrize(("quantum_arcsec", "noted"), [(1.0, False), (1000.0, True)])
def test_the_count_of_an_integrating_gyro_is_noise_of_its_rate(quantum_arcsec, noted):
    """1000 arcsec a count, each second: 0.28/sqrt(6) deg/s, and the walk of 0.01 deg/sqrt(s)."""
    text = f"""
start = 2025-06-01T00:00:00Z
orbit = {{ kind = "circular", altitude_km = 500, inclination_deg = 97.4 }}
simulation = {{ duration_s = 300 }}
spacecraft.body.inertia_kg_m2 = [0.03, 0.04, 0.02]
spacecraft.coils.limit_a_m2 = 0.2
spacecraft.magnetometer.noise_nt = 100
spacecraft.attitude_sensor.noise_deg = 0.05
spacecraft.integrating_gyro.angle_random_walk_deg_sqrt_h = 0.6
spacecraft.integrating_gyro.quantum_arcsec = {quantum_arcsec}
initial.rate_deg_s = [0.2, -0.15, 0.1]
control.sample_s = 1.0
control.law = {{ kind = "bdot", gain_a_m2_s_per_t = 1e4 }}
[control.estimator]
kind = "kalman_gyro"
sensors = ["star_tracker"]
star_tracker_noise_deg = 0.05
angle_random_walk_deg_sqrt_s = 0.01
rate_random_walk_deg_s_sqrt_s = 1e-5
gyro_bias_sigma_deg_s = 0.1
"""
    found = [n for n in write_notes(scenario_from_text(text)) if "quantum_arcsec" in n]
    assert len(found) == noted
    if noted:
        assert "must not be far below the 0.114 deg/sqrt(s)" in found[0]
