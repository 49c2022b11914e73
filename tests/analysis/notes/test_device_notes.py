"""Every device against the run, by rules that name none: walks over all that have the property."""

import re

import pytest
from device_cases import DEVICES, having, keys_of, least_keys

from torquer.analysis.notes.device_notes import device_notes
from torquer.analysis.notes.notes import write_notes
from torquer.analysis.notes.sizes import find_sizes
from torquer.scenario.load import scenario_from_text
from torquer.spacecraft.data_sheet import DataSheet

#: Parts of a data sheet that are keys of the device.
OF_KEYS = [
    what for what in DataSheet._fields if what not in ("name", "senses", "unit", "words", "factors")
]
#: What of a device is compared with the run.
COMPARED = ("noise", "noise_about", "bias", "range", "resolution", "scale", "misalignment")


@pytest.fixture(scope="module")
def sizes(make):
    """Sizes of what is sensed in the plain scenario."""
    return find_sizes(make())


def notes_of(make, name, keys, **changes):
    return device_notes(make({f"spacecraft.{name}": keys, **changes}))


def about(notes, name, what):
    """Notes that begin with the key of something of a device."""
    key = f"spacecraft.{name}.{getattr(DEVICES[name].sheet, what)} of "
    return [note for note in notes if note.startswith(key)]


@pytest.mark.parametrize("name", DEVICES)
def test_a_device_with_nothing_but_what_it_needs_has_no_notes(make, name):
    assert notes_of(make, name, least_keys(DEVICES[name], name)) == []


@pytest.mark.parametrize("name", DEVICES)
def test_every_key_that_says_how_good_a_device_is_stands_in_its_data_sheet(name):
    named = {getattr(DEVICES[name].sheet, what) for what in OF_KEYS}
    said = r"noise|bias|drift|range|resolution|scale|misalign|error|albedo|horizon_km|rate_limit"
    for key in DEVICES[name].model_fields:
        assert key in named or not re.search(said, key), key


@pytest.mark.parametrize("name", DEVICES)
def test_a_data_sheet_names_keys_of_its_device(name):
    for what in OF_KEYS:
        key = getattr(DEVICES[name].sheet, what)
        assert not key or key in DEVICES[name].model_fields, key


def bad_and_good(name, what, sizes):
    """A value of a device that is to be noted, and one that is not."""
    size = sizes.get(DEVICES[name].sheet.senses)
    least, greatest = (size.least, size.greatest) if size else (1.0, 1.0)
    if (what, DEVICES[name].sheet.unit) == ("resolution", "deg"):
        return least, 0.02 * least
    return {
        "range": (0.5 * greatest, 2.0 * greatest),
        "bias": (2.0 * greatest, 0.02 * least),
        "resolution": (3.0 * least, 0.02 * least),
        "noise": (0.5 * least, 0.02 * least),
        "noise_about": (0.5 * least, 0.02 * least),
        "scale": (0.9, 0.1),
        "misalignment": (25.0, 4.0),
    }[what]


SENSED = [
    (name, what)
    for what in COMPARED
    for name in having(what)
    if DEVICES[name].sheet.senses and (what, DEVICES[name].sheet.senses) != ("noise", "rate")
]


@pytest.mark.parametrize(("name", "what"), SENSED)
def test_a_value_that_spoils_readings_is_noted(make, sizes, name, what):
    bad, good = bad_and_good(name, what, sizes)
    assert len(about(notes_of(make, name, keys_of(name, what, bad)), name, what)) == 1
    assert about(notes_of(make, name, keys_of(name, what, good)), name, what) == []


@pytest.mark.parametrize("name", [name for name in having("noise") if DEVICES[name].sheet.senses])
def test_noise_that_no_sensor_is_below_is_noted(make, sizes, name):
    quietest = sizes[DEVICES[name].sheet.senses].quietest
    (note,) = notes_of(make, name, keys_of(name, "noise", 0.1 * quietest))
    assert f"is below that of any {DEVICES[name].sheet.name}: is it in " in note
    assert notes_of(make, name, keys_of(name, "noise", 10.0 * quietest)) == []


@pytest.mark.parametrize(
    "name",
    [
        name
        for name in having("range")
        if name in having("noise") and not DEVICES[name].sheet.senses
    ],
)
def test_noise_is_compared_with_the_range_of_what_has_no_known_size(make, name):
    sheet = DEVICES[name].sheet
    full = float(DEVICES[name].model_validate(least_keys(DEVICES[name])).model_dump()[sheet.range])
    (note,) = notes_of(make, name, keys_of(name, "noise", 0.3 * full))
    assert f"is 0.3 of its range of {full:g} {sheet.unit}" in note
    assert notes_of(make, name, keys_of(name, "noise", 0.1 * full)) == []


def test_a_noisy_gyro_is_averaged(make):
    """Its noise is compared with what a filter assumes of it, not with the rate."""
    assert notes_of(make, "gyro", {"noise_deg_s": 5.0}) == []


@pytest.mark.parametrize("name", having("rate_limit"))
def test_a_sensor_that_reads_nothing_at_the_initial_rate_is_noted(make, name):
    (note,) = notes_of(make, name, keys_of(name, "rate_limit", 1.0))
    assert note.startswith(f"spacecraft.{name}.rate_limit_deg_s of 1 deg/s is exceeded by the ")
    assert "initial rate of 1.41 deg/s: it gives no readings until" in note
    assert notes_of(make, name, keys_of(name, "rate_limit", 2.0)) == []


@pytest.mark.parametrize("name", [name for name in having("bias") if DEVICES[name].sheet.senses])
def test_a_bias_that_a_filter_looks_for_is_not_noted(make, sizes, name):
    bias = 2.0 * sizes[DEVICES[name].sheet.senses].greatest
    kind = "kalman_gyro" if DEVICES[name].sheet.senses == "rate" else None
    filter_ = {
        "kind": kind or "kalman_dynamics", "magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.1,
        "magnetometer_bias_sigma_nt": bias,
    }  # fmt: skip
    of_gyro = {
        "angle_random_walk_deg_sqrt_s": 0.01, "rate_random_walk_deg_s_sqrt_s": 1e-4,
        "gyro_bias_sigma_deg_s": bias,
    }  # fmt: skip
    of_body = {
        "inertia_kg_m2": [1.0, 1.3, 1.7], "torque_noise_n_m_sqrt_s": 1e-6, "rate_sigma_deg_s": 2.0,
    }  # fmt: skip
    given = {"control.estimator": filter_ | (of_gyro if kind else of_body)}
    keys = keys_of(name, "bias", bias)
    assert len(about(notes_of(make, name, keys), name, "bias")) == 1
    if name == "search_coil":  # filters do not measure with it
        assert len(about(notes_of(make, name, keys, **given), name, "bias")) == 1
        return
    if name == "magnetometers.own":  # of several magnetometers filters have no bias as a state
        given = {"control.estimator": {**filter_, **of_body, "magnetometer_bias_sigma_nt": None}}
        assert len(about(notes_of(make, name, keys, **given), name, "bias")) == 1
        return
    assert notes_of(make, name, keys, **given) == []


#: The satellite of the cases: what is wrong in each is put where the comment stands.
CASE = """
start = 2025-07-01T00:00:00Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 97.6 }
spacecraft.body.inertia_kg_m2 = [0.03, 0.03, 0.01]
spacecraft.coils.limit_a_m2 = 0.2
initial.rate_deg_s = [8, -5, 3]
control = { law = { kind = "bdot", gain_a_m2_s_per_t = 2e4 }, sample_s = 1.0 }
simulation = { revolutions = 2, record_s = 10.0 }
# here
"""
SAID = {
    "spacecraft.gyro.range_deg_s = 5": "spacecraft.gyro.range_deg_s of 5 deg/s is exceeded by the "
    "initial rate of 9.9 deg/s: readings will saturate",
    "spacecraft.magnetometer.scale_error = [9, 9, 9]": "spacecraft.magnetometer.scale_error of 9 "
    "is not an error of calibration, which is below 0.5: 0 is a sensor that reads right, and "
    "readings will be wrong by 900 %",
    "spacecraft.magnetometer.resolution_nt = 30000": "spacecraft.magnetometer.resolution_nt of "
    "30000 nT is 1.3 of the field where it is weakest on this orbit, 2.25e+04 nT: readings hardly "
    "show its direction",
}


@pytest.mark.parametrize("slip", SAID)
def test_a_slip_has_one_plain_line(slip):
    assert write_notes(scenario_from_text(CASE)) == []
    text = CASE.replace("simulation = ", f"{slip}\nsimulation = ")
    assert write_notes(scenario_from_text(text)) == [SAID[slip]]


def test_a_scale_error_that_reverses_readings_is_shown_with_its_sign(make):
    (note,) = notes_of(make, "magnetometer", {"scale_error": [0.01, -2.0, 0.0]})
    assert note.startswith("spacecraft.magnetometer.scale_error of -2 is not")


def test_the_initial_rate_counts_with_that_of_the_orbital_frame(make):
    """Rates relative to the orbital frame are absolute ones to a gyro."""
    slow = {"initial": {"rate_deg_s": [0, 0, 0], "rate_relative_to": "orbital"}}
    (note,) = notes_of(make, "gyro", {"range_deg_s": 0.05}, **slow)
    assert "is exceeded by the initial rate of 0.0627 deg/s" in note
    assert notes_of(make, "gyro", {"range_deg_s": 0.07}, **slow) == []


def test_a_step_of_the_gyro_hides_the_orbital_rate(make):
    still = {"initial": {"rate_deg_s": [0, 0, 0]}}
    (note,) = notes_of(make, "gyro", {"resolution_deg_s": 0.2}, **still)
    assert note.endswith("of the orbital rate of 0.0627 deg/s: readings are zero")
    assert notes_of(make, "gyro", {"resolution_deg_s": 0.1}, **still) == []
