"""Where chunks are flown: threads, processes, or a Dask cluster by its address."""

import contextlib
import functools
import multiprocessing
import os
import pickle
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np

from torquer.campaign.fleet import Fleet
from torquer.campaign.store import dataset_of

#: How often Dask tries a chunk again whose worker was lost.
_RETRIES = 5


def chunk_elsewhere(pickled: bytes, first: int, last: int):
    """The dataset of members first..last-1, in a process that may not know the campaign yet.

    `pickled`: the scenario and the campaign. Text would lose which keys were given, and times.
    """
    return _here(_fleet_of(pickled), first, last)


@functools.lru_cache(maxsize=2)
def _fleet_of(pickled: bytes) -> Fleet:
    """Prepared once in a process, for all its chunks."""
    return Fleet(*pickle.loads(pickled))


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
    pickled = pickle.dumps((fleet.scenario, fleet.campaign))
    elsewhere = functools.partial(chunk_elsewhere, pickled)
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
        executor, fly = ProcessPoolExecutor(workers, spawned, _end_with_parent), elsewhere
    try:
        yield Pool(executor, workers, fly)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def _end_with_parent() -> None:
    """Make this process end when its parent does, even if the parent is killed.

    Workers wait for chunks on a pipe that they hold open themselves: it never closes by itself.
    """

    def leave() -> None:
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=leave, daemon=True).start()


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
        # as the default one it would be asked for locks when files are written here
        return Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"where: must be the address of a Dask scheduler; received {address!r} ({error})"
        ) from None
