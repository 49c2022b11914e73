"""Arrays of attitudes: as SciPy's rotations have them, to rounding."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation, Slerp

from torquer.maths.geometry import quaternion
from torquer.maths.geometry.attitudes import (
    dcm_body_to_reference,
    interpolate,
    inverse,
    rotation_vector,
    to_body,
    to_reference,
)

SEEDS = st.integers(0, 2**32 - 1)


def drawn(seed, n=7):
    """Random attitudes (n, 4) and vectors (n, 3) of length one."""
    random = np.random.default_rng(seed)
    q, v = random.normal(size=(n, 4)), random.normal(size=(n, 3))
    return (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (q, v))


@given(SEEDS)
def test_vectors_are_turned_as_scipy_does(seed):
    q, v = drawn(seed)
    theirs = Rotation.from_quat(q)
    np.testing.assert_allclose(to_reference(q, v), theirs.apply(v), rtol=0, atol=2e-15)
    np.testing.assert_allclose(to_body(q, v), theirs.inv().apply(v), rtol=0, atol=2e-15)
    np.testing.assert_allclose(dcm_body_to_reference(q), theirs.as_matrix(), rtol=0, atol=2e-15)


@given(SEEDS)
def test_one_vector_serves_all_attitudes_and_more_axes_are_carried(seed):
    q, v = drawn(seed, 6)
    np.testing.assert_array_equal(to_reference(q, v[0]), to_reference(q, np.tile(v[0], (6, 1))))
    folded = to_reference(q.reshape(2, 3, 4), v.reshape(2, 3, 3))
    np.testing.assert_array_equal(folded.reshape(6, 3), to_reference(q, v))


@settings(deadline=None)  # compiles
@given(SEEDS)
def test_kernels_turn_the_same_way(seed):
    q, v = drawn(seed)
    one = np.array([quaternion.rotate(tuple(a), tuple(b)) for a, b in zip(q, v, strict=True)])
    np.testing.assert_allclose(to_reference(q, v), one, rtol=0, atol=2e-15)
    np.testing.assert_allclose(to_reference(inverse(q), one), v, rtol=0, atol=2e-15)


@given(SEEDS, st.sampled_from([1e-9, 1e-7, 1e-6, 1e-4, 0.1, 1.0, 3.0]), st.booleans())
def test_between_two_attitudes_the_body_turns_at_a_constant_rate(seed, angle_rad, flipped):
    q, axis = drawn(seed, 1)
    start = Rotation.from_quat(q)
    ends = Rotation.concatenate([start, start * Rotation.from_rotvec(angle_rad * axis)])
    wanted = np.linspace(0.0, 5.0, 11)
    rows = ends.as_quat() * np.array([[1.0], [-1.0 if flipped else 1.0]])
    found = interpolate(np.array([0.0, 5.0]), rows, wanted)
    theirs = Slerp([0.0, 5.0], ends)(wanted)
    apart = (theirs.inv() * Rotation.from_quat(found)).magnitude()
    np.testing.assert_allclose(apart, 0.0, atol=5e-15)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, rtol=1e-12)


def test_interpolation_passes_through_the_given_attitudes():
    t = np.array([0.0, 1.0, 3.0, 4.0])
    q, _ = drawn(5, 4)
    apart = np.abs(np.sum(interpolate(t, q, t) * q, axis=1))
    assert apart == pytest.approx(np.ones(4), abs=1e-15)


def test_rotation_vectors_are_scipys():
    """Of any rotations, of tiny ones and of none, whatever the signs of the quaternions."""
    rng = np.random.default_rng(3)
    p, q = Rotation.random(200, random_state=1), Rotation.random(200, random_state=2)
    tiny = Rotation.from_rotvec(1e-9 * rng.normal(size=(200, 3)))
    for other in (q, p * tiny, p):
        sign = rng.choice([-1.0, 1.0], size=(200, 1))
        found = rotation_vector(p.as_quat(), sign * other.as_quat())
        assert found == pytest.approx((p.inv() * other).as_rotvec(), rel=1e-9, abs=1e-15)
