"""Euler angles: against scipy, round trips, gimbal lock, errors."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from torquer.maths.geometry import euler

SEQUENCES = (
    "121", "131", "212", "232", "313", "323", "123", "132", "213", "231", "312", "321",
)  # fmt: skip
LETTERS = str.maketrans("123", "XYZ")
ANGLES = np.random.default_rng(1).uniform(-np.pi, np.pi, (40, 3))


def scipy_rotation(sequence, angles):
    return Rotation.from_euler(sequence.translate(LETTERS), angles)


def middle_folded(sequence, angles):
    """The same angles with the middle one inside the range in which it is unique."""
    folded = angles.copy()
    folded[:, 1] = np.abs(angles[:, 1]) if sequence[0] == sequence[2] else angles[:, 1] / 2.0
    return folded


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_matrices_and_quaternions_equal_scipy(sequence):
    expected = scipy_rotation(sequence, ANGLES)
    assert np.abs(euler.to_dcm(sequence, ANGLES) - expected.as_matrix()).max() < 2e-15
    ours = Rotation.from_quat(euler.to_quaternion(sequence, ANGLES))
    assert np.max((ours.inv() * expected).magnitude()) < 2e-15


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_angles_come_back(sequence):
    angles = middle_folded(sequence, ANGLES)
    assert np.abs(euler.from_dcm(sequence, euler.to_dcm(sequence, angles)) - angles).max() < 1e-13
    q = euler.to_quaternion(sequence, angles)
    assert np.abs(euler.from_quaternion(sequence, 3.0 * q) - angles).max() < 1e-13


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_angles_equal_scipy(sequence):
    rotations = Rotation.random(50, rng=np.random.default_rng(3))
    expected = rotations.as_euler(sequence.translate(LETTERS))
    assert np.abs(euler.from_dcm(sequence, rotations.as_matrix()) - expected).max() < 1e-12
    assert np.abs(euler.from_quaternion(sequence, rotations.as_quat()) - expected).max() < 1e-12


def lock_angles(sequence):
    return (0.0, np.pi) if sequence[0] == sequence[2] else (-np.pi / 2, np.pi / 2)


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("which", (0, 1))
def test_gimbal_lock_zeroes_the_third_angle_and_keeps_the_matrix(sequence, which):
    middle = lock_angles(sequence)[which]
    m = euler.to_dcm(sequence, (0.7, middle, -0.4))
    angles = euler.from_dcm(sequence, m)
    assert angles[2] == 0.0
    assert abs(angles[1] - middle) < 1e-15
    assert np.abs(euler.to_dcm(sequence, angles) - m).max() < 1e-15
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = Rotation.from_matrix(m).as_euler(sequence.translate(LETTERS))
    assert np.abs(np.sin((angles - expected) / 2.0)).max() < 1e-12


@settings(max_examples=100, deadline=None)
@given(
    st.sampled_from(SEQUENCES),
    st.floats(-np.pi, np.pi),
    st.floats(-16.0, -1.0),
    st.floats(-np.pi, np.pi),
    st.integers(0, 1),
)
def test_matrix_survives_however_close_the_lock(sequence, first, exponent, third, which):
    middle = lock_angles(sequence)[which] * (1.0 - 10.0**exponent) + 10.0**exponent * (
        sequence[0] == sequence[2] and which == 0
    )
    m = euler.to_dcm(sequence, (first, middle, third))
    assert np.abs(euler.to_dcm(sequence, euler.from_dcm(sequence, m)) - m).max() < 3e-12


def test_shapes_of_any_depth():
    angles = ANGLES.reshape(2, 4, 5, 3)
    m = euler.to_dcm("321", angles)
    assert m.shape == (2, 4, 5, 3, 3)
    assert np.array_equal(m[1, 2, 3], euler.to_dcm("321", angles[1, 2, 3]))
    assert euler.from_dcm("321", m).shape == angles.shape
    assert euler.to_quaternion("321", angles[0, 0, 0]).shape == (4,)


def test_body_axis_of_a_single_turn():
    # the third body axis of a 313 set lies at nutation from reference axis 3
    third = euler.to_dcm("313", (0.3, 0.2, 1.9))[:, 2]
    expected = (np.sin(0.2) * np.sin(0.3), -np.sin(0.2) * np.cos(0.3), np.cos(0.2))
    assert np.allclose(third, expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("bad", ("311", "334", "zxz", "31", "3131", 313, None, "133"))
def test_a_bad_sequence_is_one_clear_line(bad):
    with pytest.raises(ValueError, match="Euler sequence: must be three axes") as error:
        euler.to_dcm(bad, (0.0, 0.0, 0.0))
    assert str(error.value).endswith(f"received {bad!r}") and "\n" not in str(error.value)


def test_bad_shapes_and_numbers():
    with pytest.raises(ValueError, match=r"Euler angles: must end in shape \(3,\)"):
        euler.to_dcm("321", (0.0, 0.0))
    with pytest.raises(ValueError, match=r"direction cosines: must end in shape \(3, 3\)"):
        euler.from_dcm("321", np.zeros(9))
    with pytest.raises(ValueError, match="quaternion: must be finite"):
        euler.from_quaternion("321", (0.0, 0.0, 0.0, np.nan))
