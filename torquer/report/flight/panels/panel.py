"""Building blocks of time plots: lines, levels, panels, pictures, and functions to make them."""

from dataclasses import dataclass, replace

import numpy as np

from torquer.analysis.goals import NAMED, find_goals
from torquer.analysis.series import quiet_from, usual_size
from torquer.base.language import message, told
from torquer.report.common.colours import AXES
from torquer.report.common.downsample import Downsampled, downsample, thin
from torquer.report.common.scales import choose_prefix, log_floor
from torquer.report.flight.view import Mark, View

ECLIPSE: str = message("eclipse")
MEASUREMENT: str = message("measurement, coils off")
Spans = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Line:
    """A series to draw; `style`: 'line', 'dashed', 'steps' (held until the next point), 'dots'."""

    label: str
    series: Downsampled
    colour: str
    width: float = 1.0
    style: str = "line"


@dataclass(frozen=True)
class Level:
    """A horizontal mark with its label: dashed, or a solid one, as for zero."""

    y: float
    label: str
    solid: bool = False


@dataclass(frozen=True)
class Bar:
    """When a region was in a state: the spans of a strip that have its colour and opacity."""

    label: str
    spans: Spans
    colour: str
    opacity: float


@dataclass(frozen=True)
class Panel:
    """One set of axes: `window` None shows the whole run; `y_range` None fits the data.

    With `bars` it is a strip of these instead, without a y axis. Panels with the same `fold` are
    folded on a page, under this name.
    """

    title: str
    y_label: str
    lines: tuple[Line, ...]
    levels: tuple[Level, ...] = ()
    log: bool = False
    y_range: tuple[float, float] | None = None
    window: tuple[float, float] | None = None
    bands: Spans = ()
    bands_label: str = ECLIPSE
    marks: tuple[Mark, ...] = ()
    bars: tuple[Bar, ...] = ()
    fold: str = ""


@dataclass(frozen=True)
class Picture:
    """Panels from top to bottom, with what they mean."""

    name: str
    title: str
    caption: str
    panels: tuple[Panel, ...]


def told_panel(panel: Panel) -> Panel:
    """The panel in the language of the reader; names of states are the scenario's."""
    return replace(
        panel,
        title=told(panel.title),
        y_label=told(panel.y_label),
        lines=tuple(replace(line, label=told(line.label)) for line in panel.lines),
        levels=tuple(replace(level, label=told(level.label)) for level in panel.levels),
        marks=tuple(replace(mark, label=told(mark.label)) for mark in panel.marks),
    )


def told_picture(picture: Picture) -> Picture:
    """The picture in the language of the reader."""
    return replace(
        picture,
        title=told(picture.title),
        caption=told(picture.caption),
        panels=tuple(map(told_panel, picture.panels)),
    )


def shown_times(view: View, panel: Panel) -> tuple[float, float]:
    """First and last time [s] of a panel's axis."""
    began, ended = panel.window or (0.0, view.end_s)
    return (began, ended) if ended > began else (began - 0.5, ended + 0.5)


def about_ranges(picture: Picture) -> str:
    """The meaning of lines and shading where a downsampled series is drawn by its range."""
    stretch = max(line.series.stretch_s for panel in picture.panels for line in panel.lines)
    if stretch == 0.0:
        return ""
    return message(
        "Lines: averages over {stretch:.3g} s of slow motion; shading: minimum to maximum.",
        stretch=stretch,
    )


def make_line(label, t, y, colour, width=1.0, style="line") -> Line:
    """A line of a series, downsampled as its style allows."""
    if style == "steps":
        return Line(label, Downsampled(t, y), colour, width, style)
    shorten = thin if style == "dots" else downsample
    return Line(label, shorten(t, y), colour, width, style)


def mean_line(label, t, y, colour, width) -> Line:
    """The average everywhere: on a logarithmic axis a factor of three is small."""
    return Line(label, downsample(t, y, swing=np.inf), colour, width)


def xyz(t, vectors, style="line", width=0.9) -> tuple[Line, ...]:
    """Lines of the components of vectors [n, 3]."""
    return tuple(
        make_line(name, t, vectors[:, i], colour, width, style)
        for i, (name, colour) in enumerate(AXES)
    )


def whole(view: View, title: str, y_label: str, lines, **keys) -> Panel:
    """A panel of the whole run."""
    return Panel(title, y_label, tuple(lines), bands=view.eclipses, **keys)


def limit_levels(view: View, signal: str) -> tuple[Level, ...]:
    """Limits of a signal; the usual one of the rate is an orbital rate, which has its mark."""
    return tuple(
        Level(goal.below, message("limit"))
        for goal in find_goals(view.scenario)
        if goal.signal == signal and (goal.why == NAMED or signal != "rate")
    )


def log_panel(
    view: View, title: str, y_label: str, series, levels=(), decades=6.0, marks=()
) -> Panel:
    """A logarithmic panel of (label, y, colour, width), from the smallest value worth showing.

    Linear where the values are of one size or none is above zero.
    """
    values = np.concatenate([y for _, y, *_ in series])
    heights = [level.y for level in levels]
    least = min([log_floor(values, decades) or 0.0, *heights])
    top = max([np.nanmax(values, initial=0.0), *heights])
    if top < 3.0 * least or least == 0.0:
        lines = [make_line(label, view.t_s, y, c, w) for label, y, c, w in series]
        y_range = (-0.04 * top, 1.2 * top) if top > 0.0 else (-0.05, 1.0)
        return whole(view, title, y_label, lines, levels=levels, y_range=y_range, marks=marks)
    lines = [
        mean_line(label, view.t_s, np.where(y > 0.0, y, np.nan), c, w) for label, y, c, w in series
    ]
    keys = {"log": True, "y_range": (0.8 * least, 1.25 * top), "marks": marks}
    return whole(view, title, y_label, lines, levels=levels, **keys)


def make_part(view: View, title, unit, lines_of, values, window, levels=()) -> Panel:
    """A part of the run, or the whole: `values` [n, k] as `lines_of`(t, values) draws them.

    A few outliers are cut off: they would flatten the rest.
    """
    began, ended = window
    rows = (view.t_s >= began) & (view.t_s <= ended)
    shown = values[rows]
    greatest, usual = np.nanmax(np.abs(shown), initial=0.0), usual_size(shown)
    cut = greatest > 3.0 * usual > 0.0
    return Panel(
        message("{title} (peaks cut off)", title=title) if cut else title,
        message("[{unit}]", unit=unit),
        lines_of(view.t_s[rows], shown),
        levels=levels,
        y_range=(-1.5 * usual, 1.5 * usual) if cut else None,
        window=None if window == (0.0, view.end_s) else window,
        bands=tuple(
            (max(a, began), min(b, ended)) for a, b in view.eclipses if a < ended and b > began
        ),
        marks=tuple(m for m in view.marks(labelled=False) if began <= m.t_s <= ended),
    )


def with_room(panel: Panel) -> Panel:
    """The panel with headroom for the labels of its marks."""
    if not any(mark.label for mark in panel.marks):
        return panel
    rows = 0.11 * min(len(panel.marks), 3) + 0.03
    low, high = panel.y_range or _find_range(panel.lines)
    if panel.log:
        return replace(panel, y_range=(low, high * (high / low) ** rows))
    return replace(panel, y_range=(low, high + rows * (high - low)))


def _find_range(lines) -> tuple[float, float]:
    """Range of the lines with a small margin."""
    kept = (part for line in lines for part in (line.series.y, line.series.low, line.series.high))
    values = np.concatenate([part for part in kept if part is not None])
    low, high = np.nanmin(values, initial=0.0), np.nanmax(values, initial=0.0)
    edge = 0.05 * (high - low) or 1.0
    return low - edge, high + edge


def quiet_panels(view: View, title, vectors, unit, size, prefix=True) -> tuple[Panel, ...]:
    """The components once the fast motion has decayed, if it does."""
    since = quiet_from(view.t_s, size)
    if since is None:
        return ()
    rows = view.t_s >= since
    factor, unit = choose_prefix(vectors[rows], unit) if prefix else (1.0, unit)
    bands = tuple((max(a, since), b) for a, b in view.eclipses if b > since)
    lines = xyz(view.t_s[rows], factor * vectors[rows])
    label = message("[{unit}]", unit=unit)
    return (Panel(title, label, lines, window=(since, view.end_s), bands=bands),)
