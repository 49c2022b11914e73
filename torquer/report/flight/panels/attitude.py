"""Attitude error and rate relative to the reference frame."""

import numpy as np

from torquer.analysis.attitude import AttitudeError
from torquer.base.language import message
from torquer.report.common.colours import GREY, SKY
from torquer.report.flight.panels.panel import (
    Panel,
    Picture,
    limit_levels,
    log_panel,
    make_part,
    with_room,
    xyz,
)
from torquer.report.flight.view import View, known


def attitude_error(view: View) -> Picture:
    """Attitude error of the law, with the rate relative to its reference frame."""
    error = known(view.attitude_error)
    caption = message(
        "{held} The true error is shown, not the on-board estimate; its components are those of "
        "the rotation vector from the reference attitude to the body, about body x, y, z.",
        held=_held_in_words(error),
    )
    angles = message("Attitude error about body axes")
    rates = _rates_in_words(error)
    parts = (
        (angles, error.error_deg, "deg"),
        (message("{rates} about body axes", rates=rates), np.degrees(error.rate_rad_s), "deg/s"),
    )
    panels = (
        angle(view),
        rate(view, error, rates),
        *(p for part in parts for p in _by_axes(view, *part)),
    )
    return Picture("attitude_error", message("Attitude error"), caption, panels)


def _held_in_words(error: AttitudeError) -> str:
    """From what the error is, and when there is none."""
    used = np.unique(error.which[error.is_held])
    moves = any(error.attitudes[number].targets for number in used)
    if len(used) == 1:
        frame = error.attitudes[used[0]].frame
        words = (
            message("The reference attitude is the one that the law's targets give at the time.")
            if moves
            else message("The reference attitude is fixed in the {frame} frame.", frame=frame)
        )
    elif moves:
        words = message(
            "The reference is the attitude that the targets of the present mode's law give, one "
            "of {count}.",
            count=len(used),
        )
    else:
        words = message(
            "The reference is the attitude that the laws of the present mode hold, one of "
            "{count} in the {frame} frame.",
            count=len(used),
            frame=error.frames,
        )
    if error.has_slews:
        words = message(
            "{words} During a slew the attitude commanded is on its way there: the error from it "
            "is drawn beside.",
            words=words,
        )
    if error.is_held.all():
        return words
    return message("{words} Gaps: no attitude is held.", words=words)


def _rates_in_words(error: AttitudeError) -> str:
    """What rates are relative to."""
    if any(each.targets for each in error.attitudes):
        return message("Rate relative to the reference")
    return message("Rate relative to the {frame} frame", frame=error.frames)


def angle(view: View) -> Panel:
    """Angle of the attitude error on a logarithmic axis."""
    error = known(view.attitude_error)
    whole = message("from the target") if error.has_slews else message("angle")
    series = [(whole, error.angle_deg, GREY, 1.3)]
    if error.has_slews:
        series.append((message("from the commanded attitude"), error.commanded_deg, SKY, 1.0))
    levels, title = limit_levels(view, "attitude error"), message("Attitude error angle")
    return with_room(
        log_panel(view, title, message("[{unit}]", unit="deg"), series, levels, 5.0, view.marks())
    )


def rate(view: View, error: AttitudeError, title: str) -> Panel:
    """Size of the rate relative to the reference, on a logarithmic axis."""
    size = np.degrees(np.linalg.norm(error.rate_rad_s, axis=1))
    series = (("|ω|", size, SKY, 1.3),)
    return log_panel(
        view, title, message("[{unit}]", unit="deg/s"), series, (), 5.0, view.marks(labelled=False)
    )


def _by_axes(view: View, title: str, vectors, unit: str) -> tuple[Panel, ...]:
    """Components during acquisition and in steady state, each to its own scale."""
    acquired = view.acquired_s
    if acquired is None:
        return (make_part(view, title, unit, xyz, vectors, (0.0, view.end_s)),)
    first, then = (0.0, acquired), (acquired, view.end_s)
    return (
        make_part(view, message("{title}: acquisition", title=title), unit, xyz, vectors, first),
        make_part(view, message("{title}: steady state", title=title), unit, xyz, vectors, then),
    )
