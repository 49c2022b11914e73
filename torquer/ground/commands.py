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

from torquer.base.explain import ScenarioError
from torquer.base.time import utc_text
from torquer.computer.names import Names
from torquer.flight.packets.commands import ANSWERS, Sent, command_numbers
from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.frames import LAST_REQUEST, Uplink, last_second
from torquer.flight.packets.reasons import Reason, describe_code
from torquer.ground.archive import EPOCH_MS, quote_names
from torquer.ground.command_states import (
    CANCELLED,
    EXECUTED,
    RECEIVED,
    REFUSED,
    SENT,
    UNANSWERED,
    WAITING,
)

#: Time after which an answer is no longer waited for [ms]; of a delayed command, after its
#: execution time by the satellite's clock.
ANSWER_MS = 30_000
#: How long after a command was sent a late answer to it is thought possible [ms].
LATEST_MS = 3_600_000
#: Most commands that are not over.
MOST_OPEN = 1000
#: The command that takes another out of the satellite's plan.
CANCEL = "plan_cancel"
#: Columns of a command, as `as_shown` takes them.
COLUMNS = (
    *("id", "made_ms", "made_by", "command", "values", "execute_s", "state"),
    *("sent_ms", "received_ms", "answered_ms", "reason"),
)
_STORED = (*COLUMNS, "acknowledge", "packet")
_ANSWER = ("command_id", "accepted", "code", "command_time")
#: Most commands that are over and still known without the archive.
_MOST_KNOWN = 2000


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
    """Commands of one satellite; times in ms since 1970, UTC, handed in by the caller.

    They live here, so that no disk holds them up: `keep` is called with each as it becomes, to be
    stored, and `next_number` gives the numbers, none twice, or None while none can be kept.
    """

    def __init__(
        self,
        dictionary: Dictionary,
        names: Names,
        keep: Callable[[dict[str, Any]], None],
        next_number: Callable[[], int | None],
    ):
        self._dictionary, self._names = dictionary, names
        self._keep, self._next_number = keep, next_number
        self._frame = Uplink(dictionary).frame
        self._has_answers = has_answers(dictionary)
        self._has_numbers = has_answers(dictionary, ("request",))
        self._known: dict[int, dict[str, Any]] = {}
        self._open: dict[int, _Open] = {}

    def adopt(self, commands: Sequence[dict[str, Any]]) -> None:
        """Take up the commands of a ground that has ended, as `last_commands` gives them."""
        self._known = {row["id"]: dict(row) for row in commands} | self._known
        for row in commands:
            if row["state"] == WAITING:
                reason = "the ground ended before it was sent"
                self._change(row["id"], state=CANCELLED, reason=reason)
            elif row["state"] in (SENT, RECEIVED) and row["acknowledge"]:
                key = self._request(row["id"]), row["packet"], row["execute_s"]
                self._open[row["id"]] = _Open(row["id"], key, row["state"], row["sent_ms"])

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
        number = self._next_number()
        if number is None:
            raise ScenarioError("command: must wait until its number can be kept: see the log")
        self._known[number] = {
            "id": number,
            "made_ms": now_ms,
            "made_by": by,
            "command": sent.command,
            "values": json.dumps(sent.values),
            "execute_s": execute_s,
            "state": WAITING,
            **dict.fromkeys(("sent_ms", "received_ms", "answered_ms")),
            "reason": "",
            "acknowledge": sent.acknowledge,
            "packet": packet,
        }
        self._change(number)
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
        found = self._known.get(number)
        received = f"one that is {found['state']}" if found else "a number that no command has"
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
        for each in [*self._open.values()]:
            if each.since_ms > now_ms:  # by a clock that was set back before this ground began
                self._open[each.id] = each._replace(since_ms=now_ms)
        late = [each.id for each in self._open.values() if _is_late(each, now_ms, clock_ms)]
        for number in late:
            del self._open[number]
        return [self._change(number, state=UNANSWERED) for number in late]

    def shown(self, number: int) -> dict:
        """A command as users see it."""
        return as_shown(self._known[number])

    def made_by(self, ending: str) -> int | None:
        """The number of the last command whose maker ends so; None if none is known."""
        found = [n for n, each in self._known.items() if each["made_by"].endswith(ending)]
        return max(found, default=None)

    def last(self, size: int) -> list[dict]:
        """The last commands, newest first, as far as they are known without the archive."""
        return [self.shown(number) for number in sorted(self._known, reverse=True)[:size]]

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
        late = [
            number
            for number, row in self._known.items()
            if row["state"] == UNANSWERED
            and [row["packet"], row["execute_s"]] == packet_and_time
            and (row["execute_s"] > 0 or row["sent_ms"] > now_ms - LATEST_MS)
            and request in (0, _as_request(number))
        ]
        for each in self._open.values():
            if each.key == key and each.state in (SENT, RECEIVED):
                doubt = f"or the late answer to command {max(late)}" if late else ""
                return each.id, doubt
        return max(late, default=None), ""

    def _change(self, number: int, **columns) -> dict:
        """Change a command, have it stored, and forget old ones that are over."""
        self._known[number] |= columns
        self._keep(self._known[number])
        if (surplus := len(self._known) - len(self._open) - _MOST_KNOWN) > 0:
            for old in [n for n in self._known if n not in self._open][:surplus]:
                del self._known[old]
        return self.shown(number)


def list_commands(
    db: sqlite3.Connection | None, size: int, newer: Sequence[dict[str, Any]] = ()
) -> list[dict]:
    """The last commands of an archive, newest first; `newer`: as `Commands.last` has them now.

    `db` None: only these.
    """
    statement = f"SELECT {quote_names(COLUMNS)} FROM _commands ORDER BY id DESC LIMIT ?"
    rows = [] if db is None else db.execute(statement, (size,)).fetchall()
    shown = {row[0]: as_shown(dict(zip(COLUMNS, row, strict=True))) for row in rows}
    shown |= {each["id"]: each for each in newer}
    return [shown[number] for number in sorted(shown, reverse=True)[:size]]


def last_commands(read: Callable[..., list[tuple]]) -> list[dict[str, Any]]:
    """The last commands of an archive as it has them, oldest first, for `Commands.adopt`.

    `read`: gives the rows of a statement.
    """
    statement = f"SELECT {quote_names(_STORED)} FROM _commands ORDER BY id DESC LIMIT ?"
    rows = [dict(zip(_STORED, row, strict=True)) for row in read(statement, _MOST_KNOWN)]
    return [row for row in rows[::-1] if _is_whole(row)]


def _is_whole(row: Mapping[str, Any]) -> bool:
    """Whether a command of an archive can be shown: others may have written there."""
    try:
        return isinstance(json.loads(row["values"]), dict) and (
            row["state"] not in (SENT, RECEIVED) or isinstance(row["sent_ms"], int)
        )
    except (ValueError, TypeError):
        return False


def has_answers(dictionary: Dictionary, also: Sequence[str] = ()) -> bool:
    """Whether acknowledgements come down that say what became of a command; `also`: and these."""
    packet = dictionary.down.get("acknowledgement")
    return packet is not None and {*_ANSWER, *also} <= set(packet.names)


def _as_request(number: int) -> int:
    return (number - 1) % LAST_REQUEST + 1


def as_shown(row: Mapping[str, Any]) -> dict:
    found = {name: row[name] for name in COLUMNS if name != "execute_s"}
    execute_s = row["execute_s"]
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
