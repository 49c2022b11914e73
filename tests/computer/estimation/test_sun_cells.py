"""Single Sun cells in filters: statistics with the Earth's light, starts, eclipse, faults."""

import copy

import numpy as np
import pytest
from filter_cases import DISTURBANCE, DYNAMICS, GYRO, SCENARIO, SPACECRAFT, without
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.filter_statistics import consistency, nees, nis
from torquer.analysis.filters.linear_covariance import expected_accuracy
from torquer.analysis.filters.observability import observability
from torquer.analysis.notes.assumption_notes import assumption_notes
from torquer.compile import engine
from torquer.computer.estimation.isolation_states import CONTRADICTS
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.computer.estimation.measurements.sun_cells import measure_cell
from torquer.computer.estimation.starts import NOT_STARTED
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.load import ScenarioError, scenario_from_data

COMPILED = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
FACES = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
CELLS = {"normals": FACES, "noise": 0.01, "albedo": 0.3}
OWN = {
    "sensors": ["magnetometer", "sun_cells"],
    "cell_noise": 0.01,
    "cell_normals": FACES,
    "cell_albedo": 0.3,
}
WITH_GYRO = {**without(GYRO, "sun_noise_deg"), **OWN}
WITHOUT_GYRO = {**without(DYNAMICS, "sun_noise_deg"), **OWN}


def scenario(estimator=WITH_GYRO, cells=None, seed=0, **simulation):
    spacecraft = copy.deepcopy(SPACECRAFT) | {"sun_cells": CELLS | (cells or {})}
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


def test_the_measurement_is_the_derivative_of_the_signal():
    """By differences of attitudes; the Earth's light behind a cell counts for nothing."""
    own = KalmanGyro.model_validate(WITH_GYRO | {"cell_albedo_error": 0.5}).sensing().sun_cells
    q, sun = Rotation.from_rotvec([0.4, -0.3, 0.9]), np.array([0.6, 0.0, 0.8])
    normal = q.inv().apply(np.array([0.8, 0.1, 0.6]))
    normal /= np.linalg.norm(normal)
    row = (*normal, 0.0)
    for earth in (0.2 * np.array([0.9, 0.3, 0.1]), np.array([-0.3, 0.0, -0.1])):

        def signal(a, earth=earth):
            body = q * Rotation.from_rotvec(a)
            return normal @ body.inv().apply(sun) + max(normal @ body.inv().apply(earth), 0.0)

        m = measure_cell(
            tuple(q.as_quat()), row, signal(np.zeros(3)), tuple(sun), tuple(earth), own, 0.0
        )
        assert m.z[0] == pytest.approx(0.0, abs=1e-15)
        steps = [(signal(1e-6 * e) - signal(-1e-6 * e)) / 2e-6 for e in np.eye(3)]
        assert np.array(m.h[0]) == pytest.approx(np.array(steps), abs=1e-8)
        of_earth = max(normal @ q.inv().apply(earth), 0.0)
        assert m.r == pytest.approx(0.01**2 + (0.5 * of_earth) ** 2)


@COMPILED
@pytest.mark.parametrize("estimator", [WITH_GYRO, WITHOUT_GYRO], ids=["gyro", "dynamics"])
def test_errors_have_their_stated_size_under_earth_light(estimator):
    """In light and umbra."""
    runs = fly_filter(make_members(scenario(estimator, record_s=20.0, duration_s=2400.0), 60))
    assert np.isfinite(runs.errors[:, 5, 0]).mean() > 0.9
    for states in (3, 6):
        found = consistency(nees(runs, states), states)
        assert found.consistent and found.inside > 0.8
    assert consistency(*nis(runs.innovations["sun_cells"])).overall == pytest.approx(1.0, abs=0.05)


@COMPILED
def test_ignored_earth_light_shows_in_the_errors():
    ignored = WITH_GYRO | {"cell_albedo": 0.0}
    runs = fly_filter(make_members(scenario(ignored, record_s=20.0, duration_s=1200.0), 20))
    assert consistency(nees(runs, 3), 3).overall > 3.0


@COMPILED
def test_cells_are_used_in_the_light_only():
    result = simulate(scenario(duration_s=2400.0))
    used = np.isfinite(result["estimator.innovation_sun_cells"].values)[1:-1]
    fraction = result["sunlit_fraction"].values[1:-1]
    assert used[fraction == 1.0].sum(axis=1).min() >= 1 and used.sum(axis=1).max() <= 3
    assert not used[fraction < 0.4].any() and (fraction < 0.4).any()
    assert (errors_deg(result)[5:] < 4.0 * stated_deg(result)[5:]).all()


@COMPILED
def test_a_start_in_the_umbra_waits_for_the_sun():
    dark = scenario(duration_s=100.0)
    r = dark.orbit_environment().state(np.zeros(1))[0][0]
    behind = (-r / np.linalg.norm(r)).tolist()
    result = simulate(dark.replace("environment.sun_direction", behind))
    assert np.isnan(result["q_estimated"].values).all()
    reason = NOT_STARTED[int(result["estimator.not_started"].values[-1])]
    assert reason == "fewer than three Sun cells in the light"


@COMPILED
@pytest.mark.parametrize("kind", ["zeros", "nan", "infinite"])
def test_no_value_of_the_signals_makes_the_attitude_unknown(kind):
    bad = {"failures": [{"kind": kind, "from_s": 300.0, "until_s": 360.0}]}
    result = simulate(scenario(cells=bad, duration_s=400.0))
    assert (errors_deg(result)[5:] < 4.0 * stated_deg(result)[5:]).all()


@COMPILED
def test_a_cell_that_is_far_too_bright_is_isolated_alone():
    """One of six by a factor of two."""
    result = simulate(
        scenario(cells={"scale_error": [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]}, duration_s=600.0)
    )
    isolated = result["estimator.isolated"].values[:, 4:]
    assert (isolated[200:, :2] == CONTRADICTS).any() and not isolated[200:, 2:].any()
    assert errors_deg(result)[200:].max() < 1.0


def test_expected_accuracy_and_observability_know_them():
    """Bright cells leave nothing open; without albedo error they are more accurate."""
    seen = scenario(duration_s=600.0)
    doubted = scenario(WITH_GYRO | {"cell_albedo_error": 2.0}, duration_s=600.0)
    sigma = [expected_accuracy(each).attitude_sigma_rad[-1] for each in (seen, doubted)]
    assert 0.1 < np.degrees(sigma[0]) * np.sqrt(3.0) < 1.0 and sigma[1] > 1.05 * sigma[0]
    alone = scenario(
        {**without(GYRO, "sun_noise_deg"), "sensors": ["magnetometer"]}, duration_s=600.0
    )
    singular = [observability(each, 60.0).singular[:, -1] for each in (seen, alone)]
    assert (singular[0] > 10.0 * singular[1]).all()


def test_mistakes_are_reported():
    with pytest.raises(ScenarioError, match="cell_normals: must be given with sensors"):
        scenario(without(WITH_GYRO, "cell_normals"))
    with pytest.raises(ScenarioError, match="normals: must be at most 6 vectors; received 7"):
        scenario(cells={"normals": [*FACES, [1, 1, 1]]})
    with pytest.raises(ScenarioError, match="scale_error: must be one number above -1, or one per"):
        scenario(cells={"scale_error": [0.1, 0.2]})


def test_scenario_that_ignores_earth_light_is_noted():
    assert assumption_notes(scenario()) == []
    (note,) = assumption_notes(scenario(WITH_GYRO | {"cell_albedo": 0.0}))
    assert "see an Earth of albedo 0.3" in note


@COMPILED
def test_cells_and_the_horizon_alone_find_the_attitude():
    """The last two of the sensors by whose directions a filter starts."""
    own = without(OWN, "sensors") | {"sensors": ["horizon", "sun_cells"], "horizon_noise_deg": 0.3}
    estimator = without(GYRO, "sun_noise_deg") | own
    estimator = without(estimator, "magnetometer_noise_nt")
    flown = scenario(estimator, duration_s=300.0)
    horizon = {"noise_deg": 0.3}
    spacecraft = flown.spacecraft.model_dump(exclude_unset=True) | {"horizon_sensor": horizon}
    result = simulate(flown.replace("spacecraft", spacecraft))
    assert np.isfinite(stated_deg(result)[:10]).any()
    assert errors_deg(result)[-30:].max() < 5.0
