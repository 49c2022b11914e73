"""What a module of the flight software is.

After SDOT App. A: own number, start and stop, own loop and rate, settings from a configuration
file, state, error log, dispatcher of commands. A state is plain attributes that can be copied: no
reference to the core, no generators, no threads.
"""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import ValidationError

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.services import Services, save_settings


class NoSettings(Spec):
    """Settings of a module that has none."""


class Module:
    """Base of all modules: settings, commands and status; a module adds its `step`.

    `name`: as in the dictionary's modules; `Settings`: spec of what commands may change and the
    non-volatile memory keeps; `period_s`: time between two steps. A method `on_NAME(core, values)`
    for each uplink packet of the module returns a reason code, 0 for done. `step` runs once in
    each period. `core` is what a module sees of the rest of the software (`Services`).
    """

    name: ClassVar[str]
    Settings: ClassVar[type[Spec]] = NoSettings
    period_s: ClassVar[float] = 1.0

    def __init__(self, settings: Any):
        self.settings = settings

    def start(self, core: Services) -> None:
        """Begin, at boot or by command: what the module needs of memory and computer."""

    def step(self, core: Services) -> None:
        """The module's own work."""

    def stop(self, core: Services) -> None:
        """End by command: give back what the module has taken over."""

    def status(self) -> dict[str, float]:
        """What telemetry reports of the module: numbers by name."""
        return {}

    def change(self, core: Services, **settings: Any) -> Reason:
        """Change settings and keep them in the non-volatile memory; VALUE if they do not fit."""
        try:
            self.settings = self.settings.model_copy(update=settings)
        except ValidationError:
            return Reason.VALUE
        return save_settings(core.memory, self.name, self.settings)
