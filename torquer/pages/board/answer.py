"""What the page is sent of a run: series for its plots, key numbers, the verdict.

The answer is one block of bytes: the length of a header (4 bytes, little-endian), the header as
JSON, zeros up to a multiple of 8, then the numbers as float64, little-endian. The header's
`arrays` name them in order with their shapes.

Of a long run, each plot has the least and the greatest value of each of its lines in every interval
of a few records, so that no peak is lost; `rate.t_s` are the times of the plot `rate`. The 3D view
has every n-th record, at the times `t_s`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.analysis.attitude import attitude_error_in, body_axes_from_deg
from torquer.analysis.goals import find_goals
from torquer.analysis.verdict import judge_run, judged_series
from torquer.base.language import told
from torquer.base.strict_json import json_text
from torquer.pages.board.flown import Flown
from torquer.pages.board.words import told_all
from torquer.pages.browser.scene import scene

#: Records that the 3D view is sent at most.
MOST_POINTS = 1500
#: Intervals of a plot that have a least and a greatest value: about one for each of its pixels.
INTERVALS = 600
_RPM = 30.0 / math.pi


class Panel(NamedTuple):
    """A plot: its key, title, unit, names of its lines, their values (n, lines)."""

    key: str
    title: str
    unit: str
    lines: tuple[str, ...]
    values: np.ndarray


def make_answer(flown: Flown) -> bytes:
    """The answer for a run; plots have all records of one with at most two in each interval."""
    panels = [*make_panels(flown)]
    header = {
        "panels": [
            {
                "key": p.key,
                "title": told(p.title),
                "unit": told(p.unit),
                "lines": [told(line) for line in p.lines],
            }
            for p in panels
        ],
        "verdict": told_all(verdict_in(flown), ("headline", "limits_met")),
        "numbers": key_numbers(flown),
        "scene": scene(flown.scenario.spacecraft),
        "period_s": flown.scenario.orbit.period_s,
        "records": len(flown.t_s),
    }
    arrays = _view(flown)
    for panel in panels:
        kept = extremes(panel.values, INTERVALS)
        arrays |= {panel.key: panel.values[kept], f"{panel.key}.t_s": flown.t_s[kept]}
    return pack_answer(header, arrays)


def _view(flown: Flown) -> dict[str, np.ndarray]:
    """What the 3D view shows: attitude, rate [deg/s] and dipole at the times `t_s`."""
    kept = _every_nth(len(flown.t_s), MOST_POINTS)
    return {
        "t_s": flown.t_s[kept],
        "q": flown["q_body_to_inertial"].values[kept],
        "view.rate": np.degrees(flown["omega_body"].values[kept]),
        "view.dipole": flown["dipole_body"].values[kept],
    }


def pack_answer(header: dict, arrays: dict[str, np.ndarray]) -> bytes:
    """A header and arrays as the page reads them."""
    shapes = {name: list(values.shape) for name, values in arrays.items()}
    text = json_text({**header, "arrays": shapes}, indent=None).encode()
    begin = struct.pack("<I", len(text)) + text
    begin += b"\0" * (-len(begin) % 8)
    return begin + b"".join(np.ascontiguousarray(a, "<f8").tobytes() for a in arrays.values())


def make_panels(flown: Flown) -> Iterator[Panel]:
    """All plots that apply to a run, with every record."""
    rate = np.degrees(flown["omega_body"].values)
    size = np.degrees(np.linalg.norm(flown["omega_body"].values, axis=1))
    yield Panel("rate", "rate", "deg/s", ("size", "x", "y", "z"), np.column_stack([size, rate]))
    xyz = ("x", "y", "z")
    yield Panel("dipole", "dipole of the coils", "A m²", xyz, flown["dipole_body"].values)
    error = attitude_error_in(flown, flown.scenario)
    if error is not None and error.is_held.any():
        values = np.column_stack([error.angle_deg, error.error_deg])
        yield Panel("error", "attitude error", "deg", ("size", *xyz), values)
    axes = tuple(f"{c} axis" for c in xyz)
    vertical = body_axes_from_deg(flown, "position_inertial")
    yield Panel("vertical", "angle from the local vertical", "deg", axes, vertical)
    sun = body_axes_from_deg(flown, "sun_inertial")
    yield Panel("sun", "angle from the Sun", "deg", axes, sun)
    if "wheel_speed" in flown:
        speed = flown["wheel_speed"].values * _RPM
        names = tuple(f"wheel {k}" for k in range(speed.shape[1]))
        yield Panel("wheels", "speed of the wheels", "rpm", names, speed)


def verdict_in(flown: Flown) -> dict:
    """The verdict, as the summary of a result has it."""
    scenario, goals = flown.scenario, find_goals(flown.scenario)
    return judge_run(scenario, goals, flown.t_s, judged_series(flown, scenario, goals), True)


def key_numbers(flown: Flown) -> dict[str, float]:
    """Key numbers, as the summary of a result has them."""
    rate = np.linalg.norm(flown["omega_body"].values, axis=1)
    found = {
        "simulated_s": float(flown.t_s[-1]),
        "initial_rate_deg_s": float(np.degrees(rate[0])),
        "final_rate_deg_s": float(np.degrees(rate[-1])),
    }
    coils = flown.scenario.spacecraft.coils
    if coils is not None:
        energy_j = float(flown.totals["coil_energy_j"])
        found["coil_full_power_s"] = energy_j / (coils.power_w() or 1.0)
        found["peak_coil_dipole_a_m2"] = float(flown.totals["peak_dipole_a_m2"])
    return found


def extremes(values: np.ndarray, intervals: int) -> np.ndarray:
    """Rows of `values` (n, lines), ascending, in which a line is least or greatest in its interval.

    The first and the last row are among them, and all rows if there are at most two an interval.
    """
    count, lines = values.shape
    if count <= 2 * intervals:
        return np.arange(count)
    size = -(-count // intervals)
    whole = count - count % size
    parts = values[:whole].reshape(-1, size, lines)
    begins = np.arange(0, whole, size)[:, None]
    found = [begins + each(parts, axis=1) for each in (np.argmin, np.argmax)]
    if whole < count:
        found += [whole + each(values[whole:], axis=0)[None] for each in (np.argmin, np.argmax)]
    kept = np.zeros(count, bool)
    kept[np.concatenate(found)] = True
    kept[[0, -1]] = True
    return np.flatnonzero(kept)


def _every_nth(count: int, most: int) -> np.ndarray:
    every = -(-count // most)
    kept = np.arange(0, count, every)
    return kept if kept[-1] == count - 1 else np.append(kept, count - 1)
