"""What software outside may change of the computer on board, each thing by its name.

Flags and thresholds of its mode tables, parameters of its laws, the states of its regions. What is
changed takes effect at the next control step; states are entered as by a transition.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from torquer.base.spec import Vector
from torquer.computer.computer import Blocks, Board, parameter_places
from torquer.computer.interface import ESTIMATED, NUMBERS, SENSED, SENSORS, nothing_known
from torquer.computer.modes.packing import check_choice
from torquer.computer.modes.signals import SIGNALS, UNITS
from torquer.computer.modes.spec import Condition, Modes
from torquer.computer.names import MODES, Names
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.state import find_arrays
from torquer.simulation.loop.timetable import READ
from torquer.simulation.setup.run import Run
from torquer.spacecraft.house_keeping import light_and_distance
from torquer.spacecraft.wheel_array.steering import Steering, lose


def computer_names(scenario: Scenario, blocks: Blocks) -> Names:
    """The names of the computer of a scenario with these laws and estimators."""
    modes, places = scenario.control.named().modes, parameter_places(blocks)
    fixed = frozenset(f"{key}.{name}" for key, of in blocks.by_key().items() for name in of.fixed)
    if modes is None:
        return Names({}, (), places, {}, (), fixed)
    regions, first = {}, 0
    for place, (name, region) in enumerate(modes.regions.items()):
        regions[name] = place, {state: first + i for i, state in enumerate(region.states)}
        first += len(region.states)
    states = tuple(state for _, own in regions.values() for state in own)
    return Names(regions, modes.flags, places, _thresholds(modes), states, fixed)


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
        """Set `LAW.PARAMETER` [SI] or a threshold `modes.NAME`, in its signal's unit.

        ValueError for a number beyond the limits of the key that it stands for (`Block.limits`).
        """
        board, names = self._direct("set_parameter"), self.names
        check_choice("name", names.all_parameters(), name)
        if name not in names.parameters:
            _set_threshold(board, name, names.thresholds[name.removeprefix(MODES)], value)
            return
        if name in names.fixed:
            raise ValueError(f"name: must be of a parameter that is set in flight; received {name}")
        first, count = names.parameters[name]
        numbers = finite_numbers(name, value, count)
        check_limits(name, numbers, self._run.blocks)
        board.parameters[first : first + count] = numbers

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

    def use_wheels(self, in_use: Sequence[bool]) -> None:
        """Which wheels the computer may drive, one after the other; the motors of others are off.

        Their part of a torque is taken over by those in use, as after a failure that is noticed.
        """
        run, count = self._run, len(self.wheel_axes)
        self._direct("use_wheels")
        if len(in_use) != count:
            raise ValueError(f"in_use: must be {count} truths, one a wheel; received {in_use!r}")
        steering, now = run.plan.allocation.steering, run.state.allocation
        limits = now.momentum_limit, now.torque_limit, now.bias
        first = steering.momentum_limit, steering.torque_limit, steering.bias
        for place, value in zip(limits, first, strict=True):
            place[:] = value
        for wheel, on in enumerate(in_use):
            if not on and now.torque_limit[wheel] > 0.0:
                lose(Steering(steering.wheels, *limits, steering.bias_after, steering.work), wheel)

    @property
    def wheel_axes(self) -> tuple[Vector, ...]:
        """Axes of the wheels in the body, unit vectors; () for a satellite without any."""
        return tuple(map(tuple, self._run.plan.allocation.steering.wheels.axes.tolist()))

    @property
    def wheel_inertia_kg_m2(self) -> tuple[float, ...]:
        """Inertia of each wheel's rotor about its axis."""
        return tuple(self._run.plan.plant.rotors.rows["inertia"].tolist())

    def wheels(self) -> tuple[list[float], list[float]]:
        """Of each wheel: momentum by its tachometer [N m s], motor torque asked for [N m]."""
        allocation = self._run.state.allocation
        return allocation.momentum.tolist(), allocation.motor.tolist()

    @property
    def devices(self) -> set[str]:
        """What the satellite has: names of its kinds of sensors, "coils", "wheels"."""
        craft = self._run.scenario.spacecraft
        given = {"coils": craft.coils, "wheels": craft.wheels, "tachometers": craft.wheels}
        there = {name for name, device in given.items() if device is not None}
        return there | {each.device.kind for each in craft.flown().values()}

    def units(self, sensor: str) -> tuple[int, ...]:
        """Places in `Inputs.units` of the devices of a kind of which there are several."""
        flown = self._run.scenario.spacecraft.flown().values()
        return tuple(each.row - len(SENSORS) for each in flown
                     if each.device.kind == sensor and each.row >= len(SENSORS))  # fmt: skip

    def silence(self, sensor: str, on: bool = True) -> bool:
        """Take the power of a sensor, of all of its kind: it is not read, its last reading ages.

        False for a sensor that the satellite does not have.
        """
        check_choice("sensor", SENSORS, sensor)
        _check_truth("on", on)
        found = {each.row for each in self._run.scenario.spacecraft.flown().values()
                 if each.device.kind == sensor}  # fmt: skip
        bits = sum(READ << row for row in found | {NUMBERS[sensor]})
        at = self._run.state.at
        at[2] = at[2] | bits if on else at[2] & ~bits
        return bool(found)

    def surroundings(self) -> tuple[float, float]:
        """In truth: visible part of the Sun's disc, distance from the Earth's centre [m]."""
        run, tables = self._run, self._run.piece.tables
        return light_and_distance(run.plan.plant.shadow, tables.orbit, tables.sun, run.now_s)

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


def check_limits(name: str, numbers: Sequence[float], blocks: Blocks) -> None:
    """ValueError of one line for numbers of `BLOCK.PARAMETER` that are beyond its limits."""
    key, _, parameter = name.rpartition(".")
    block = blocks.by_key()[key]
    first, count = block.places()[parameter]
    for value, limits in zip(numbers, block.limits[first : first + count], strict=True):
        if not limits.hold(value):
            raise ValueError(f"{name}: must be {limits}; received {value:g}")


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
