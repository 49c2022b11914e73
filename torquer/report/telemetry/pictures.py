"""Pictures of an examination: residuals over time and over the orbit, the ellipsoid, the causes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from torquer.computer.estimation.sensor_keys import SENSOR_WORDS
from torquer.ground.telemetry.diagnosis.causes import CAUSES
from torquer.report.common.colours import BLUE, GREY, ORANGE, RED
from torquer.report.common.figure import label_time, legend_at_left, save_figure, stack_panels
from torquer.report.common.scales import clock_for

#: Points that are drawn at most.
_MOST = 20_000
#: A line is broken at steps of so many times the usual one; latitudes [deg] that tell an orbit.
_GAP, _MOVES_DEG = 10.0, 0.1


def draw_pictures(found, out: Path) -> dict[str, Path]:
    """Draw all pictures that an examination has into a folder; their paths by name."""
    made = {"residual": _residual(found, out / "residual.png")}
    if found.calibration is not None:
        made["ellipsoid"] = _ellipsoid(found, out / "ellipsoid.png")
    if found.diagnosis is not None:
        made["causes"] = _causes(found.diagnosis, out / "causes.png")
    if found.attitude is not None:
        made["attitude"] = _attitude(found.attitude, out / "attitude.png")
    if found.twin is not None and found.twin.data is not None:
        made["twin"] = _twin(found.twin, out / "twin.png")
    return made


def _twin(found, path: Path) -> Path:
    """The rate of twin and gyro, and what the twin misses of the readings."""
    data = found.data
    clock = clock_for(float(np.ptp(data["time"].values)))
    t = data["time"].values / clock.seconds
    figure, (rate, gyro, field) = stack_panels("Twin over data", 3, 9.0)
    read, own = (np.degrees(data[name].values) for name in ("omega_measured", "omega_body"))
    rate.plot(t, np.linalg.norm(own, axis=1), color=BLUE, lw=1.0, label="twin")
    rate.plot(t, np.linalg.norm(read, axis=1), ".", ms=4, color=ORANGE, label="gyro")
    rate.set_ylabel("rate [deg/s]", fontsize=10)
    off = 1e9 * (data["b_measured"].values - data["b_body"].values)
    for k, colour in enumerate((BLUE, ORANGE, GREY)):
        gyro.plot(t, (read - own)[:, k], ".", ms=4, color=colour, label="xyz"[k])
        field.plot(t, off[:, k], ".", ms=4, color=colour, label="xyz"[k])
    gyro.set_ylabel("gyro - twin [deg/s]", fontsize=10)
    field.set_ylabel("field, reading - twin [nT]", fontsize=10)
    label_time((rate, gyro, field), clock.unit)
    return save_figure(figure, path)


def _attitude(found, path: Path) -> Path:
    """What filter and smoother state, and the whitened innovations, over time."""
    rows = np.unique(np.linspace(0, found.data.sizes["time"] - 1, _MOST).astype(int))
    t_s = found.data["time"].values[rows]
    clock = clock_for(float(np.ptp(t_s)))
    t = t_s / clock.seconds
    figure, (stated, missed) = stack_panels("Attitude", 2, 5.6)
    for name, label, colour in (
        ("attitude_sigma", "filter", ORANGE), ("attitude_sigma_smoothed", "in hindsight", BLUE),
    ):  # fmt: skip
        stated.semilogy(t, np.degrees(found.data[name].values[rows]), ".-", ms=3, lw=0.8,
                        color=colour, label=label)  # fmt: skip
    stated.set_ylabel("stated, about each axis [deg]", fontsize=10)
    colours = (BLUE, ORANGE, GREY, RED)
    for (sensor, values), colour in zip(found.innovations.items(), colours, strict=False):
        shown = np.clip(values[rows], -6.0, 6.0)
        missed.plot(t, shown[:, 0], ".", ms=3, color=colour, label=SENSOR_WORDS[sensor])
        missed.plot(t, shown[:, 1:], ".", ms=3, color=colour)
    missed.axhline(0.0, color=GREY, lw=0.6)
    missed.set_ylim(-6.5, 6.5)
    missed.set_ylabel("innovation over its sigma", fontsize=10)
    label_time((stated, missed), clock.unit)
    if not found.fit.fits:
        stated.set_title("the model does not fit: these are no errors", fontsize=10, color=RED)
    return save_figure(figure, path)


def _thin(found):
    """Rows that are drawn: strength before and after, the model's, flags, latitude, time."""
    columns = found.calibrated
    rows = np.unique(np.linspace(0, columns.sizes["Timestamp"] - 1, _MOST).astype(int))
    before = 1e9 * np.linalg.norm(found.data["b_measured"].values[rows], axis=1)
    model, after = columns["F_model"].values[rows], columns["F"].values[rows]
    return rows, before, after, model, columns["Flags_F"].values[rows] == 1


def _residual(found, path: Path) -> Path:
    """|B| and residuals over time, residuals after calibration over the latitude."""
    rows, before, after, model, out = _thin(found)
    t_s = found.data["time"].values[rows]
    clock = clock_for(float(np.ptp(t_s)))
    t = t_s / clock.seconds
    lat = found.calibrated["Latitude"].values[rows]
    moves = bool(np.ptp(lat) > _MOVES_DEG)
    figure, panels = stack_panels("Strength of the field", 2 + moves, 6.1 + 2.9 * moves)
    strength, over_time = panels[:2]
    strength.plot(t, before * 1e-3, ".", ms=3, color=GREY, label="as measured")
    strength.plot(*break_line(t, model * 1e-3), color=BLUE, lw=1.0, label="IGRF")
    _limit(strength, np.append(before, model) * 1e-3)
    strength.set_ylabel("|B| [µT]", fontsize=10)
    over_time.plot(t, before - model, ".", ms=3, color=GREY, label="before")
    over_time.axhline(0.0, color=GREY, lw=0.6)
    if found.calibration is not None:
        over_time.plot(t, after - model, ".", ms=3, color=BLUE, label="after")
    _limit(over_time, before - model)
    low, high = over_time.get_ylim()
    if np.any(out):  # at the edge where they are beyond it
        shown = np.clip((before - model)[out], low, high)
        over_time.plot(t[out], shown, "x", ms=6, color=RED, label="outliers", clip_on=False)
    over_time.set_ylabel("residual [nT]", fontsize=10)
    label_time((strength, over_time), clock.unit)
    if moves:
        _over_latitude(panels[2], lat, after - model, out, found.calibration is None)
    return save_figure(figure, path)


def break_line(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A line [n] over times [n], with a hole where these have a gap."""
    steps = np.diff(t)
    after = 1 + np.flatnonzero(steps > _GAP * np.median(steps)) if len(steps) else np.zeros(0, int)
    return np.insert(t, after, np.nan), np.insert(values, after, np.nan)


def _over_latitude(over_orbit, lat, residual, out, is_raw: bool) -> None:
    """Residuals [n] nT over the latitude [n] deg, northbound and southbound."""
    north = np.gradient(lat) >= 0.0
    for half, name, colour in ((north, "northbound", ORANGE), (~north, "southbound", BLUE)):
        shown = half & ~out
        over_orbit.plot(lat[shown], residual[shown], ".", ms=3, color=colour, label=name)
    over_orbit.set_xlabel("latitude [deg]", fontsize=10)
    over_orbit.set_ylabel("residual [nT]" if is_raw else "residual after [nT]", fontsize=10)
    legend_at_left(over_orbit, 2)


def _limit(axes, values) -> None:
    """An axis on which the outliers do not hide all else."""
    low, high = np.nanpercentile(values, [2.0, 98.0])
    margin = 0.4 * (high - low) + 1e-9
    axes.set_ylim(low - margin, high + margin)


def _ellipsoid(found, path: Path) -> Path:
    """Where the readings point, and how much longer they are than the field: before and after.

    The distance from the circle is exaggerated so that it can be seen.
    """
    rows, _, _, model, out = _thin(found)
    raw = 1e9 * found.data["b_measured"].values[rows]
    cooked = found.calibrated["B_VFM"].values[rows]
    usual = np.nanpercentile(np.abs(np.linalg.norm(raw, axis=1) / model - 1.0)[~out], 90.0)
    gain = max(1.0, float(f"{0.25 / max(usual, 1e-6):.1g}"))
    circle = "the model's |B|" + (f", departures times {gain:g}" if gain > 1.0 else "")
    title = "Readings over the model's |B|, near each plane"
    figure, panels = stack_panels(title, 1, 3.6)
    panels[0].remove()
    axes_of = figure.subplots(1, 3)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    for axes, (i, k) in zip(axes_of, ((0, 1), (0, 2), (1, 2)), strict=True):
        axes.plot(np.cos(angle), np.sin(angle), color=GREY, lw=0.8, label=circle)
        for values, colour, name in ((raw, ORANGE, "before"), (cooked, BLUE, "after calibration")):
            length = np.linalg.norm(values, axis=1)
            drawn = (values / length[:, None]) * (1.0 + gain * (length / model - 1.0))[:, None]
            # rows near the plane: their departure is in it
            near = (np.abs(drawn[:, 3 - i - k]) < 0.5) & ~out
            flat = drawn[near][:, (i, k)]
            long = np.linalg.norm(drawn[near], axis=1) / np.linalg.norm(flat, axis=1)
            axes.plot(*(flat * long[:, None]).T, ".", ms=2.5, color=colour, label=name)
        axes.set_xlabel(f"{'xyz'[i]} of the body [1]", fontsize=10)
        axes.set_ylabel(f"{'xyz'[k]} of the body [1]", fontsize=10)
        axes.set_aspect("equal")
        axes.set_xlim(-1.7, 1.7)
        axes.set_ylim(-1.7, 1.7)
        axes.tick_params(labelsize=10)
    handles, labels = axes_of[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=3, fontsize=10, frameon=False,
                  markerscale=3.0)  # fmt: skip
    return save_figure(figure, path)


def _causes(found, path: Path) -> Path:
    """What each cause leaves, the most probable at the top, beside what a free field leaves."""
    rows = [
        (CAUSES[each.cause].say(each.value), each.residual_nt, each.fits, f"{each.nats:+.0f}")
        for each in found.ranking[::-1]
    ]
    if found.plane is not None:
        said = f"node {found.plane.node_deg:+.0f} deg, another phase"
        rows.append((said, found.plane.residual_nt, found.plane.fits, "second look"))
    figure, (axes,) = stack_panels(
        "What each cause leaves of |B|", 1, max(3.2, 1.4 + 0.32 * len(rows))
    )
    for row, (_, residual_nt, fits, _) in enumerate(rows):
        axes.plot(residual_nt, row, "o" if fits else "x", ms=6, color=BLUE if fits else GREY)
    axes.axvline(found.floor_nt, color=ORANGE, lw=1.0, label="a free, smooth field")
    axes.set_xscale("log")
    axes.set_xlabel("residual [nT]; a cross is too much", fontsize=10)
    axes.set_yticks(range(len(rows)), [row[0] for row in rows], fontsize=9)
    axes.set_ylim(-0.6, len(rows) - 0.4)
    right = axes.secondary_yaxis("right")
    right.set_yticks(range(len(rows)), [row[3] for row in rows], fontsize=9)
    right.set_ylabel("log evidence over 'as stated' [nats]", fontsize=9)
    legend_at_left(axes, 1)
    return save_figure(figure, path)
