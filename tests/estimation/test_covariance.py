"""The measurement update against matrices; symmetry and positivity over long runs."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer.compile.engine import kernel
from torquer.estimation.covariance import States, forget, slices_of, update
from torquer.estimation.kalman_gyro import propagate_covariance
from torquer.estimation.measurements.measurement import biased_measurement, direction_measurement

MANY = settings(max_examples=60, deadline=None)
seeds = st.integers(0, 10_000)


@kernel
def take(p, gain, correction, m, gate):
    """An update, for the interpreter."""
    return update(p, gain, correction, m, gate)


def spread(n, rng):
    """A random covariance."""
    root = rng.normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)


def matrices(m, n):
    """H and R of a measurement."""
    h = np.zeros((m.count, n))
    h[:, :3] = np.array(m.h)[: m.count]
    if m.at:
        h[:, m.at : m.at + 3] = np.array(m.h_other)[: m.count]
    return h, m.r * np.eye(m.count)


def measurement(n, rng):
    v, z = (tuple(map(float, rng.normal(size=3))) for _ in range(2))
    q = tuple(map(float, Rotation.random(random_state=rng).as_quat()))
    if n == 6:
        return direction_measurement(q, v, z, 0.3)
    return biased_measurement(q, v, z, 6, 0.3)


@MANY
@given(seeds, st.sampled_from([6, 9]))
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


@pytest.mark.parametrize("has", list(itertools.product([False, True], repeat=4)))
def test_states_stand_one_after_another(has):
    """Those that have a variance at the start; forgetting gives them this one and nothing else."""
    prior = States(9.0, *(k + 1.0 if each else 0.0 for k, each in enumerate(has)))
    first = [3 * (1 + sum(has[:k])) if each else 0 for k, each in enumerate(has)]
    assert slices_of(prior) == (0, *first)
    n = 3 * (1 + sum(has))
    p, states = spread(n, np.random.default_rng(1)), np.ones(n - 3)
    expected = np.diag(np.repeat([v for v in prior if v], 3))
    expected[:3, :3] = p[:3, :3]
    forget(prior, states, p)
    assert np.array_equal(p, expected) and not states.any()


@MANY
@given(seeds, st.sampled_from([6, 9]))
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


@kernel
def many(p, gain, correction, directions, sigma, turn, white, walk):
    """Readings of directions, one a second."""
    for k in range(directions.shape[0]):
        propagate_covariance(p, turn, 1.0, white, walk)
        v = (directions[k, 0], directions[k, 1], directions[k, 2])
        m = direction_measurement((0.0, 0.0, 0.0, 1.0), v, v, sigma * sigma)
        update(p, gain, correction, m, 9.0)


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
    many(p, np.zeros((3, n)), np.zeros(n), directions, sigma, turn, white, walk)
    expected = by_joseph(first, directions, sigma, turn, white, walk)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.array_equal(p, p.T) and np.linalg.eigvalsh(p / scale)[0] > 0.0
    assert p / scale == pytest.approx(expected / scale, abs=1e-6)
