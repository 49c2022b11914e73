"""What a request names: a satellite, a packet, numbers of its query, who orders.

404 for what is not there.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable, Mapping
from contextlib import closing
from typing import TypeVar
from urllib.parse import unquote

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request

from torquer.base.explain import ScenarioError
from torquer.flight.packets.dictionary import Packet
from torquer.ground.archive import read_only
from torquer.ground.authors import OPERATOR, fault_of
from torquer.ground.contact import Contact
from torquer.ground.spool import PATIENCE_S

T = TypeVar("T")


def contact_of(contacts: Mapping[str, Contact], request: Request) -> Contact:
    """The satellite of a path."""
    found = contacts.get(request.path_params["satellite"])
    if found is None:
        raise HTTPException(404)
    return found


async def read_archive(contact: Contact, ask: Callable[[sqlite3.Connection], T]) -> T:
    """What `ask` makes of a satellite's archive, in a thread that waits a moment for others."""

    def found() -> T:
        with closing(read_only(contact.spool.path, PATIENCE_S)) as db:
            return ask(db)

    return await run_in_threadpool(found)


def packet_of(contact: Contact, request: Request) -> Packet:
    """The packet of a path."""
    found = contact.dictionary.down.get(request.path_params["packet"])
    if found is None:
        raise HTTPException(404)
    return found


def query_of(request: Request) -> dict[str, int | str]:
    """The query, in which digits are numbers."""
    return {key: whole(value) for key, value in request.query_params.items()}


def whole(text: str) -> int | str:
    """A number, where a text is the digits of one."""
    return int(text) if re.fullmatch(r"-?[0-9]{1,18}", text) else text


def made_by(request: Request) -> str:
    """Who orders: from where, and the name that was stated; `ScenarioError` for what is none."""
    place = "command line" if "authorization" in request.headers else "page"
    stated = request.headers.get(OPERATOR, "")
    if not stated:
        return place
    name = unquote(stated)
    if fault := fault_of(name):
        raise ScenarioError(f"operator: {fault}")
    return f"{name.strip()} (stated), {place}"
