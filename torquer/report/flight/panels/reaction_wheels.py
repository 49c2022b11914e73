"""Pictures of reaction wheels in flight: speeds, shares of the limits, motor torque, momentum."""

from dataclasses import replace

import numpy as np

from torquer.analysis.series import usual_size
from torquer.base.language import message
from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.panels.panel import (
    Level,
    Line,
    Panel,
    Picture,
    make_line,
    make_part,
    whole,
    with_room,
    xyz,
)
from torquer.report.flight.view import View, known

#: Six colours for six wheels; the next six are dashed.
_COLOURS, _STYLES = (ORANGE, BLUE, PINK, GREEN, SKY, RED), ("line", "dashed")
#: Share of a limit from which a panel shows it.
_NEAR = 0.5
_ZERO = Level(0.0, "", solid=True)


def wheels(view: View) -> Picture:
    """Speeds, shares of the momentum limits and motor torque of the wheels."""
    caption = message(
        "Wheels are numbered from 0; a wheel reaches its momentum and speed limits together. "
        "Wheels can spin against each other: the minimax share is the smallest peak share of the "
        "limits with which the working wheels could store the same total momentum. Torque is the "
        "commanded motor torque; a failed wheel delivers none."
    )
    panels = (speeds(view, view.marks()), shares(view), *_torques(view))
    return Picture("wheels", message("Reaction wheels"), caption, panels)


def speeds_or_shares(view: View) -> Panel:
    """Speeds of a few wheels, or the shares of many: for a small panel."""
    marks = view.marks(labelled=False)
    return speeds(view, marks) if known(view.wheels).count <= 5 else shares(view)


def _wheel_lines(t_s, values) -> tuple[Line, ...]:
    """A line for every wheel; many wheels are named by number alone."""
    count = values.shape[1]
    return tuple(
        make_line(_wheel_name(k, count), t_s, values[:, k], _COLOURS[k % 6], 1.0, _STYLES[k // 6])
        for k in range(count)
    )


def _wheel_name(number: int, count: int) -> str:
    return message("wheel {number}", number=number) if count <= 5 else str(number)


def _between(values, limits) -> dict:
    """Range of y around zero, with the limits as levels if the values come near one."""
    greatest = np.nanmax(np.abs(values), initial=0.0)
    if greatest < _NEAR * limits.min():
        return {"levels": (_ZERO,)}
    top = 1.12 * max(greatest, limits.max())
    levels = [Level(side * v, message("limit")) for v in np.unique(limits) for side in (1.0, -1.0)]
    return {"levels": (_ZERO, *levels), "y_range": (-top, top)}


def speeds(view: View, marks=()) -> Panel:
    """Speeds of the wheels."""
    flown = known(view.wheels)
    limit = flown.spec.speed_limit_rpm
    place = _between(flown.speed_rpm, np.array([limit]))
    title = (
        message("Speed of each wheel")
        if "y_range" in place
        else message("Speed of each wheel (limit {limit:g} rpm)", limit=limit)
    )
    lines = _wheel_lines(view.t_s, flown.speed_rpm)
    return with_room(
        whole(view, title, message("speed [{unit}]", unit="rpm"), lines, marks=marks, **place)
    )


def shares(view: View) -> Panel:
    """Peak share of the momentum limits, and the minimax share of the same total."""
    flown = known(view.wheels)
    greatest, needed = 100.0 * flown.momentum_shares.max(axis=1), 100.0 * flown.minimax_share
    lines = [make_line(message("most loaded wheel"), view.t_s, greatest, RED, 1.2)]
    if np.isfinite(needed).any():
        lines.append(make_line(message("minimax share"), view.t_s, needed, GREY, 1.2))
    near = greatest.max() > 100.0 * _NEAR
    return whole(
        view,
        message("Share of the momentum limit"),
        "[%]",
        lines,
        levels=(Level(100.0, message("limit")),) if near else (),
        y_range=(0.0, 112.0 if near else max(1.15 * greatest.max(), 1.0)),
        marks=view.marks(labelled=False),
    )


def _torques(view: View) -> tuple[Panel, ...]:
    """Motor torques: the whole run, and acquisition and steady state where they differ."""
    torque, acquired = known(view.wheels).torque, view.acquired_s
    first = _torque_panel(view, message("Motor torque"), torque)
    if acquired is None:
        return (first,)
    parts = (
        (message("Motor torque: acquisition"), (0.0, acquired)),
        (message("Motor torque: steady state"), (acquired, view.end_s)),
    )
    return first, *(_torque_part(view, title, window) for title, window in parts)


def _torque_panel(view: View, title: str, torque) -> Panel:
    factor, unit = choose_prefix(torque, "N m")
    limits = factor * known(view.wheels).limits("torque_limit_n_m")
    place = _between(factor * torque, limits)
    shown = " / ".join(f"{limit:.4g}" for limit in np.unique(limits))
    if "y_range" not in place:
        title = message("{title} (limit {shown} {unit})", title=title, shown=shown, unit=unit)
    lines = _wheel_lines(view.t_s, factor * torque)
    return whole(
        view,
        title,
        message("[{unit}]", unit=unit),
        lines,
        marks=view.marks(labelled=False),
        **place,
    )


def _torque_part(view: View, title: str, window) -> Panel:
    rows = (view.t_s >= window[0]) & (view.t_s <= window[1])
    factor, unit = choose_prefix(usual_size(known(view.wheels).torque[rows]), "N m")
    return make_part(
        view, title, unit, _wheel_lines, factor * known(view.wheels).torque, window, (_ZERO,)
    )


def total_momentum_panel(view: View) -> Panel:
    """Total wheel momentum in body axes, which unloading removes."""
    held = known(view.wheels).total_body
    factor, unit = choose_prefix(usual_size(held), "N m s")
    title = message("Total wheel momentum in body axes")
    panel = make_part(view, title, unit, _with_size, factor * held, (0.0, view.end_s), (_ZERO,))
    return with_room(replace(panel, y_label=message("h [{unit}]", unit=unit), marks=view.marks()))


def _with_size(t_s, vectors) -> tuple[Line, ...]:
    size = make_line("|h|", t_s, np.linalg.norm(vectors, axis=1), GREY, 1.4)
    return (*xyz(t_s, vectors), size)
