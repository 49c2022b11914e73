"""The Earth, the last revolution around it and the field line through the satellite, in J."""

import numpy as np

from torquer.analysis.field.lines import field_lines
from torquer.base.language import told, translated
from torquer.report.common.colours import AXES, GREY, ORANGE, PINK
from torquer.report.common.space import animate, line
from torquer.report.flight.scene import spell, units
from torquer.report.flight.view import View

_FRAMES = 61
_HEIGHT_PX = 560
_RADIUS_M = 6.371e6
#: Length of the body axes, and distance of the Sun's mark [Earth radii].
_AXIS, _SUN = 0.35, 2.0
#: Night and day side.
_SHADES = [[0.0, "#2b3a55"], [0.45, "#2b3a55"], [0.55, "#7fb0d6"], [1.0, "#9fcbe8"]]


def shown_times(view: View) -> np.ndarray:
    """Instants of the frames [s]: the last revolution, or the whole of a shorter run."""
    began = max(0.0, view.end_s - view.revolution_s)
    return np.linspace(began, view.end_s, _FRAMES if view.end_s > 0.0 else 1)


def orbit_figure(view: View) -> dict:
    """The figure with its frames, play button and slider."""
    t = shown_times(view)
    r = view.at("position_inertial", t)
    moving = _moving(view, t, r)
    return animate(
        [
            _earth(view, t[0]),
            _equator(),
            _line(r / _RADIUS_M, GREY, 3, translated("orbit")),
            _sun(view, t[0]),
        ],
        moving,
        moving[0],
        [told(spell(float(at))) for at in t],
        height_px=_HEIGHT_PX,
        eye=(0.9, 0.9, 0.5),
        axis={},
        aspectmode="data",
    )


def _line(points, colour: str, width: float, name: str) -> dict:
    return line(points, colour, width, name, hoverinfo="name")


def _earth(view: View, t_s: float) -> dict:
    """The sphere, its day side light."""
    lat, lon = np.radians(np.linspace(-90.0, 90.0, 25)), np.radians(np.linspace(0.0, 360.0, 49))
    parts = (np.outer(np.cos(lat), np.cos(lon)), np.outer(np.cos(lat), np.sin(lon)),
             np.outer(np.sin(lat), np.ones_like(lon)))  # fmt: skip
    sun = units(view.at("sun_inertial", np.array([t_s])))[0]
    light = sum(part * component for part, component in zip(parts, sun, strict=True))
    x, y, z = (np.round(part, 3).tolist() for part in parts)
    return {
        "type": "surface", "x": x, "y": y, "z": z, "surfacecolor": np.round(light, 3).tolist(),
        "colorscale": _SHADES, "cmin": -1.0, "cmax": 1.0, "showscale": False, "opacity": 1.0,
        "hoverinfo": "skip", "name": translated("Earth"),
        "lighting": {"ambient": 0.9, "diffuse": 0.1, "specular": 0.0},
    }  # fmt: skip


def _equator() -> dict:
    u = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = 1.005 * np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=1)
    axis = [[np.nan] * 3, [0.0, 0.0, 1.0], [0.0, 0.0, 1.25]]
    return _line([*circle, *axis], "rgba(128,128,128,0.9)", 2, translated("equator and axis"))


def _sun(view: View, t_s: float) -> dict:
    """From the Earth's surface towards the Sun."""
    sun = units(view.at("sun_inertial", np.array([t_s])))[0]
    name = translated("Sun")
    trace = _line([1.0 * sun, _SUN * sun], ORANGE, 4, name)
    return trace | {
        "mode": "lines+text", "text": ["", name], "textfont": {"size": 13, "color": ORANGE}
    }  # fmt: skip


def _moving(view: View, t, r) -> list[list[dict]]:
    """Moving traces for each instant: the body's axes and the field line."""
    turn, at = view.to_inertial(t), r / _RADIUS_M
    lines = field_lines(view.scenario.orbit_environment(), t, r, view.at("velocity_inertial", t))
    found = []
    for n in range(len(t)):
        traces = [
            _line([at[n], at[n] + _AXIS * turn[n, :, i]], colour, 6, name)
            for i, (name, colour) in enumerate(AXES)
        ]
        if lines is not None:
            inside = lines[n][np.isfinite(lines[n, :, 0])] / _RADIUS_M
            traces.append(_line(inside, PINK, 3, translated("field line")))
        found.append(traces)
    return found
