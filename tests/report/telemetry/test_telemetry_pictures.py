"""Pictures of an examination: lines are broken at gaps."""

import numpy as np
import pytest

from torquer.report.telemetry.pictures import break_line


@pytest.mark.parametrize("gaps", [(), (7,), (1, 20), (39,)])
def test_a_line_is_broken_at_gaps_alone(gaps):
    steps = np.where(np.isin(np.arange(1, 41), gaps), 500.0, 10.0) + 0.4 * np.arange(40)
    t = np.append(0.0, np.cumsum(steps))
    at, values = break_line(t, 2.0 * t)
    holes = np.flatnonzero(np.isnan(at))
    assert list(holes) == [gap + k for k, gap in enumerate(gaps)]
    np.testing.assert_array_equal(np.isnan(values), np.isnan(at))
    np.testing.assert_array_equal(np.delete(values, holes), 2.0 * t)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_points_are_a_line(count):
    t = np.arange(float(count))
    for line in break_line(t, t):
        np.testing.assert_array_equal(line, t)
