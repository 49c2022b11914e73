"""What the runs of a filter check draw: start, biases, errors of the sensors."""

import numpy as np
import pytest
from device_cases import DEVICES, craft_with, keys_of
from filter_cases import DYNAMICS, GYRO, SCENARIO
from scipy.spatial.transform import Rotation

from torquer.analysis.filters.filter_members import AS_STATED, Start, make_members, what_runs_draw
from torquer.scenario.load import scenario_from_data
from torquer.spacecraft.data_sheet import FIXED

RUNS = 300


def scenario(estimator=GYRO, spacecraft=None, initial=None):
    craft = {
        name: {**SCENARIO["spacecraft"][name], **keys} for name, keys in (spacecraft or {}).items()
    }
    return scenario_from_data(
        {
            **SCENARIO,
            "spacecraft": SCENARIO["spacecraft"] | craft,
            "initial": initial or SCENARIO["initial"],
            "control": {"law": {"kind": "off"}, "estimator": estimator},
        }
    )


def starts(flown, start=Start(), runs=RUNS):  # noqa: B008  a tuple
    """Turns (runs, 3) [deg] of the initial attitudes from the scenario's, and rates (runs, 3)."""
    members = list(make_members(flown, runs, start))
    q = [member.initial.motion((7e6, 0.0, 0.0), (0.0, 7e3, 0.0))[:4] for member in members]
    own = flown.initial.motion((7e6, 0.0, 0.0), (0.0, 7e3, 0.0))[:4]
    turns = (Rotation.from_quat(own).inv() * Rotation.from_quat(q)).as_rotvec(degrees=True)
    return turns, np.array([member.initial.rate_deg_s for member in members])


def test_inertial_members_take_any_attitude_and_spread_by_orbital_rate():
    """Of attitudes that are all equally likely, half are turned by more than 132 deg
    (the angle a at which (a - sin a)/pi is a half)."""
    flown = scenario()
    turns, rates = starts(flown)
    assert np.median(np.linalg.norm(turns, axis=1)) == pytest.approx(132.3, abs=6.0)
    assert np.abs(np.mean(turns / np.linalg.norm(turns, axis=1)[:, None], axis=0)).max() < 0.12
    orbital_deg_s = np.degrees(flown.orbit.rate_rad_s())
    assert rates.std(axis=0) == pytest.approx(3 * [orbital_deg_s], rel=0.12)
    assert rates.mean(axis=0) == pytest.approx(flown.initial.rate_deg_s, abs=4e-3 * 3.0)


def test_held_attitude_stays_near_and_fast_rate_spreads_a_tenth():
    held = {"reference": "orbital", "euler_deg": [0.0, 30.0, 0.0], "rate_deg_s": [0.0, 6.0, 8.0]}
    turns, rates = starts(scenario(initial=held))
    assert turns.std(axis=0) == pytest.approx(3 * [5.0], rel=0.12)
    assert rates.std(axis=0) == pytest.approx(3 * [1.0], rel=0.12)


def test_the_rate_is_one_that_the_filter_believes_possible():
    assert starts(scenario(DYNAMICS | {"rate_sigma_deg_s": 0.01}))[1].std() < 0.2
    spread = starts(scenario(DYNAMICS | {"rate_sigma_deg_s": 0.01}))[1].std(axis=0)
    assert spread == pytest.approx(3 * [0.01], rel=0.12)


def test_start_may_be_given_and_the_scenarios_own_kept():
    turns, rates = starts(scenario(), Start(2.0, 0.3))
    assert turns.std(axis=0) == pytest.approx(3 * [2.0], rel=0.12)
    assert rates.std(axis=0) == pytest.approx(3 * [0.3], rel=0.12)
    turns, rates = starts(scenario(), AS_STATED, 5)
    assert np.abs(turns).max() < 1e-6 and np.ptp(rates, axis=0).max() == 0.0


def test_sensor_errors_are_drawn_of_the_stated_size():
    """Those that are states of the filter: of the size that it believes."""
    wrong = {
        "magnetometer": {"scale_error": [0.003, 0.0, -0.004], "bias_nt": [100.0, 0.0, 0.0]},
        "gyro": {"misalignment_deg": [0.3, 0.3, 0.3]},
        "sun_sensors": {"bias_deg": [[0.1, 0.0, 0.0]] * 6},
    }
    flown = scenario(GYRO | {"magnetometer_bias_sigma_nt": 300.0}, wrong)
    members = list(make_members(flown, RUNS))

    def rms(sensor, key):
        craft = (member.spacecraft for member in members)
        return np.sqrt(np.mean(np.square([getattr(getattr(c, sensor), key) for c in craft])))

    assert rms("magnetometer", "scale_error") == pytest.approx(0.005 / np.sqrt(3.0), rel=0.07)
    assert rms("magnetometer", "bias_nt") == pytest.approx(300.0, rel=0.07)
    assert rms("gyro", "misalignment_deg") == pytest.approx(0.3, rel=0.07)
    assert rms("gyro", "bias_deg_s") == pytest.approx(0.05, rel=0.07)
    assert rms("sun_sensors", "bias_deg") == pytest.approx(0.1 / np.sqrt(3.0), rel=0.07)
    assert rms("gyro", "scale_error") == 0.0
    assert np.shape(members[0].spacecraft.sun_sensors.bias_deg) == (6, 3)


def test_what_is_drawn_is_said():
    said = [each.in_words for each in what_runs_draw(scenario(), Start())]
    assert said == ["gyro bias (0.05 deg/s)", "any attitude", "rate (0.0627 deg/s)"]
    said = [each.in_words for each in what_runs_draw(scenario(), Start(3.0, 0.0))]
    assert said == ["gyro bias (0.05 deg/s)", "attitude (3 deg)"]
    wrong = scenario(spacecraft={"gyro": {"scale_error": [0.01, 0.01, 0.01]}})
    assert "gyro scale (0.01)" in [each.in_words for each in what_runs_draw(wrong)]


def not_flown(*args, start=AS_STATED, **keys):
    drawn = what_runs_draw(scenario(*args, **keys), start)
    return [each.replaced_in_words for each in drawn if each.replaced_in_words]


def test_what_the_scenario_states_and_no_run_flies_is_said():
    """Biases that are states, with how far they lie from what the filter states of them."""
    large = {"gyro": {"bias_deg_s": [3.0, -2.0, 1.0]}}
    said = "gyro bias of 3.74 deg/s, 374 sigma by gyro_bias_sigma_deg_s"
    assert not_flown(GYRO | {"gyro_bias_sigma_deg_s": 0.01}, large) == [said]
    small = {"gyro": {"bias_deg_s": [0.03, 0.0, 0.04]}}
    assert not_flown(GYRO, small) == ["gyro bias of 0.05 deg/s, 1 sigma by gyro_bias_sigma_deg_s"]
    assert not_flown() == []


def test_errors_of_other_devices_and_the_attitude_are_said_too():
    wrong = {"gyro": {"scale_error": [0.01, 0.0, 0.0]}, "sun_sensors": {"bias_deg": [0.2, 0, 0]}}
    said = ["gyro scale of 0.01", "Sun sensor misalignment of 0.2 deg"]
    assert not_flown(spacecraft=wrong) == said
    assert not_flown(spacecraft=wrong, start=Start()) == [*said, "attitude"]
    assert not_flown(start=Start(5.0, 0.1)) == []  # about the scenario's own
    dipole = {"coils": {"residual_dipole_a_m2": [0.0, 0.3, 0.4]}}
    assert not_flown(DYNAMICS | {"dipole_sigma_a_m2": 0.05}, dipole) == [
        "residual dipole of 0.5 A m^2, 10 sigma by dipole_sigma_a_m2"
    ]
    assert not_flown(DYNAMICS, dipole) == []  # flown as it is


@pytest.mark.parametrize("estimator", [GYRO, DYNAMICS])
def test_every_fixed_error_of_a_device_is_drawn(estimator):
    """Of whatever devices there are: those of the data sheets, each once."""
    place = {name: kind.sheet for name, kind in DEVICES.items()}
    for name, sheet in place.items():
        for what in FIXED:
            is_state_only = what == "bias" and (sheet.senses == "rate" or name == "coils")
            if not getattr(sheet, what) or is_state_only:
                continue
            craft = craft_with(SCENARIO["spacecraft"], name, keys_of(name, what, 0.1))
            control = {"law": {"kind": "off"}, "estimator": estimator}
            flown = scenario_from_data({**SCENARIO, "spacecraft": craft, "control": control})
            keys = [each.key for each in what_runs_draw(flown)]
            assert keys.count(f"spacecraft.{name}.{getattr(sheet, what)}") == 1


def test_a_dipole_among_the_states_needs_no_coils():
    craft = {key: value for key, value in SCENARIO["spacecraft"].items() if key != "coils"}
    estimator = DYNAMICS | {"dipole_sigma_a_m2": 0.05}
    data = {**SCENARIO, "spacecraft": craft, "control": {"estimator": estimator}}
    data["control"]["law"] = {"kind": "off"}
    (member,) = make_members(scenario_from_data(data), 1)
    assert member.spacecraft.coils is None


def test_the_same_run_has_the_same_errors_whatever_the_start():
    """So that the effect of a start can be distinguished from chance."""
    one, other = (next(make_members(scenario(), 1, start)) for start in (AS_STATED, Start()))
    assert one.seed == other.seed
    assert one.spacecraft.gyro.bias_deg_s == other.spacecraft.gyro.bias_deg_s
