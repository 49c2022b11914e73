"""Angles, spans of time and typical sizes of series."""

import numpy as np
import pytest

from torquer.analysis.series import angle_deg, bands_where, quiet_from, settled_from, usual_size


@pytest.mark.parametrize(
    ("inside", "bands"),
    [
        ([0, 0, 1, 1, 0], [(15.0, 35.0)]),
        ([1, 1, 0, 0, 0], [(0.0, 15.0)]),
        ([0, 0, 0, 1, 1], [(25.0, 40.0)]),
        ([1, 1, 1, 1, 1], [(0.0, 40.0)]),
        ([0, 0.25, 0.75, 0.25, 0], [(15.0, 25.0)]),
        ([0, 0.4, 0.9, 0.1, 0], [(12.0, 25.0)]),
        ([0, 0, 0, 0, 0], []),
        ([0, 1, 0, 1, 0], [(5.0, 15.0), (25.0, 35.0)]),
    ],
)
def test_bands_where(inside, bands):
    found = bands_where(10.0 * np.arange(5), inside)
    np.testing.assert_allclose(np.reshape(found, (-1, 2)), np.reshape(bands, (-1, 2)), rtol=1e-12)


def test_bands_of_a_single_record():
    assert bands_where([0.0], [1.0]) == [] and bands_where([0.0], [0.0]) == []


def test_angles():
    a = np.array([[1.0, 0, 0], [1.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [0.0, 0, 0]])
    b = np.array([[3.0, 0, 0], [0, 2.0, 0], [-1.0, 0, 0], [1.0, 1e-9, 0], [1.0, 0, 0]])
    angles = angle_deg(a, b)
    np.testing.assert_allclose(angles[:4], [0.0, 90.0, 180.0, np.degrees(1e-9)], rtol=1e-12)
    assert np.isnan(angles[4])


def test_quiet_from():
    t = np.arange(1000.0)
    size = np.where(t < 400.0, 1.0, 0.05)
    assert quiet_from(t, size) == 400.0
    assert quiet_from(t, np.ones(1000)) is None
    assert quiet_from(t, np.where(t < 950.0, 1.0, 0.05)) is None
    assert quiet_from(t[:1], size[:1]) is None
    assert quiet_from(t, np.zeros(1000)) is None


def test_settled_once_it_is_as_small_as_later():
    t = np.arange(1000.0)
    size = 60.0 * np.exp(-t / 10.0) + 1.0
    since = settled_from(t, size)
    assert size[int(since)] <= 3.0 * np.median(size[500:]) < size[int(since) - 1]
    assert settled_from(t, np.ones(1000)) is None
    assert settled_from(t, 60.0 * np.exp(-t / 400.0) + 0.01) is None
    # a later peak does not matter, and nothing has to become smaller than a 300th
    size[400] = 50.0
    assert settled_from(t, size) == since
    assert settled_from(t, 60.0 * np.exp(-t / 10.0)) == pytest.approx(10.0 * np.log(300.0), abs=1.0)
    assert settled_from(t[:1], size[:1]) is None


def test_usual_size_leaves_few_values_out():
    values = np.concatenate([np.full(99, -2.0), [500.0], [np.nan]])
    assert usual_size(values) == 2.0
    assert usual_size([1.0, 500.0]) > 400.0
    assert usual_size([]) == 0.0 and usual_size([np.nan]) == 0.0
