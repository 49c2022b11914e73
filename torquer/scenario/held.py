"""Which attitude the laws hold, and when: that of the state in which the modes are.

A law that holds an attitude says so itself: `LawSpec.held`. With modes only those of the present
states do: what is said of the attitude's error is from the attitude held at that instant, and there
is none while no law that works holds one, or while two hold different ones.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from torquer.computer.laws.held import Attitude
from torquer.computer.laws.law_spec import LawSpec
from torquer.computer.modes.packing import check_choice
from torquer.computer.modes.spec import Modes, State
from torquer.scenario.control import Control
from torquer.scenario.mission import Mission

#: Number of the attitude where none is held.
NONE_HELD = -1


class Holding(NamedTuple):
    """The attitudes that may be held, and the number of the one that is: (n,), -1 for none."""

    attitudes: tuple[Attitude, ...]
    which: np.ndarray


def held_attitudes(control: Control) -> set[Attitude]:
    """The attitudes that laws hold at any time, in some state of the modes if there are any."""
    holders, modes = _holders(control), control.named().modes
    if modes is None:
        return set(holders.values())
    used = {name for state in modes.states() for name in _working(state) if name in holders}
    return {each for name in used for each in _reached(name, holders[name], [*modes.states()])}


def _reached(name: str, first: Attitude, states: list[State]) -> set[Attitude]:
    """What a law holds at first, and whatever states make of it one after the other."""
    found, new = {first}, {first}
    while new:
        new = {_after_entry(state, name, each) for state in states for each in new} - found
        found |= new
    return found


def judged_by_modes(control: Control) -> Attitude | None:
    """What signals of the modes take for the wanted attitude of a law; None if they name none."""
    modes = control.named().modes
    if modes is None or modes.attitude_of is None:
        return None
    holders = _holders(control)
    check_choice("control.modes.attitude_of", holders, modes.attitude_of)
    return holders[modes.attitude_of]


def _after_entry(state: State, name: str, held: Attitude) -> Attitude:
    """What a law holds once a state has set its parameters."""
    for key, value in state.set.items():
        law, _, parameter = key.partition(".")
        if law == name:
            held = held.with_parameter(parameter, value)
    return held


def attitudes_in_order(control: Control) -> tuple[Attitude, ...]:
    """`held_attitudes` in the order of their numbers."""
    return tuple(sorted(held_attitudes(control)))


def holds_attitude(control: Control) -> bool:
    """Whether laws hold one attitude, at all times or in some states of the modes."""
    held = held_attitudes(control)
    return len(held) == 1 or (len(held) > 1 and control.named().modes is not None)


def why_no_attitude(control: Control) -> str:
    """Why no attitude error can be told, in words; "" where it can, or a law is only named.

    A law that was given in Python stands in a result by its name: its scenario was checked before.
    """
    laws = control.named().laws
    if holds_attitude(control) or any(law.kind == "given_in_python" for law in laws.values()):
        return ""
    if held_attitudes(control):
        return "laws that hold different attitudes at the same time"
    if not laws:
        return "no law"
    kinds = ", ".join(dict.fromkeys(law.kind for law in laws.values()))
    return f"laws that hold none ({kinds})"


def why_no_slews(control: Control) -> str:
    """Why no error from a commanded attitude can be told, in words; "" where it can."""
    if why := why_no_attitude(control):
        return why
    if not holds_attitude(control) or any(each.steered_in for each in held_attitudes(control)):
        return ""
    return "laws without slews"


def slews_in_flight(control: Control) -> bool:
    """Whether laws turn by slews to what they hold, again and again: to that of another state of
    the modes, or to a place that comes into sight. Then the error from what they command is meant
    where a limit does not say which error."""
    held = held_attitudes(control)
    if not held or not all(each.steered_in for each in held):
        return False
    return holds_attitude(control) and (len(held) > 1 or any(map(_comes_into_sight, held)))


def _comes_into_sight(held: Attitude) -> bool:
    """Whether a target of an attitude is a place on the ground, which is not always in sight."""
    if not held.targets:
        return False
    from torquer.computer.laws.targets import NUMBERS  # known where there are targets

    return NUMBERS["ground"] in (held.targets.first.number, held.targets.second.number)


def check_judged(control: Control, mission: Mission | None) -> None:
    """ValueError for a limit of the attitude error that no law of a flight gives a meaning.

    A design takes the limit from a scenario whose law it replaces; so this is asked of flights.
    """
    if mission is None:
        return
    limit_deg = mission.attitude_error_below_deg
    if limit_deg is not None and (why := why_no_attitude(control)):
        raise ValueError(
            "mission.attitude_error_below_deg: must be left out unless built-in laws hold an "
            f"attitude, one at a time, from which the error is measured; received {limit_deg:g} "
            f"with {why}"
        )
    limit_deg = mission.commanded_error_below_deg
    if limit_deg is not None and (why := why_no_slews(control)):
        raise ValueError(
            "mission.commanded_error_below_deg: must be left out unless a law turns to what it "
            f"holds by slews, as wheel_tracking does; received {limit_deg:g} with {why}"
        )


def always_held(control: Control) -> Attitude | None:
    """The one attitude that laws hold at every instant; None if it depends on the modes."""
    held, modes = held_attitudes(control), control.named().modes
    if len(held) != 1:
        return None
    holders = _holders(control)
    if modes is not None and (
        any(state.laws_off for state in modes.states())
        or not any(_always_in(region.states.values(), holders) for region in modes.regions.values())
    ):
        return None
    return next(iter(held))


def _always_in(states: Iterable[State], holders: Mapping) -> bool:
    return all(any(name in holders for name in _working(state)) for state in states)


def held_over_time(control: Control, modes: Mapping[str, np.ndarray], count: int) -> Holding:
    """What is held at each of `count` records.

    `modes`: number of the state at each record by region, -1: not known. What a state sets on entry
    is kept until it is set again, so the records must be those from the start of a run on. A state
    that is entered and left between two records is not seen.
    """
    held, table = attitudes_in_order(control), control.named().modes
    which = np.full(count, NONE_HELD, dtype=np.int16)
    if table is None:
        which[:] = 0 if len(held) == 1 else NONE_HELD
        return Holding(held, which)
    if not held or not count:
        return Holding(held, which)
    numbers = np.stack([np.asarray(modes[name]) for name in table.regions], axis=1)
    change = np.flatnonzero((numbers[1:] != numbers[:-1]).any(axis=1)) + 1
    now, before = _holders(control), np.full(len(table.regions), NONE_HELD)
    for first, end in zip([0, *change], [*change, count], strict=True):
        states = _present(table, numbers[first])
        for state, new in zip(states, numbers[first] != before, strict=True):
            if new and state is not None:
                now |= {name: _after_entry(state, name, each) for name, each in now.items()}
        before = numbers[first]
        which[first:end] = _number_held(states, now, held)
    return Holding(held, which)


def _holders(control: Control) -> dict[str, Attitude]:
    """The attitudes of the laws that hold one, by the laws' names."""
    laws = control.named().laws.items()
    found = ((name, law, law.held()) for name, law in laws if isinstance(law, LawSpec))
    return {
        name: held._replace(steered_in=f"{name}.{law.steers}") if law.steers else held
        for name, law, held in found
        if held is not None
    }


def held_by(control: Control, names: Iterable[str]) -> set[Attitude]:
    """The attitudes of laws by their names, as they are at the start."""
    holders = _holders(control)
    return {holders[name] for name in names if name in holders}


def _working(state: State) -> list[str]:
    return [name for name, factor in state.laws.items() if factor != 0.0]


def _present(table: Modes, numbers: np.ndarray) -> list[State | None]:
    """The state of each region; None where it is not known."""
    return [
        list(region.states.values())[number] if number >= 0 else None
        for region, number in zip(table.regions.values(), numbers, strict=True)
    ]


def _number_held(
    states: list[State | None], now: Mapping[str, Attitude], held: tuple[Attitude, ...]
) -> int:
    """The number of the one attitude that the laws of these states hold."""
    off = {name for state in states if state for name in state.laws_off}
    found = {
        now[name]
        for state in states
        if state
        for name in _working(state)
        if name in now and name not in off
    }
    return held.index(found.pop()) if len(found) == 1 else NONE_HELD
