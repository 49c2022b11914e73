"""Rate, angular momentum and directions over time."""

import numpy as np

from torquer.analysis.attitude import body_axes_from_deg
from torquer.analysis.goals import angle_from_axis_deg, find_goals
from torquer.analysis.series import angle_deg
from torquer.base.language import joined, message
from torquer.report.common.colours import BLUE, GREY, ORANGE, PINK
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.panels.panel import (
    Level,
    Panel,
    Picture,
    limit_levels,
    log_panel,
    make_line,
    quiet_panels,
    whole,
    xyz,
)
from torquer.report.flight.panels.reaction_wheels import total_momentum_panel
from torquer.report.flight.view import View


def _orbital_levels(view: View) -> tuple[Level, ...]:
    rate_deg_s = np.degrees(view.omega0_rad_s)
    return tuple(Level(n * rate_deg_s, f"{n} ω₀") for n in (1, 2, 3))


def rate_size(view: View) -> Panel:
    """Absolute rate on a logarithmic axis."""
    series = (("|ω|", np.degrees(view.rate), GREY, 1.4),)
    levels = (*_orbital_levels(view), *limit_levels(view, "rate"))
    return log_panel(
        view, message("Absolute rate"), message("|ω| [{unit}]", unit="deg/s"), series, levels
    )


def rate(view: View) -> Picture:
    """Rate: modulus and components."""
    omega = np.degrees(view.values("omega_body"))
    title = message("Rate in body axes")
    parts = whole(view, title, message("[{unit}]", unit="deg/s"), xyz(view.t_s, omega))
    later = message("{title}, after the fast motion has decayed", title=title)
    late = quiet_panels(view, later, omega, "deg/s", view.rate, False)
    caption = message(
        "Dashed: multiples of the orbital rate, ω₀ = {omega0:.4g} deg/s.",
        omega0=np.degrees(view.omega0_rad_s),
    )
    return Picture("rate", message("Angular velocity"), caption, (rate_size(view), parts, *late))


def momentum_size(view: View) -> Panel:
    """Angular momentum on a logarithmic axis."""
    size = np.linalg.norm(view.values("momentum_inertial"), axis=1)
    factor, unit = choose_prefix(size, "N m s")
    series = [("|L|", factor * size, GREY, 1.4)]
    if view.wheels is not None:
        held = np.linalg.norm(view.wheels.total_body, axis=1)
        series.append((message("wheels"), factor * held, ORANGE, 1.0))
    # wheels may start empty: their smallest momentum does not matter
    decades = 6.0 if view.wheels is None else 3.0
    title = message("Angular momentum")
    return log_panel(view, title, message("|L| [{unit}]", unit=unit), series, decades=decades)


def momentum(view: View) -> Picture:
    """Angular momentum of body and wheels: modulus and components in J."""
    vectors = view.values("momentum_inertial")
    size = np.linalg.norm(vectors, axis=1)
    factor, unit = choose_prefix(vectors, "N m s")
    title = message("Angular momentum in inertial axes")
    parts = whole(view, title, message("[{unit}]", unit=unit), xyz(view.t_s, factor * vectors))
    later = message("{title}, after the fast motion has decayed", title=title)
    late = quiet_panels(view, later, vectors, "N m s", size)
    caption = message(
        "Body and wheels together, in the inertial frame: only external torques change it."
    )
    panels = (momentum_size(view), parts, *late)
    if view.wheels is not None:
        panels = (momentum_size(view), total_momentum_panel(view), parts, *late)
    return Picture("momentum", message("Angular momentum"), caption, panels)


def pointing(view: View) -> Picture:
    """Angular velocity, momentum and body axes relative to the field and the orbit."""
    caption = message(
        "Directions relative to the field, the orbit normal, the local vertical and the Sun."
    )
    if view.has_coils:
        caption = message("Coils damp only the rate component perpendicular to the field.")
    if [law["name"].startswith("bdot") for law in view.laws.values()] == [True]:
        settled = message(
            "B-dot settles into a slow rotation with the field, at about 2 ω₀ around the orbit "
            "normal."
        )
        caption = joined(" ", [caption, settled])
    from_axes = body_axes_from_vertical(view), body_axes_from_sun(view)
    panels = (_rate_parts(view), *_angles(view), *from_axes)
    return Picture("pointing", message("Pointing"), caption, panels)


def body_axes_from_vertical(view: View) -> Panel:
    """Angles of the body axes from the local vertical."""
    lines = xyz(view.t_s, body_axes_from_deg(view.result, "position_inertial"), width=0.7)
    return _angle_panel(view, message("Angles of the body axes from the local vertical"), lines)


def _angle_panel(view: View, title: str, lines, levels=()) -> Panel:
    return whole(
        view,
        title,
        message("angle [{unit}]", unit="deg"),
        lines,
        levels=levels,
        y_range=(0.0, 180.0),
    )


def body_axes_from_sun(view: View) -> Panel:
    """Angles of the body axes from the Sun, in view or not; and of a goal's axis, if another."""
    lines = [*xyz(view.t_s, body_axes_from_deg(view.result, "sun_inertial"), width=0.7)]
    axes = np.eye(3)
    for goal in find_goals(view.scenario):
        if goal.signal == "angle to the Sun" and not np.any(axes @ goal.axis > 1.0 - 1e-9):
            angle = angle_from_axis_deg(view.result, goal.axis)
            lines.append(make_line(message("axis of the mission"), view.t_s, angle, GREY, 1.4))
    levels = limit_levels(view, "angle to the Sun")
    return _angle_panel(view, message("Angles of the body axes from the Sun"), lines, levels)


def _rate_parts(view: View) -> Panel:
    omega, b = view.values("omega_body"), view.values("b_body")
    along = np.sum(omega * b, axis=1) / np.linalg.norm(b, axis=1)
    across = np.sqrt(np.maximum(np.sum(omega * omega, axis=1) - along**2, 0.0))
    relative = np.linalg.norm(view.values("omega_orbital"), axis=1)
    parts = (
        (message("parallel to B"), np.abs(along), PINK),
        (message("perpendicular to B"), across, ORANGE),
        (message("relative to the orbital frame"), relative, GREY),
    )
    series = tuple((label, np.degrees(y), colour, 1.0) for label, y, colour in parts)
    title, label = message("Rate components"), message("[{unit}]", unit="deg/s")
    return log_panel(view, title, label, series, _orbital_levels(view), 4.0)


def _angles(view: View) -> tuple[Panel, ...]:
    """Angles of rate and momentum, unless both are zero."""
    to_field = angle_deg(view.values("omega_body"), view.values("b_body"))
    normal = np.cross(view.values("position_inertial"), view.values("velocity_inertial"))
    to_normal = angle_deg(view.values("momentum_inertial"), normal)
    lines = (
        make_line(message("ω to B"), view.t_s, to_field, ORANGE, 0.9),
        make_line(message("L to the orbit normal"), view.t_s, to_normal, BLUE, 1.2),
    )
    if not np.isfinite([to_field, to_normal]).any():
        return ()
    return (_angle_panel(view, message("Directions"), lines),)
