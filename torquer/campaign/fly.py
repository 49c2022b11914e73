"""A campaign flown: chunks of members in any order, results in the order of the members."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from torquer.campaign.executors import Pool, cores, pool
from torquer.campaign.fleet import Fleet
from torquer.campaign.load import check_campaign
from torquer.campaign.spec import SUCCESS, Campaign
from torquer.campaign.statistics import is_enough
from torquer.campaign.store import (
    attributes_of,
    check_same,
    chunks_folder,
    chunks_there,
    finish_file,
    joined,
    put_chunk,
)
from torquer.lanes import LANES
from torquer.scenario.spec import Scenario
from torquer.simulation.file import load
from torquer.simulation.stopping import heeded, heeding

if TYPE_CHECKING:
    import xarray as xr

#: Members of a chunk: what a kill may lose, and what a worker is given at once.
CHUNK = 128
#: Chunks in flight for each worker.
_AHEAD = 2


class Progress(NamedTuple):
    """How far a campaign has come: members flown, and in all."""

    done: int
    runs: int


class OneByOne(UserWarning):
    """The members of a campaign are flown one by one, which takes several times as long."""


def fly_campaign(
    scenario: Scenario,
    campaign: Campaign,
    *,
    to: str | os.PathLike | None = None,
    workers: int | None = None,
    where: str = "threads",
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> xr.Dataset:
    """Fly all members of a campaign; one row each in the order of their numbers.

    `to`: a file (NetCDF) for the result; chunks of it are written as they are flown, into a folder
    beside it. `resume` goes on with the members that are missing there, more than at first if the
    campaign has more `runs` now. `workers`: as many as cores unless given. `where`: 'threads',
    'processes', or the address of a Dask scheduler. A member's bits depend on none of these.
    Members that fail are kept, with the reason. KeyboardInterrupt ends the campaign with what is
    written.
    """
    check_campaign(campaign, scenario)
    path = None if to is None else Path(to)
    attributes = attributes_of(scenario, campaign)
    if path is not None:
        _check_file(path, attributes, resume)
    workers = cores() if workers is None else workers
    if workers < 1:
        raise ValueError(f"workers: must be 1 or more; received {workers}")
    with heeding():
        fleet = Fleet(scenario, campaign)
        if fleet.why_not_in_lanes:
            told = f"members fly one by one, not {LANES} at a time: {fleet.why_not_in_lanes}"
            warnings.warn(told, OneByOne, stacklevel=2)
        there = _complete(path) if resume and path is not None else set()
        with pool(fleet, workers, where) as fliers:
            parts, members = _flown(campaign, fliers, there, path, progress)
    if path is not None:
        return finish_file(path, members, attributes)
    return joined(parts, attributes).isel(member=slice(0, members))


def _check_file(path: Path, attributes, resume: bool) -> None:
    if resume:
        check_same(path, attributes)
    elif path.exists() or chunks_folder(path).exists():
        raise ValueError(
            f"to: must hold no campaign; received {path}: resume goes on with it, or remove it"
        )


def _complete(path: Path) -> set[int]:
    """Numbers of the members that have been flown."""
    files = [*chunks_there(path).values(), *([path] if path.exists() else [])]
    return {int(member) for file in files for member in load(file)["member"].values}


def _spans(runs: int, there: set[int]) -> Iterator[tuple[int, int]]:
    """First and last members of the chunks that are missing."""
    for first in range(0, runs, CHUNK):
        last = min(first + CHUNK, runs)
        missing = [member for member in range(first, last) if member not in there]
        if missing:
            yield missing[0], last


def _flown(campaign: Campaign, fliers: Pool, there: set[int], path, progress):
    """(Chunks in order, number of members) once all are flown, or enough of them."""
    spans = _spans(campaign.runs, there)
    running: dict[Future, tuple[int, int]] = {}
    parts: dict[int, xr.Dataset] = {}
    done, known, members = len(there), _Known(campaign), campaign.runs
    while True:
        while len(running) < _AHEAD * fliers.workers and (span := next(spans, None)):
            running[fliers.submit(*span)] = span
        if not running:
            return [parts[first] for first in sorted(parts)], members
        ended, _ = wait(running, timeout=0.2, return_when=FIRST_COMPLETED)
        if heeded().asked:
            raise KeyboardInterrupt
        for future in ended:
            first, last = running.pop(future)
            data = future.result()
            done += last - first
            if path is None:
                parts[first] = data
            else:
                put_chunk(path, data)
            if progress:
                progress(Progress(done, campaign.runs))
            if (enough := known.add(first, data)) is not None:
                spans, members = iter(()), enough


class _Known:
    """The outcome that a stopping rule looks at, in the order of the members."""

    def __init__(self, campaign: Campaign):
        self._campaign, self._enough = campaign, False
        self._waiting: dict[int, np.ndarray] = {}
        self._values = np.empty(0)

    def add(self, first: int, data: xr.Dataset) -> int | None:
        """Members that are enough, if they are; whatever the order in which chunks end."""
        stop = self._campaign.stop
        if stop is None or self._enough:
            return None
        name = "succeeded" if stop.outcome == SUCCESS else stop.outcome
        self._waiting[first] = data[name].values
        while len(self._values) in self._waiting:
            more = self._waiting.pop(len(self._values))
            self._values = np.append(self._values, more)
            if is_enough(stop, self._values):
                self._enough = True
                return len(self._values)
        return None
