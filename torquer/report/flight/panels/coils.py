"""Dipole of the coils over time."""

from dataclasses import replace

import numpy as np

from torquer.analysis.budget import coil_reach
from torquer.analysis.control_cycle import acting_rows
from torquer.base.language import joined, message
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.panels.panel import (
    MEASUREMENT,
    Level,
    Panel,
    Picture,
    whole,
    xyz,
)
from torquer.report.flight.view import View, known


def _reach_levels(view: View) -> tuple[Level, ...]:
    """Limits along each axis, one mark for all axes that share it."""
    reach = np.round(coil_reach(known(view.scenario.spacecraft.coils)), 9)
    levels = []
    for value in dict.fromkeys(reach.tolist()):
        axes = "".join(name for name, r in zip("xyz", reach, strict=True) if r == value)
        label = message("limit") if axes == "xyz" else message("limit {axes}", axes=axes)
        levels += [Level(value, label), Level(-value, "")]
    return tuple(levels)


def dipole_whole(view: View) -> Panel:
    """Dipole during actuation, over the whole run."""
    control, acting = view.scenario.control, acting_rows(view.scenario, view.t_s)
    title = (
        message("Dipole during actuation")
        if control.measure_s > 0.0
        else message("Dipole of the coils")
    )
    if acting.size == 0:
        acting, title = np.arange(len(view.t_s)), message("Dipole at the recorded instants")
    m, reach = view.values("dipole_body")[acting], coil_reach(known(view.scenario.spacecraft.coils))
    keys = {"levels": _reach_levels(view), "y_range": (-1.15 * reach.max(), 1.15 * reach.max())}
    factor, unit = 1.0, "A m²"
    if 0.0 < np.abs(m).max() < 0.25 * reach.min():
        # distant limits would flatten the lines
        (factor, unit), keys = choose_prefix(m, unit), {}
        title = message(
            "{title}, far below the limit of {limit:.3g} A m²", title=title, limit=reach.min()
        )
    lines = xyz(view.t_s[acting], factor * m, width=0.8)
    if control.measure_s == 0.0 and known(view.scenario.spacecraft.coils).lag_s == 0.0:
        lines = tuple(
            line if line.series.stretch_s else replace(line, style="steps") for line in lines
        )
    return whole(view, title, message("m [{unit}]", unit=unit), lines, **keys)


def dipoles(view: View) -> Picture:
    """Dipole of the coils in body axes: the whole run, the first cycles and the last ones."""
    control = view.scenario.control
    caption = message("Dashed: largest dipole of the coil set along a body axis.")
    if control.measure_s > 0.0:
        cycle = message(
            "The coils are on for {on:g} s of every {cycle:g} s. The panel of the whole run shows "
            "the dipole during actuation, the others single cycles.",
            on=control.actuate_s,
            cycle=control.cycle_s,
        )
    else:
        cycle = message(
            "The dipole is held constant for {sample:g} s between samples.", sample=control.sample_s
        )
    caption = joined(" ", [caption, cycle])
    panels = (dipole_whole(view), *_cycles(view))
    return Picture("dipoles", message("Dipole of the coils"), caption, panels)


def _cycles(view: View, count: int = 6) -> tuple[Panel, ...]:
    """First and last cycles, if records are close enough to show them."""
    control, span = view.scenario.control, count * view.scenario.control.cycle_s
    shortest = control.sample_s
    if control.measure_s and control.actuate_s:
        shortest = min(control.measure_s, control.actuate_s)
    if view.record_s > shortest * (1.0 + 1e-9) or view.end_s < span:
        return ()
    first = _cycle_panel(view, message("The first {count} cycles", count=count), 0, span)
    if view.end_s < 4.0 * span:
        return (first,)
    began = int((view.end_s - span) // control.cycle_s) * control.cycle_s
    return (
        first,
        _cycle_panel(view, message("The last {count} cycles", count=count), began, began + span),
    )


def _cycle_panel(view: View, title: str, began: float, ended: float) -> Panel:
    control = view.scenario.control
    rows = (view.t_s >= began - 1e-6) & (view.t_s <= ended + 1e-6)
    m = view.values("dipole_body")[rows]
    factor, unit = choose_prefix(m, "A m²")
    style = "steps" if known(view.scenario.spacecraft.coils).lag_s == 0.0 else "line"
    near = np.abs(m).max() > 0.5 * coil_reach(known(view.scenario.spacecraft.coils)).min()
    reach = _reach_levels(view) if near else ()
    levels = tuple(Level(factor * level.y, level.label) for level in reach)
    starts = np.arange(began, ended - 1e-6, control.cycle_s)
    bands = tuple((s, s + control.measure_s) for s in starts.tolist()) if control.measure_s else ()
    lines = xyz(view.t_s[rows], factor * m, style, width=1.3)
    return Panel(
        title,
        message("m [{unit}]", unit=unit),
        lines,
        levels,
        window=(began, ended),
        bands=bands,
        bands_label=MEASUREMENT,
    )
