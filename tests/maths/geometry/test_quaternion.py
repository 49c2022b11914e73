"""Quaternions against scipy's rotations: order, sense, exponential map, direction cosines."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer.maths.geometry import quaternion as quat

MANY = settings(max_examples=80, deadline=None)
turns = st.integers(0, 100_000).map(lambda n: Rotation.random(random_state=n))
vectors = st.tuples(*[st.floats(-10.0, 10.0)] * 3)


def q_of(rotation):
    return tuple(rotation.as_quat().tolist())


def angle_between(q, rotation):
    return (Rotation.from_quat(q).inv() * rotation).magnitude()


@MANY
@given(turns, turns, vectors)
def test_products_turns_and_inverses_are_scipys(p, q, v):
    size = np.linalg.norm(v)
    assert angle_between(quat.multiply(q_of(p), q_of(q)), p * q) < 1e-14
    assert quat.rotate(q_of(p), v) == pytest.approx(p.apply(v), abs=1e-15 * (1.0 + 4.0 * size))
    assert quat.rotate_inverse(q_of(p), v) == pytest.approx(
        p.inv().apply(v), abs=1e-15 * (1.0 + 4.0 * size)
    )
    assert quat.multiply(q_of(p), quat.conjugate(q_of(p))) == pytest.approx(
        (0.0, 0.0, 0.0, 1.0), abs=1e-15
    )


def test_quarter_turn_about_z_takes_body_x_to_reference_y():
    q = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
    assert quat.rotate(q, (1.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-15)
    assert quat.rotate_inverse(q, (0.0, 1.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0), abs=1e-15)


@MANY
@given(turns, st.floats(0.1, 10.0), st.booleans())
def test_a_rotation_vector_is_that_of_the_shorter_turn(turn, size, is_negative):
    q = tuple((-size if is_negative else size) * np.array(q_of(turn)))
    assert quat.to_rotation_vector(q) == pytest.approx(turn.as_rotvec(), abs=1e-14)


@MANY
@given(vectors, st.floats(-160.0, 0.4))
def test_a_rotation_vector_comes_back_at_any_size(v, power):
    """From pi down to where squares are no numbers."""
    phi = np.array(v) / max(np.linalg.norm(v), 1.0) * 10.0**power
    back = quat.to_rotation_vector(quat.from_rotation_vector(tuple(phi.tolist())))
    assert back == pytest.approx(phi, rel=1e-14, abs=1e-15 * 10.0**power)


@MANY
@given(turns, vectors)
def test_derivative_is_that_of_a_turn_about_body_axes(q, omega):
    """q(t) = q exp(omega t): central difference of the exponential."""
    h = 1e-5
    ahead, behind = (
        np.array(quat.multiply(q_of(q), quat.from_rotation_vector(tuple(s * w for w in omega))))
        for s in (h, -h)
    )
    rate = quat.derivative(q_of(q), omega)
    size = 1.0 + np.linalg.norm(omega) ** 3
    assert rate == pytest.approx((ahead - behind) / (2.0 * h), abs=1e-9 * size)
    assert np.dot(rate, q_of(q)) == pytest.approx(0.0, abs=1e-14)  # the length stays


@MANY
@given(vectors, st.floats(-12.0, 0.0))
@example((0.0, 0.0, 0.0), 0.0)
@example((1.0, 0.0, 0.0), -4.0)
@example((0.99999, 0.0, 0.0), -4.0)
@example((math.pi, 0.0, 0.0), 0.0)
@example((0.0, 2.0 * math.pi, 0.0), 0.0)
@example((1.0, 10.0, 2.225073858507203e-309), -8.439453125)
def test_exponential_map_to_rounding_at_every_size(phi, exponent):
    phi = tuple(10.0**exponent * x for x in phi)
    q = quat.from_rotation_vector(phi)
    angle = math.sqrt(sum(x * x for x in phi))
    expected = [0.5 * np.sinc(angle / (2.0 * math.pi)) * x for x in phi] + [math.cos(0.5 * angle)]
    # subnormal numbers are 5e-324 apart, however small they are
    rounding = {"rel": 4e-15, "abs": 1e-323} if angle < 1.0 else {"abs": 1e-15 * angle}
    assert q == pytest.approx(expected, **rounding)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=4e-16)


@MANY
@given(turns)
def test_direction_cosines_there_and_back(q):
    m = quat.to_dcm(q_of(q))
    assert np.array(m) == pytest.approx(q.as_matrix(), abs=1e-15)
    assert angle_between(quat.from_dcm(m), q) < 1e-14


def test_direction_cosines_of_half_turns_and_of_all_branches():
    axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, -1), (1, 1, 1), (-3, 2, 1))
    angles = (math.pi, math.pi - 1e-9, -math.pi, 2.0 * math.pi / 3.0, 1e-9)
    errors = {}
    for axis, angle in itertools.product(axes, angles):
        turn = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis))
        q = quat.from_dcm(tuple(tuple(row) for row in turn.as_matrix().tolist()))
        errors[axis, angle] = angle_between(q, turn), abs(np.linalg.norm(q) - 1.0)
    wrong = {case: (off, grown) for case, (off, grown) in errors.items()
             if not (off < 1e-14 and grown <= 4e-16)}  # fmt: skip
    assert wrong == {}


@MANY
@given(turns, st.floats(1e-6, 1e6))
def test_normalised_has_length_one_and_the_same_attitude(q, size):
    grown = tuple(size * x for x in q_of(q))
    assert np.linalg.norm(quat.normalise(grown)) == pytest.approx(1.0, abs=4e-16)
    assert angle_between(quat.normalise(grown), q) < 1e-14
