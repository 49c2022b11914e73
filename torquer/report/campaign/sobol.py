"""The share of an outcome's variance due to each key: Sobol indices as bars."""

from matplotlib.figure import Figure

from torquer.campaign.summary import percent
from torquer.report.campaign.shared import (
    bar_axes,
    bar_labels,
    outcome_in_words,
)
from torquer.report.common.colours import BLUE, SKY
from torquer.report.common.figure import INK, SMALL, foot, legend, quiet, sheet

#: Most bars of an outcome.
_MOST_BARS = 10


def draw_sobol(summary: dict) -> Figure | None:
    """First-order and total indices of each outcome; None where there are none."""
    outcomes = (summary["sensitivity"] or {"outcomes": {}})["outcomes"]
    shown = {name: greatest(found["groups"]) for name, found in outcomes.items()}
    shown = {name: groups for name, groups in shown.items() if groups}
    if not shown:
        return None
    heights = [0.5 + 0.36 * len(groups) for groups in shown.values()]
    ends = [x for groups in shown.values() for each in groups.values() for x in _numbers(each)]
    low, high = min(-0.05, *ends) - 0.02, max(1.05, *ends) + 0.02
    figure = sheet(7.2, 0.65 + sum(heights) + 0.65, f"Sobol indices · {summary['name']}")
    top, make_axes = 0.65, bar_axes(figure, shown.values())
    for (name, groups), height in zip(shown.items(), heights, strict=True):
        axes = make_axes(top + 0.3, height - 0.4, outcome_in_words(summary, name))
        handles = _draw_bars(axes, groups)
        axes.set_xlim(low, high)
        axes.tick_params(labelbottom=name == [*shown][-1])
        if top == 0.65:
            legend(axes, handles)
        top += height
    axes.set_xlabel("share of the variance", fontsize=SMALL)
    foot(figure, f"lines: {percent(summary['confidence'])} confidence intervals (bootstrap)")
    return figure


def greatest(groups: dict[str, dict]) -> dict[str, dict]:
    """The groups of the greatest total indices, the greatest first."""
    names = sorted(groups, key=lambda name: -groups[name]["total"])[:_MOST_BARS]
    return {name: groups[name] for name in names}


def _numbers(each: dict) -> list[float]:
    """Indices of a group and the ends of their intervals."""
    ends = [*each["first_interval"], *each["total_interval"]]
    return [each["first"], each["total"], *(end for end in ends if end is not None)]


def _draw_bars(axes, groups: dict[str, dict]) -> list:
    """Two bars a group, with their intervals."""
    quiet(axes)
    axes.grid(False, axis="y")
    handles = []
    for shift, kind, colour, label in (
        (-0.18, "first", BLUE, "first-order, S1"), (0.18, "total", SKY, "total, ST")
    ):  # fmt: skip
        places = [k + shift for k in range(len(groups))]
        sizes = [each[kind] for each in groups.values()]
        handles.append(axes.barh(places, sizes, 0.32, color=colour, label=label))
        for at, each in zip(places, groups.values(), strict=True):
            if None not in each[f"{kind}_interval"]:
                axes.plot(each[f"{kind}_interval"], [at, at], color=INK, lw=1.0)
    axes.axvline(0.0, color=INK, lw=0.8)
    axes.set_yticks(range(len(groups)), bar_labels(groups), fontsize=7.5)
    axes.set_ylim(len(groups) - 0.45, -0.55)
    return handles
