"""Who on board assumes something of devices: estimators, laws, checks of modes."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from torquer.scenario.control import Control
from torquer.scenario.spec import Scenario
from torquer.spacecraft.data_sheet import Assumed, DataSheet


class User(NamedTuple):
    """A part of the computer with keys about devices (`assumes`): its key, and its spec.

    `states_errors`: whether it estimates, and states how well; else it checks sensors.
    """

    key: str
    spec: Any
    states_errors: bool

    def value(self, assumed: Assumed) -> float:
        """The number at a key."""
        return float(getattr(self.spec, assumed.key))

    def says(self, assumed: Assumed, unit: str) -> str:
        """Key and value in words."""
        return f"{self.key}.{assumed.key} of {self.value(assumed):g}{' ' * bool(unit)}{unit}"


def find_users(scenario: Scenario) -> list[User]:
    """All that assume something of devices."""
    return [
        User(key, spec, hasattr(spec, "gives"))
        for key, spec in parts_on_board(scenario.control)
        if hasattr(spec, "assumes")
    ]


def estimators_at_start(control: Control) -> set[str]:
    """Keys of the estimators that work in the initial states."""
    modes = control.named().modes
    regions = modes.regions.values() if modes is not None else ()
    chosen = {region.states[region.initial].estimator for region in regions} - {None}
    names = chosen or {"estimator"}
    return {f"control.{'' if each == 'estimator' else 'estimators.'}{each}" for each in names}


def parts_on_board(control: Control) -> Iterator[tuple[str, Any]]:
    """Estimators, laws, mode table and its noise, with their keys."""
    yield "control.estimator", control.estimator
    for name, estimator in control.estimators.items():
        yield f"control.estimators.{name}", estimator
    if control.law is not None:
        yield "control.law", control.law
    for name, law in control.laws.items():
        yield f"control.laws.{name}", law
    if control.modes is not None:
        yield "control.modes", control.modes
        yield "control.modes.noise", control.modes.noise


class Pair(NamedTuple):
    """A key of a user about a device that the satellite has; the device with its own key."""

    user: User
    assumed: Assumed
    key: str
    device: Any
    scenario: Scenario

    @property
    def sheet(self) -> DataSheet:
        """What the keys of the device are."""
        return self.device.sheet

    @property
    def name(self) -> str:
        """Name of one of several devices of a kind, whose axes the user takes from it; else ''."""
        return self.key.partition(".")[2]

    @property
    def stated(self) -> float:
        """The number that the user assumes."""
        own = self._own_noise()
        return self.user.value(self.assumed) if own is None else own

    def says(self, unit: str) -> str:
        """The user's key and value in words."""
        if self._own_noise() is None:
            return self.user.says(self.assumed, unit)
        return f"{self.user.key}.unit_noise.{self.name} of {self.stated:g}{' ' * bool(unit)}{unit}"

    def _own_noise(self) -> float | None:
        """What the user says of the noise of one of several devices; None where it does not."""
        own = getattr(self.user.spec, "unit_noise", {})
        known = self.assumed.what == "noise" and self.name in own
        return float(own[self.name]) if known else None

    def of_device(self, what: str) -> np.ndarray | None:
        """What the device says of itself."""
        return self.sheet.value(self.device, what)

    def key_of_device(self, what: str) -> str:
        """The key at which it says so."""
        return f"spacecraft.{self.key}.{getattr(self.sheet, what)}"


def find_pairs(scenario: Scenario) -> list[Pair]:
    """All that is assumed of devices which the satellite has: others are ideal, or not there."""
    return [
        Pair(user, assumed, key, device, scenario)
        for user in find_users(scenario)
        for assumed in user.spec.assumes
        for key, device in scenario.spacecraft.of_kind(assumed.device).items()
    ]
