"""Flight software from a software file: its modules are found, checked, made ready to start."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from torquer.base.explain import ScenarioError, explain
from torquer.base.spec import Spec
from torquer.flight.packets.dictionary import Dictionary
from torquer.flight.packets.software_file import (
    ModuleTable,
    SoftwareFile,
    SpaceLink,
    make_link,
    read_software,
)
from torquer.flight.software.containment import brief
from torquer.flight.software.modules import MODULES
from torquer.flight.software.modules.module import Module
from torquer.flight.software.strikes import REQUIRED

#: The longest period of a module [s].
_LONGEST_S = 1e10


class Installed(NamedTuple):
    """A module ready to be started: its class, period [s], default settings, whether it starts."""

    make: type[Module]
    period_s: float
    settings: Spec
    on: bool


@dataclass(frozen=True)
class Software(SpaceLink):
    """Flight software that has been checked; `modules` in the order of their steps."""

    modules: dict[str, Installed]


def load_software(source: str | Path | Mapping | None = None) -> Software:
    """The software of a TOML file, or of its tables as data; None: that of Chibis-M as shipped.

    Paths in it are relative to the file. `ScenarioError` with one line for each mistake.
    """
    file, folder = read_software(source)
    if file.link == "space_packets":
        raise ScenarioError(
            "link: must be historical, protected or pus for software that flies; "
            "received 'space_packets'"
        )
    link = make_link(file, folder)
    classes = _classes(file, folder)
    installed = {}
    for name, make in classes.items():
        table = file.modules.get(name, ModuleTable())
        settings = _settings(name, make, table.settings)
        installed[name] = Installed(make, table.period_s or make.period_s, settings, table.on)
    faults = list(_faults(link.dictionary, installed))
    if faults:
        raise ScenarioError("\n".join(faults))
    return Software(link.name, link.dictionary, link.link, link.keys, installed)


def _classes(file: SoftwareFile, folder: Path) -> dict[str, type[Module]]:
    """Classes of all modules in the order of their steps; the user's own before telemetry."""
    wanted = {name for name in MODULES if name in REQUIRED or name in file.modules}
    own = {}
    for name, table in file.modules.items():
        if table.class_name is not None and table.file is None:
            raise ScenarioError(f"modules.{name}.file: must be given with a class; received none")
        if table.file is not None:
            own[name] = _own_class(name, table, folder)
        elif name not in MODULES:
            known = ", ".join(MODULES)
            raise ScenarioError(
                f"modules.{name}: must be one of {known}, or have a file; received no file"
            )
    ordered: dict[str, type[Module]] = {}
    for name, make in MODULES.items():
        if name == "tm":
            ordered |= {each: made for each, made in own.items() if each not in MODULES}
        if name in wanted:
            ordered[name] = own.get(name, make)
    return ordered


def _own_class(name: str, table: ModuleTable, folder: Path) -> type[Module]:
    """The class of a module in the user's file."""
    path = (folder / table.file).resolve() if table.file is not None else folder
    key = f"modules.{name}"
    if table.class_name is None:
        raise ScenarioError(f"{key}.class: must be given with a file; received nothing")
    if not path.is_file():
        raise ScenarioError(f"{key}.file: must be a Python file; received {table.file}")
    found = getattr(_load_module(key, path), table.class_name, None)
    if not isinstance(found, type) or not issubclass(found, Module):
        raise ScenarioError(
            f"{key}.class: must be a class of {path.name} derived from "
            "torquer.flight.software.Module; "
            f"received {table.class_name!r}"
        )
    if getattr(found, "name", None) != name:
        raise ScenarioError(
            f"{key}.class: must have name = {name!r}; received {getattr(found, 'name', None)!r}"
        )
    if not isinstance(found.Settings, type) or not issubclass(found.Settings, Spec):
        raise ScenarioError(
            f"{key}.class: must have Settings derived from torquer.base.spec.Spec; received "
            f"{found.Settings!r}"
        )
    period_s: Any = found.period_s
    if not isinstance(period_s, int | float) or not 0.0 < period_s <= _LONGEST_S:
        raise ScenarioError(
            f"{key}.class: must have a period_s above 0 and of at most {_LONGEST_S:g} s; received "
            f"{period_s!r}"
        )
    return found


def _load_module(key: str, path: Path):
    """The Python file as a module."""
    spec = importlib.util.spec_from_file_location(f"torquer_onboard_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ScenarioError(f"{key}.file: must be a Python file; received {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException as error:
        raise ScenarioError(f"{key}.file: must be importable; received {brief(error)}") from None
    return module


def _settings(name: str, make: type[Module], given: dict) -> Spec:
    """The settings of a module in place of its defaults."""
    try:
        return make.Settings.model_validate(given)
    except ValidationError as error:
        where = f"modules.{name}.settings"
        lines = [f"{where}.{line}" for line in explain(error, given, make.Settings)]
        raise ScenarioError("\n".join(lines)) from None


def _faults(dictionary: Dictionary, installed: Mapping[str, Installed]) -> Iterator[str]:
    """What of modules and packets does not fit together, a line each."""
    for name, one in installed.items():
        try:
            one.make(one.settings)
        except BaseException as error:
            yield (
                f"modules.{name}: must be made from its settings without an error; received "
                f"{brief(error)}"
            )
        if name not in dictionary.modules:
            yield f"modules.{name}: must be a module of the dictionary; received {name!r}"
        for command, packet in dictionary.up.items():
            has_method = callable(getattr(one.make, f"on_{command}", None))
            if packet.module == name and not has_method:
                yield (
                    f"modules.{name}: must have a method on_{command} for the packet {command}; "
                    f"received {one.make.__name__} without it"
                )
