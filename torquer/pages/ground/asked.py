"""What a request names: a satellite, a packet, numbers of its query, who orders.

404 for what is not there.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from urllib.parse import unquote

from starlette.exceptions import HTTPException
from starlette.requests import Request

from torquer.flight.packets.dictionary import Packet
from torquer.ground.authors import OPERATOR, fault_of
from torquer.ground.contact import Contact
from torquer.scenario.explain import ScenarioError


def contact_of(contacts: Mapping[str, Contact], request: Request) -> Contact:
    """The satellite of a path."""
    found = contacts.get(request.path_params["satellite"])
    if found is None:
        raise HTTPException(404)
    return found


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
