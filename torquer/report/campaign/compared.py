"""Two campaigns side by side: distribution functions, differences, one HTML page."""

from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from torquer.campaign.summary import percent
from torquer.report.campaign.interactive import cdf_figure, difference_figure
from torquer.report.campaign.several import draw_cdf
from torquer.report.campaign.shared import axis_label, in_words
from torquer.report.campaign.tables import (
    about_comparison,
    campaign_labels,
    comparison_grid,
)
from torquer.report.common.colours import BLUE, ORANGE
from torquer.report.common.figure import INK, foot, place, quiet, save_figures, sheet
from torquer.report.common.html import card, cards
from torquer.simulation.results.file import put


def draw_compared(a: xr.Dataset, b: xr.Dataset, found: dict, folder: Path) -> dict[str, Path]:
    """Write the pictures; their paths by name."""
    figures = {f"cdf_{name}": _draw_cdf(a, b, found, name) for name in found["outcomes"]}
    figures["differences"] = _draw_differences(found)
    return save_figures(figures, folder)


def _draw_cdf(a: xr.Dataset, b: xr.Dataset, found: dict, name: str) -> Figure | None:
    """Distribution functions in one picture; None if no member has a value."""
    unit = found["summaries"][0]["outcomes"][name]["unit"]
    return draw_cdf((a, b), campaign_labels(found), name, unit)


def find_differences(found: dict) -> dict[str, tuple]:
    """Difference and ends of its interval by label, where there are any."""
    shown = {}
    success = found["success"]
    if success is not None:
        shown["success rate"] = (success["difference"], *success["interval"])
    for name, each in found["outcomes"].items():
        unit = found["summaries"][0]["outcomes"][name]["unit"]
        ours = [summary["outcomes"][name] for summary in found["summaries"]]
        if any(one["missing"] for one in ours) and each["restricted"] is not None:
            each, kind = each["restricted"], "restricted mean"
        else:
            kind = "mean"
        shown[f"{kind} of {axis_label(name, unit)}"] = (each["difference"], *each["interval"])
    return {label: each for label, each in shown.items() if None not in each}


def _draw_differences(found: dict) -> Figure | None:
    """Each difference on its own scale, zero marked; None if there is none."""
    shown = find_differences(found)
    if not shown:
        return None
    figure = sheet(7.2, 0.75 + 0.95 * len(shown), "Differences B - A")
    for row, (label, (middle, low, high)) in enumerate(shown.items()):
        axes = place(figure, 0.5, 0.75 + 0.95 * row, 6.3, 0.3)
        quiet(axes)
        axes.grid(False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.axvline(0.0, color=INK, lw=0.8)
        colour = BLUE if low <= 0.0 <= high else ORANGE
        axes.plot([low, high], [0, 0], color=colour, lw=3, solid_capstyle="butt")
        axes.plot([middle], [0], "o", color=colour, ms=6)
        reach = 1.1 * max(abs(low), abs(high)) or 1.0
        axes.set_xlim(-reach, reach)
        axes.set_yticks([])
        axes.set_title(label, fontsize=9.5, loc="left", color=INK, pad=3)
    foot(
        figure,
        f"bars: {percent(found['confidence'])} confidence intervals; orange: they exclude zero",
    )
    return figure


# ------------------------------------------------------------------ page


def write_compared(a: xr.Dataset, b: xr.Dataset, found: dict, path: Path) -> Path:
    """Write the page on two campaigns."""
    title = f"{found['names'][0]} and {found['names'][1]}: campaigns compared"
    differences = card(
        "differences",
        "Differences B - A",
        f"{about_comparison(found)} Bars: the same intervals; orange: they exclude zero.",
        {"grid": comparison_grid(found)},
        *(
            {"figure": difference_figure(label, *each), "words": f"Difference of the {label}."}
            for label, each in find_differences(found).items()
        ),
    )
    made = [differences, *(_distribution(a, b, found, name) for name in found["outcomes"])]
    return put(path, cards(title, made, description="; ".join(campaign_labels(found))))


def _distribution(a: xr.Dataset, b: xr.Dataset, found: dict, name: str) -> dict:
    each = found["summaries"][0]["outcomes"][name]
    figure = cdf_figure((a, b), campaign_labels(found), name, each["unit"])
    said = in_words(name, each["unit"])
    words = f"Distribution functions: {said}."
    shown = {"figure": figure, "words": words} if figure else {"line": "No member has a value."}
    return card(f"cdf_{name}", said, each["definition"], shown)
