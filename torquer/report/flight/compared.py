"""Runs side by side: what differs in their scenarios, their key numbers, one picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from torquer.analysis.attitude import find_attitude_error
from torquer.analysis.derived import rate_size
from torquer.analysis.side_by_side import differences, distinct_names
from torquer.analysis.summary import summarise, summary_rows, told_rows
from torquer.analysis.wheel_use import recorded_wheels
from torquer.base.language import message, translated
from torquer.report.common.colours import RUNS
from torquer.report.common.figure import image, place, sheet
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.panels.panel import Panel, mean_line, told_panel
from torquer.report.flight.png import draw_panel
from torquer.report.flight.view import View, make_view

#: Greatest number of runs: the number of colours that can be distinguished.
MOST = len(RUNS)
_WIDE, _LEFT, _PANEL, _HEAD, _BETWEEN, _UNDER = 9.0, 0.82, 1.9, 0.75, 0.85, 0.55
_DECADES = 5.0


@dataclass(frozen=True)
class Comparison:
    """The result of `compare`; shows itself in notebooks.

    >>> weak = torquer.simulate(scenario.replace("control.law.gain_a_m2_s_per_t", 5e3))
    >>> both = torquer.compare(result, weak, names=["2e4", "5e3"])
    >>> both.rows()[0][0]
    'Verdict'
    >>> figure = both.plot()
    >>> sorted(both.as_plain())
    ['changed', 'runs']
    """

    names: tuple[str, ...]
    results: tuple[xr.Dataset, ...] = field(repr=False)
    summaries: tuple[dict, ...] = field(repr=False)
    """The summary of each run, as `torquer.summarise` gives it."""
    changed: dict[str, list] = field(repr=False)
    """Keys whose values differ between the scenarios, with the value of each run."""

    def rows(self) -> list[tuple[str, ...]]:
        """The key numbers as rows of a table, in the language of the reader: label, then a value of
        each run."""
        shown = [_number(told_rows(summary_rows(summary))) for summary in self.summaries]
        labels = dict.fromkeys(label for rows in shown for label in rows)
        return [(label[0], *(rows.get(label, "") for rows in shown)) for label in labels]

    def plot(self) -> Figure:
        """Attitude error if laws held an attitude, rate, momentum, wheels: a line for each run."""
        views = [make_view(result) for result in self.results]
        longest = max(views, key=lambda view: view.end_s)
        panels = _panels(_labels(self), views)
        height = _HEAD + len(panels) * (_PANEL + _BETWEEN) - _BETWEEN + _UNDER
        figure = sheet(_WIDE, height, " · ".join(self.names))
        for k, panel in enumerate(panels):
            top = _HEAD + k * (_PANEL + _BETWEEN)
            axes = place(figure, _LEFT, top, _WIDE - _LEFT - 0.3, _PANEL)
            draw_panel(axes, longest, told_panel(panel))
        return figure

    def as_plain(self) -> dict:
        """Plain data: names, differing keys, summaries."""
        return {
            "runs": [
                {"name": name, "summary": summary}
                for name, summary in zip(self.names, self.summaries, strict=True)
            ],
            "changed": self.changed,
        }

    def __str__(self) -> str:
        return "\n".join(" | ".join(row) for row in [("", *self.names), *self.rows()])

    def _repr_html_(self) -> str:
        changed = [(key, *map(_text, values)) for key, values in self.changed.items()]
        head = "".join(f"<th>{escape(name)}</th>" for name in ("", *self.names))
        rows = "".join(
            f"<tr>{''.join(f'<td>{escape(text)}</td>' for text in row)}</tr>"
            for row in [*changed, *self.rows()]
        )
        picture = image(self.plot(), "The runs, overlaid")
        return f"<table><tr>{head}</tr>{rows}</table>{picture}"


def compare(*results: xr.Dataset, names: Sequence[str] | None = None) -> Comparison:
    """Two to six runs side by side: differing keys, key numbers, one picture.

    `names` of the runs: by default those of their scenarios. ValueError for another number of runs.

        >>> weak = torquer.simulate(scenario.replace("control.law.gain_a_m2_s_per_t", 5e3))
        >>> torquer.compare(result, weak, names=["2e4", "5e3"]).changed
        {'control.law.gain_a_m2_s_per_t': [20000.0, 5000.0]}
    """
    if not 2 <= len(results) <= MOST:
        raise ValueError(f"results: must be 2 to {MOST} runs; received {len(results)}")
    named = tuple(distinct_names(results, names))
    summaries = tuple(map(summarise, results))
    return Comparison(named, tuple(results), summaries, differences(results))


def _text(value) -> str:
    return translated("not given") if value is None else str(value)


def _number(rows: list[tuple[str, str]]) -> dict[tuple[str, int], str]:
    """Values by label, the second of two equal labels ("Final rate") apart from the first."""
    found: dict[tuple[str, int], str] = {}
    for label, value in rows:
        found[label, sum(label == known for known, _ in found)] = value
    return found


def _labels(compared: Comparison) -> list[str]:
    """Names for the legend; with the value where a single key differs."""
    if len(compared.changed) != 1:
        return list(compared.names)
    ((key, values),) = compared.changed.items()
    text = f"{key.rpartition('.')[2]} "
    return [
        name if isinstance(value, list | dict) else f"{name}: {text}{_text(value)}"
        for name, value in zip(compared.names, values, strict=True)
    ]


def _panels(names, views: list[View]) -> list[Panel]:
    """The panels that apply to all runs."""
    rates = [rate_size(view.result).values for view in views]
    momenta = [np.linalg.norm(view.values("momentum_inertial"), axis=1) for view in views]
    factor, unit = choose_prefix(np.concatenate(momenta), "N m s")
    panels = [
        _panel(
            names, views, rates, message("Absolute rate"), message("|ω| [{unit}]", unit="deg/s")
        ),
        _panel(
            names,
            views,
            [factor * m for m in momenta],
            message("Angular momentum"),
            message("|L| [{unit}]", unit=unit),
        ),
    ]
    errors = [find_attitude_error(view.result) for view in views]
    known = [error.angle_deg for error in errors if error is not None]
    if len(known) == len(views):
        title, label = message("Attitude error angle"), message("[{unit}]", unit="deg")
        panels.insert(0, _panel(names, views, known, title, label))
    wheels = [recorded_wheels(view.result, view.scenario) for view in views]
    if all(each is not None for each in wheels):
        shares = [100.0 * each.momentum_shares.max(axis=1) for each in wheels if each is not None]
        title = message("Most loaded wheel, share of its momentum limit")
        panels.append(_panel(names, views, shares, title, "[%]", log=False))
    return panels


def _panel(names, views, series, title: str, y_label: str, log: bool = True) -> Panel:
    """A panel with a line for each run; logarithmic over the decades worth showing."""
    top = max(float(np.nanmax(y, initial=0.0)) for y in series)
    least = max(
        min((float(np.nanmin(y[y > 0.0], initial=np.inf)) for y in series), default=np.inf),
        top * 10.0**-_DECADES,
    )
    log = log and np.isfinite(least) and top > 3.0 * least
    lines = tuple(
        mean_line(name, view.t_s, np.where(y > 0.0, y, np.nan) if log else y, colour, 1.2)
        for name, view, y, colour in zip(names, views, series, RUNS, strict=False)
    )
    y_range = (0.8 * least, 1.25 * top) if log else (-0.04 * top, 1.08 * top or 1.0)
    return Panel(title, y_label, lines, log=log, y_range=y_range)
