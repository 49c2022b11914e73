"""When faults strike: in each mode that the flight without a fault visits, or at given times."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.computer.modes.spec import Region
from torquer.scenario.change import with_values
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_scenario


class Strike(NamedTuple):
    """An instant at which faults strike; `mode`: the states of the working regions then."""

    mode: str
    at_s: float


def without_guards(scenario: Scenario) -> Scenario:
    """The scenario whose guards stay in their first states."""
    modes = scenario.control.modes
    guards = modes.guards() if modes else []
    changes = {f"control.modes.regions.{name}": _idle(modes.regions[name]) for name in guards}
    return with_values(scenario, changes) if changes else scenario


def _idle(region: Region) -> dict:
    states = {
        name: {**state.model_dump(exclude_unset=True, exclude={"transitions"}), "final": True}
        for name, state in region.states.items()
    }
    return {"initial": region.initial, "states": states}


def _working_regions(scenario: Scenario) -> dict[str, Region]:
    """The regions that do not guard; none without modes."""
    modes = scenario.control.named().modes
    regions = modes.regions if modes else {}
    return {name: region for name, region in regions.items() if not region.only_guards}


def strikes_in(nominal: xr.Dataset) -> list[Strike]:
    """One instant in each mode of a flight, in the order of these times.

    It is the middle of the longest stay in that mode, or the instant next to it, within the stay,
    at which Sun sensors see the Sun: what they are stuck at in the dark misleads nobody. A mode is
    a combination of states of the regions that do not guard; without modes the flight is one.
    """
    working, t = _working_regions(flown_scenario(nominal)), nominal["time"].values
    if not working:
        return [Strike("", _instant(nominal, 0.0, float(t[-1])))]
    numbers = np.stack([nominal[f"mode_{name}"].values for name in working], axis=1)
    first = np.flatnonzero((np.diff(numbers, axis=0, prepend=-1) != 0).any(axis=1))
    ends = np.append(t[first[1:]], t[-1])
    longest: dict[tuple, tuple[float, float]] = {}
    for row, end in zip(first, ends, strict=True):
        mode, stay = tuple(numbers[row].tolist()), (float(end - t[row]), float(t[row]))
        longest[mode] = max(longest.get(mode, stay), stay)
    found = [
        Strike(_in_words(working, mode), _instant(nominal, begin, stay))
        for mode, (stay, begin) in longest.items()
    ]
    return sorted(found, key=lambda strike: strike.at_s)


def strike_at(nominal: xr.Dataset, at_s: float) -> Strike:
    """A given instant, with the mode of the flight then; ValueError for one after its end."""
    t, working = nominal["time"].values, _working_regions(flown_scenario(nominal))
    if not 0.0 <= at_s < t[-1]:
        raise ValueError(
            f"at_h: must be a time before the end of the flights, {t[-1] / 3600.0:g} h; "
            f"received {at_s / 3600.0:g} h"
        )
    row = int(np.searchsorted(t, at_s, side="right")) - 1
    mode = tuple(int(nominal[f"mode_{name}"].values[row]) for name in working)
    return Strike(_in_words(working, mode), _on_record(t, at_s))


def _instant(nominal: xr.Dataset, begin_s: float, stay_s: float) -> float:
    """The record next to the middle of a stay, if possible with the Sun in view."""
    t = nominal["time"].values
    middle_s = _on_record(t, begin_s + 0.5 * stay_s)
    seen = np.any(nominal["sun_measured"].values != 0.0, axis=1)
    there = t[seen & (t >= begin_s) & (t < begin_s + stay_s)]
    return float(there[np.argmin(np.abs(there - middle_s))]) if len(there) else middle_s


def _on_record(t: np.ndarray, at_s: float) -> float:
    """The last instant of the record at or before a time: a multiple of the record's interval."""
    return float(t[np.searchsorted(t, at_s * (1.0 + 1e-12), side="right") - 1])


def _in_words(working: dict[str, Region], mode: tuple) -> str:
    pairs = zip(working.values(), mode, strict=True)
    return " / ".join([*region.states][k] for region, k in pairs)
