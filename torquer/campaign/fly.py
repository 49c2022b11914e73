"""A campaign flown: chunks of members in any order, results in the order of the members."""

import os
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.base.cores import cores
from torquer.base.limits import at_least
from torquer.base.spec import check_spec
from torquer.campaign.executors import Pool, pool
from torquer.campaign.fleet import Fleet
from torquer.campaign.joining import join_chunks
from torquer.campaign.load import check_campaign, check_own_parts
from torquer.campaign.parts import Part, check_part
from torquer.campaign.room import check_room
from torquer.campaign.spec import SUCCESS, Campaign
from torquer.campaign.statistics import is_enough
from torquer.campaign.store import (
    campaign_attributes,
    check_arrived,
    check_storable,
    finish_file,
    is_there,
    load_members,
    put_chunk,
)
from torquer.compile.lanes import LANES
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.signals import noted_signals, noting_signals

#: Members that a worker is given at once, at least and at most: what a kill may lose. As many as
#: are flown in some seconds, since a chunk costs something however few it has.
CHUNK, MOST, CHUNK_S = 128, 2048, 2.0
#: Chunks in flight for each worker.
_AHEAD = 2


class Progress(NamedTuple):
    """Progress of a campaign: members flown, and members in total."""

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
    computer: str | os.PathLike | None = None,
    part: tuple[int, int] | None = None,
) -> xr.Dataset:
    """Fly all members of a campaign; one row each in the order of their numbers.

    `to`: a file (NetCDF) for the result; chunks of it are written as they are flown, into a folder
    next to it; the numbers of a long result are read from the file when they are asked for.
    `resume` continues with the members that are missing there, also with added ones if the campaign
    has more `runs` now. `workers`: one per core unless given. `where`: 'threads', 'processes' (a
    script needs `if __name__ == "__main__":` around what it does), or the address of
    a Dask scheduler. A member's result does not depend on any of these, to the bit. Members that
    fail are kept, with the reason. `computer`: a folder of `export_c`, or a shared library built
    from it, whose computer in C flies in all members, with the same bits; members may differ in
    parameters and memory of laws and estimators, and ValueError names a key that changes more.
    `part`: (k, n) flies the k-th of n parts alone, as each of n machines does; `join_parts` makes
    one campaign of them. KeyboardInterrupt ends the campaign; what has been written is kept.

        >>> varied, campaign = torquer.load_campaign("releases.toml")
        >>> releases = torquer.fly_campaign(varied, campaign, workers=1)
        >>> releases.sizes["member"], releases["final_rate_deg_s"].dims
        (4, ('member',))
    """
    with noted_signals().raising():
        check_campaign(campaign, check_spec(scenario))
        check_own_parts(campaign, scenario)
        of_part = check_part(part, campaign)
    path = None if to is None else Path(to)
    if path is not None and not resume and is_there(path):
        raise ValueError(
            f"to: must hold no campaign; received {path}: resume continues it, or remove it"
        )
    workers = cores() if workers is None else workers
    at_least(1).check("workers", workers)
    with noting_signals() as signals:
        with signals.raising():
            fleet = Fleet(scenario, campaign, computer)
            known = _Known(campaign, of_part)
            for data in load_members(path, fleet) if path is not None else ():
                known.add(data)
            if path is not None:
                check_room(campaign, fleet.rows, *known.counts(), path.parent)
                check_storable(fleet)
        if fleet.why_not_in_lanes:
            text = f"members fly one by one, not {LANES} at a time: {fleet.why_not_in_lanes}"
            warnings.warn(text, OneByOne, stacklevel=2)
        with pool(fleet, workers, where) as fliers:
            parts = _fly(known, fleet, fliers, path, progress)
    if path is not None:
        return finish_file(path, known.wanted_members(), campaign_attributes(fleet))
    whole = join_chunks(parts, campaign_attributes(fleet))
    return whole.isel(member=slice(0, len(known.wanted_members())))


class _Known:
    """The state of a campaign: which members are `there`, how many `members` it will have.

    A stopping rule is evaluated when the members up to a whole number of chunks are there: neither
    the order in which chunks end nor a resume changes where the campaign ends.
    """

    def __init__(self, campaign: Campaign, part: Part | None):
        self.runs = self.members = campaign.runs
        self._part = part
        self.wanted = np.zeros(campaign.runs, bool)
        self.wanted[self.wanted_members()] = True
        self.there, self.done = np.zeros(campaign.runs, bool), 0
        self._stop, self._looked_at = campaign.stop, 0
        self._values = np.empty(campaign.runs if campaign.stop else 0)

    def wanted_members(self) -> np.ndarray:
        """Numbers of the members that there will be, of the part if one is flown."""
        return np.arange(self.members) if self._part is None else self._part.members(self.runs)

    def counts(self) -> tuple[int, int]:
        """How many members there will be at most, and how many of them are missing."""
        return int(np.count_nonzero(self.wanted)), int(np.count_nonzero(self.missing))

    @property
    def missing(self) -> np.ndarray:
        """Which members are to be flown."""
        return self.wanted & ~self.there

    @property
    def may_stop(self) -> bool:
        """Whether fewer than all runs may be enough."""
        return self._stop is not None

    @property
    def has_enough(self) -> bool:
        """Whether fewer than all runs are enough."""
        return self.members < self.runs

    def add(self, data: xr.Dataset) -> None:
        """Take in members that have been flown."""
        members = data["member"].values
        self.done += int(np.count_nonzero(~self.there[members]))
        self.there[members] = True
        if self._stop is None or self.has_enough:
            return
        name = "succeeded" if self._stop.outcome == SUCCESS else self._stop.outcome
        self._values[members] = data[name].values
        for last in self._chunk_ends():
            self._looked_at = last
            if is_enough(self._stop, self._values[:last]):
                self.members = last
                return

    def _chunk_ends(self) -> Iterator[int]:
        """Numbers of members at the ends of chunks up to which all members are there."""
        for first in range(self._looked_at, self.runs, CHUNK):
            last = min(first + CHUNK, self.runs)
            if not self.there[first:last].all():
                return
            yield last


class _Spans:
    """First and last members of the chunks that are missing, as long as there are not enough.

    Chunks grow until each takes `CHUNK_S`; the last ones are shorter, so that all workers end at
    once. Where few may be enough, none is long compared with what is there. No bit depends on it.
    """

    def __init__(self, known: _Known, workers: Callable[[], int]):
        self._known, self._workers, self._at = known, workers, 0
        self._size = CHUNK
        self._begun_s: dict[int, float] = {}

    def next(self) -> tuple[int, int] | None:
        """The next ones; None if there are none."""
        known = self._known
        missing = known.missing[self._at :]
        if known.has_enough or not missing.any():
            return None
        first = self._at + int(missing.argmax())
        of = known.done if known.may_stop else np.count_nonzero(missing)
        size = min(self._size, MOST, int(of) // (_AHEAD * self._workers()))
        last = first // CHUNK * CHUNK + max(1, size // CHUNK) * CHUNK
        flown = ~known.missing[first:last]
        self._at = first + int(flown.argmax() if flown.any() else len(flown))
        self._begun_s[first] = time.monotonic()
        return first, self._at

    def ended(self, first: int, last: int) -> None:
        """These have come back: the next ones may be more or fewer."""
        took_s = (time.monotonic() - self._begun_s.pop(first)) / _AHEAD  # others were before them
        fitting = int((last - first) * CHUNK_S / max(took_s, 1e-9))
        self._size = max(CHUNK, self._size // 2, min(fitting, 2 * self._size))


def _fly(known: _Known, fleet: Fleet, fliers: Pool, path, progress) -> list[xr.Dataset]:
    """Chunks in order, unless they go to a file, once all are flown, or enough of them."""
    spans = _Spans(known, lambda: fliers.workers)
    lost: list[tuple[int, int]] = []
    running: dict[Future, tuple[int, int]] = {}
    parts: dict[int, xr.Dataset] = {}
    while True:
        loss = None
        try:
            while len(running) < _AHEAD * fliers.workers:
                if not lost and (span := spans.next()) is not None:
                    lost = [span]
                if not lost:
                    break
                future = fliers.submit(*lost[0])
                running[future] = lost.pop(0)
        except fliers.losses as error:
            loss = error
        if not running and loss is None:
            return [parts[first] for first in sorted(parts)]
        ended, _ = wait(running, timeout=0.2, return_when=FIRST_COMPLETED)
        if noted_signals().asked:
            raise KeyboardInterrupt
        found, of_running = _came_back(ended, running, fliers)
        for span, data in found:
            if fliers.is_elsewhere:
                check_arrived(data, fleet, *span)
            if path is None:
                parts[span[0]] = data
            else:
                put_chunk(path, data)
            known.add(data)
            spans.ended(*span)
            if progress:
                progress(Progress(known.done, int(np.count_nonzero(known.wanted))))
        if loss := loss or of_running:
            fliers.renew(loss)
            lost, running = [*running.values(), *lost], {}


def _came_back(ended, running: dict[Future, tuple[int, int]], fliers: Pool):
    """Spans and datasets of chunks that have ended, and one of the losses if any did so.

    What has come back is taken out of `running`.
    """
    found, loss = [], None
    for future in ended:
        try:
            data = fliers.result(future)
        except fliers.losses as error:
            loss = error
        else:
            found.append((running.pop(future), data))
    return found, loss
