"""TM, telemetry: beacon, extended packets, the stored record and its replay, dumps of files.

After SDOT App. A. The record is a ring of files in the non-volatile memory.
"""

from __future__ import annotations

import math
import struct

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.codec import decoder, encoder
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Module
from torquer.flight.software.modules.telemetry import beacon, extended_values

#: At the beginning of a file of the record its number since the first one, in the order of time
#: whatever the clock does; before the data of each packet in it the on-board time [s].
_FILE = _TIME = struct.Struct("<I")
#: Frames of a replay or dump that a step sends: fewer than the ground queue holds.
_AT_ONCE = 4
_DUMPED = 64
#: Packets on modules that a step sends.
_MODULES_AT_ONCE = 2
#: Subsystems whose telemetry has a period of its own, as the command `set_period` numbers them: the
#: module that sends it, the packet, its setting, and its attribute of when the next one is due.
PERIODS = (
    ("tm", "extended", "extended_s", ""),
    ("svr", "devices", "report_s", "due_s"),
    ("tm", "module_status", "modules_s", ""),
    ("cdh", "queues", "report_s", "due_s"),
    ("adc", "housekeeping", "report_s", "due_s"),
    ("wheels", "wheels", "report_s", "due_s"),
)


def record_file(number: int) -> str:
    """Name of a file of the record."""
    return f"record.{number}"


class TmSettings(Spec):
    """Settings of telemetry; a period of 0: none."""

    beacon_s: float = Field(default=10.0, ge=0.0)
    """Time between beacons."""
    extended_s: float = Field(default=1.0, ge=0.0)
    """Time between extended packets."""
    store_s: float = Field(default=60.0, ge=0.0)
    """Time between stored packets."""
    modules_s: float = Field(default=0.0, ge=0.0)
    """Time between the packets on the status of all modules."""
    in_file: int = Field(default=30, ge=1, le=1000)
    """Stored packets in a file of the record; a reboot loses those of the file just begun."""
    files: int = Field(default=100, ge=1, le=1000)
    """Files of the record; the oldest is overwritten."""


class Tm(Module):
    """Sends telemetry in its periods, stores some of it and sends it again on demand."""

    name = "tm"
    Settings = TmSettings
    period_s = 0.1

    def __init__(self, settings: TmSettings):
        super().__init__(settings)
        self.due_ms = {"beacon": 0, "extended": 0, "store": 0, "modules": 0}
        self.described: list[str] = []
        self.begun = bytearray()
        self.spans: dict[int, tuple[int, int]] = {}
        self.next_file = self.stored = 0  # files by their numbers since the first one
        self.replayed: tuple[int, int, int, int] | None = None
        self.waiting: list[bytes] = []
        self.skipped = 0
        self.dumped: tuple[int, str, int, int] | None = None

    def start(self, core) -> None:
        """Find the record that the memory holds; the first packets, but on modules, are due now."""
        now_ms = round(core.t_s * 1e3)
        self.due_ms = dict.fromkeys(self.due_ms, now_ms)
        self.due_ms["modules"] += round(self.settings.modules_s * 1e3)
        found = set(core.memory.names())
        for place in range(self.settings.files):
            is_there = record_file(place) in found
            data = (core.memory.read(record_file(place)) if is_there else None) or b""
            records = self._split(core, data[_FILE.size :])
            if records:
                (number,) = _FILE.unpack_from(data)
                self.spans[number] = _span(records)
        self.next_file = max(self.spans, default=-1) + 1

    def step(self, core) -> None:
        """Send and store what is due, then a part of replay and dump."""
        now_ms, due, settings = round(core.t_s * 1e3), self.due_ms, self.settings
        if due["beacon"] <= now_ms and settings.beacon_s:
            due["beacon"] = _next(due["beacon"], settings.beacon_s, now_ms)
            core.send("beacon", beacon(core))
        sends = due["extended"] <= now_ms and settings.extended_s
        stores = due["store"] <= now_ms and settings.store_s
        if sends or stores:
            values = extended_values(core)
            if sends:
                due["extended"] = _next(due["extended"], settings.extended_s, now_ms)
                core.send("extended", values)
            if stores:
                due["store"] = _next(due["store"], settings.store_s, now_ms)
                self._store(core, values)
        if settings.modules_s and due["modules"] <= now_ms:
            due["modules"] = _next(due["modules"], settings.modules_s, now_ms)
            self.described = list(core.modules)
        for name in self.described[:_MODULES_AT_ONCE]:
            core.send("module_status", core.account(name))
        del self.described[:_MODULES_AT_ONCE]
        if self.replayed is not None or self.waiting:
            self._replay(core)
        if self.dumped is not None:
            self._dump(core)

    def on_set_rates(self, core, values) -> Reason:
        """Change the periods [s]; they begin now."""
        beacon_s, extended_s, store_s = values
        code = self.change(core, beacon_s=beacon_s, extended_s=extended_s, store_s=store_s)
        if code is Reason.DONE:
            self.due_ms = dict.fromkeys(self.due_ms, round(core.t_s * 1e3))
        return code

    def on_set_period(self, core, values) -> Reason:
        """Change the period [s] of one subsystem's telemetry; it begins now. 0: none."""
        number, period_s = values
        if number >= len(PERIODS):
            return Reason.VALUE
        name, packet, setting, due = PERIODS[number]
        module = core.modules.get(name)
        has_it = module is not None and hasattr(module.settings, setting) and core.sends(packet)
        if not has_it or core.lacks(name):
            return Reason.NOT_AVAILABLE
        if not core.is_running(name):
            return Reason.STATE
        code = module.change(core, **{setting: period_s})
        if code is Reason.DONE and due:
            setattr(module, due, core.t_s)
        elif code is Reason.DONE:
            self.due_ms[setting.removesuffix("_s")] = round(core.t_s * 1e3)
        return code

    def in_force(self, core):
        """The periods of all telemetry; not a number: of a module that does not fly."""
        found = [core.modules.get(name) for name, *_ in PERIODS]
        periods = [
            getattr(getattr(module, "settings", None), setting, math.nan)
            for module, (_, _, setting, _) in zip(found, PERIODS, strict=True)
        ]
        return [("periods", (self.settings.beacon_s, self.settings.store_s, *periods))]

    def on_replay(self, core, values) -> Reason:
        """Send what was stored between two times [s since 2010-01-01], each or every n-th."""
        from_s, to_s, every = values
        if from_s > to_s or every < 1:
            return Reason.VALUE
        if self.replayed is not None or self.waiting:
            return Reason.STATE
        within = any(first <= to_s and last >= from_s for first, last in self.spans.values())
        begun = [r for r in self._split(core, self.begun) if from_s <= _record_time(r) <= to_s]
        if not within and not begun:
            return Reason.NOT_AVAILABLE
        self.replayed, self.skipped = (min(self.spans, default=0), from_s, to_s, every), 0
        return Reason.DONE

    def on_dump(self, core, values) -> Reason:
        """Send part of a file of the memory, as far as it goes."""
        number, offset, length = values
        if self.dumped is not None:
            return Reason.STATE
        names = core.memory.names()
        if number >= len(names):
            return Reason.NOT_AVAILABLE
        data = core.memory.read(names[number])
        if data is None:
            return Reason.NOT_AVAILABLE
        end = min(offset + length, len(data))
        if offset >= end:
            return Reason.VALUE
        self.dumped = number, names[number], offset, end
        return Reason.DONE

    def status(self) -> dict[str, float]:
        """Packets stored since the boot, whether a replay or dump goes on, periods."""
        settings = self.settings
        return {
            "stored": self.stored,
            "busy": float(self.replayed is not None or self.dumped is not None),
            "beacon_s": settings.beacon_s,
            "extended_s": settings.extended_s,
            "store_s": settings.store_s,
        }

    def _store(self, core, values) -> None:
        """Append a packet to the file begun; write it once it is full."""
        data = encoder(core.dictionary.down["stored"])(values)
        self.begun += _TIME.pack(core.clock.now_s) + data
        self.stored += 1
        records = self._split(core, self.begun)
        if len(records) < self.settings.in_file:
            return
        place = record_file(self.next_file % self.settings.files)
        if core.memory.write(place, _FILE.pack(self.next_file) + bytes(self.begun)):
            self.spans[self.next_file] = _span(records)
            self.spans.pop(self.next_file - self.settings.files, None)
            self.next_file += 1
        self.begun.clear()

    def _split(self, core, data: bytes | bytearray) -> list[bytes]:
        """The records of a file."""
        size = _TIME.size + core.dictionary.down["stored"].size
        return [bytes(data[at : at + size]) for at in range(0, len(data) - size + 1, size)]

    def _records(self, core, number: int) -> list[bytes]:
        data = core.memory.read(record_file(number % self.settings.files)) or b""
        is_there = data[: _FILE.size] == _FILE.pack(number)  # else overwritten since
        return self._split(core, data[_FILE.size :]) if is_there else []

    def _replay(self, core) -> None:
        """The next frames of a replay: files in their order, then what is not in one yet.

        A file that is completed meanwhile is sent, too.
        """
        while len(self.waiting) < _AT_ONCE and self.replayed is not None:
            number, from_s, to_s, every = self.replayed
            ends = number >= self.next_file
            records = self._split(core, self.begun) if ends else self._records(core, number)
            self.replayed = None if ends else (number + 1, from_s, to_s, every)
            for record in records:
                if from_s <= _record_time(record) <= to_s:
                    if self.skipped % every == 0:
                        self.waiting.append(record)
                    self.skipped += 1
        packet = core.dictionary.down["stored"]
        for record in self.waiting[:_AT_ONCE]:
            values = decoder(packet)(record, _TIME.size)
            core.put_frame(core.frame("stored", values, time_s=_record_time(record)))
        del self.waiting[:_AT_ONCE]

    def _dump(self, core) -> None:
        """The next frames of a dump; it ends early if the file is gone."""
        number, name, offset, end = self.dumped
        data = core.memory.read(name) or b""
        for _ in range(_AT_ONCE):
            part = data[offset : min(offset + _DUMPED, end)]
            if not part:
                break
            core.send("dump", (number, offset, len(part), part))
            offset += len(part)
        more = offset < min(end, len(data))
        self.dumped = (number, name, offset, end) if more else None


def _record_time(record: bytes) -> int:
    return _TIME.unpack_from(record)[0]


def _span(records: list[bytes]) -> tuple[int, int]:
    """Least and greatest time of records [s]."""
    times = [_record_time(record) for record in records]
    return min(times), max(times)


def _next(due_ms: int, period_s: float, now_ms: int) -> int:
    """When something is due again [ms]: after its period, once for steps that were left out."""
    period_ms = max(1, round(period_s * 1e3))
    return max(due_ms + period_ms, now_ms + 1)
