"""The motion in space: body, field, momentum and Sun in the inertial frame, frame by frame."""

import math
from dataclasses import dataclass

import numpy as np

from torquer.base.language import Message, message, told, translated
from torquer.report.common.colours import AXES, GREY, ORANGE, PINK, SKY
from torquer.report.common.scales import clock_for
from torquer.report.common.space import animate, line, xyz
from torquer.report.flight.view import View

#: Rotation of the body [deg] between frames that the eye follows easily.
_EASY_DEG = 20.0
_START, _MIDDLE, _END = 50, 40, 60
_HEIGHT_PX = 600
#: Corners of a cube by signs, and its twelve triangles.
_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_TRIANGLES = np.array([
    (0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
])  # fmt: skip


@dataclass(frozen=True)
class Chapter:
    """Frames evenly spaced in time, with a description of their spacing."""

    name: str
    description: str
    t_s: np.ndarray


def chapters(view: View) -> tuple[Chapter, ...]:
    """Instants to show: evenly spaced if the eye can follow, else in three chapters.

    A tumbling body rotates hundreds of times while it is braked. At the start and at the end the
    frames resolve every rotation; between them they are snapshots.
    """
    count, end = _START + _MIDDLE + _END, view.end_s
    if end == 0.0:
        return (Chapter(message("The only record"), message("one instant"), np.zeros(1)),)
    fastest = math.degrees(float(view.rate.max()))
    if fastest * end / (count - 1) <= _EASY_DEG:
        return (_chapter(view, message("Whole run"), np.linspace(0.0, end, count)),)
    opening = _opening_s(view)
    closing = _closing_s(view, opening)
    first = _chapter(view, message("Start"), np.linspace(0.0, opening, _START))
    between = np.linspace(opening, end - closing, _MIDDLE + 2)[1:-1]
    remark = message("snapshots: the body rotates further between frames")
    middle = _chapter(view, message("Middle"), between, remark)
    last = _chapter(view, message("End"), np.linspace(end - closing, end, _END))
    return (first, middle, last)


def _chapter(
    view: View, name: str, t_s, remark: str = message("every rotation resolved")
) -> Chapter:
    """A chapter; at recorded instants only where they are too far apart to interpolate."""
    rows = np.clip(np.searchsorted(view.t_s, [t_s[0], t_s[-1]]), 0, len(view.t_s) - 1)
    if not view.can_follow(max(int(rows[0]) - 1, 0), int(rows[1]) + 1):
        nearest = np.searchsorted(view.t_s, t_s - 0.5 * view.record_s)
        t_s = view.t_s[np.unique(np.clip(nearest, 0, len(view.t_s) - 1))]
        remark = message("records too far apart to resolve each rotation")
    spacing = (t_s[-1] - t_s[0]) / max(len(t_s) - 1, 1)
    about = message("frames {time} apart, {remark}", time=spell(spacing, 3), remark=remark)
    return Chapter(name, about, t_s)


def spell(seconds: float, digits: int = 4) -> Message:
    clock = clock_for(seconds)
    number = f"{seconds / clock.seconds:.{digits}g}"
    return message("{number} {unit}", number=number, unit=clock.unit)


def _opening_s(view: View) -> float:
    """Length of the first chapter [s]: small rotations, a third of the run at most."""
    rate = math.degrees(float(view.rate[: max(2, len(view.rate) // 50)].max()))
    return min((_START - 1) * _EASY_DEG / rate if rate > 0.0 else math.inf, view.end_s / 3.0)


def _closing_s(view: View, opening: float) -> float:
    """Length of the last chapter [s]: the longest in which the rotation is easy to follow."""
    rate = np.degrees(view.rate)
    longest = 0.6 * (view.end_s - opening)
    for length in longest * 0.8 ** np.arange(60):
        fastest = float(rate[view.t_s >= view.end_s - length].max())
        if fastest * length / (_END - 1) <= _EASY_DEG:
            return float(length)
    return float(longest * 0.8**60)


def scene_figure(view: View) -> dict:
    """The figure with its frames, play button, slider and a button for each chapter."""
    parts = chapters(view)
    t = np.concatenate([part.t_s for part in parts])
    moving = _moving(view, t)
    began = np.cumsum([0, *(len(part.t_s) for part in parts)]).tolist()
    return animate(
        [_great_circles(), _momentum_path(view)],
        moving,
        _full_traces(moving[0]),
        _labels(view, parts),
        jumps=zip((told(part.name) for part in parts), began, strict=False)
        if len(parts) > 1
        else (),
        height_px=_HEIGHT_PX,
        eye=(1.0, 1.0, 0.6),
        axis={"range": [-1.12, 1.12]},
        aspectmode="cube",
    )


def units(vectors) -> np.ndarray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0.0)


def _moving(view: View, t) -> list[list[dict]]:
    """Moving traces for each instant: the box, its axes and the directions."""
    turn = view.to_inertial(t)
    corners = np.einsum("nij,kj->nki", turn, _box(view))
    dark = np.interp(t, view.t_s, view.values("sunlit_fraction")) < 0.5
    arrows = [(name, colour, turn[:, :, i], None) for i, (name, colour) in enumerate(AXES)]
    arrows += [
        ("B", PINK, units(view.at("b_inertial", t)), None),
        ("L", GREY, units(view.at("momentum_inertial", t)), None),
        (message("nadir"), SKY, -units(view.at("position_inertial", t)), None),
        (message("Sun"), ORANGE, units(view.at("sun_inertial", t)), dark),
    ]
    return [
        [{"type": "mesh3d", **xyz(corners[n])}, *(_arrow(a, n) for a in arrows)]
        for n in range(len(t))
    ]


def _box(view: View) -> np.ndarray:
    """Corners [8, 3] in body axes of the homogeneous box that has the body's inertia, scaled."""
    moments, axes = view.scenario.spacecraft.body.principal()
    squares = np.maximum(moments.sum() - 2.0 * moments, 1e-3 * moments.sum())
    edges = np.sqrt(squares)
    return (_CORNERS * (0.32 * edges / edges.max())) @ axes.T


def _arrow(arrow, n: int) -> dict:
    name, colour, tips, dark = arrow
    if dark is not None and dark[n]:
        colour = GREY
    own = name in ("x", "y", "z")  # thicker, with smaller tips
    return {
        "type": "scatter3d",
        **xyz([np.zeros(3), tips[n]]),
        "name": name,
        "line": {"color": colour, "width": 7 if own else 4},
        "marker": {"color": colour, "size": [0, 3 if own else 5]},
    }


def _full_traces(traces: list[dict]) -> list[dict]:
    """Full traces for the first picture."""
    mesh, *arrows = traces
    i, j, k = (column.tolist() for column in _TRIANGLES.T)
    body = {
        **mesh, "i": i, "j": j, "k": k, "color": "#9aa7b0", "opacity": 0.55, "flatshading": True,
        "hoverinfo": "skip", "name": translated("body"),
    }  # fmt: skip
    labels = {"mode": "lines+markers+text", "textposition": "top center", "hoverinfo": "name"}
    colours = dict(AXES) | {"B": PINK, "nadir": SKY, "Sun": ORANGE}

    def text(name: str) -> dict:
        shown = told(name)
        return {
            "name": shown,
            "text": ["", shown],
            "textfont": {"size": 13, "color": colours.get(name, GREY)},
        }

    return [body, *(arrow | labels | text(arrow["name"]) for arrow in arrows)]


def _great_circles() -> dict:
    """Three great circles in the planes of the inertial axes, to give depth."""
    u = np.append(np.linspace(0.0, 2.0 * np.pi, 61), np.nan)
    c, s, o = np.cos(u), np.sin(u), np.where(np.isnan(u), np.nan, 0.0)
    points = np.transpose([np.concatenate(parts) for parts in ((c, c, o), (s, o, c), (o, s, s))])
    return line(
        points, "rgba(128,128,128,0.7)", 1.5, translated("inertial planes"), hoverinfo="skip"
    )


def _momentum_path(view: View) -> dict:
    """Where the angular momentum has pointed during the whole run."""
    rows = np.unique(np.linspace(0, len(view.t_s) - 1, 600).astype(int))
    path = units(view.values("momentum_inertial")[rows])
    return line(path, "rgba(118,118,118,0.7)", 2, translated("path of L"), hoverinfo="skip")


def _labels(view: View, parts: tuple[Chapter, ...]) -> list[str]:
    rates = np.degrees(view.rate)
    return [
        translated(
            "{name}: {time}, {rate:.3g} {unit}",
            name=part.name,
            time=spell(at),
            rate=np.interp(at, view.t_s, rates),
            unit="deg/s",
        )
        for part in parts
        for at in part.t_s
    ]
