"""Commands through the ground that runs on this machine, from another process."""

import http.client
import json
import re
import time
import urllib.error
import urllib.request
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote, urlencode

from torquer.base.limits import RequestError
from torquer.ground.authors import OPERATOR, fault_of

#: File in the folder by which commands on this machine find the server: its address and token.
SERVER = "server.json"
#: An address of a page on this machine.
_ADDRESS = re.compile(r"(http://127\.0\.0\.1:\d{1,5})/\?token=([\w-]+)", re.ASCII)
#: How long an answer is waited for beyond a command's delay [s], and between two looks.
_PATIENCE_S, _LOOK_S = 40.0, 0.2
#: A ground that was killed has left its address, where something else may listen now.
_ANOTHER = "another program answers there"
#: Most characters that are shown of an answer that is not a ground's.
_LONGEST = 200
#: How many commands are looked at.
_LISTED = 2000


class RunningGround:
    """The ground that runs in a folder, `runs/ground` unless `torquer ground` was told another.

    `operator`: the name that is stated with commands; `patience_s`: how long an answer is waited
    for. RequestError for a folder without a ground,
    and for a satellite that it does not serve; ValueError with its line for what it refuses.

        ground = RunningGround(Path("runs/ground"))
        order = {"command": "report_status", "values": {"module_id": 1}}
        (sent,) = ground.send([order])
        sent["state"]                     # "executed"
    """

    def __init__(self, folder: Path, operator: str | None = None, patience_s: float = _PATIENCE_S):
        if operator is not None and (fault := fault_of(operator)):
            raise RequestError("as", fault)
        self._operator, self._patience_s = operator, patience_s
        try:
            known = json.loads((folder / SERVER).read_text(encoding="utf-8"))
            found = _ADDRESS.fullmatch(known["address"])
        except (OSError, ValueError, KeyError, TypeError):
            found = None
        if found is None:
            raise RequestError(
                "folder",
                "must be that of a running ground, which `torquer ground` starts; received "
                f"{folder}",
            )
        self._base, self._token = found.groups()
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
        """The plan, by execution time, once the satellite has listed what waits on board.

        `mark`: how it differs from what is known here, as `torquer.ground.plan` says; `request`:
        the number by which `plan_cancel` names one; `id`, `command`, `values`: of the command here,
        `id` None of one that another ground has sent. RequestError if it does not answer.
        """
        key = self.satellite(satellite)
        (asked,) = self.send([{"command": "plan_list"}], key)
        end_s = time.monotonic() + _PATIENCE_S
        while asked["state"] == "executed" and time.monotonic() < end_s:
            plan = self._get(f"/api/{key}/plan")
            if plan["is_complete"] and plan["reported_ms"] >= asked["sent_ms"]:
                return plan["entries"]
            time.sleep(_LOOK_S)
        raise RequestError("satellite", f"must list its plan; plan_list is {asked['state']}")

    def history(self, satellite: str | None = None, **wanted) -> list[dict]:
        """Commands with what became of them, newest first, also such as are not archived yet.

        `wanted`: fields of `torquer.ground.command_history.Wanted`.
        """
        return self._get(f"/api/{self.satellite(satellite)}/command-history?{urlencode(wanted)}")

    def alarms(self, satellite: str | None = None) -> list[dict]:
        """Alarms and shelves as they are now, also such as are not archived yet."""
        return self._get(f"/api/{self.satellite(satellite)}/alarms")["alarms"]

    def violations(self, satellite: str | None = None, **wanted) -> list[dict]:
        """The out-of-limits log, newest first, also what is not archived yet.

        `wanted`: `start` and `end` on board [ms since 1970], `size`.
        """
        return self._get(f"/api/{self.satellite(satellite)}/violations?{urlencode(wanted)}")

    def stack(self, satellite: str | None = None) -> dict:
        """The command stack of a satellite, None if there is none, and the names of saved ones."""
        return self._get(f"/api/{self.satellite(satellite)}/stack")

    def load_stack(
        self, text: str | None = None, name: str = "", satellite: str | None = None
    ) -> dict:
        """Load a TOML text as the stack, or without one the saved stack of a name; it is held."""
        data = {"name": name} if text is None else {"name": name, "text": text}
        return self._post(f"/api/{self.satellite(satellite)}/stack", data)

    def act_on_stack(self, action: str, satellite: str | None = None) -> dict:
        """Send the next step (`next`), `skip` it, `run`, `hold` or `abort` the stack."""
        key = self.satellite(satellite)
        stack = self._get(f"/api/{key}/stack")["stack"] or {"id": 0, "next": None}
        data = {"stack": stack["id"], "place": stack["next"]}
        return self._post(f"/api/{key}/stack/{action}", data)

    def saved_stack(self, name: str, satellite: str | None = None) -> str:
        """The text of a saved stack."""
        return self._get(self._saved(name, satellite))["text"]

    def save_stack(self, name: str, text: str, satellite: str | None = None) -> None:
        """Keep a text, which is checked, under a name."""
        self._post(self._saved(name, satellite), {"text": text}, "PUT")

    def delete_stack(self, name: str, satellite: str | None = None) -> None:
        """Forget a saved stack."""
        self._post(self._saved(name, satellite), {}, "DELETE")

    def _saved(self, name: str, satellite: str | None) -> str:
        return f"/api/{self.satellite(satellite)}/stacks/{quote(name, safe='')}"

    def satellite(self, name: str | None = None) -> str:
        """A satellite by its short name, or the only one."""
        try:
            known = [each["key"] for each in self._get("/api/satellites")]
        except (KeyError, TypeError):
            raise _not_one(_ANOTHER) from None
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

    def _post(self, path: str, data: dict, method: str = "POST"):
        request = urllib.request.Request(self._base + path, json.dumps(data).encode())
        request.method = method
        if self._operator:
            request.add_header(OPERATOR, quote(self._operator))
        return self._ask(request)

    def _ask(self, request: urllib.request.Request):
        request.add_header("Authorization", f"Bearer {self._token}")
        try:
            data, refused = self._fetch(request)
        except OSError as error:
            raise _not_one(getattr(error, "reason", error)) from None
        except http.client.HTTPException:
            raise _not_one(_ANOTHER) from None
        if refused:
            raise ValueError(_describe_answer(data.decode("utf-8", "replace")))
        try:
            return json.loads(data)
        except ValueError:
            raise _not_one(_ANOTHER) from None

    def _fetch(self, request: urllib.request.Request) -> tuple[bytes, bool]:
        """What is answered, and whether it is a refusal."""
        try:
            with self._open(request, timeout=self._patience_s) as answer:
                return answer.read(), False
        except urllib.error.HTTPError as error:
            with error:
                return error.read(), True


def _not_one(why: object) -> RequestError:
    return RequestError("folder", f"must be that of a running ground; {why}")


def _describe_answer(answer: str) -> str:
    try:
        return str(json.loads(answer)["error"])
    except (ValueError, KeyError, TypeError):
        return " ".join(answer.split())[:_LONGEST] or "the ground refuses the request"
