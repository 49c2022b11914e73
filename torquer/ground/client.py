"""Commands through the ground that runs on this machine, from another process."""

import json
import time
import urllib.error
import urllib.request
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from torquer.base.limits import RequestError
from torquer.ground.archive import EPOCH_MS

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

    def cancel(self, number: int, satellite: str | None = None) -> dict:
        """Cancel a command that waits, here or on board: the command as it then stands.

        For one on board that is the command by which it is taken out of the plan, once answered.
        ValueError with the line of the ground for a command that waits nowhere.
        """
        key = self.satellite(satellite)
        changed = self._post(f"/api/{key}/commands/{number}/cancel", {})
        if changed["id"] == number:
            return changed
        return self._answered(key, [{"command": changed["command"]}], [changed])[0]

    def plan(self, satellite: str | None = None) -> list[dict]:
        """The commands that wait on board, by their execution time, as the satellite lists them.

        `request`: the number by which `plan_cancel` names one; `id`, `command`, `values`: of the
        command here, None of one that another ground has sent. RequestError if it does not answer.
        """
        key = self.satellite(satellite)
        (asked,) = self.send([{"command": "plan_list"}], key)
        end_s, rows = time.monotonic() + _PATIENCE_S, []
        while asked["state"] == "executed" and time.monotonic() < end_s:
            since = f"start={asked['sent_ms']}&by=received&size={_LISTED}"
            rows = [values for *_, values in self._get(f"/api/{key}/history/plan?{since}")]
            if rows and len(rows) >= rows[0][0]:
                sent = self._get(f"/api/{key}/sent?size={_LISTED}")  # newest first
                return [_planned(row, sent) for row in sorted(rows, key=_place) if row[0]]
            time.sleep(_LOOK_S)
        raise RequestError("satellite", f"must list its plan; plan_list is {asked['state']}")

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


def _place(row: Sequence) -> int:
    """Place of a command in the plan."""
    return row[1]


def _planned(row: Sequence, sent: Sequence[dict]) -> dict:
    """A packet on the plan, with the command that was sent with its number."""
    _, _, request, _, _, execute_s = row
    ours = next((each for each in sent if each["request"] == request), {})
    known = {name: ours.get(name) for name in ("id", "command", "values")}
    return {"request": request, "execute_ms": EPOCH_MS + 1000 * execute_s} | known


def _describe_answer(answer: str) -> str:
    try:
        return str(json.loads(answer)["error"])
    except (ValueError, KeyError, TypeError):
        return answer.strip() or "the ground refuses the request"
