"""FS, the file system: updates of the software, taken as blocks and checked as a whole.

An update is stored, and marked for the next boot, only if its length and its CRC-32 are those that
were announced. What can be marked is a table of settings: `torquer.flight.software.update`.
"""

from __future__ import annotations

import zlib

from pydantic import Field

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.memory import Report
from torquer.flight.software.modules.module import Module
from torquer.flight.software.update import mark, read_table, update_file

#: Events in a step: a part of what the log holds; most that wait, the newest of more.
_AT_ONCE, _WAITING = 16, 64


class FsSettings(Spec):
    """Settings of the file system."""

    greatest_size: int = Field(default=262144, ge=1, le=2**24)
    """Bytes of the longest update."""


class Fs(Module):
    """Receives updates; reports what went wrong in the non-volatile memory."""

    name = "fs"
    Settings = FsSettings
    period_s = 5.0

    def __init__(self, settings: FsSettings):
        super().__init__(settings)
        self.number = self.crc = 0
        self.data: bytearray | None = None
        self.missing: set[int] = set()
        self.updates = 0
        self.reports: list[Report] = []

    def step(self, core) -> None:
        """Events of the memory, a few at a time; argument: CRC-32 of the file's name, 31 bits."""
        self.reports = [*self.reports, *core.memory.take_reports()][-_WAITING:]
        for report in self.reports[:_AT_ONCE]:
            core.report("fs", report.code, zlib.crc32(report.name.encode()) & 0x7FFFFFFF)
        del self.reports[:_AT_ONCE]

    def on_update_begin(self, core, values) -> Reason:
        """Announce a file; one that was announced before and is not complete is forgotten."""
        number, size, crc = values
        if not 0 < size <= self.settings.greatest_size:
            return Reason.VALUE
        self.number, self.crc, self.data = number, crc, bytearray(size)
        self.missing = set(range(0, size, 64))
        return Reason.DONE

    def on_update_block(self, core, values) -> Reason:
        """64 bytes at a multiple of 64, in any order; what is beyond the file's end is ignored."""
        offset, block = values
        if self.data is None:
            return Reason.STATE
        if offset % 64 or offset >= len(self.data):
            return Reason.VALUE
        kept = block[: len(self.data) - offset]
        self.data[offset : offset + len(kept)] = kept
        self.missing.discard(offset)
        return Reason.DONE

    def on_update_end(self, core, values) -> Reason:
        """Check the file; a wrong one is forgotten. VALUE for one to activate that is no table of
        settings: it may still be stored."""
        (activate,) = values
        if self.data is None:
            return Reason.STATE
        if activate > 1:
            return Reason.VALUE
        if self.missing:
            return Reason.LENGTH
        data = bytes(self.data)
        if zlib.crc32(data) != self.crc:
            self.data = None
            return Reason.CHECKSUM
        if activate and not _is_table(core, data):
            return Reason.VALUE
        self.data = None
        written = core.memory.write(update_file(self.number), data)
        if written and activate:
            written = mark(core.memory, self.number, self.crc)
        self.updates += written
        return Reason.DONE if written else Reason.FAILED

    def status(self) -> dict[str, float]:
        """Updates stored since the boot, blocks that are still to come."""
        return {"updates": self.updates, "missing": len(self.missing) if self.data else 0}


def _is_table(core, data: bytes) -> bool:
    """Whether an update is a table of settings that the modules can have."""
    try:
        read_table(data, {name: module.settings for name, module in core.modules.items()})
    except ValueError:
        return False
    return True
