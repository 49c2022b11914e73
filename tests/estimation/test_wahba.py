"""Wahba's problem: Davenport's q, QUEST and scipy agree; TRIAD is no better; the covariance."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer.estimation.triad import triad_covariance
from torquer.estimation.wahba import davenport_q, quest, wahba_covariance
from torquer.geometry.quaternion import angle_between

MANY = settings(max_examples=60, deadline=None)


def directions(seed, count, noise):
    rng = np.random.default_rng(seed)
    inertial = rng.normal(size=(count, 3))
    inertial /= np.linalg.norm(inertial, axis=1)[:, None]
    turn = Rotation.random(random_state=seed)
    body = turn.inv().apply(inertial) + noise * rng.normal(size=(count, 3))
    return (
        turn,
        body / np.linalg.norm(body, axis=1)[:, None],
        inertial,
        rng.uniform(1.0, 5.0, count),
    )


@MANY
@given(st.integers(0, 10_000), st.integers(2, 6))
def test_the_best_attitude_is_that_of_scipy(seed, count):
    _, body, inertial, weights = directions(seed, count, 0.01)
    expected, _ = Rotation.align_vectors(inertial, body, weights)
    for method in (davenport_q, quest):
        found = method(body, inertial, weights)
        assert angle_between(found, expected.as_quat()) < 1e-6


@MANY
@given(st.integers(0, 10_000))
def test_exact_directions_give_the_attitude(seed):
    turn, body, inertial, weights = directions(seed, 3, 0.0)
    assert angle_between(davenport_q(body, inertial, weights), turn.as_quat()) < 1e-7


@MANY
@given(st.integers(0, 10_000), st.floats(0.1, 10.0))
def test_triad_is_no_better_than_the_best(seed, ratio):
    """In any direction; and equal where the first direction is far more accurate."""
    _, body, _, _ = directions(seed, 2, 0.0)
    first, second = (tuple(map(float, v)) for v in body)
    best = wahba_covariance(body, [1.0, ratio])
    worse = np.array(triad_covariance(first, second, 1.0, ratio)) - best
    size, square = np.abs(best).max(), np.linalg.norm(np.cross(*body)) ** 2
    assert np.linalg.eigvalsh(worse)[0] > -1e-9 * size / square
    # variances of 1e-8 to 1: they part, and the information matrix loses digits, by 1e-8 over the
    # square of the sine between the directions
    best = wahba_covariance(body, [1e-8, 1.0])
    tolerance = 1e-7 * np.abs(best).max() / square
    assert np.array(triad_covariance(first, second, 1e-8, 1.0)) == pytest.approx(
        best, rel=0.0, abs=tolerance
    )
