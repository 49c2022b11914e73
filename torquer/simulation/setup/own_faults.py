"""What a torque or a sensor of the user's own did wrong, found once a run has stopped.

In compiled code such a function answers with not-a-numbers where it raises an error. The last
interval is then gone through again with probes in place of the functions: they ask the functions in
plain Python, and note what these do. A run that does not stop pays nothing for it.
"""

import copy
import functools
import math
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, cast

from torquer.base.user_code import UserCode
from torquer.base.user_source import error_line, plain_function, printable
from torquer.compile import engine
from torquer.computer.blocks.adapter import flat
from torquer.computer.interface import OWN_SENSOR
from torquer.maths.geometry.vec3 import norm
from torquer.simulation.loop.members import BAD_READING, BAD_STATE
from torquer.simulation.propagate.interval import GO_ON, propagate
from torquer.simulation.setup.run import Run, next_event
from torquer.spacecraft.disturbance.user import (
    OwnTorque,
    as_torque,
    no_torque,
    signature as torque_signature,
)
from torquer.spacecraft.sensors.own_sensor import signature as sensor_signature

#: Calls of a function in plain Python, after which the search ends; some seconds.
_MOST_CALLS = 200_000
#: A torque beyond this moves no satellite.
_GREATEST_N_M = 1e6
#: First adaptive step of the search [s].
_FIRST_STEP_S = 1e-3


class Fault(NamedTuple):
    """What a function did: received in words, and what more must hold; when; line of its file."""

    received: str
    more: str
    t_s: float
    line: int = 0


class Probe:
    """Asks a function of the user's own in plain Python, and keeps the last fault.

    The last is the one of the shortest step that was tried. `greatest`: the limit of an answer.
    """

    def __init__(self, spec: UserCode, greatest: float = math.inf):
        self.spec = spec
        self.fault: Fault | None = None
        self._function, self._names = spec.plain(), tuple(spec.all_parameters())
        self._greatest, self._calls = greatest, 0

    def __call__(self, here, parameters):
        """Its answer, or not-a-numbers."""
        self._calls += 1
        if self._calls > _MOST_CALLS:
            return no_torque()
        if not all(map(math.isfinite, flat(here))):
            return no_torque()  # another torque has failed
        given = dict(zip(self._names, parameters, strict=False))
        try:
            answer = self._function(here, **given)
        except (Exception, SystemExit) as error:
            line = error_line(error, Path(self._function.__code__.co_filename))
            return self._note(printable(error), "", here, line)
        try:
            found = plain_function(as_torque)(answer)
        except (TypeError, ValueError):
            return self._note(printable(answer), "", here)
        if not all(map(math.isfinite, found)):
            return self._note(printable(found), ", finite", here)
        if norm(found) > self._greatest:
            return self._note(printable(found), f", below {self._greatest:g} N m", here)
        return found

    def _note(self, received: str, more: str, here, line: int = 0):
        self.fault = Fault(received, more, here.t_s, line)
        return no_torque()

    def in_words(self) -> str:
        """The fault in one line, "" for none."""
        if self.fault is None:
            return ""
        received, more, t_s, line = self.fault
        return str(self.spec.refusal(f"{received} at t = {t_s:.9g} s", more, line))


#: Probes at work, by their places; those of one run at a time.
_at_work: list[Probe] = []
_ONE_AT_A_TIME = threading.Lock()


def _ask(number, here, parameters):
    return _at_work[int(number)](here, parameters)


def _address_of(probe: Probe, signature: Callable):
    """The probe as a function that kernels call by its address."""
    if not engine.COMPILED:
        return probe
    _at_work.append(probe)
    return _watcher(len(_at_work) - 1, signature).address


@functools.cache
def _watcher(number: int, signature: Callable):
    """A compiled function that asks the probe at a place."""
    import numba

    from torquer.compile.overloads import FirstClass

    def watched(here, parameters):
        with numba.objmode(answer="UniTuple(float64, 3)"):
            answer = _ask(number, here, parameters)
        return answer

    made = numba.njit(signature())(watched)
    return FirstClass(made, signature())


def find_own_fault(run: Run, ended: int) -> str:
    """What a torque or a sensor of the user's own did wrong where a run has stopped; "" if nothing.

    The run itself is left as it is.
    """
    with _ONE_AT_A_TIME:
        _at_work.clear()
        if ended == BAD_STATE:
            return _fault_of_torques(run)
        return _fault_of_sensor(run) if ended == BAD_READING else ""


def _copied(run: Run, **changed) -> Run:
    """A run from the same state, with other constants."""
    state, record = copy.deepcopy(run.state), copy.deepcopy(run.record)
    return replace(run, state=state, record=record, _ready=None, **changed)


def _fault_of_torques(run: Run) -> str:
    own = run.scenario.disturbance.own if run.scenario.disturbance else {}
    if not own:
        return ""
    probes = [Probe(spec, _GREATEST_N_M) for spec in own.values()]
    left, acting = iter(probes), run.dynamics.rigid.acting
    watched = tuple(
        each._replace(address=_address_of(next(left), torque_signature))
        if isinstance(each, OwnTorque)
        else each
        for each in acting
    )
    rigid = run.dynamics.rigid._replace(acting=watched)
    again = _copied(run, dynamics=run.dynamics._replace(rigid=rigid))
    _move_on(again)
    return next((found for probe in probes if (found := probe.in_words())), "")


def _move_on(run: Run) -> None:
    """Propagate a run to its next event, or to where it stops."""
    cells = run.state.cells[0]
    cells["next_step_s"] = cells["slow_step_s"] = _FIRST_STEP_S
    step = int(run.state.at[0])
    until = min(next_event(run.plan, step + 1), run.piece.last)
    problem = run.look_up()
    while 0 <= step < until:
        step = propagate(problem, step, until, GO_ON)


def _fault_of_sensor(run: Run) -> str:
    probe = Probe(cast(UserCode, run.scenario.spacecraft.own_sensor))
    sensors = cast(Any, run.plan.plant.sensors)
    address = _address_of(probe, sensor_signature)
    watched = sensors._replace(own_sensor=sensors.own_sensor._replace(address=address))
    again = _copied(run, plan=run.plan._replace(plant=run.plan.plant._replace(sensors=watched)))
    again.state.sensors[OWN_SENSOR]["count"] -= 1.0  # the same noise
    again.advance_to(int(run.state.at[0]) + 1)
    return probe.in_words() or str(probe.spec.refusal("not-a-numbers", ", finite"))
