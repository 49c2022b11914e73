"""Pictures as PNG, by matplotlib's object interface: no global state, any thread, no display."""

from collections.abc import Callable
from functools import partial

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, MultipleLocator

from torquer.analysis.verdict import clock_text
from torquer.base.language import joined, message, told, translated
from torquer.report.common.figure import (
    FAINT,
    INK,
    SMALL,
    foot,
    legend,
    place,
    quiet,
    sheet,
)
from torquer.report.common.scales import clock_for, label_places, level_places, split_where_wrapped
from torquer.report.flight.ground_track import (
    DARK,
    PALE,
    SUNLIT,
    only_where,
)
from torquer.report.flight.panels import overview
from torquer.report.flight.panels.panel import (
    MEASUREMENT,
    Panel,
    Picture,
    about_ranges,
    shown_times,
)
from torquer.report.flight.view import Mark, View

#: Sizes [inch]. A fixed layout: searching for one would double the time of drawing.
_WIDTH, _LEFT, _RIGHT = 9.0, 0.82, 0.52
_HEAD, _TITLE, _PLOT, _UNDER, _REVOLUTIONS, _FOOT = 0.42, 0.30, 1.62, 0.42, 0.40, 0.24
#: Height of a strip and the space below it.
_STRIP, _UNDER_STRIP = 0.2, 0.04
#: Room for the number at a tick of the time axis.
_TICK = 0.45
_BANDS = {MEASUREMENT: "#f7f0e0"}
_NIGHT = "#e3e6ef"
_DASHES = (0, (5, 2))
#: Margins of the ground track [inch], and the colours of its map.
_MAP_TOP, _MAP_BELOW = 0.72, 0.42
_MAP_COLOURS = LinearSegmentedColormap.from_list("field", PALE)


def picture_functions(pictures) -> dict[str, Callable[[View], Figure]]:
    """The functions that draw the pictures of a view, by name; the overview first."""
    return {
        "overview": draw_overview,
        "ground_track": draw_ground_track,
        **{each.name: partial(draw_picture, picture=each) for each in pictures},
    }


def draw_picture(view: View, picture: Picture) -> Figure:
    """The panels of a picture, one under the other; revolutions below the last whole run."""
    last_whole = max(i for i, panel in enumerate(picture.panels) if panel.window is None)
    counted = view.end_s >= view.revolution_s
    legend_of_ranges = told(about_ranges(picture))
    sizes = [(_STRIP, _UNDER_STRIP) if panel.bars else (_PLOT, _UNDER) for panel in picture.panels]
    height = _HEAD + sum(_TITLE + tall + under for tall, under in sizes)
    height += (_REVOLUTIONS if counted else 0.0) + (_FOOT if legend_of_ranges else 0.0)
    figure = sheet(_WIDTH, height, f"{picture.title} · {view.scenario.name}", is_told=True)
    top = _HEAD
    for i, (panel, (tall, under)) in enumerate(zip(picture.panels, sizes, strict=True)):
        axes = place(figure, _LEFT, top + _TITLE, _WIDTH - _LEFT - _RIGHT, tall)
        (draw_strip if panel.bars else draw_panel)(axes, view, panel)
        top += _TITLE + tall + under
        if counted and i == last_whole:
            _add_revolutions(axes, view)
            top += _REVOLUTIONS
    foot(figure, legend_of_ranges)
    return figure


def draw_strip(axes, view: View, panel: Panel) -> None:
    """Bars of a strip; a state's name is in its longest bar, if it fits, and in the legend."""
    began, ended = shown_times(view, panel)
    axes.set_xlim(began, ended)
    axes.set_ylim(0.0, 1.0)
    axes.set_axis_off()
    for bar in panel.bars:
        spans = [(a, b - a) for a, b in bar.spans]
        axes.broken_barh(spans, (0.0, 1.0), color=bar.colour, alpha=bar.opacity, lw=0)
        first, last = max(bar.spans, key=lambda span: span[1] - span[0])
        if (last - first) / (ended - began) * _inches_wide(axes) > 0.075 * len(bar.label):
            axes.text(
                (first + last) / 2, 0.45, bar.label, ha="center", va="center", fontsize=SMALL - 0.5
            )
    axes.set_title(panel.title, loc="left", y=1.0, fontsize=9.5, color=INK)
    handles = [Patch(color=b.colour, alpha=b.opacity, lw=0, label=b.label) for b in panel.bars]
    _legend(axes, handles, panel.title)


def draw_panel(axes, view: View, panel: Panel) -> None:
    """One panel with its lines, levels, bands, legend and labels."""
    began, ended = shown_times(view, panel)
    clock = clock_for(ended - began)
    quiet(axes)
    axes.ticklabel_format(useOffset=False)
    handles = [_draw_line(axes, line, clock) for line in panel.lines]
    if panel.bands:
        handles.append(_draw_bands(axes, panel, clock))
    axes.set_xlim(began / clock.seconds, ended / clock.seconds)
    span = (ended - began) / clock.seconds
    axes.xaxis.set_major_locator(_time_ticks(clock, span, _inches_wide(axes)))
    _set_y(axes, panel)
    _draw_levels(axes, panel)
    _draw_marks(axes, panel.marks, clock)
    axes.set_xlabel(translated("time [{unit}]", unit=clock.unit), fontsize=SMALL, labelpad=1)
    axes.set_ylabel(panel.y_label, fontsize=9)
    axes.yaxis.set_label_coords(-0.53 / _inches_wide(axes), 0.5)
    axes.set_title(panel.title, loc="left", y=1.0, fontsize=9.5, color=INK)
    _legend(axes, handles, panel.title)


def _inches_wide(axes) -> float:
    return axes.get_position().width * axes.figure.bbox.width / axes.figure.dpi


def _time_ticks(clock, span: float, inches: float):
    """Ticks at round numbers of the unit; for hours at parts of a day."""
    if clock.unit == "h":
        return MultipleLocator(next((n for n in (0.5, 1, 2, 3, 6, 12) if span <= 12 * n), 24))
    most = min(10, int(inches / _TICK))
    return MaxNLocator(most, steps=(1, 2, 5, 10) if span < 50 else (1, 2, 3, 5, 6, 10))


def _draw_line(axes, line, clock):
    """Draw a line with its range; return what the legend shows for it."""
    series = line.series
    t, dots = series.t / clock.seconds, line.style == "dots"
    many, alone = len(t) > 200, len(t) < 4
    if series.low is not None:
        axes.fill_between(t, series.low, series.high, color=line.colour, alpha=0.2, lw=0)
        for edge in (series.low, series.high):
            axes.plot(t, np.where(series.fast, edge, np.nan), lw=0.8, color=line.colour)
    if dots:
        axes.plot(
            t,
            series.y,
            ".",
            ms=2.5 if many else 6.0,
            mew=0,
            color=line.colour,
            alpha=0.5 if many else 1.0,
        )
    else:
        axes.plot(
            t,
            series.y,
            lw=line.width,
            color=line.colour,
            ls=_DASHES if line.style == "dashed" else "-",
            marker="o" if alone else None,
            ms=4,
            drawstyle="steps-post" if line.style == "steps" else "default",
        )
    return Line2D(
        [],
        [],
        color=line.colour,
        lw=0 if dots else 1.8,
        ls=(0, (2, 1)) if line.style == "dashed" else "-",
        ms=4,
        label=line.label,
        marker="o" if dots or alone else None,
    )


def _draw_bands(axes, panel: Panel, clock):
    colour = _BANDS.get(panel.bands_label, _NIGHT)
    spans = [(a / clock.seconds, (b - a) / clock.seconds) for a, b in panel.bands]
    axes.broken_barh(
        spans, (0.0, 1.0), transform=axes.get_xaxis_transform(), color=colour, lw=0, zorder=0.5
    )
    return Patch(color=colour, lw=0, label=told(panel.bands_label))


def _draw_levels(axes, panel: Panel) -> None:
    low, high = axes.get_ylim()
    levels = sorted((v for v in panel.levels if low <= v.y <= high), key=lambda level: level.y)
    gap = 0.14 * axes.figure.dpi / (axes.get_position().height * axes.figure.bbox.height)
    _, places = level_places([v.y for v in levels], (low, high), panel.log, gap)
    for level, at in zip(levels, places, strict=True):
        dashes = "-" if level.solid else (0, (5, 3))
        axes.axhline(level.y, color=FAINT, lw=0.8, ls=dashes, zorder=1.5)
        axes.annotate(
            level.label,
            (1.006, at),
            xycoords="axes fraction",
            va="center",
            fontsize=SMALL,
            color="#555555",
            annotation_clip=False,
        )


def _draw_marks(axes, marks: tuple[Mark, ...], clock) -> None:
    """Vertical lines, their labels next to them, in the upper part of the axes."""
    began, ended = axes.get_xlim()
    at = [mark.t_s / clock.seconds for mark in marks]
    places = [(x - began) / (ended - began) for x in at]
    widths = [(0.065 * len(mark.label) + 0.12) / _inches_wide(axes) for mark in marks]
    labels = label_places(places, widths)
    for mark, x, (left, row) in zip(marks, at, labels, strict=True):
        axes.axvline(x, color=INK, lw=0.9, ls=(0, (1, 1.5)), zorder=1.6)
        axes.annotate(
            mark.label,
            (left, 1.0),
            xycoords="axes fraction",
            xytext=(4, -9 - 11 * row),
            textcoords="offset points",
            fontsize=SMALL - 0.5,
            color=INK,
            bbox={"facecolor": "white", "alpha": 0.75, "lw": 0, "pad": 0.6},
        )


def _set_y(axes, panel: Panel) -> None:
    if panel.log:
        axes.set_yscale("log")
        plain = FuncFormatter(lambda y, _: f"{y:g}")
        axes.yaxis.set_major_formatter(plain)
        axes.yaxis.set_minor_formatter("")
        if panel.y_range and panel.y_range[1] < 20.0 * panel.y_range[0]:
            axes.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
            axes.yaxis.set_minor_formatter(plain)
            axes.tick_params(which="minor", labelsize=SMALL)
    if panel.y_range:
        axes.set_ylim(*panel.y_range)
    if panel.y_range == (0.0, 180.0):
        axes.yaxis.set_major_locator(MultipleLocator(45.0))


def _legend(axes, handles, title: str) -> None:
    """One row to the right above the axes; close together where it would run into the title."""
    wide = 0.07 * len(title) + sum(0.35 + 0.065 * len(h.get_label()) for h in handles)
    keys = {"handletextpad": 0.5}
    if wide > _inches_wide(axes):
        keys = {"handlelength": 0.9, "handletextpad": 0.3, "columnspacing": 0.6}
    legend(axes, handles, **keys)


def _add_revolutions(axes, view: View) -> None:
    """A second time axis in revolutions, below the first, for runs of at least one revolution."""
    if view.end_s < view.revolution_s:
        return
    unit = view.revolution_s / clock_for(view.end_s).seconds
    both_ways = (lambda x: x / unit, lambda n: n * unit)
    second = axes.secondary_xaxis(-_UNDER / _PLOT, functions=both_ways)
    second.set_xlabel(translated("revolutions"), fontsize=SMALL, labelpad=1)
    second.tick_params(labelsize=SMALL, color=FAINT)
    second.spines["bottom"].set_color(FAINT)
    second.xaxis.set_major_locator(MaxNLocator(12, integer=True))


def draw_overview(view: View) -> Figure:
    """Three panels and the ground track on one page, with the key numbers."""
    wide, tall = 4.95, 2.475
    figure = sheet(12.2, 7.1, view.scenario.description or view.scenario.name, is_told=True)
    places = ((0.75, 0.68), (6.85, 0.68), (0.75, 3.9), (6.85, 3.9))
    cells = [place(figure, left, top, wide, tall) for left, top in places]
    for axes, panel in zip(cells[:3], overview(view), strict=True):
        draw_panel(axes, view, panel)
    draw_track(cells[3], view)
    foot(figure, _facts(view), 9)
    return figure


def _facts(view: View) -> str:
    """The key numbers in one line."""
    summary, clock = view.summary, clock_for(view.end_s)
    facts = [
        message("{time:.4g} {unit} simulated", time=view.end_s / clock.seconds, unit=clock.unit)
    ]
    if view.attitude_error is None:
        first, last = summary["initial_rate_deg_s"], summary["final_rate_deg_s"]
        facts.append(
            message("rate {first:.3g} → {last:.3g} {unit}", first=first, last=last, unit="deg/s")
        )
    else:
        error = summary["initial_attitude_error_deg"], summary["final_attitude_error_deg"]
        first, last = (message("none") if e is None else f"{e:.3g}" for e in error)
        facts.append(
            message("attitude error {first} → {last} {unit}", first=first, last=last, unit="deg")
        )
    facts += [
        message(
            "below {below:.3g} {unit} from {time}",
            below=goal["below"],
            unit=goal["unit"],
            time=clock_text(goal["stays_from_s"]),
        )
        for goal in summary["verdict"]["goals"][:1]
        if goal["stays_from_s"] is not None and view.wheels is None  # else the line is too long
    ]
    left = summary["momentum_left_n_m_s"]
    facts.append(message("final momentum {left:.3g} {unit}", left=left, unit="N m s"))
    if view.has_coils:
        peak = summary["peak_coil_dipole_a_m2"]
        facts.append(message("peak coil dipole {peak:.3g} {unit}", peak=peak, unit="A m²"))
    if view.wheels is not None:
        share = summary["peak_wheel_momentum_share"]
        facts.append(message("wheels up to {share:.0%} of their momentum limit", share=share))
    return told(joined("   ·   ", facts))


def draw_ground_track(view: View) -> Figure:
    """Ground track over a map of the field at the mean altitude."""
    wide = _WIDTH - _LEFT - _RIGHT - 0.5
    height = _MAP_TOP + 0.5 * wide + _MAP_BELOW
    title = f"{translated('Ground track')} · {view.scenario.name}"
    figure = sheet(_WIDTH, height, title, is_told=True)
    axes = place(figure, _LEFT, _MAP_TOP, wide, 0.5 * wide)
    bar = place(figure, _LEFT + wide + 0.15, _MAP_TOP + 0.3, 0.15, 0.5 * wide - 0.6)
    draw_track(axes, view, bar)
    return figure


def draw_track(axes, view: View, bar=None) -> None:
    """Track, sunlit and in eclipse, on a graticule and, where the model has one, a map of |B|."""
    quiet(axes)
    _draw_field_map(axes, view, bar)
    track = {k: view.values(k) for k in ("longitude", "latitude", "sunlit_fraction")}
    lon, lat, sunlit_fraction = split_where_wrapped(*track.values())
    width = 1.5 if view.end_s < 20.0 * view.revolution_s else 0.7
    alone = "o" if len(track["sunlit_fraction"]) < 2 else None
    handles = []
    for label, mask, colour in (
        (translated("sunlit"), sunlit_fraction >= 0.5, SUNLIT),
        (translated("in eclipse"), sunlit_fraction < 0.5, DARK),
    ):
        if mask.any():
            handles += axes.plot(
                *only_where(mask, lon, lat), lw=width, color=colour, label=label, marker=alone
            )
    for label, row, marker in ((translated("start"), 0, "o"), (translated("end"), -1, "s")):
        handles += axes.plot(
            track["longitude"][row],
            track["latitude"][row],
            marker,
            ms=8,
            mew=1.4,
            color="white",
            mec=INK,
            label=label,
            zorder=5,
        )
    axes.set(xlim=(-180, 180), ylim=(-90, 90), aspect="equal")
    axes.xaxis.set_major_locator(MultipleLocator(30 if bar else 60))
    axes.yaxis.set_major_locator(MultipleLocator(30))
    axes.set_xlabel(translated("longitude [{unit}]", unit="deg"), fontsize=SMALL)
    axes.set_ylabel(translated("latitude [{unit}]", unit="deg"), fontsize=SMALL)
    legend(axes, handles, handletextpad=0.5)


def _draw_field_map(axes, view: View, bar) -> None:
    grid = view.field_map
    kind = view.scenario.environment.field.kind
    if grid is None:
        axes.set_title(
            translated("{kind} field: defined along the orbit only, no map", kind=kind),
            loc="left",
            fontsize=9.5,
        )
        if bar:
            bar.remove()
        return
    lon, lat, strength = grid
    filled = axes.contourf(lon, lat, strength, 24, cmap=_MAP_COLOURS, zorder=0)
    marks = np.arange(5, 200, 5)
    lines = axes.contour(lon, lat, strength, marks, colors="#7f98a3", linewidths=0.6, zorder=0.6)
    axes.clabel(lines, lines.levels[:: 1 if bar else 2], fmt="%g", fontsize=7, colors="#4f6873")
    height_km = 1e-3 * view.values("altitude").mean()
    title = translated(
        "|B| [{unit}] at {height_km:.0f} km, {kind}", unit="µT", height_km=height_km, kind=kind
    )
    axes.set_title(title, loc="left", fontsize=9.5, color=INK)
    if bar:
        axes.figure.colorbar(filled, cax=bar, ticks=marks).outline.set_visible(False)
        bar.set_title(told("µT"), fontsize=SMALL)
        bar.tick_params(labelsize=SMALL)
