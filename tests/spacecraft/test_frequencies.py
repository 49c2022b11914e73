"""Frequencies of a body's motion, against eigenvalues and textbook cases."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from torquer.maths.geometry.vec3 import as_symmetric
from torquer.spacecraft.frequencies import libration_fourth, nutation_square

MOMENTS = np.array([1.0, 1.4, 2.1])
numbers = st.floats(-2.0, 2.0)
vectors = st.tuples(numbers, numbers, numbers)


def skew(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


@given(vectors, vectors, vectors)
def test_nutation_square_is_sum_of_linearised_principal_minors(omega, momentum, tilt):
    turn, _ = np.linalg.qr(np.eye(3) + skew(tilt))
    inertia = turn @ np.diag(MOMENTS) @ turn.T
    inverse = np.linalg.inv(inertia)
    matrix = inverse @ (skew(momentum) - skew(omega) @ inertia)
    minors = 0.5 * (np.trace(matrix) ** 2 - np.trace(matrix @ matrix))
    found = nutation_square(as_symmetric(inverse), momentum, omega)
    size = 1.0 + np.dot(omega, omega) + np.dot(momentum, momentum)
    assert found == pytest.approx(minors, abs=1e-13 * size)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_free_spin(axis):
    omega, spin = np.zeros(3), 0.7
    omega[axis] = spin
    a, b = np.delete(MOMENTS, axis)
    c = MOMENTS[axis]
    expected = spin**2 * (c - a) * (c - b) / (a * b)
    found = nutation_square(tuple(1.0 / MOMENTS), tuple(MOMENTS * omega), tuple(omega))
    assert found == pytest.approx(expected, rel=1e-14)
    assert (found < 0.0) == (axis == 1)  # about the middle axis the motion runs away


def test_a_gyrostat_at_rest():
    h = np.array([0.3, -0.2, 0.5])
    expected = h @ np.diag(MOMENTS) @ h / np.prod(MOMENTS)
    found = nutation_square(tuple(1.0 / MOMENTS), tuple(h), (0.0, 0.0, 0.0))
    assert found == pytest.approx(expected, rel=1e-14)


def test_a_dipole_swings_about_the_field():
    inverse, dipole, field = tuple(1.0 / MOMENTS), (0.0, 3.0, 4.0), (2e-5, 0.0, 0.0)
    assert libration_fourth(inverse, dipole, field) == pytest.approx((5.0 * 2e-5 / 1.0) ** 2)
