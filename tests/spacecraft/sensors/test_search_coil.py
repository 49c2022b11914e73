"""Search coil: errors of the size that was asked for, and the rate of the field as it is."""

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from torquer.base import noise
from torquer.compile.engine import kernel
from torquer.maths.geometry.motion import Motion
from torquer.spacecraft.sensors import search_coil as of_coil
from torquer.spacecraft.sensors.search_coil import (
    IDEAL_SEARCH_COIL,
    SearchCoil,
    rate_in_body,
    read_field_rate,
)
from torquer.spacecraft.sensors.sensing import mounting_matrix

RATE = (3.1e-7, -2.2e-7, 0.9e-7)
N = 40_000


@kernel
def readings(coil, rate, seed, out):
    for i in range(out.shape[0]):
        drawn = noise.draw(coil.noise_t_s, seed, of_coil.STREAM, i)
        out[i, 0], out[i, 1], out[i, 2] = read_field_rate(coil, rate, drawn)


def many(seed=1, count=N, **keys):
    out = np.empty((count, 3))
    readings(SearchCoil(**keys).pack(), RATE, seed, out)
    return out


def test_one_that_is_left_out_is_the_one_without_errors():
    assert SearchCoil().pack() == IDEAL_SEARCH_COIL
    assert np.array_equal(many(count=3), [RATE] * 3)


def test_noise_is_white_normal_and_of_the_size_asked_for():
    errors = (many(noise_nt_s=40.0) - RATE) / 40e-9
    assert errors.std(axis=0) == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * N))
    assert np.abs(errors.mean(axis=0)).max() < 4.0 / np.sqrt(N)
    for axis in range(3):
        assert stats.kstest(errors[:, axis], "norm").pvalue > 1e-4
        for lag in (1, 2, 7):
            together = np.mean(errors[lag:, axis] * errors[:-lag, axis])
            assert abs(together) < 4.0 / np.sqrt(N)
    assert np.abs(np.corrcoef(errors.T) - np.eye(3)).max() < 4.0 / np.sqrt(N)


def test_errors_come_in_their_order():
    """Mounting and scale act on the field's rate, the bias is the electronics', then the steps."""
    keys = {"scale_error": [0.02, -0.01, 0.03], "misalignment_deg": [1.0, -2.0, 0.5]}
    turn = Rotation.from_rotvec(keys["misalignment_deg"], degrees=True)
    expected = np.diag([1.02, 0.99, 1.03]) @ turn.inv().apply(RATE)
    bias = np.array([50e-9, -20e-9, 10e-9])
    found = many(count=1, bias_nt_s=[50, -20, 10], **keys)[0]
    assert found == pytest.approx(expected + bias, rel=1e-12)
    assert np.array(mounting_matrix(*keys.values())) @ RATE == pytest.approx(expected, rel=1e-12)
    rounded = many(count=1, bias_nt_s=[50, -20, 10], resolution_nt_s=30.0, **keys)[0]
    assert rounded == pytest.approx(30e-9 * np.round((expected + bias) / 30e-9), rel=1e-12)
    assert np.abs(many(count=100, noise_nt_s=5e3, range_nt_s=250.0)).max() == pytest.approx(250e-9)


def test_steps_of_readings_add_a_twelfth_of_their_square_to_the_variance():
    errors = many(noise_nt_s=40.0, resolution_nt_s=40.0) - RATE
    expected = np.sqrt(40e-9**2 * (1.0 + 1.0 / 12.0))
    assert errors.std(axis=0) == pytest.approx(expected, rel=4.0 / np.sqrt(2 * N))


def test_the_rate_in_the_body_is_that_along_the_orbit_less_omega_cross_b():
    """Against the difference of the field in the body a little before and after."""
    omega, b, b_rate = np.array([0.1, -0.2, 0.05]), np.array([2e-5, -3e-5, 1e-5]), np.array(RATE)
    attitude, half_s = Rotation.from_quat([0.1, 0.4, -0.2, 0.8]), 1e-3

    def in_body(t_s):
        return (attitude * Rotation.from_rotvec(omega * t_s)).inv().apply(b + b_rate * t_s)

    motion = Motion(tuple(attitude.as_quat()), tuple(omega))
    found = rate_in_body(motion, tuple(b), tuple(b_rate))
    expected = (in_body(half_s) - in_body(-half_s)) / (2.0 * half_s)
    assert found == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())
