"""Routes of the command side: roles, the command stack, command history, the plan.

Their list, with what each answers, is in `design/0014-ground.md`.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.strict_json import INFINITIES, json_text
from torquer.flight.packets.mistakes import quote_value
from torquer.ground.archive import ArchiveError
from torquer.ground.command_history import MOST, Wanted, commands_csv, find_commands
from torquer.ground.contact import Contact
from torquer.ground.plan import compare_plan, has_plan
from torquer.ground.stack_file import MOST_BYTES, check_stack, checked_name, read_stack
from torquer.pages.browser.files import json_object
from torquer.pages.ground.asked import contact_of, made_by, read_archive, whole

#: Most bytes of a stack as JSON, which may write six for one.
_MOST_BYTES = 6 * MOST_BYTES


def orders_routes(contacts: Mapping[str, Contact]) -> list[Route]:
    """The routes; `contacts` by the short names of the satellites."""
    routes, one = _Routes(contacts), "/api/{satellite}"
    return [
        Route("/api/role", _role),
        Route(f"{one}/command-history", routes.history),
        Route(f"{one}/plan", routes.plan),
        Route(f"{one}/stack", routes.stack, methods=["GET"]),
        Route(f"{one}/stack", routes.load, methods=["POST"]),
        Route(f"{one}/stack/{{action}}", routes.act, methods=["POST"]),
        Route(f"{one}/stacks/{{name}}", routes.saved, methods=["GET"]),
        Route(f"{one}/stacks/{{name}}", routes.save, methods=["PUT"]),
        Route(f"{one}/stacks/{{name}}", routes.delete, methods=["DELETE"]),
    ]


async def _role(request: Request) -> Response:
    """The role of who asks."""
    return JSONResponse({"role": request.scope["role"]})


class _Routes:
    """Answers to requests."""

    def __init__(self, contacts: Mapping[str, Contact]):
        self._contacts = contacts

    async def history(self, request: Request) -> Response:
        """Commands by what is asked of them, as JSON or CSV."""
        contact, asked = self._contact(request), dict(request.query_params)
        form = asked.pop("format", "json")
        if form not in ("json", "csv"):
            raise ScenarioError(f"format: must be json or csv; received {quote_value(form)}")
        wanted = validate_tables(Wanted, {key: _number(key, text) for key, text in asked.items()})

        newer = contact.commands.last(MOST)

        def found(db: sqlite3.Connection | None) -> str:
            commands = find_commands(db, wanted, newer)
            return commands_csv(commands) if form == "csv" else _json(commands)

        try:
            text = await read_archive(contact, found)
        except (ArchiveError, sqlite3.Error):  # what is known without it is better than nothing
            text = await run_in_threadpool(found, None)
        return _answer(text, form, contact.key)

    async def plan(self, request: Request) -> Response:
        """The plan on board beside that on the ground."""
        contact = self._contact(request)
        if not has_plan(contact.dictionary):
            raise HTTPException(404)

        def found(db: sqlite3.Connection) -> str:
            return _json(compare_plan(db, contact.dictionary))

        return _answer(await read_archive(contact, found), "json", contact.key)

    async def stack(self, request: Request) -> Response:
        """The stack with its steps, and the names of those that are saved."""
        contact = self._contact(request)
        saved = await run_in_threadpool(contact.saved_stacks.names)
        return JSONResponse({"stack": contact.stack.state(), "saved": saved})

    async def load(self, request: Request) -> Response:
        """Load a stack, from a text or by the name of one that is saved."""
        contact, by = self._contact(request), made_by(request)
        data = await json_object(request, "stack", _MOST_BYTES)
        name = checked_name(data["name"]) if data.get("name") else ""
        if "text" in data:
            text = _text(data)
        else:
            text = await run_in_threadpool(contact.saved_stacks.text, checked_name(name))
        stack = await run_in_threadpool(self._checked, contact, text)
        return JSONResponse(contact.stack.load(stack, name, by))

    async def act(self, request: Request) -> Response:
        """Send the next step, skip it, run, hold, abort."""
        contact, by = self._contact(request), made_by(request)
        data = await json_object(request, "stack", 1000)
        number, place = _whole(data, "stack"), data.get("place")
        place = None if place is None else _whole(data, "place")
        return JSONResponse(contact.stack.act(request.path_params["action"], number, place, by))

    async def saved(self, request: Request) -> Response:
        """The text of a saved stack."""
        contact, name = self._contact(request), request.path_params["name"]
        text = await run_in_threadpool(contact.saved_stacks.text, name)
        return JSONResponse({"name": name, "text": text})

    async def save(self, request: Request) -> Response:
        """Keep a stack, which is checked first, under a name."""
        contact, name = self._contact(request), request.path_params["name"]
        text = _text(await json_object(request, "stack", _MOST_BYTES))
        await run_in_threadpool(self._checked, contact, text, False)
        await run_in_threadpool(contact.saved_stacks.save, name, text)
        return JSONResponse({"name": name})

    async def delete(self, request: Request) -> Response:
        """Forget a saved stack."""
        contact, name = self._contact(request), request.path_params["name"]
        await run_in_threadpool(contact.saved_stacks.delete, name)
        return JSONResponse({"name": name})

    def _contact(self, request: Request) -> Contact:
        return contact_of(self._contacts, request)

    def _checked(self, contact: Contact, text: str, is_now: bool = True):
        """The stack of a text; times are checked by the clock of now, or not at all."""
        clock_ms = contact.clock.now_ms() if is_now else None
        return check_stack(read_stack(text), contact.dictionary, contact.satellite.names, clock_ms)


def _text(data: dict) -> str:
    text = data.get("text")
    if not isinstance(text, str):
        raise ScenarioError(f"text: must be a stack as TOML; received {quote_value(text)}")
    return text


def _whole(data: dict, key: str) -> int:
    value = data.get(key)
    if type(value) is not int or not 0 <= value < 2**53:
        raise ScenarioError(f"{key}: must be a whole number from 0; received {quote_value(value)}")
    return value


def _number(key: str, text: str) -> int | str:
    is_number = key in Wanted.model_fields and Wanted.model_fields[key].annotation is int
    return whole(text) if is_number else text


def _json(data) -> str:
    return json_text(data, None, INFINITIES)


def _answer(text: str, form: str, key: str) -> Response:
    if form == "json":
        return Response(text, media_type="application/json")
    headers = {"content-disposition": f'attachment; filename="{key}-commands.csv"'}
    return Response(text, media_type="text/csv", headers=headers)
