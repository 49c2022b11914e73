"""The verdict at the head of the report: the goals, when they were met, what was limiting."""

import numpy as np

from torquer.analysis.budget import NAMES, budget_rows
from torquer.analysis.goals import below_in_words
from torquer.analysis.summary import time_or_never
from torquer.analysis.verdict import value_or_none
from torquer.base.language import Message, message
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.view import View

HEAD = (
    message("Limit"),
    message("Set by"),
    message("First below at"),
    message("Stays below from"),
    message("At the end"),
    message("Last revolution"),
)
#: Look of a verdict: achieved, not achieved, none.
LOOKS = {True: "done", False: "missed", None: "open"}


def goal_grid(view: View) -> list[tuple[str, ...]]:
    """Rows below `HEAD`: every limit, since when it was met, and by what margin."""
    return [
        (
            below_in_words(goal["signal"], goal["below"], goal["unit"]),
            goal["why"],
            time_or_never(goal["first_s"]),
            _stays(goal),
            value_or_none(goal, "final"),
            _last_revolution(goal),
        )
        for goal in view.summary["verdict"]["goals"]
    ]


def _stays(goal: dict) -> Message:
    stays, count = time_or_never(goal["stays_from_s"]), goal["times_above"]
    if not count:
        return stays
    return message("{stays}, above it again {count} times", stays=stays, count=count)


def _last_revolution(goal: dict) -> Message:
    if goal["mean_last_revolution"] is None:
        return message("shorter run")
    mean, greatest = goal["mean_last_revolution"], goal["greatest_last_revolution"]
    return message(
        "mean {mean:.3g}, greatest {greatest:.3g} {unit}",
        mean=mean,
        greatest=greatest,
        unit=goal["unit"],
    )


def limiting(view: View) -> list[str]:
    """Limits that actuators reached, and the greatest disturbance against the coils' torque."""
    return [*view.summary["verdict"]["limits_met"], *_greatest_disturbance(view)]


def _greatest_disturbance(view: View) -> list[str]:
    torques = {
        name: row
        for name, row in budget_rows(view.budget).items()
        if name not in ("all", "coils") and row.rms_size_n_m > 0.0
    }
    if not torques:
        return []
    name, row = max(torques.items(), key=lambda each: each[1].rms_size_n_m)
    factor, unit = choose_prefix(np.array([row.rms_size_n_m]), "N m")
    line = message(
        "greatest disturbance torque: {name}, {size:.3g} {unit} RMS",
        name=NAMES[name],
        size=factor * row.rms_size_n_m,
        unit=unit,
    )
    if row.share is None:
        return [line]
    percent = 100.0 * row.share
    return [
        message("{line}, {percent:.2g} % of what the coils can give", line=line, percent=percent)
    ]


def verdict_data(view: View) -> dict:
    """The verdict as the page's template takes it."""
    verdict = view.summary["verdict"]
    return {
        "look": LOOKS[verdict["done"]],
        "headline": verdict["headline"],
        "head": HEAD,
        "rows": goal_grid(view),
        "limiting": limiting(view),
    }
