"""Where chunks are flown: threads, processes, or a Dask cluster by its address."""

import contextlib
import functools
import multiprocessing
import os
import pickle
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from typing import Any

import numpy as np

from torquer.campaign.fleet import Fleet
from torquer.campaign.store import chunk_dataset

#: How often Dask tries a chunk again whose worker was lost.
_RETRIES = 5
#: Worker processes that may die before a campaign ends.
_MOST_DEATHS = 3


def chunk_elsewhere(pickled: bytes, first: int, last: int):
    """The dataset of members first..last-1, in a process that may not know the campaign yet.

    `pickled`: the scenario, the campaign, and the export that flies or None. Text would lose which
    keys were given, and times.
    """
    return _here(_prepare_fleet(pickled), first, last)


@functools.lru_cache(maxsize=2)
def _prepare_fleet(pickled: bytes) -> Fleet:
    """Prepared once in a process, for all its chunks."""
    return Fleet(*pickle.loads(pickled))


class _Refused(Exception):
    """A cluster takes no more chunks."""


class Pool:
    """Flies chunks, several at once; `workers`: how many.

    `losses`: exceptions by which chunks are lost that were submitted. `cluster`: address of the one
    that is to fly them, for which every exception on submitting is a loss.
    """

    def __init__(
        self,
        begin: Callable[[], Executor],
        workers: int,
        fly,
        losses: tuple = (BrokenExecutor,),
        cluster: str = "",
    ):
        self._begin, self.workers, self._fly = begin, workers, fly
        self.losses, self._cluster = (*losses, _Refused), cluster
        self._executor = begin()
        self._deaths = 0

    def submit(self, first: int, last: int) -> Future:
        """Members first..last-1 as a dataset, when they have been flown."""
        try:
            return self._executor.submit(self._fly, first, last)
        except Exception as error:
            if self._cluster:
                raise _Refused(f"{type(error).__name__}: {error}") from error
            raise

    def renew(self, loss: Exception) -> None:
        """Begin again with new workers after one has died, with which its pool ends.

        ValueError after the third: whatever kills them will go on to; and for a cluster, which has
        tried by itself.
        """
        if self._cluster:
            said = str(loss) if isinstance(loss, _Refused) else f"{type(loss).__name__}: {loss}"
            raise ValueError(
                "where: must keep its scheduler and its workers; received "
                f"{self._cluster!r}, which lost them ({' '.join(said.split())[:200].rstrip(':')}); "
                "what was flown is kept, resume continues"
            )
        self._deaths += 1
        if self._deaths == _MOST_DEATHS:
            raise ValueError(
                f"workers: must survive; received {_MOST_DEATHS} that were killed, as by a lack of "
                f"memory: take fewer than {self.workers}; what was flown is kept, resume continues"
            )
        self.end()
        self._executor = self._begin()

    def end(self) -> None:
        """Let the workers end."""
        self._executor.shutdown(wait=True, cancel_futures=True)


@contextlib.contextmanager
def pool(fleet: Fleet, workers: int, where: str) -> Iterator[Pool]:
    """A pool of `workers`; `where`: 'threads', 'processes', or the address of a Dask scheduler."""
    pickled = pickle.dumps((fleet.scenario, fleet.campaign, fleet.computer))
    elsewhere = functools.partial(chunk_elsewhere, pickled)
    if where not in ("threads", "processes"):
        with _cluster(where) as (client, losses):
            # a worker that is lost costs its chunks one more try
            theirs = functools.partial(client.get_executor, retries=_RETRIES, pure=False)
            yield Pool(theirs, max(1, len(client.nthreads())), elsewhere, losses, where)
        return
    begin: Callable[[], Executor]
    if where == "threads":
        begin, fly = functools.partial(ThreadPoolExecutor, workers), functools.partial(_here, fleet)
    else:
        spawned = multiprocessing.get_context("spawn")
        begin = functools.partial(ProcessPoolExecutor, workers, spawned, end_with_parent)
        fly = elsewhere
    made = Pool(begin, workers, fly)
    try:
        yield made
    finally:
        made.end()


def end_with_parent() -> None:
    """Make this process end when its parent does, even if the parent is killed.

    Workers wait for chunks on a pipe that they hold open themselves: it never closes by itself.
    """

    def leave() -> None:
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=leave, daemon=True).start()


def _here(fleet: Fleet, first: int, last: int):
    return chunk_dataset(fleet, fleet.fly(np.arange(first, last)))


@contextlib.contextmanager
def _cluster(address: str) -> Iterator[tuple[Any, tuple]]:
    """A client of a Dask cluster, and the exceptions of a future whose chunk it has lost.

    These are the death of more workers than it has patience for, and the end of the scheduler.
    """
    try:
        from distributed import Client, KilledWorker
    except ImportError:
        raise ValueError(
            "where: must be 'threads' or 'processes' without the package dask[distributed]; "
            f"received {address!r}"
        ) from None
    try:
        # as the default one it would be asked for locks when files are written here
        client = Client(address, timeout="10s", set_as_default=False)
        client.nthreads()
    except (OSError, ValueError) as error:
        raise ValueError(
            f"where: must be the address of a Dask scheduler; received {address!r} ({error})"
        ) from None
    try:
        yield client, (KilledWorker, CancelledError, OSError)
    finally:
        with contextlib.suppress(OSError, RuntimeError):  # as of a scheduler that has gone
            client.close()
