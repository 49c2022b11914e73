"""The geomagnetic field in body axes, and the magnetometer's readings."""

from dataclasses import replace

import numpy as np

from torquer.analysis.control_cycle import fresh_rows
from torquer.base.language import message
from torquer.report.common.colours import GREY
from torquer.report.common.scales import choose_prefix
from torquer.report.flight.panels.panel import (
    Panel,
    Picture,
    make_line,
    whole,
    xyz,
)
from torquer.report.flight.view import View


def field(view: View) -> Picture:
    """Field in body axes, the first rotations in detail, and the magnetometer error."""
    b = 1e6 * view.values("b_body")
    size = make_line("|B|", view.t_s, np.linalg.norm(b, axis=1), GREY, 1.6)
    lines = (*xyz(view.t_s, b, width=0.6), size)
    panel = whole(view, message("Field in body axes"), message("B [{unit}]", unit="µT"), lines)
    caption = message(
        "The field at the magnetometer. Readings are compared with the truth only at records that "
        "coincide with a sampling instant; between samples the last reading is held."
    )
    panels = (panel, *_first_turns(view), *_reading_errors(view))
    return Picture("field", message("Geomagnetic field"), caption, panels)


def _first_turns(view: View, turns: float = 4.0) -> tuple[Panel, ...]:
    """Field and readings over the first few rotations, if those are a small part of the run."""
    if view.rate[0] == 0.0:
        return ()
    end = turns * 2.0 * np.pi / view.rate[0]
    count = int(np.count_nonzero(view.t_s <= end))
    if end > 0.2 * view.end_s or not view.can_follow(0, count + 1):
        return ()
    t = np.linspace(0.0, end, 400)
    b = 1e6 * np.einsum("nji,nj->ni", view.to_inertial(t), view.at("b_inertial", t))
    fresh = fresh_rows(view.scenario, view.t_s)
    fresh = fresh[view.t_s[fresh] <= end]
    dots = xyz(view.t_s[fresh], 1e6 * view.values("b_measured")[fresh], "dots")
    dots = tuple(replace(line, label=message("{line} measured", line=line.label)) for line in dots)
    title = message("First rotations: truth (lines) and readings (dots)")
    label = message("B [{unit}]", unit="µT")
    return (Panel(title, label, (*xyz(t, b, width=1.2), *dots), window=(0.0, end)),)


def _reading_errors(view: View) -> tuple[Panel, ...]:
    """Reading minus truth, where there is a fresh reading and it is not perfect."""
    rows = fresh_rows(view.scenario, view.t_s)
    truth = view.values("b_body")[rows]
    errors = view.values("b_measured")[rows] - truth
    if rows.size == 0 or np.abs(errors).max() <= 1e-6 * np.abs(truth).max():
        return ()
    factor, unit = (
        choose_prefix(1e9 * errors, "nT") if np.abs(errors).max() < 1e-6 else (1e-3, "µT")
    )
    shown = 1e9 * factor * errors
    spread = ", ".join(f"{s:.3g}" for s in shown.std(axis=0))
    title = message(
        "Magnetometer error: reading minus truth (standard deviation {spread} {unit})",
        spread=spread,
        unit=unit,
    )
    dots = xyz(view.t_s[rows], shown, "dots", width=0.5)
    return (whole(view, title, message("ΔB [{unit}]", unit=unit), dots),)
