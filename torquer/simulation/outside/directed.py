"""What software outside may change of the computer on board, each thing by its name.

Flags and thresholds of its mode tables, parameters of its laws, the states of its regions. What is
changed takes effect at the next control step; states are entered as by a transition.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from torquer.computer.computer import Blocks, Board, parameter_places
from torquer.computer.interface import KNOWN, nothing_known
from torquer.computer.modes.packing import check_choice
from torquer.computer.modes.signals import SIGNALS, UNITS
from torquer.computer.modes.spec import Condition, Modes
from torquer.computer.names import MODES, Names
from torquer.scenario.spec import Scenario
from torquer.simulation.loop.state import find_arrays
from torquer.simulation.setup.run import Run

#: What the computer's record has of the estimate.
_ESTIMATE = KNOWN.names[KNOWN.names.index("estimate_s") : KNOWN.names.index("position_x")]


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


def states_now(run: Run, names: Names) -> dict[str, str]:
    """The state of each region, by name."""
    numbers = run.state.board.modes.regions["state"].tolist()
    now = map(names.states.__getitem__, map(int, numbers))
    return dict(zip(names.regions, now, strict=True))


def set_flag(run: Run, names: Names, flag: str, on: bool) -> None:
    """Raise or lower a flag of the mode tables."""
    check_choice("flag", names.flags, flag)
    _truth("on", on)
    run.state.board.modes.flags[names.flags.index(flag)] = float(on)


def command_mode(run: Run, names: Names, region: str, state: str) -> None:
    """Have a region enter one of its states at the next control step."""
    place, states = _region(names, region)
    check_choice(region, states, state)
    run.state.board.modes.regions[place]["commanded"] = float(states[state])


def hold(run: Run, names: Names, region: str, on: bool) -> None:
    """Keep the transitions of a region from firing, or let them again."""
    place, _ = _region(names, region)
    _truth("on", on)
    run.state.board.modes.regions[place]["held"] = float(on)


def set_parameter(run: Run, names: Names, name: str, value: float | Iterable[float]) -> None:
    """Set a parameter of a law or estimator, in SI units, or a threshold in its signal's unit."""
    check_choice("name", names.all_parameters(), name)
    if name not in names.parameters:
        _set_threshold(run, name, names.thresholds[name.removeprefix(MODES)], value)
        return
    first, count = names.parameters[name]
    run.state.board.parameters[first : first + count] = _numbers(name, value, count)


def restart(run: Run) -> None:
    """Let the computer begin as at the start of the run, but for its latest readings.

    As `torquer.computer.computer.restart` does within the loop, where a failure ends.
    """
    board, first = run.state.board, run.plan.first_board
    for now, then in zip(_restart(board), _restart(first), strict=True):
        now[...] = then
    nothing = nothing_known()
    for name in _ESTIMATE:
        board.known[name] = nothing[name]


def _restart(board: Board) -> list[np.ndarray]:
    return find_arrays((board.parameters, board.memory, board.chosen, board.modes))


def parameter(run: Run, names: Names, name: str) -> tuple[float, ...]:
    """The numbers of a parameter or of a threshold, as `set_parameter` takes them."""
    check_choice("name", names.all_parameters(), name)
    if name in names.parameters:
        first, count = names.parameters[name]
        return tuple(run.state.board.parameters[first : first + count].tolist())
    place, condition = names.thresholds[name.removeprefix(MODES)][0]
    value = float(run.state.board.modes.conditions[place]["threshold"])
    return (value / UNITS[SIGNALS[condition.signal].unit],)


def _set_threshold(run: Run, name: str, conditions: list, value) -> None:
    """Set the value with which all conditions of a name compare; hysteresis must stay one."""
    (limit,) = _numbers(name, value, 1)
    for _, condition in conditions:
        back, sign = condition.back, condition.sign
        if back is not None and sign * (limit - back) <= 0.0:
            than = "greater" if sign > 0.0 else "less"
            raise ValueError(f"{name}: must be {than} than {back:g}; received {limit:g}")
    for place, condition in conditions:
        at = run.state.board.modes.conditions[place]
        at["threshold"] = limit * UNITS[SIGNALS[condition.signal].unit]


def _region(names: Names, region: str) -> tuple[int, dict[str, int]]:
    check_choice("region", names.regions, region)
    return names.regions[region]


def _truth(name: str, value) -> None:
    if not isinstance(value, bool):
        raise ValueError(f"{name}: must be True or False; received {value!r}")


def _numbers(name: str, value, count: int) -> tuple[float, ...]:
    """So many finite numbers."""
    must = "a finite number" if count == 1 else f"{count} finite numbers"
    try:
        found = tuple(map(float, value)) if isinstance(value, Iterable) else (float(value),)
    except (TypeError, ValueError):
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise ValueError(f"{name}: must be {must}; received {value!r}")
    return found
