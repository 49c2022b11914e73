"""The cone of the averaged field and the paths of field vectors: PNG and an HTML page."""

import math
from pathlib import Path

import mpl_toolkits.mplot3d  # noqa: F401  (makes the projection known)
import numpy as np
import xarray as xr

from torquer.analysis.field.cone import ConeShape, cone_in
from torquer.report.common.figure import INK, SMALL, place, quiet, save_figure, sheet
from torquer.report.common.html import card, cards
from torquer.report.common.interactive import layout
from torquer.report.common.space import line, scene, xyz
from torquer.report.field.along import COLOURS
from torquer.simulation.results.file import put

_CONE = "#9aa7b0"
_UPRIGHT, _NODE = "Earth's axis", "ascending node"
#: Placement of labels at line ends: for matplotlib (anchor of the text), for plotly.
_LEFT = ("right", "center"), "middle left"
_SIDES = {
    _UPRIGHT: (("center", "bottom"), "top center"),
    _NODE: (("center", "top"), "bottom center"),
}
#: Elevation and azimuth [deg] in Y of the initial view.
_EYE = (16.0, 32.0)
#: Cosine of the angle from which on two directions have one name.
_NEARLY = math.cos(math.radians(20.0))
_AROUND = np.radians(np.arange(0.0, 361.0, 5.0))


def draw_cone(paths: xr.Dataset, path: Path) -> Path:
    """Left: 3D view in the axes Y. Right: view along the cone axis; of what `field_cone` found."""
    figure, shape = sheet(11.0, 5.5, f"Field cone · {paths.attrs['title']}"), cone_in(paths)
    space = place(figure, 0.0, 0.5, 5.75, 4.85, projection="3d", computed_zorder=False)
    flat = place(figure, 6.45, 0.72, 4.25, 4.25)
    handles = _draw_space(space, paths, shape)
    _draw_flat(flat, paths, shape)
    figure.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.005, 0.0),
        ncols=4,
        frameon=False,
        fontsize=SMALL,
        handlelength=1.4,
        columnspacing=1.3,
    )
    return save_figure(figure, path)


def _draw_space(axes, paths: xr.Dataset, shape: ConeShape) -> list:
    b, rim = 1e6 * paths["b_y"].values, shape.rim_ut()
    surface = [np.outer([0.0, 1.0], rim[:, k]) for k in range(3)]
    axes.plot_surface(*surface, color=_CONE, alpha=0.22, lw=0, shade=False, zorder=1)
    for tip in rim[:: len(rim) // 12]:
        axes.plot(*zip((0, 0, 0), tip, strict=True), color=_CONE, lw=0.5, alpha=0.7, zorder=2)
    axes.plot(*rim.T, color=_CONE, lw=1.2, zorder=2)
    handles = []
    for m, name in enumerate(paths["model"].values.tolist()):
        colour = COLOURS[m % len(COLOURS)]
        handles += axes.plot(*b[m].T, color=colour, lw=1.6, label=name, zorder=4)
    directions = _directions(paths, shape)
    for _, tip, style in directions:
        axes.plot(*zip((0, 0, 0), tip, strict=True), color=INK, lw=0.9, ls=style, zorder=3)
    for names, tip in named_once(directions):
        ha, va = _SIDES.get(names[0], _LEFT)[0]
        text = "\n".join(names)
        axes.text(*(1.04 * tip), text, fontsize=SMALL, color=INK, zorder=6, ha=ha, va=va)
    tips = np.array([tip for _, tip, _ in directions])
    _frame_space(axes, np.vstack([b.reshape(-1, 3), rim, np.zeros((1, 3)), tips]))
    return handles


def _directions(paths: xr.Dataset, shape: ConeShape) -> list[tuple[str, np.ndarray, object]]:
    """Name, tip in Y [µT] and line style of the reference directions."""
    size = 1e6 * max(paths["strength"].values.max(), shape.b0_t)
    cone_axis = f"cone axis, Θ = {shape.half_angle_deg:.1f}°"
    return [
        (_UPRIGHT, size * np.array([0.0, 0.0, 1.0]), "-"),
        (_NODE, 1.0 * size * np.array([1.0, 0.0, 0.0]), "-"),
        (cone_axis, 0.95 * size * shape.axis_y, (0, (4, 2))),
        ("orbit normal", size * shape.normal_y, ":"),
    ]


def named_once(directions) -> list[tuple[list[str], np.ndarray]]:
    """Names of the directions at their tips; those that nearly coincide have one place."""
    found: list[tuple[list[str], np.ndarray]] = []
    for name, tip, _ in directions:
        near = [names for names, other in found if _cosine(tip, other) > _NEARLY]
        near[0].append(name) if near else found.append(([name], tip))
    return found


def _cosine(a, b) -> float:
    return float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))


def _frame_space(axes, points) -> None:
    """Reference directions instead of axes; equal scales, everything in view."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low).max()
    for limits, centre in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), middle, strict=True):
        limits(centre - half, centre + half)
    axes.set_axis_off()
    axes.set_box_aspect((1, 1, 1), zoom=1.4)
    axes.view_init(elev=_EYE[0], azim=_EYE[1])


def _draw_flat(axes, paths: xr.Dataset, shape: ConeShape) -> None:
    """Components perpendicular to the cone axis."""
    b = 1e6 * paths["b_y"].values @ shape.y_from_z
    quiet(axes)
    radius = 1e6 * shape.b0_t * math.sin(math.radians(shape.half_angle_deg))
    axes.fill(radius * np.cos(_AROUND), radius * np.sin(_AROUND), color=_CONE, alpha=0.18, lw=0)
    for m in range(len(b)):
        axes.plot(*b[m, :, :2].T, color=COLOURS[m % len(COLOURS)], lw=1.5)
        axes.plot(*b[m, 0, :2], "o", ms=4, color=COLOURS[m % len(COLOURS)])
    axes.plot(0.0, 0.0, "+", ms=9, color=INK)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("View along the cone axis; dots: start", loc="left", fontsize=9.5, color=INK)
    axes.set_xlabel("Z1 [µT]", fontsize=SMALL)
    axes.set_ylabel("Z2 [µT]", fontsize=SMALL)


def write_cone_page(paths: xr.Dataset, path: Path) -> Path:
    """Write the same view as a self-contained interactive page."""
    shape = cone_in(paths)
    caption = (
        "Path of the field vector over the orbit in the axes Y: Y3 is the Earth's axis, Y1 points "
        "to the ascending node. Grey: cone of the averaged field, half-angle "
        f"{shape.half_angle_deg:.2f} deg, magnitude {1e6 * shape.b0_t:.2f} µT. Drag to rotate; "
        "click a legend entry to hide it."
    )
    figure = {"figure": cone_figure(paths), "words": "The field along the orbit."}
    title = f"Field cone · {paths.attrs['title']}"
    made = cards(title, [card("cone", "Field along the orbit", caption, figure)])
    return put(path, made)


def cone_figure(paths: xr.Dataset) -> dict:
    """The plotly figure: cone, paths with the argument of latitude on hover, directions."""
    shape = cone_in(paths)
    data = [*_cone_traces(shape), *_path_traces(paths)]
    data += [_axis_trace(name, tip) for name, tip, _ in _directions(paths, shape)]
    eye = np.radians(_EYE)
    across = 1.7 * math.cos(eye[0])
    camera = (across * math.cos(eye[1]), across * math.sin(eye[1]), 1.7 * math.sin(eye[0]))
    margin = {"l": 0, "r": 0, "t": 30, "b": 0}
    # (a list of frames, even an empty one, marks the figure as one in 3D for the page's script)
    return {
        "data": data,
        "frames": [],
        "layout": layout(640, scene=scene(camera, "data"), margin=margin),
    }


def _cone_traces(shape: ConeShape) -> list[dict]:
    """The surface, and its rim with lines from the tip."""
    rim = shape.rim_ut()
    count = len(rim)
    surface = {
        "type": "mesh3d", **xyz([np.zeros(3), *rim]), "i": [0] * (count - 1),
        "j": list(range(1, count)), "k": list(range(2, count + 1)), "color": _CONE,
        "opacity": 0.25, "hoverinfo": "skip", "name": "cone", "showlegend": True,
        "legendgroup": "cone", "lighting": {"ambient": 1.0, "diffuse": 0.0},
    }  # fmt: skip
    spokes = [point for tip in rim[:: count // 12] for point in (np.zeros(3), tip)]
    hidden = {"hoverinfo": "skip", "showlegend": False, "legendgroup": "cone"}
    return [surface, line([*spokes, *rim], _CONE, 1.5, "cone", **hidden)]


def _path_traces(paths: xr.Dataset) -> list[dict]:
    shown = np.unique(np.linspace(0, paths.sizes["time"] - 1, 3000).round().astype(int))
    b, strength = 1e6 * paths["b_y"].values, 1e6 * paths["strength"].values
    u_deg = np.round(paths["argument_of_latitude"].values[shown], 1).tolist()
    return [
        line(
            b[m, shown],
            COLOURS[m % len(COLOURS)],
            5,
            name,
            customdata=u_deg,
            text=[f"{size:.2f}" for size in strength[m, shown]],
            hovertemplate="u = %{customdata}°, |B| = %{text} µT",
        )
        for m, name in enumerate(paths["model"].values.tolist())
    ]


def _axis_trace(name: str, tip) -> dict:
    return line([np.zeros(3), tip], "#808080", 3, name) | {
        "mode": "lines+text", "text": ["", name], "hoverinfo": "skip", "showlegend": False,
        "textfont": {"size": 12, "color": "#808080"}, "textposition": _SIDES.get(name, _LEFT)[1],
    }  # fmt: skip
