"""Pictures of the averaged motion: they are written, and show what they are given."""

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure

from torquer.report.common.figure import save_figure
from torquer.report.theory.pictures import _levels, draw_evolution, draw_map, isolines
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.slow_result import SlowMotion

U = np.linspace(0.0, 60.0, 50)
FLAT = Slow(np.ones(50), np.full(50, 0.5), np.zeros(50), np.full(50, 1.0))
GRID = np.linspace(0.0, 90.0, 31)


def test_courses_are_drawn_even_if_nothing_moves(tmp_path):
    falling = FLAT._replace(l=np.exp(-0.1 * U))
    path = save_figure(
        draw_evolution(U, {"one": FLAT, "two": falling}, "a title"), tmp_path / "x.png"
    )
    still = save_figure(draw_evolution(U, {"one": FLAT}, "a title"), tmp_path / "y.png")
    images = [matplotlib.image.imread(each)[..., :3] for each in (path, still)]
    assert images[0].shape == images[1].shape
    assert np.abs(images[0] - images[1]).max() > 0.5


def test_a_motion_that_stops_ends_with_a_cross(tmp_path):
    half = FLAT._replace(l=np.where(U < 30.0, 1.0 - 0.03 * U, np.nan))
    stopped = SlowMotion(*half, ended=30.0)
    images = [
        matplotlib.image.imread(
            save_figure(draw_evolution(U, {"one": slow}, "a title"), tmp_path / name)
        )
        for name, slow in (("x.png", half), ("y.png", stopped))
    ]
    assert np.abs(images[0] - images[1]).max() > 0.5


def test_isolines_lie_where_the_values_are():
    axes = Figure().subplots()
    isolines(axes, GRID, GRID, np.add.outer(GRID, 0.0 * GRID), [30.0])
    (line,) = [p for c in axes.collections if hasattr(c, "levels") for p in c.get_paths()]
    assert line.vertices[:, 0] == pytest.approx(np.full(len(line.vertices), 30.0))
    assert line.vertices[:, 1].min() == 0.0


def test_maps_are_drawn_with_gaps_and_over_decades(tmp_path):
    values = np.exp(-np.add.outer(GRID, GRID) / 10.0)
    values[0, 0] = np.nan
    figure = draw_map(GRID, GRID, values, "", "a title", (30.0, 40.0))
    path = save_figure(figure, tmp_path / "map.png")
    image = matplotlib.image.imread(path)[..., :3]
    red = (image[..., 0] > 0.75) & (image[..., 1] < 0.5) & (image[..., 2] < 0.2)
    assert red.sum() > 500  # the mark of the orbit asked for


def test_levels_are_even_or_by_decades():
    levels, norm = _levels(0.5, 1.0)
    assert norm is None and np.ptp(np.diff(levels)) == pytest.approx(0.0, abs=1e-12)
    levels, norm = _levels(1e-9, 1.0)
    assert (norm.vmin, norm.vmax) == (1e-3, 1.0)
    assert levels == pytest.approx([2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5])
