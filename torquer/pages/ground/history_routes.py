"""Routes of the past: files of a selection, what was known at an instant, gaps and orders."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping

from pydantic import Field, model_validator
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.limits import RequestError
from torquer.base.spec import Spec
from torquer.base.strict_json import INFINITIES, json_text
from torquer.flight.packets.mistakes import quote_value
from torquer.ground.archive import ArchiveError
from torquer.ground.columns import FIRST_MS, LAST_MS
from torquer.ground.contact import Contact
from torquer.ground.gaps import can_fill, fill, find_gaps
from torquer.ground.past import last_known, state_in_words
from torquer.ground.selection import (
    KINDS,
    Selected,
    check_selection,
    file_name,
    has_parquet,
    selection,
)
from torquer.ground.span import refuse_reversed
from torquer.pages.browser.files import json_object
from torquer.pages.ground.asked import contact_of, made_by, packet_of, query_of, read_archive

#: Bytes of an order to fill a gap.
_MOST_BYTES = 4096
#: What a file of SQLite that cannot be read, or is not there any more, raises.
_UNREADABLE = (ArchiveError, sqlite3.Error, OSError)


class _Instant(Spec):
    """An instant of the past."""

    time: int = Field(ge=FIRST_MS, le=LAST_MS)
    """Milliseconds since 1970."""
    by: str = Field(default="time", pattern="^(time|received)$")
    """Which time it is."""


class _Stretch(Spec):
    """Where gaps are looked for."""

    packet: str | None = None
    """Only of this packet [all]."""
    start: int | None = Field(default=None, ge=FIRST_MS, le=LAST_MS)
    """First on-board time [ms since 1970; a week before the last row]."""
    end: int | None = Field(default=None, ge=FIRST_MS, le=LAST_MS)
    """Last on-board time [ms since 1970]."""
    _in_order = model_validator(mode="after")(refuse_reversed)


class _Filling(Spec):
    """The interval of a gap."""

    start: int = Field(ge=FIRST_MS, le=LAST_MS)
    """Its first on-board time [ms since 1970]."""
    end: int = Field(ge=FIRST_MS, le=LAST_MS)
    """Its last on-board time [ms since 1970]."""
    _in_order = model_validator(mode="after")(refuse_reversed)


def history_routes(contacts: Mapping[str, Contact]) -> list[Route]:
    """The routes, of the satellites by their short names."""

    async def formats(request: Request) -> Response:
        return JSONResponse([kind for kind in KINDS if kind != "parquet" or has_parquet()])

    async def export(request: Request) -> Response:
        contact = contact_of(contacts, request)
        packet = packet_of(contact, request)
        query = query_of(request)
        selected = validate_tables(Selected, query | {"numbers": str(query.get("numbers", ""))})
        columns = check_selection(packet, selected)
        path, name = contact.spool.path, contact.dictionary.name
        pieces = await run_in_threadpool(selection, path, name, packet, columns, selected)
        kind = KINDS[selected.format].media_type
        return _File(pieces, file_name(contact.key, packet, selected), kind)

    async def past(request: Request) -> Response:
        contact = contact_of(contacts, request)
        asked = validate_tables(_Instant, query_of(request))

        def found(db: sqlite3.Connection) -> str:
            known = last_known(db, contact.dictionary, asked.time, asked.by)
            state = state_in_words(known, contact.dictionary, contact.satellite.names)
            answer = {"time": asked.time, "by": asked.by, "state": state, "packets": known}
            return json_text(answer, None, INFINITIES)

        text = await read_archive(contact, found)
        return Response(text, media_type="application/json")

    async def gaps(request: Request) -> Response:
        contact = contact_of(contacts, request)
        asked = validate_tables(_Stretch, query_of(request))
        if asked.packet is not None and asked.packet not in contact.dictionary.down:
            text = quote_value(asked.packet)
            raise ScenarioError(f"packet: must be one of the dictionary; received {text}")
        packets = None if asked.packet is None else [asked.packet]

        def found(db: sqlite3.Connection) -> list[dict]:
            listed = find_gaps(db, contact.dictionary, packets, asked.start, asked.end)
            return [gap._asdict() for gap in listed]

        listed = await read_archive(contact, found)
        return JSONResponse({"can_fill": can_fill(contact.dictionary), "gaps": listed})

    async def order(request: Request) -> Response:
        contact = contact_of(contacts, request)
        asked = validate_tables(_Filling, await json_object(request, "gap", _MOST_BYTES))
        if not can_fill(contact.dictionary):
            raise ScenarioError("satellite: must have a record; its dictionary names no replay")
        try:
            sent = fill(asked.start, asked.end)
        except RequestError as error:
            raise ScenarioError(str(error)) from None
        return JSONResponse(contact.order([sent], made_by(request))[0])

    one = "/api/{satellite}"
    return [
        Route("/api/formats", formats),
        Route(f"{one}/export/{{packet}}", export),
        Route(f"{one}/past", past),
        Route(f"{one}/gaps", gaps, methods=["GET"]),
        Route(f"{one}/gaps", order, methods=["POST"]),
    ]


class _File(StreamingResponse):
    """A file in pieces; if one cannot be read, the connection ends, and the file is not whole."""

    def __init__(self, pieces: Iterator[bytes], name: str, media_type: str):
        headers = {
            "content-disposition": f'attachment; filename="{name}"',
            "cache-control": "no-store",
        }
        super().__init__(pieces, headers=headers, media_type=media_type)

    async def stream_response(self, send) -> None:
        try:
            await super().stream_response(send)
        except _UNREADABLE:
            return  # the server closes what is not complete
