"""The orbit by which passes are predicted, and how good it is.

Elements of a file are for that; the orbit of a scenario is one of a model, which tells where
its simulated satellite is.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from torquer.ground.file import SatelliteTable
from torquer.ground.stations import GroundStation

if TYPE_CHECKING:
    from torquer.environment.along_orbit import OrbitEnvironment
    from torquer.ground.passes import Pass
    from torquer.scenario.spec import Scenario

#: Age from which on elements are said to be old [days].
OLD_DAYS = 3.0


class Elements(NamedTuple):
    """Elements of SGP4: what they are called, their age at a time, and by how much the satellite
    may then be early or late (a rule: 3 km a day, and a tenth of what drag does)."""

    called: str
    epoch_ms: int
    age_days: float
    error_s: float


class KnownOrbit(NamedTuple):
    """An orbit with models of Earth and Sun, what it is in a line, its elements if it has such."""

    around: OrbitEnvironment
    text: str
    elements: Elements | None


def orbit_of(
    table: SatelliteTable | None, scenario: Scenario | None, time_ms: int
) -> KnownOrbit | None:
    """The orbit of a satellite at a time: its elements, else its scenario's; None without both.

    ValueError with one line for a file that holds no orbit at that time.
    """
    if table is not None and table.elements is not None:
        return orbit_from_file(table.elements, time_ms, table.elements_of)
    if scenario is None:
        return None
    return _known(scenario.orbit_environment(), time_ms, f"the scenario {scenario.name}")


def orbit_from_file(path: Path | str, time_ms: int, called: str | None = None) -> KnownOrbit:
    """The orbit of a file of elements or positions; of several sets, the one nearest to the time.

    `called`: name or catalogue number, in a file of several. ValueError with one line.
    """
    from torquer.base.explain import ScenarioError, validate_tables
    from torquer.environment.along_orbit import Environment, OrbitEnvironment
    from torquer.environment.orbit import FileOrbit

    given = {"kind": "file", "file": Path(path)} | ({"satellite": called} if called else {})
    start = datetime.fromtimestamp(time_ms / 1e3, UTC)
    try:
        orbit = validate_tables(FileOrbit, given)
        return _known(OrbitEnvironment(Environment(), orbit, start), time_ms, Path(path).name)
    except ValueError as error:
        line = str(error).removeprefix("orbit.").removeprefix("file: ")
        raise ScenarioError(f"elements: {line}") from None


def passes_by(
    known: KnownOrbit, stations: Mapping[str, GroundStation], start_ms: int, end_ms: int
) -> list[Pass]:
    """`find_passes` by an orbit; what is wrong with a file is said of `elements`."""
    from torquer.ground.passes import find_passes

    try:
        return find_passes(known.around, stations, start_ms, end_ms)
    except ValueError as error:
        raise ValueError(str(error).replace("orbit.file: ", "elements: ", 1)) from None


def _known(around: OrbitEnvironment, time_ms: int, where: str) -> KnownOrbit:
    elements = _elements(around, time_ms)
    if elements is None:
        return KnownOrbit(around, f"that of {where}", None)
    text = (
        f"SGP4 with elements of {elements.called}, {elements.age_days:.1f} days "
        f"{'old' if elements.age_days >= 0.0 else 'ahead'}, of {where}"
    )
    if abs(elements.age_days) > OLD_DAYS:
        text += f": the satellite may be early or late by {elements.error_s:.0f} s"
    return KnownOrbit(around, text, elements)


def _elements(around: OrbitEnvironment, time_ms: int) -> Elements | None:
    from sgp4.api import Satrec

    from torquer.environment.orbit import FileOrbit, Sgp4
    from torquer.environment.orbit.files.elements import ElementSet
    from torquer.environment.orbit.sgp4 import likely_error_s

    orbit = around.orbit
    if isinstance(orbit, Sgp4):
        chosen = ElementSet(orbit, orbit.tle[0][2:7].strip())
    elif isinstance(orbit, FileOrbit) and orbit.step_s is None:
        chosen = orbit.elements(around.start)
    else:
        return None
    mean, epoch_s = chosen.orbit, chosen.epoch.timestamp()
    satellite = Satrec.twoline2rv(*mean.tle) if isinstance(mean, Sgp4) else mean.satellite()
    age_days = (time_ms / 1e3 - epoch_s) / 86_400.0
    error_s = likely_error_s(satellite, mean.extent(), age_days)
    return Elements(chosen.called, round(1e3 * epoch_s), age_days, error_s)
