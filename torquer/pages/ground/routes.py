"""The routes of the page: what browsers ask of satellites and archives, and how it is checked.

Their list, with what each answers, is in `design/0014-ground.md`.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from pydantic import Field, model_validator
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.spec import Spec
from torquer.base.strict_json import INFINITIES, json_text
from torquer.flight.packets.commands import Sent
from torquer.flight.packets.dictionary import Packet
from torquer.flight.packets.mistakes import quote_value
from torquer.flight.packets.openmct import openmct
from torquer.ground import history
from torquer.ground.archive import ArchiveError, read_only
from torquer.ground.bins import points
from torquer.ground.commands import list_commands
from torquer.ground.contact import Contact
from torquer.ground.ground_clock import now_ms
from torquer.ground.limits import describe_limits
from torquer.ground.live import Listener, Live, message_text
from torquer.ground.plan import has_plan
from torquer.ground.span import refuse_reversed
from torquer.ground.spool import PATIENCE_S
from torquer.pages.browser import scene
from torquer.pages.browser.files import answer_failure, answer_missing, json_object, serve_files
from torquer.pages.ground.alarm_routes import alarm_routes
from torquer.pages.ground.asked import contact_of, made_by, packet_of, query_of, whole
from torquer.pages.ground.history_routes import history_routes
from torquer.pages.ground.orders_routes import orders_routes
from torquer.pages.ground.passes_routes import has_passes, passes_routes

WEB = Path(__file__).parent / "web"
#: Most rows that one answer has, and bytes of a command as JSON.
MOST_ROWS, _MOST_BYTES = 20_000, 65_536
_LAST_MS = 2**53


class _Span(Spec):
    """What is asked of an archive."""

    start: int = Field(default=-_LAST_MS, ge=-_LAST_MS, le=_LAST_MS)
    """First time [ms since 1970]."""
    end: int = Field(default=_LAST_MS, ge=-_LAST_MS, le=_LAST_MS)
    """Last time [ms since 1970]."""
    size: int = Field(default=1000, ge=1, le=MOST_ROWS)
    """How many rows at most."""
    by: str = Field(default="time", pattern="^(time|received)$")
    """Which time it is."""
    latest: int = Field(default=0, ge=0, le=1)
    """1: the last rows."""
    _in_order = model_validator(mode="after")(refuse_reversed)


def application(contacts: dict[str, Contact], live: Live, lifespan) -> Starlette:
    """The application of a ground; `contacts` by the short names of the satellites."""
    routes = _Routes(contacts, live)
    one = "/api/{satellite}"
    return Starlette(
        routes=[
            Route("/api/satellites", routes.satellites),
            Route(f"{one}/history/{{packet}}", routes.frames),
            Route(f"{one}/history/{{packet}}/{{number}}", routes.history),
            Route(f"{one}/log", routes.log),
            Route(f"{one}/commands", routes.commands, methods=["GET"]),
            Route(f"{one}/commands", routes.order, methods=["POST"]),
            Route(f"{one}/commands/{{number}}/cancel", routes.cancel, methods=["POST"]),
            Route(f"{one}/sent", routes.sent),
            Route(f"{one}/modes", routes.modes),
            Route(f"{one}/scene", routes.scene),
            Route(f"{one}/orbit", routes.orbit),
            *orders_routes(contacts),
            *history_routes(contacts),
            *alarm_routes(contacts),
            WebSocketRoute("/api/live", routes.live),
            *passes_routes(contacts),
            serve_files(WEB),
        ],
        exception_handlers={
            ScenarioError: _refused,
            HTTPException: answer_missing,
            Exception: answer_failure,
            ArchiveError: _unreadable,
            sqlite3.Error: _unreadable,
        },
        lifespan=lifespan,
    )


class _Routes:
    """Answers to requests, by what the contacts and their archives hold."""

    def __init__(self, contacts: dict[str, Contact], live: Live):
        self._contacts, self._live = contacts, live

    async def satellites(self, request: Request) -> Response:
        """All satellites with their packets."""
        return JSONResponse([_describe(contact) for contact in self._contacts.values()])

    async def frames(self, request: Request) -> Response:
        """Last rows of a packet."""
        contact, span = self._asked(request)
        packet = packet_of(contact, request)

        def found(db):
            ends, names = (span.start, span.end), packet.names
            rows = history.latest(db, packet.name, names, *ends, span.size, span.by)
            return [(*row[:3], row[3:]) for row in rows]

        return await self._read(contact, found)

    async def history(self, request: Request) -> Response:
        """Rows of one number."""
        contact, span = self._asked(request)
        packet, number = packet_of(contact, request), request.path_params["number"]
        if number not in packet.names:
            raise HTTPException(404)

        def found(db):
            ends = span.start, span.end
            if span.latest:
                rows = history.latest(db, packet.name, [number], *ends, span.size, span.by)
                return [(*times, value, quality) for *times, quality, value in rows]
            return points(db, packet.name, number, *ends, span.size, span.by)

        return await self._read(contact, found)

    async def log(self, request: Request) -> Response:
        """The last entries of the log."""
        contact, span = self._asked(request)
        ends, waiting = (span.start, span.end), contact.spool.entries()
        return await self._read(
            contact, lambda db: history.log(db, contact.dictionary, *ends, span.size, waiting), True
        )

    async def sent(self, request: Request) -> Response:
        """The last commands with their states."""
        contact, span = self._asked(request)
        newer = contact.commands.last(span.size)
        return await self._read(contact, lambda db: list_commands(db, span.size, newer), True)

    async def commands(self, request: Request) -> Response:
        """What can be commanded."""
        contact = self._contact(request)
        names = contact.satellite.names
        choices = {
            "region": list(names.regions),
            "flag": list(names.flags),
            "index": names.all_parameters(),
        }
        up = contact.dictionary.up.values()
        return JSONResponse({
            "commands": [_command(packet, choices) for packet in up],
            "regions": {name: list(states) for name, (_, states) in names.regions.items()},
        })  # fmt: skip

    async def order(self, request: Request) -> Response:
        """Send a command, or all of a list or none."""
        contact = self._contact(request)
        data = await json_object(request, "command", _MOST_BYTES)
        by = made_by(request)
        if "commands" in data:
            listed = data["commands"] if isinstance(data["commands"], list) else [None]
            return JSONResponse(contact.order([*map(_as_sent, listed)], by))
        return JSONResponse(contact.order([_as_sent(data)], by)[0])

    async def cancel(self, request: Request) -> Response:
        """Cancel a command that waits, here or on board."""
        contact, number = self._contact(request), whole(request.path_params["number"])
        if not isinstance(number, int):
            raise HTTPException(404)
        return JSONResponse(contact.cancel(number, made_by(request)))

    async def modes(self, request: Request) -> Response:
        """The mode table and its diagram."""
        modes = self._scenario(request).control.named().modes
        if modes is None:
            raise HTTPException(404)
        from torquer.computer.modes.diagram import svg

        regions = [{"name": n, "states": [*region.states]} for n, region in modes.regions.items()]
        return JSONResponse({"regions": regions, "svg": svg(modes)})

    async def scene(self, request: Request) -> Response:
        """Body and sensors."""
        return JSONResponse(scene.scene(self._scenario(request).spacecraft))

    async def orbit(self, request: Request) -> Response:
        """Position, track, field and Sun at a time."""
        scenario = self._scenario(request)
        asked = request.query_params.get("time", "")
        try:
            found = await run_in_threadpool(scene.orbit, scenario, int(asked))
        except (ValueError, OverflowError, OSError):
            raise ScenarioError(
                "time: must be milliseconds since 1970 of a time at which the models hold; "
                f"received {quote_value(asked)}"
            ) from None
        return JSONResponse(found)

    async def live(self, socket: WebSocket) -> None:
        """Rows, log, commands and links as they come."""
        await socket.accept()
        listener = Listener()
        self._live.listeners.add(listener)
        listener.beat(now_ms())
        for contact in self._contacts.values():
            listener.put("links", message_text(contact.key, contact.state()))
        try:
            await listener.serve(socket)
        except (WebSocketDisconnect, RuntimeError):
            pass  # the browser has gone
        finally:
            self._live.listeners.discard(listener)

    def _contact(self, request: Request) -> Contact:
        return contact_of(self._contacts, request)

    def _scenario(self, request: Request):
        scenario = self._contact(request).satellite.scenario
        if scenario is None:
            raise HTTPException(404)
        return scenario

    def _asked(self, request: Request) -> tuple[Contact, _Span]:
        return self._contact(request), validate_tables(_Span, query_of(request))

    async def _read(self, contact: Contact, ask, is_known_without: bool = False) -> Response:
        """What `ask` makes of the archive; of None, where it cannot be read and more is known."""

        def rows():
            try:
                with closing(read_only(contact.spool.path, PATIENCE_S)) as db:
                    yield from ask(db)
            except (ArchiveError, sqlite3.Error):
                if not is_known_without:
                    raise
                yield from ask(None)

        def answer() -> str:
            # row by row: in one piece a large answer would keep all else waiting
            return f"[{','.join(json_text(row, None, INFINITIES) for row in rows())}]"

        text = await run_in_threadpool(answer)
        return Response(text, media_type="application/json")


def _describe(contact: Contact) -> dict:
    """A satellite for the tree of objects; regions of the mode table go by their names."""
    satellite, dictionary = contact.satellite, contact.dictionary
    described, regions = openmct(dictionary), satellite.names.regions
    for packet in described["packets"]:
        if packet["key"] == "modes":
            packet["measurements"] = [
                _name_region(measurement, name, list(states))
                for measurement, (name, (_, states)) in zip(
                    packet["measurements"], regions.items(), strict=False
                )
            ]
    scenario = satellite.scenario
    return {
        "key": contact.key,
        "name": dictionary.name,
        "clock_ms": contact.clock.latest_ms,
        "has": {
            "modes": bool(regions) and "modes" in dictionary.down,
            "scene": scenario is not None,
            "orbit": scenario is not None,
            "plan": has_plan(dictionary),
            "passes": has_passes(satellite),
        },
        "packets": described["packets"],
        "limits": describe_limits(contact.alarms.limits),
    }


def _name_region(measurement: dict, name: str, states: list[str]) -> dict:
    value, time = measurement["values"]
    texts = [{"value": i, "string": state} for i, state in enumerate(states)]
    value = {**value, "name": name, "format": "enum", "enumerations": texts}
    return {**measurement, "name": name, "values": [value, time]}


def _command(packet: Packet, choices: dict[str, list[str]]) -> dict:
    """A command and its fields, for a form."""
    fields = []
    for field in packet.fields[1:]:
        low, high = field.range
        fields.append({
            "name": field.name,
            "description": field.description,
            "unit": field.unit,
            "type": field.type,
            "count": field.count,
            "labels": list(field.texts.values()),
            "low": low,
            "high": high,
            "choices": choices.get(field.name) or None,
        })  # fmt: skip
    return {
        "name": packet.name,
        "description": packet.description,
        "module": packet.module,
        "fields": fields,
    }


def _as_sent(data) -> Sent:
    if not isinstance(data, dict):
        raise ScenarioError(f"command: must be an object; received {quote_value(data)}")
    return validate_tables(Sent, {"at_s": 0.0} | data)


async def _refused(request: Request, error: Exception) -> Response:
    return JSONResponse({"error": str(error)}, 400)


async def _unreadable(request: Request, error: Exception) -> Response:
    why = " ".join(str(error).removeprefix("archive: ").split())
    return JSONResponse({"error": f"archive: cannot be read now: {why}"}, 503)
