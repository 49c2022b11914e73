"""FIELD Fig. 9: B-dot brings the axis of a pitch wheel to the orbit normal, four field models."""

from torquer.gallery.drawing import label, new_figure
from torquer.gallery.entry import Answer, Entry, lost, within
from torquer.gallery.four_models import Case, by_node, courses, draw, spread_at_a_node

CASE = Case((60.0, 100.0, 230.0), 5e10, 10.0, 6.0)
LIMIT_DEG = 45.0


def compute() -> Answer:
    """Time until the axis is within 45 deg of the normal, and how far it is in the end."""
    runs = courses(CASE)
    times = by_node(runs, lambda run: run.first_below(run.wheel_axis_deg, LIMIT_DEG))
    left = by_node(runs, last_revolution_deg)
    checks = (
        within("spread of the times at a node, over IGRF's between nodes",
               "analogous to Fig. 8: times differ insignificantly", spread_at_a_node(times),
               high=1.0),
        lost("axis to the normal, mean of revolution 6, worst model and node", left.max(), "deg"),
    )  # fmt: skip
    figure, (axes,) = new_figure("Pitch wheel's axis to the orbit normal (FIELD Fig. 9)")
    draw(axes, runs, lambda run: run.wheel_axis_deg)
    label(axes, "revolutions", "angle [deg]")
    axes.set(ylim=(0.0, 180.0), yticks=range(0, 181, 30))
    ranges = ", ".join(
        f"{model} {found.min():.2f} to {found.max():.2f}"
        for model, found in zip(runs, times, strict=True)
    )
    note = f"Revolutions to {LIMIT_DEG:g} deg, over 12 nodes (the text prints none): {ranges}."
    return Answer(checks, {"": figure}, note)


def last_revolution_deg(run) -> float:
    """Mean angle of the last revolution."""
    return float(run.wheel_axis_deg[run.revolutions > run.revolutions[-1] - 1.0].mean())


ENTRY = Entry(ids=("FIELD-9",), compute=compute)
