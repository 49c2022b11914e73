"""The routes of the board's page; all take and give what the page has of a scenario: plain data.

    GET  /api/start    {data, name}: the scenario that the board was opened with
    POST /api/form     {data}                -> {tables}: see `form`
    POST /api/fly      {data}                -> a run: see `answer`
    POST /api/theory   {data}                -> {lines, notes}: see `theory`
    POST /api/starts   {data}                -> a line of JSON after each part: see `starts`
    POST /api/read     {toml}                -> {data}
    POST /api/write    {data}                -> {toml}

A mistake of the user is 422 with {errors: [{key, text}]}. What a page no longer waits for is
stopped: it closes its request.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
from collections.abc import AsyncIterator, Callable, Container
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from torquer.base.text_files import MOST_BYTES
from torquer.pages.board.answer import make_answer
from torquer.pages.board.flown import Flown, Orbits, Superseded, fly
from torquer.pages.board.form import make_form
from torquer.pages.board.own_files import OwnFiles
from torquer.pages.board.starts import Starts
from torquer.pages.board.text import data_from_toml, mistakes_in, read_scenario
from torquer.pages.board.theory import predict
from torquer.pages.board.words import messages, page, told_all
from torquer.pages.browser.files import answer_failure, answer_missing, json_object, serve_files
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import toml_from_data

WEB = Path(__file__).parent / "web"
#: Status of an answer that nobody waits for.
_CLOSED = 499
#: What people read of a form, and of the lines of theory.
_OF_FORM = ("title", "about", "name", "unit", "values", "default")
_OF_THEORY = ("name", "unit", "about", "notes")
IsSuperseded = Callable[[], bool]


class Board:
    """What answers: a thread for flights, one for theory, a process for starts.

    `data`: the scenario that the page begins with; `folder`: where its relative paths begin;
    `code`: Python files that may be executed.
    """

    def __init__(self, data: dict, name: str, folder: Path, code: Container[Path] = ()):
        self.data, self.name, self.folder, self.code = data, name, folder, code
        self.own_files = OwnFiles(data, folder, code)
        self.orbits, self.starts = Orbits(), Starts()
        self.flights, self.theory = ThreadPoolExecutor(1), ThreadPoolExecutor(1)
        self.background = ThreadPoolExecutor(1)
        #: Set when the server begins to end: no answer is waited for after that.
        self.ending = asyncio.Event()

    def scenario(self, data: dict) -> Scenario:
        """The scenario of the page's data; its name is no matter of the page."""
        return read_scenario({"name": self.name, **data}, self.folder, self.code)

    def make_ready(self) -> None:
        """Compile what a flight of the first scenario needs, which can take a minute."""
        self.orbits.prepare(self.scenario(self.data)).make_ready()

    def flown(self, data: dict, is_superseded: IsSuperseded = lambda: False) -> Flown:
        """A flight."""
        return fly(self.scenario(data), self.orbits, is_superseded)

    def close(self) -> None:
        """End the threads once they are idle, and the process of the starts."""
        for each in (self.flights, self.theory, self.background):
            each.shutdown(wait=False, cancel_futures=True)
        self.starts.close()


def application(board: Board, ready: Callable[[], None]) -> Starlette:
    """The application of a board; `ready` is called once it answers."""
    routes = _Routes(board)

    @contextlib.asynccontextmanager
    async def lifespan(app):
        ready()
        yield
        board.close()

    return Starlette(
        routes=[
            Route("/api/start", routes.start),
            *(
                Route(f"/api/{name}", getattr(routes, name), methods=["POST"])
                for name in ("form", "fly", "theory", "starts", "read", "write", "code", "edit")
            ),
            *(Route(path, _shown(page, "text/html")) for path in ("/", "/index.html")),
            Route("/messages.js", _shown(messages, "text/javascript")),
            serve_files(WEB),
        ],
        exception_handlers={
            ValueError: _refused,
            ArithmeticError: _refused,
            MemoryError: _refused,
            HTTPException: answer_missing,
            Exception: answer_failure,
            ClientDisconnect: _closed,
            Superseded: _closed,
        },
        lifespan=lifespan,
    )


def _shown(make: Callable[[], str], kind: str):
    async def answer(request: Request) -> Response:
        return Response(make(), media_type=kind, headers={"cache-control": "no-cache"})

    return answer


def _theory(scenario: Scenario) -> dict:
    return told_all(predict(scenario), _OF_THEORY)


class _Routes:
    """Answers to the page's requests."""

    def __init__(self, board: Board):
        self._board = board

    async def start(self, request: Request) -> Response:
        """The scenario to begin with."""
        return JSONResponse({"data": self._board.data, "name": self._board.name})

    async def form(self, request: Request) -> Response:
        """Tables and fields."""
        return JSONResponse({"tables": told_all(make_form(await _data(request)), _OF_FORM)})

    async def read(self, request: Request) -> Response:
        """The data of a TOML text."""
        asked = await json_object(request, "scenario", MOST_BYTES)
        return JSONResponse({"data": data_from_toml(str(asked.get("toml", "")))})

    async def write(self, request: Request) -> Response:
        """The TOML text of data."""
        return JSONResponse({"toml": toml_from_data(await _data(request))})

    async def code(self, request: Request) -> Response:
        """The Python files that the page may edit."""
        return JSONResponse({"files": await run_in_threadpool(self._board.own_files.read)})

    async def edit(self, request: Request) -> Response:
        """A Python file replaced."""
        asked = await json_object(request, "file", 2 * MOST_BYTES)
        given = (str(asked.get(key, "")) for key in ("name", "text", "mark"))
        found = await run_in_threadpool(self._board.own_files.write, *given)
        self._board.orbits = Orbits()  # its tables may be of what the file had
        return JSONResponse(found)

    async def fly(self, request: Request) -> Response:
        """A flight."""
        data, board = await _data(request), self._board

        def work(is_superseded: IsSuperseded) -> bytes:
            return make_answer(board.flown(data, is_superseded))

        found = await _worked(request, board, board.flights, work)
        return Response(found, media_type="application/octet-stream")

    async def theory(self, request: Request) -> Response:
        """Lines of theory."""
        data, board = await _data(request), self._board
        return JSONResponse(
            await _worked(request, board, board.theory, lambda _: _theory(board.scenario(data)))
        )

    async def starts(self, request: Request) -> Response:
        """Bands of a campaign, line by line; a mistake is the last line."""
        scenario = self._board.scenario(await _data(request))
        return StreamingResponse(self._bands(request, scenario), media_type="application/x-ndjson")

    async def _bands(self, request: Request, scenario: Scenario) -> AsyncIterator[str]:
        loop, over = asyncio.get_running_loop(), threading.Event()
        lines: asyncio.Queue[dict | None] = asyncio.Queue()

        def tell(line: dict | None) -> None:
            loop.call_soon_threadsafe(lines.put_nowait, line)

        def work() -> None:
            try:
                self._board.starts.fly(scenario, tell, over.is_set)
            except Superseded:
                pass
            except (ValueError, ArithmeticError, MemoryError) as error:
                tell({"errors": mistakes_in(str(error))})
            finally:
                tell(None)

        self._board.background.submit(work)
        ending = asyncio.ensure_future(self._board.ending.wait())
        ending.add_done_callback(lambda _: over.set())
        try:
            while (line := await lines.get()) is not None:
                yield json.dumps(line) + "\n"
        finally:
            over.set()
            ending.cancel()


async def _worked(request: Request, board: Board, threads: ThreadPoolExecutor, work: Callable):
    """What work gives in a thread; `Superseded` if the page closes its request or the board ends.

    What cannot be stopped is waited for if the page has closed its request, but not at the end.
    """
    over = threading.Event()

    def begun():
        if over.is_set():
            raise Superseded
        return work(over.is_set)

    future = asyncio.get_running_loop().run_in_executor(threads, begun)
    unwanted = [asyncio.ensure_future(each) for each in (_gone(request), board.ending.wait())]
    try:
        await asyncio.wait({future, *unwanted}, return_when=asyncio.FIRST_COMPLETED)
        over.set()
        if board.ending.is_set() and not future.done():
            future.add_done_callback(lambda done: done.cancelled() or done.exception())
            raise Superseded
        return await future
    finally:
        over.set()
        for each in unwanted:
            each.cancel()


async def _gone(request: Request) -> None:
    """Wait until the page has closed its request."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def _data(request: Request) -> dict:
    data = (await json_object(request, "scenario", MOST_BYTES)).get("data")
    if not isinstance(data, dict):
        raise ValueError("data: must be an object; received none")
    return data


async def _refused(request: Request, error: Exception) -> Response:
    return JSONResponse({"errors": mistakes_in(str(error) or type(error).__name__)}, 422)


async def _closed(request: Request, error: Exception) -> Response:
    return Response(status_code=_CLOSED)
