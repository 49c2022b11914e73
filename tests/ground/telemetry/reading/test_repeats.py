"""Numbers that repeat are said: how many rows, which, of what; those that come near are not."""

import numpy as np
import pytest

from torquer.ground.telemetry.reading.mapping import make_mapping
from torquer.ground.telemetry.reading.read import read

ROWS = 120
KEYS = {"time": "t", "columns": {"b_measured": ["x", "y", "z"]}, "units": {"b_measured": "nT"}}
START = np.datetime64("2012-03-04T10:00:00")


def numbers(rows=ROWS, digits=1, seed=0):
    t = np.arange(rows)[:, None]
    turned = 2e4 * np.sin(0.31 * t + [0.0, 1.0, 2.5])
    return np.round(turned + 30.0 * np.random.default_rng(seed).normal(size=(rows, 3)), digits)


def findings(folder, values, at=None):
    at = 10 * np.arange(len(values)) if at is None else at
    stamps = START + np.asarray(at).astype("timedelta64[s]")
    lines = [f"{s}Z,{x},{y},{z}" for s, (x, y, z) in zip(stamps, values, strict=True)]
    path = folder / "a.csv"
    path.write_text("\n".join(["t,x,y,z", *lines]))
    return {each.key: each for each in read(path, make_mapping(KEYS)).findings}


@pytest.mark.parametrize("gap_s", [0, 600, 86400])
def test_a_part_that_is_logged_again_later(tmp_path, gap_s):
    at = 10 * np.arange(2 * ROWS) + np.repeat([0, gap_s], ROWS)
    found = findings(tmp_path, np.tile(numbers(), (2, 1)), at)["logged again"]
    first = START + np.timedelta64(10 * ROWS + gap_s, "s")
    assert found.rows == ROWS
    assert f"those from {first}Z to " in found.text
    assert "are those from 2012-03-04T10:00:00Z to 2012-03-04T10:19:50Z" in found.text


def test_several_parts_of_held_readings_are_counted_together(tmp_path):
    values = np.repeat(numbers(), 2, axis=0)
    values[100:140], values[180:220] = values[20:60], values[60:100]
    found = findings(tmp_path, values)["logged again"]
    assert found.rows == 40  # each stands twice, and is held once
    assert found.text.endswith("; and 1 more such parts")


def test_rows_exported_twice_are_said_with_their_stamps(tmp_path):
    at = np.append(10 * np.arange(ROWS), 10 * np.arange(20, 50))
    found = findings(tmp_path, np.append(numbers(), numbers()[20:50], axis=0), at)
    said = found["doubled stamps"]
    assert said.rows == 30 and "from 2012-03-04T10:03:20Z to 2012-03-04T10:08:10Z" in said.text
    assert "logged again" not in found


@pytest.mark.parametrize("axis", range(3))
def test_an_axis_that_stands_still(tmp_path, axis):
    values = numbers()
    values[50:, axis] = values[50, axis]
    found = findings(tmp_path, values)["axis stands still"]
    assert found.rows == 70
    assert f"b_measured: {'xyz'[axis]} stands still in 70 rows, from 2012-03-04T10:08:20Z" in (
        found.text
    )


@pytest.mark.parametrize(
    "values",
    [numbers(), numbers(digits=-3), np.tile([[2e4, 1e4, 5e3]], (ROWS, 1)),
     np.tile([[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]], (ROWS // 2, 1))],
    ids=["plain", "coarse", "all still", "two numbers in turn"],
)  # fmt: skip
def test_what_is_neither(tmp_path, values):
    assert not {"logged again", "axis stands still"} & findings(tmp_path, values).keys()


def test_a_gap_is_no_jump(tmp_path):
    at = 10 * np.arange(ROWS) + np.repeat([0, 3000], ROWS // 2)
    smooth = 2e4 * np.sin(2e-3 * at[:, None] + [0.0, 1.0, 2.0])
    assert "jumps" not in findings(tmp_path, smooth, at)
    smooth[30] += 900.0
    assert findings(tmp_path, smooth, at)["jumps"].text.startswith("b_measured: 1 row jumps")
