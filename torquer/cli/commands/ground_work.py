"""Work of `ground`: the server, commands through it, recordings, exports."""

from __future__ import annotations

import json
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from torquer.base.folder_lock import claimed
from torquer.base.strict_json import json_text
from torquer.cli.commands.ground import (
    NAME,
    ExportOptions,
    GroundOptions,
    ImportOptions,
    SendOptions,
)
from torquer.cli.loading import check_code
from torquer.cli.options import CodeOptions
from torquer.cli.output import (
    check_installed,
    harmless,
    make_writable,
    print_error,
    print_note,
    progress_bar,
    show_address,
    writing_to,
)
from torquer.cli.process import FAILED_CODE
from torquer.ground import SERVER

_SERVER_NEEDS = ("starlette", "uvicorn", "websockets")
#: How long a command line waits for an answer beyond its delay [s], and between two looks.
_PATIENCE_S, _LOOK_S = 40.0, 0.2
#: How many commands it looks at.
_LISTED = 2000


def serve(path: Path | None, how: GroundOptions, code: CodeOptions) -> int:
    """Serve the page until a signal; 1 if something else ended it."""
    check_installed("ground", _SERVER_NEEDS)
    from torquer.ground.contact import Counters
    from torquer.pages.ground.server import Ground

    satellites = _satellites(path, how, code)
    make_writable(how.folder, "--folder")
    with writing_to(how.folder, "--folder"), claimed(how.folder, "--folder"):
        counters = Counters(how.command_counter or 0, how.new_telemetry)
        ground = Ground(satellites, how.folder, how.port or 0, counters)
        for each in satellites:
            _note_on_protection(each)
        ground.serve(lambda: show_address(ground.address, how.no_browser))
    if ground.failed is not None:
        print_error(f"the ground has ended: {ground.failed}")
        return FAILED_CODE
    return 0


def _note_on_protection(satellite) -> None:
    if satellite.software.link == "historical":
        print_note(f"{satellite.key}: commands go without protection, as its software file says")
    elif satellite.software.keys.are_known:
        print_note(
            f"{satellite.key}: its link is protected by keys that everybody knows; up_key and "
            "down_key of the software file name your own"
        )


def _satellites(path: Path | None, how: GroundOptions, code: CodeOptions) -> list:
    """The satellites of the file, or the one of the options."""
    from torquer.ground.file import SatelliteTable, load_ground, satellite_of
    from torquer.scenario.load import load_scenario

    if (path is None) == (how.link is None):
        received = "neither" if path is None else "both"
        raise ValueError(f"FILE: must be given, or --link; received {received}")
    if path is not None:
        for name, is_given in (
            ("scenario", how.scenario is not None),
            ("software", how.software is not None),
            ("name", how.name != NAME),
        ):
            if is_given:
                raise ValueError(f"--{name}: must not be given with FILE, which has its own")
        tables = load_ground(path).satellites
    else:
        table = {"link": how.link, "software": how.software, "scenario": how.scenario}
        tables = {_short_name(how.name): SatelliteTable.model_validate(table)}
    for each in tables.values():
        if each.scenario is not None:
            check_code(load_scenario(each.scenario), each.scenario, code)
    return [satellite_of(key, table) for key, table in tables.items()]


def _short_name(name: str) -> str:
    from pydantic import TypeAdapter, ValidationError

    from torquer.flight.packets.dictionary import Name

    try:
        return TypeAdapter(Name).validate_python(name)
    except ValidationError:
        raise ValueError(
            "--name: must be words of lower-case letters and digits, with '_' between them; "
            f"received {name!r}"
        ) from None


def send(name: str | None, values: Sequence[str], how: SendOptions) -> int:
    """Send commands through the running ground; 1 unless all were executed."""
    if (name is None) == (how.file is None):
        raise ValueError(
            f"NAME: must be given, or --file; received {'neither' if name is None else 'both'}"
        )
    orders, server = _orders(name, values, how), _Server(how.folder)
    satellite = server.satellite(how.satellite)
    found = server.post(f"/api/{satellite}/commands", {"commands": orders})
    if not how.no_wait:
        found = server.finished(satellite, orders, found)
    if how.json:
        print(json_text(found))
    else:
        _show_commands(found)
    pairs = zip(orders, found, strict=True)
    went_well = how.no_wait or all(each["state"] in _good(order) for order, each in pairs)
    return 0 if went_well else FAILED_CODE


def _good(order: dict) -> tuple[str, ...]:
    """States of a command that went well, as far as is waited for."""
    return ("executed", "received") if order["acknowledge"] else ("sent",)


def _orders(name: str | None, values: Sequence[str], how: SendOptions) -> list[dict]:
    if how.file is not None:
        if values or how.delay_s is not None or how.no_acknowledge:
            raise ValueError("--file: must be given alone; received values or options as well")
        from torquer.flight.software.script import load_script

        commands = load_script(how.file).commands
        if not commands:
            raise ValueError(f"--file: must hold commands; received none in {how.file}")
        return [each.model_dump(mode="json", exclude_none=True) for each in commands]
    order: dict[str, Any] = {"command": name, "acknowledge": not how.no_acknowledge}
    if how.delay_s:
        order["delay_s"] = how.delay_s
    return [order | {"values": dict(map(_key_and_value, values))}]


def _key_and_value(text: str) -> tuple[str, Any]:
    """KEY=VALUE: a number, several with commas between them, or text."""
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise ValueError(f"values: must be written KEY=VALUE; received {text!r}")
    parts = value.split(",")
    try:
        numbers = [float(part) if set(part) & set(".eEni") else int(part) for part in parts]
    except ValueError:
        return key, value
    return key, numbers if len(numbers) > 1 else numbers[0]


def _show_commands(commands: list[dict]) -> None:
    for each in commands:
        values = "".join(f" {key}={value}" for key, value in each["values"].items())
        reason = f" ({each['reason']})" if each["reason"] else ""
        print(harmless(f"{each['id']} {each['command']}{values}: {each['state']}{reason}"))


class _Server:
    """The ground that runs in a folder."""

    def __init__(self, folder: Path):
        try:
            known = json.loads((folder / SERVER).read_text(encoding="utf-8"))
            parts = urlsplit(known["address"])
            self._token = parse_qs(parts.query)["token"][0]
            self._base = f"{parts.scheme}://{parts.netloc}"
        except (OSError, ValueError, KeyError, TypeError):
            raise ValueError(
                f"--folder: must be that of a running ground, which `torquer ground` starts; "
                f"received {folder}"
            ) from None
        # whatever proxy the environment names, this machine is reached directly
        self._open = urllib.request.build_opener(urllib.request.ProxyHandler({})).open

    def satellite(self, name: str | None) -> str:
        """A satellite by its short name, or the only one."""
        known = [each["key"] for each in self.get("/api/satellites")]
        if name is None and len(known) == 1:
            return known[0]
        if name is None or name not in known:
            raise ValueError(
                f"--satellite: must be one of {', '.join(known)}; received {name or 'nothing'}"
            )
        return name

    def get(self, path: str):
        """The answer to a question."""
        return self._ask(urllib.request.Request(self._base + path))

    def post(self, path: str, data: dict):
        """The answer to an order; ValueError with the ground's line if it refuses it."""
        body = json.dumps(data).encode()
        return self._ask(urllib.request.Request(self._base + path, body, method="POST"))

    def finished(self, satellite: str, orders: list[dict], sent: list[dict]) -> list[dict]:
        """Commands once each has been answered, or after some time as they are."""
        found = {each["id"]: each for each in sent}
        asks = dict(zip(found, (order["acknowledge"] for order in orders), strict=True))
        end_s = time.monotonic() + _PATIENCE_S + max(o.get("at_s", 0.0) for o in orders)

        def is_open(each: dict) -> bool:
            return each["state"] == "waiting" or (each["state"] == "sent" and asks[each["id"]])

        while any(map(is_open, found.values())) and time.monotonic() < end_s:
            time.sleep(_LOOK_S)
            listed = self.get(f"/api/{satellite}/sent?size={_LISTED}")
            found |= {each["id"]: each for each in listed if each["id"] in found}
        return list(found.values())

    def _ask(self, request: urllib.request.Request):
        request.add_header("Authorization", f"Bearer {self._token}")
        try:
            with self._open(request, timeout=_PATIENCE_S) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as error:
            with error:
                text = error.read().decode("utf-8", "replace")
            raise ValueError(_line_of(text)) from None
        except OSError as error:
            why = getattr(error, "reason", error)
            raise ValueError(f"--folder: must be that of a running ground; {why}") from None


def _line_of(answer: str) -> str:
    try:
        return str(json.loads(answer)["error"])
    except (ValueError, KeyError, TypeError):
        return harmless(answer.strip()) or "the ground refuses the request"


def import_recording(recording: Path, how: ImportOptions) -> int:
    """Put a recording into the archive, and say what was in it."""
    from torquer.ground.archive import Archive
    from torquer.ground.file import SatelliteTable, satellite_of
    from torquer.ground.recording import imported

    name = _short_name(how.name)
    satellite = satellite_of(name, SatelliteTable(link="", software=how.software))
    if not recording.is_file():
        raise ValueError(f"RECORDING: must be a file; received {recording}")
    make_writable(how.folder, "--folder")
    path = how.folder / f"{name}.sqlite"
    archive = Archive(path, satellite.software.dictionary)
    try:
        with _progress(recording.name) as progress:
            counts = imported(satellite.software, recording, archive, progress)
    finally:
        archive.close()
    if how.json:
        print(json_text(counts | {"archive": str(path)}))
    else:
        print(", ".join(f"{key.replace('_', ' ')} {value}" for key, value in counts.items()))
        print(f"archive: {path}")
    return 0


def export(archive: Path, how: ExportOptions) -> int:
    """Write the packets of an archive."""
    if how.format == "parquet":
        check_installed("ground", ("pyarrow",))
    from torquer.ground.export import exported

    start_ms, end_ms = _ms("--start", how.start), _ms("--end", how.end)
    if start_ms is not None and end_ms is not None and start_ms > end_ms:
        raise ValueError(f"--end: must not be before --start; received {how.end}")
    make_writable(how.out)
    with writing_to(how.out), _progress(archive.name) as progress:
        files = exported(archive, how.out, how.format, how.packet, start_ms, end_ms, progress)
    if how.json:
        print(json_text([{"file": str(path), "rows": rows} for path, rows in files]))
    else:
        for path, rows in files:
            print(f"{path}: {rows} rows")
    if not files:
        print_note("nothing was written: the archive has no such rows")
    return 0


@contextmanager
def _progress(name: str) -> Iterator[Callable[[float], None] | None]:
    """Progress callback for a bar on a terminal; None elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    with progress_bar() as shown:
        task = shown.add_task(name, total=1.0)
        yield lambda part: shown.update(task, completed=part)


def _ms(option: str, text: str | None) -> int | None:
    """Milliseconds since 1970 of a date with a zone."""
    if text is None:
        return None
    try:
        at = datetime.fromisoformat(text)
    except ValueError:
        at = None
    if at is None or at.tzinfo is None:
        raise ValueError(
            f"{option}: must be a time with a zone, such as 2012-01-01T00:00:00Z; received {text}"
        )
    return round(at.timestamp() * 1e3)
