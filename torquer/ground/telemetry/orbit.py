"""The orbit of a session from a file: elements, positions, or a table `[orbit]` of scenarios."""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from torquer.base.limits import RequestError
from torquer.base.spec import Spec
from torquer.base.time import parse_utc, seconds_between
from torquer.environment.orbit import AnyOrbit, FileOrbit, Sgp4
from torquer.environment.orbit.files.oem import is_oem
from torquer.environment.orbit.files.sp3 import is_sp3
from torquer.environment.orbit.numerical import tle_epoch
from torquer.ground.telemetry.request import mistakes_in_file
from torquer.scenario.explain import validate_tables
from torquer.scenario.load import tables_with_files
from torquer.scenario.toml_text import parse_toml, read_text

_LINE = re.compile(r"^([12]) [ 0-9A-Z]")


class _Tables(Spec):
    """What a file must hold of a scenario."""

    orbit: AnyOrbit


class _Positions(Spec):
    """Positions of a file."""

    orbit: FileOrbit


class OrbitFrom(NamedTuple):
    """An orbit whose time 0 is an instant of its own, as `environment.orbit` has them otherwise."""

    orbit: Any
    start: datetime

    @property
    def frame(self) -> str:
        """Frame of `state`."""
        return self.orbit.frame

    @property
    def period_s(self) -> float:
        """Time of a revolution [s]."""
        return self.orbit.period_s

    def state(self, t_s, start_utc, dut1_s: float = 0.0):
        """Position [n, 3] m and velocity [n, 3] m/s at seconds after `start_utc`."""
        return self.orbit.state(t_s + seconds_between(self.start, start_utc), self.start, dut1_s)


def load_orbit(path: Path | str, at: datetime):
    """The orbit of a file, and what to say of it; of several element sets the one nearest to `at`.

    RequestError for a file that has none.
    """
    with mistakes_in_file("orbit"):
        return _load(Path(path), at)


def _load(path: Path, at: datetime):
    text = read_text(path, "orbit")
    lines = [line.strip() for line in text.splitlines() if _LINE.match(line.strip())]
    if len(lines) >= 2 and path.suffix.lower() != ".toml":
        read = (
            _read_orbit({"kind": "sgp4", "tle": lines[k : k + 2]})
            for k in range(0, len(lines) - 1, 2)
        )
        sets = [each for each in read if isinstance(each, Sgp4)]
        return _describe(min(sets, key=lambda each: abs(tle_epoch(each) - at)), at)
    if path.suffix.lower() != ".toml" and (is_oem(text) or is_sp3(text)):
        places = _read_positions(path)
        return places, f"positions every {places.step_s:g} s in {path.name}"
    data = parse_toml(text, "orbit")
    if not isinstance(data.get("orbit"), dict):
        raise RequestError(
            "orbit",
            f"must hold two-line elements, an OEM, SP3, or a table [orbit]; received {path}",
        )
    for _, table in tables_with_files(data):
        table["file"] = str(path.parent / table["file"])
    orbit = _read_orbit(data["orbit"])
    if isinstance(orbit, Sgp4):
        return _describe(orbit, at)
    if "start" not in data:
        raise RequestError(
            "orbit", f"must state `start`, the time of the elements; received {path}"
        )
    start = parse_utc(data["start"], "start")
    return OrbitFrom(orbit, start), f"{orbit.kind} orbit of {path.name}"


def _read_positions(path: Path) -> FileOrbit:
    try:
        return validate_tables(_Positions, {"orbit": {"kind": "file", "file": path}}).orbit
    except ValueError as error:
        raise RequestError("orbit", str(error).removeprefix("orbit.file: ")) from None


def _read_orbit(table: dict) -> AnyOrbit:
    """The orbit of a table `[orbit]`; ValueError with a line for each mistake."""
    return validate_tables(_Tables, {"orbit": table}).orbit


def _describe(orbit: Sgp4, at: datetime):
    days = (at - tle_epoch(orbit)) / timedelta(days=1)
    side = "before" if days > 0.0 else "after"
    return orbit, f"SGP4, elements of {abs(days):.1f} d {side} the first row"
