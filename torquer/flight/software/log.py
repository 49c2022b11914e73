"""The log that keeps the last events.

After `module_add_err_log` of SDOT 3.4: time stamp, module, code.
"""

import struct
from collections import deque
from typing import NamedTuple


class Entry(NamedTuple):
    """One event: on-board time [ms since 2010-01-01], module id, reason code, argument (i32)."""

    time_ms: int
    module: int
    code: int
    argument: int


_ENTRY = struct.Struct("<QBBi")
_TOTAL = struct.Struct("<I")
_GREATEST = 2**31 - 1


class Log:
    """The last `size` events; `total` counts all of them. Plain state that can be copied.

    `told`: how many of them have been taken for the ground, or were lost before that.
    """

    def __init__(self, size: int = 64):
        self.entries: deque[Entry] = deque(maxlen=size)
        self.total = self.told = 0

    def add(self, time_ms: int, module: int, code: int, argument: int = 0) -> Entry:
        """Append an event, the oldest leaves a full log; an argument beyond i32 is saturated.

        ValueError for a module or code that is no byte: it could be neither kept nor sent.
        """
        if not (0 <= module <= 255 and 0 <= code <= 255):
            must = "must have a module and a code of 0 to 255"
            raise ValueError(f"{must}; received {module}, {code}")
        held = max(-_GREATEST - 1, min(_GREATEST, int(argument)))
        entry = Entry(time_ms, module, int(code), held)
        self.entries.append(entry)
        self.total += 1
        return entry

    def take_news(self) -> list[Entry]:
        """The events since the last call, as many of them as the log still has."""
        count = min(self.total - self.told, len(self.entries))
        self.told = self.total
        return list(self.entries)[len(self.entries) - count :]

    def save(self) -> bytes:
        """Count and entries for the non-volatile memory: u32, then 14 bytes an entry."""
        total = _TOTAL.pack(min(self.total, 2**32 - 1))
        return total + b"".join(_ENTRY.pack(*entry) for entry in self.entries)

    def restore(self, data: bytes | None) -> bool:
        """Take over what `save` gave; False, and an empty log, for anything else."""
        self.entries.clear()
        self.total = self.told = 0
        if data is None or len(data) < _TOTAL.size or (len(data) - _TOTAL.size) % _ENTRY.size:
            return False
        (self.total,) = _TOTAL.unpack_from(data)
        self.told = self.total
        self.entries.extend(map(Entry._make, _ENTRY.iter_unpack(data[_TOTAL.size :])))
        return True
