"""The field of square coils against closed forms, a ring of straight pieces and symmetry."""

import math

import numpy as np
import pytest

from gallery.theory.square_coils import (
    conductor_field,
    flattest_ratio,
    off_uniform,
    pair_field,
)
from torquer.base.conventions import MU_0_H_M


def test_a_long_conductor_has_the_field_of_an_endless_one():
    found = conductor_field([0.0, 0.0, -1e4], [0.0, 0.0, 1e4], np.array([[0.2, 0.0, 0.0]]))[0]
    assert found == pytest.approx([0.0, MU_0_H_M / (2.0 * math.pi * 0.2), 0.0], rel=1e-8)


def test_the_centre_of_a_square():
    """2 sqrt(2) mu0 I/(pi a) for one; a pair that touches has twice that."""
    found = pair_field(1.9, 1e-9, [[0.0, 0.0, 0.0]])[0]
    assert found == pytest.approx([0.0, 0.0, 4.0 * math.sqrt(2.0) * MU_0_H_M / (math.pi * 1.9)])


def test_the_field_has_no_sources_and_no_curl_off_the_conductors():
    place, step = np.array([0.31, -0.17, 0.11]), 1e-4
    ends = [place + sign * step * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    values = pair_field(1.0, 0.5445, ends)
    slopes = (values[::2] - values[1::2]) / (2.0 * step)  # row j: derivative along j
    assert np.trace(slopes) == pytest.approx(0.0, abs=1e-6 * np.abs(slopes).max())
    assert slopes == pytest.approx(slopes.T, abs=1e-6 * np.abs(slopes).max())


def test_the_flattest_pair_departs_with_the_fourth_power():
    ratio = flattest_ratio()
    assert ratio == pytest.approx(0.5445, abs=5e-5)
    near, far = (off_uniform(1.0, ratio, [[0.0, 0.0, z]])[0] for z in (0.02, 0.04))
    assert math.log2(far / near) == pytest.approx(4.0, abs=0.02)
    other = [off_uniform(1.0, 1.05 * ratio, [[0.0, 0.0, z]])[0] for z in (0.005, 0.01)]
    assert math.log2(other[1] / other[0]) == pytest.approx(2.0, abs=0.05)
