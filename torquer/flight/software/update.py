"""Updates of the software: files of the memory; a table of settings is taken up at the next boot.

Such a table has the settings of modules as a software file has them, `[modules.NAME.settings]`;
what it does not name stays. Any other bytes are stored, and can't be activated.
"""

from __future__ import annotations

import struct
import tomllib
import zlib
from collections.abc import Mapping
from typing import NamedTuple

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.memory import Memory

#: File of the non-volatile memory with number and CRC-32 of the update that the next boot takes up.
ACTIVE = "active"
_MARK = struct.Struct("<HI")
#: Mark of no update: the last one has been taken up.
_NONE = b""


class Update(NamedTuple):
    """What a boot made of an update: reason of the event, its number, settings by module."""

    code: Reason
    number: int
    settings: Mapping[str, Spec]


def update_file(number: int) -> str:
    """Name of the file of an update."""
    return f"update.{number}"


def read_table(data: bytes, present: Mapping[str, Spec]) -> dict[str, Spec]:
    """Settings of modules as a table changes them; `present`: those of all modules.

    ValueError for what is none, or has modules or settings that there are not.
    """
    try:
        tables = tomllib.loads(data.decode())
    except RecursionError:
        raise ValueError("must not be nested so deeply") from None
    modules = tables.pop("modules", None)
    if tables or not isinstance(modules, dict) or not modules:
        raise ValueError("must be tables [modules.NAME.settings]")
    found = {}
    for name, table in modules.items():
        settings = table.get("settings") if isinstance(table, dict) else None
        if name not in present or not isinstance(settings, dict) or len(table) != 1:
            raise ValueError(f"modules.{name}: must have settings of a module that flies")
        found[name] = present[name].model_copy(update=settings)
    return found


def mark(memory: Memory, number: int, crc: int) -> bool:
    """Have the next boot take up an update; False if the memory does not take the mark."""
    return memory.write(ACTIVE, _MARK.pack(number, crc))


def take_up(memory: Memory, present: Mapping[str, Spec]) -> Update | None:
    """The update that is marked, whose mark is then gone; None without one.

    SETTINGS_DAMAGED for one that can't be read any more, or does not fit.
    """
    data = memory.read(ACTIVE) if ACTIVE in memory.names() else _NONE
    if not data:  # a mark that cannot be read is reported by the memory
        return None
    memory.advance(ACTIVE, _NONE)
    if len(data) != _MARK.size:
        return Update(Reason.SETTINGS_DAMAGED, 0, {})
    number, crc = _MARK.unpack(data)
    content = memory.read(update_file(number))
    if content is None or zlib.crc32(content) != crc:
        return Update(Reason.SETTINGS_DAMAGED, number, {})
    try:
        return Update(Reason.UPDATED, number, read_table(content, present))
    except BaseException:  # a validator of the user's may raise anything
        return Update(Reason.SETTINGS_DAMAGED, number, {})
