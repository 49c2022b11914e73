"""Passes as a picture: ground track over the map, the sky over the station, Doppler."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from torquer.environment.along_orbit import OrbitEnvironment
from torquer.ground import footprint
from torquer.ground.passes import Pass, doppler, seconds_of
from torquer.ground.stations import GroundStation
from torquer.report.common.colours import curve_colour
from torquer.report.common.figure import FAINT, INK, SMALL, foot, place, quiet, sheet

_WIDTH, _MAP, _SKY, _HEAD, _FOOT = 9.8, 4.55, 3.4, 0.5, 0.3
_LAND, _SEA, _TRACK = "#e9e4d6", "#f7fafc", "#9aa3ad"
#: Passes that are drawn in colours of their own; the track of at most so many revolutions.
MOST_DRAWN, _MOST_REVOLUTIONS = 6, 4.0
_POINTS = 181


def draw_passes(
    title: str,
    around: OrbitEnvironment,
    stations: Mapping[str, GroundStation],
    passes: Sequence[Pass],
    frequency_hz: float | None = None,
) -> Figure:
    """A figure of the first passes of a list, `MOST_DRAWN` at most.

    Map with track and stations' circles; sky over the stations; Doppler of a frequency, else the
    elevation. ValueError where there is no orbit.
    """
    drawn = list(passes[:MOST_DRAWN])
    figure = sheet(_WIDTH, _HEAD + _MAP + 0.55 + _SKY + _FOOT + 0.35, title)
    world = place(figure, 0.5, _HEAD, 2.0 * (_MAP - 0.1), _MAP - 0.1)
    _draw_world(world)
    _draw_track(world, around, drawn)
    _draw_stations(world, around, stations, drawn)
    top = _HEAD + _MAP + 0.6
    sky = place(figure, 0.35, top, _SKY, _SKY, projection="polar")
    _draw_sky(sky, drawn)
    curves = place(figure, _SKY + 1.5, top, _WIDTH - _SKY - 1.75, _SKY)
    _draw_curves(curves, drawn, frequency_hz)
    count = "1 pass" if len(drawn) == 1 else f"{len(drawn)} passes"
    more = f" of {len(passes)}" if len(passes) > len(drawn) else ""
    foot(
        figure,
        f"{count}{more}. Times UTC. Sky: north up, east right, as on a map; dashed: satellite in "
        "the Earth's shadow. Coasts: Natural Earth.",
    )
    return figure


def _draw_world(axes) -> None:
    land = PolyCollection(
        [np.array(ring) for ring in footprint.coastline()],
        facecolor=_LAND, edgecolor="#b9b19b", linewidth=0.4, zorder=0.5,
    )  # fmt: skip
    axes.add_collection(land)
    axes.set_facecolor(_SEA)
    axes.set(xlim=(-180, 180), ylim=(-90, 90), aspect="equal")
    axes.set_xticks(range(-180, 181, 60))
    axes.set_yticks(range(-90, 91, 30))
    axes.set_xticklabels([f"{abs(x)}°{'W' if x < 0 else 'E' if x else ''}" for x in
                          range(-180, 181, 60)])  # fmt: skip
    axes.set_yticklabels([f"{abs(y)}°{'S' if y < 0 else 'N' if y else ''}" for y in
                          range(-90, 91, 30)])  # fmt: skip
    axes.grid(True, color="#000000", alpha=0.1, lw=0.5)
    axes.tick_params(labelsize=SMALL, color=FAINT)
    axes.spines[:].set_color(FAINT)


def _line(axes, lat, lon, **look) -> None:
    """A line over the map, interrupted where it leaves it at one side."""
    lat, lon = np.asarray(lat), np.asarray(lon)
    breaks = np.flatnonzero(np.abs(np.diff(lon)) > 180.0) + 1
    axes.plot(np.insert(lon, breaks, np.nan), np.insert(lat, breaks, np.nan), **look)


def _draw_track(axes, around: OrbitEnvironment, drawn: Sequence[Pass]) -> None:
    if not drawn:
        return
    first_s = seconds_of(around, drawn[0].aos.time_ms)
    last_s = seconds_of(around, drawn[-1].los.time_ms)
    last_s = min(last_s, first_s + _MOST_REVOLUTIONS * around.orbit.period_s)
    count = int(np.clip((last_s - first_s) / around.orbit.period_s * _POINTS, 2, 8 * _POINTS))
    lat, lon, _ = footprint.below(around, np.linspace(first_s, last_s, count))
    _line(axes, lat, lon, color=_TRACK, lw=0.8, zorder=1)
    for number, each in enumerate(drawn):
        t_s = [seconds_of(around, point.time_ms) for point in each.curve]
        lat, lon, _ = footprint.below(around, t_s)
        _line(axes, lat, lon, color=curve_colour(number), lw=2.4, zorder=3)
        axes.plot(lon[-1], lat[-1], "o", ms=4.5, color=curve_colour(number), zorder=3.5)


def _draw_stations(axes, around, stations: Mapping[str, GroundStation], drawn) -> None:
    for name, each in stations.items():
        axes.plot(
            each.longitude_deg, each.latitude_deg, "^", ms=6, color=INK, mec="white", zorder=4
        )
        axes.annotate(name, (each.longitude_deg, each.latitude_deg), (5, 4), zorder=4,
                      textcoords="offset points", fontsize=SMALL, color=INK)  # fmt: skip
        seen = [one for one in drawn if one.station == name]
        if seen:
            t_s = seconds_of(around, seen[0].highest.time_ms)
            height_m = float(footprint.below(around, t_s)[2][0])
            reach = footprint.reach_rad(height_m, each.least_rad)
            ring = footprint.circle(each.latitude_deg, each.longitude_deg, reach)
            _line(axes, *zip(*ring, strict=True), color=INK, lw=0.9, ls=(0, (4, 2)), zorder=2)


def _draw_sky(axes, drawn: Sequence[Pass]) -> None:
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_rlim(0.0, 90.0)
    axes.set_rgrids([0, 30, 60, 90], ["", "60°", "30°", ""], fontsize=7, color="#555555", angle=22)
    axes.set_thetagrids(range(0, 360, 45), ["N", "NE", "E", "SE", "S", "SW", "W", "NW"])
    axes.tick_params(labelsize=SMALL, pad=1)
    axes.grid(True, color="#d9d9d9", lw=0.6)
    axes.spines[:].set_color(FAINT)
    for number, each in enumerate(drawn):
        curve = [point for point in each.curve if point.elevation_deg >= 0.0]
        angle = np.radians([point.azimuth_deg for point in curve])
        apart = np.array([90.0 - point.elevation_deg for point in curve])
        lit = np.array([point.sunlit for point in curve], dtype=bool)
        colour = curve_colour(number)
        for mask, style in ((lit, "-"), (~lit, (0, (3, 2)))):
            near = mask | np.append(mask[1:], False)  # up to where the light changes
            axes.plot(
                np.unwrap(angle), np.where(near, apart, np.nan), color=colour, ls=style, lw=1.8
            )
        if len(curve) > 1:
            axes.plot(angle[-1], apart[-1], "o", ms=4.5, color=colour)


def _draw_curves(axes, drawn: Sequence[Pass], frequency_hz: float | None) -> None:
    quiet(axes)
    for number, each in enumerate(drawn):
        since_min = [(point.time_ms - each.aos.time_ms) / 6e4 for point in each.curve]
        if frequency_hz is None:
            values = [point.elevation_deg for point in each.curve]
        else:
            values = [1e-3 * doppler(point, frequency_hz)[0] for point in each.curve]
        at = datetime.fromtimestamp(each.aos.time_ms / 1e3, UTC)
        label = f"{each.station} {at:%d %b %H:%M}, {each.highest.elevation_deg:.0f}°"
        axes.plot(since_min, values, color=curve_colour(number), lw=1.6, label=label)
    axes.set_xlabel("time since AOS [min]", fontsize=9)
    name = "elevation [deg]" if frequency_hz is None else (
        f"Doppler of {frequency_hz / 1e6:.6g} MHz [kHz]")  # fmt: skip
    axes.set_ylabel(name, fontsize=9)
    axes.margins(x=0)
    if drawn:
        axes.legend(fontsize=7.5, frameon=False, loc="best", handlelength=1.4)
