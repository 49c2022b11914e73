"""One satellite: its link, its frames, its archive, its commands, and what browsers see of it."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

from torquer.flight.link import Link, connect
from torquer.flight.packets.commands import Sent
from torquer.flight.packets.frames import Frame
from torquer.flight.packets.keys import KEY_COMMAND
from torquer.flight.packets.station import Station
from torquer.ground.alarm_desk import AlarmDesk
from torquer.ground.archive import RECORDED, SUSPECT, Archive, Row
from torquer.ground.commands import ANSWER_MS, EXECUTED, Commands
from torquer.ground.file import Satellite
from torquer.ground.history import ground_entry, has_events, satellite_entry
from torquer.ground.live import Live
from torquer.ground.recording import Judge
from torquer.ground.satellite_clock import SatelliteClock
from torquer.ground.stack import Stack
from torquer.ground.stack_file import SavedStacks

#: Time between two looks at a link on which nothing comes [s].
PAUSE_S = 0.005
#: Time between two messages on the state of a link, and two looks at late answers [s].
REPORT_S = 1.0
#: Time without a byte after which a satellite that has no connection is thought away [s].
SILENCE_S = 30.0
#: Counters in the archive: of commands, of changes of their key, of telemetry; number of the key.
UP, RECOVERY, DOWN, KEY = "up", "recovery", "down", "key"


def now_ms() -> int:
    """The time of this machine [ms since 1970, UTC]."""
    return time.time_ns() // 1_000_000


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

    Counters of both directions are kept in the archive. With keys that everybody knows, a
    satellite that counts from 0 again is accepted: such keys prove nothing, and simulations
    start again all the time.
    """

    def __init__(
        self, satellite: Satellite, folder: Path, live: Live, counters: Counters = AS_ARCHIVED
    ):
        self.satellite, self._live = satellite, live
        self.key, self.dictionary = satellite.key, satellite.software.dictionary
        self.archive = Archive(folder / f"{satellite.key}.sqlite", self.dictionary)
        self.commands = Commands(self.archive, self.dictionary, satellite.names)
        self.clock = SatelliteClock()
        self.saved_stacks = SavedStacks(folder / "stacks" / satellite.key)
        self.stack = Stack(self, lambda stack: live.message("stack", self.key, stack))
        self.link: Link = connect(satellite.link, self.dictionary)
        self._station, self._frames = Station(satellite.software), 0
        self._judge = Judge(self._station, self.dictionary)
        self._is_open_to_all = satellite.software.keys.are_known
        self._heard_s, self._was_connected, self._reject = -math.inf, False, 0
        show = partial(live.message, "alarms", self.key)
        self.alarms = AlarmDesk(self.archive, self.dictionary, satellite.names, self.note, show)
        last = {UP: counters.commands, RECOVERY: counters.recovery}
        self.archive.put([], {name: max(self.archive.counter(name), n) for name, n in last.items()})
        protection = self._station.protection
        if protection is not None and not (counters.new_telemetry or self._is_open_to_all):
            protection.telemetry.counters[satellite.software.keys.spi] = self.archive.counter(DOWN)

    def close(self) -> None:
        """End the link and the archive."""
        self.link.close()
        self.alarms.save(self.alarms.unsaved())
        self.archive.close()

    async def serve(self) -> None:
        """Receive, archive, show, send, until cancelled."""
        report_s = 0.0
        with ThreadPoolExecutor(1, f"archive of {self.key}") as writer:
            while True:
                worked = await self._receive(writer)
                worked = self._send() or worked
                if time.monotonic() >= report_s:
                    report_s = time.monotonic() + REPORT_S
                    self._report()
                    await self._save_alarms(writer)
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
        number = self.archive.note(*entry)
        self._live.message("log", self.key, ground_entry(number, *entry))

    def state(self) -> dict:
        """Link and counts."""
        return {
            "connected": self.is_connected,
            "frames": self._frames,
            **self.link.counts(),
            **self._station.counts(),
            "address": self.satellite.link,
        }

    async def _receive(self, writer: ThreadPoolExecutor) -> bool:
        data = self.link.receive()
        if not data:
            return False
        at_ms = now_ms()
        pairs = self._judge.rows(self._station.receive(data), at_ms)
        self._accept_restart()
        if pairs:
            rows = [row for _, row in pairs]
            self._frames, self._heard_s = self._frames + len(rows), time.monotonic()
            loop = asyncio.get_running_loop()
            await loop.run_in_executor(writer, self.archive.put, rows, self._counters())
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

    async def _save_alarms(self, writer: ThreadPoolExecutor) -> None:
        if unsaved := self.alarms.unsaved():
            loop = asyncio.get_running_loop()
            await loop.run_in_executor(writer, self.alarms.save, unsaved)

    def _send(self) -> bool:
        """Hand commands that are due to the link, once there is one."""
        sent = False
        if self.link.is_ready:
            until_s = self.clock.seconds_in(ANSWER_MS * 1e-3)
            for number, frame in self.commands.due(now_ms(), until_s):
                self._set_counter(frame)
                self.link.send(self._station.command(frame))
                self._live.message("commands", self.key, self.commands.sent(number, now_ms()))
                sent = True
        return sent

    def _set_counter(self, frame: bytes) -> None:
        """Use the next counter of a command's key, which is kept before it is used."""
        protection = self._station.protection
        if protection is not None and self._station.changes_key(frame):
            protection.recovery.counter = self.archive.next_counter(RECOVERY) - 1
        elif protection is not None:
            self._station.use_key(self.archive.counter(KEY), self.archive.next_counter(UP) - 1)

    def _note_key(self, answered: dict) -> None:
        """Use the new key of commands from its change on, which the satellite has confirmed."""
        if answered["command"] == KEY_COMMAND and answered["state"] == EXECUTED:
            self.archive.put([], {KEY: answered["values"]["number"], UP: 0})

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
            self.archive.put([], {KEY: 0})
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

    def _report(self) -> None:
        """State of the link, and commands whose answers are late."""
        if self.is_connected != self._was_connected:
            self._was_connected = self.is_connected
            self.note(*(("info", "link found") if self.is_connected else ("warning", "link lost")))
        self.alarms.tick()
        for late in self.commands.expire(now_ms(), self.clock.latest_ms):
            self._live.message("commands", self.key, late)
        self._live.message("links", self.key, self.state())
