"""Readings of a twin: numbers of field, rate and Sun, what is left out, and what the Sun adds."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from twin_session import NOISE_T, believed, departure, tip_off

from torquer.compile import engine
from torquer.ground.telemetry.twin.flights import States
from torquer.ground.telemetry.twin.readings import Readings, Sunlight, select_readings
from torquer.ground.telemetry.twin.twin import fit_twin
from torquer.scenario.change import with_values

SIGMA = 1e-3


@pytest.fixture
def readings():
    """Three rows; the Sun is seen in the first and the last."""
    rng = np.random.default_rng(0)
    b_j, to_sun = 3e-5 * rng.normal(size=(3, 3)), rng.normal(size=(3, 3))
    to_sun /= np.linalg.norm(to_sun, axis=1)[:, None]
    sun = Sunlight(to_sun.copy(), to_sun, SIGMA)
    sun.seen[1] = np.nan
    return Readings(np.arange(3.0), b_j, np.zeros((3, 3)), b_j, NOISE_T, 1e-4, 1e-8, 1e-5, sun)


def turned(vector):
    """A twin at three rows, turned from J by a rotation vector [rad]."""
    q = np.tile(Rotation.from_rotvec(vector).as_quat(), (3, 1, 1))
    return States(q, np.zeros((3, 1, 3)))


def test_the_sun_adds_two_numbers_to_rows_that_see_it(readings):
    assert readings.rows().tolist() == 8 * [0] + 6 * [1] + 8 * [2]
    assert len(readings.measured()) == 22 and readings.noise().shape == (22, 22)
    assert not np.any(readings.shared()[[6, 7, 20, 21]])
    late = readings.until(1.5)
    assert late.rows().tolist() == 8 * [0] + 6 * [1]
    assert readings._replace(sun=None).rows().tolist() == 6 * [0] + 6 * [1] + 6 * [2]


def test_turn_moves_sun_by_its_part_across_line_of_sight(readings):
    assert np.allclose(readings.predicted(turned([0, 0, 0]))[0], readings.measured(), atol=1e-9)
    turn = 1e-5 * np.array([1.0, -2.0, 0.5])
    off = (readings.predicted(turned(turn))[0] - readings.measured())[[6, 7, 20, 21]]
    for pair, sun in zip(np.split(off, 2), readings.sun.to_sun_j[[0, 2]], strict=True):
        across = np.linalg.norm(np.cross(turn, sun)) / SIGMA
        assert np.linalg.norm(pair) == pytest.approx(across, rel=1e-4)


@pytest.fixture(scope="module")
def session():
    """Five minutes around the end of the umbra, at 11:09 UTC."""
    scenario = believed(5e5).replace("start", "2012-03-04T11:06:00Z")
    return scenario, tip_off(scenario, 1, 7, (2.0, -1.5, 1.2), sun=True)[0]


def sun_of(data, scenario):
    return select_readings(data, scenario, NOISE_T, 0.0, 0.0)[0].sun


def test_readings_of_the_sun_count_where_it_can_be_seen(session):
    scenario, data = session
    seen = np.isfinite(sun_of(data, scenario).seen[:, 0])
    assert 2 < seen.sum() < len(seen)
    dark = data.copy(deep=True)
    dark["sun_measured"].values[:] = [0.0, 0.6, 0.8]  # a lamp: in the umbra, and at a wrong angle
    dark["sun_measured"].values[seen] = 2.0 * data["sun_measured"].values[seen]
    found = sun_of(dark, scenario)
    assert np.array_equal(np.isfinite(found.seen[:, 0]), seen)
    assert np.allclose(np.linalg.norm(found.seen[seen], axis=1), 1.0)
    wrong = data.copy(deep=True)
    wrong["sun_measured"].values[:] = [0.0, 0.6, 0.8]
    assert sun_of(wrong, scenario) is None


@pytest.mark.parametrize("change", [{"albedo": 0.3}, {"bias_deg": [0.1, 0.0, 0.0]}])
def test_sensors_that_err_by_more_than_noise_do_not_count(session, change):
    scenario, data = session
    keys = {f"spacecraft.sun_sensors.{key}": value for key, value in change.items()}
    assert sun_of(data, with_values(scenario, keys)) is None
    assert sun_of(data, with_values(scenario, {"spacecraft.sun_sensors": None})) is None
    assert sun_of(data.drop_vars("sun_measured"), scenario) is None


@pytest.mark.slow
@pytest.mark.skipif(not engine.COMPILED, reason="hundreds of flights: slow")
def test_with_the_sun_errors_are_smaller_and_true():
    """Twenty minutes in sunlight of each of three satellites."""
    scenario = believed(5e5).replace("start", "2012-03-04T11:10:00Z")
    squares = []
    for seed in range(3):
        data, true = tip_off(scenario, seed, 20, (10.0, 10.0, 10.0), sun=True)
        twins = [
            fit_twin(each, scenario, NOISE_T) for each in (data, data.drop_vars("sun_measured"))
        ]
        covariances = [np.array(twin.members[0]["covariance"]) for twin in twins]
        assert all(twin.fits and not twin.doubt for twin in twins)
        assert "sun_body" in twins[0].data and "sun_body" not in twins[1].data
        ours, theirs = (np.sqrt(np.diag(each)[:3]) for each in covariances)
        assert np.linalg.norm(ours) < 0.75 * np.linalg.norm(theirs)
        off = departure(twins[0], true)
        squares.append(off @ np.linalg.solve(covariances[0], off) / len(off))
    assert 0.3 < np.mean(squares) < 1.7
