"""Pictures of campaigns with extreme values, and what finds texts and data that cannot be read."""

import numpy as np
import pytest
from artificial_campaign import artificial
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from picture_faults import cut_data, faults, off_the_sheet, overlapping

from torquer.report.campaign import write_campaign_report

OUTCOMES = ("settling_s", "final_rate_deg_s", "coil_energy_j")


def drawn():
    """A figure of one line, which has no fault."""
    figure = Figure(figsize=(4.0, 3.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0], label="a line")
    return figure, axes


def test_a_plain_figure_has_no_fault():
    assert faults(drawn()[0]) == []


def test_texts_over_one_another_are_found():
    figure, axes = drawn()
    axes.text(0.5, 0.5, "here")
    axes.text(0.51, 0.5, "there")
    assert overlapping(figure) == ["'here' over 'there'"]


def test_a_text_that_leaves_the_sheet_is_found():
    figure, _ = drawn()
    figure.text(0.95, 0.5, "far to the right")
    assert off_the_sheet(figure) == ["far to the right"]


def test_data_beyond_the_axes_are_found_unless_the_title_says_so():
    figure, axes = drawn()
    axes.set_ylim(0.0, 0.5)
    assert len(cut_data(figure)) == 1
    axes.set_title("rate (peaks cut off)", loc="left")
    assert cut_data(figure) == []


def equal(values):
    return np.full_like(values, 61.25)


def one_far_off(values):
    return np.where(np.arange(len(values)) == 3, 1e9, np.linspace(55.0, 82.0, len(values)))


def crowded(values):
    """Half at one place, the other half close beside it."""
    return np.where(np.arange(len(values)) % 2 == 0, 55.0, 55.0 + 1e-3 * np.arange(len(values)))


def over_decades(values):
    return np.geomspace(1e-12, 1e12, len(values))


def tiny(values):
    return 1e-14 * np.linspace(1.0, 2.0, len(values))


def far_from_zero(values):
    return 1e9 + np.linspace(0.0, 1.0, len(values))


@pytest.mark.parametrize("shape", [equal, one_far_off, crowded, over_decades, tiny, far_from_zero])
@pytest.mark.parametrize("members", [2, 40])
def test_campaigns_of_extreme_outcomes_are_drawn(shape, members, tmp_path):
    result = artificial(members, name="a campaign with quite a long name, of a long study, " * 3)
    for name in OUTCOMES:
        result[name] = result[name].copy(data=shape(result[name].values))
    paths = write_campaign_report(result, tmp_path)
    assert len(paths) > 4
