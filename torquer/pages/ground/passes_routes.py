"""Routes of passes: the next ones, the map, and the report of one; loads models when asked."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import lru_cache
from threading import Lock
from typing import Any

from pydantic import Field, model_validator
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.spec import Spec
from torquer.flight.packets.mistakes import quote_value
from torquer.ground.archive import ArchiveError
from torquer.ground.contact import Contact
from torquer.ground.file import Satellite
from torquer.ground.ground_clock import now_ms
from torquer.ground.span import refuse_reversed
from torquer.pages.ground.asked import contact_of

#: A satellite's clock is that of this machine if it is no further from it [ms]; else it is that of
#: a simulation, by which passes then go.
_SAME_CLOCK_MS = 86_400_000
#: How far back the list of passes goes [ms], how long it is kept [s], and the longest report [ms].
_BEFORE_MS, _KEPT_S, _LONGEST_MS = 3 * 3_600_000, 60.0, 86_400_000
_MINUTE_MS = 60_000
#: Times of which a browser may ask [ms since 1970]: 1950 to 2150.
_FIRST_MS, _LAST_MS = -631_152_000_000, 5_680_281_600_000


class _Asked(Spec):
    """What is asked of passes."""

    hours: float = Field(default=24.0, gt=0.0, le=240.0)
    """Length of the list from now on."""


class _Moment(Spec):
    """A time of the map."""

    time: float = Field(ge=_FIRST_MS, le=_LAST_MS)
    """Time [ms since 1970, UTC]."""


class _Wanted(Spec):
    """The pass of a report."""

    start: float = Field(ge=_FIRST_MS, le=_LAST_MS)
    """AOS [ms since 1970, UTC]."""
    end: float = Field(ge=_FIRST_MS, le=_LAST_MS)
    """LOS [ms since 1970, UTC]."""
    station: str = Field(default="", max_length=100)
    """Its station; none: a span without prediction."""
    _in_order = model_validator(mode="after")(refuse_reversed)


def has_passes(satellite: Satellite) -> bool:
    """Whether passes of a satellite can be predicted: there are stations, and an orbit."""
    has_orbit = satellite.scenario is not None or satellite.table.elements is not None
    return bool(satellite.stations) and has_orbit


def passes_routes(contacts: Mapping[str, Contact]) -> list[Route]:
    """The routes of passes of satellites by their short names."""
    routes = _Routes(contacts)
    one = "/api/{satellite}"
    return [
        Route("/api/coastline", routes.coastline),
        Route(f"{one}/passes", routes.passes),
        Route(f"{one}/map", routes.map),
        Route(f"{one}/report", routes.report),
    ]


class _Routes:
    def __init__(self, contacts: Mapping[str, Contact]):
        self._contacts, self._lock = contacts, Lock()
        self._found = lru_cache(maxsize=16)(self._find)

    async def coastline(self, request: Request) -> Response:
        """Rings of land, as longitudes and latitudes."""
        return JSONResponse(await run_in_threadpool(_coastline))

    async def passes(self, request: Request) -> Response:
        """Passes of the last hours and the next ones, and by which clock they go."""
        contact, asked = self._contact(request), _checked(_Asked, request)
        return JSONResponse(await run_in_threadpool(self._answer, contact, asked.hours))

    async def map(self, request: Request) -> Response:
        """What the map shows at a time."""
        contact, moment = self._contact(request), _checked(_Moment, request)
        return JSONResponse(await run_in_threadpool(_map, contact.satellite, round(moment.time)))

    async def report(self, request: Request) -> Response:
        """The report of a pass as a page."""
        contact, wanted = self._contact(request), _checked(_Wanted, request)
        if wanted.end - wanted.start > _LONGEST_MS:
            raise ScenarioError(
                "end: must be at most a day after the start; received "
                f"{quote_value(request.query_params.get('end'))}"
            )
        return HTMLResponse(await run_in_threadpool(_report, contact, wanted))

    def _contact(self, request: Request) -> Contact:
        found = contact_of(self._contacts, request)
        if not has_passes(found.satellite):
            raise HTTPException(404)
        return found

    def _answer(self, contact: Contact, hours: float) -> dict:
        """The list, by the satellite's clock where that is of another epoch.

        A clock that was reset on board is of none: where the orbit is not known then, this
        machine's clock counts.
        """
        on_board_ms, here_ms = contact.clock.now_ms(), now_ms()
        if on_board_ms is not None and abs(on_board_ms - here_ms) > _SAME_CLOCK_MS:
            try:
                return self._listed(contact.key, "satellite", on_board_ms, hours)
            except ValueError as error:
                try:
                    return self._listed(contact.key, "ground", here_ms, hours)
                except ValueError:
                    raise ScenarioError(str(error)) from None
        try:
            return self._listed(contact.key, "ground", here_ms, hours)
        except ValueError as error:
            raise ScenarioError(str(error)) from None

    def _listed(self, key: str, clock: str, at_ms: int, hours: float) -> dict:
        with self._lock:  # of many browsers that ask at once one waits for the work
            age = int(time.monotonic() / _KEPT_S)
            found = self._found(key, at_ms // _MINUTE_MS * _MINUTE_MS, hours, age)
        return {"clock": clock, "now_ms": at_ms, **found}

    def _find(self, key: str, at_ms: int, hours: float, age: int) -> dict[str, Any]:
        """Passes around a time; `age`: changes with the minute, as files of elements may."""
        from torquer.ground.elements import orbit_of, passes_by
        from torquer.ground.schedule import radio_of, schedule

        satellite = self._contacts[key].satellite
        known = orbit_of(satellite.table, satellite.scenario, at_ms)
        if known is None:
            raise HTTPException(404)
        start_ms, end_ms = at_ms - _BEFORE_MS, at_ms + round(3.6e6 * hours)
        found = passes_by(known, satellite.stations, start_ms, end_ms)
        radio = radio_of(satellite.table)
        return {
            "orbit": known.text,
            "elements": None if known.elements is None else known.elements._asdict(),
            "stations": list(satellite.stations),
            "frequency_hz": radio.frequency_hz,
            "passes": schedule(found, start_ms, radio),
        }


def _checked(spec, request: Request):
    """What is asked; `ScenarioError` with one line for anything else."""
    given = {
        key: value if key == "station" else _number(value)
        for key, value in request.query_params.items()
    }
    return validate_tables(spec, given)


def _number(text: str) -> float | str:
    try:
        return float(text) if len(text) < 40 else text
    except ValueError:
        return text


def _coastline() -> list:
    from torquer.ground.footprint import coastline

    return [*coastline()]


def _map(satellite: Satellite, time_ms: int) -> dict:
    from torquer.ground.elements import orbit_of
    from torquer.ground.footprint import map_at

    try:
        known = orbit_of(satellite.table, satellite.scenario, time_ms)
        if known is None:
            raise HTTPException(404)
        return map_at(known.around, satellite.stations, time_ms)
    except ValueError as error:
        raise ScenarioError(str(error)) from None


def _report(contact: Contact, wanted: _Wanted) -> str:
    from torquer.report.pass_page import report_page

    span = round(wanted.start), round(wanted.end)
    try:
        heading = _heading(contact, wanted.station, *span)
        return report_page(contact.spool.path, heading, *span)
    except ArchiveError:
        raise
    except ValueError as error:
        raise ScenarioError(str(error)) from None


def _heading(contact: Contact, station: str, start_ms: int, end_ms: int):
    """The heading of a report: with the pass that is predicted for the span, if there is one."""
    from torquer.ground.elements import orbit_of, passes_by
    from torquer.ground.schedule import radio_of
    from torquer.report.pass_page import Heading, heading_of

    satellite = contact.satellite
    if station not in satellite.stations:
        return Heading(contact.key)
    stations = {station: satellite.stations[station]}
    known = orbit_of(satellite.table, satellite.scenario, start_ms)
    around = (start_ms - _MINUTE_MS, end_ms + _MINUTE_MS)
    found = [] if known is None else passes_by(known, stations, *around)
    if known is None or not found:
        return Heading(contact.key)
    return heading_of(contact.key, known, stations, found[0], radio_of(satellite.table))
