"""What software outside may change of the computer on board, each thing by its name.

Flags and thresholds of its mode tables, parameters of its laws, the states of its regions. What is
changed takes effect at the next control step; states are entered as by a transition.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from torquer.computer.computer import Blocks, Board, parameter_places
from torquer.computer.interface import ESTIMATED, SENSED, nothing_known
from torquer.computer.modes.packing import check_choice
from torquer.computer.modes.signals import SIGNALS, UNITS
from torquer.computer.modes.spec import Condition, Modes
from torquer.computer.names import MODES, Names
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.state import find_arrays
from torquer.simulation.setup.run import Run


def computer_names(scenario: Scenario, blocks: Blocks) -> Names:
    """The names of the computer of a scenario with these laws and estimators."""
    modes, places = scenario.control.named().modes, parameter_places(blocks)
    if modes is None:
        return Names({}, (), places, {}, ())
    regions, first = {}, 0
    for place, (name, region) in enumerate(modes.regions.items()):
        regions[name] = place, {state: first + i for i, state in enumerate(region.states)}
        first += len(region.states)
    states = tuple(state for _, own in regions.values() for state in own)
    return Names(regions, modes.flags, places, _thresholds(modes), states)


def _thresholds(modes: Modes) -> dict[str, list[tuple[int, Condition]]]:
    found: dict[str, list[tuple[int, Condition]]] = {}
    for place, (_, condition) in enumerate(modes.all_conditions()):
        if condition.threshold is not None:
            found.setdefault(condition.threshold, []).append((place, condition))
    return found


class Directed:
    """A flight whose computer software outside directs, from its next control step on.

    `names`: regions, flags, parameters and thresholds by their names.
    """

    keeps_computer: bool
    names: Names
    _run: Run

    def modes(self) -> dict[str, str]:
        """The state of each region of the mode tables, by name."""
        numbers = self._run.state.board.modes.regions["state"].tolist()
        now = map(self.names.states.__getitem__, map(int, numbers))
        return dict(zip(self.names.regions, now, strict=True))

    def set_flag(self, flag: str, on: bool) -> None:
        """Raise or lower a flag of the mode tables, from the next control step on."""
        board, flags = self._direct("set_flag"), self.names.flags
        check_choice("flag", flags, flag)
        _check_truth("on", on)
        board.modes.flags[flags.index(flag)] = float(on)

    def set_parameter(self, name: str, value: float | Iterable[float]) -> None:
        """Set `LAW.PARAMETER` [SI] or a threshold `modes.NAME`, in its signal's unit."""
        board, names = self._direct("set_parameter"), self.names
        check_choice("name", names.all_parameters(), name)
        if name not in names.parameters:
            _set_threshold(board, name, names.thresholds[name.removeprefix(MODES)], value)
            return
        first, count = names.parameters[name]
        board.parameters[first : first + count] = finite_numbers(name, value, count)

    def parameter(self, name: str) -> tuple[float, ...]:
        """The numbers of a parameter or threshold, as `set_parameter` takes them."""
        board, names = self._run.state.board, self.names
        check_choice("name", names.all_parameters(), name)
        if name in names.parameters:
            first, count = names.parameters[name]
            return tuple(board.parameters[first : first + count].tolist())
        place, condition = names.thresholds[name.removeprefix(MODES)][0]
        value = float(board.modes.conditions[place]["threshold"])
        return (value / UNITS[SIGNALS[condition.signal].unit],)

    def command_mode(self, region: str, state: str) -> None:
        """Have a region enter a state at the next control step, as a transition would."""
        board, (place, states) = self._direct("command_mode"), self._region(region)
        check_choice(region, states, state)
        board.modes.regions[place]["commanded"] = float(states[state])

    def hold(self, region: str, on: bool = True) -> None:
        """Keep a region in its state but for commands, or release it."""
        board, (place, _) = self._direct("hold"), self._region(region)
        _check_truth("on", on)
        board.modes.regions[place]["held"] = float(on)

    def restart_computer(self) -> None:
        """Let the computer begin as at the start of the flight, but for its latest readings.

        As `torquer.computer.computer.restart` does within the loop, where a failure ends.
        """
        board, first = self._direct("restart_computer"), self._run.plan.first_board
        for now, then in zip(_begins(board), _begins(first), strict=True):
            now[...] = then
        estimate = slice(SENSED, ESTIMATED)
        board.known.view(np.float64)[estimate] = nothing_known().view(np.float64)[estimate]

    def _direct(self, call: str) -> Board:
        """The board of the computer that is to be directed."""
        if not self.keeps_computer:
            raise ValueError(f"{call}: needs keeps_computer=True; received a flight without")
        return self._run.state.board

    def _region(self, region: str) -> tuple[int, dict[str, int]]:
        check_choice("region", self.names.regions, region)
        return self.names.regions[region]


def _begins(board: Board) -> list[np.ndarray]:
    """What begins again at a restart."""
    return find_arrays((board.parameters, board.memory, board.chosen, board.modes))


def _set_threshold(board: Board, name: str, conditions: list, value) -> None:
    """Set the value with which all conditions of a name compare; hysteresis must stay one."""
    (limit,) = finite_numbers(name, value, 1)
    for _, condition in conditions:
        back, sign = condition.back, condition.sign
        if back is not None and sign * (limit - back) <= 0.0:
            than = "greater" if sign > 0.0 else "less"
            raise ValueError(f"{name}: must be {than} than {back:g}; received {limit:g}")
    for place, condition in conditions:
        at = board.modes.conditions[place]
        at["threshold"] = limit * UNITS[SIGNALS[condition.signal].unit]


def _check_truth(name: str, value) -> None:
    if not isinstance(value, bool):
        raise ValueError(f"{name}: must be True or False; received {value!r}")


def finite_numbers(name: str, value, count: int) -> tuple[float, ...]:
    """So many finite numbers; ValueError of one line for anything else."""
    must = "a finite number" if count == 1 else f"{count} finite numbers"
    try:
        found = tuple(map(float, value)) if isinstance(value, Iterable) else (float(value),)
    except (TypeError, ValueError):
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise ValueError(f"{name}: must be {must}; received {value!r}")
    return found
