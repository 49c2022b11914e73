"""The time-tagged plan: what waits on board, by the satellite's last report, beside what we know.

as sent            on board, and here as it was sent
on board only      of another ground, or of one whose archive is lost; or taken out, and still there
on ground only     here as waiting or received, and not in the report
not reported yet   received after the report, or that is incomplete, or there is none
over since         in the report; executed or cancelled since
"""

from __future__ import annotations

import math
import sqlite3

from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import LAST_REQUEST
from torquer.ground.archive import EPOCH_MS, quote_names
from torquer.ground.commands import (
    COLUMNS,
    RECEIVED,
    SENT,
    UNANSWERED,
    WAITING,
    as_shown,
)

#: The packet on a command that waits on board, and the command that asks for all of them.
PACKET, LIST = "plan", "plan_list"
_FIELDS = ("size", "place", "request", "command_id", "execute_s")
AS_SENT, BOARD_ONLY, GROUND_ONLY = "as sent", "on board only", "on ground only"
NOT_YET, OVER_SINCE = "not reported yet", "over since"
#: Most rows of reports, and delayed commands, that are looked at.
_MOST = 5000
#: What an entry has of the command here.
_SHOWN = ("id", "request", "command", "values", "execute_ms", "state", "made_by")
#: States in which a delayed command is not over.
_WAITS = (WAITING, SENT, RECEIVED)


def has_plan(dictionary: Dictionary) -> bool:
    """Whether the satellite can list its plan."""
    packet = dictionary.down.get(PACKET)
    return packet is not None and set(_FIELDS) <= set(packet.names) and LIST in dictionary.up


def compare_plan(db: sqlite3.Connection, dictionary: Dictionary) -> dict:
    """The plan on board beside that on the ground.

    `reported_ms`: when the last report came, None: never; `is_complete`: whether all of it has;
    `entries`: by execution time, each with `mark`, `request`, `execute_ms`, and `id`, `command`,
    `values`, `state`, `made_by` of the command here, None where there is none.
    """
    report, reported_ms, is_complete = _last_report(db)
    delayed = _delayed(db)
    names = {packet.id: name for name, packet in dictionary.up.items()}
    entries: list[dict] = []
    found: set[int] = set()
    for row in report:
        command = names.get(row["command_id"])
        others = (each for each in delayed if each["id"] not in found)
        ours = next((each for each in others if _is_same(row, command, each)), None)
        if ours is not None:
            found.add(ours["id"])
        entries.append(_reported(row, command, ours, reported_ms))
    for each in delayed:
        if each["id"] not in found and each["state"] in _WAITS:
            told_ms = reported_ms if is_complete and reported_ms else math.inf
            is_newer = each["state"] == RECEIVED and (each["received_ms"] or 0) > told_ms
            mark = NOT_YET if is_newer or told_ms == math.inf else GROUND_ONLY
            entries.append({name: each[name] for name in _SHOWN} | {"mark": mark, "place": None})
    entries.sort(key=_place)
    return {"reported_ms": reported_ms, "is_complete": is_complete, "entries": entries}


def _place(entry: dict) -> tuple:
    """Where an entry stands: by execution time, those on board in their order, then the rest."""
    place = math.inf if entry["place"] is None else entry["place"]
    return entry["execute_ms"], place, entry["id"] or 0


def _last_report(db: sqlite3.Connection) -> tuple[list[dict], int | None, bool]:
    """The packets of the last report, when it came, and whether all of it has."""
    names = ("_received_ms", *_FIELDS)
    rows = db.execute(
        f"SELECT {quote_names(names)} FROM {PACKET} WHERE _received_ms IS NOT NULL "
        "ORDER BY _received_ms DESC, _time_ms DESC, place DESC LIMIT ?",
        (_MOST,),
    )
    report: list[dict] = []
    for values in rows:
        row = dict(zip(names, values, strict=True))
        if report and (row["size"] != report[-1]["size"] or row["place"] >= report[-1]["place"]):
            break  # of a report before
        report.append(row)
    if not report:
        return [], None, False
    size, reported_ms = report[0]["size"], report[0]["_received_ms"]
    return (report[::-1] if size else []), reported_ms, len(report) == size or not size


def _delayed(db: sqlite3.Connection) -> list[dict]:
    """The delayed commands of the ground, newest first."""
    statement = (
        f"SELECT {quote_names(COLUMNS)} FROM _commands WHERE execute_s > 0 ORDER BY id DESC LIMIT ?"
    )
    return [
        as_shown(dict(zip(COLUMNS, row, strict=True))) for row in db.execute(statement, (_MOST,))
    ]


def _is_same(row: dict, command: str | None, ours: dict) -> bool:
    """Whether a packet on the plan is about a command of ours.

    With PUS it has the number of the telecommand, which the ground does not keep.
    """
    has_number = 0 < row["request"] <= LAST_REQUEST
    return (
        ours["command"] == command
        and ours["execute_ms"] == _execute_ms(row)
        and (not has_number or row["request"] == ours["request"])
    )


def _reported(row: dict, command: str | None, ours: dict | None, reported_ms: int | None) -> dict:
    """An entry of the report, with the command here."""
    on_board = {
        "request": row["request"],
        "execute_ms": _execute_ms(row),
        "place": row["place"],
        "command": command,
    }
    if ours is None:
        return dict.fromkeys(_SHOWN) | on_board | {"mark": BOARD_ONLY}
    mark = AS_SENT
    if ours["state"] not in (*_WAITS, UNANSWERED):
        is_since = (ours["answered_ms"] or 0) > (reported_ms or 0)
        mark = OVER_SINCE if is_since else BOARD_ONLY
    return {name: ours[name] for name in _SHOWN} | on_board | {"mark": mark}


def _execute_ms(row: dict) -> int:
    return EPOCH_MS + 1000 * row["execute_s"]
