"""TRIAD: exact without noise, the first direction exact with it, covariance that of samples."""

import math

import numpy as np
import pytest
from filter_cases import SCENARIO
from hypothesis import given, settings, strategies as st
from law_cases import ZERO, compiled, inputs
from scipy.spatial.transform import Rotation

from torquer import simulate
from torquer.compile import engine
from torquer.computer.estimation.triad import Triad, rate_between, triad, triad_covariance
from torquer.maths.geometry.quaternion import angle_between
from torquer.scenario.load import scenario_from_data

NOISE = {"magnetometer_noise_nt": 50.0, "sun_noise_deg": 0.1}
MANY = settings(max_examples=80, deadline=None)
turns = st.integers(0, 10_000).map(lambda n: Rotation.random(random_state=n))
FIRST, SECOND = np.array([0.3, -0.5, 0.2]), np.array([-0.1, 0.7, 0.4])


def vectors(*arrays):
    return [tuple(map(float, a)) for a in arrays]


@MANY
@given(turns, st.floats(0.05, 3.0), st.floats(1e-6, 1e6))
def test_exact_readings_give_the_attitude(turn, angle, length):
    second = Rotation.from_rotvec(angle * np.array([0.0, 0.6, 0.8])).apply([length, 0.0, 0.0])
    first = np.array([1.0, 0.0, 0.0])
    q = triad(*vectors(turn.inv().apply(first), turn.inv().apply(second), first, second))
    assert angle_between(np.array(q), turn.as_quat()) < 1e-13 / math.sin(angle)


@MANY
@given(turns, st.integers(0, 1000))
def test_the_first_direction_is_reproduced_whatever_the_second_says(turn, seed):
    wrong = np.random.default_rng(seed).normal(size=3)
    q = triad(*vectors(turn.inv().apply(FIRST), wrong, FIRST, SECOND))
    assert Rotation.from_quat(q).apply(turn.inv().apply(FIRST)) == pytest.approx(FIRST, abs=1e-14)
    across = np.cross(FIRST, SECOND)
    assert Rotation.from_quat(q).apply(wrong) @ across == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize(("sigma_1", "sigma_2"), [(1e-3, 4e-3), (4e-3, 1e-3)])
def test_covariance_is_that_of_samples(sigma_1, sigma_2):
    """20 000 samples: variances to 1 %, 3 sigma of theirs."""
    rng, count = np.random.default_rng(5), 20_000
    first, second = FIRST / np.linalg.norm(FIRST), SECOND / np.linalg.norm(SECOND)
    turn = Rotation.random(random_state=1)
    in_body = turn.inv().apply([first, second])
    errors = np.empty((count, 3))
    for k in range(count):
        read = in_body + np.array([[sigma_1], [sigma_2]]) * rng.normal(size=(2, 3))
        q = triad(*vectors(*read, first, second))
        errors[k] = (Rotation.from_quat(q).inv() * turn).as_rotvec()
    expected = np.array(triad_covariance(*vectors(*in_body), sigma_1**2, sigma_2**2))
    root = np.linalg.cholesky(np.linalg.inv(expected))
    assert np.cov((errors @ root).T) == pytest.approx(np.eye(3), abs=0.03)


def best_covariance(body, variances):
    """Of the attitude that fits directions with these variances best (Wahba's problem)."""
    across = np.eye(3) - np.einsum("ki,kj->kij", body, body)
    return np.linalg.inv(np.einsum("k,kij->ij", 1.0 / np.array(variances), across))


@MANY
@given(st.integers(0, 10_000), st.floats(0.1, 10.0))
def test_no_better_than_the_best_attitude(seed, ratio):
    """In any direction; and equal where the first direction is far more accurate."""
    body = np.random.default_rng(seed).normal(size=(2, 3))
    body /= np.linalg.norm(body, axis=1)[:, None]
    first, second = vectors(*body)
    best = best_covariance(body, [1.0, ratio])
    worse = np.array(triad_covariance(first, second, 1.0, ratio)) - best
    size, square = np.abs(best).max(), np.linalg.norm(np.cross(*body)) ** 2
    assert np.linalg.eigvalsh(worse)[0] > -1e-9 * size / square
    # variances of 1e-8 to 1: they part, and the information matrix loses digits, by 1e-8 over the
    # square of the sine between the directions
    best = best_covariance(body, [1e-8, 1.0])
    tolerance = 1e-7 * np.abs(best).max() / square
    assert np.array(triad_covariance(first, second, 1e-8, 1.0)) == pytest.approx(
        best, rel=0.0, abs=tolerance
    )


@MANY
@given(turns, st.floats(1e-9, 3.1), st.floats(0.1, 10.0))
def test_the_rate_between_two_attitudes_is_the_constant_one(turn, angle, dt):
    omega = np.array([0.6, -0.48, 0.64]) * angle / dt
    after = turn * Rotation.from_rotvec(omega * dt)
    found = rate_between(tuple(turn.as_quat()), tuple(after.as_quat()), dt)
    assert found == pytest.approx(omega, rel=1e-6, abs=1e-15 / dt)


class Estimating:
    """The estimator, reading by reading, on a body that turns steadily."""

    omega = np.array([0.02, -0.01, 0.015])
    b, sun = np.array([2e-5, -1e-5, 3e-5]), np.array([0.6, 0.0, 0.8])

    def __init__(self, **keys):
        estimator = Triad(**NOISE, **keys).estimator()
        self.function, self.packed = compiled(estimator), estimator.pack()
        self.cells = estimator.first_memory()

    def attitude(self, t_s):
        return Rotation.from_rotvec(self.omega * t_s)

    def __call__(self, t_s, read_s=None, sunlit_fraction=True, sun_s=None):
        read_s = t_s if read_s is None else read_s
        turn = self.attitude(read_s).inv()
        sun = turn.apply(self.sun) if sunlit_fraction else ZERO
        known = inputs(
            t_s, turn.apply(self.b), omega=self.omega, sun=sun, model_b=self.b,
            model_b_rate=ZERO, model_sun=self.sun,
        )  # fmt: skip
        at = known.read_at._replace(
            magnetometer_s=float(read_s), sun_sensors_s=float(read_s if sun_s is None else sun_s)
        )
        return self.function(known._replace(read_at=at), self.packed, self.cells)


def test_attitude_and_rate_are_of_the_time_of_the_readings():
    estimating = Estimating()
    estimating(0.5, 0.0)
    found = estimating(2.5, 2.0)
    assert found.t_s == 2.0
    expected = estimating.attitude(2.0).as_quat()
    assert angle_between(np.array(found.q_body_to_inertial), expected) < 1e-14
    assert found.omega_body_rad_s == pytest.approx(estimating.omega, rel=1e-9)


def test_readings_of_different_times_make_no_attitude():
    estimating = Estimating()
    estimating(0.0)
    first = estimating(1.0)
    assert estimating(2.0, sun_s=1.0) == first  # grows old
    assert estimating(3.0).t_s == 3.0


def test_unknown_in_the_shadow_and_known_again_after():
    estimating = Estimating(rate="gyro")
    assert np.isfinite(estimating(0.0).omega_body_rad_s).all()
    dark = estimating(1.0, sunlit_fraction=False)
    assert dark.t_s == -math.inf and np.isnan(dark.q_body_to_inertial).all()
    assert np.isfinite(estimating(2.0).q_body_to_inertial).all()


def test_parallel_directions_make_no_attitude():
    estimating = Estimating()
    estimating.sun = estimating.b / np.linalg.norm(estimating.b)
    assert np.isnan(estimating(0.0).q_body_to_inertial).all()


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize("first", ["magnetometer", "sun"])
def test_errors_in_flight_have_the_stated_size(first):
    """Mean square of errors over what is stated, 1 to 10 %: 3 * 120 numbers."""
    data = SCENARIO | {"control": {"law": {"kind": "off"}}}
    data["control"]["estimator"] = {"kind": "triad", "first": first, **NOISE}
    result = simulate(scenario_from_data(data)).isel(time=slice(0, -1))
    error = angle_between(result["q_estimated"].values, result["q_body_to_inertial"].values)
    ratio = np.mean(error**2 / result["attitude_sigma"].values ** 2) / 3.0
    assert ratio == pytest.approx(1.0, abs=0.25)
