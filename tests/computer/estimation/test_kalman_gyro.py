"""The filter with a gyro: a twin, statistics of their errors, restarts, readings of other times.

Errors over runs are compared with chi-square bands; seeds are fixed.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from filter_cases import GYRO, HANDED_OVER, SCENARIO, without
from filter_twin import GyroTwin
from scipy.spatial.transform import Rotation

from torquer import resume, simulate
from torquer.analysis.filters.filter_flights import fly_filter
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.filter_statistics import autocorrelation, consistency, nees, nis
from torquer.base.user_source import plain_function
from torquer.compile import engine
from torquer.computer.estimation.kalman_gyro import keep_reading
from torquer.computer.inputs import Inputs, ReadingTimes
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.load import ScenarioError, scenario_from_data
from torquer.simulation.setup.run import prepare

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
FIELD = {**without(GYRO, "sun_noise_deg"), "sensors": ["magnetometer"]}
SUN = {**without(GYRO, "magnetometer_noise_nt"), "sensors": ["sun"]}


def scenario(estimator=GYRO, control=None, **changes):
    data = {
        **SCENARIO,
        "control": {"estimator": estimator, **(control or {"law": {"kind": "off"}})},
        "simulation": {**SCENARIO["simulation"], **changes},
    }
    return scenario_from_data(data)


def error_deg(result):
    q, true = result["q_estimated"].values, result["q_body_to_inertial"].values
    return np.degrees(angle_between(q, true))


def test_estimates_are_those_of_the_twin():
    """To 1e-4 sigma, in light and shadow; the twin takes whole vectors in Joseph's form."""
    estimator = GYRO | {"record_covariance": True}
    found = simulate(scenario(estimator, record_s=1.0, duration_s=1800.0))
    covariance = found["estimator.covariance"].values
    first = covariance[0].copy()
    bias = found["gyro_bias_estimated"].values[0]
    twin = GyroTwin(
        found["q_estimated"].values[0],
        bias,
        first,
        math.radians(0.01) ** 2,
        math.radians(1e-4) ** 2,
    )
    omega, b, sun = (found[f"{name}_measured"].values for name in ("omega", "b", "sun"))
    assert not sun[1600:].any() and sun[100].any()
    for k in range(1, 1800):
        twin.propagate(omega[max(k - 2, 0) : k + 1], 1.0)
        twin.update(found["b_inertial"].values[k], b[k], 50e-9)
        if sun[k].any():
            twin.update(found["sun_inertial"].values[k], sun[k], math.radians(0.1))
        sigma = np.sqrt(np.diag(twin.p))
        q, bias = found["q_estimated"].values[k], found["gyro_bias_estimated"].values[k]
        assert angle_between(q, twin.attitude.as_quat()) < 1e-4 * sigma[:3].min()
        assert np.abs(bias - twin.others).max() < 1e-4 * sigma[3:].min()
        assert covariance[k] == pytest.approx(twin.p, abs=1e-3 * sigma.max() ** 2)


def flown(runs, estimator=GYRO, control=None, **changes):
    return fly_filter(make_members(scenario(estimator, control, **changes), runs))


def test_errors_are_as_large_as_the_filter_says():
    """60 runs of 40 minutes, half of them in the shadow: NEES, NIS, whiteness."""
    runs = flown(60, duration_s=2400.0, record_s=20.0)
    for states in (3, 6):
        found = consistency(nees(runs, states), states)
        assert found.consistent and found.inside > 0.85
    for innovations in runs.innovations.values():
        assert consistency(*nis(innovations)).consistent


def test_innovations_are_white():
    runs = flown(4, duration_s=1200.0, record_s=1.0)
    for innovations in runs.innovations.values():
        for lag in (1, 2, 3):
            correlation, sigma = autocorrelation(innovations, lag)
            assert abs(correlation) < 4.0 * sigma < 0.05


@pytest.mark.parametrize(
    "wrong",
    [
        {"magnetometer_noise_nt": 500.0},
        {"magnetometer_noise_nt": 5.0},
        {"sun_noise_deg": 1.0},
        {"sun_noise_deg": 0.01},
        {"angle_random_walk_deg_sqrt_s": 0.1},
        {"angle_random_walk_deg_sqrt_s": 0.001},
        {"rate_random_walk_deg_s_sqrt_s": 1e-3},
        {"rate_random_walk_deg_s_sqrt_s": 1e-5},
    ],
    ids=lambda wrong: " ".join(f"{key}={value}" for key, value in wrong.items()),
)
def test_noise_wrong_by_ten_is_found_out(wrong):
    """By the errors or by the innovations of at least one of the sensors."""
    runs = flown(40, GYRO | wrong, duration_s=2400.0, record_s=20.0)
    values = [nees(runs), *(nis(i)[0] for i in runs.innovations.values())]
    found = [consistency(v, n) for v, n in zip(values, (6, 2, 2), strict=True)]
    assert not all(each.consistent for each in found)
    assert min(each.inside for each in found) < 0.7


@pytest.mark.parametrize("estimator", [FIELD, SUN], ids=["magnetometer", "sun"])
def test_filters_with_one_direction_are_consistent_after_they_took_over(estimator):
    runs = flown(60, estimator, HANDED_OVER, duration_s=2400.0, record_s=20.0)
    found = consistency(nees(runs), 6)
    assert found.consistent and found.inside > 0.85


def test_the_sun_comes_back_to_a_filter_that_stays_honest():
    """After half an hour in the umbra, 6 deg wrong about each axis: the turn about the Sun, which
    no reading tells, does not seem to follow from the readings that correct the others."""
    runs = flown(60, SUN, HANDED_OVER, duration_s=5000.0, record_s=20.0)
    after = slice(3700 // 20, None)
    wrong = np.degrees(np.sqrt(np.mean(runs.errors[:, 3500 // 20, :3] ** 2)))
    assert wrong > 4.0
    assert consistency(nees(runs)[:, after], 6).consistent


def test_the_sun_alone_begins_nothing():
    """The attitude about it would never be found."""
    result = simulate(scenario(SUN, duration_s=300.0))
    assert np.isnan(result["q_estimated"].values).all()


def test_the_magnetometer_bias_is_found():
    """With the gyro's scale factors, as good as known, the filter has the smoother's 12 errors."""
    estimator = GYRO | {"magnetometer_bias_sigma_nt": 300.0, "gyro_scale_sigma": 1e-7}
    runs = flown(40, estimator, duration_s=2400.0, record_s=20.0)
    found = consistency(nees(runs, 9), 9)
    assert found.consistent and found.inside > 0.85
    sigma = np.sqrt(runs.covariance[:, -2, 8, 8])
    assert np.all(sigma < 60e-9)


def test_triad_recovers_what_is_lost_in_the_shadow():
    """A gyro of 0.3 deg/sqrt(s), a magnetometer of 500 nT: lost, started again, consistent."""
    noise = {"magnetometer_noise_nt": 500.0, "angle_random_walk_deg_sqrt_s": 0.3}
    estimator = GYRO | noise | {"lost_sigma_deg": 3.0, "record_covariance": True}
    changed = scenario(estimator, duration_s=5000.0, record_s=20.0)
    changed = changed.replace("spacecraft.magnetometer.noise_nt", 500.0)
    changed = changed.replace("spacecraft.gyro.noise_deg_s", 0.3)
    changed = changed.replace("initial.rate_deg_s", [0.0, 0.0, 0.0])
    runs = fly_filter(make_members(changed, 40))
    result = simulate(changed)
    assert result["estimator.starts"].values[-2] > 1
    after = slice(int(3700 / 20), None)
    found = consistency(nees(runs)[:, after], 6)
    assert found.consistent


def test_wrong_readings_are_refused():
    """A field 30 sigma off, from a bias that is not among the states."""
    changed = scenario(duration_s=600.0).replace("spacecraft.magnetometer.bias_nt", [0, 3000, 0])
    result = simulate(changed)
    assert result["estimator.rejected"].values[-2] > 100
    assert result["estimator.starts"].values[-2] > 1  # too many: it begins again


def test_sound_readings_are_refused_as_rarely_as_said():
    result = simulate(scenario(GYRO | {"gate": 0.01}, duration_s=2400.0))
    readings = 2400 + 1500  # of the magnetometer, of the Sun sensors
    assert result["estimator.rejected"].values[-2] == pytest.approx(0.01 * readings, abs=20)
    result = simulate(scenario(duration_s=2400.0))
    assert result["estimator.rejected"].values[-2] <= 1


def test_each_reading_is_used_once_as_of_its_own_time():
    """Magnetometer every 4 s and 3 s late, Sun sensors every 5 s: still consistent."""
    late = scenario(duration_s=1400.0, record_s=20.0)
    late = late.replace("spacecraft.magnetometer.sample_s", 4.0)
    late = late.replace("spacecraft.magnetometer.delay_s", 3.0)
    late = late.replace("spacecraft.sun_sensors.sample_s", 5.0)
    late = late.replace("initial.rate_deg_s", [1.0, -0.6, 0.8])
    late = late.replace("control.estimator.record_covariance", True)
    result = simulate(late.replace("simulation.record_s", 1.0))
    seen = np.isfinite(result["estimator.innovation_magnetometer"].values[:, 0])
    assert seen[10:1390].mean() == pytest.approx(0.25, abs=0.002)
    seen = np.isfinite(result["estimator.innovation_sun"].values[:, 0])
    assert seen[10:1390].mean() == pytest.approx(0.2, abs=0.002)
    runs = fly_filter(make_members(late, 40))
    assert consistency(nees(runs)[:, 2:], 6).consistent


def test_a_run_resumes_to_the_same_bits():
    one = simulate(scenario(duration_s=600.0))
    stopped = simulate(scenario(duration_s=600.0), until_s=245.0)
    other = resume(stopped)
    for name in ("q_estimated", "gyro_bias_estimated", "attitude_sigma", "estimator.starts"):
        assert np.array_equal(one[name].values, other[name].values, equal_nan=True)


def test_the_magnetometer_and_the_gyro_find_the_attitude_by_themselves():
    """From nothing but the field: lost at the start, about a degree in one orbit."""
    result = simulate(scenario(FIELD, duration_s=6000.0, record_s=60.0))
    error, sigma = error_deg(result), np.degrees(result["attitude_sigma"].values)
    assert error[0] > 50.0 and math.sqrt(3.0) * sigma[0] > 90.0
    assert np.sqrt(np.mean(error[-40:-1] ** 2)) < 1.5
    assert np.all(error[-40:-1] < 4.0 * math.sqrt(3.0) * sigma[-40:-1])


def error_after(estimator, wrong_deg, duration_s):
    """Error [deg] of 40 runs that take over attitudes wrong by so much about each axis."""
    piece, errors = None, []
    for number in range(40):
        member = scenario(estimator, duration_s=duration_s, record_s=60.0).replace("seed", number)
        run = prepare(member, piece=piece)
        piece, cells, known = piece or run.piece, run.state.cells[0], run.state.board.known[0]
        drawn = np.random.default_rng(number).normal(size=3)
        true = Rotation.from_quat([cells[f"q_{c}"] for c in "xyzw"])
        given = true * Rotation.from_rotvec(np.radians(wrong_deg) * drawn)
        for c, value in zip("xyzw", given.as_quat(), strict=True):
            known[f"estimate_q_{c}"] = value
        for c in "xyz":
            known[f"estimate_omega_{c}"] = 0.0
        known["estimate_s"], known["sigma_rad"] = -0.5, np.radians(wrong_deg) / math.sqrt(3.0)
        run.advance_to(run.steps)
        last, row = run.rows().known[-1], run.rows().rows[-1]
        q, found = ([x[f"{p}_{c}"] for c in "xyzw"] for x, p in ((row, "q"), (last, "estimate_q")))
        errors.append(np.degrees(angle_between(np.array(q), np.array(found))))
    return np.array(errors)


def test_from_large_errors_the_filter_comes_back():
    """Magnetometer and gyro, 50 deg wrong about each axis: an hour later, of 300 runs one is more
    than 10 deg off."""
    assert np.quantile(error_after(FIELD, 50.0, 3600.0), 0.95) < 10.0


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"sun_noise_deg": None}, "sun_noise_deg: must be given with sensors = ['magnetometer', "
         "'sun']; received none"),
        ({"sensors": ["magnetometer"]}, "sun_noise_deg: must be left out with sensors = "
         "['magnetometer']; received 0.1"),
        ({"sensors": []}, "sensors: must name one or more different sensors; received []"),
        ({"sensors": ["sun"], "magnetometer_noise_nt": None, "magnetometer_bias_sigma_nt": 5.0},
         "magnetometer_bias_sigma_nt: must be left out without the magnetometer among the "
         "sensors; received 5"),
    ],
)  # fmt: skip
def test_mistakes_are_reported(keys, message):
    estimator = {key: value for key, value in (GYRO | keys).items() if value is not None}
    with pytest.raises(ScenarioError) as error:
        scenario(estimator)
    assert message in str(error.value)


def test_a_reading_is_kept_once():
    """However often the computer sees it before the next one."""
    memory = SimpleNamespace(
        gyro_s=np.arange(1.0, 4.0), gyro_rad_s=np.arange(9.0).reshape(3, 3), gyro_units=0.0
    )
    inputs = Inputs(4.0, omega_body_rad_s=(0.1, 0.2, 0.3), read_at=ReadingTimes(gyro_s=4.0))
    for _ in range(3):
        plain_function(keep_reading)(inputs, None, memory)
        assert memory.gyro_s.tolist() == [2.0, 3.0, 4.0]
        assert memory.gyro_rad_s.tolist() == [[3.0, 4.0, 5.0], [6.0, 7.0, 8.0], [0.1, 0.2, 0.3]]
