"""This package's integrators in the work-precision benchmark: what is tried, and one flight.

Steps that do not divide the times of a task, or that an integrator refuses, are left out: the
package is asked. So is a run that stops (RK4 does where its step does not follow the motion).
"""

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from precision_tasks import Task

from torquer.scenario.load import ScenarioError
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.step import RUNNING
from torquer.simulation.setup.run import prepare

STEPS_S = (300, 150, 100, 75, 60, 50, 30, 20, 15, 10, 5, 3, 2, 1.5, 1, 0.5, 0.3, 0.2, 0.1, 0.05,
           0.02, 0.01, 0.005, 0.002)  # fmt: skip
#: With shorter ones the rounding of splitting's many operations only grows.
LEAST_SPLIT_S = 0.02
TOLERANCES_DEG = (10.0, 1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13)


class Way(NamedTuple):
    """A way to solve a task: `fly()` gives (seconds of stepping, attitudes), None if it fails."""

    integrator: str
    setting: float
    fly: Callable


def own_ways(task: Task) -> Iterator[Way]:
    """All that the package accepts."""
    steps = tuple(h for h in STEPS_S if task.least_step_s <= h <= task.most_step_s)
    # DOP853 takes the friction of wheels from the start of each step, as RK4 does
    with_wheels = "wheels" in task.data["spacecraft"]
    for name, key, values in (
        ("rk4", "step_s", steps),
        ("splitting", "step_s", tuple(h for h in steps if h >= LEAST_SPLIT_S)),
        ("dop853", "step_s", steps) if with_wheels else ("dop853", "tolerance", TOLERANCES),
        ("auto", "tolerance_deg", TOLERANCES_DEG),
    ):
        for value in values:
            try:
                scenario = task.scenario({"integrator": name, key: value})
            except ScenarioError:
                continue
            yield Way(name, value, partial(fly, scenario))


def fly(scenario: Scenario) -> tuple[float, np.ndarray] | None:
    """(Processor time of stepping [s], attitudes at the records); None if the run stops."""
    run, seconds, attitudes = prepare(scenario), 0.0, []
    stride = run.plan.record_steps
    while (step := int(run.state.at[0])) < run.steps:
        run.enter()  # tables of the next days: not of the stepping
        until = min(step + stride - step % stride, run.piece.last)
        start = time.process_time()
        ended = run.advance_to(until)
        seconds += time.process_time() - start
        if ended != RUNNING:
            return None
        if until % stride == 0:
            attitudes.append([float(run.state.cells[0][f"q_{axis}"]) for axis in "xyzw"])
    return seconds, np.array(attitudes)
