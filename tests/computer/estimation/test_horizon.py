"""The horizon sensor in filters: statistics, starts in the umbra, faults."""

import copy

import numpy as np
import pytest
from filter_cases import DISTURBANCE, DYNAMICS, GYRO, SCENARIO, SPACECRAFT, without

from torquer import simulate
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.filter_statistics import consistency, nees, nis
from torquer.analysis.filters.linear_covariance import expected_accuracy
from torquer.analysis.filters.observability import observability
from torquer.compile import engine
from torquer.computer.estimation.isolation_states import CONTRADICTS, STUCK
from torquer.computer.estimation.starts import NOT_STARTED
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.load import scenario_from_data

COMPILED = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
NADIR = {"horizon_noise_deg": 0.3, "sensors": ["magnetometer", "horizon"]}
WITH_GYRO = {**without(GYRO, "sun_noise_deg"), **NADIR}
WITHOUT_GYRO = {**without(DYNAMICS, "sun_noise_deg"), **NADIR}
ALL = {**GYRO, **NADIR, "sensors": ["magnetometer", "sun", "horizon"]}


def scenario(estimator=WITH_GYRO, horizon=None, seed=0, **simulation):
    spacecraft = copy.deepcopy(SPACECRAFT) | {
        "horizon_sensor": {"noise_deg": 0.3} | (horizon or {})
    }
    return scenario_from_data(
        {
            **SCENARIO,
            "spacecraft": spacecraft,
            "control": {"law": {"kind": "off"}, "estimator": estimator},
            "disturbance": DISTURBANCE,
            "seed": seed,
            "simulation": {**SCENARIO["simulation"], "record_s": 1.0} | simulation,
        }
    )


def errors_deg(result):
    return np.degrees(
        angle_between(result["q_estimated"].values, result["q_body_to_inertial"].values)
    )[:-1]


def stated_deg(result):
    """Of all axes together."""
    return np.sqrt(3.0) * np.degrees(result["attitude_sigma"].values)[:-1]


@COMPILED
@pytest.mark.parametrize("estimator", [WITH_GYRO, WITHOUT_GYRO], ids=["gyro", "dynamics"])
def test_errors_have_their_stated_size_from_the_first_reading(estimator):
    """In light and umbra: it needs no Sun."""
    runs = fly_filter(make_members(scenario(estimator, record_s=20.0, duration_s=2400.0), 60))
    assert np.isfinite(runs.errors[:, 0, 0]).all()
    for states in (3, 6):
        found = consistency(nees(runs, states), states)
        assert found.consistent and found.inside > 0.8
    assert consistency(*nis(runs.innovations["horizon"])).consistent


@COMPILED
def test_uneven_horizon_unknown_to_the_filter_shows_in_errors():
    """8 km are 0.07 deg, at every reading the same; a noise that includes it is honest again."""
    precise = {"noise_deg": 0.05, "horizon_km": 8.0}
    ignored = scenario(WITH_GYRO | {"horizon_noise_deg": 0.05}, precise, record_s=20.0)
    runs = fly_filter(make_members(ignored, 40))
    assert consistency(nees(runs, 3), 3).overall > 2.0


@COMPILED
def test_the_earth_out_of_view_is_bridged():
    """The field is a cone about a body axis; the body turns through it."""
    cone = {"axis": [0.0, 0.7, -0.6], "half_field_deg": 40.0}
    result = simulate(scenario(ALL, cone, duration_s=2400.0))
    seen = np.isfinite(result["estimator.innovation_horizon"].values[:, 0])
    assert 50 < seen.sum() < 2300
    assert (errors_deg(result) < 4.0 * stated_deg(result)).all()


@COMPILED
def test_a_stuck_sensor_is_isolated_and_used_again():
    stuck = {"failures": [{"kind": "stuck", "from_s": 300.0, "until_s": 420.0}]}
    result = simulate(scenario(ALL, stuck, duration_s=600.0))
    isolated = result["estimator.isolated"].values[:, 3]
    assert isolated[380:419].all() and isolated[418] == STUCK and not isolated[430:].any()
    # at 0.14 deg/s it takes a while until readings that stay are beyond the gate
    assert np.sum(errors_deg(result) > 4.0 * stated_deg(result)) < 20
    assert errors_deg(result).max() < 0.6


@COMPILED
def test_a_sensor_that_is_mounted_wrong_is_isolated():
    """By 12 deg; field and Sun together know better."""
    result = simulate(scenario(ALL, {"bias_deg": [9.0, -6.0, 5.0]}, duration_s=300.0))
    assert (result["estimator.isolated"].values[60:, 3] == CONTRADICTS).all()
    assert errors_deg(result)[60:].max() < 0.5


@COMPILED
def test_a_filter_that_never_sees_the_earth_says_so():
    result = simulate(scenario(horizon={"rate_limit_deg_s": 0.01}, duration_s=100.0))
    assert np.isnan(result["q_estimated"].values).all()
    reason = NOT_STARTED[int(result["estimator.not_started"].values[-1])]
    assert reason == "no usable reading of the horizon sensor"


def test_expected_accuracy_and_observability_know_it():
    """Field and nadir leave nothing open; without the Earth the field alone has gaps."""
    seen = scenario(duration_s=600.0)
    blind = scenario(horizon={"rate_limit_deg_s": 0.01}, duration_s=600.0)
    ratio = expected_accuracy(blind).attitude_sigma_rad / expected_accuracy(seen).attitude_sigma_rad
    assert ratio[60] > 10.0
    singular = [observability(each, 60.0).singular[:, 2] for each in (seen, blind)]
    assert (singular[0] > 10.0 * singular[1]).all()
