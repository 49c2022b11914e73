"""The orbit of a session from a file: elements, positions, or a table `[orbit]` of scenarios."""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from torquer.base.explain import validate_tables
from torquer.base.limits import RequestError
from torquer.base.spec import Spec
from torquer.base.time import parse_utc, seconds_between
from torquer.environment.orbit import AnyOrbit, FileOrbit, Sgp4
from torquer.environment.orbit.files import is_orbit_file
from torquer.environment.orbit.files.elements import read_neighbours
from torquer.environment.orbit.numerical import tle_epoch
from torquer.ground.telemetry.request import MOST_AGE_DAYS, mistakes_in_file
from torquer.scenario.load import tables_with_files
from torquer.scenario.toml_text import parse_toml, read_text

#: How a TOML file may begin that is called otherwise: a list of messages in JSON has no name there.
_TABLE = re.compile(r"\s*\[+\s*[A-Za-z]")
#: Other satellites of a file whose elements are tried in place of those stated.
_MOST_NEIGHBOURS = 100
#: How mistakes in a file of an orbit begin.
_OF_FILE = re.compile(r"^orbit\.(\w+): ", re.MULTILINE)


class _Tables(Spec):
    """What a file must hold of a scenario."""

    orbit: AnyOrbit


class _File(Spec):
    """A file of positions or elements."""

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

    @property
    def step_s(self) -> float | None:
        """Interval between known positions [s]; None for an orbit in closed form."""
        return self.orbit.step_s

    def knot_s(self, start_utc) -> float:
        """Time of the first known position [s]."""
        return self.orbit.knot_s(self.start) - seconds_between(self.start, start_utc)

    def check_span(self, start_utc, *times_s: float) -> None:
        """ValueError for times [s] after `start_utc` at which it is not known well enough."""
        later_s = seconds_between(self.start, start_utc)
        self.orbit.check_span(self.start, *(later_s + each for each in times_s))

    def state(self, t_s, start_utc, dut1_s: float = 0.0):
        """Position [n, 3] m and velocity [n, 3] m/s at seconds after `start_utc`."""
        return self.orbit.state(t_s + seconds_between(self.start, start_utc), self.start, dut1_s)


def load_orbit(
    path: Path | str,
    at: datetime,
    satellite: str | None = None,
    most_age_days: float = MOST_AGE_DAYS,
):
    """The orbit of a file, and what to say of it; of several element sets the one nearest to `at`.

    `at`: UTC of the middle row; `satellite`: its name or number in a file of several. RequestError
    for a file that has none, and for elements older, or younger, than `most_age_days`.
    """
    with mistakes_in_file("orbit"):
        orbit, about, age_days = _load(Path(path), at, satellite)
    if not abs(age_days) <= most_age_days:
        raise RequestError(
            "orbit",
            f"must have elements within {most_age_days:g} d of the middle row (most_age_days); "
            f"received {about}",
            "most_age_days",
        )
    return orbit, about


def _load(path: Path, at: datetime, satellite: str | None):
    """Orbit, what to say of it, age of its elements [days]; 0 if it has none."""
    text = read_text(path, "orbit")
    if path.suffix.lower() != ".toml" and is_orbit_file(text) and not _TABLE.match(text):
        found = _read_file(path, satellite)
        if found.step_s is not None:
            return found, f"positions every {found.step_s:g} s in {path.name}", 0.0
        elements = found.elements(at)
        count = found.count_sets()
        return _describe(OrbitFrom(found, at), elements.called, elements.epoch, at, count)
    if satellite is not None:
        raise RequestError(
            "satellite",
            f"must be left out for a table [orbit], which may name it; received {satellite!r}",
        )
    data = parse_toml(text, "orbit")
    if not isinstance(data.get("orbit"), dict):
        raise RequestError(
            "orbit",
            f"must hold two-line elements, an OMM, OEM, SP3, or a table [orbit]; received {path}",
        )
    for _, table in tables_with_files(data):
        table["file"] = str(path.parent / table["file"])
    orbit = _read_orbit(data["orbit"])
    if isinstance(orbit, Sgp4):
        return _describe(orbit, orbit.tle[0][2:7].strip(), tle_epoch(orbit), at)
    if "start" not in data:
        raise RequestError(
            "orbit", f"must state `start`, the time of the elements; received {path}"
        )
    start = parse_utc(data["start"], "start")
    return OrbitFrom(orbit, start), f"{orbit.kind} orbit of {path.name}", 0.0


def age_days(orbit, at: datetime) -> float:
    """How far its elements are from an instant; 0 for positions, and for an orbit of a scenario."""
    given = orbit.orbit if isinstance(orbit, OrbitFrom) else orbit
    if isinstance(given, FileOrbit) and given.step_s is None:
        return abs((at - given.elements(at).epoch) / timedelta(days=1))
    return abs((at - tle_epoch(given)) / timedelta(days=1)) if isinstance(given, Sgp4) else 0.0


def load_neighbours(orbit, at: datetime) -> dict[str, Any]:
    """Orbits of the other satellites in the file of elements of one, by name, each by the epoch
    nearest to an instant."""
    given = orbit.orbit if isinstance(orbit, OrbitFrom) else orbit
    if not isinstance(given, FileOrbit) or given.step_s is not None:
        return {}
    called = given.elements(at).called
    sets = read_neighbours(read_text(given.file, "orbit"), called, _MOST_NEIGHBOURS)
    nearest = (min(each, key=lambda one: abs(one.epoch - at)) for each in sets)
    return {each.called: each.orbit for each in nearest}


def _read_file(path: Path, satellite: str | None) -> FileOrbit:
    table = {"kind": "file", "file": path, "satellite": satellite}
    try:
        return validate_tables(_File, {"orbit": table}).orbit
    except ValueError as error:
        text = str(error).replace("; orbit.", "; a TOML file with [orbit] file and orbit.")
        raise RequestError("orbit", _OF_FILE.sub(_in_words, text)) from None


def _in_words(found: re.Match) -> str:
    """What a mistake begins with where the file is all that is given."""
    if found[1] == "file":
        return ""
    return f"must be a TOML file with a table [orbit] of kind 'file' for this one: {found[1]} "


def _read_orbit(table: dict) -> AnyOrbit:
    """The orbit of a table `[orbit]`; ValueError with a line for each mistake."""
    return validate_tables(_Tables, {"orbit": table}).orbit


def _describe(orbit: Sgp4 | OrbitFrom, called: str, epoch: datetime, at: datetime, count: int = 1):
    """An orbit of elements, what to say of it, their age [days]; `count`: sets in the file."""
    days = (at - epoch) / timedelta(days=1)
    side = "before" if days > 0.0 else "after"
    chosen = f", the nearest of {count} sets" if count > 1 else ""
    said = f"SGP4, elements of {called} of {epoch:%Y-%m-%dT%H:%MZ}{chosen}"
    return orbit, f"{said}, {abs(days):.1f} d {side} the middle row", days
