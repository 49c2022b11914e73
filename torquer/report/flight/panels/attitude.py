"""Pictures of a held attitude: the turn from the wanted one, the rate relative to the reference."""

import numpy as np

from torquer.analysis.attitude import Held
from torquer.report.common.colours import GREY, SKY
from torquer.report.flight.panels.panel import Panel, Picture, log_panel, part_of, with_room, xyz
from torquer.report.flight.view import View


def attitude_error(view: View) -> Picture:
    """How far the body is from the attitude that its law holds."""
    held = _held_of(view)
    frame = "orbital" if held.orbital else "inertial"
    caption = (
        f"The wanted attitude is fixed in the {frame} frame. Shown is the truth, not what the "
        "computer knows: the components are those of the turn vector from the wanted attitude to "
        "the body's, about body x, y, z."
    )
    angles = "Turn from the wanted attitude about body axes"
    rates = f"Rate relative to the {frame} frame"
    parts = (
        (angles, held.error_deg, "deg"),
        (f"{rates} about body axes", np.degrees(held.rate_rad_s), "deg/s"),
    )
    panels = (
        angle(view),
        rate(view, held, rates),
        *(p for part in parts for p in _by_axes(view, *part)),
    )
    return Picture("attitude_error", "Attitude error", caption, panels)


def angle(view: View) -> Panel:
    """Angle of the whole turn from the wanted attitude, on a logarithmic axis."""
    series = (("angle", _held_of(view).angle_deg, GREY, 1.3),)
    marks = view.marks()
    title = "Angle from the wanted attitude"
    panel = log_panel(view, series, decades=5.0, title=title, y_label="[deg]", marks=marks)
    return with_room(panel)


def rate(view: View, held: Held, title: str) -> Panel:
    """Size of the rate relative to the reference, on a logarithmic axis."""
    size = np.degrees(np.linalg.norm(held.rate_rad_s, axis=1))
    marks = view.marks(labelled=False)
    series = (("|ω|", size, SKY, 1.3),)
    return log_panel(view, series, decades=5.0, title=title, y_label="[deg/s]", marks=marks)


def _by_axes(view: View, title: str, vectors, unit: str) -> tuple[Panel, ...]:
    """Components: first while the attitude is taken up, then while it is held, each to scale."""
    taken_up = view.taken_up_s
    if taken_up is None:
        return (part_of(view, title, unit, xyz, vectors, (0.0, view.end_s)),)
    first, then = (0.0, taken_up), (taken_up, view.end_s)
    return (
        part_of(view, f"{title}: taken up", unit, xyz, vectors, first),
        part_of(view, f"{title}: held", unit, xyz, vectors, then),
    )


def _held_of(view: View) -> Held:
    """That of a view that has one: without, no such picture is made."""
    assert view.held is not None
    return view.held
