"""Attitude from telemetry: the smoother of simulated runs again, true errors, models that are not.

Errors over sessions are compared with what is stated; seeds are fixed.
"""

from datetime import timedelta

import numpy as np
import pytest
from filter_cases import GYRO, SCENARIO
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from telemetry_session import START, environment, motion

from torquer import simulate, smooth_run
from torquer.compile import engine
from torquer.computer.estimation.kalman_dynamics import KalmanDynamics
from torquer.computer.estimation.kalman_gyro import KalmanGyro
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.ground.telemetry.attitude import estimate_attitude, load_filter
from torquer.ground.telemetry.reading.quantities import QUANTITIES, make_session
from torquer.maths.geometry.attitudes import rotation_vector
from torquer.scenario.load import scenario_from_data

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="filters over sessions: slow")
CADENCE_S, ROWS, LIT = 31.0, 117, 60
INERTIA = np.diag([1.0, 1.3, 1.7])
NOISE = {"b_nt": 50.0, "sun_deg": 0.1, "gyro_deg_s": 0.003}


def gyro_filter(**keys):
    """A filter that knows the noise of `session`."""
    usual = {
        "magnetometer_noise_nt": NOISE["b_nt"],
        "sun_noise_deg": NOISE["sun_deg"],
        "angle_random_walk_deg_sqrt_s": NOISE["gyro_deg_s"] * np.sqrt(CADENCE_S),
        "rate_random_walk_deg_s_sqrt_s": 1e-7,
        "gyro_bias_sigma_deg_s": 0.01,
    }
    return KalmanGyro(**(usual | keys))


def session(seed, rows=slice(None), moved=None, **noise):
    """A session that begins in the umbra; what is true of its attitude (n, 4) and the gyro's bias.

    `moved`: attitudes (J to body) and rates at the rows, left out: those of `motion`.
    """
    noise, rng, t_s = NOISE | noise, np.random.default_rng(seed), CADENCE_S * np.arange(ROWS)
    to_body, omega = moved or motion(t_s, seed)
    env = environment()
    r, v = env.state(t_s)
    sun = env.sun(t_s) - r
    sun /= np.linalg.norm(sun, axis=1)[:, None]
    seen = to_body.apply(sun) + np.radians(noise["sun_deg"]) * rng.normal(size=(ROWS, 3))
    seen /= np.linalg.norm(seen, axis=1)[:, None]
    seen[env.sunlit_fraction(t_s, r) < 0.99] = 0.0
    b = to_body.apply(env.field(t_s, r, v)) + 1e-9 * noise["b_nt"] * rng.normal(size=(ROWS, 3))
    bias = np.radians(0.01) * rng.normal(size=3)
    gyro = omega + bias + np.radians(noise["gyro_deg_s"]) * rng.normal(size=(ROWS, 3))
    utc = np.datetime64(START.replace(tzinfo=None), "ns") + (1e9 * t_s).astype("timedelta64[ns]")
    data = make_session(utc, {"b_measured": b, "omega_measured": gyro, "sun_measured": seen})
    data = data.isel(time=rows)
    first = float(data["time"][0])
    data = data.assign_coords(time=data["time"] - first)
    return data, to_body.inv().as_quat()[rows], bias, along(first)


def along(first_s):
    """The environment from seconds after the start."""
    return environment(START + timedelta(seconds=first_s))


def nees(found, q, bias=None):
    """Mean square of the smoothed errors over what is stated, by row."""
    errors = rotation_vector(found["q_smoothed"].values, q)
    if bias is not None:
        errors = np.hstack([errors, bias - found["states_smoothed"].values])
    k = errors.shape[1]
    p = found["covariance_smoothed"].values[:, :k, :k]
    return np.einsum("ni,ni->n", errors, np.linalg.solve(p, errors[..., None])[..., 0]) / k


def angle_deg(q, true):
    """Root mean square of the whole angles."""
    return np.degrees(np.sqrt(np.mean(np.sum(rotation_vector(q, true) ** 2, axis=1))))


def test_a_result_stripped_to_telemetry_is_smoothed_again():
    """The tabulated surroundings of the run differ from those of telemetry by 1e-9 and less."""
    record = {"record_s": 1.0, "record_inputs": True, "duration_s": 300.0}
    scenario = scenario_from_data(
        {
            **SCENARIO,
            "control": {"estimator": GYRO, "law": {"kind": "off"}},
            "simulation": {**SCENARIO["simulation"], **record},
        }
    )
    result = simulate(scenario)
    wanted = smooth_run(result)
    steps = result.isel(time=slice(-1))  # the last row is recorded before the sensors are read
    values = {name: steps[name].values for name in steps if name in QUANTITIES}
    assert {"b_measured", "sun_measured", "omega_measured"} <= set(values)
    data = make_session(steps["utc"].values, values)
    place = OrbitEnvironment(scenario.environment, scenario.orbit, scenario.start)
    found = estimate_attitude(data, scenario.control.estimator, place)
    assert found.fit.fits
    sigma = wanted["attitude_sigma_smoothed"].values
    apart = rotation_vector(found.data["q_smoothed"].values, wanted["q_smoothed"].values)
    assert np.abs(apart / sigma[:, None]).max() < 1e-3
    for name in ("attitude_sigma_smoothed", "rate_sigma_smoothed", "omega_smoothed"):
        assert found.data[name].values == pytest.approx(wanted[name].values, rel=1e-3)


def test_errors_are_as_stated_from_the_umbra_on():
    """40 sessions: from the first row on, in the umbra, before the filter itself has started.

    The gyro's noise of a row enters the steps before and after it, which the filter takes for
    independent: at 31 s a step the mean is a tenth off one.
    """
    squares, wholes, better = [], [], []
    for seed in range(40):
        data, q, bias, place = session(seed)
        found = estimate_attitude(data, gyro_filter(), place)
        assert found.fit.fits, found.verdict
        squares.append(nees(found.data, q))
        wholes.append(nees(found.data, q, bias))
        own = [angle_deg(found.data[name].values, q) for name in ("q_smoothed", "q_estimated")]
        better.append(own[0] < own[1])
    assert 0.8 < np.mean(squares) < 1.2
    assert 0.8 < np.mean(wholes) < 1.2
    assert 0.6 < np.mean([each[0] for each in squares]) < 1.4  # the first row alone
    assert all(better)


def test_gaps_forget_the_attitude_and_keep_the_bias():
    """Ten minutes are missing in the light: errors stay as stated on both sides of the gap."""
    rows = np.r_[LIT : LIT + 18, LIT + 38 : ROWS]
    squares = []
    for seed in range(20):
        data, q, _, place = session(seed, rows)
        found = estimate_attitude(data, gyro_filter(), place)
        assert found.fit.fits
        squares.append(nees(found.data, q))
    assert 0.8 < np.mean(squares) < 1.25
    assert 0.5 < np.mean([each[17:20] for each in squares]) < 1.5
    alone, *_ = session(19, slice(LIT + 38, None))
    second = estimate_attitude(alone, gyro_filter(), along(CADENCE_S * (LIT + 38)))
    both = found.data["covariance_smoothed"].values[-1, 3:, 3:]
    assert np.trace(both) < 0.7 * np.trace(second.data["covariance_smoothed"].values[-1, 3:, 3:])


def test_a_stretch_that_never_shows_the_attitude_stays_unknown():
    data, q, _, place = session(0, np.r_[0:40, LIT + 10 : ROWS])
    found = estimate_attitude(data, gyro_filter(), place)
    known = np.isfinite(found.data["q_smoothed"].values[:, 0])
    assert not known[:40].any() and known[40:].all()
    assert found.fit.known == pytest.approx(known.mean())
    assert angle_deg(found.data["q_smoothed"].values[40:], q[40:]) < 0.3


def test_readings_of_single_rows_may_be_missing_or_wild():
    data, q, _, place = session(3)
    rng = np.random.default_rng(0)
    for name in ("b_measured", "sun_measured", "omega_measured"):
        data[name].values[rng.choice(np.arange(1, ROWS), 6, replace=False)] = np.nan
    wild = rng.choice(ROWS, 11, replace=False)
    data["b_measured"].values[wild] += 2e-5
    found = estimate_attitude(data, gyro_filter(), place)
    assert found.fit.fits, found.verdict
    assert 0.0 < found.fit.rejected < 0.15
    assert nees(found.data, q).mean() < 1.6


def corrupted(kind):
    """A session and a filter whose model is not that of the session."""
    noise = {"quiet Sun": {"sun_deg": 0.5}, "quiet gyro": {"gyro_deg_s": 0.015}}.get(kind, {})
    data, _, _, place = session(0, **noise)
    b, keys = data["b_measured"].values, {}
    if kind == "flipped axis":
        b[:, 2] *= -1.0
    elif kind == "swapped axes":
        b[:, [0, 1]] = b[:, [1, 0]]
    elif kind == "gyro's sign":
        data["omega_measured"].values[:] *= -1.0
    elif kind == "bias taken for noise":
        b += (1500e-9, -900e-9, 2200e-9)
        keys = {"magnetometer_noise_nt": 2000.0}
    elif kind == "too fast for the cadence":
        data, _, _, place = session(0, moved=motion(CADENCE_S * np.arange(ROWS), 0, 3.0))
    return estimate_attitude(data, gyro_filter(**keys), place)


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("quiet Sun", "readings of the Sun sensors miss the expected ones"),
        ("quiet gyro", "readings of the magnetometer miss"),
        ("flipped axis", "readings are rejected"),
        ("swapped axes", "readings are rejected"),
        ("gyro's sign", "is the same from row to row"),
        ("bias taken for noise", "readings of the magnetometer miss is the same from row to row"),
        ("too fast for the cadence", "readings are rejected"),
    ],
)
def test_a_model_that_does_not_fit_states_no_accuracy(kind, reason):
    found = corrupted(kind)
    assert not found.fit.fits and found.data.attrs["fits"] == 0
    assert reason in found.verdict and "attitude to" not in found.verdict


def free_body(seed, inertia=INERTIA):
    """A free rotation at the rows: attitudes (J to body) and rates."""
    rng = np.random.default_rng(seed)
    first, rate = Rotation.random(random_state=seed), np.radians(0.5) * rng.normal(size=3)

    def slope(_, y):
        omega = y[4:]
        q = np.array([*omega, 0.0])
        turned = 0.5 * _product(y[:4], q)
        return [*turned, *np.linalg.solve(inertia, -np.cross(omega, inertia @ omega))]

    t_s = CADENCE_S * np.arange(ROWS)
    flown = solve_ivp(slope, (0.0, t_s[-1]), [*first.as_quat(), *rate], "DOP853", t_s, rtol=1e-10,
                      atol=1e-12)  # fmt: skip
    return Rotation.from_quat(flown.y[:4].T).inv(), flown.y[4:].T


def _product(a, b):
    v = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.array([*v, a[3] * b[3] - a[:3] @ b[:3]])


def dynamics_filter(inertia=INERTIA, **keys):
    usual = {
        "magnetometer_noise_nt": NOISE["b_nt"],
        "sun_noise_deg": NOISE["sun_deg"],
        "inertia_kg_m2": inertia.tolist(),
        "torque_noise_n_m_sqrt_s": 1e-5,
        "rate_sigma_deg_s": 1.0,
    }
    return KalmanDynamics(**(usual | keys))


def test_without_a_gyro_a_wrong_inertia_does_not_fit():
    data, q, _, place = session(2, slice(LIT, None), moved=free_body(2))
    found = estimate_attitude(data, dynamics_filter(), place)
    assert found.fit.fits, found.verdict
    assert angle_deg(found.data["q_smoothed"].values, q) < 0.3
    wrong = estimate_attitude(data, dynamics_filter(np.diag([1.0, 1.6, 1.7])), place)
    assert not wrong.fit.fits


def test_mistakes_are_named(tmp_path):
    data, _, _, place = session(0)
    with pytest.raises(ValueError, match=r"received 'sun' without sun_measured"):
        estimate_attitude(data.drop_vars("sun_measured"), gyro_filter(), place)
    with pytest.raises(ValueError, match=r"received 'gyro' without omega_measured"):
        estimate_attitude(data.drop_vars("omega_measured"), gyro_filter(), place)
    alone = gyro_filter(sensors=("magnetometer",), sun_noise_deg=None)
    with pytest.raises(ValueError, match=r"must be more than the magnetometer"):
        estimate_attitude(data, alone, place)
    with pytest.raises(ValueError, match=r"must hold 2 rows or more for an attitude; received 1"):
        estimate_attitude(data.isel(time=[0]), gyro_filter(), place)
    path = tmp_path / "filter.toml"
    path.write_text("[control.law]\nkind = 'off'\n")
    with pytest.raises(ValueError, match=r"filter: must hold a table \[control.estimator\]"):
        load_filter(path)
    path.write_text("[control.estimator]\nkind = 'kalman_gyro'\nsun_noise_deg = 0.1\n")
    with pytest.raises(ValueError, match=r"filter: control.estimator.*gyro_bias_sigma_deg_s"):
        load_filter(path)
