"""What the ground that runs knows and its archive may lack, for commands that read archives."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from torquer.base.dates import iso_s
from torquer.cli.output import print_note

T = TypeVar("T")
#: How long a ground is waited for that is asked for a note alone [s].
_PATIENCE_S = 2.0


def ask_or_read(archive: Path, ask: Callable[..., T], read: Callable[[Path], T]) -> T:
    """`ask(ground, satellite)` of the ground that writes an archive; where none does, `read` of it.

    What is read alone lacks what a disk did not take: a note says so.
    """
    from torquer.ground.client import RunningGround

    try:
        return ask(RunningGround(archive.parent), archive.stem)
    except ValueError:  # none runs, or it serves other satellites
        found = read(archive)
        print_note(f"{archive.name} alone is read: no ground that writes it answers")
        return found


def note_what_waits(archive: Path) -> None:
    """Say since when the ground that writes an archive cannot: what came since is not in it."""
    from torquer.ground.alarm import ARCHIVE_ALARM
    from torquer.ground.client import RunningGround
    from torquer.ground.limits import IN_ORDER

    with suppress(ValueError):  # none runs, or it serves other satellites
        for each in RunningGround(archive.parent, patience_s=_PATIENCE_S).alarms(archive.stem):
            if each["key"] == ARCHIVE_ALARM and each.get("condition", IN_ORDER) != IN_ORDER:
                since = iso_s(each["since_ms"])
                print_note(f"{archive.name}: nothing is archived since {since}, and this lacks it")
