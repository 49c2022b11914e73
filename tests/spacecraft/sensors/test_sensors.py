"""Magnetometer, gyro and Sun sensors: errors of the size that was asked for, senses, limits."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats
from scipy.spatial.transform import Rotation

from torquer.base import noise
from torquer.compile.engine import kernel
from torquer.spacecraft.sensors import (
    gyro as of_gyro,
    magnetometer as of_magnetometer,
    sun_sensor as of_sun,
)
from torquer.spacecraft.sensors.gyro import Gyro, read_rate, walked_bias
from torquer.spacecraft.sensors.magnetometer import Magnetometer, read_field
from torquer.spacecraft.sensors.sun_sensor import NO_SUN_SENSORS, SunSensors, read_sun

B = (2.1e-5, -3.3e-5, 1.7e-5)
OFF = (0.0, 0.0, 0.0)
OMEGA = (0.01, -0.02, 0.03)
SUN = (0.6, 0.0, 0.8)
N = 40_000
MANY = settings(max_examples=60, deadline=None)


@kernel
def fields(magnetometer, b, seed, out):
    for i in range(out.shape[0]):
        drawn = noise.draw(magnetometer.noise_t, seed, of_magnetometer.STREAM, i)
        out[i, 0], out[i, 1], out[i, 2] = read_field(magnetometer, b, (0.0, 0.0, 0.0), drawn)


@kernel
def rates(gyro, omega, interval, seed, drifts, out):
    drift = (0.0, 0.0, 0.0)
    for i in range(out.shape[0]):
        walk = noise.draw(gyro.drift_rad_s_sqrt_s, seed, of_gyro.DRIFT_STREAM, i)
        drift = walked_bias(gyro, drift, interval, walk)
        drifts[i, 0], drifts[i, 1], drifts[i, 2] = drift
        drawn = noise.draw(gyro.noise_rad_s, seed, of_gyro.NOISE_STREAM, i)
        out[i, 0], out[i, 1], out[i, 2] = read_rate(gyro, omega, drift, drawn)


@kernel
def suns(sensors, sun, seed, out):
    for i in range(out.shape[0]):
        drawn = noise.draw(sensors.noise_rad, seed, of_sun.STREAM, i)
        out[i, 0], out[i, 1], out[i, 2] = read_sun(sensors, sun, 1.0, OFF, drawn)


def many_fields(seed=1, **keys):
    out = np.empty((N, 3))
    fields(Magnetometer(**keys).pack(), B, seed, out)
    return out


def many_rates(seed=1, interval=1.0, **keys):
    drifts, out = np.empty((N, 3)), np.empty((N, 3))
    rates(Gyro(**keys).pack(), OMEGA, interval, seed, drifts, out)
    return drifts, out


def field(b=B, dipole=OFF, sample=0, **keys):
    packed = Magnetometer(**keys).pack()
    drawn = noise.draw(packed.noise_t, 1, of_magnetometer.STREAM, sample)
    return read_field(packed, b, dipole, drawn)


def rate(omega=OMEGA, drift=OFF, **keys):
    packed = Gyro(**keys).pack()
    drawn = noise.draw(packed.noise_rad_s, 1, of_gyro.NOISE_STREAM, 0)
    return read_rate(packed, omega, drift, drawn)


def test_ideal_sensors_read_the_truth():
    assert field() == B
    assert rate() == pytest.approx(OMEGA, abs=1e-18)
    assert field(dipole=(1.0, 2.0, 3.0)) == B
    sensors = SunSensors(axes=((0.0, 0.0, 1.0),), half_field_deg=60.0).pack()
    assert read_sun(sensors, SUN, 1.0, OFF, OFF) == SUN


def test_magnetometer_noise_is_white_and_of_the_requested_size():
    error = (many_fields(noise_nt=150.0) - B) * 1e9
    for axis in range(3):
        assert stats.kstest(error[:, axis] / 150.0, "norm").pvalue > 1e-3
    assert error.std(axis=0) == pytest.approx([150.0] * 3, rel=0.02)
    between = np.corrcoef(np.hstack([error[1:], error[:-1]]).T) - np.eye(6)
    assert np.abs(between).max() < 5.0 / np.sqrt(N)


def test_noise_depends_on_the_seed_and_the_sensor():
    one, other = many_fields(seed=1, noise_nt=1.0), many_fields(seed=2, noise_nt=1.0)
    _, gyro = many_rates(seed=1, noise_deg_s=1.0)
    a, b, c = ((x - x.mean(axis=0)) / x.std(axis=0) for x in (one, other, gyro))
    for x, y in ((a, b), (a, c)):
        assert abs(np.mean(x * y)) < 5.0 / np.sqrt(3 * N)


def test_bias_scale_and_coil_disturbance():
    assert field(bias_nt=(100.0, -200.0, 300.0)) == pytest.approx(
        np.add(B, [1e-7, -2e-7, 3e-7]), abs=1e-19
    )
    assert field(scale_error=(0.01, -0.02, 0.5)) == pytest.approx(
        np.multiply(B, [1.01, 0.98, 1.5]), abs=1e-19
    )
    dipole = (1.0, -2.0, 0.5)
    assert field(dipole=dipole, coil_disturbance_nt_per_a_m2=250.0) == pytest.approx(
        np.add(B, 250e-9 * np.array(dipole)), abs=1e-19
    )
    assert rate(bias_deg_s=(0.1, 0.2, -0.3), drift=(1e-4, 0.0, -1e-4)) == pytest.approx(
        np.array([1e-4, 0.0, -1e-4]) + OMEGA + np.radians([0.1, 0.2, -0.3]), abs=1e-17
    )
    grown = np.multiply(OMEGA, [1.01, 0.98, 1.5])
    assert rate(scale_error=(0.01, -0.02, 0.5)) == pytest.approx(grown)


@pytest.mark.parametrize("read", [field, rate])
def test_misalignment_turns_the_sensor_in_the_body(read):
    """A sensor turned by +5 deg about z sees a vector along x turned by -5 deg."""
    c, s = np.cos(np.radians(5.0)), np.sin(np.radians(5.0))
    seen = read((1e-5, 0.0, 0.0), misalignment_deg=(0.0, 0.0, 5.0))
    assert seen == pytest.approx((1e-5 * c, -1e-5 * s, 0.0), abs=1e-19)
    turn = np.array([3.0, -8.0, 5.0])
    seen = read(B, misalignment_deg=tuple(turn), scale_error=(0.1, 0.0, -0.1))
    axes = Rotation.from_rotvec(np.radians(turn)).as_matrix()  # columns: the sensor's axes
    assert seen == pytest.approx(np.array([1.1, 1.0, 0.9]) * (axes.T @ B), abs=1e-18)


units = st.floats(-3.0, 3.0)


@MANY
@given(b=st.tuples(units, units, units), limit=st.floats(0.05, 4.0), step=st.floats(1e-3, 2.0))
def test_readings_are_steps_within_the_range(b, limit, step):
    """Every reading is the nearest step, or the end of the range; never beyond it."""
    true = 1e-5 * np.array(b)
    keys = {"range_nt": 1e4 * limit, "resolution_nt": 1e4 * step}
    for seen in (
        np.array(field(tuple(true), **keys)) * 1e5,
        np.degrees(rate(tuple(np.radians(b)), range_deg_s=limit, resolution_deg_s=step)),
    ):
        assert np.all(np.abs(seen) <= limit * (1.0 + 1e-12))
        inside = np.abs(seen) < limit * (1.0 - 1e-12)
        steps = seen / step
        assert steps[inside] == pytest.approx(np.round(steps[inside]), abs=1e-9)
        assert np.all(np.abs(seen - b)[inside] <= 0.5 * step * (1.0 + 1e-9))
        assert np.all(np.abs(b)[~inside] >= limit - 0.5 * step * (1.0 + 1e-9) - 1e-12)


def test_a_range_clips_each_axis_alone():
    assert field(range_nt=2e4) == pytest.approx((2e-5, -2e-5, 1.7e-5), abs=1e-19)
    assert rate(range_deg_s=1.0) == pytest.approx(
        (0.01, -np.radians(1.0), np.radians(1.0)), abs=1e-17
    )


def test_quantisation_noise_is_that_of_a_uniform_error():
    error = (many_fields(noise_nt=500.0, resolution_nt=100.0) - B) * 1e9
    assert error.var(axis=0) == pytest.approx([500.0**2 + 100.0**2 / 12.0] * 3, rel=0.04)
    assert error.mean(axis=0) == pytest.approx(np.zeros(3), abs=4.0 * 500.0 / np.sqrt(N))


def test_noise_of_the_gyro_is_of_the_size_asked_for():
    _, readings = many_rates(noise_deg_s=0.03)
    error = np.degrees(readings - OMEGA)
    assert error.std(axis=0) == pytest.approx([0.03] * 3, rel=0.02)
    assert stats.kstest(error[:, 1] / 0.03, "norm").pvalue > 1e-3


def test_the_finest_resolution_leaves_a_reading_as_it_is():
    """Steps of 1e-15 deg/s: those of a fast rate are more than 64 bits can count."""
    fine = {"range_deg_s": 1e6, "resolution_deg_s": 1e-15}
    assert rate((0.1, -0.05, 0.02), **fine) == pytest.approx((0.1, -0.05, 0.02), rel=1e-14)
    assert rate((1e4, -2e3, 5e2), **fine) == pytest.approx((1e4, -2e3, 5e2), rel=1e-14)


@pytest.mark.parametrize("interval", [0.25, 4.0])
def test_gyro_drift_is_a_random_walk_of_the_requested_size(interval):
    """Standard deviation after t seconds: drift sqrt(t), whatever the sampling interval."""
    per_root_second = 1e-3
    drifts, readings = many_rates(interval=interval, bias_drift_deg_s_sqrt_s=per_root_second)
    walk = np.degrees(drifts)
    assert readings - drifts == pytest.approx(np.tile(OMEGA, (N, 1)), abs=1e-15)
    steps = np.diff(walk, axis=0, prepend=0.0)
    assert steps.std(axis=0) == pytest.approx([per_root_second * np.sqrt(interval)] * 3, rel=0.02)
    between = np.corrcoef(np.hstack([steps[1:], steps[:-1]]).T) - np.eye(6)
    assert np.abs(between).max() < 5.0 / np.sqrt(N)
    ends = walk.reshape(400, 100, 3)[:, -1]
    spans = np.diff(ends, axis=0).std(axis=0)
    assert spans == pytest.approx([per_root_second * np.sqrt(100 * interval)] * 3, rel=0.15)


def test_without_drift_the_bias_stays():
    assert walked_bias(Gyro().pack(), (1.0, 2.0, 3.0), 1.0, (0.3, -0.2, 0.1)) == (1.0, 2.0, 3.0)


def looking(axis, angle_deg):
    """The direction at an angle from a sensor's axis, on some side."""
    axis = np.array(axis, dtype=float)
    side = np.cross(axis, [0.3, -0.5, 0.9])
    side /= np.linalg.norm(side)
    a = np.radians(angle_deg)
    return tuple((np.cos(a) * axis + np.sin(a) * side).tolist())


@pytest.mark.parametrize("half", [10.0, 60.0, 90.0, 120.0, 180.0])
def test_a_sun_sensor_sees_within_its_cone(half):
    axis = (0.0, 1.0, 0.0)
    sensors = SunSensors(axes=(axis,), half_field_deg=half).pack()
    inside = looking(axis, half - 1e-6)
    assert read_sun(sensors, inside, 1.0, OFF, OFF) == inside
    if half < 180.0:
        assert read_sun(sensors, looking(axis, half + 1e-6), 1.0, OFF, OFF) == OFF
    else:
        assert read_sun(sensors, (0.0, -1.0, 0.0), 1.0, OFF, OFF) == (0.0, -1.0, 0.0)


def test_two_sun_sensors_see_both_sides():
    sensors = SunSensors(axes=((0.0, 0.0, 2.0), (0.0, 0.0, -1.0)), half_field_deg=50.0).pack()
    for z in (1.0, -1.0):
        assert read_sun(sensors, (0.0, 0.0, z), 1.0, OFF, OFF) == (0.0, 0.0, z)
    assert read_sun(sensors, (1.0, 0.0, 0.0), 1.0, OFF, OFF) == OFF


def test_sun_sensors_need_half_of_the_disc_and_a_sensor():
    sensors = SunSensors(axes=((0.0, 0.0, 1.0),), half_field_deg=60.0).pack()
    for sunlit_fraction, seen in ((1.0, SUN), (0.5, SUN), (0.49, OFF), (0.0, OFF)):
        assert read_sun(sensors, SUN, sunlit_fraction, OFF, OFF) == seen
    assert read_sun(NO_SUN_SENSORS, SUN, 1.0, OFF, OFF) == OFF
    assert read_sun(NO_SUN_SENSORS, (0.0, 0.0, -1.0), 1.0, OFF, OFF) == OFF


def test_sun_sensor_noise_has_the_requested_angle_per_cross_axis():
    sensors = SunSensors(axes=((0.0, 0.0, 1.0),), half_field_deg=60.0, noise_deg=0.5).pack()
    out = np.empty((N, 3))
    suns(sensors, SUN, 3, out)
    assert np.linalg.norm(out, axis=1) == pytest.approx(np.ones(N), abs=1e-15)
    for cross in ((0.0, 1.0, 0.0), (0.8, 0.0, -0.6)):
        angles = np.degrees(np.arcsin(out @ cross))
        assert angles.std() == pytest.approx(0.5, rel=0.02)
        assert angles.mean() == pytest.approx(0.0, abs=0.01)
    mean = out.mean(axis=0)
    assert mean / np.linalg.norm(mean) == pytest.approx(SUN, abs=2e-4)


@pytest.mark.parametrize(
    ("spec", "keys", "expected"),
    [
        (Magnetometer, {"range_nt": 0.0}, "greater than 0"),
        (Magnetometer, {"noise_nt": -1.0}, "greater than or equal to 0"),
        (Magnetometer, {"resolution_nt": -1.0}, "greater than or equal to 0"),
        (Magnetometer, {"bias_nt": (0.0, 1.0)}, "bias_nt"),
        (Magnetometer, {"bias_nt": (0.0, 1.0, float("inf"))}, "must be finite"),
        (Magnetometer, {"scale_error": "some"}, "scale_error"),
        (Magnetometer, {"coil_disturbance_nt_per_a_m2": float("nan")}, "must be finite"),
        (Magnetometer, {"colour": 1}, "must be a known key"),
        (Gyro, {"range_deg_s": -1.0}, "greater than 0"),
        (Gyro, {"noise_deg_s": -1.0}, "greater than or equal to 0"),
        (Gyro, {"bias_drift_deg_s_sqrt_s": -1.0}, "greater than or equal to 0"),
        (Gyro, {"resolution_deg_s": -1.0}, "greater than or equal to 0"),
        (Gyro, {"misalignment_deg": (0.0, 0.0, float("nan"))}, "must be finite"),
        (SunSensors, {"axes": ((0.0, 0.0, 1.0),)}, "half_field_deg: must be given"),
        (SunSensors, {"half_field_deg": 60.0}, "axes: must be given"),
        (SunSensors, {"axes": ((1.0, 0.0, 0.0),), "half_field_deg": 0.0}, "greater than 0"),
        (SunSensors, {"axes": ((1.0, 0.0, 0.0),), "half_field_deg": 181.0}, "equal to 180"),
        (
            SunSensors,
            {"axes": ((0.0, 0.0, 0.0),), "half_field_deg": 60.0},
            r"axes: must be non-zero vectors of 3 numbers; received \[\[0.0, 0.0, 0.0\]\]",
        ),
        (
            SunSensors,
            {"axes": ((1.0, 0.0, 0.0),), "half_field_deg": 60.0, "noise_deg": -1.0},
            "greater than or equal to 0",
        ),
    ],
)
def test_what_cannot_be_is_reported(spec, keys, expected):
    with pytest.raises(ValueError, match=expected):
        spec(**keys)
