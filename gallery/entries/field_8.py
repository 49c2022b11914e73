"""FIELD Fig. 8: damping of the rate by B-dot under four field models.

The figure's node is not printed, and the text says nothing of how its curves were compared: 12
nodes are run, models are compared node by node, by a time (to half the initial rate), by the
whole course (root mean square distance), and by the rate that is left. The claims do not fare
alike, so that all of it is shown.
"""

from gallery.drawing import label, level, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict
from gallery.four_models import Case, by_node, comparison, courses, draw

CASE = Case((60.0, 130.0, 230.0), 5e11, 0.0, 1.0, record_s=2.0)
DAMPED_FROM = 0.3


def compute() -> Answer:
    """Courses of the rate relative to the orbital frame over the first revolution."""
    runs = courses(CASE)
    half = 0.5 * runs["averaged"][0].rate_per_s[0]
    times = by_node(runs, lambda run: run.first_below(run.rate_per_s, half))
    left = by_node(runs, lambda run: run.rate_per_s[run.revolutions > DAMPED_FROM].mean())
    checks = comparison(runs, lambda run: run.rate_per_s, times, left, "rate")
    ranges = ", ".join(
        f"{model} {found.min():.3f} to {found.max():.3f}"
        for model, found in zip(runs, times, strict=True)
    )
    note = f"Revolutions to half the initial rate, over the nodes: {ranges}."
    return Answer(checks, {"": picture(runs, half)}, note)


def picture(runs, half):
    """The four courses at the first node."""
    figure, (axes,) = new_figure("B-dot damping under four field models (FIELD Fig. 8)")
    draw(axes, runs, lambda run: 1e3 * run.rate_per_s)
    label(axes, "revolutions", "rate to orbital frame [mrad/s]")
    level(axes, 1e3 * half, "half of the initial rate")
    axes.set_ylim(bottom=0.0)
    return figure


ENTRY = Entry(
    ids=("FIELD-8",),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.OPEN,
    reason=(
        "which model damps sooner depends on the node, which is not printed: at most nodes IGRF is "
        "not the slower one, and by their times the dipoles are not the closest pair. Over the "
        "whole transient they are closest at most nodes, the averaged model differs, and IGRF "
        "leaves a slightly greater rate, as in the text"
    ),
)
