"""A simulated flight driven from outside: software or hardware in the loop, by a pull interface.

flight = torquer.Flight(scenario)
while (inputs := flight.read()) is not None:
    flight.command(dipole_a_m2=my_software(inputs))
result = flight.result()
"""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from torquer.control.law import Law
from torquer.interface import Inputs
from torquer.scenario.spec import Scenario
from torquer.simulation.host import HostFailed, inputs_from
from torquer.simulation.members import COARSE_STEP, RUNNING, WAITING
from torquer.simulation.results.dataset import COMPLETE, FAILED, STOPPED
from torquer.simulation.results.store import InMemory
from torquer.simulation.run import Piece, prepare, reason, record_this_instant
from torquer.simulation.simulate import RunStopped
from torquer.simulation.state import CELLS, arrays_of
from torquer.spec import checked

if TYPE_CHECKING:
    import xarray as xr

_ZERO = (0.0, 0.0, 0.0)
#: All that the computer can be given, whatever the estimator.
_NEEDS = frozenset({"sun", "search_coil", "horizon", "sun_cells", "ephemeris"})


class Snapshot(NamedTuple):
    """A flight at one instant; `software`: what was handed over with it."""

    arrays: list[np.ndarray]
    piece: Piece
    relative_error: float
    parts: list[xr.Dataset]
    waits: bool
    software: object


class Flight:
    """The satellite of a scenario, its sensors and actuators; the computer is outside.

    `read` gives what the computer knows at a control step, `command` answers it. The scenario's
    laws and modes do not work; its estimator does, if it has one, and its control cycle says when
    control steps are. `done`: whether the end is reached; `now_s`: the time. An exchange takes a
    few microseconds.
    """

    def __init__(self, scenario: Scenario):
        if not isinstance(scenario, Scenario):
            raise ValueError(
                f"scenario: must be a torquer Scenario (see torquer.load_scenario); "
                f"received {scenario!r}"
            )
        scenario = checked(scenario)
        craft = scenario.spacecraft
        self._coils, self._wheels = craft.coils is not None, craft.wheels is not None
        answers: Literal["dipole", "torque", "command"] = "command" if self._coils else "torque"
        if not self._wheels:
            answers = "dipole"
        outside = Law("flight", _outside, needs=_NEEDS, compiled=False, answers=answers)
        self._run = prepare(scenario, outside, driven_from_outside=True)
        self._store = InMemory()
        self._run.keep = self._store.keep
        self._waits = False
        self._known = self._run.state.board.known.view(np.float64)
        cells = self._run.state.cells.view(np.float64)
        first = CELLS.names.index("dipole_x")
        self._dipole, self._torque = cells[first : first + 3], cells[first + 3 : first + 6]

    @property
    def now_s(self) -> float:
        """Time that the flight has reached [s]."""
        return float(self._run.now_s)

    @property
    def done(self) -> bool:
        """Whether the end of the scenario is reached."""
        return int(self._run.state.at[0]) >= self._run.steps

    def read(self) -> Inputs | None:
        """What the computer knows at the next control step; None at the end of the flight.

        Asked again before a command it is the same. Raises `RunStopped`, with the result so far,
        if the motion is lost.
        """
        if not self._waits and not self._to_next_control_step():
            return None
        return inputs_from(self._known)

    def command(self, dipole_a_m2=_ZERO, torque_n_m=_ZERO) -> None:
        """Answer the control step that `read` has shown: dipole, torque on the body by wheels."""
        if not self._waits:
            raise ValueError("command: must follow a read of its own; received a second one")
        self._dipole[:] = _three("dipole_a_m2", dipole_a_m2, self._coils)
        if torque_n_m is not _ZERO or self._wheels:
            self._torque[:] = _three("torque_n_m", torque_n_m, self._wheels)
        self._waits = False

    def snapshot(self, software: object = None) -> Snapshot:
        """The flight as it stands, to be restored any number of times.

        `software`: the state of the software outside, or anything else that is to go back with
        the flight; it is copied (`copy.deepcopy`).
        """
        run = self._run
        arrays = [part.copy() for part in arrays_of((run.state, run.record))]
        parts, kept = list(self._store.parts), copy.deepcopy(software)
        return Snapshot(arrays, run.piece, run.relative_error, parts, self._waits, kept)

    def restore(self, snapshot: Snapshot) -> object:
        """Go back to a snapshot of this flight; returns a copy of the software's state."""
        run = self._run
        for part, kept in zip(arrays_of((run.state, run.record)), snapshot.arrays, strict=True):
            part[...] = kept
        run.piece, run.relative_error = snapshot.piece, snapshot.relative_error
        self._store.parts[:] = snapshot.parts
        self._waits = snapshot.waits
        return copy.deepcopy(snapshot.software)

    def result(self) -> xr.Dataset:
        """What was recorded so far, as `torquer.simulate` returns it."""
        record_this_instant(self._run)
        if self.done:
            return self._store.result(self._run, COMPLETE, COMPLETE)
        return self._store.result(self._run, STOPPED, f"stopped at t = {self.now_s:g} s")

    def _to_next_control_step(self) -> bool:
        """Hand the answer over and run on; whether there is another control step."""
        ended = self._run.advance_to(self._run.steps)
        if ended == WAITING:
            self._waits = True
            return True
        if ended != RUNNING:
            self._stop(ended)
        if not self._run.is_followed():
            self._stop(COARSE_STEP)
        return False

    def _stop(self, ended: int) -> None:
        why = reason(self._run, ended)
        record_this_instant(self._run)
        raise RunStopped(why, self._store.result(self._run, FAILED, why), False)


def _outside(inputs, parameters, memory):
    """Stands for the software outside, which is not called."""
    raise HostFailed("flight: is driven from outside (read, command)")


def _three(name: str, values, possible: bool) -> tuple[float, float, float]:
    try:
        x, y, z = values
        finite = math.isfinite(x + y + z)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: must be three numbers; received {values!r}") from None
    if not finite:
        raise ValueError(f"{name}: must be finite; received {values!r}")
    if not possible and (x or y or z):
        must = "must be zero for a satellite without such actuators"
        raise ValueError(f"{name}: {must}; received {values!r}")
    return x, y, z
