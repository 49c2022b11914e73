"""A signal over time: percentile bands of all members, and the worst member."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from torquer.campaign.contents import failed_in, member_numbers, names_by_role, unit_of_signal
from torquer.report.campaign.shared import axis_label, in_words, is_wide, literal
from torquer.report.common.colours import BLUE, ORANGE, PINK, RED
from torquer.report.common.figure import SMALL, legend, place, quiet, sheet
from torquer.report.common.scales import clock_for

#: Parts of the members between which bands lie.
PARTS = (0.05, 0.25, 0.5, 0.75, 0.95)
#: Numbers of a signal that are in memory at once.
_MOST = 1 << 24


def series_by_signal(result: xr.Dataset) -> list[list[str]]:
    """Names of the outcomes whose signal is kept over time, those of one signal together.

    The first of each has the series.
    """
    groups: dict[str, list[str]] = {}
    for variable in names_by_role(result, "series"):
        name = variable.removeprefix("series.")
        groups.setdefault(_signal_text(result, name), []).append(name)
    for name in names_by_role(result, "outcome"):
        if name not in (names := groups.get(_signal_text(result, name), [name])):
            names.append(name)
    return list(groups.values())


def _signal_text(result: xr.Dataset, name: str) -> str:
    """A text that identifies the signal of an outcome."""
    if name in result and "signal" in result[name].attrs:
        return result[name].attrs["signal"]
    series = f"series.{name}"
    return str(result[series].attrs.get("long_name", name)) if series in result else name


def percentiles(series: np.ndarray, parts=PARTS) -> np.ndarray:
    """Quantiles [parts, time] of a series [n, time] over the members.

    Each is the value of a member, as in `quantile`; missing values count as the greatest.
    """
    ordered = np.sort(series, axis=0)
    places = np.ceil(np.asarray(parts) * len(series) - 1e-9).astype(int) - 1
    return ordered[np.clip(places, 0, len(series) - 1)]


def bands_of(variable: xr.DataArray, members: np.ndarray, instants: np.ndarray) -> np.ndarray:
    """Percentiles [parts, time] of a stored signal over some members at some of its instants."""
    at_once, found = max(1, _MOST // variable.sizes["member"]), []
    for first in range(0, int(instants[-1]) + 1, at_once):
        asked = instants[(instants >= first) & (instants < first + at_once)] - first
        part = variable.isel(time=slice(first, first + at_once)).values
        found.append(percentiles(part[members][:, asked]))
    return np.concatenate(found, axis=1)


def draw_bands(result: xr.Dataset, summary: dict, names: list[str]) -> Figure | None:
    """Bands of the signal that outcomes are taken from, and the worst member of each outcome.

    None if no member was flown to the end.
    """
    if not has_bands(result):
        return None
    figure = sheet(7.2, 3.9, f"{signal_title(result, names)} · {summary['name']}")
    draw_bands_on(place(figure, 0.75, 0.75, 6.2, 2.6), result, summary, names)
    return figure


def has_bands(result: xr.Dataset) -> bool:
    """Whether a member was flown to the end, so that there is something to draw over time."""
    return bool(result.sizes["time"]) and not failed_in(result).all()


def signal_title(result: xr.Dataset, names: list[str]) -> str:
    """What the signal is that outcomes are taken from."""
    said = str(result[f"series.{names[0]}"].attrs.get("long_name", names[0]))
    return in_words(said, series_unit(result, names[0]))


def draw_bands_on(axes, result: xr.Dataset, summary: dict, names: list[str]) -> None:
    """As `draw_bands`, on given axes."""
    variable = result[f"series.{names[0]}"].transpose("member", "time")
    rows = np.flatnonzero(~failed_in(result))
    t_s = result["time"].values.astype(float)
    clock = clock_for(float(t_s[-1] - t_s[0]))
    found = bands_of(variable, rows, np.arange(len(t_s)))
    quiet(axes)
    t = t_s / clock.seconds
    handles = [
        axes.fill_between(t, found[0], found[4], color=BLUE, alpha=0.18, lw=0, label="5 to 95 %"),
        axes.fill_between(t, found[1], found[3], color=BLUE, alpha=0.3, lw=0, label="25 to 75 %"),
        *axes.plot(t, found[2], color=BLUE, lw=1.5, label="median"),
    ]
    for row, label, colour in worst_lines(result, summary, names):
        handles += axes.plot(t, variable.isel(member=row).values, color=colour, lw=1.0, label=label)
    axes.set_yscale("log" if is_wide(found) else "linear")
    axes.set_xlim(t[0], t[-1] if t[-1] > t[0] else t[0] + 1.0)
    axes.set_xlabel(f"time [{clock.unit}]", fontsize=SMALL)
    label = axis_label(signal_title(result, names), series_unit(result, names[0]))
    axes.set_ylabel(literal(label), fontsize=SMALL)
    legend(axes, handles)


def series_unit(result: xr.Dataset, name: str) -> str:
    """Unit of the signal that an outcome is taken from."""
    known = name in result and "signal" in result[name].attrs
    return unit_of_signal(result, name) if known else ""


def worst_lines(result: xr.Dataset, summary: dict, names: list[str]) -> list[tuple[int, str, str]]:
    """Row, label and colour of the worst member of each outcome, each once; at most three."""
    members = member_numbers(result)
    worst = dict.fromkeys(
        found["worst"][0]["member"]
        for name in reversed(names)
        if (found := summary["outcomes"].get(name)) and found["worst"]
    )
    return [
        (int(np.flatnonzero(members == member)[0]), f"worst: member {member}", colour)
        for member, colour in zip(worst, (RED, ORANGE, PINK), strict=False)
    ]
