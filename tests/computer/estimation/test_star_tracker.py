"""The star tracker in filters: statistics, starts, blinding, faults."""

import copy

import numpy as np
import pytest
from filter_cases import DISTURBANCE, DYNAMICS, GYRO, SCENARIO, SPACECRAFT, without
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.filter_statistics import consistency, nees
from torquer.analysis.filters.linear_covariance import expected_accuracy
from torquer.analysis.filters.observability import observability
from torquer.analysis.filters.sensor_sets import sensor_sets
from torquer.compile import engine
from torquer.computer.estimation.isolation_states import CONTRADICTS, STUCK
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.computer.estimation.measurements.star_tracker import measure_attitude
from torquer.computer.estimation.starts import NOT_STARTED
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.load import ScenarioError, scenario_from_data

COMPILED = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
TRACKER = {"boresight": [0.0, 0.6, 0.8], "noise_deg": 0.02, "boresight_noise_deg": 0.1}
STARS = {
    "star_tracker_noise_deg": 0.02,
    "star_tracker_boresight_noise_deg": 0.1,
    "star_tracker_boresight": [0.0, 0.6, 0.8],
}
NO_DIRECTIONS = ("magnetometer_noise_nt", "sun_noise_deg")
GYRO_ALONE = {**without(GYRO, *NO_DIRECTIONS), **STARS, "sensors": ["star_tracker"]}
DYNAMICS_ALONE = {**without(DYNAMICS, *NO_DIRECTIONS), **STARS, "sensors": ["star_tracker"]}
WITH_FIELD = {
    **without(GYRO, "sun_noise_deg"),
    **STARS,
    "sensors": ["magnetometer", "star_tracker"],
}


def scenario(estimator=GYRO_ALONE, tracker=None, seed=0, **simulation):
    spacecraft = copy.deepcopy(SPACECRAFT) | {"attitude_sensor": TRACKER | (tracker or {})}
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


def test_the_measurement_is_the_turn_scaled_to_one_variance():
    """A turn about any axis: components over their standard deviations, as stated for the axes."""
    spec = KalmanGyro.model_validate(GYRO_ALONE)
    own, boresight = spec.sensing().star_tracker, np.array(STARS["star_tracker_boresight"])
    q, turn = Rotation.from_rotvec([0.3, -1.2, 0.7]), np.array([0.002, -0.001, 0.0015])
    read = q * Rotation.from_rotvec(turn)
    m = measure_attitude(tuple(q.as_quat()), tuple(read.as_quat()), own, 0.0, 0.0)
    along = boresight * (turn @ boresight)
    sigma = np.radians([0.02, 0.1])
    square = np.sum((turn - along) ** 2) / sigma[0] ** 2 + np.sum(along**2) / sigma[1] ** 2
    assert np.sum(np.square(m.z)) / m.r == pytest.approx(square, rel=1e-12)
    assert np.array(m.h) @ turn == pytest.approx(np.array(m.z), rel=1e-12)


@COMPILED
@pytest.mark.parametrize("estimator", [GYRO_ALONE, DYNAMICS_ALONE], ids=["gyro", "dynamics"])
def test_errors_have_their_stated_size_from_the_first_reading(estimator):
    runs = fly_filter(make_members(scenario(estimator, record_s=20.0), 60))
    assert np.isfinite(runs.errors[:, 0, 0]).all()
    for states in (3, 6):
        found = consistency(nees(runs, states), states)
        assert found.consistent and found.inside > 0.8
    # about the boresight the error is larger, as the hardware says
    turned = np.linalg.norm(runs.errors[:, 0, :3] @ np.array([0.0, 0.6, 0.8]))
    assert np.degrees(turned) / np.sqrt(60) == pytest.approx(0.1, rel=0.3)


@COMPILED
def test_a_late_reading_is_taken_as_of_its_time():
    late = scenario(tracker={"sample_s": 4.0, "delay_s": 2.0}, record_s=20.0)
    runs = fly_filter(make_members(late.replace("initial.rate_deg_s", [1.0, -0.6, 0.8]), 40))
    assert consistency(nees(runs)[:, 2:], 6).consistent


@COMPILED
def test_a_blinded_tracker_is_bridged_and_comes_back():
    """Turning at about 0.14 deg/s, the Sun is within 60 deg of the boresight for a while."""
    result = simulate(scenario(tracker={"sun_exclusion_deg": 60.0}, duration_s=2400.0))
    b = Rotation.from_quat(result["q_body_to_inertial"].values).apply([0.0, 0.6, 0.8])
    near = np.sum(b * result["sun_inertial"].values, axis=1) > 0.5
    seen = np.isfinite(result["estimator.innovation_star_tracker"].values[:, 0])
    assert 100 < np.sum(near) < 2300
    assert np.array_equal(seen[1:-1], ~near[1:-1])
    assert (errors_deg(result) < 4.0 * stated_deg(result)).all()
    assert stated_deg(result)[near[:-1]].max() > 3.0 * np.median(stated_deg(result)[~near[:-1]])
    assert errors_deg(result)[~near[:-1]][-100:].max() < 0.2


@COMPILED
def test_a_filter_that_sees_no_stars_says_so():
    result = simulate(scenario(tracker={"rate_limit_deg_s": 0.01}, duration_s=100.0))
    assert np.isnan(result["q_estimated"].values).all()
    reason = NOT_STARTED[int(result["estimator.not_started"].values[-1])]
    assert reason == "no usable reading of the star tracker"


@COMPILED
@pytest.mark.parametrize("estimator", [GYRO_ALONE, WITH_FIELD], ids=["alone", "with the field"])
def test_a_stuck_tracker_is_isolated_and_used_again(estimator):
    stuck = {"failures": [{"kind": "stuck", "from_s": 300.0, "until_s": 420.0}]}
    result = simulate(scenario(estimator, stuck, duration_s=600.0))
    isolated = result["estimator.isolated"].values[:, 2]
    assert (isolated[315:419] == STUCK).all() and not isolated[430:].any()
    assert (errors_deg(result) < 4.0 * stated_deg(result)).all()


@COMPILED
@pytest.mark.parametrize("kind", ["zeros", "nan", "infinite"])
def test_no_value_of_a_reading_makes_the_attitude_unknown(kind):
    bad = {"failures": [{"kind": kind, "from_s": 300.0, "until_s": 310.0}]}
    result = simulate(scenario(tracker=bad, duration_s=400.0))
    assert (errors_deg(result) < 4.0 * stated_deg(result)).all()


@COMPILED
def test_a_tracker_that_contradicts_field_and_sun_is_isolated():
    """Mounted 10 deg otherwise than believed."""
    estimator = {**GYRO, **STARS, "sensors": ["magnetometer", "sun", "star_tracker"]}
    result = simulate(scenario(estimator, {"error_deg": [8.0, -5.0, 4.0]}, duration_s=300.0))
    assert (result["estimator.isolated"].values[60:, 2] == CONTRADICTS).all()
    assert errors_deg(result)[60:].max() < 0.5


@COMPILED
def test_where_tracker_and_field_contradict_each_other_nothing_starts():
    result = simulate(scenario(WITH_FIELD, {"error_deg": [15.0, -20.0, 0.0]}, duration_s=100.0))
    assert np.isnan(result["q_estimated"].values).all()
    reason = NOT_STARTED[int(result["estimator.not_started"].values[-1])]
    assert reason == "the star tracker contradicts a direction"


@COMPILED
def test_a_gyro_that_reads_zeros_for_a_while_is_forgiven():
    case = scenario().replace(
        "spacecraft.gyro.failures", [{"kind": "zeros", "from_s": 300.0, "until_s": 360.0}]
    )
    result = simulate(case.replace("initial.rate_deg_s", [0.6, -0.5, 0.62]))
    wrong = errors_deg(result) > 4.0 * stated_deg(result)
    assert wrong.sum() < 10 and errors_deg(result)[420:].max() < 0.5


def test_expected_accuracy_is_that_of_the_readings():
    """A gyro so bad that each reading stands alone: the covariance is that of the tracker."""
    bad = GYRO_ALONE | {"angle_random_walk_deg_sqrt_s": 100.0}
    found = expected_accuracy(scenario(bad, duration_s=60.0)).covariance[-1, :3, :3]
    boresight = np.array(STARS["star_tracker_boresight"])
    own = np.radians(0.02) ** 2 * np.eye(3)
    own += (np.radians(0.1) ** 2 - np.radians(0.02) ** 2) * np.outer(boresight, boresight)
    assert found == pytest.approx(own, rel=1e-3, abs=1e-3 * own.max())


def test_a_tracker_sees_all_states_of_the_motion():
    blinded = scenario(DYNAMICS_ALONE, {"rate_limit_deg_s": 0.1}, duration_s=600.0)
    assert observability(blinded, 60.0).gaps.all()  # it turns at 0.14 deg/s
    seen = observability(scenario(DYNAMICS_ALONE, duration_s=600.0), 60.0)
    assert not seen.gaps.any()


def test_sensor_sets_name_it():
    estimator = {**GYRO, **STARS, "sensors": ["magnetometer", "sun", "star_tracker"]}
    sets = sensor_sets(scenario(estimator, duration_s=600.0))
    assert [each.name for each in sets] == [
        "magnetometer + Sun sensors + star tracker + gyro",
        "magnetometer + gyro",
        "Sun sensors + gyro",
        "star tracker + gyro",
    ]
    assert sets[3].reached_s == pytest.approx(0.0, abs=5.0)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"star_tracker_boresight": None}, "star_tracker_boresight_noise_deg, "
         "star_tracker_boresight: must be given together, with the star tracker among the sensors"),
        ({"sensors": ["magnetometer"], "magnetometer_noise_nt": 50.0},
         "star_tracker_noise_deg: must be left out with sensors = ['magnetometer']; received 0.02"),
        ({"star_tracker_noise_deg": None},
         "star_tracker_noise_deg: must be given with sensors = ['star_tracker']; received none"),
    ],
)  # fmt: skip
def test_mistakes_are_reported(keys, message):
    estimator = {key: value for key, value in (GYRO_ALONE | keys).items() if value is not None}
    with pytest.raises(ScenarioError) as error:
        scenario(estimator)
    assert message in str(error.value)
