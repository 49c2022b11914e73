"""The ground file: satellites, each with its link, software file and scenario.

[satellites.chibis_m]
link = "tcp:127.0.0.1:10015"
software = "my_software.toml"     # packets, keys, kind of frames [those of Chibis-M]
scenario = "chibis_m_day.toml"    # names of regions, states, flags, parameters, sensors; orbit
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pydantic import Field

from torquer.base.spec import Spec
from torquer.computer.names import Names
from torquer.flight.packets.dictionary import Name
from torquer.flight.packets.software_file import SpaceLink, load_link
from torquer.scenario.explain import ScenarioError, validate_tables
from torquer.scenario.toml_text import parse_toml, read_text

if TYPE_CHECKING:
    from torquer.scenario.spec import Scenario

#: Names where there is no scenario.
_NO_NAMES = Names({}, (), {}, {}, ())


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


class GroundFile(Spec):
    """What a ground serves."""

    satellites: dict[Name, SatelliteTable] = Field(min_length=1)
    """Satellites by their short names, which name their archives, too."""


class Satellite(NamedTuple):
    """A satellite as the ground knows it; `software`: of its link; `names`: of its computer."""

    key: str
    link: str
    software: SpaceLink
    scenario: Scenario | None
    names: Names


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
                for name in ("software", "scenario")
                if getattr(table, name) is not None
            }
        )
        for key, table in file.satellites.items()
    }
    return file.model_copy(update={"satellites": tables})


def make_satellite(key: str, table: SatelliteTable) -> Satellite:
    """A satellite with its packets, keys and names; `ScenarioError` for wrong files.

    Only one with a scenario needs what simulates satellites.
    """
    software = load_link(table.software)
    if table.scenario is None:
        return Satellite(key, table.link, software, None, _NO_NAMES)
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
    return Satellite(key, table.link, software, scenario, names)
