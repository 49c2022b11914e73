"""The file of a session, written as the flight goes: a JSON list, an element a line.

    [
    {"torquer": "0.1.0", "scenario": "...", ...}
    ,[12, "eb90204d..."]
    ,{"ticks": 64, "downlink_bytes": 9216, "digest": "0b5c3a..."}
    ]

First what determines the flight; then bytes received at a control step, and digests of the downlink
up to a number of control steps: every `STRIDE` of them, at the end, and each second, so that of a
flight that was killed hardly anything is lost. Such a file has no last line, or part of one.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, NoReturn, Self

from pydantic import AfterValidator, Field

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.spec import Spec
from torquer.base.version import VERSION
from torquer.flight.packets.software_file import digest_files
from torquer.flight.software.faults import FaultsFile, SoftwareFault, software_faults
from torquer.scenario.spec import Scenario

#: Control steps from one recorded digest to the next.
STRIDE = 64
_DIGITS = 16
#: Longest time between two digests in the file [s].
_MARK_S = 1.0


def _hexadecimal(text: str) -> str:
    try:
        bytes.fromhex(text)
    except ValueError:
        raise ValueError("must be hexadecimal digits, two for each byte") from None
    return text


Hexadecimal = Annotated[str, AfterValidator(_hexadecimal)]


class Beginning(Spec):
    """What determines a flight, but for what it receives."""

    torquer: str
    """Version of torquer."""
    scenario: str
    """The scenario with the faults of devices, as JSON."""
    software: str = ""
    """The software file; empty for the software as shipped."""
    software_sha256: str
    """Digest of the software file and of the files that it names."""
    faults: tuple[SoftwareFault, ...] = ()
    """Faults of the software."""
    memory: dict[Literal["main", "reserve"], dict[str, Hexadecimal]] = Field(default_factory=dict)
    """Files of the non-volatile memory before the flight, by file system; empty: as delivered."""


class Session(Beginning):
    """A flight of the software that can be flown again."""

    uplink: tuple[tuple[int, Hexadecimal], ...] = ()
    """Bytes received at control steps, as hexadecimal digits."""
    ticks: int = Field(ge=0)
    """Control steps flown, as far as there is a digest."""
    downlink_bytes: int = Field(ge=0)
    """Bytes of the whole downlink."""
    digests: tuple[str, ...] = ()
    """Digest of the downlink up to every 64th control step, and to the end."""


def begin_session(
    scenario: Scenario,
    faults: FaultsFile,
    software: Path | None,
    memory: Mapping[str, Mapping[str, bytes]] = MappingProxyType({}),
) -> Beginning:
    """What a session begins with.

    `scenario`: with the faults of devices; `memory`: the files of `Memory.snapshot` before the
    flight, none of a new one.
    """
    kept = {
        place: {name: data.hex() for name, data in files.items()}
        for place, files in memory.items()
        if files
    }
    return Beginning(
        torquer=VERSION,
        scenario=scenario.model_dump_json(),
        software="" if software is None else str(software),
        software_sha256=digest_files(software),
        faults=tuple(software_faults(faults)),
        memory=kept,
    )


class Digest:
    """Digest and counts of what has come down so far."""

    def __init__(self) -> None:
        self._digest = hashlib.sha256()
        self.ticks = self.downlink_bytes = 0

    def note(self, downlink: bytes) -> bool:
        """One more control step; whether it is one whose digest is recorded."""
        self._digest.update(downlink)
        self.downlink_bytes += len(downlink)
        self.ticks += 1
        return self.ticks % STRIDE == 0

    def digest(self) -> str:
        """Of the whole downlink so far."""
        return self._digest.copy().hexdigest()[:_DIGITS]


class Replayed(Digest):
    """Digests of a flight as a session has them."""

    def __init__(self) -> None:
        super().__init__()
        self._digests: list[str] = []

    def note(self, downlink: bytes) -> bool:
        if is_recorded := super().note(downlink):
            self._digests.append(self.digest())
        return is_recorded

    def list_digests(self) -> tuple[str, ...]:
        """Digests, that of the end included."""
        return (*self._digests, *([self.digest()] if self.ticks % STRIDE else []))

    def parted(self, session: Session) -> int:
        """First control step of the stretch in which other bytes came down than recorded."""
        pairs = zip(self.list_digests(), session.digests, strict=False)
        alike = [a == b for a, b in pairs]
        return STRIDE * (alike.index(False) if False in alike else len(alike))


class Recorder(Digest):
    """Writes a session's file; keeps nothing of it.

    with Recorder(path, begin_session(scenario, faults, None)) as recorder:
        recorder.note(tick.downlink, tick.uplink)
    """

    def __init__(self, path: Path, beginning: Beginning):
        super().__init__()
        self._file = open(path, "w", encoding="utf-8")  # noqa: SIM115, closed by `close`
        self._marked, self._marked_s = 0, time.monotonic()
        self._file.write("[\n")
        self._put("", beginning.model_dump(mode="json", exclude_none=True))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def note(self, downlink: bytes, uplink: bytes = b"") -> bool:
        """One more control step: what came down, what was received."""
        if uplink:
            self._put(",", [self.ticks, uplink.hex()])
        is_recorded = super().note(downlink)
        if is_recorded or time.monotonic() - self._marked_s > _MARK_S:
            self._mark()
        return is_recorded

    def close(self) -> None:
        """End the file: the flight is over."""
        if self._file.closed:
            return
        with self._file:
            if self._marked != self.ticks:
                self._mark()
            self._file.write("]\n")

    def _mark(self) -> None:
        self._marked, self._marked_s = self.ticks, time.monotonic()
        numbers = {"ticks": self.ticks, "downlink_bytes": self.downlink_bytes}
        self._put(",", numbers | {"digest": self.digest()})

    def _put(self, comma: str, element: Any) -> None:
        """Write an element, so that it is there whatever becomes of this process."""
        self._file.write(f"{comma}{json.dumps(element)}\n")
        self._file.flush()


def load_session(path: Path) -> Session:
    """A session's file; `ScenarioError` with one line for another one, or of another version."""
    beginning, uplink, marks = None, [], [_NOTHING]
    for number, element in _elements(path):
        if beginning is None:
            beginning = element if isinstance(element, dict) else _refuse(path, number)
            continue
        match element:
            case [int(tick), str(data)] if tick >= marks[-1]["ticks"]:
                uplink.append((tick, data))
            case {"ticks": int(ticks), "downlink_bytes": int(), "digest": str()} if (
                marks[-1]["ticks"] < ticks <= _next_digest(marks[-1]["ticks"])
            ):
                marks.append(element)
            case _:
                _refuse(path, number)
    if beginning is None:
        _refuse(path, 1)
    end = marks[-1]
    found = {
        **beginning,
        "uplink": [(tick, data) for tick, data in uplink if tick < end["ticks"]],
        **{name: end[name] for name in ("ticks", "downlink_bytes")},
        "digests": [
            each["digest"] for each in marks[1:] if each is end or each["ticks"] % STRIDE == 0
        ],
    }
    session = validate_tables(Session, found)
    if session.torquer != VERSION:
        raise ScenarioError(
            f"session: must be of torquer {VERSION} to be flown again; received one of "
            f"{session.torquer}"
        )
    return session


#: Before the first digest.
_NOTHING: dict[str, Any] = {"ticks": 0, "downlink_bytes": 0, "digest": ""}


def _next_digest(ticks: int) -> int:
    """The next control step whose digest every session has."""
    return (ticks // STRIDE + 1) * STRIDE


def _elements(path: Path) -> Iterator[tuple[int, Any]]:
    """The elements of a session's file and the numbers of their lines; not one that is torn."""
    try:
        with open(path, encoding="utf-8") as file:
            if file.readline() != "[\n":
                _refuse(path, 1)
            for number, line in enumerate(file, start=2):
                if line == "]\n" and not file.readline():
                    return
                if not line.endswith("\n"):
                    return
                try:
                    yield number, json.loads(line.removeprefix(",") if number > 2 else line)
                except (ValueError, RecursionError):
                    _refuse(path, number)
    except OSError as error:
        _refuse(path, 0, error.strerror or str(error))
    except UnicodeDecodeError:
        _refuse(path, 0, "no text")


def _refuse(path: Path, number: int, why: str = "") -> NoReturn:
    what = why or f"line {number} is none of a session"
    raise ScenarioError(f"session: must be a readable session; received {path}: {what}")
