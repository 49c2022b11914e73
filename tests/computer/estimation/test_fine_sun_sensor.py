"""The fine Sun sensor as filters take it: Jacobian, sense, late readings, the direction read."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats
from scipy.spatial.transform import Rotation

from torquer.compile.engine import kernel
from torquer.compile.when_compiling import plainly
from torquer.computer.estimation.covariance import update
from torquer.computer.estimation.measurements.fine_sun_sensor import (
    frame_then,
    has_tangents,
    measure_tangents,
    sun_by_tangents,
)
from torquer.computer.estimation.measurements.measurement import (
    NO_MEASUREMENT,
    direction_measurement,
)
from torquer.maths.geometry.quaternion import from_rotation_vector, multiply, rotate, rotate_inverse
from torquer.spacecraft.sensors.fine_sun_sensor import FineSunSensor, read_tangents

OFF = (0.0, 0.0, 0.0)
MANY = settings(max_examples=100, deadline=None)
SPEC = FineSunSensor(boresight=(1.0, -2.0, 0.5), up=(0.3, 0.2, 1.0), half_field_deg=64.0)
FRAME = SPEC.frame()
seeds = st.integers(0, 100_000)
tangents = st.floats(-2.0, 2.0)


def attitude(seed):
    return tuple(Rotation.random(random_state=seed).as_quat().tolist())


def sun_at(q, a, b):
    """Direction to the Sun (inertial) whose tangents at an attitude are these."""
    body = np.array([a, b, 1.0]) @ np.array(FRAME)
    return rotate(q, tuple((body / np.linalg.norm(body)).tolist()))


def turned(q, error):
    """The true attitude of an estimated one, by the error that filters have as a state."""
    return multiply(q, from_rotation_vector(tuple(map(float, error))))


def reading_at(q, sun_inertial, drawn=OFF, spec=SPEC):
    return read_tangents(spec.pack(), rotate_inverse(q, sun_inertial), 1.0, drawn)


@MANY
@given(seeds, tangents, tangents)
def test_the_matrix_is_the_slope_of_the_readings(seed, a, b):
    """Central differences of the sensor's own kernel; what is predicted has no residual."""
    q = attitude(seed)
    sun, h = sun_at(q, a, b), 1e-5
    m = measure_tangents(q, sun, FRAME, reading_at(q, sun), 1e-6)
    assert (m.count, m.r, m.since) == (2, 1e-6, 0.0) and m.z == pytest.approx(OFF, abs=1e-13)
    slopes = [
        np.subtract(reading_at(turned(q, h * e), sun), reading_at(turned(q, -h * e), sun)) / (2 * h)
        for e in np.eye(3)
    ]
    assert np.array(m.h)[:2] == pytest.approx(np.column_stack(slopes)[:2], abs=1e-7)
    assert m.h[2] == OFF


@MANY
@given(seeds, tangents, tangents)
def test_a_turn_about_the_sun_is_not_seen(seed, a, b):
    """The two rows are across the Sun's direction and independent."""
    q = attitude(seed)
    sun = sun_at(q, a, b)
    m = measure_tangents(q, sun, FRAME, (a, b, 1.0), 1e-6)
    rows, body = np.array(m.h)[:2], rotate_inverse(q, sun)
    assert rows @ body == pytest.approx(np.zeros(2), abs=1e-13)
    # area of tangents per solid angle: 1/cos^3
    across = np.linalg.norm(np.cross(rows[0], rows[1]))
    assert across == pytest.approx((1.0 + a * a + b * b) ** 1.5, rel=1e-12)


@MANY
@given(seeds, tangents, tangents, st.tuples(*[st.floats(-1e-4, 1e-4)] * 3))
def test_the_residual_is_the_error_of_the_estimate(seed, a, b, error):
    q = attitude(seed)
    sun = sun_at(turned(q, error), a, b)
    m = measure_tangents(q, sun, FRAME, (a, b, 1.0), 1e-6)
    assert m.z[:2] == pytest.approx((np.array(m.h) @ error)[:2], abs=4e-6)
    assert m.z[2] == 0.0 and m.reference == sun
    truth = rotate_inverse(turned(q, error), sun)
    assert m.read == pytest.approx(truth, abs=1e-13)


@MANY
@given(seeds, tangents, tangents)
def test_it_tells_what_a_direction_with_this_noise_tells(seed, a, b):
    """Information H^T H / r of a direction whose covariance is that of the tangents read."""
    q = attitude(seed)
    sun = sun_at(q, a, b)
    m = measure_tangents(q, sun, FRAME, (a, b, 1.0), 1.0)
    d = direction_measurement(q, sun, m.read, 1.0)
    step, across = 1e-6, np.array(d.h)[:2]
    # slopes of the direction's components by the tangents read
    slopes = []
    for da, db in ((step, 0.0), (0.0, step)):
        there, back = (sun_by_tangents(FRAME, (a + s * da, b + s * db, 1.0)) for s in (1.0, -1.0))
        z = [np.array(direction_measurement(q, sun, s, 1.0).z)[:2] for s in (there, back)]
        slopes.append((z[0] - z[1]) / (2.0 * step))
    noise = np.column_stack(slopes)
    expected = across.T @ np.linalg.solve(noise @ noise.T, across)
    rows = np.array(m.h)[:2]
    assert rows.T @ rows == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


@MANY
@given(seeds, tangents, tangents)
def test_the_vector_of_a_reading_is_the_direction_to_the_sun(seed, a, b):
    q = attitude(seed)
    sun = sun_at(q, a, b)
    found = sun_by_tangents(FRAME, reading_at(q, sun))
    assert found == pytest.approx(rotate_inverse(q, sun), abs=1e-14)
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(
    "reading",
    [
        OFF,
        (0.1, 0.2, 0.0),
        (math.nan, 0.2, 1.0),
        (0.1, math.nan, 1.0),
        (0.1, 0.2, math.nan),
        (math.inf, 0.2, 1.0),
        (-math.inf, 0.2, 1.0),
        (0.1, -math.inf, 1.0),
        (math.inf, math.inf, math.inf),
        (math.nan, math.nan, math.nan),
    ],
)
def test_what_is_no_reading_of_the_sun_is_no_measurement(reading):
    q = attitude(1)
    assert not has_tangents(reading) and sun_by_tangents(FRAME, reading) == OFF
    assert measure_tangents(q, sun_at(q, 0.1, 0.2), FRAME, reading, 1.0) == NO_MEASUREMENT


@MANY
@given(seeds, tangents, tangents, st.floats(-0.99, 0.09))
def test_a_sun_predicted_behind_the_head_counts_as_a_direction(seed, a, b, along):
    """Tangents of what is beside or behind the head are of no use: no number may be infinite."""
    q = attitude(seed)
    body = np.array([math.sqrt(1.0 - along**2), 0.0, along]) @ np.array(FRAME)
    sun = rotate(q, tuple(body.tolist()))
    m = measure_tangents(q, sun, FRAME, (a, b, 1.0), 1e-6)
    assert m == direction_measurement(q, sun, sun_by_tangents(FRAME, (a, b, 1.0)), 1e-6)
    assert np.isfinite(np.array(m.h)).all()


@MANY
@given(seeds, tangents, tangents, st.tuples(*[st.floats(-0.05, 0.05)] * 3), st.floats(0.0, 5.0))
def test_a_late_reading_is_one_by_the_head_as_it_was(seed, a, b, omega, age):
    """The body turns on with a steady rate after the reading; the estimate of now is right."""
    then = attitude(seed)
    now = turned(then, age * np.array(omega))
    frame = frame_then(FRAME, omega, age)
    sun = sun_at(then, a, b)
    m = measure_tangents(now, sun, frame, (a, b, 1.0), 1e-6)
    assert m.count == 2 and m.z == pytest.approx(OFF, abs=1e-12)
    assert m.read == pytest.approx(rotate_inverse(now, sun), abs=1e-13)
    if age == 0.0:
        assert frame == FRAME


@kernel
def take(p, gain, correction, m):
    """An update of a filter, for the interpreter."""
    return update(p, gain, correction, m, math.inf, 6)


def test_updates_of_a_filter_are_consistent():
    """Noise of the sensor, prior errors of their covariance: innovations and errors of their size.

    Each sum is chi-square distributed; a right measurement fails with a chance of 4e-7.
    """
    spec = SPEC.model_copy(update={"noise_deg": 0.05})
    rng, count, sigma = np.random.default_rng(6), 1500, 0.002
    variance, squares, innovations = math.radians(0.05) ** 2, [], []
    for _ in range(count):
        q, error = attitude(int(rng.integers(1e6))), sigma * rng.normal(size=3)
        truth = turned(q, error)
        sun = sun_at(truth, *rng.uniform(-1.7, 1.7, size=2))
        drawn = tuple(rng.normal(size=3).tolist())
        m = measure_tangents(q, sun, FRAME, reading_at(truth, sun, drawn, spec), variance)
        p, correction = np.diag([sigma**2] * 3 + [1.0] * 3), np.zeros(6)
        nis, _, _ = take(p, np.zeros((3, 6)), correction, m)
        left = error - correction[:3]
        squares.append(left @ np.linalg.solve(p[:3, :3], left))
        innovations.append(nis)
    for sums, dof in ((squares, 3 * count), (innovations, 2 * count)):
        low, high = stats.chi2.ppf([1e-7, 1.0 - 1e-7], dof)
        assert low < np.sum(sums) < high


def test_compiled_and_plain_code_agree():
    q, omega = attitude(5), (0.01, -0.02, 0.03)
    given_ = q, sun_at(q, 0.3, -0.5), FRAME, (0.31, -0.52, 1.0), 1e-6
    compiled = measure_tangents(*given_), frame_then(FRAME, omega, 2.0)
    with plainly():
        plain = measure_tangents(*given_), frame_then(FRAME, omega, 2.0)
    assert compiled[0].count == 2
    for one, other in zip((*compiled[0], compiled[1]), (*plain[0], plain[1]), strict=True):
        assert np.ravel(one) == pytest.approx(np.ravel(other), rel=1e-13, abs=1e-15)
