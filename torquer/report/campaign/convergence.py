"""How the mean of each outcome and the success rate converge with more members.

Of times that some members do not reach, the restricted mean.
"""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from torquer.campaign.contents import (
    campaign_table,
    end_s,
    member_outcomes,
    restrict_times,
    succeeded_in,
)
from torquer.campaign.spec import SUCCESS
from torquer.campaign.statistics import mean_interval, rate_interval
from torquer.campaign.summary import percent, with_unit
from torquer.report.campaign.shared import in_words, settled_range
from torquer.report.common.colours import BLUE, GREEN
from torquer.report.common.figure import INK, SMALL, foot, place, quiet, sheet

#: Numbers of members at which the estimates are taken.
_POINTS = 100
_PANEL, _UNDER = 1.15, 0.5


def draw_convergence(result: xr.Dataset, summary: dict) -> Figure | None:
    """A panel for the success rate and for each mean; None with fewer than two members."""
    counts, found = estimates(result, summary)
    return _draw(found, counts, result, summary) if found else None


def estimates(result: xr.Dataset, summary: dict) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Numbers of members, and by name the success rate and means of as many [counts, 3].

    None of these with fewer than two members.
    """
    confidence = summary["confidence"]
    if summary["independent"] < 2:
        return np.empty(0), {}
    counts = counts_to(summary["independent"])
    found = {}
    succeeded = succeeded_in(result)
    if succeeded is not None:
        found[SUCCESS] = rates(succeeded, counts, confidence)
    for name, values in member_outcomes(result).items():
        times = restrict_times(result, name, end_s(result))
        values = values if times is None else times
        if np.isfinite(values).sum() > 1:
            found[name] = means(values, counts, confidence)
    return counts, found


def counts_to(members: int) -> np.ndarray:
    """Numbers of members in equal ratios, the last being all."""
    return np.unique(np.geomspace(2, members, _POINTS).round().astype(int))


def rates(succeeded: np.ndarray, counts, confidence: float) -> np.ndarray:
    """Success rate of the first members and the ends of its interval [counts, 3]."""
    found = [(int(succeeded[:n].sum()), int(n)) for n in counts]
    return np.array([(k / n, *rate_interval(k, n, confidence)) for k, n in found])


def means(values: np.ndarray, counts, confidence: float) -> np.ndarray:
    """Mean of the first members that have a value and the ends of its interval [counts, 3]."""
    return np.array([_mean(values[:n], confidence) for n in counts])


def _mean(values: np.ndarray, confidence: float) -> tuple[float, float, float]:
    known = values[np.isfinite(values)]
    low, high = mean_interval(values, confidence)
    return (float(known.mean()) if len(known) else np.nan, low, high)


def _draw(found: dict[str, np.ndarray], counts, result: xr.Dataset, summary: dict) -> Figure:
    figure = sheet(7.2, 0.6 + len(found) * (_PANEL + _UNDER) + 0.3,
                   f"Convergence · {summary['name']}")  # fmt: skip
    stop = campaign_table(result).get("stop") or {}
    for row, (name, each) in enumerate(found.items()):
        axes = place(figure, 0.85, 0.75 + row * (_PANEL + _UNDER), 6.1, _PANEL)
        _draw_panel(axes, counts, each)
        if stop.get("outcome") == name:
            for sign in (-1.0, 1.0):
                axes.axhline(each[-1, 0] + sign * stop["half_width"], color=GREEN, lw=1.0)
        axes.set_title(mean_title(summary, name), fontsize=9.5, loc="left", color=INK, pad=3)
        axes.tick_params(labelbottom=row == len(found) - 1)
    axes.set_xlabel("members", fontsize=SMALL)
    wanted = "; green: requested width" if stop else ""
    foot(figure, f"band: {percent(summary['confidence'])} confidence interval{wanted}")
    return figure


def mean_title(summary: dict, name: str) -> str:
    """Which mean of an outcome is drawn, with its unit; or the success rate."""
    if name == SUCCESS:
        return "success rate"
    each = summary["outcomes"][name]
    said = in_words(name, each["unit"])
    if not each["missing"]:
        title = f"mean of {said}"
    elif each["restricted_mean"] is not None:
        title = f"restricted mean of {said}"
    else:
        title = f"mean of {said} where it has a value"
    return with_unit(title, each["unit"])


def _draw_panel(axes, counts, each: np.ndarray) -> None:
    """Estimate and band; the first intervals, which are very wide, may leave the panel."""
    quiet(axes)
    axes.fill_between(counts, each[:, 1], each[:, 2], color=BLUE, alpha=0.22, lw=0)
    axes.plot(counts, each[:, 0], color=BLUE, lw=1.3)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda count, _: f"{count:g}"))
    axes.xaxis.set_minor_formatter("")
    axes.set_xlim(counts[0], max(counts[-1], counts[0] + 1))
    if shown := settled_range(counts, each):
        axes.set_ylim(*shown)
