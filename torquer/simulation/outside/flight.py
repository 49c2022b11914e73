"""A simulated flight driven from outside: software or hardware in the loop, by a pull interface.

flight = torquer.Flight(scenario)
while (inputs := flight.read()) is not None:
    flight.command(dipole_a_m2=my_software(inputs))
result = flight.result()

With `keeps_computer=True` the scenario's own estimators, modes and laws work, and software outside
directs them: flight software around the computer on board.
"""

from __future__ import annotations

import copy
import math
import os
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, NoReturn

import numpy as np

from torquer.computer.blocks.law import Law
from torquer.computer.inputs import Inputs
from torquer.computer.interface import Command
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.members import COARSE_STEP, RUNNING, WAITING
from torquer.simulation.loop.state import CELLS, find_arrays
from torquer.simulation.loop.step import WORKED
from torquer.simulation.outside.directed import computer_names
from torquer.simulation.outside.host import HostFailed, inputs_from
from torquer.simulation.outside.uplinked import Uplinked
from torquer.simulation.results.dataset import COMPLETE, FAILED, STOPPED, whole_run_names
from torquer.simulation.results.restore import restore
from torquer.simulation.results.store import InMemory
from torquer.simulation.setup.run import (
    NoNextPiece,
    Piece,
    Uplink,
    prepare,
    record_this_instant,
)
from torquer.simulation.setup.simulate import RunStopped, check_scenario, flown_by
from torquer.simulation.setup.stopped import reason
from torquer.spacecraft.sensors.devices import DEVICES

if TYPE_CHECKING:
    import xarray as xr

#: In place of an argument; None is a mistake of the caller's.
_LEFT_OUT: Any = object()
#: All that the computer can be given, whatever the estimator.
_NEEDS = frozenset({"ephemeris", *(device.need for device in DEVICES if device.need)})


class Snapshot(NamedTuple):
    """A flight at one instant; `software`: what was handed over with it."""

    arrays: list[np.ndarray]
    piece: Piece
    relative_error: float
    uplinked: tuple[Uplink, ...]
    parts: list[xr.Dataset]
    waits: bool
    software: object


class Flight(Uplinked):
    """The satellite of a scenario, its sensors and actuators; the computer is outside.

    `read` gives what the computer knows at a control step, `command` answers it. The scenario's
    laws and modes do not work; its estimator does, if it has one, and its control cycle says when
    control steps are. `done`: whether the end is reached; `now_s`: the time. An exchange takes a
    few microseconds.

    With `keeps_computer` the scenario's laws and modes do work: `read` gives what the computer
    knows after it has worked, `answer` is the command that it found, and `command()` goes on with
    it. `set_flag`, `set_parameter`, `command_mode` and `hold` direct the computer from its next
    control step on; `modes` and `parameter` show where it stands. `set_ephemeris`, `calibrate`,
    `calibrate_coils` and `calibrate_tachometers` give it what the ground sends up. `laws`: laws by
    the names of the scenario's, which take their place. `computer`: as of `torquer.simulate`, works
    in their place.

        >>> flight = torquer.Flight(scenario)
        >>> while (inputs := flight.read()) is not None and inputs.t_s < 60.0:
        ...     flight.command((0.0, 0.0, 0.0))
        >>> kept = flight.snapshot()
        >>> flight.command((0.2, 0.0, 0.0))
        >>> flight.restore(kept)
        >>> part = flight.result()
        >>> again = torquer.Flight(scenario)
        >>> again.resume(part)
        >>> again.now_s == flight.now_s
        True
    """

    def __init__(
        self,
        scenario: Scenario,
        keeps_computer: bool = False,
        laws: Mapping[str, Law | Callable] | None = None,
        computer: str | os.PathLike | None = None,
    ):
        if computer is not None and not keeps_computer:
            raise ValueError(
                f"computer: must be left out unless keeps_computer=True; received {computer}"
            )
        scenario = check_scenario(scenario)
        craft = scenario.spacecraft
        self._coils, self._wheels = craft.coils is not None, craft.wheels is not None
        answers: Literal["dipole", "torque", "command"] = "command" if self._coils else "torque"
        if not self._wheels:
            answers = "dipole"
        outside = Law("flight", _outside, needs=_NEEDS, compiled=False, answers=answers)
        self.keeps_computer = keeps_computer
        if keeps_computer:
            self._run = flown_by(computer, scenario, laws=laws, stops=True)
        else:
            self._run = prepare(scenario, outside, stops=True, driven_from_outside=True)
        self.names = computer_names(self._run.scenario, self._run.blocks)
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
    def is_single(self) -> bool:
        """Whether the computer is one in C that computes in single precision."""
        return self._run.library is not None and self._run.library.is_single

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

    def command(self, dipole_a_m2=_LEFT_OUT, torque_n_m=_LEFT_OUT) -> None:
        """Answer the control step that `read` has shown: dipole, torque on the body by wheels.

        What is left out is zero or, where the computer is kept, what the computer answered.
        """
        if not self._waits:
            raise ValueError("command: must follow a read of its own; received a second one")
        if dipole_a_m2 is not _LEFT_OUT:
            self._dipole[:] = three_numbers("dipole_a_m2", dipole_a_m2, self._coils)
        elif not self.keeps_computer:
            self._dipole[:] = 0.0
        if torque_n_m is not _LEFT_OUT:
            self._torque[:] = three_numbers("torque_n_m", torque_n_m, self._wheels)
        elif not self.keeps_computer:
            self._torque[:] = 0.0
        self._waits = False

    @property
    def answer(self) -> Command:
        """The command of this control step as it stands: dipole [A m^2], torque [N m]."""
        return Command(tuple(self._dipole.tolist()), tuple(self._torque.tolist()))

    def snapshot(self, software: object = None) -> Snapshot:
        """The flight as it stands, to be restored any number of times.

        `software`: the state of the software outside, or anything else that is to go back with
        the flight; it is copied (`copy.deepcopy`).
        """
        run = self._run
        arrays = [part.copy() for part in find_arrays((run.state, run.record))]
        parts, kept = list(self._store.parts), copy.deepcopy(software)
        of_run = run.piece, run.relative_error, run.uplinked
        return Snapshot(arrays, *of_run, parts, self._waits, kept)

    def restore(self, snapshot: Snapshot) -> object:
        """Go back to a snapshot of this flight; returns a copy of the software's state."""
        run = self._run
        for part, kept in zip(find_arrays((run.state, run.record)), snapshot.arrays, strict=True):
            part[...] = kept
        run.piece, run.relative_error = snapshot.piece, snapshot.relative_error
        run.uplinked = snapshot.uplinked
        self._store.parts[:] = snapshot.parts
        self._waits = snapshot.waits
        return copy.deepcopy(snapshot.software)

    def resume(self, result: xr.Dataset) -> None:
        """Go on where a result of this scenario's flight stopped, which `result` returned.

        ValueError for one that is damaged, of another version of torquer or of another run. The
        software outside has a state of its own, which is not in it.
        """
        run = self._run
        restore(run, result)
        earlier = result.isel(time=slice(0, run.first_row)).drop_vars(whole_run_names(result))
        self._store.parts[:] = InMemory(earlier).parts
        self._waits = int(run.state.at[1]) == WORKED

    def result(self) -> xr.Dataset:
        """What was recorded so far, as `torquer.simulate` returns it."""
        record_this_instant(self._run)
        if self.done:
            return self._store.result(self._run, COMPLETE, COMPLETE)
        return self._store.result(self._run, STOPPED, f"stopped at t = {self.now_s:g} s")

    def _to_next_control_step(self) -> bool:
        """Hand the answer over and run on; whether there is another control step."""
        try:
            ended = self._run.advance_to(self._run.steps)
        except HostFailed as error:
            self._stop(f"{error} at t = {self.now_s:g} s")
        except NoNextPiece as error:
            self._stop(str(error))
        if ended == WAITING:
            self._waits = True
            return True
        if ended != RUNNING:
            self._stop(reason(self._run, ended))
        if not self._run.is_followed():
            self._stop(reason(self._run, COARSE_STEP))
        return False

    def _stop(self, why: str) -> NoReturn:
        if not self._run.is_at_end:
            record_this_instant(self._run)
        raise RunStopped(why, self._store.result(self._run, FAILED, why), False)


def _outside(inputs, parameters, memory):
    """Stands for the software outside, which is not called."""
    raise HostFailed("flight: is driven from outside (read, command)")


def three_numbers(name: str, values, possible: bool) -> tuple[float, float, float]:
    """Three finite numbers of a command, zero where there are no such actuators; ValueError."""
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
