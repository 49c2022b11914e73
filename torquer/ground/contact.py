"""One satellite: its link, its frames, its archive, its commands, and what browsers see of it."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from torquer.flight.link import Link, connect
from torquer.flight.packets.commands import Sent
from torquer.flight.packets.frames import Frame
from torquer.flight.packets.keys import KEY_COMMAND
from torquer.flight.packets.station import Station
from torquer.ground.alarm import ARCHIVE_ALARM
from torquer.ground.alarm_desk import AlarmDesk
from torquer.ground.archive import RECORDED, SUSPECT, Row
from torquer.ground.command_states import EXECUTED
from torquer.ground.commands import ANSWER_MS, Commands
from torquer.ground.file import Satellite
from torquer.ground.ground_clock import now_ms
from torquer.ground.history import ground_entry, has_events, satellite_entry
from torquer.ground.kept_counters import COMMAND, DOWN, RECOVERY, UP, KeptCounters
from torquer.ground.live import Live
from torquer.ground.recording import Judge
from torquer.ground.satellite_clock import SatelliteClock
from torquer.ground.silence import Pace
from torquer.ground.spool import Spool
from torquer.ground.stack import Stack
from torquer.ground.stack_file import SavedStacks
from torquer.ground.storage_report import StorageReport

#: Time between two looks at a link on which nothing comes [s].
PAUSE_S = 0.005
#: Time between two messages on the state of a link, and two looks at late answers [s].
REPORT_S = 1.0
#: Time without a byte after which a satellite that has no connection is thought away [s].
SILENCE_S = 30.0


class Counters(NamedTuple):
    """How counters of protected frames go on, where not as the archive has them.

    `commands`, `recovery`: the last ones used with these keys, for an archive that was lost;
    `new_telemetry`: telemetry may count from 0 again, once.
    """

    commands: int = 0
    recovery: int = 0
    new_telemetry: bool = False


AS_ARCHIVED = Counters()


class Contact:
    """A satellite whose link is served; `clock`: its clock by telemetry.

    Counters of commands are kept in a file before they are used, that of telemetry in the archive.
    With keys that everybody knows, a satellite that counts from 0 again is accepted: such keys
    prove nothing, and simulations start again all the time.
    """

    def __init__(
        self, satellite: Satellite, folder: Path, live: Live, counters: Counters = AS_ARCHIVED
    ):
        self.satellite, self._live = satellite, live
        self.key, self.dictionary = satellite.key, satellite.software.dictionary
        try:
            self.link: Link = connect(satellite.link, self.dictionary)
        except ValueError as error:
            raise ValueError(f"satellites.{self.key}.link: {error}") from None
        try:
            self.spool = Spool(folder / f"{satellite.key}.sqlite", self.dictionary)
        except BaseException:
            self.link.close()
            raise
        found = self.spool.found
        self.counters = KeptCounters(
            folder / f"{satellite.key}.counters",
            None if found is None else found.counters,
            self.spool.add_counters,
        )
        self.commands = Commands(
            self.dictionary, satellite.names, self.spool.keep_command, self._next_number
        )
        self.clock, self.pace = SatelliteClock(), Pace()
        self.heard_ms: int | None = None
        self._frames, self._is_open_to_all = 0, satellite.software.keys.are_known
        self._was_connected, self._was_silent, self._reject = False, False, 0
        self._accepts_new = counters.new_telemetry or self._is_open_to_all
        self._storage = StorageReport(self.spool, self.counters)
        self._begin(self.counters.down)
        self.counters.at_least(up=counters.commands, recovery=counters.recovery)
        self._is_adopted = False
        self._adopt()
        self.counters.begin()
        self.saved_stacks = SavedStacks(folder / "stacks" / satellite.key)
        self.stack = Stack(self, lambda stack: live.message("stack", self.key, stack))
        show = partial(live.message, "alarms", self.key)
        self.alarms = AlarmDesk(self.spool, self.dictionary, satellite.names, self.note, show)

    def _begin(self, down: int) -> None:
        """Begin to look for frames, behind the last known counter of telemetry."""
        self._station = Station(self.satellite.software)
        self._judge = Judge(self._station, self.dictionary)
        self._heard_s = -math.inf
        protection = self._station.protection
        if protection is not None and not self._accepts_new:
            protection.telemetry.counters[self.satellite.software.keys.spi] = down

    def _adopt(self) -> None:
        """Take up what the archive held when the ground began, once it can be read."""
        found = self.spool.found
        if found is None or self._is_adopted:
            return
        self._is_adopted = True
        self.commands.adopt(found.commands)
        numbers = [command["id"] for command in found.commands]
        self.counters.learn(found.counters, command=max(numbers, default=0))

    async def restart(self) -> None:
        """Begin anew after a failure: another connection, and nothing of a frame that was begun."""
        await asyncio.to_thread(self.link.close)
        self.link = connect(self.satellite.link, self.dictionary)
        self._begin(self._counters().get(DOWN, 0))

    def close(self) -> int:
        """End the link and the archive; how many rows could not be archived."""
        self.link.close()
        self.counters.close()
        return self.spool.close()

    async def serve(self) -> None:
        """Receive, archive, show, send, until cancelled."""
        report_s = time.monotonic()
        while True:
            worked = await self._receive()
            worked = self._send() or worked
            now_s = time.monotonic()
            # a silence is told when it begins: the next report may be a second away
            if now_s >= report_s or self.pace.is_silent(now_s) != self._was_silent:
                # the ground stood still: answers may have come meanwhile, and are received first
                stood_still = now_s - report_s > 3.0 * REPORT_S
                report_s = now_s + REPORT_S
                self._report(has_received=not stood_still)
            await asyncio.sleep(0.0 if worked else PAUSE_S)

    @property
    def is_connected(self) -> bool:
        """Whether the satellite is there: frames have come, by this connection or of late."""
        if not self.link.is_ready:
            self._heard_s = -math.inf
        silence_s = math.inf if self.link.peers else SILENCE_S
        return time.monotonic() - self._heard_s < silence_s

    def order(self, commands: Sequence[Sent], by: str) -> list[dict]:
        """Take commands, all or none; `ScenarioError` with one line for what cannot be sent."""
        clock_ms = self.clock.now_ms()
        self.commands.check(commands, clock_ms)
        ordered = [self.commands.order(sent, by, now_ms(), clock_ms) for sent in commands]
        for each in ordered:
            self._live.message("commands", self.key, each)
        return ordered

    def cancel(self, number: int, by: str) -> dict:
        """Cancel a command that waits, here or on board; as `Commands.cancel`."""
        changed = self.commands.cancel(number, by, now_ms())
        self._live.message("commands", self.key, changed)
        return changed

    def note(self, severity: str, text: str) -> None:
        """An entry of the ground's log."""
        at_ms = now_ms()
        heard_ms = self.clock.latest_ms
        entry = (at_ms if heard_ms is None else heard_ms, at_ms, severity, text)
        number = self.spool.add_entry(*entry)
        self._live.message("log", self.key, ground_entry(number, *entry))

    def fail(self, text: str) -> None:
        """Say that the service has failed; what browsers see is no link."""
        self.note("alarm", text)
        self._heard_s, self._was_connected = -math.inf, False
        self._live.message("links", self.key, self.state())

    def state(self) -> dict:
        """Link, telemetry, archive, counts; `silent`: frames have come, and now none does."""
        return {
            "connected": self.is_connected,
            "silent": self.pace.is_silent(time.monotonic()),
            "heard_ms": self.heard_ms,
            "not_archived_since_ms": self.spool.since_ms,
            "frames": self._frames,
            **self.link.counts(),
            **self._station.counts(),
            "address": self.satellite.link,
        }

    async def _receive(self) -> bool:
        data = self.link.receive()
        if not data:
            return False
        at_ms = now_ms()
        pairs = self._judge.rows(self._station.receive(data), at_ms)
        self._accept_restart()
        if pairs:
            rows = [row for _, row in pairs]
            self._frames, self._heard_s = self._frames + len(rows), time.monotonic()
            self.heard_ms = at_ms
            self.pace.hear(self._heard_s)
            counters = self._counters()
            self.counters.down = counters.get(DOWN, 0)
            await self.spool.put_rows(rows, counters)
            self._live.rows(self.key, rows)
            self._look_at(pairs, at_ms)
        return True

    def _look_at(self, pairs: list[tuple[Frame, Row]], at_ms: int) -> None:
        """Clock, answers and events in new frames."""
        times = [
            row.time_ms for _, row in pairs if row.packet not in RECORDED and row.quality != SUSPECT
        ]
        if times:
            self.clock.hear(max(times))
        for frame, row in pairs:
            names = frame.packet.names
            if row.packet == "acknowledgement":
                values = dict(zip(names, frame.values, strict=True))
                answered = self.commands.answered(values, at_ms)
                if answered is not None:
                    self._note_key(answered)
                    self._live.message("commands", self.key, answered)
            if row.packet == "event" and has_events(self.dictionary):
                values = dict(zip(names, row.values, strict=True))
                entry = satellite_entry(
                    self.dictionary, row.digest, row.time_ms, row.received_ms, values
                )
                self._live.message("log", self.key, entry)
        self.alarms.look(row for _, row in pairs)

    def _send(self) -> bool:
        """Hand commands that are due to the link, once there is one."""
        sent = False
        if self.link.is_ready:
            until_s = self.clock.seconds_in(ANSWER_MS * 1e-3)
            for number, frame in self.commands.due(now_ms(), until_s):
                if not self._use_next_counter(frame):
                    break
                self.link.send(self._station.command(frame))
                self._live.message("commands", self.key, self.commands.sent(number, now_ms()))
                sent = True
        return sent

    def _next_number(self) -> int | None:
        return self.counters.take(COMMAND)

    def _use_next_counter(self, frame: bytes) -> bool:
        """Use the next counter of a command's key, if one is kept: else the command waits."""
        protection = self._station.protection
        if protection is None:
            return True
        is_change = self._station.changes_key(frame)
        counter = self.counters.take(RECOVERY if is_change else UP)
        if counter is None:
            return False
        if is_change:
            protection.recovery.counter = counter - 1
        else:
            self._station.use_key(self.counters.key, counter - 1)
        return True

    def _note_key(self, answered: dict) -> None:
        """Use the new key of commands from its change on, which the satellite has confirmed."""
        if answered["command"] == KEY_COMMAND and answered["state"] == EXECUTED:
            self.counters.change_key(answered["values"]["number"])

    def _tell_archive(self) -> None:
        """Raise the alarm of an archive that takes nothing, or say that it is over."""
        since_ms = self.spool.since_ms
        severity = None if since_ms is None else "alarm"
        reason = f"not archived: {self.spool.reason}" if since_ms is not None else ""
        self.alarms.tell(ARCHIVE_ALARM, severity, reason, since_ms or now_ms())

    def _counters(self) -> dict[str, int]:
        protection = self._station.protection
        return {} if protection is None else {DOWN: max(protection.telemetry.counters.values())}

    def _accept_restart(self) -> None:
        """Say that frames are rejected; with known keys let a satellite count from 0 again."""
        protection = self._station.protection
        if protection is None:
            return
        rejected = protection.telemetry.rejected["replayed"]
        if rejected == self._reject:
            return
        if self._is_open_to_all:
            protection.telemetry.counters = dict.fromkeys(protection.telemetry.counters, 0)
            if self.counters.key:
                self.counters.change_key(0, self.counters.last(UP))
            self.note(
                "info", "telemetry counts from the beginning: a restarted satellite, or a replay"
            )
        elif self._reject == 0:
            self.note(
                "alarm",
                "telemetry is rejected: its counter is not above the last accepted one. Frames are "
                "replayed, or the satellite has lost its memory; `torquer ground "
                "--new-telemetry` accepts that once",
            )
        self._reject = rejected

    def _report(self, has_received: bool) -> None:
        """State of link and archive, and commands whose answers are late."""
        self._adopt()
        self._was_silent = self.pace.is_silent(time.monotonic())
        if self.is_connected != self._was_connected:
            self._was_connected = self.is_connected
            self.note(*(("info", "link found") if self.is_connected else ("warning", "link lost")))
        for severity, text in self._storage.news():
            self.note(severity, text)
        self._tell_archive()
        self.alarms.tick()
        late = self.commands.expire(now_ms(), self.clock.latest_ms) if has_received else []
        for each in late:
            self._live.message("commands", self.key, each)
        self._live.message("links", self.key, self.state())
