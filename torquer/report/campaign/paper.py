"""Each plot of a campaign as a figure of one column."""

from functools import partial

import xarray as xr
from matplotlib.figure import Figure

from torquer.campaign.contents import independent
from torquer.campaign.summary import campaign_summary
from torquer.report.campaign.bands import draw_bands_on, has_bands, series_by_signal, signal_title
from torquer.report.campaign.distribution import draw_shares, name_marks
from torquer.report.campaign.shared import in_words
from torquer.report.common.paper import column


def campaign_figures(result: xr.Dataset) -> dict[str, Figure]:
    """Bands of each signal over time and the distribution function of each outcome, by name."""
    summary, result = campaign_summary(result), independent(result)
    found: dict[str, Figure] = {}
    if has_bands(result):
        for names in series_by_signal(result):
            if f"series.{names[0]}" in result:
                draw = partial(_bands, result=result, summary=summary, names=names)
                found[f"series_{names[0]}"] = column(draw)
    for name, each in summary["outcomes"].items():
        if each["mean"] is not None:
            draw = partial(_shares, result=result, summary=summary, name=name)
            found[f"distribution_{name}"] = column(draw)
    return found


def _bands(axes, result: xr.Dataset, summary: dict, names: list[str]) -> str:
    draw_bands_on(axes, result, summary, names)
    return signal_title(result, names)


def _shares(axes, result: xr.Dataset, summary: dict, name: str) -> str:
    named = in_words(name, summary["outcomes"][name]["unit"])
    marks = draw_shares(axes, result, summary, name)
    name_marks(axes, result, summary, name)
    return f"Distribution of {named}; {marks}"
