"""What the time plots show, panel by panel; drawn by `plots` (PNG) and `interactive` (HTML)."""

from dataclasses import replace

import numpy as np

from torquer.report import view as seen
from torquer.report.attitude_panels import angle, attitude_error
from torquer.report.panel import (
    BLUE,
    GREY,
    MEASUREMENT,
    ORANGE,
    PINK,
    Level,
    Panel,
    Picture,
    line_of,
    log_panel,
    quiet_panels,
    whole,
    xyz,
)
from torquer.report.series import angle_deg, prefixed
from torquer.report.view import View
from torquer.report.wheel_panels import fullest_or_speeds, total_momentum_panel, wheels


def pictures(view: View) -> tuple[Picture, ...]:
    """All pictures over time: of what the satellite has, and of what its laws do."""
    makers = (
        (attitude_error, view.held is not None),
        (rate, True),
        (wheels, view.wheels is not None),
        (momentum, True),
        (field, True),
        (dipoles, view.has_coils),
        (pointing, True),
    )
    return tuple(make(view) for make, made in makers if made)


def overview(view: View) -> tuple[Panel, Panel, Panel]:
    """The three panels that say most."""
    first = rate_size(view) if view.held is None else angle(view)
    if view.wheels is not None:
        return first, momentum_size(view), fullest_or_speeds(view)
    last = dipole_whole(view) if view.has_coils else _vertical(view)
    return first, momentum_size(view), last


def _orbital_levels(view: View) -> tuple[Level, ...]:
    rate_deg_s = np.degrees(view.omega0_rad_s)
    return tuple(Level(n * rate_deg_s, f"{n} ω₀") for n in (1, 2, 3))


def rate_size(view: View) -> Panel:
    """Absolute rate on a logarithmic axis."""
    series = (("|ω|", np.degrees(view.rate), GREY, 1.4),)
    return log_panel(
        view, series, _orbital_levels(view), title="Absolute rate", y_label="|ω| [deg/s]"
    )


def rate(view: View) -> Picture:
    """Rate: modulus and components."""
    omega = np.degrees(view.values("omega_body"))
    title = "Rate in body axes"
    parts = whole(view, title=title, y_label="[deg/s]", lines=xyz(view.t_s, omega))
    late = quiet_panels(view, f"{title}, after the fast motion", omega, "deg/s", view.rate, False)
    omega0 = f"ω₀ = {np.degrees(view.omega0_rad_s):.4g} deg/s"
    caption = f"Dashed: one, two and three orbital rates, {omega0}."
    return Picture("rate", "Angular velocity", caption, (rate_size(view), parts, *late))


def momentum_size(view: View) -> Panel:
    """Angular momentum on a logarithmic axis."""
    size = np.linalg.norm(view.values("momentum_inertial"), axis=1)
    factor, unit = prefixed(size, "N m s")
    series = (("|L|", factor * size, GREY, 1.4),)
    if view.wheels is not None:
        held = np.linalg.norm(view.wheels.total_body, axis=1)
        series += (("wheels", factor * held, ORANGE, 1.0),)
    # wheels may hold nothing at first: the least of theirs does not matter
    decades = 6.0 if view.wheels is None else 3.0
    return log_panel(
        view, series, decades=decades, title="Angular momentum", y_label=f"|L| [{unit}]"
    )


def momentum(view: View) -> Picture:
    """Angular momentum of body and wheels: modulus and components in J."""
    vectors = view.values("momentum_inertial")
    size = np.linalg.norm(vectors, axis=1)
    factor, unit = prefixed(vectors, "N m s")
    title = "Angular momentum in inertial axes"
    parts = whole(view, title=title, y_label=f"[{unit}]", lines=xyz(view.t_s, factor * vectors))
    late = quiet_panels(view, f"{title}, after the fast motion", vectors, "N m s", size)
    caption = "Body and wheels together, in the inertial frame: only outer torques change it."
    panels = (momentum_size(view), parts, *late)
    if view.wheels is not None:
        panels = (momentum_size(view), total_momentum_panel(view), parts, *late)
    return Picture("momentum", "Angular momentum", caption, panels)


def field(view: View) -> Picture:
    """Field in body axes, its beginning in detail, and the error of the magnetometer."""
    b = 1e6 * view.values("b_body")
    size = line_of("|B|", view.t_s, np.linalg.norm(b, axis=1), GREY, 1.6)
    panel = whole(
        view,
        title="Field in body axes",
        y_label="B [µT]",
        lines=(*xyz(view.t_s, b, width=0.6), size),
    )
    caption = (
        "What the magnetometer lives in. Readings are compared with the truth only at records "
        "that fall on a sampling instant: in between, the last reading is held."
    )
    panels = (panel, *_first_turns(view), *_reading_errors(view))
    return Picture("field", "Geomagnetic field", caption, panels)


def _first_turns(view: View, turns: float = 4.0) -> tuple[Panel, ...]:
    """Field and readings over the first few turns of the body, if they are a small part."""
    if view.rate[0] == 0.0:
        return ()
    end = turns * 2.0 * np.pi / view.rate[0]
    count = int(np.count_nonzero(view.t_s <= end))
    if end > 0.2 * view.end_s or not view.can_follow(0, count + 1):
        return ()
    t = np.linspace(0.0, end, 400)
    b = 1e6 * np.einsum("nji,nj->ni", view.to_inertial(t), view.at("b_inertial", t))
    fresh = seen.fresh_rows(view)
    fresh = fresh[view.t_s[fresh] <= end]
    dots = xyz(view.t_s[fresh], 1e6 * view.values("b_measured")[fresh], "dots")
    dots = tuple(replace(line, label=f"{line.label} read") for line in dots)
    title = "The first turns: truth (lines) and readings (dots)"
    return (Panel(title, "B [µT]", (*xyz(t, b, width=1.2), *dots), window=(0.0, end)),)


def _reading_errors(view: View) -> tuple[Panel, ...]:
    """Reading minus truth, where there is a fresh reading and it is not perfect."""
    rows = seen.fresh_rows(view)
    truth = view.values("b_body")[rows]
    errors = view.values("b_measured")[rows] - truth
    if rows.size == 0 or np.abs(errors).max() <= 1e-6 * np.abs(truth).max():
        return ()
    factor, unit = prefixed(1e9 * errors, "nT") if np.abs(errors).max() < 1e-6 else (1e-3, "µT")
    shown = 1e9 * factor * errors
    spread = ", ".join(f"{s:.3g}" for s in shown.std(axis=0))
    title = f"Magnetometer: reading less truth (standard deviation {spread} {unit})"
    dots = xyz(view.t_s[rows], shown, "dots", width=0.5)
    return (whole(view, title=title, y_label=f"ΔB [{unit}]", lines=dots),)


def coil_reach(view: View) -> np.ndarray:
    """Greatest dipole [A m^2] that the coils together can make along each body axis [3]."""
    coils = view.scenario.spacecraft.coils
    limits = np.broadcast_to(coils.limit_a_m2, len(coils.axes))
    return np.abs(np.array(coils.axes)).T @ limits


def _reach_levels(view: View) -> tuple[Level, ...]:
    """Marks at the reach along each axis, one for all axes that share it."""
    reach = np.round(coil_reach(view), 9)
    levels = []
    for value in dict.fromkeys(reach.tolist()):
        axes = "".join(name for name, r in zip("xyz", reach, strict=True) if r == value)
        label = "limit" if axes == "xyz" else f"limit {axes}"
        levels += [Level(value, label), Level(-value, "")]
    return tuple(levels)


def dipole_whole(view: View) -> Panel:
    """Dipole while the coils act, over the whole run."""
    control, step_s = view.scenario.control, view.scenario.simulation.step_s
    steps = np.round(view.t_s / step_s).astype(np.int64)
    phase = steps % round(control.cycle_s / step_s)
    # the last row is taken before the coils are switched, whatever its phase
    acting = np.flatnonzero(phase[:-1] >= round(control.measure_s / step_s))
    title = "Dipole while the coils act" if control.measure_s > 0.0 else "Dipole of the coils"
    if acting.size == 0:
        acting, title = np.arange(len(phase)), "Dipole at the recorded instants"
    m, reach = view.values("dipole_body")[acting], coil_reach(view)
    keys = {"levels": _reach_levels(view), "y_range": (-1.15 * reach.max(), 1.15 * reach.max())}
    factor, unit = 1.0, "A m²"
    if 0.0 < np.abs(m).max() < 0.25 * reach.min():
        # limits far away would press the lines flat
        (factor, unit), keys = prefixed(m, unit), {}
        title += f", far below the limit of {reach.min():.3g} A m²"
    lines = xyz(view.t_s[acting], factor * m, width=0.8)
    if control.measure_s == 0.0 and view.scenario.spacecraft.coils.lag_s == 0.0:
        lines = tuple(
            line if line.course.stretch_s else replace(line, style="steps") for line in lines
        )
    return whole(view, title=title, y_label=f"m [{unit}]", lines=lines, **keys)


def dipoles(view: View) -> Picture:
    """Dipole of the coils in body axes: the whole run, the first cycles and the last ones."""
    control = view.scenario.control
    caption = "Dashed: what the coils together can reach along a body axis. "
    if control.measure_s > 0.0:
        caption += (
            f"The coils act for {control.actuate_s:g} s of every {control.cycle_s:g} s; the panel "
            "of the whole run shows the dipole at those instants, the others show single cycles."
        )
    else:
        caption += f"The dipole is held for {control.sample_s:g} s from sample to sample."
    panels = (dipole_whole(view), *_cycles(view))
    return Picture("dipoles", "Dipole of the coils", caption, panels)


def _cycles(view: View, count: int = 6) -> tuple[Panel, ...]:
    """First and last cycles, if the record is fine enough to show them."""
    control, span = view.scenario.control, count * view.scenario.control.cycle_s
    shortest = min(control.measure_s, control.actuate_s) if control.measure_s else control.sample_s
    if view.record_s > shortest * (1.0 + 1e-9) or view.end_s < span:
        return ()
    first = _cycle_panel(view, f"The first {count} cycles", 0, span)
    if view.end_s < 4.0 * span:
        return (first,)
    began = int((view.end_s - span) // control.cycle_s) * control.cycle_s
    return (first, _cycle_panel(view, f"The last {count} cycles", began, began + span))


def _cycle_panel(view: View, title: str, began: float, ended: float) -> Panel:
    control = view.scenario.control
    rows = (view.t_s >= began - 1e-6) & (view.t_s <= ended + 1e-6)
    m = view.values("dipole_body")[rows]
    factor, unit = prefixed(m, "A m²")
    style = "steps" if view.scenario.spacecraft.coils.lag_s == 0.0 else "line"
    reach = _reach_levels(view) if np.abs(m).max() > 0.5 * coil_reach(view).min() else ()
    levels = tuple(Level(factor * level.y, level.label) for level in reach)
    starts = np.arange(began, ended - 1e-6, control.cycle_s)
    bands = tuple((s, s + control.measure_s) for s in starts.tolist()) if control.measure_s else ()
    lines = xyz(view.t_s[rows], factor * m, style, width=1.3)
    return Panel(
        title,
        f"m [{unit}]",
        lines,
        levels,
        window=(began, ended),
        bands=bands,
        bands_label=MEASUREMENT,
    )


def pointing(view: View) -> Picture:
    """Where the motion points: along and across the field, to the orbit normal, to the vertical."""
    caption = "Angles by which motion and body axes stand off what is around the satellite."
    if view.has_coils:
        caption = "Coils act only on the part of the rate across the field."
    if view.result.attrs["law"].startswith("bdot"):
        caption += (
            " Left to itself, B-dot ends in a slow turn with the field, near 2 ω₀ about the orbit "
            "normal."
        )
    return Picture(
        "pointing",
        "Direction of the motion",
        caption,
        (_rate_parts(view), *_angles(view), _vertical(view)),
    )


def _vertical(view: View) -> Panel:
    """Angles of the body axes from the local vertical."""
    return whole(
        view,
        title="Body axes from the local vertical",
        y_label="angle [deg]",
        lines=xyz(view.t_s, seen.body_axes_from_vertical_deg(view), width=0.7),
        y_range=(0.0, 180.0),
    )


def _rate_parts(view: View) -> Panel:
    omega, b = view.values("omega_body"), view.values("b_body")
    along = np.sum(omega * b, axis=1) / np.linalg.norm(b, axis=1)
    across = np.sqrt(np.maximum(np.sum(omega * omega, axis=1) - along**2, 0.0))
    relative = np.linalg.norm(view.values("omega_orbital"), axis=1)
    parts = (
        ("along B", np.abs(along), PINK),
        ("across B", across, ORANGE),
        ("relative to the orbit", relative, GREY),
    )
    series = tuple((label, np.degrees(y), colour, 1.0) for label, y, colour in parts)
    return log_panel(
        view,
        series,
        _orbital_levels(view),
        decades=4.0,
        title="Rate by direction",
        y_label="[deg/s]",
    )


def _angles(view: View) -> tuple[Panel, ...]:
    """Directions of rate and momentum, unless the body has none."""
    to_field = angle_deg(view.values("omega_body"), view.values("b_body"))
    to_normal = angle_deg(view.values("momentum_inertial"), seen.orbit_normals(view))
    lines = (
        line_of("ω to B", view.t_s, to_field, ORANGE, 0.9),
        line_of("L to the orbit normal", view.t_s, to_normal, BLUE, 1.2),
    )
    if not np.isfinite([to_field, to_normal]).any():
        return ()
    return (
        whole(view, title="Directions", y_label="angle [deg]", lines=lines, y_range=(0.0, 180.0)),
    )
