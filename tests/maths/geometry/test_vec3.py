"""Vectors and matrices as tuples, against NumPy."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from torquer.maths.geometry import vec3

MANY = settings(max_examples=60, deadline=None)
number = st.floats(-1e3, 1e3)
vectors = st.tuples(number, number, number)
matrices = st.tuples(vectors, vectors, vectors)


def close(values, size=1.0):
    return pytest.approx(np.asarray(values), abs=1e-15 * (size + 1.0), rel=1e-14)


@MANY
@given(vectors, vectors, number)
def test_vectors_as_numpy_has_them(a, b, k):
    x, y = np.array(a), np.array(b)
    size = np.linalg.norm(x) * np.linalg.norm(y)
    assert vec3.add(a, b) == tuple(x + y)
    assert vec3.sub(a, b) == tuple(x - y)
    assert vec3.scale(k, a) == tuple(k * x)
    assert vec3.add_scaled(a, k, b) == close(x + k * y, np.linalg.norm(x) + abs(k) * 2e3)
    assert vec3.dot(a, b) == close(x @ y, size)
    assert vec3.cross(a, b) == close(np.cross(x, y), size)
    assert vec3.norm(a) == close(np.linalg.norm(x))


@MANY
@given(vectors)
def test_unit_vectors_have_length_one(a):
    if vec3.norm(a) > 1e-100:
        n = vec3.unit(a)
        assert vec3.norm(n) == pytest.approx(1.0, abs=4e-16)
        assert vec3.dot(n, a) == pytest.approx(vec3.norm(a))


@MANY
@given(matrices, vectors)
def test_matrices_as_numpy_has_them(m, a):
    x = np.array(m)
    size = np.linalg.norm(x) * np.linalg.norm(a)
    assert vec3.mat_vec(m, a) == close(x @ a, size)
    assert vec3.mat_t_vec(m, a) == close(x.T @ a, size)
    symmetric = x + x.T
    packed = vec3.as_symmetric(symmetric)
    assert vec3.sym_vec(packed, a) == close(symmetric @ a, 2.0 * size)


@MANY
@given(st.integers(0, 10_000), vectors, st.floats(-8.0, 8.0))
def test_solve_inverts_a_matrix_of_any_size(seed, b, exponent):
    m = 10.0**exponent * (np.random.default_rng(seed).normal(size=(3, 3)) + 3.0 * np.eye(3))
    x = vec3.solve(vec3.as_matrix(m), b)
    condition = np.linalg.cond(m)
    assert m @ x == pytest.approx(np.array(b), abs=1e-15 * condition**2 * (np.abs(b).max() + 1e-9))


def test_arrays_become_tuples_of_floats():
    assert vec3.as_vector(np.array([1, 2, 3])) == (1.0, 2.0, 3.0)
    assert all(type(x) is float for x in vec3.as_vector(np.arange(3, dtype=np.float32)))
    assert vec3.as_matrix(np.eye(3)) == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    tensor = [[1.0, 4.0, 5.0], [4.0, 2.0, 6.0], [5.0, 6.0, 3.0]]
    assert vec3.as_symmetric(tensor) == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    for wrong in ((1.0, 2.0), (1.0, 2.0, 3.0, 4.0)):
        with pytest.raises(ValueError, match="values to unpack"):
            vec3.as_vector(wrong)
