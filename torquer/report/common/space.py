"""Figures in space: lines, hidden axes; traces that move, with a slider and buttons to play."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from torquer.report.common.interactive import layout


def animate(
    still: list[dict],
    moving: list[list[dict]],
    first: list[dict],
    labels: Sequence[str],
    *,
    jumps: Iterable[tuple[str, int]] = (),
    height_px: int,
    eye: tuple[float, float, float],
    axis: dict,
    aspectmode: str,
) -> dict:
    """The figure of traces that stay and traces that move, which are given for each frame.

    `first`: the moving traces in full; `labels`: of the frames; `jumps`: names of frames, each with
    its number; `axis`: keys of all three axes, which are hidden.
    """
    traces = list(range(len(still), len(still) + len(first)))
    frames = [
        {"name": str(i), "data": [_changing(trace) for trace in data], "traces": traces}
        for i, data in enumerate(moving)
    ]
    many = len(moving) > 1
    look = layout(
        height_px,
        scene=scene(eye, aspectmode, **axis),
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        showlegend=False,
        sliders=[_slider(labels)] if many else [],
        updatemenus=_buttons(jumps) if many else [],
    )
    return {"data": [*still, *first], "frames": frames, "layout": look}


def scene(eye: Iterable[float], aspectmode: str, **axis) -> dict:
    """A scene seen from `eye`, its three axes hidden; `axis`: further keys of each."""
    hidden = {"visible": False, **axis}
    return {
        "xaxis": hidden, "yaxis": hidden, "zaxis": hidden, "aspectmode": aspectmode,
        "camera": {"eye": dict(zip("xyz", eye, strict=True))}, "dragmode": "orbit",
    }  # fmt: skip


def line(points, colour: str, width: float, name: str, **keys) -> dict:
    """A line through points [n, 3], broken where they are not numbers."""
    return {
        "type": "scatter3d", "mode": "lines", **xyz(points), "name": name,
        "line": {"color": colour, "width": width}, **keys,
    }  # fmt: skip


def xyz(points, digits: int = 3) -> dict:
    """Columns of points [n, 3] as plotly takes them, None for a gap."""
    columns = zip("xyz", np.round(np.transpose(points), digits).tolist(), strict=True)
    return {name: [None if math.isnan(v) else v for v in column] for name, column in columns}


def _changing(trace: dict) -> dict:
    """The changing part of a trace. (Labels must not change: plotly would rescale them.)"""
    keys = ("type", "x", "y", "z") + (("line", "marker") if trace.get("name") == "Sun" else ())
    return {key: trace[key] for key in keys}


def _slider(labels: Sequence[str]) -> dict:
    steps = [
        {"label": label, "method": "animate", "args": [[str(i)], _at_once()]}
        for i, label in enumerate(labels)
    ]
    return {
        "active": 0, "steps": steps, "x": 0.03, "len": 0.94, "y": 0.08, "yanchor": "top",
        "pad": {"t": 6, "b": 6}, "ticklen": 0, "minorticklen": 0,
        "font": {"color": "rgba(0,0,0,0)", "size": 1},
        "currentvalue": {"font": {"size": 13, "color": "#808080"}, "xanchor": "left"},
    }  # fmt: skip


def _at_once(duration_ms: int = 0, **keys) -> dict:
    frame = {"duration": duration_ms, "redraw": True}
    return {"mode": "immediate", "frame": frame, "transition": {"duration": 0}, **keys}


def _buttons(jumps: Iterable[tuple[str, int]]) -> list[dict]:
    """Play, pause, and jumps to frames."""

    def button(label: str, frames, **keys) -> dict:
        return {"label": label, "method": "animate", "args": [frames, _at_once(**keys)]}

    look = {
        "type": "buttons", "direction": "left", "yanchor": "top", "y": 1.0, "showactive": False,
        "bgcolor": "rgba(128,128,128,0.15)", "bordercolor": "rgba(128,128,128,0.4)",
    }  # fmt: skip
    play = button("▶ play", None, duration_ms=110, fromcurrent=True)
    pair = [play, button("❚❚ pause", [None])]
    menus = [{**look, "x": 0.01, "xanchor": "left", "buttons": pair}]
    if named := [button(name, [str(frame)]) for name, frame in jumps]:
        menus.append({**look, "x": 0.99, "xanchor": "right", "buttons": named})
    return menus
