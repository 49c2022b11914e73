"""The software file: which modules fly, at what rates and with what settings; packets and link.

Two further keys in a module's table make it a module of the user:

    [modules.dosimeter]
    file = "dosimeter.py"      # relative to the software file
    class = "Dosimeter"
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from pydantic import Field, model_validator

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.spec import Spec
from torquer.flight.packets.bits import dictionary_for
from torquer.flight.packets.dictionary import Dictionary, load_dictionary
from torquer.flight.packets.framing import LinkKind, check_framing
from torquer.flight.packets.keys import Keys, read_key
from torquer.scenario.toml_text import parse_toml, read_text

if TYPE_CHECKING:
    from torquer.scenario.spec import Scenario

#: The software file that flies unless another is given.
AS_SHIPPED = Path(__file__).parents[1] / "software" / "chibis_m.toml"


class ModuleTable(Spec):
    """A module of the software: its rate and settings, and its file if it is the user's own."""

    period_s: float | None = Field(default=None, gt=0.0)
    """Time between two steps; the module's own period unless given."""
    on: bool = True
    """Whether the module starts at boot; else a command can start it."""
    settings: dict[str, Any] = Field(default_factory=dict)
    """Settings in place of the module's defaults."""
    file: Path | None = None
    """Python file of a module of your own, relative to the software file."""
    class_name: str | None = Field(default=None, alias="class")
    """Class of the module in that file."""


class SoftwareFile(Spec):
    """Flight software as a file describes it."""

    name: str = "software"
    """Name of the software."""
    dictionary: str = "chibis_m"
    """Dictionary of packets: a shipped one by name, or a file."""
    packets: tuple[Path, ...] = ()
    """Files of further modules and packets, added to the dictionary."""
    link: LinkKind = "protected"
    """Frames of the link: those of Chibis-M; these within frames with checksum and MAC; space
    packets of PUS-C (ECSS-E-ST-70-41C) within such frames; space packets (CCSDS 133.0-B) of another
    satellite as they come, which are read only."""
    up_key: Path | None = None
    """File of the key of commands (all but historical); unless given, one that everybody knows."""
    recovery_key: Path | None = None
    """File of the key by which the key of commands is changed; with `up_key`."""
    down_key: Path | None = None
    """File of the key of telemetry; unless given, a key that everybody knows."""
    spacecraft: int = Field(default=77, ge=0, le=1023)
    """Number of the spacecraft in protected frames; of its application process in PUS-C."""
    modules: dict[str, ModuleTable] = Field(default_factory=dict)
    """Modules by name, in addition to those that fly always."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.link == "pus" and self.spacecraft == 0:
            raise ValueError("spacecraft: must be at least 1 with link = 'pus'; received 0")
        if (self.up_key is None) != (self.recovery_key is None):
            lacks, has = ("recovery", "up") if self.up_key else ("up", "recovery")
            raise ValueError(f"{lacks}_key: must be given with {has}_key; received nothing")
        return self


@dataclass(frozen=True)
class SpaceLink:
    """What both ends of a link know of it: name of the software, packets, kind of frames, keys.

    `link`: historical, protected, pus or space_packets, as `SoftwareFile` has it.
    """

    name: str
    dictionary: Dictionary
    link: str
    keys: Keys

    def for_satellite(self, scenario: Scenario | None) -> Self:
        """The same with the satellite's sensors named where packets have a bit for each.

        None, where nothing is known of them: as it is.
        """
        if scenario is None:
            return self
        return replace(self, dictionary=dictionary_for(scenario, self.dictionary))


def load_link(source: str | Path | Mapping | None = None) -> SpaceLink:
    """The link of a software file, or of its tables as data; None: that of Chibis-M as shipped.

    Nothing is executed. `ScenarioError` with one line for each mistake.

        load_link("software.toml").dictionary.down["beacon"].size     # bytes
    """
    return make_link(*read_software(source))


def make_link(file: SoftwareFile, folder: Path = Path()) -> SpaceLink:
    """The link that a software file describes; `folder`: to which its paths are relative."""
    dictionary = _dictionary(file, folder)
    try:
        check_framing(dictionary, file.link)
    except ValueError as error:
        raise ScenarioError(str(error)) from None
    return SpaceLink(file.name, dictionary, file.link, _keys(file, folder))


def read_software(source: str | Path | Mapping | None) -> tuple[SoftwareFile, Path]:
    """A software file, and the folder to which its paths are relative."""
    if isinstance(source, Mapping):
        return validate_tables(SoftwareFile, dict(source)), Path()
    path = AS_SHIPPED if source is None else Path(source)
    return validate_tables(
        SoftwareFile, parse_toml(read_text(path, "software"), "software")
    ), path.parent


def code_in(path: Path) -> dict[str, Path]:
    """Python files that a software file names, by their keys; nothing is executed."""
    file, folder = read_software(path)
    return {f"modules.{name}.file": folder / t.file for name, t in file.modules.items() if t.file}


def digest_files(software: Path | None) -> str:
    """SHA-256 of a software file and of all files that it names."""
    found = hashlib.sha256()
    for path in list_files(software):
        found.update(hashlib.sha256(path.read_bytes()).digest())
    return found.hexdigest()


def list_files(software: Path | None) -> list[Path]:
    """The software file, as shipped for None, and all files that it names."""
    if software is None:
        return [AS_SHIPPED]
    file, folder = read_software(software)
    named = [*file.packets, *(table.file for table in file.modules.values() if table.file)]
    named += [key for key in (file.up_key, file.down_key, file.recovery_key) if key]
    if file.dictionary.endswith(".toml"):
        named.append(Path(file.dictionary))
    return [software, *(folder / path for path in named)]


def _keys(file: SoftwareFile, folder: Path) -> Keys:
    """The keys in the files; those for demonstrations without."""
    found: dict[str, Any] = {}
    for name in ("up", "down", "recovery"):
        path = getattr(file, f"{name}_key")
        if path is not None:
            try:
                found[name] = read_key(folder / path)
            except ValueError as error:
                raise ScenarioError(f"{name}_{error}") from None
    keys = Keys(**found, spacecraft=file.spacecraft)
    if len({keys.up, keys.down, keys.recovery}) < 3:
        raise ScenarioError(
            "up_key, down_key, recovery_key: must be three different keys; received one twice"
        )
    return keys


def _dictionary(file: SoftwareFile, folder: Path) -> Dictionary:
    name, extra = file.dictionary, tuple(folder / path for path in file.packets)
    try:
        return load_dictionary(folder / name if name.endswith(".toml") else name, extra)
    except ValueError as error:
        raise ScenarioError(str(error)) from None
