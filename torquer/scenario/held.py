"""Which attitude the laws hold, and when: that of the state in which the modes are.

Laws of `torquer.computer.laws.pointing` hold an attitude. With modes only those of the present
states do: what is said of the attitude's error is from the attitude held at that instant, and there
is none while no law that works holds one, or while two hold different ones.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from torquer.computer.laws.pointing import HeldAttitude
from torquer.computer.modes.spec import Modes, State
from torquer.scenario.control import Control
from torquer.scenario.mission import Mission

#: Number of the attitude where none is held.
NONE_HELD = -1


class Attitude(NamedTuple):
    """An attitude of the body to the orbital frame, or else to the inertial one."""

    orbital: bool
    q_wanted: tuple[float, ...]


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
    held = {holders[name] for name in used}
    for state in modes.states():
        held |= {holding for name, holding in _set_by(state, holders) if name in used}
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


def check_judged(control: Control, mission: Mission | None) -> None:
    """ValueError for a limit of the attitude error that no law of a flight gives a meaning.

    A design takes the limit from a scenario whose law it replaces; so this is asked of flights.
    """
    limit_deg = mission.attitude_error_below_deg if mission else None
    if limit_deg is not None and (why := why_no_attitude(control)):
        raise ValueError(
            "mission.attitude_error_below_deg: must be left out unless built-in laws hold an "
            f"attitude, one at a time, from which the error is measured; received {limit_deg:g} "
            f"with {why}"
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
                now |= dict(_set_by(state, now))
        before = numbers[first]
        which[first:end] = _number_held(states, now, held)
    return Holding(held, which)


def _holders(control: Control) -> dict[str, Attitude]:
    """The attitudes of the laws that hold one, by the laws' names."""
    laws = control.named().laws.items()
    return {
        name: Attitude(law.orbital, law.q_wanted())
        for name, law in laws
        if isinstance(law, HeldAttitude)
    }


def held_by(control: Control, names: Iterable[str]) -> set[Attitude]:
    """The attitudes of laws by their names, as they are at the start."""
    holders = _holders(control)
    return {holders[name] for name in names if name in holders}


def _working(state: State) -> list[str]:
    return [name for name, factor in state.laws.items() if factor != 0.0]


def _set_by(state: State, now: Mapping[str, Attitude]) -> Iterator[tuple[str, Attitude]]:
    """Laws whose attitude a state sets on entry, with what they hold then."""
    for key, wanted in state.set.items():
        name, _, parameter = key.partition(".")
        if name in now and parameter == "q_wanted" and isinstance(wanted, tuple):
            yield name, now[name]._replace(q_wanted=wanted)


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
