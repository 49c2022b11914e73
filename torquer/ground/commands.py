"""Commands of a satellite from order to answer, each with its state in the archive.

waiting     not sent yet: for its time, or for answers to those before it
sent        handed to the link
received    the satellite has it, and waits for its execution time
executed, refused      by the satellite's answer; `reason`: why it was refused
unanswered  no answer in time; one that comes later still counts
cancelled   never sent, or taken out of the satellite's plan

An answer names a command by its number (`request`), its packet and its execution time, and a
command states the last second at which it may be received: what counts as unanswered is not
executed later. Of a satellite whose answers have no number, two commands that are equal but for it
are never on their way at once. Nor do more commands wait for an answer than a satellite holds.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from torquer.base.time import utc_text
from torquer.computer.names import Names
from torquer.flight.packets.commands import ANSWERS, Sent, command_numbers
from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import LAST_REQUEST, Uplink, last_second
from torquer.flight.packets.reasons import Reason, describe_code
from torquer.ground.archive import EPOCH_MS, Archive, quote_names
from torquer.scenario.explain import ScenarioError

#: Time after which an answer is no longer waited for [ms]; of a delayed command, after its
#: execution time by the satellite's clock.
ANSWER_MS = 30_000
#: How long after a command was sent a late answer to it is thought possible [ms].
LATEST_MS = 3_600_000
#: Most commands that are not over.
MOST_OPEN = 1000
#: The command that takes another out of the satellite's plan.
CANCEL = "plan_cancel"
WAITING, SENT, RECEIVED = "waiting", "sent", "received"
EXECUTED, REFUSED, UNANSWERED, CANCELLED = "executed", "refused", "unanswered", "cancelled"
#: Columns of a command, as `as_shown` takes them.
COLUMNS = (
    *("id", "made_ms", "made_by", "command", "values", "execute_s", "state"),
    *("sent_ms", "received_ms", "answered_ms", "reason"),
)
_ANSWER = ("command_id", "accepted", "code", "command_time")


class _Open(NamedTuple):
    """A command that is not over.

    `key`: its number (0: answers have none), packet and execution time, as answers name it;
    `frame`: makes its frame by the mark of the last second to receive it.
    """

    id: int
    key: tuple[int, int, int]
    state: str
    since_ms: int
    not_before_ms: int = 0
    asks: bool = True
    frame: Callable[[int], bytes] = bytes


class Commands:
    """Commands of one satellite; times in ms since 1970, UTC, handed in by the caller."""

    def __init__(self, archive: Archive, dictionary: Dictionary, names: Names):
        self._archive, self._dictionary, self._names = archive, dictionary, names
        self._frame = Uplink(dictionary).frame
        self._has_answers = has_answers(dictionary)
        self._has_numbers = has_answers(dictionary, ("request",))
        with archive.writing() as db:
            db.execute(
                "UPDATE _commands SET state = ?, reason = 'the ground ended before it was sent' "
                "WHERE state = ?",
                (CANCELLED, WAITING),
            )
        unfinished = archive.read(
            "SELECT id, packet, execute_s, state, sent_ms FROM _commands "
            "WHERE acknowledge AND state IN (?, ?)",
            *(SENT, RECEIVED),
        )
        self._open = {
            number: _Open(number, (self._request(number), packet, execute_s), state, sent_ms)
            for number, packet, execute_s, state, sent_ms in unfinished
        }

    def check(self, commands: Sequence[Sent], clock_ms: int | None) -> None:
        """`ScenarioError` with one line if any of these commands cannot be taken."""
        if len(self._open) + len(commands) > MOST_OPEN:
            raise ScenarioError(f"command: must wait until fewer than {MOST_OPEN} are on their way")
        for sent in commands:
            execution_time_s(sent, clock_ms)
            command_numbers(sent, self._dictionary, self._names)

    def order(self, sent: Sent, by: str, now_ms: int, clock_ms: int | None) -> dict:
        """Take a command, to be sent `sent.at_s` from now; the command as `shown` gives it.

        `clock_ms`: the satellite's clock, None if no telemetry has shown it. `ScenarioError` with
        one line for what cannot be sent.
        """
        self.check([sent], clock_ms)
        numbers = command_numbers(sent, self._dictionary, self._names)
        execute_s = execution_time_s(sent, clock_ms)
        packet = self._dictionary.up[sent.command].id
        row = {
            "made_ms": now_ms,
            "made_by": by,
            "command": sent.command,
            "values": json.dumps(sent.values),
            "acknowledge": sent.acknowledge,
            "packet": packet,
            "execute_s": execute_s,
            "state": WAITING,
        }
        with self._archive.writing() as db:
            marks = ", ".join("?" * len(row))
            made = db.execute(
                f"INSERT INTO _commands ({quote_names([*row])}) VALUES ({marks})", [*row.values()]
            )
        number = made.lastrowid or 0
        request = self._request(number)
        self._open[number] = _Open(
            number,
            (request, packet, execute_s),
            WAITING,
            now_ms,
            now_ms + round(sent.at_s * 1e3),
            sent.acknowledge,
            lambda mark: self._frame(sent.command, execute_s, numbers, request, mark),
        )
        return self.shown(number)

    def due(self, now_ms: int, until_s: float | None = None) -> Iterator[tuple[int, bytes]]:
        """(number, frame) of the commands to be sent now, in order; `sent` must follow each.

        `until_s`: last second at which the satellite may receive them, by its clock [s since
        2010], None: any. One that has to wait for the answer to an equal one lets others go first.
        """
        mark = 0 if until_s is None or not self._has_numbers else last_second(until_s)
        for each in list(self._open.values()):
            if each.state == WAITING and each.not_before_ms <= now_ms:
                if self._is_full(each):
                    return
                if not self._is_on_way(each.key):
                    yield each.id, each.frame(mark)

    def cancel(self, number: int, by: str, now_ms: int) -> dict:
        """Cancel a command that was not sent, or have one taken out of the satellite's plan.

        The command, or the one that was ordered for that; `ScenarioError` with one line for a
        command that is past both.
        """
        each = self._open.get(number)
        if each is not None and each.state == WAITING:
            del self._open[number]
            return self._change(
                number, state=CANCELLED, reason=f"cancelled before it was sent, by {by}"
            )
        can_reach = self._has_numbers and CANCEL in self._dictionary.up
        if each is not None and each.state == RECEIVED and can_reach:
            order = Sent(at_s=0.0, command=CANCEL, values={"request": each.key[0]})
            return self.order(order, by, now_ms, None)
        found = self._archive.read("SELECT state FROM _commands WHERE id = ?", number)
        received = f"one that is {found[0][0]}" if found else "a number that no command has"
        raise ScenarioError(
            f"command: must wait here or on board to be cancelled; received {received}"
        )

    def sent(self, number: int, now_ms: int) -> dict:
        """Note that a command was handed to the link."""
        each = self._open[number]
        if each.asks and self._has_answers:
            self._open[number] = each._replace(state=SENT, since_ms=now_ms)
        else:
            del self._open[number]  # nobody will say what became of it
        return self._change(number, state=SENT, sent_ms=now_ms)

    def answered(self, values: Mapping[str, Any], now_ms: int) -> dict | None:
        """Take an acknowledgement; the command that it is for, None if there is none."""
        if not self._has_answers:
            return None
        request = int(values["request"]) if self._has_numbers else 0
        if self._has_numbers and not request:
            return None  # of somebody else's command
        key = request, int(values["command_id"]), int(values["command_time"])
        code = int(values["code"])
        number, doubt = self._find_number(key, now_ms)
        if number is None:
            return None
        if code == Reason.WAITING:
            if number in self._open:
                self._open[number] = self._open[number]._replace(state=RECEIVED)
            return self._change(number, state=RECEIVED, received_ms=now_ms)
        self._open.pop(number, None)
        state, reason = EXECUTED, ""
        if code == Reason.CANCELLED:
            state, reason = CANCELLED, describe_code(code)
        elif not values["accepted"]:
            state, reason = REFUSED, describe_code(code)
        reason = "; ".join(filter(None, (reason, doubt)))
        return self._change(number, state=state, answered_ms=now_ms, reason=reason)

    def expire(self, now_ms: int, clock_ms: int | None) -> list[dict]:
        """Give up waiting where no answer has come in time; the commands that it concerns."""
        late = [each.id for each in self._open.values() if _is_late(each, now_ms, clock_ms)]
        for number in late:
            del self._open[number]
        return [self._change(number, state=UNANSWERED) for number in late]

    def shown(self, number: int) -> dict:
        """A command as users see it."""
        statement = f"SELECT {quote_names(COLUMNS)} FROM _commands WHERE id = ?"
        return as_shown(self._archive.read(statement, number)[0])

    def _request(self, number: int) -> int:
        """The number of a command in answers, by that in the archive."""
        return _as_request(number) if self._has_numbers else 0

    def _is_full(self, waiting: _Open) -> bool:
        """Whether as many answers are waited for as the satellite holds."""
        return waiting.asks and sum(e.state == SENT for e in self._open.values()) >= ANSWERS

    def _is_on_way(self, key: tuple[int, int, int]) -> bool:
        """Whether an answer could be taken for that to a command which was sent before."""
        on_way = (each.key for each in self._open.values() if each.state in (SENT, RECEIVED))
        return key in on_way

    def _find_number(self, key: tuple[int, int, int], now_ms: int) -> tuple[int | None, str]:
        """The command that an answer names, and whether it may be another one's.

        One on its way, else the last equal one without an answer.
        """
        request, *packet_and_time = key
        late = self._archive.read(
            "SELECT id FROM _commands WHERE packet = ? AND execute_s = ? AND state = ? "
            "AND (execute_s > 0 OR sent_ms > ?) AND ? IN (0, (id - 1) % ? + 1) "
            "ORDER BY id DESC LIMIT 1",
            *(*packet_and_time, UNANSWERED, now_ms - LATEST_MS, request, LAST_REQUEST),
        )
        for each in self._open.values():
            if each.key == key and each.state in (SENT, RECEIVED):
                doubt = f"or the late answer to command {late[0][0]}" if late else ""
                return each.id, doubt
        return (late[0][0] if late else None), ""

    def _change(self, number: int, **columns) -> dict:
        settings = ", ".join(f"{name} = ?" for name in columns)
        with self._archive.writing() as db:
            db.execute(f"UPDATE _commands SET {settings} WHERE id = ?", (*columns.values(), number))
        return self.shown(number)


def list_commands(db: sqlite3.Connection, size: int) -> list[dict]:
    """The last commands of an archive, newest first."""
    statement = f"SELECT {quote_names(COLUMNS)} FROM _commands ORDER BY id DESC LIMIT ?"
    return [as_shown(row) for row in db.execute(statement, (size,))]


def has_answers(dictionary: Dictionary, also: Sequence[str] = ()) -> bool:
    """Whether acknowledgements come down that say what became of a command; `also`: and these."""
    packet = dictionary.down.get("acknowledgement")
    return packet is not None and {*_ANSWER, *also} <= set(packet.names)


def _as_request(number: int) -> int:
    return (number - 1) % LAST_REQUEST + 1


def as_shown(row: tuple) -> dict:
    """A row of `COLUMNS` as users see it."""
    found = dict(zip(COLUMNS, row, strict=True))
    execute_s = found.pop("execute_s")
    return found | {
        "request": _as_request(found["id"]),
        "values": json.loads(found["values"]),
        "execute_ms": EPOCH_MS + 1000 * execute_s if execute_s else None,
    }


def execution_time_s(sent: Sent, clock_ms: int | None) -> int:
    """Execution time [s since 2010-01-01], 0: at once."""
    if sent.delay_s is not None and clock_ms is None:
        raise ScenarioError(
            f"delay_s: must be left out until telemetry shows the satellite's clock; received "
            f"{sent.delay_s:g}"
        )
    if clock_ms is None:
        return sent.execute_s(0.0)
    sent_s = (clock_ms - EPOCH_MS) / 1e3 + sent.at_s
    if sent.at is not None and sent.execute_s(sent_s) <= sent_s:
        clock = np.datetime64(clock_ms // 1000, "s")  # whatever it is: a date, and no error
        raise ScenarioError(
            f"at: must be after the satellite's clock, {clock}Z, and after at_s; received "
            f"{utc_text(sent.at)}"
        )
    return sent.execute_s(sent_s)


def _is_late(each: _Open, now_ms: int, clock_ms: int | None) -> bool:
    if each.state == SENT:
        return now_ms - each.since_ms > ANSWER_MS
    if each.state != RECEIVED or clock_ms is None:
        return False
    return clock_ms - EPOCH_MS - 1000 * each.key[2] > ANSWER_MS
