"""Envelopes of wheel arrays in 3D, failures, momentum build-up, sweeps of an angle, as PNG."""

import math
from pathlib import Path

import mpl_toolkits.mplot3d  # noqa: F401  (makes the projection known)
import numpy as np
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from torquer.design.wheel_design import METHODS, half_spaces
from torquer.design.wheel_file import WheelDesign
from torquer.design.wheel_sweep import Sweep
from torquer.design.wheel_tables import hours, lost_label
from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, RED
from torquer.report.common.figure import (
    INK,
    SMALL,
    legend_at_left,
    place,
    quiet,
    save_figure,
    sheet,
    stack_panels,
)
from torquer.scenario.keys import key_words
from torquer.spacecraft.wheel_array.demand import Ellipsoid
from torquer.spacecraft.wheel_array.envelope import Envelope, momentum_envelope
from torquer.spacecraft.wheel_array.rates import required_momenta

#: Elevation and azimuth [deg] from which envelopes are seen.
EYE = (18.0, -48.0)
_NAMES = ("x1", "x2", "x3")
FACE = "#7fb2d6"
_DAY = 86400.0
#: Most revolutions that a picture can resolve.
_MOST_TURNS = 100
_METHOD_NAMES = {"minimax": "minimax", "least_squares": "pseudo-inverse"}


def needed_momenta(design, report: dict) -> tuple[Ellipsoid, float]:
    """Momenta of the required rate, or of the largest guaranteed one, and that rate."""
    rate = design.demand.rate_deg_s or report["momentum"]["worst_rate_deg_s"]
    return required_momenta(np.array(design.body.inertia), math.radians(rate)), rate


def draw_all(design, report: dict, folder: Path) -> list[Path]:
    """Write envelope.png, failures.png and, if accumulation is given, accumulation.png."""
    made = [
        draw_envelope_page(design, report, folder / "envelope.png"),
        draw_failures(design, report, folder / "failures.png"),
    ]
    if design.accumulation is not None:
        made.append(draw_accumulation(design, report, folder / "accumulation.png"))
    return made


# ------------------------------------------------------------------ in space


def draw_envelope_page(design, report: dict, path: Path) -> Path:
    """Envelopes of the whole array and after the worst single failure, with the demand."""
    array, (ellipsoid, rate) = design.wheels.array(), needed_momenta(design, report)
    singles = [case for case in report["failures"] if len(case["lost"]) == 1]
    worst = min(singles, key=lambda case: case["worst_rate_deg_s"])
    figure = sheet(11.0, 5.6, f"Momentum envelope · {report['description'] or report['name']}")
    after = (array.without(*worst["lost"]), f"wheel {lost_label(worst['lost'])} failed")
    shown = ((array, "as given" if array.lost else "all wheels"), after)
    for left, (each, name) in zip((0.0, 5.5), shown, strict=True):
        axes = place(figure, left, 0.45, 5.5, 4.75, projection="3d", computed_zorder=False)
        draw_envelope(axes, momentum_envelope(each), ellipsoid, momentum_envelope(array))
        figure.text((left + 0.3) / 11.0, 1.0 - 0.5 / 5.6, name, fontsize=10.5, va="top", color=INK)
    figure.text(
        0.3 / 11.0,
        0.2 / 5.6,
        f"Blue: momentum envelope [N m s]. Orange: momentum needed to rotate at {rate:.4g} deg/s "
        "about any axis; red: outside the envelope.",
        fontsize=SMALL + 0.5,
        color=INK,
    )
    return save_figure(figure, path)


def draw_envelope(axes, envelope: Envelope, ellipsoid: Ellipsoid | None = None, frame=None) -> None:
    """An envelope with transparent faces, and an ellipsoid in it, on axes in space.

    The axes must have been made with computed_zorder=False: far faces, ellipsoid and near faces are
    drawn in this order. `frame`: another envelope to take the scale from.
    """
    elevation, azimuth = np.radians(EYE)
    eye = np.array([math.cos(elevation) * math.cos(azimuth),
                    math.cos(elevation) * math.sin(azimuth), math.sin(elevation)])  # fmt: skip
    loops = [envelope.vertices[list(face)] for face in envelope.faces]
    outward = [np.cross(loop[1] - loop[0], loop[2] - loop[1]) for loop in loops]
    near = np.array([normal @ eye > 0.0 for normal in outward], dtype=bool)
    _faces(axes, [loop for loop, n in zip(loops, near, strict=True) if not n], 0.30, 1)
    if ellipsoid is not None:
        _ellipsoid(axes, ellipsoid, envelope, eye)
    _faces(axes, [loop for loop, n in zip(loops, near, strict=True) if n], 0.22, 3)
    size = (frame or envelope).vertices
    if ellipsoid is not None:
        size = np.vstack([size, ellipsoid.matrix, -ellipsoid.matrix])
    _frame(axes, size)


def _faces(axes, loops, opacity: float, order: int) -> None:
    if not loops:
        return
    axes.add_collection3d(Poly3DCollection(loops, facecolor=FACE, alpha=opacity, zorder=order))
    width = 0.6 if order == 1 else 1.1
    lines = [np.vstack([loop, loop[:1]]) for loop in loops]
    axes.add_collection3d(Line3DCollection(lines, colors=BLUE, lw=width, zorder=order + 0.5))


def _ellipsoid(axes, ellipsoid: Ellipsoid, envelope: Envelope, eye) -> None:
    """Its near side, shaded; red outside the envelope."""
    points, triangles = ellipsoid.mesh(90, 180)
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    facing = normals @ eye
    seen = facing > 0.0
    colours = np.where(
        envelope.contains(corners[seen].mean(axis=1))[:, None], _rgb(ORANGE), _rgb(RED)
    )
    shade = 0.72 + 0.28 * facing[seen, None]
    axes.add_collection3d(
        Poly3DCollection(
            corners[seen], facecolor=colours * shade, lw=0, zorder=2, antialiased=False
        )
    )


def _rgb(colour: str) -> np.ndarray:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0


def _frame(axes, points) -> None:
    """Equal scales, limits that fit the points, labels."""
    half = 1.08 * np.abs(points).max(axis=0)
    half = np.maximum(half, 0.3 * half.max())
    limits = (axes.set_xlim, axes.set_ylim, axes.set_zlim)
    for limit, side in zip(limits, half, strict=True):
        limit(-side, side)
    axes.set_box_aspect(half, zoom=0.95)
    axes.view_init(elev=EYE[0], azim=EYE[1])
    axes.tick_params(labelsize=7, pad=-2)
    axes.locator_params(nbins=5)
    axes.locator_params(axis="x", nbins=3)
    names = (axes.set_xlabel, axes.set_ylabel, axes.set_zlabel)
    for name, text in zip(names, _NAMES, strict=True):
        name(text, fontsize=SMALL, labelpad=-4)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set_alpha(0.0)
        axis._axinfo["grid"].update(color="#e2e2e2", linewidth=0.4)


# ------------------------------------------------------------------ failures and time


def draw_failures(design, report: dict, path: Path) -> Path:
    """Bars of the rate guaranteed about any axis, for each failure case."""
    cases = report["failures"]
    height = max(2.4, 1.1 + 0.2 * len(cases))
    figure = sheet(7.2, height, "Rate about any axis after wheel failures")
    axes = place(figure, 0.85, 0.5, 6.1, height - 1.05)
    quiet(axes)
    axes.grid(False, axis="y")
    rates = [case["worst_rate_deg_s"] for case in cases]
    colours = [(BLUE, GREEN, ORANGE)[len(case["lost"])] for case in cases]
    bars = axes.barh(range(len(cases)), rates, 0.72, color=colours)
    axes.bar_label(bars, fmt="%.3f", fontsize=SMALL - 1, padding=2)
    axes.set_yticks(range(len(cases)), [lost_label(case["lost"]) for case in cases])
    axes.set_ylim(len(cases) - 0.4, -0.6)
    axes.set_xlim(0.0, 1.12 * max(*rates, design.demand.rate_deg_s or 0.0, 1e-12))
    axes.set_xlabel("rate [deg/s]", fontsize=SMALL)
    axes.set_ylabel("failed wheels", fontsize=SMALL)
    if design.demand.rate_deg_s:
        axes.axvline(design.demand.rate_deg_s, color=INK, lw=1.0, ls=(0, (4, 3)))
        figure.text(0.99, 1.0 - 0.2 / height, "dashed: required", fontsize=SMALL, ha="right",
                    va="center")  # fmt: skip
    return save_figure(figure, path)


def draw_accumulation(design, report: dict, path: Path) -> Path:
    """Momentum build-up and the share of the envelope that it takes up, until saturation.

    Over a long time the oscillation is drawn as a band.
    """
    array = design.wheels.array()
    growth = design.accumulation.growth(np.array(design.body.inertia))
    ends = [report["accumulation"][f"saturation_{m}_h"] for m in METHODS]
    end_s = 1.15 * max([3600.0 * e for e in ends if e] or [0.0]) or 5.0 * _DAY
    last = max(2, math.ceil(end_s / growth.held.period_s))
    shown = np.unique(np.linspace(0, last, min(last + 1, 160)).astype(int))
    momenta = growth.over(shown)
    figure = sheet(8.6, 5.1, f"Momentum build-up · {report['description'] or ''}")
    upper = place(figure, 0.75, 0.65, 7.6, 1.85)
    lower = place(figure, 0.75, 2.8, 7.6, 1.7)
    upper.tick_params(labelbottom=False)
    t = (shown[:, None] + np.linspace(0.0, 1.0, momenta.shape[1])) * growth.held.period_s / _DAY
    for k, colour in enumerate((RED, GREEN, BLUE)):
        _oscillation(upper, t, momenta[..., k], colour, _NAMES[k])
    for method, colour, end in reversed(list(zip(METHODS, (BLUE, ORANGE), ends, strict=True))):
        share = np.abs(momenta @ half_spaces(array, method).T).max(axis=-1)
        _oscillation(lower, t, 100.0 * share, colour, f"{_METHOD_NAMES[method]}: {hours(end)}")
    lower.axhline(100.0, color=GREY, lw=1.0, ls=(0, (4, 3)))
    for axes, label in ((upper, "momentum [N m s]"), (lower, "share of the envelope [%]")):
        quiet(axes)
        axes.set_xlim(0.0, t.max())
        axes.set_ylabel(label, fontsize=SMALL)
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False,
                    fontsize=SMALL, borderaxespad=0.1)  # fmt: skip
    lower.set_ylim(0.0, 120.0)
    lower.set_xlabel("time [days]", fontsize=SMALL)
    return save_figure(figure, path)


def _oscillation(axes, t, values, colour: str, name: str) -> None:
    """A line while its oscillations can be resolved, else a band from minimum to maximum."""
    if len(t) <= _MOST_TURNS:
        axes.plot(t.ravel(), values.ravel(), color=colour, lw=0.9, label=name)
        return
    middle = t.mean(axis=1)
    axes.fill_between(middle, values.min(axis=1), values.max(axis=1), color=colour, alpha=0.3, lw=0)
    axes.plot(middle, values.mean(axis=1), color=colour, lw=1.2, label=name)


# ------------------------------------------------------------------ a sweep


def draw_sweep(design: WheelDesign, sweep: Sweep, path: Path) -> Path:
    """Write the picture: the whole array, and the array after its worst single failure."""
    title = f"{design.description or design.name}: {key_words(sweep.key)} varied"
    figure, (upper, lower) = stack_panels(title, 2, 5.4, sharex=True)
    angles = np.array([point.value for point in sweep.points])
    for name, colour in (("whole", BLUE), ("one_failed", ORANGE)):
        able = np.array([getattr(point, name) for point in sweep.points])
        label = "all wheels" if name == "whole" else "worst single failure"
        lower.plot(angles, able[:, 0], color=colour, lw=1.6)
        upper.plot(angles, able[:, 1], color=colour, lw=1.6, label=label)
    best = sweep.best()
    upper.plot(best.value, best.whole.rate_deg_s, "o", color=BLUE, ms=5)
    upper.annotate(
        f"{best.value:.4g} deg: {best.whole.rate_deg_s:.4g} deg/s",
        (best.value, best.whole.rate_deg_s), (0, 7), textcoords="offset points", fontsize=9,
        color=INK, ha="right" if best.value > angles.mean() else "left",
    )  # fmt: skip
    if design.demand.rate_deg_s is not None:
        upper.axhline(design.demand.rate_deg_s, color=GREY, lw=1.1, ls="--", label="demand")
    upper.set_ylabel("rate about any axis [deg/s]", fontsize=10)
    lower.set_ylabel("momentum [N m s]", fontsize=10)
    lower.set_xlabel(f"{sweep.key.removesuffix('_deg')} [deg]", fontsize=10)
    for axes in (upper, lower):
        axes.set_ylim(0.0, 1.12 * axes.get_ylim()[1])
        axes.set_xlim(angles[0], angles[-1])
    legend_at_left(upper, 3)
    return save_figure(figure, path)
