"""The ground file: satellites, each with its link, software file and scenario.

[satellites.chibis_m]
link = "tcp:127.0.0.1:10015"
software = "my_software.toml"     # packets, keys, kind of frames [those of Chibis-M]
scenario = "chibis_m_day.toml"    # names of regions, states, flags, parameters, sensors; orbit
elements = "chibis_m.tle"         # orbit for passes [the scenario's]
downlink_hz = 435.215e6

[satellites.chibis_m.downlink]
bit_s = 9600.0

[stations.tarusa]
latitude_deg = 54.73
longitude_deg = 37.18
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from pydantic import Field

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.spec import Spec
from torquer.computer.names import Names
from torquer.flight.packets.dictionary import Name
from torquer.flight.packets.software_file import SpaceLink, load_link, read_software
from torquer.ground.backlog import DownlinkTable
from torquer.ground.stations import GroundStation
from torquer.scenario.toml_text import parse_toml, read_text

if TYPE_CHECKING:
    from torquer.scenario.spec import Scenario

#: Names where there is no scenario.
_NO_NAMES = Names({}, (), {}, {}, ())
_NO_STATIONS: Mapping[str, GroundStation] = MappingProxyType({})


class SatelliteTable(Spec):
    """A satellite of the ground file; paths are relative to the file."""

    link: str
    """Address of its link: tcp:HOST:PORT, udp:HOST:PORT, can:INTERFACE:CHANNEL."""
    software: Path | None = None
    """Its software file: packets, kind of frames, keys [that of Chibis-M]; modules in it are not
    loaded.
    """
    scenario: Path | None = None
    """Its scenario: names for commands, mode table, orbit and sensors; numbers are shown without.
    """
    elements: Path | None = None
    """File of its orbit, for passes: two-line elements or OMM, OEM, SP3 [that of its scenario]."""
    elements_of: str | None = None
    """Its name or catalogue number in a file of several satellites."""
    downlink_hz: float | None = Field(default=None, gt=0.0, le=1e12)
    """Frequency at which it sends."""
    uplink_hz: float | None = Field(default=None, gt=0.0, le=1e12)
    """Frequency at which it receives."""
    downlink: DownlinkTable = DownlinkTable()
    """What it sends by itself, and what it keeps for a pass."""


class GroundFile(Spec):
    """What a ground serves."""

    satellites: dict[Name, SatelliteTable] = Field(min_length=1)
    """Satellites by their short names, which name their archives, too."""
    stations: dict[Name, GroundStation] = Field(default_factory=dict)
    """Ground stations by their short names, for passes."""


class Satellite(NamedTuple):
    """A satellite as the ground knows it; `software`: of its link; `names`: of its computer.

    `table`: what the ground file says of it; `stations`: those of the file.
    """

    key: str
    link: str
    software: SpaceLink
    scenario: Scenario | None
    names: Names
    table: SatelliteTable
    stations: Mapping[str, GroundStation] = _NO_STATIONS


def load_ground(path: Path) -> GroundFile:
    """The ground file of a path, its paths made relative to the present folder.

    `ScenarioError` with one line for each mistake.
    """
    file = validate_tables(GroundFile, parse_toml(read_text(path, "ground"), "ground"))
    folder = path.parent
    tables = {
        key: table.model_copy(
            update={
                name: folder / getattr(table, name)
                for name in ("software", "scenario", "elements")
                if getattr(table, name) is not None
            }
        )
        for key, table in file.satellites.items()
    }
    return file.model_copy(update={"satellites": tables})


def make_satellite(
    key: str, table: SatelliteTable, stations: Mapping[str, GroundStation] = _NO_STATIONS
) -> Satellite:
    """A satellite with its packets, keys, names and stations; `ScenarioError` for wrong files.

    Only one with a scenario needs what simulates satellites.
    """
    software, downlink = link_of(table, key)
    table = table.model_copy(update={"downlink": downlink})
    if table.scenario is None:
        return Satellite(key, table.link, software, None, _NO_NAMES, table, stations)
    from torquer.scenario.load import load_scenario
    from torquer.simulation.outside.directed import computer_names
    from torquer.simulation.setup.prepare import make_blocks

    scenario = load_scenario(table.scenario)
    names = computer_names(scenario, make_blocks(scenario))
    software = software.for_satellite(scenario)
    try:
        software.dictionary.check_alarms({name: each for name, (_, each) in names.regions.items()})
    except ValueError as error:
        raise ScenarioError(f"software: {error}") from None
    return Satellite(key, table.link, software, scenario, names, table, stations)


def link_of(table: SatelliteTable, key: str = "NAME") -> tuple[SpaceLink, DownlinkTable]:
    """Link of a satellite, and what it sends with the periods of its software where none are given.

    `ScenarioError` for wrong files.
    """
    software = load_link(table.software)
    table.downlink.check(f"satellites.{key}.downlink", software.dictionary)
    tm = read_software(table.software)[0].modules.get("tm")
    settings = {} if tm is None else tm.settings
    return software, table.downlink.with_settings(settings, software.dictionary)
