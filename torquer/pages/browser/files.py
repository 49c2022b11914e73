"""What all pages send and are sent: JSON, the page's own files, and those that all pages share.

Files of others are stored compressed, as they are sent.
"""

from __future__ import annotations

import json
import mimetypes
from collections import Counter
from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from torquer.base.explain import ScenarioError
from torquer.flight.packets.mistakes import quote_value

#: What pages share: three.js, the body in 3D, elements of a page.
SHARED = Path(__file__).parent / "web"
_COMPRESSED = {"content-encoding": "gzip"}
#: What a request is told at which the server fails.
FAILURE = {"error": "this cannot be answered: the server failed, and has said why where it runs"}


def serve_files(folder: Path) -> Route:
    """The route of all files of a page in `folder`, to stand last; 404 for any other path."""

    async def file(request: Request) -> Response:
        name = request.path_params["path"] or "index.html"
        for path in (within(folder, name), within(SHARED, name)):
            for place, encoding in ((path, {}), (path.with_name(f"{path.name}.gz"), _COMPRESSED)):
                if place.is_file():
                    return await _sent(request, place, name, encoding)
        raise HTTPException(404)

    return Route("/{path:path}", file)


def within(folder: Path, name: str) -> Path:
    """The path of a file in a folder; HTTPException 404 if it leads out of it."""
    try:
        path = (folder / name).resolve()
        if path.is_relative_to(folder.resolve()):
            path.is_file()
            return path
    except (OSError, ValueError):
        pass  # no name of a file: too long, or with characters that none has
    raise HTTPException(404)


async def answer_missing(request: Request, error: Exception) -> Response:
    """The answer to a request for what is not there."""
    return JSONResponse({"error": "there is no such thing"}, getattr(error, "status_code", 404))


async def answer_failure(request: Request, error: Exception) -> Response:
    """The answer to a request at which the server fails: nothing of why, which is not theirs."""
    return JSONResponse(FAILURE, 500)


async def _sent(request: Request, path: Path, name: str, encoding: dict[str, str]) -> Response:
    about = path.stat()
    # browsers ask each time, but keep the file and what they have compiled of it
    tag = f'"{about.st_mtime_ns:x}-{about.st_size:x}"'
    headers = {"cache-control": "no-cache", "etag": tag, **encoding}
    if request.headers.get("if-none-match") == tag:
        return Response(status_code=304, headers=headers)
    data = await run_in_threadpool(path.read_bytes)
    kind = mimetypes.guess_type(name)[0] or "application/octet-stream"
    return Response(data, headers=headers, media_type=kind)


async def json_object(request: Request, what: str, most_bytes: int) -> dict:
    """The body of a request, an object in JSON; `ScenarioError`, of `what`, for anything else."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > most_bytes:
            raise ScenarioError(f"{what}: must have at most {most_bytes} bytes; received more")
    try:
        found = json.loads(body, object_pairs_hook=_once_each)
        if b"\\ud" in body.lower():  # a half of a character cannot be said again
            json.dumps(found, ensure_ascii=False).encode()
    except _TwiceError as error:
        raise ScenarioError(f"{what}: must have each key once; received {error} twice") from None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ScenarioError(f"{what}: must be a JSON object; received something else")
    return found


class _TwiceError(ValueError):
    """A key that an object has twice."""


def _once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        ((key, _),) = Counter(key for key, _ in pairs).most_common(1)
        raise _TwiceError(quote_value(key))
    return found
