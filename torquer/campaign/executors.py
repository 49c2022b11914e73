"""Where chunks are flown: threads, processes, or a Dask cluster by its address."""

import contextlib
import functools
import logging
import math
import multiprocessing
import os
import pickle
import threading
import time
import warnings
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
from torquer.campaign.provenance import OtherProvenance, check_provenance, files_named, provenance
from torquer.campaign.spec import Campaign
from torquer.campaign.store import chunk_dataset
from torquer.scenario.spec import Scenario

#: How often Dask tries a chunk again whose worker was lost.
_RETRIES = 5
#: Worker processes that may die before a campaign ends.
_MOST_DEATHS = 3
#: How often a cluster is asked for its workers [s], and how long it may have none unsaid.
_ASKED_EVERY_S, _PATIENCE_S = 1.0, 3.0


#: A campaign as it is sent to another process: the user's files by the keys that name them; what
#: numbers depend on besides; scenario, campaign, and the export that flies or None, pickled (text
#: would lose which keys were given, and times). Plain, as the other package may lack our classes.
Task = tuple[dict[str, str], dict[str, str], bytes]
#: Evaluated by a worker of a cluster. A function that it cannot find would end its connection.
_AT_WORKER = (
    "__import__('torquer.campaign.executors', fromlist=['*']).chunk_of_task(task, first, last)"
)


def task_of(
    scenario: Scenario, campaign: Campaign, computer: str | os.PathLike | None = None
) -> Task:
    """A campaign for other processes; `computer`: the export that flies."""
    told = scenario, campaign, computer
    files = files_named(*told)
    return files, provenance(files), pickle.dumps(told)


def chunk_of_task(task: Task, first: int, last: int):
    """The dataset of members first..last-1, in a process that may not know the campaign yet.

    OtherProvenance if it would compute other numbers.
    """
    files, expected, pickled = task
    check_provenance(expected, provenance(files))
    return _here(_prepare_fleet(pickled), first, last)


@functools.lru_cache(maxsize=2)
def _prepare_fleet(pickled: bytes) -> Fleet:
    """Prepared once in a process, for all its chunks."""
    return Fleet(*pickle.loads(pickled))


class _Refused(Exception):
    """A cluster takes no more chunks."""


class Waiting(UserWarning):
    """A cluster has no workers."""


class Pool:
    """Flies chunks, several at once.

    `count`: how many at once, now. `fly`: for the first and last of some members, what is to be
    called, and with what. `losses`: exceptions by which chunks are lost that were
    submitted. `cluster`: address of the one that is to fly them, for which every exception on
    submitting is a loss. `is_elsewhere`: whether other processes fly them.
    """

    def __init__(
        self,
        begin: Callable[[], Executor],
        count: Callable[[], int],
        fly,
        losses: tuple = (BrokenExecutor,),
        cluster: str = "",
        is_elsewhere: bool = True,
    ):
        self._begin, self._count, self._fly = begin, count, fly
        self.losses, self._cluster = (*losses, _Refused), cluster
        self.is_elsewhere = is_elsewhere
        self._executor = begin()
        self._deaths = 0

    @property
    def workers(self) -> int:
        """How many chunks are flown at once, now; at least one, for which workers are awaited."""
        try:
            return max(1, self._count())
        except Exception as error:
            raise self._refused(error) from error

    def _refused(self, error: Exception) -> Exception:
        return _Refused(f"{type(error).__name__}: {error}") if self._cluster else error

    def submit(self, first: int, last: int) -> Future:
        """Members first..last-1 as a dataset, when they have been flown."""
        try:
            return self._executor.submit(*self._fly(first, last))
        except Exception as error:
            raise self._refused(error) from error

    def result(self, future: Future):
        """The dataset of members that have been flown; OtherProvenance if a worker cannot do it."""
        try:
            return future.result()
        except (ImportError, AttributeError) as error:
            if not self._cluster:
                raise
            raise OtherProvenance(
                "where: must have workers with the package of this campaign; received one with "
                f"another, or with none ({type(error).__name__}: {error})"
            ) from None

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
    if where not in ("threads", "processes"):
        task = task_of(fleet.scenario, fleet.campaign, fleet.computer)
        with _cluster(where) as (client, losses):
            # a worker that is lost costs its chunks one more try
            theirs = functools.partial(client.get_executor, retries=_RETRIES, pure=False)
            yield Pool(theirs, _Threads(client), functools.partial(_at_worker, task), losses, where)
        return
    begin: Callable[[], Executor]
    call: tuple
    if where == "threads":
        begin, call = functools.partial(ThreadPoolExecutor, workers), (_here, fleet)
    else:
        spawned = multiprocessing.get_context("spawn")
        begin = functools.partial(ProcessPoolExecutor, workers, spawned, end_with_parent)
        call = (chunk_of_task, task_of(fleet.scenario, fleet.campaign, fleet.computer))
    made = Pool(
        begin, lambda: workers, lambda *span: (*call, *span), is_elsewhere=where != "threads"
    )
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


def _at_worker(task: Task, first: int, last: int) -> tuple:
    """What a worker of a cluster is to call, and with what."""
    return eval, _AT_WORKER, {"task": task, "first": first, "last": last}


def _here(fleet: Fleet, first: int, last: int):
    return chunk_dataset(fleet, fleet.fly(np.arange(first, last)))


class _Threads:
    """How many threads the workers of a cluster have; they come and go."""

    def __init__(self, client):
        self._client, self._count = client, 0
        self._asked_s, self._had_some_s, self._is_said = -math.inf, time.monotonic(), False

    def __call__(self) -> int:
        now_s = time.monotonic()
        if now_s - self._asked_s > _ASKED_EVERY_S:
            self._asked_s, self._count = now_s, sum(self._client.nthreads().values())
        if self._count:
            self._had_some_s, self._is_said = now_s, False
        elif now_s - self._had_some_s > _PATIENCE_S and not self._is_said:
            self._is_said = True
            warnings.warn("the cluster has no workers; waiting", Waiting, stacklevel=4)
        return self._count


@contextlib.contextmanager
def _quiet(name: str) -> Iterator[None]:
    """Nothing is logged by a library: what it has to say comes as an exception, too."""
    loggers = [
        each
        for key, each in logging.root.manager.loggerDict.items()
        if key.partition(".")[0] == name and isinstance(each, logging.Logger)
    ]
    levels = [each.level for each in loggers]
    for each in loggers:
        each.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for each, level in zip(loggers, levels, strict=True):
            each.setLevel(level)


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
    with _quiet("distributed"):
        try:
            yield client, (KilledWorker, CancelledError, OSError)
        finally:
            with contextlib.suppress(OSError, RuntimeError):  # as of a scheduler that has gone
                client.close()
