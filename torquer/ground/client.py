"""Commands through the ground that runs on this machine, from another process."""

import json
import time
import urllib.error
import urllib.request
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from torquer.base.limits import RequestError

#: File in the folder by which commands on this machine find the server: its address and token.
SERVER = "server.json"
#: How long an answer is waited for beyond a command's delay [s], and between two looks.
_PATIENCE_S, _LOOK_S = 40.0, 0.2
#: How many commands are looked at.
_LISTED = 2000


class RunningGround:
    """The ground that runs in a folder, `runs/ground` unless `torquer ground` was told another.

    RequestError for a folder without one, and for a satellite that it does not serve; ValueError
    with its line for what it refuses.

        ground = RunningGround(Path("runs/ground"))
        order = {"command": "report_status", "values": {"module_id": 1}}
        (sent,) = ground.send([order])
        sent["state"]                     # "executed"
    """

    def __init__(self, folder: Path):
        try:
            known = json.loads((folder / SERVER).read_text(encoding="utf-8"))
            parts = urlsplit(known["address"])
            self._token = parse_qs(parts.query)["token"][0]
            self._base = f"{parts.scheme}://{parts.netloc}"
        except (OSError, ValueError, KeyError, TypeError):
            raise RequestError(
                "folder",
                "must be that of a running ground, which `torquer ground` starts; received "
                f"{folder}",
            ) from None
        # whatever proxy the environment names, this machine is reached directly
        self._open = urllib.request.build_opener(urllib.request.ProxyHandler({})).open

    def send(
        self, orders: Sequence[dict], satellite: str | None = None, wait: bool = True
    ) -> list[dict]:
        """Send orders to a satellite, by default the only one; the commands with their states.

        `orders` are commands as a file of commands has them. Unless `wait` is false, each is
        waited for until it has been answered, or for 40 s after its delay.
        """
        key = self.satellite(satellite)
        sent = self._post(f"/api/{key}/commands", {"commands": list(orders)})
        return self._answered(key, orders, sent) if wait else sent

    def satellite(self, name: str | None = None) -> str:
        """A satellite by its short name, or the only one."""
        known = [each["key"] for each in self._get("/api/satellites")]
        if name is None and len(known) == 1:
            return known[0]
        if name is None or name not in known:
            raise RequestError(
                "satellite", f"must be one of {', '.join(known)}; received {name or 'nothing'}"
            )
        return name

    def _answered(self, satellite: str, orders: Sequence[dict], sent: list[dict]) -> list[dict]:
        """Commands once each has been answered, or after some time as they are."""
        found = {each["id"]: each for each in sent}
        asks = dict(zip(found, (order.get("acknowledge", True) for order in orders), strict=True))
        end_s = time.monotonic() + _PATIENCE_S + max(o.get("at_s", 0.0) for o in orders)

        def is_open(each: dict) -> bool:
            return each["state"] == "waiting" or (each["state"] == "sent" and asks[each["id"]])

        while any(map(is_open, found.values())) and time.monotonic() < end_s:
            time.sleep(_LOOK_S)
            listed = self._get(f"/api/{satellite}/sent?size={_LISTED}")
            found |= {each["id"]: each for each in listed if each["id"] in found}
        return list(found.values())

    def _get(self, path: str):
        return self._ask(urllib.request.Request(self._base + path))

    def _post(self, path: str, data: dict):
        body = json.dumps(data).encode()
        return self._ask(urllib.request.Request(self._base + path, body, method="POST"))

    def _ask(self, request: urllib.request.Request):
        request.add_header("Authorization", f"Bearer {self._token}")
        try:
            with self._open(request, timeout=_PATIENCE_S) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as error:
            with error:
                text = error.read().decode("utf-8", "replace")
            raise ValueError(_describe_answer(text)) from None
        except OSError as error:
            why = getattr(error, "reason", error)
            raise RequestError("folder", f"must be that of a running ground; {why}") from None


def _describe_answer(answer: str) -> str:
    try:
        return str(json.loads(answer)["error"])
    except (ValueError, KeyError, TypeError):
        return answer.strip() or "the ground refuses the request"
