"""The one list of causes: derived from devices and torques, complete, each removed by its keys."""

import numpy as np
import pytest

from torquer.analysis.causes import (
    GROUPS,
    OF_KEYS,
    OF_SHEETS,
    TORQUES,
    acting_causes,
    causes_of,
)
from torquer.analysis.counter_tests import lessened, without
from torquer.spacecraft.actuators.coils import Coils
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.disturbance import Disturbance
from torquer.spacecraft.sensors.devices import DEVICES

#: What a device is, which is no error of it.
PROPERTIES = {
    "axes", "axis", "boresight", "up", "normals", "half_field_deg", "blind_zones",
    "bias_correlation_s", "kind", "file", "function", "parameters", "limit_a_m2", "windings",
    "saturation", "power_at_limit_w", "layout", "momentum_limit_n_m_s", "torque_limit_n_m",
    "speed_limit_rpm", "initial_speed_rpm", "allocation", "minimum_speed_fraction",
}  # fmt: skip
SPECS = [device.spec for device in DEVICES if device.spec] + [Coils, ReactionWheels]
HOLD = {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 1e4, "angle_gain_n_m_per_t2": 10.0}
#: Errors by cause, of a satellite with that law.
ERRORS = {
    "magnetometer_noise": {"spacecraft.magnetometer.noise_nt": 5.0},
    "magnetometer_bias": {"spacecraft.magnetometer.bias_nt": [5.0, 0.0, 0.0]},
    "magnetometer_resolution": {"spacecraft.magnetometer.resolution_nt": 5.0},
    "magnetometer_scale": {"spacecraft.magnetometer.scale_error": [0.1, 0.0, 0.0]},
    "magnetometer_mounting": {"spacecraft.magnetometer.misalignment_deg": [0.1, 0.0, 0.0]},
    "magnetometer_soft_iron": {
        "spacecraft.magnetometer.soft_iron": [[1.1, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    },
    "magnetometer_field_of_the_coils": {
        "spacecraft.magnetometer.coil_disturbance_nt_per_a_m2": 3e3
    },
    "magnetometer_range": {"spacecraft.magnetometer.range_nt": 3e4},
    "magnetometer_times": {"spacecraft.magnetometer.sample_s": 3.0},
    "gyro_noise": {"spacecraft.gyro.noise_deg_s": 0.1},
    "gyro_drift": {"spacecraft.gyro.bias_drift_deg_s_sqrt_s": 0.1},
    "gyro_resolution": {"spacecraft.gyro.resolution_deg_s": 0.1},
    "attitude_sensor_noise": {
        "spacecraft.attitude_sensor": {"boresight": [0, 0, 1], "boresight_noise_deg": 0.1}
    },
    "attitude_sensor_mounting": {"spacecraft.attitude_sensor.error_deg": [0.1, 0.0, 0.0]},
    "attitude_sensor_missing_readings": {"spacecraft.attitude_sensor.rate_limit_deg_s": 0.1},
    "residual_dipole": {"spacecraft.coils.residual_dipole_a_m2": [0.1, 0.0, 0.0]},
    "coils_random_error": {"spacecraft.coils.random_error": 0.1},
    "coils_dead_band": {"spacecraft.coils.dead_band_a_m2": 0.1},
    "coils_failures": {"spacecraft.coils.polarity": [1, -1, 1]},
    "coils_times": {"spacecraft.coils.lag_s": 0.5},
    "magnets": {"spacecraft.permanent_magnet_a_m2": [0.0, 0.0, 0.1]},
    "own": {"disturbance": {"own": {"mine": {
        "kind": "user", "file": "torque.py", "function": "torque"}}}},
    "eddy_currents": {"disturbance": {"eddy_currents": {"damping_n_m_s_per_t2": 1.0}}},
    "unmodelled": {"disturbance": {"unmodelled": {"constant_n_m": 1e-6, "hold_s": 1.0}}},
    "ephemeris": {"control.ephemeris": {"along_track_error_m": 100.0}},
    "cycle": {"control.sample_s": 2.0},
}  # fmt: skip


def names(causes) -> set[str]:
    return {cause.name for cause in causes}


@pytest.fixture
def held(make):
    return lambda changes: make({"control": {"law": HOLD}} | changes)


def test_what_a_data_sheet_says_is_an_error_or_none_of_one():
    """A kind of error that a data sheet gets is named here, or it is no cause of anything."""
    no_errors = {"name", "senses", "unit", "words", "factors", "axes", "correlation", "range",
                 "rate_limit"}  # fmt: skip
    assert set(DataSheet._fields) == no_errors | set(OF_SHEETS)
    assert {group for _, _, group in OF_SHEETS.values()} <= set(GROUPS)


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.__name__)
def test_every_key_of_a_device_is_of_a_cause_or_says_what_it_is(spec):
    of_sheet = {getattr(spec.sheet, what) for what in OF_SHEETS}
    of_rows = {key for *_, keys in OF_KEYS for key in keys}
    assert set(spec.model_fields) <= of_sheet | of_rows | PROPERTIES


def test_keys_of_torques_are_keys():
    assert set(TORQUES) <= set(Disturbance.model_fields)


@pytest.mark.parametrize("name", sorted(ERRORS))
def test_an_error_is_a_cause_that_goes_with_its_keys(held, name, tmp_path, monkeypatch):
    if name == "own":
        monkeypatch.chdir(tmp_path)
        (tmp_path / "torque.py").write_text(
            "from numba import njit\n@njit\ndef torque(here):\n    return (0.0, 0.0, 0.0)\n",
            encoding="utf-8",
        )
    plain, disturbed = held({}), held(ERRORS[name])
    assert names(acting_causes(disturbed)) - names(acting_causes(plain)) == {name}
    (cause,) = (each for each in causes_of(disturbed) if each.name == name)
    clean = without(disturbed, [cause])
    assert names(causes_of(clean)) == names(causes_of(plain))


def test_errors_of_sensors_that_nothing_reads_do_not_act(make):
    errors = ERRORS["gyro_noise"] | {"spacecraft.sun_sensors": {
        "axes": [[0, 0, 1]], "half_field_deg": 60.0, "noise_deg": 1.0}}  # fmt: skip
    found = make({"control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e4}}} | errors)
    assert {"gyro_noise", "sun_sensors_noise"} <= names(causes_of(found))
    assert not {"gyro_noise", "sun_sensors_noise"} & names(acting_causes(found))


def test_errors_of_a_search_coil_act_where_a_law_reads_it(make):
    keys = {"noise_nt_s": 20.0, "bias_nt_s": [5, 0, 0], "resolution_nt_s": 3.0, "range_nt_s": 1e4,
            "scale_error": [0.1, 0, 0], "misalignment_deg": [1, 0, 0], "sample_s": 2.0}  # fmt: skip
    found = {
        kind: names(acting_causes(make({
            "control.law": {"kind": kind, "gain_a_m2_s_per_t": 1e4}, "spacecraft.search_coil": keys,
        })))
        for kind in ("bdot", "bdot_derivative")
    }  # fmt: skip
    assert found["bdot_derivative"] - found["bdot"] == {
        f"search_coil_{each}"
        for each in ("noise", "bias", "resolution", "range", "scale", "mounting", "times")
    }


def test_each_of_several_sensors_has_causes_of_its_own(held):
    both = {"first": {"noise_deg": 0.1}, "second": {"noise_deg": 0.2, "error_deg": [0.1, 0, 0]}}
    found = names(acting_causes(held({"spacecraft.star_trackers": both})))
    assert {"star_trackers.first_noise", "star_trackers.second_mounting"} <= found
    half = lessened(held({"spacecraft.star_trackers": both}), "noise", 0.5)
    assert half.spacecraft.star_trackers["second"].noise_deg == 0.1


def test_a_part_of_soft_iron_lies_between_it_and_none(held):
    half = lessened(held(ERRORS["magnetometer_soft_iron"]), "bias", 0.5)
    assert np.diag(half.spacecraft.magnetometer.soft_iron) == pytest.approx([1.05, 1.0, 1.0])
