"""The measurement update against matrices; symmetry and positivity over long runs."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer.compile.engine import kernel
from torquer.computer.estimation.channels import Sensing
from torquer.computer.estimation.covariance import States, forget, state_slices, update
from torquer.computer.estimation.kalman_gyro import GyroParameters, propagate_covariance
from torquer.computer.estimation.measurements.measurement import (
    direction_measurement,
    vector_measurement,
)

MANY = settings(max_examples=60, deadline=None)
seeds = st.integers(0, 10_000)


@kernel
def take(p, gain, correction, m, gate, estimated=99):
    """An update, for the interpreter."""
    return update(p, gain, correction, m, gate, min(estimated, correction.shape[0]))


def spread(n, rng):
    """A random covariance."""
    root = rng.normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)


def matrices(m, n):
    """H and R of a measurement."""
    h = np.zeros((m.count, n))
    h[:, :3] = np.array(m.h)[: m.count]
    for at, other in zip(m.at, m.h_other, strict=True):
        if at:
            h[:, at : at + 3] = np.array(other)[: m.count]
    return h, m.r * np.eye(m.count)


def measurement(n, rng):
    v, z = (tuple(map(float, rng.normal(size=3))) for _ in range(2))
    q = tuple(map(float, Rotation.random(random_state=rng).as_quat()))
    if n == 6:
        return direction_measurement(q, v, z, 0.3)
    return vector_measurement(q, v, z, (6, 9, 12) if n == 15 else (6, 0, 0), 0.3)


@MANY
@given(seeds, st.sampled_from([6, 9, 15]))
def test_is_the_update_by_matrices(seed, n):
    rng = np.random.default_rng(seed)
    before, m = spread(n, rng), measurement(n, rng)
    p, correction = before.copy(), np.zeros(n)
    nis, accepted, white = take(p, np.zeros((3, n)), correction, m, np.inf)
    h, r = matrices(m, n)
    e, s = np.array(m.z)[: m.count], h @ before @ h.T + r
    gain = before @ h.T @ np.linalg.inv(s)
    left = np.eye(n) - gain @ h
    size = np.abs(before).max()
    assert p == pytest.approx(
        left @ before @ left.T + gain @ r @ gain.T, abs=1e-11 * size * np.linalg.cond(s)
    )
    assert correction == pytest.approx(gain @ e, abs=1e-11 * size * np.linalg.cond(s))
    assert accepted and nis == pytest.approx(e @ np.linalg.solve(s, e), rel=1e-9)
    assert nis == pytest.approx(np.sum(np.array(white) ** 2), rel=1e-9)


@MANY
@given(seeds, st.sampled_from([6, 9, 12, 15]))
def test_what_is_considered_is_neither_corrected_nor_better_known(seed, estimated):
    """A gain of zero for these errors, in Joseph's form, which holds for any gain."""
    rng = np.random.default_rng(seed)
    before, m = spread(15, rng), measurement(15, rng)
    p, correction = before.copy(), np.zeros(15)
    nis, _, _ = take(p, np.zeros((3, 15)), correction, m, np.inf, estimated)
    h, r = matrices(m, 15)
    s = h @ before @ h.T + r
    gain = before @ h.T @ np.linalg.inv(s)
    gain[estimated:] = 0.0
    left = np.eye(15) - gain @ h
    size = 1e-11 * np.abs(before).max() * np.linalg.cond(s)
    assert p == pytest.approx(left @ before @ left.T + gain @ r @ gain.T, abs=size)
    assert correction == pytest.approx(gain @ np.array(m.z), abs=size)
    assert np.array_equal(p[estimated:, estimated:], before[estimated:, estimated:])
    assert nis == pytest.approx(np.array(m.z) @ np.linalg.solve(s, m.z), rel=1e-9)


@pytest.mark.parametrize("has", list(itertools.product([False, True], repeat=8)))
def test_states_stand_one_after_another(has):
    """Those that have a variance at the start; forgetting gives them this one and nothing else."""
    prior = States(9.0, *(k + 1.0 if each else 0.0 for k, each in enumerate(has)))
    first = [3 * (1 + sum(has[:k])) if each else 0 for k, each in enumerate(has)]
    assert state_slices(prior) == (0, *first)
    n = 3 * (1 + sum(has))
    p, states = spread(n, np.random.default_rng(1)), np.ones(n - 3)
    expected = np.diag(np.repeat([v for v in prior if v], 3))
    expected[:3, :3] = p[:3, :3]
    forget(prior, states, p)
    assert np.array_equal(p, expected) and not states.any()


@MANY
@given(seeds, st.sampled_from([6, 9, 15]))
def test_what_the_gate_refuses_changes_nothing(seed, n):
    rng = np.random.default_rng(seed)
    before, m = spread(n, rng), measurement(n, rng)
    for factor, accepted in ((1.001, True), (0.999, False)):
        p, correction = before.copy(), np.ones(n)
        nis = take(p.copy(), np.zeros((3, n)), correction.copy(), m, np.inf)[0]
        assert take(p, np.zeros((3, n)), correction, m, factor * nis)[1] == accepted
        assert np.array_equal(p, before) != accepted
        assert np.array_equal(correction, np.zeros(n)) != accepted


@MANY
@given(seeds)
def test_a_direction_tells_what_a_vector_tells(seed):
    """The component along the prediction brings nothing: two do what three do."""
    rng = np.random.default_rng(seed)
    before = spread(6, rng)
    v, z = rng.normal(size=(2, 3))
    p, correction = before.copy(), np.zeros(6)
    m = direction_measurement((0.0, 0.0, 0.0, 1.0), tuple(v), tuple(z), 0.3)
    take(p, np.zeros((3, 6)), correction, m, np.inf)
    h = np.hstack([np.cross(np.eye(3), v), np.zeros((3, 3))])
    gain = before @ h.T @ np.linalg.inv(h @ before @ h.T + 0.3 * np.eye(3))
    size = 1e-11 * np.abs(before).max()
    assert p == pytest.approx(before - gain @ h @ before, abs=10 * size)
    assert correction == pytest.approx(gain @ (z - v), abs=10 * size)


def gyro(white, walk, scale=0.0, misalignment=0.0):
    """Parameters of a filter with a gyro."""
    prior = States(1.0, gyro_bias=1.0, gyro_scale=scale, gyro_misalignment=misalignment)
    return GyroParameters(white, walk, prior, Sensing(*[1.0] * len(Sensing._fields)))


@kernel
def turned(parameters, p, omega, dt):
    """A covariance after a turn by a constant rate, for the interpreter."""
    turn = (omega[0] * dt, omega[1] * dt, omega[2] * dt)
    propagate_covariance(parameters, p, omega, turn, dt)


@MANY
@given(seeds, st.booleans(), st.booleans())
def test_errors_of_the_gyro_move_the_attitude(seed, has_scale, has_misalignment):
    """d a/dt = -omega x a - bias - diag(omega) k - omega x d, integrated in small steps."""
    rng = np.random.default_rng(seed)
    parameters = gyro(1e-6, 1e-9, float(has_scale), float(has_misalignment))
    n = 6 + 3 * has_scale + 3 * has_misalignment
    before, omega = 1e-4 * spread(n, rng), 0.1 * rng.normal(size=3)
    p, expected, small = before.copy(), before.copy(), 1e-4
    f = np.zeros((n, n))
    f[:3, :3], f[:3, 3:6] = -skew_of(omega), -np.eye(3)
    if has_scale:
        f[:3, 6:9] = -np.diag(omega)
    if has_misalignment:
        f[:3, n - 3 :] = -skew_of(omega)
    q = np.diag([1e-6] * 3 + [1e-9] * 3 + [0.0] * (n - 6))
    step = np.eye(n) + small * f + 0.5 * small**2 * f @ f
    for _ in range(1000):
        expected = step @ expected @ step.T + small * q
    turned(parameters, p, tuple(omega), 0.1)
    assert p == pytest.approx(expected, rel=1e-4, abs=1e-4 * np.abs(expected).max())
    assert np.array_equal(p, p.T)
    assert np.linalg.eigvalsh(p)[0] > 0.0


def skew_of(v):
    """The matrix of v x."""
    return np.cross(v, np.eye(3)).T


@kernel
def many(parameters, p, gain, correction, directions, sigma, turn):
    """Readings of directions, one a second."""
    for k in range(directions.shape[0]):
        propagate_covariance(parameters, p, turn, turn, 1.0)
        v = (directions[k, 0], directions[k, 1], directions[k, 2])
        m = direction_measurement((0.0, 0.0, 0.0, 1.0), v, v, sigma * sigma)
        update(p, gain, correction, m, 9.0, 6)


def by_joseph(p, directions, sigma, turn, white, walk):
    """The same by Joseph's form in long double."""
    r, q = np.eye(6), np.diag([white + walk / 3.0] * 3 + [walk] * 3)
    r[:3, :3] = Rotation.from_rotvec(turn).as_matrix().T
    r[:3, 3:] = -np.eye(3) + 0.5 * np.cross(np.eye(3), turn)
    q[:3, 3:] = q[3:, :3] = -0.5 * walk * np.eye(3)
    p, r, variance = np.longdouble(p), np.longdouble(r), np.longdouble(sigma) ** 2
    for v in np.longdouble(directions):
        p = r @ p @ r.T + q
        for h in np.hstack([np.cross(np.eye(3), v), np.zeros((3, 3))]):
            gain = p @ h / (h @ p @ h + variance)
            left = np.eye(6) - np.outer(gain, h)
            p = left @ p @ left.T + np.outer(gain, gain) * variance
    return np.float64(p)


@pytest.mark.parametrize(
    ("sigma", "white", "walk"), [(1e-3, 3e-8, 3e-12), (1e-2, 1e-18, 1e-24), (1e-6, 1e-18, 1e-24)]
)
def test_the_plain_form_keeps_the_covariance_symmetric_positive_and_right(sigma, white, walk):
    """Chibis-M's sensors; and gyros with next to no noise, whose bias is found to 14 decades."""
    rng, n, turn = np.random.default_rng(1), 6, (0.01, -0.02, 0.005)
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    first = np.diag([3.0] * 3 + [1e-4] * 3)
    p = first.copy()
    many(gyro(white, walk), p, np.zeros((3, n)), np.zeros(n), directions, sigma, turn)
    expected = by_joseph(first, directions, sigma, turn, white, walk)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.array_equal(p, p.T) and np.linalg.eigvalsh(p / scale)[0] > 0.0
    assert p / scale == pytest.approx(expected / scale, abs=1e-6)
