"""A campaign of starts in the background: the band in which rates lie, as it fills.

The members differ in attitude and in the direction of the rate, both uniform; all else is the
scenario's. They fly in a process of their own, sixteen at a time, so that the page stays quick.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import numpy as np

from torquer.campaign.executors import Task, chunk_of_task, end_with_parent, task_of
from torquer.campaign.load import check_campaign
from torquer.campaign.spec import Campaign
from torquer.pages.board.flown import Superseded
from torquer.scenario.spec import Scenario

#: Members of a campaign, and of a part of it that is flown at once.
RUNS, PART = 256, 16
#: Parts of the members below the lines of the band.
QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)
_LOOK_S = 0.05
_NICE = 10


def make_campaign(scenario: Scenario, runs: int = RUNS) -> Campaign:
    """The campaign of starts of a scenario."""
    size = float(np.linalg.norm(scenario.initial.rate_deg_s))
    vary: dict = {"initial.attitude": "uniform"}
    if size > 0.0:
        vary["initial.rate_deg_s"] = {"direction": "uniform", "magnitude": size}
    signal = {"signal": "rate_deg_s", "what": {"at_end": True}}
    return Campaign.model_validate({"runs": runs, "vary": vary, "outcomes": {"rate": signal}})


class Starts:
    """The process in which starts fly; begun when the first are asked for."""

    def __init__(self) -> None:
        self._pool: ProcessPoolExecutor | None = None
        self._lock = threading.Lock()

    def fly(
        self, scenario: Scenario, tell: Callable[[dict], None], is_superseded: Callable[[], bool]
    ) -> None:
        """Fly the starts; `tell` is given the band after each part.

        `Superseded` soon after `is_superseded` says so; ValueError for a scenario that cannot vary.
        """
        with self._lock:
            campaign = make_campaign(scenario)
            check_campaign(campaign, scenario)
            task = task_of(scenario, campaign)
            rates, failed, t_s = [], 0, np.zeros(0)
            for first in range(0, campaign.runs, PART):
                part = self._part(task, first, is_superseded)
                flown = np.array([how == "complete" for how in part["how_it_ended"].values])
                failed += int(np.count_nonzero(~flown))
                rates.append(part["series.rate"].values[flown])
                t_s = part["time"].values
                tell(rate_band(t_s, np.concatenate(rates), campaign.runs, failed))

    def close(self) -> None:
        """End the process."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def _part(self, task: Task, first: int, is_superseded: Callable[[], bool]):
        if is_superseded():
            raise Superseded
        if self._pool is None:
            spawned = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, spawned, _begin)
        future: Future = self._pool.submit(chunk_of_task, task, first, first + PART)
        try:
            while not future.done():
                if is_superseded():
                    raise Superseded  # the part in flight is short, and ends by itself
                time.sleep(_LOOK_S)
            return future.result()
        except BrokenProcessPool:
            self._pool = None
            raise ValueError("campaign: its process was ended, as by a lack of memory") from None


def rate_band(t_s: np.ndarray, rates: np.ndarray, runs: int, failed: int) -> dict:
    """The band of rates (members, times) [deg/s], as plain data."""
    lines = np.quantile(rates, QUANTILES, axis=0) if len(rates) else np.zeros((0, 0))
    return {
        "t_s": t_s.tolist(), "quantiles": QUANTILES, "rate_deg_s": lines.tolist(),
        "flown": len(rates) + failed, "failed": failed, "runs": runs,
    }  # fmt: skip


def _begin() -> None:
    """A process that ends with its parent and leaves the processor to it."""
    end_with_parent()
    if hasattr(os, "nice"):
        os.nice(_NICE)
