"""Routes of alarms and of the log's search: what operators may ask and say, checked by specs."""

from __future__ import annotations

import csv
import io
import sqlite3
from collections.abc import Callable, Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from torquer.base.dates import iso_ms
from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.limits import RequestError
from torquer.base.spec import Spec
from torquer.base.strict_json import INFINITIES, json_text
from torquer.ground.alarms import LONGEST_SHELF_S
from torquer.ground.archive import ArchiveError
from torquer.ground.contact import Contact
from torquer.ground.log_search import SEVERITIES, LogQuery, search
from torquer.ground.pieces import plain_cell
from torquer.ground.span import refuse_reversed
from torquer.ground.violations import MOST
from torquer.pages.browser.files import json_object
from torquer.pages.ground.asked import contact_of, made_by, read_archive, whole

_MOST_BYTES, _MOST_ALARMS, _LAST_MS = 65_536, 500, 2**53
#: Most rows of an answer, and of a file.
_MOST_ROWS, _MOST_IN_FILE = 2000, 20_000


def _line(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must be one line")
    return text


_Text = Annotated[str, Field(max_length=500), AfterValidator(_line)]
_Key = Annotated[str, Field(max_length=200)]
_Time = Annotated[int, Field(ge=-_LAST_MS, le=_LAST_MS)]


class _Seen(Spec):
    """An alarm as an operator has seen it."""

    key: _Key
    """`packet.number`."""
    number: int = Field(ge=0, le=_LAST_MS)
    """Its number."""
    state: str = Field(default="", max_length=20)
    """Its state [any]: where it is `active` or `returned`, and somebody else was quicker, nothing
    is left to do.
    """


class _Acknowledged(Spec):
    """Alarms that an operator acknowledges."""

    alarms: tuple[_Seen, ...] = Field(min_length=1, max_length=_MOST_ALARMS)
    """Which."""
    comment: _Text = ""
    """What the operator says."""


class _Shelved(Spec):
    """A point that is to call for nobody."""

    key: _Key
    """`packet.number`."""
    for_s: float = Field(gt=0.0, le=LONGEST_SHELF_S)
    """For how long [s]."""
    reason: Annotated[_Text, Field(min_length=1)]
    """Why."""


class _Unshelved(Spec):
    """A point that is to call again."""

    key: _Key
    """`packet.number`."""


class _Span(Spec):
    """A span of on-board time."""

    start: _Time = -_LAST_MS
    """First time [ms since 1970]."""
    end: _Time = _LAST_MS
    """Last time [ms since 1970]."""
    size: int = Field(default=500, ge=1, le=MOST)
    """How many at most."""
    _in_order = model_validator(mode="after")(refuse_reversed)


class _Search(_Span):
    """What is searched in the log."""

    size: int = Field(default=500, ge=1, le=_MOST_IN_FILE)
    """How many at most."""
    severity: Literal[SEVERITIES] = "info"  # type: ignore[valid-type]
    """The least."""
    source: Literal["", "satellite", "ground"] = ""
    """Whose."""
    text: Annotated[str, Field(max_length=200)] = ""
    """What the text has in it, in any case of letters."""


def alarm_routes(contacts: Mapping[str, Contact]) -> list[Route]:
    """The routes; `contacts` by the short names of the satellites."""
    routes = _AlarmRoutes(contacts)
    one = "/api/{satellite}"
    return [
        Route(f"{one}/alarms", routes.alarms),
        Route(f"{one}/alarms/acknowledge", routes.acknowledge, methods=["POST"]),
        Route(f"{one}/alarms/shelve", routes.shelve, methods=["POST"]),
        Route(f"{one}/alarms/unshelve", routes.unshelve, methods=["POST"]),
        Route(f"{one}/violations", routes.violations),
        Route(f"{one}/log/search", routes.search),
        Route(f"{one}/log.csv", routes.log_file),
    ]


class _AlarmRoutes:
    """Answers to requests."""

    def __init__(self, contacts: Mapping[str, Contact]):
        self._contacts = contacts

    async def alarms(self, request: Request) -> Response:
        """All alarms, with counts."""
        return _json(self._contact(request).alarms.listed())

    async def acknowledge(self, request: Request) -> Response:
        """Acknowledge alarms, all or none."""
        contact = self._contact(request)
        asked = validate_tables(_Acknowledged, await json_object(request, "alarms", _MOST_BYTES))
        numbers = {each.key: each.number for each in asked.alarms}
        not_yet = {each.key for each in asked.alarms if each.state in ("active", "returned")}
        desk, by = contact.alarms, made_by(request)
        return _answer(lambda: desk.acknowledge(numbers, by, asked.comment, not_yet))

    async def shelve(self, request: Request) -> Response:
        """Shelve a point."""
        contact = self._contact(request)
        asked = validate_tables(_Shelved, await json_object(request, "alarm", _MOST_BYTES))
        desk, by = contact.alarms, made_by(request)
        return _answer(lambda: desk.shelve(asked.key, asked.for_s, by, asked.reason))

    async def unshelve(self, request: Request) -> Response:
        """Take a point from its shelf."""
        contact = self._contact(request)
        asked = validate_tables(_Unshelved, await json_object(request, "alarm", _MOST_BYTES))
        return _answer(lambda: contact.alarms.unshelve(asked.key, made_by(request)))

    async def violations(self, request: Request) -> Response:
        """The out-of-limits log."""
        contact, span = self._contact(request), _asked(_Span, request)

        def found(db: sqlite3.Connection | None) -> list[dict]:
            return contact.alarms.violations(db, span.start, span.end, span.size)

        try:
            return _json(await read_archive(contact, found))
        except (ArchiveError, sqlite3.Error):  # what is known without it is better than nothing
            return _json(found(None))

    async def search(self, request: Request) -> Response:
        """Entries of the log, newest first, and whether the whole archive was searched."""
        contact, asked = self._contact(request), _asked(_Search, request)
        if asked.size > _MOST_ROWS:
            raise ScenarioError(f"size: must be at most {_MOST_ROWS}; received {asked.size}")
        entries, is_all = await _found(contact, asked)
        return _json({"entries": entries, "complete": is_all})

    async def log_file(self, request: Request) -> Response:
        """The same as CSV."""
        contact, asked = self._contact(request), _asked(_Search, request)
        entries, _ = await _found(contact, asked)
        name = f'attachment; filename="{contact.key}-log.csv"'
        return Response(_csv(entries), media_type="text/csv; charset=utf-8",
                        headers={"Content-Disposition": name})  # fmt: skip

    def _contact(self, request: Request) -> Contact:
        return contact_of(self._contacts, request)


def _asked(spec, request: Request):
    given = dict(request.query_params.items())
    numbers = {key: whole(given[key]) for key in ("start", "end", "size") if key in given}
    return validate_tables(spec, given | numbers)


async def _found(contact: Contact, asked: _Search) -> tuple[list[dict], bool]:
    query = LogQuery(asked.start, asked.end, asked.severity, asked.source, asked.text)
    return await read_archive(contact, lambda db: search(db, contact.dictionary, query, asked.size))


def _answer(act: Callable[[], object]) -> Response:
    try:
        return _json(act())
    except RequestError as error:
        raise ScenarioError(str(error)) from None


def _json(data) -> Response:
    return Response(json_text(data, None, INFINITIES), media_type="application/json")


def _csv(entries: list[dict]) -> str:
    text = io.StringIO()
    table = csv.writer(text)
    table.writerow(["on_board_utc", "received_utc", "source", "severity", "text"])
    for each in entries:
        times = [iso_ms(each[key]) for key in ("time_ms", "received_ms")]
        table.writerow([*times, each["source"], each["severity"], plain_cell(each["text"])])
    return text.getvalue()
