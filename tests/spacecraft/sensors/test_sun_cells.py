"""Sun cells: the cosine within the field of view, light of the Earth, cells that are not there."""

import numpy as np
import pytest

from torquer.spacecraft.sensors.sun_cells import CELLS, SunCells, read_cell

DARK = (0.0, 0.0, 0.0)


def signals(cells, sun, fraction=1.0, earth=DARK, drawn=0.0):
    packed = cells.pack()
    return np.array([read_cell(packed, k, sun, fraction, earth, drawn) for k in range(CELLS)])


def test_cell_signal_is_cosine_in_front_and_within_its_field():
    cells = SunCells(normals=((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)))
    found = signals(cells, (0.6, 0.8, 0.0), fraction=0.7)
    assert found == pytest.approx([0.42, 0.56, 0.0, 0.0, 0.0, 0.0])
    narrow = SunCells(normals=cells.normals, half_field_deg=45.0)
    assert signals(narrow, (0.6, 0.8, 0.0)) == pytest.approx([0.0, 0.8, 0.0, 0.0, 0.0, 0.0])


def test_earth_light_is_added_only_in_front_of_a_cell():
    cells = SunCells(normals=((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)), scale_error=(0.1, -0.2))
    found = signals(cells, (0.6, 0.8, 0.0), earth=(-0.25, 0.0, 0.0))
    assert found[:2] == pytest.approx([1.1 * 0.6, 0.8 * 0.25])


def test_noise_is_on_cells_that_are_there():
    cells = SunCells(normals=((1.0, 0.0, 0.0),), noise=0.02)
    assert signals(cells, (0.0, 0.0, 1.0), drawn=1.5) == pytest.approx([0.03, 0, 0, 0, 0, 0])


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"normals": [[1, 0, 0]] * 7}, "normals: must be at most 6 vectors; received 7"),
        ({"normals": [[0, 0, 0]]}, "normals"),
        ({"normals": [[1, 0, 0]], "scale_error": [0.1, 0.2]}, "scale_error: must be one number"),
        ({"normals": [[1, 0, 0]], "scale_error": -1.0}, "scale_error: must be one number above -1"),
    ],
)
def test_mistakes_are_reported(keys, message):
    with pytest.raises(ValueError, match=message):
        SunCells(**keys)
