"""Modes of a run: which state each region was in, how often, and for what share of the time."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.base.strict_json import finite_or_none
from torquer.simulation.results.dataset import flown_scenario


class StateUse(NamedTuple):
    """A state of a region in a run.

    `entries`: how often it was entered, the start included; `last_entered_s`: when last, None if
    never; `share`: its share of the recorded time.
    """

    entries: int
    last_entered_s: float | None
    share: float


class RegionRecord(NamedTuple):
    """A region, its states, and the number of its state at every record."""

    name: str
    states: tuple[str, ...]
    numbers: np.ndarray

    @property
    def final(self) -> str:
        """The state at the last record."""
        return self.states[self.numbers[-1]]

    def spans(self, t_s) -> list[list[tuple[float, float]]]:
        """Time spans [s] of each state; one lasts until the record that shows the next."""
        t, numbers = np.asarray(t_s, dtype=float), self.numbers
        first = np.flatnonzero(np.diff(numbers, prepend=-1))
        ends = np.append(t[first[1:]], t[-1])
        found: list[list[tuple[float, float]]] = [[] for _ in self.states]
        for row, end in zip(first, ends, strict=True):
            found[numbers[row]].append((float(t[row]), float(end)))
        return found

    def shares(self) -> list[float]:
        """Shares of the time by state; a record counts until the next one, the last not at all."""
        counted = self.numbers[:-1] if len(self.numbers) > 1 else self.numbers
        return (np.bincount(counted, minlength=len(self.states)) / len(counted)).tolist()


def find_regions(result: xr.Dataset) -> list[RegionRecord]:
    """Regions of a run with modes or a scheme; none for laws that always work."""
    modes = flown_scenario(result).control.named().modes
    return [
        RegionRecord(name, tuple(region.states), result[f"mode_{name}"].values)
        for name, region in (modes.regions.items() if modes else ())
    ]


def state_uses(result: xr.Dataset) -> dict[str, dict[str, StateUse]]:
    """Use of every state, by region and state."""
    found, first = {}, 0
    for region in find_regions(result):
        here = slice(first, first + len(region.states))
        entries, entered = (result[f"mode_{key}"].values[here] for key in ("entries", "entered"))
        uses = zip(entries, entered, region.shares(), strict=True)
        found[region.name] = {
            state: StateUse(int(count), finite_or_none(last_s), share)
            for state, (count, last_s, share) in zip(region.states, uses, strict=True)
        }
        first += len(region.states)
    return found
