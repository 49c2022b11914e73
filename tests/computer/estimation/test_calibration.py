"""Scale factors and misalignments of magnetometer and gyro: estimated, considered, ignored.

`python tests/computer/estimation/test_calibration.py` prints the numbers of the tutorial.
"""

from pathlib import Path

import numpy as np
import pytest
from filter_cases import GYRO, SCENARIO
from slow_cases import slow_after

from torquer.analysis.filters.filter_check import check_filter
from torquer.analysis.filters.observability import observability
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.scenario.change import with_values
from torquer.scenario.load import load_scenario, scenario_from_data

#: Standard deviations as the filter has them, and errors of which runs draw others as large.
STATED = {
    "magnetometer_scale_sigma": 0.005,
    "magnetometer_misalignment_sigma_deg": 0.5,
    "gyro_scale_sigma": 0.003,
    "gyro_misalignment_sigma_deg": 0.3,
}
MAGNETOMETER = {"scale_error": [0.005] * 3, "misalignment_deg": [0.5] * 3, "noise_nt": 50.0}
GYRO_ERRORS = {"scale_error": [0.003] * 3, "misalignment_deg": [0.3] * 3}
#: Sensors that have errors, and of which part of their uncertainty is left by estimating them. With
#: those of the magnetometer alone the filter has 12 errors, as other tests compile it.
LEFT = {"magnetometer": [0.03, 0.03], "magnetometer, gyro": [0.03, 0.03, 0.7, 0.4]}
RUNS = 24
KEYS: dict[str, dict] = {
    "ignored": {},
    "considered": STATED | {"calibration": "considered"},
    "estimated": STATED,
}


def scenario(sensors="magnetometer, gyro", **keys):
    spacecraft = SCENARIO["spacecraft"] | {"magnetometer": MAGNETOMETER}
    if "gyro" in sensors:
        spacecraft["gyro"] = spacecraft["gyro"] | GYRO_ERRORS
    control = SCENARIO["control"] | {"estimator": GYRO | keys}
    initial = {"rate_deg_s": [0.6, -0.5, 0.6], "euler_deg": [20.0, -35.0, 70.0]}
    return scenario_from_data(
        {**SCENARIO, "spacecraft": spacecraft, "control": control, "initial": initial}
    )


@pytest.fixture(scope="module", params=slow_after(1, LEFT))
def sensors(request):
    """Those that have errors."""
    return request.param


def stated(sensors):
    """What the filter states of the errors of these sensors."""
    return {key: sigma for key, sigma in STATED.items() if key.split("_")[0] in sensors}


@pytest.fixture(scope="module")
def checked(sensors):
    known = stated(sensors)
    keys = {
        "ignored": {},
        "estimated": known,
        "considered": known | {"calibration": "considered"},
    }
    return {name: check_filter(scenario(sensors, **each), RUNS) for name, each in keys.items()}


def checks(found):
    return {check.name: check.value for check in found.checks}


def test_ignored_errors_make_the_filter_optimistic(checked):
    assert checked["ignored"].verdict.word == "optimistic"
    assert checks(checked["ignored"])["NEES of the attitude"] > 10.0


@pytest.mark.parametrize("how", ["estimated", "considered"])
def test_errors_that_the_filter_knows_of_leave_it_consistent(checked, how):
    assert checked[how].verdict.word == "consistent"


def test_estimated_errors_are_found_and_considered_ones_are_not(sensors, checked):
    """In 20 min at 1 deg/s: the magnetometer's well; the gyro's are hardly different from its bias
    in a body that turns evenly. What is considered stays as uncertain as it was."""
    prior = np.sqrt(list(KalmanGyro(**GYRO, **stated(sensors)).initial_variances().values())[2:])
    shares = {}
    for how in ("estimated", "considered"):
        p = checked[how].flown.covariance[:, -1]
        sigma = np.sqrt(
            np.einsum("rkk->rk", p)[:, 6:].reshape(RUNS, len(prior), 3).mean(axis=(0, 2))
        )
        shares[how] = sigma / prior
    assert (shares["estimated"] < LEFT[sensors]).all()
    assert shares["considered"] == pytest.approx(np.ones(len(prior)), rel=1e-12)


def test_estimating_brings_more_than_considering(checked):
    def error(how):
        return np.nanmean(checked[how].flown.errors[:, 20:, :3] ** 2)

    assert error("estimated") < 0.3 * error("considered") < 0.3 * error("ignored")


def test_even_rotation_reveals_only_the_bias_of_the_gyro():
    """Errors of six parameters are one constant error of the rate; at rest, the turn of the
    magnetometer about the field and one of its scale factors stay unknown, too."""
    at_rest, turning = (
        observability(scenario(**STATED).replace("initial.rate_deg_s", rate), 300.0)
        for rate in ([0.0, 0.0, 0.0], [0.6, -0.5, 0.6])
    )
    assert at_rest.gaps.all() and turning.gaps.all()
    assert ((at_rest.singular < 1.0).sum(axis=1) == 8).all()
    assert ((turning.singular < 1.0).sum(axis=1) == 6).all()
    for each in (at_rest, turning):
        weakest = {each.weakest_state(k) for k in range(len(each.gaps))}
        assert weakest <= {"gyro scale", "gyro misalignment"}


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"calibration": "considered"},
            "calibration: must be left out without a standard deviation of scale factors or "
            "misalignments, which the filter would consider; received 'considered'",
        ),
        (
            {"sensors": ["sun"], "magnetometer_noise_nt": None, "magnetometer_scale_sigma": 0.1},
            "magnetometer_scale_sigma: must be left out without the magnetometer among the "
            "sensors; received 0.1",
        ),
    ],
)
def test_wrong_keys_are_refused(keys, message):
    with pytest.raises(ValueError) as error:
        KalmanGyro(**{k: v for k, v in (GYRO | keys).items() if v is not None})
    assert message in str(error.value)


def main():
    """Print the table of docs/tutorials/filter-check.md: 60 runs of two revolutions each."""
    turning = load_scenario(Path(__file__).parents[3] / "examples/which_sensors.toml")
    errors = {f"magnetometer.{key}": value for key, value in MAGNETOMETER.items()}
    errors |= {f"gyro.{key}": value for key, value in GYRO_ERRORS.items()}
    del errors["magnetometer.noise_nt"]
    values = {f"spacecraft.{key}": value for key, value in errors.items()}
    values |= {"control.laws.hold": {"kind": "off"}, "initial.reference": "inertial"}
    values |= {"initial.rate_deg_s": [0.6, -0.5, 0.6]}
    for how, keys in KEYS.items():
        stated = {f"control.estimator.{key}": value for key, value in keys.items()}
        found = check_filter(with_values(turning, values | stated), 60)
        later = found.flown.t_s > 0.25 * found.flown.t_s[-1]
        error = np.sum(found.flown.errors[:, later, :3] ** 2, axis=2)
        sigma = np.einsum("rkii->rk", found.flown.covariance[:, later, :3, :3])
        sizes = (np.degrees(np.sqrt(np.nanmean(each))) for each in (error, sigma))
        print(how, *(f"{x:.3g}" for x in (found.checks[0].value, *sizes)))


if __name__ == "__main__":
    main()
