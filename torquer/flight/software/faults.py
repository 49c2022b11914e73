"""Faults during a flight, from a file: of devices, of modules, of the memory; and reboots.

[[faults]]
at_s = 600
fault = "gyro stuck"       # a device, as `torquer faults` names them

[[faults]]
tick = 7200                # control step
fault = "reboot"
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import Field, model_validator

from torquer.base.explain import ScenarioError, validate_tables
from torquer.base.spec import Spec
from torquer.campaign.faults.kinds import find_faults
from torquer.flight.software.memory import unseal
from torquer.flight.software.state import Cause
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import parse_toml, read_text

if TYPE_CHECKING:
    from torquer.flight.software.core import Core

#: Faults of the software: what each is, in words.
OF_SOFTWARE = {
    "reboot": "the power fails for a moment",
    "module stops": "a module makes no step any more",
    "module fails": "each step of a module ends with an error",
    "file damaged": "one bit of a file of the memory is wrong",
    "file lost": "a file of the memory is gone",
}


class SoftwareFault(Spec):
    """A fault, and when it strikes."""

    at_s: float | None = Field(default=None, ge=0.0)
    """Time of the run from which it acts."""
    tick: int | None = Field(default=None, ge=0)
    """Number of the control step before which it strikes, in place of `at_s`."""
    fault: str
    """What fails, such as "gyro stuck", "reboot", "module stops"."""
    module: str | None = None
    """Module that stops or fails."""
    file: str | None = None
    """File of the memory that is damaged or lost."""
    place: str = "main"
    """Copy of the file: 'main', 'reserve' or 'both'."""

    @model_validator(mode="after")
    def _is_complete(self):
        if (self.at_s is None) == (self.tick is None):
            received = "none" if self.at_s is None else "both"
            raise ValueError(f"at_s, tick: one of the two must be given; received {received}")
        if self.place not in ("main", "reserve", "both"):
            raise ValueError(f"place: must be 'main', 'reserve' or 'both'; received {self.place!r}")
        for key in ("module", "file"):
            if self.fault.startswith(key) != (getattr(self, key) is not None):
                must = "must" if self.fault.startswith(key) else "must not"
                raise ValueError(f"{key}: {must} be given for {self.fault!r}")
        return self


class FaultsFile(Spec):
    """A file of faults."""

    faults: tuple[SoftwareFault, ...] = ()
    """Faults, in any order."""


def load_faults(path: Path) -> FaultsFile:
    """The faults of a TOML file; `ScenarioError` with one line for each mistake."""
    return validate_tables(FaultsFile, parse_toml(read_text(path, "faults"), "faults"))


def with_device_faults(scenario: Scenario, file: FaultsFile) -> Scenario:
    """The scenario with the faults of its devices; `ScenarioError` for an unknown one."""
    known = {fault.name: fault for fault in find_faults(scenario)}
    for i, one in enumerate(file.faults):
        if one.fault in OF_SOFTWARE:
            continue
        if one.fault not in known:
            names = ", ".join([*OF_SOFTWARE, *known])
            raise ScenarioError(
                f"faults[{i}].fault: must be one of {names}; received {one.fault!r}"
            )
        if one.at_s is None:
            raise ScenarioError(f"faults[{i}].at_s: must be given for a device; received a tick")
        scenario = known[one.fault].strikes(scenario, one.at_s)
    return scenario


def check_faults(file: FaultsFile, modules: Collection[str]) -> None:
    """`ScenarioError` for a fault of a module that does not fly; `modules`: those that do."""
    for i, one in enumerate(file.faults):
        if one.module is not None and one.module not in modules:
            raise ScenarioError(
                f"faults[{i}].module: must be one of {', '.join(modules)}; received {one.module!r}"
            )


def software_faults(file: FaultsFile) -> list[SoftwareFault]:
    """The faults that the software suffers."""
    return [one for one in file.faults if one.fault in OF_SOFTWARE]


def strike(core: Core, fault: SoftwareFault) -> None:
    """Let a fault of the software happen now."""
    if fault.fault == "reboot":
        core.reboot(Cause.FAULT)
    elif fault.module is not None:
        _strike_module(core, fault)
    else:
        places = ("main", "reserve") if fault.place == "both" else (fault.place,)
        for place in places:
            _strike_file(core.memory.places[place], str(fault.file), fault.fault)


def _strike_module(core: Core, fault: SoftwareFault) -> None:
    slot = core.state.slots.get(str(fault.module))
    if slot is None:  # it is booting: there is no module yet
        return
    if fault.fault == "module stops":
        slot.due_ms = NEVER_MS
    else:
        slot.module.step = _fails  # type: ignore[method-assign]


#: Beyond the end of any run [ms].
NEVER_MS = 1 << 62


def _fails(core) -> None:
    raise RuntimeError("a fault from a file")


def _strike_file(files, name: str, kind: str) -> None:
    content = files.get(name)
    if content is None:
        return
    if kind == "file lost":
        del files[name]
    elif unseal(name, content) is not None:
        files[name] = content[:-1] + bytes([content[-1] ^ 1])
