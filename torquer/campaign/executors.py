"""Where chunks are flown: threads, processes, or a Dask cluster by its address."""

import contextlib
import functools
import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np

from torquer.campaign.fleet import Fleet
from torquer.campaign.spec import Campaign
from torquer.campaign.store import dataset_of
from torquer.scenario.spec import Scenario

#: How often Dask tries a chunk again whose worker was lost.
_RETRIES = 5


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def chunk_elsewhere(scenario: Scenario, campaign: Campaign, first: int, last: int):
    """The dataset of members first..last-1, in a process that may not know the campaign yet."""
    fleet = _fleet_of(scenario.model_dump_json(), campaign.model_dump_json(exclude_none=True))
    return dataset_of(fleet, fleet.fly(np.arange(first, last)))


@functools.lru_cache(maxsize=2)
def _fleet_of(scenario: str, campaign: str) -> Fleet:
    """Prepared once in a process, for all its chunks."""
    return Fleet(Scenario.model_validate_json(scenario), Campaign.model_validate_json(campaign))


class Pool:
    """Flies chunks, several at once; `workers`: how many."""

    def __init__(self, executor: Executor, workers: int, fly):
        self._executor, self.workers, self._fly = executor, workers, fly

    def submit(self, first: int, last: int) -> Future:
        """Members first..last-1 as a dataset, when they have been flown."""
        return self._executor.submit(self._fly, first, last)


@contextlib.contextmanager
def pool(fleet: Fleet, workers: int, where: str) -> Iterator[Pool]:
    """A pool of `workers`; `where`: 'threads', 'processes', or the address of a Dask scheduler."""
    elsewhere = functools.partial(chunk_elsewhere, fleet.scenario, fleet.campaign)
    if where not in ("threads", "processes"):
        with _cluster(where) as client:
            # a worker that is lost costs its chunks one more try
            theirs = client.get_executor(retries=_RETRIES, pure=False)
            yield Pool(theirs, max(1, len(client.nthreads())), elsewhere)
        return
    if where == "threads":
        executor: Executor = ThreadPoolExecutor(workers)
        fly = functools.partial(_here, fleet)
    else:
        spawned = multiprocessing.get_context("spawn")
        executor, fly = ProcessPoolExecutor(workers, spawned), elsewhere
    try:
        yield Pool(executor, workers, fly)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def _here(fleet: Fleet, first: int, last: int):
    return dataset_of(fleet, fleet.fly(np.arange(first, last)))


def _cluster(address: str):
    """A client of a Dask cluster."""
    try:
        from distributed import Client
    except ImportError:
        raise ValueError(
            "where: must be 'threads' or 'processes' without the package dask[distributed]; "
            f"received {address!r}"
        ) from None
    try:
        return Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise ValueError(
            f"where: must be the address of a Dask scheduler; received {address!r} ({error})"
        ) from None
