"""Flights of the software step by step: commands by time, replay of sessions, their differences.

A session replays to the same bytes: scenario, software, uplink by control step and faults determine
the downlink. Digests of all of it up to every `STRIDE`-th control step are recorded, so that the
first difference of two sessions, or of a session and its replay, is found without keeping the
downlink.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from pydantic import ValidationError

from torquer.base.explain import ScenarioError
from torquer.flight.packets.software_file import digest_files
from torquer.flight.packets.station import Station
from torquer.flight.software.core import Core
from torquer.flight.software.faults import SoftwareFault, strike
from torquer.flight.software.memory import Memory
from torquer.flight.software.session_file import STRIDE, Session
from torquer.flight.software.software import load_software
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.signals import noted_signals

#: Classes of lateness in a second.
_PER_S = 10_000
#: The longest sleep [s] without a look at the signals.
_MOMENT_S = 0.1


class Sender:
    """Commands by time, as a station sends them: `at(t_s)` gives what is sent until then."""

    def __init__(self, frames: Sequence[tuple[float, bytes]], station: Station):
        self._frames, self._station = list(frames), station

    @property
    def waiting(self) -> int:
        """Number of commands that have not been sent yet."""
        return len(self._frames)

    def at(self, t_s: float) -> bytes:
        """Bytes that are sent up to a time of the run and were not yet."""
        due = 0
        while due < len(self._frames) and self._frames[due][0] <= t_s:
            due += 1
        sent = b"".join(self._sent(frame) for _, frame in self._frames[:due])
        del self._frames[:due]
        return sent

    def _sent(self, frame: bytes) -> bytes:
        """A script waits for no answer: what follows a change of the key has the new one."""
        data = self._station.command(frame)
        if self._station.changes_key(frame):
            self._station.use_key(self._station.key_in(frame))
        return data


class Tick(NamedTuple):
    """What went up and came down at a control step; the number of the step and its time.

    `late_s`: how long after it was due the step began, of a flight that waits for the clock.
    """

    number: int
    t_s: float
    uplink: bytes
    downlink: bytes
    late_s: float = 0.0


class Lateness:
    """How late control steps begin that should keep pace with a clock, in classes of 0.1 ms."""

    def __init__(self) -> None:
        self._count: Counter[int] = Counter()
        self._most_s = 0.0

    def take(self, late_s: float) -> None:
        """Count a control step that began late [s]."""
        self._count[int(late_s * _PER_S)] += 1
        self._most_s = max(self._most_s, late_s)

    def within_ms(self, part: float) -> float:
        """Lateness that a part of the control steps do not exceed [ms], rounded up."""
        wanted, seen = part * self._count.total(), 0
        for number in sorted(self._count):
            seen += self._count[number]
            if seen >= wanted:
                return min((number + 1) / _PER_S, self._most_s) * 1e3
        return 0.0

    def summary(self) -> dict[str, float]:
        """Median, that of 99 % and the greatest lateness [ms]."""
        most_ms = self._most_s * 1e3
        found = {"median": self.within_ms(0.5), "99 %": self.within_ms(0.99), "most": most_ms}
        return {name: round(value, 3) for name, value in found.items()}


def fly_steps(
    core: Core,
    uplink: Callable[[int, float], bytes],
    faults: Sequence[SoftwareFault] = (),
    ticks: int | None = None,
    speed: float | None = None,
) -> Iterator[Tick]:
    """Fly control step by control step, to the end or for `ticks` control steps; yields each.

    `uplink`: what is received at a control step, by its number and the time of the one before;
    `speed`: how many times real time at most, None: as fast as it goes.
    """
    waiting = sorted(faults, key=lambda fault: (fault.tick is None, fault.tick or fault.at_s or 0))
    begun = t_s = late_s = 0.0
    number = 0
    while number != ticks:
        for fault in [f for f in waiting if _is_due(f, number, t_s)]:
            waiting.remove(fault)
            strike(core, fault)
        received = uplink(number, t_s)
        sent = core.tick(received)
        if sent is None:
            return
        t_s = core.services.t_s
        yield Tick(number, t_s, received, sent, late_s)
        if speed is not None:
            if number == 0:  # which may compile
                begun = time.monotonic() - t_s / speed
            _wait_until(begun + t_s / speed)
            late_s = time.monotonic() - begun - t_s / speed
        number += 1


def _wait_until(end_s: float) -> None:
    """Sleep until an instant of the monotonic clock [s] or, at most a moment longer, a signal."""
    signals = noted_signals()
    while (left_s := end_s - time.monotonic()) > 0.0 and not signals.asked:
        time.sleep(min(left_s, _MOMENT_S))


def _is_due(fault: SoftwareFault, number: int, t_s: float) -> bool:
    """Whether a fault strikes before this control step; `t_s`: time of the one before."""
    return number >= fault.tick if fault.tick is not None else t_s >= (fault.at_s or 0.0)


def replay_session(session: Session, ticks: int | None = None) -> Iterator[Tick]:
    """Fly a session again, to its end or for `ticks` control steps."""
    software = Path(session.software) if session.software else None
    if digest_files(software) != session.software_sha256:
        raise ScenarioError(
            f"session: its software must be as it was recorded; received other files of "
            f"{session.software or 'the software as shipped'}"
        )
    core = Core(read_scenario(session), load_software(software), _read_memory(session))
    uplink = {tick: bytes.fromhex(data) for tick, data in session.uplink}
    last = session.ticks if ticks is None else min(ticks, session.ticks)
    yield from fly_steps(core, lambda tick, _: uplink.get(tick, b""), session.faults, last)


def read_scenario(session: Session) -> Scenario:
    """The scenario of a session; `ScenarioError` for another text."""
    try:
        return Scenario.model_validate_json(session.scenario)
    except ValidationError:
        raise ScenarioError(
            "session.scenario: must be a scenario as a flight records it; received another text"
        ) from None


def _read_memory(session: Session) -> Memory:
    """The non-volatile memory as it was before the flight."""
    memory = Memory()
    for place, files in session.memory.items():
        memory.places[place].update({name: bytes.fromhex(data) for name, data in files.items()})
    return memory


class Difference(NamedTuple):
    """The first control step at which two sessions differ; None for one that has ended."""

    first: Tick | None
    second: Tick | None


def first_difference(first: Session, second: Session) -> Difference | None:
    """Where the downlinks of two sessions part; None if they are the same.

    The digests show which stretch of `STRIDE` control steps it is in; both are flown to its end.
    """
    pairs = zip(first.digests, second.digests, strict=False)
    stretch = next((k for k, (a, b) in enumerate(pairs) if a != b), None)
    if stretch is None and first.ticks == second.ticks:
        return None
    shorter = min(first.ticks, second.ticks)
    last = shorter + 1 if stretch is None else (stretch + 1) * STRIDE
    one, two = replay_session(first, last), replay_session(second, last)
    while True:
        a, b = next(one, None), next(two, None)
        if a is None and b is None:
            raise ScenarioError(
                "sessions: must fly here as they were recorded; received digests that differ, and "
                "the same bytes from both"
            )
        if a is None or b is None or a.downlink != b.downlink:
            return Difference(a, b)
