"""What a page sends."""

from __future__ import annotations

import json

from starlette.requests import Request

from torquer.scenario.explain import ScenarioError


async def json_object(request: Request, what: str, most_bytes: int) -> dict:
    """The body of a request, an object in JSON; `ScenarioError`, of `what`, for anything else."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > most_bytes:
            raise ScenarioError(f"{what}: must have at most {most_bytes} bytes; received more")
    try:
        found = json.loads(body)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ScenarioError(f"{what}: must be a JSON object; received something else")
    return found
