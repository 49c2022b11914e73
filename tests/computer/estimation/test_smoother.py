"""The smoother: a twin by matrices, statistics of its errors, eclipse, restarts, what it refuses.

Errors over runs are compared with chi-square bands; seeds are fixed.
"""

import math

import numpy as np
import pytest
from filter_cases import DISTURBANCE, DYNAMICS, GYRO, HANDED_OVER, SCENARIO
from filter_twin import GyroTwin, cross_matrix, discrete
from scipy.spatial.transform import Rotation
from slow_cases import slow_after

import torquer
from torquer import simulate
from torquer.analysis.filters.filter_flights import true_states
from torquer.analysis.filters.filter_members import make_members
from torquer.analysis.filters.filter_statistics import FilterRuns, consistency, nees
from torquer.analysis.filters.linear_covariance import Motion
from torquer.analysis.filters.smoothing import measure_accuracy, smooth_run
from torquer.compile import engine
from torquer.maths.geometry.attitudes import rotation_vector
from torquer.scenario.load import scenario_from_data
from torquer.simulation.results.dataset import flown_scenario

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
BOTH = pytest.mark.parametrize("estimator", [GYRO, DYNAMICS], ids=["gyro", "dynamics"])
BIASED = GYRO | {"magnetometer_bias_sigma_nt": 300.0}
DIPOLE = DYNAMICS | {"dipole_sigma_a_m2": 0.05}
#: What is noise to a filter with a gyro, but for the random walk of its bias.
NOISE = (
    "magnetometer_noise_nt", "sun_noise_deg", "angle_random_walk_deg_sqrt_s",
    "gyro_bias_sigma_deg_s",
)  # fmt: skip


def scenario(estimator=GYRO, control=None, **changes):
    """Lit at the start, in the umbra from about 1500 s to 3600 s; a record at each control step."""
    record = {"record_s": 1.0, "record_inputs": True}
    return scenario_from_data(
        {
            **SCENARIO,
            "disturbance": DISTURBANCE if estimator["kind"] == "kalman_dynamics" else {},
            "control": {"estimator": estimator, **(control or {"law": {"kind": "off"}})},
            "simulation": {**SCENARIO["simulation"], **record, **changes},
        }
    )


@pytest.fixture(scope="module")
def revolution():
    """A revolution with a gyro, and smoothed."""
    result = simulate(scenario(GYRO | {"record_covariance": True}, duration_s=5700.0))
    return result, smooth_run(result)


def test_it_is_the_fixed_interval_smoother_of_the_textbook():
    """Rauch, Tung and Striebel's recursion, written out with the twin's matrices, from what the
    filter has recorded. Both are right to first order in the errors: with a tenth of the usual
    noise they differ by a thousandth of sigma at most, with the usual one by a hundredth (tried).
    """
    estimator = GYRO | {key: 0.1 * GYRO[key] for key in NOISE} | {"record_covariance": True}
    quiet = scenario(estimator, duration_s=300.0)
    for key in ("magnetometer.noise_nt", "sun_sensors.noise_deg", "gyro.noise_deg_s"):
        sensor, name = key.split(".")
        quiet = quiet.replace(f"spacecraft.{key}", 0.1 * SCENARIO["spacecraft"][sensor][name])
    result = simulate(quiet)
    found = smooth_run(result)
    names = ("q_estimated", "gyro_bias_estimated", "estimator.covariance", "omega_measured")
    q, bias, p, omega = (result[name].values[:300] for name in names)
    later = q[299], bias[299], p[299]
    for k in range(298, -1, -1):
        twin = GyroTwin(q[k], bias[k], p[k], math.radians(0.001) ** 2, math.radians(1e-4) ** 2)
        later = smoothed_by_matrices(twin, omega[max(k - 1, 0) : k + 2], later)
        own_q, own_bias, own_p = later
        sigma, given = np.sqrt(np.diag(own_p)), found.isel(time=k)
        apart = rotation_vector(given["q_smoothed"].values[None], own_q[None])[0]
        assert np.abs(apart / sigma[:3]).max() < 2e-3
        assert np.abs((given["states_smoothed"].values - own_bias) / sigma[3:]).max() < 1e-4
        scale = np.outer(sigma, sigma)
        assert given["covariance_smoothed"].values / scale == pytest.approx(
            own_p / scale, rel=0, abs=1e-4
        )


def smoothed_by_matrices(twin: GyroTwin, readings, later):
    """Smoothed attitude, bias, covariance at a step from those a second later."""
    start, bias, p = twin.attitude, twin.others, twin.p
    twin.propagate(readings, 1.0)
    phi = transition(twin, (start.inv() * twin.attitude).as_rotvec())
    gain = p @ phi.T @ np.linalg.inv(twin.p)
    q_later, bias_later, p_later = later
    turn = twin.attitude.inv() * Rotation.from_quat(q_later)
    x = gain @ np.concatenate([turn.as_rotvec(), bias_later - twin.others])
    better = in_axes(p_later, turn.inv()) - twin.p
    turn = Rotation.from_rotvec(x[:3])
    return (start * turn).as_quat(), bias + x[3:], in_axes(p + gain @ better @ gain.T, turn)


def in_axes(p, turn: Rotation) -> np.ndarray:
    """A covariance whose attitude error is referred to turned axes."""
    axes = np.eye(6)
    axes[:3, :3] = turn.inv().as_matrix()
    return axes @ p @ axes.T


def transition(twin: GyroTwin, turn) -> np.ndarray:
    """Transition matrix of the twin's errors over one second, in which it turns so [rad]."""
    f = np.zeros((6, 6))
    f[:3, :3] = -cross_matrix(turn)
    f[:3, 3:] = -np.eye(3)
    return discrete(f, twin.noise, 1.0)[0]


def smoother_runs(results):
    """Errors of the smoother in runs of one scenario, as `fly_filter` has those of its filter.
    There are no innovations; restarts and readings rejected are those of the filter.
    """
    errors, covariance, counts, motions = [], [], [], []
    for result in results:
        scenario, found = flown_scenario(result), smooth_run(result)
        steps = result.sel(time=found["time"])
        t_s, omega, q = (
            steps[name].values for name in ("time", "omega_body", "q_body_to_inertial")
        )
        turn = rotation_vector(found["q_smoothed"].values, q)
        others = true_states(scenario, t_s, omega) - found["states_smoothed"].values
        errors.append(np.hstack([turn, others]))
        covariance.append(found["covariance_smoothed"].values)
        counts.append([steps[f"estimator.{name}"].values for name in ("rejected", "starts")])
        motions.append(Motion(t_s, q, omega, np.zeros_like(omega)))
    rejected, starts = np.swapaxes(counts, 0, 1)
    return FilterRuns(
        motions[0].t_s, np.stack(errors), np.stack(covariance), {}, rejected, starts,
        np.zeros_like(starts), motions,
    )  # fmt: skip


@pytest.mark.parametrize(
    "estimator",
    slow_after(1, [GYRO, DYNAMICS, BIASED, DIPOLE]),
    ids=["gyro", "dynamics", "biased", "dipole"],
)
def test_errors_are_as_large_as_the_smoother_says(estimator):
    """40 runs of 40 minutes, the last third in the shadow: NEES of attitude and of all states."""
    members = make_members(scenario(estimator, duration_s=2400.0), 40)
    runs = smoother_runs(simulate(member) for member in members)
    for states in (3, runs.errors.shape[-1]):
        found = consistency(nees(runs, states), states)
        assert found.consistent and 0.9 < found.overall < 1.1, (states, found.overall)


@BOTH
def test_nothing_is_less_certain_afterwards(estimator):
    """No variance of any combination of errors grows, to rounding; at the end nothing changes."""
    result = simulate(scenario(estimator | {"record_covariance": True}, duration_s=3000.0))
    found = smooth_run(result)
    filtered, own = result["estimator.covariance"].values[:-1], found["covariance_smoothed"].values
    sigma = np.sqrt(np.einsum("kii->ki", filtered))
    scale = sigma[:, :, None] * sigma[:, None, :]
    turn = rotation_vector(found["q_smoothed"].values, result["q_estimated"].values[:-1])
    axes = np.tile(np.eye(6), (len(turn), 1, 1))
    axes[:, :3, :3] = Rotation.from_rotvec(turn).inv().as_matrix()
    in_same_axes = axes @ own @ np.swapaxes(axes, 1, 2)
    gained = np.linalg.eigvalsh((filtered - in_same_axes) / scale)
    assert gained.min() > -1e-6
    assert np.array_equal(own[-1], filtered[-1])
    assert np.array_equal(found["q_smoothed"].values[-1], result["q_estimated"].values[-2])


def test_the_eclipse_gains_most(revolution):
    """The Sun at its end tells what the gyro has drifted in it: the worst error falls to less than
    half, and what is stated, too; in the light there is less to gain."""
    result, found = revolution
    dark = ~result["sun_measured"].values[:-1].any(axis=1)
    assert 1500 < np.flatnonzero(dark)[0] < 1700 and dark.sum() > 1500
    stated = [
        np.sqrt(np.mean(each[dark] ** 2))
        for each in (
            found["attitude_sigma_smoothed"].values, result["attitude_sigma"].values[:-1],
        )
    ]  # fmt: skip
    assert stated[0] < 0.5 * stated[1]
    accuracy = measure_accuracy(result, found)
    assert accuracy.smoothed_greatest_deg < 0.5 * accuracy.filter_greatest_deg
    assert accuracy.smoothed_deg == pytest.approx(accuracy.smoothed_sigma_deg, rel=0.3)


def test_the_rate_is_the_gyros_less_the_smoothed_bias(revolution):
    result, found = revolution
    bias = found["states_smoothed"].sel(state=[f"gyro_bias_{c}" for c in "xyz"]).values
    expected = result["omega_measured"].values[:-1] - bias
    assert found["omega_smoothed"].values == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert list(found["state_units"].values) == 3 * ["rad/s"]
    assert np.all(found["rate_sigma_smoothed"].values <= result["rate_sigma"].values[:-1])


def test_the_rate_without_a_gyro_is_better_afterwards():
    result = simulate(scenario(DYNAMICS, duration_s=1200.0))
    found, true = smooth_run(result), result["omega_body"].values[:-1]
    error = [
        np.sqrt(np.mean((each - true) ** 2))
        for each in (found["omega_smoothed"].values, result["omega_estimated"].values[:-1])
    ]
    assert error[0] < 0.7 * error[1]
    assert error[0] < 1.3 * np.sqrt(np.mean(found["rate_sigma_smoothed"].values ** 2))


def test_nothing_is_known_before_start_and_restarts_cut_attitude():
    """Both sensors are silent at first, and again until the filter is lost."""
    silent = [
        {"kind": "silent", "from_s": 0.0, "until_s": 50.0},
        {"kind": "silent", "from_s": 300.0, "until_s": 1300.0},
    ]
    spacecraft = {
        name: SCENARIO["spacecraft"][name] | {"failures": silent}
        for name in ("magnetometer", "sun_sensors")
    }
    lost = scenario(GYRO | {"lost_sigma_deg": 1.2}, duration_s=1500.0)
    for name, keys in spacecraft.items():
        lost = lost.replace(f"spacecraft.{name}.failures", keys["failures"])
    result = simulate(lost)
    assert result["estimator.starts"].values[-2] > 1
    found = smooth_run(result)
    known = np.isfinite(found["q_smoothed"].values[:, 0])
    assert np.array_equal(known, np.isfinite(result["q_estimated"].values[:-1, 0]))
    assert not known[:50].any() and known[51:].all()
    sigma = found["attitude_sigma_smoothed"].values, result["attitude_sigma"].values[:-1]
    assert np.all(sigma[0][known] <= sigma[1][known] * (1.0 + 1e-9))


def test_steps_at_which_another_estimator_works_are_left_out():
    """TRIAD hands over after 3 s; at the very first step the modes have chosen nothing yet."""
    result = simulate(scenario(GYRO, HANDED_OVER, duration_s=300.0))
    found = smooth_run(result)
    known = np.isfinite(found["q_smoothed"].values[:, 0])
    assert known[0] and not known[1:3].any() and known[10:].all()
    assert np.isfinite(result["q_estimated"].values[:3]).all()


def test_coils_wheels_and_late_readings_change_nothing():
    """The inputs of the filter are recorded: it finds its estimates again, or says so."""
    late = scenario(DYNAMICS, {"law": {"kind": "bdot_rate", "gain_a_m2_s_per_t": 3e6}})
    for sensor in ("magnetometer", "sun_sensors"):
        late = late.replace(f"spacecraft.{sensor}.sample_s", 4.0)
        late = late.replace(f"spacecraft.{sensor}.delay_s", 3.0)
    wheels = {
        "layout": {"kind": "orthogonal"}, "momentum_limit_n_m_s": 0.5, "torque_limit_n_m": 0.005,
        "initial_speed_rpm": 1500.0, "speed_noise_rpm": 0.1,
    }  # fmt: skip
    result = simulate(late.replace("spacecraft.wheels", wheels))
    found = smooth_run(result)
    assert np.abs(result["coil_dipole_on_board"].values).max() > 0.01
    assert np.isfinite(found["q_smoothed"].values[10:]).all()
    sigma = found["attitude_sigma_smoothed"].values, result["attitude_sigma"].values[:-1]
    assert np.all(sigma[0][10:-10] < sigma[1][10:-10])


def test_result_from_a_file_is_smoothed_bit_identically(tmp_path):
    result = simulate(scenario(duration_s=120.0))
    torquer.save(result, tmp_path / "result.nc")
    assert smooth_run(torquer.load(tmp_path / "result.nc")).identical(smooth_run(result))


def test_interrupted_run_is_smoothed_bit_identically():
    whole = simulate(scenario(duration_s=120.0))
    parts = torquer.resume(simulate(scenario(duration_s=120.0), until_s=47.0))
    assert smooth_run(parts).identical(smooth_run(whole))


def test_what_cannot_be_smoothed_is_refused():
    plain = scenario(duration_s=60.0)
    without = simulate(plain.replace("simulation.record_inputs", False))
    with pytest.raises(ValueError, match=r"record_inputs: must be true in a run that"):
        smooth_run(without)
    coarse = simulate(plain.replace("simulation.record_s", 10.0))
    with pytest.raises(ValueError, match=r"record_s: must be 1 s, to have .* received 10 s"):
        smooth_run(coarse)
    triad = {"kind": "triad", "magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.1}
    with pytest.raises(ValueError, match=r"control.estimator.kind: must be .*received 'triad'"):
        smooth_run(simulate(scenario(triad, duration_s=60.0)))
    other = simulate(plain)
    other["b_measured"][20] *= 1.1
    with pytest.raises(ValueError, match=r"received one with others from t = 20 s on"):
        smooth_run(other)
