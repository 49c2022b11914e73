"""What a module of the flight software is.

After SDOT App. A: own number, start and stop, own loop and rate, settings from a configuration
file, state, error log, dispatcher of commands. A state is plain attributes that can be copied: no
reference to the core, no generators, no threads.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

from torquer.base.explain import ScenarioError
from torquer.base.spec import Spec
from torquer.environment.chosen_models import NoSuchModel
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.services import Computer, Services, save_settings


class NoSettings(Spec):
    """Settings of a module that has none."""


class Module:
    """Base of all modules: settings, commands and status; a module adds its `step`.

    `name`: as in the dictionary's modules; `device`: what it drives, by its name in the scenario:
    without it the module takes no commands; `Settings`: spec of what commands may change and the
    non-volatile memory keeps; `period_s`: time between two steps. A method `on_NAME(core, values)`
    for each uplink packet of the module returns a reason code, 0 for done. `step` runs once in
    each period. `core` is what a module sees of the rest of the software (`Services`).
    """

    name: ClassVar[str]
    device: ClassVar[str] = ""
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

    def in_force(self, core: Services) -> Iterable[tuple[str, tuple]]:
        """Packets (name, values) on what the ground has set, sent with the status on request."""
        return ()

    def take_up(self, core: Services) -> Reason:
        """Act on settings that have been changed; another answer than DONE: they do not hold."""
        return Reason.DONE

    def change(self, core: Services, **settings: Any) -> Reason:
        """Change settings and keep them in the non-volatile memory; VALUE if they do not fit."""
        before = self.settings
        try:
            self.settings = self.settings.model_copy(update=settings)
        except ScenarioError:
            return Reason.VALUE
        code = self.take_up(core)
        if code is not Reason.DONE:
            self.settings = before
            return code
        return save_settings(core.memory, self.name, self.settings)


class Supplier(Module):
    """A module with data of the ground for the compiled computer.

    It hands them over when it starts, and when they change: from then on they are in use.
    """

    @property
    def supplies(self) -> bool:
        """Whether there is anything that the computer has not had from the beginning."""
        return False

    def supply(self, computer: Computer) -> None:
        """Give the computer what there is; `NoSuchModel` or another ValueError for what it
        refuses, and then nothing has changed."""

    def start(self, core: Services) -> None:
        """Hand over what the memory has kept; an event if the computer refuses it."""
        code = self.take_up(core) if self.supplies else Reason.DONE
        if code is not Reason.DONE:
            core.report(self.name, code)

    def take_up(self, core: Services) -> Reason:
        """NOT_AVAILABLE for what the computer lacks, VALUE for what cannot be."""
        try:
            self.supply(core.computer)
        except NoSuchModel:
            return Reason.NOT_AVAILABLE
        except ValueError:
            return Reason.VALUE
        return Reason.DONE
