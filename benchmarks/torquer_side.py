"""The detumbling task in torquer, with the environment tabulated or exact, and a user's law."""

import math

import erfa
import numpy as np
from detumble_task import YEAR, Task

import torquer
from torquer.base.time import decimal_year, julian_dates
from torquer.maths.geometry.vec3 import put_vector, read_vector, scale, sub
from torquer.simulation.loop.state import find_arrays
from torquer.simulation.setup.run import prepare

#: A start whose decimal year is that of the task's coefficients, as close as a second allows.
START = "2012-03-03T05:16:48Z"


@torquer.law(
    parameters={"gain": 1e6}, memory={"has_reading": 0.0, "t_s": 0.0, "b_body_t": (0.0, 0.0, 0.0)}
)
def user_law(inputs, parameters, memory):
    """The built-in finite-difference B-dot as a user would write it."""
    b = inputs.b_body_t
    m = (0.0, 0.0, 0.0)
    if memory.has_reading == 1.0:
        difference = sub(b, read_vector(memory.b_body_t))
        m = scale(-parameters.gain / (inputs.t_s - memory.t_s), difference)
    memory.has_reading, memory.t_s = 1.0, inputs.t_s
    put_vector(memory.b_body_t, b)
    return m


def scenario_of(task: Task, table_tolerance: float = 1e-9) -> "torquer.Scenario":
    """The task as a scenario."""
    rate = math.degrees(task.rate_rad_s)
    return torquer.scenario_from_text(f"""
start = {START}
[orbit]
kind = "circular"
radius_km = {task.radius_m / 1e3!r}
inclination_deg = {math.degrees(task.inclination_rad)!r}
[environment]
field = {{ kind = "igrf14", degree = 13, held_at_year = {year_at_start()!r} }}
earth_rotation = "sidereal"
table_tolerance = {table_tolerance!r}
[spacecraft.body]
inertia_kg_m2 = {list(task.moments)!r}
[spacecraft.coils]
limit_a_m2 = {task.dipole_max!r}
saturation = "clip"
[initial]
rate_deg_s = [{rate!r}, {rate!r}, {rate!r}]
[control]
sample_s = 1.0
law = {{ kind = "bdot", gain_a_m2_s_per_t = {task.gain!r} }}
[simulation]
duration_s = {float(task.n_steps)!r}
step_s = 1.0
record_s = {float(task.n_steps)!r}
""")


def task_at_start() -> Task:
    """The task with the Earth turned as it is at the start."""
    ut1, _ = julian_dates(START, 0.0)
    return Task(theta0_rad=float(erfa.gmst82(*ut1)))


def year_at_start() -> float:
    """Date of the field's coefficients; the task's own to a few minutes."""
    year = decimal_year(START)
    assert abs(year - YEAR) < 1e-4
    return year


class TorquerSide:
    """A prepared run that can be run again and again from the start."""

    def __init__(self, task: Task, table_tolerance: float = 1e-9, law=None):
        self.scenario = scenario_of(task, table_tolerance)
        self.law = law
        self.ready = prepare(self.scenario, law)
        self._first = [array.copy() for array in find_arrays(self.ready.state)]

    def step(self):
        """Step the prepared run from its start; the final quaternion and rate."""
        for array, first in zip(find_arrays(self.ready.state), self._first, strict=True):
            array[...] = first
        self.ready.advance_to(self.ready.steps)
        return self.ready.state.cells.view(np.float64)[:7].copy()

    def whole(self):
        """Prepare, table included, and step."""
        run = prepare(self.scenario, self.law)
        run.advance_to(run.steps)
        return run.state.cells.view(np.float64)[:7].copy()
