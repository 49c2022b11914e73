"""A flight as the ground sees it: pictures from received packets alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from torquer.report.common.colours import BLUE, GREEN, GREY, ORANGE, RED
from torquer.report.common.figure import FAINT, legend_at_left, save_figure, stack_panels
from torquer.report.common.scales import Clock, clock_for

if TYPE_CHECKING:
    import xarray as xr

#: Modes in the order of the strip, with their colours.
_MODES = (("aos_mode", BLUE), ("stb_mode", GREEN), ("actuators", ORANGE))


def draw_downlink(tables: dict[str, xr.Dataset], name: str, path: Path) -> Path:
    """Modes, rate, attitude and commands over time, from the packet `extended`.

    Reboots (packets `ready`) and entries of the error log are marked. ValueError without any
    packet `extended`.
    """
    if "extended" not in tables:
        raise ValueError("downlink: must have packets 'extended' to be drawn; received none")
    extended = tables["extended"]
    t_s = extended["received_s"].values
    clock = clock_for(float(np.ptp(t_s)))
    t = t_s / clock.seconds
    figure, panels = stack_panels(f"{name}: what came down", 6, 11.0, sharex=True)
    modes, rate, angle, sun, field, command = panels
    _draw_modes(modes, extended, t)
    _draw_rates(rate, extended, t)
    _draw_angles(angle, extended, t)
    _draw_sun(sun, extended, t)
    _draw_vector(field, extended, "b", t, 1e-3, "field [µT]")
    _draw_vector(command, extended, "dipole", t, 1.0, "dipole [A m²]")
    for axes in panels:
        axes.margins(x=0)
        _mark(axes, tables, clock)
    command.set_xlabel(f"time of reception [{clock.unit}]", fontsize=10)
    return save_figure(figure, path)


def _draw_modes(axes, extended, t) -> None:
    """Modes as steps with the labels that occur, one above the other."""
    ticks: list[float] = []
    labels: list[str] = []
    first = 0.0
    for name, colour in _MODES:
        seen, meanings = extended[name].values, extended[name].attrs["flag_meanings"].split()
        there = sorted(set(seen.tolist()))
        rows = {number: first + k for k, number in enumerate(there)}
        axes.step(t, [rows[n] for n in seen.tolist()], where="post", color=colour, lw=1.2)
        ticks += rows.values()
        labels += [meanings[n] if n < len(meanings) else str(n) for n in there]
        first += len(there) + 0.6
    axes.set_yticks(ticks, labels, fontsize=6.5)
    axes.set_ylim(-0.5, first - 0.6)
    axes.invert_yaxis()


def _draw_rates(axes, extended, t) -> None:
    for name, colour, words in (
        ("omega", BLUE, "absolute"),
        ("omega_orbital", RED, "to the orbital frame"),
    ):
        axes.semilogy(t, _norm(extended, name), color=colour, lw=0.9, label=words)
    axes.set_ylabel("rate [deg/s]", fontsize=9)
    legend_at_left(axes, 2, 8)


def _draw_angles(axes, extended, t) -> None:
    vector = np.stack([_known_numbers(extended[f"q_orbital_{k}"]) for k in range(3)])
    sine = np.minimum(np.linalg.norm(vector, axis=0), 1.0)
    angle = np.degrees(2.0 * np.arcsin(sine))
    axes.semilogy(t, np.maximum(angle, 1e-2), color=BLUE, lw=0.9, label="to the orbital frame")
    axes.semilogy(t, _known_numbers(extended["sigma"]), color=GREY, lw=0.9, label="stated error")
    axes.set_ylabel("attitude [deg]", fontsize=9)
    legend_at_left(axes, 2, 8)


def _draw_sun(axes, extended, t) -> None:
    """Angle between the third axis and the Sun, while a Sun sensor sees it."""
    seen = np.stack([extended[f"sun_{axis}"].values for axis in "xyz"])
    length = np.linalg.norm(seen, axis=0)
    cosine = np.divide(seen[2], length, out=np.full(len(t), np.nan), where=length > 0.0)
    axes.plot(t, np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), color=ORANGE, lw=0.7)
    axes.set_ylim(0.0, 180.0)
    axes.set_yticks((0, 60, 120, 180))
    axes.set_ylabel("third axis\nto the Sun [deg]", fontsize=9)


def _draw_vector(axes, extended, name: str, t, factor: float, words: str) -> None:
    for axis, colour in zip("xyz", (BLUE, ORANGE, GREEN), strict=True):
        axes.plot(
            t, factor * _known_numbers(extended[f"{name}_{axis}"]), color=colour, lw=0.7, label=axis
        )
    axes.set_ylabel(words, fontsize=9)
    legend_at_left(axes, 3, 8)


def _mark(axes, tables, clock: Clock) -> None:
    """Reboots as lines, entries of the error log as small marks at the lower edge."""
    if "ready" in tables:
        for at_s in tables["ready"]["received_s"].values[1:]:
            axes.axvline(at_s / clock.seconds, color=RED, lw=0.8, ls="--")
    if "event" in tables:
        at = tables["event"]["received_s"].values / clock.seconds
        axes.plot(
            at, np.full(len(at), 0.02), "|", color=FAINT, ms=6, transform=axes.get_xaxis_transform()
        )


def _norm(extended, name: str) -> np.ndarray:
    found = np.linalg.norm(
        np.stack([_known_numbers(extended[f"{name}_{axis}"]) for axis in "xyz"]), axis=0
    )
    return np.maximum(found, 1e-4)


def _known_numbers(values) -> np.ndarray:
    """The numbers, NaN for the lowest one of a signed field, which means unknown."""
    found = values.values.astype(float)
    lowest = values.attrs.get("unknown", -np.inf)
    return np.where(found <= lowest, np.nan, found)
