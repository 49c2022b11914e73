"""Numbers of an examination: a row each, from which text, JSON, pages and notebooks are made."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from torquer.ground.telemetry.calibration import GROUPS, Calibration, Choice
from torquer.ground.telemetry.twin_found import Twin

#: Head of a table of parameters, of the calibration or the twin; of one of compared models.
PARAMETER_HEAD = ("parameter", "value", "sigma", "unit")
CHOICE_HEAD = ("model up to", "fitted rms", "held-out rms")
#: Units in which people see parameters, and the factor from SI.
_UNITS = {"T": ("nT", 1e9), "1": ("%", 100.0), "rad": ("deg", 180.0 / math.pi), "s": ("s", 1.0),
          "T/(A m^2)": ("nT/(A m^2)", 1e9), "T/K": ("nT/K", 1e9)}  # fmt: skip
#: Units of a twin's parameters by the beginning of the name.
_TWIN_UNITS = {"inertia": "kg m^2", "dipole": "A m^2"}


class Row(NamedTuple):
    """A number: for programs `value` and its standard deviation `sigma` in SI, by `key`; for people
    both times `factor`, in `unit`, under `label`."""

    key: str
    label: str
    value: float | int | str
    unit: str = ""
    sigma: float | None = None
    factor: float = 1.0

    @property
    def texts(self) -> tuple[str, str, str, str]:
        """Label, value, standard deviation and unit for people; "" for what it lacks."""
        if self.sigma is None:
            value = f"{self.value:.4g}" if isinstance(self.value, float) else str(self.value)
            return self.label, value, "", self.unit
        value, sigma = with_error(self.factor * float(self.value), self.factor * self.sigma)
        return self.label, value, sigma, self.unit


def calibration_rows(calibration: Calibration | None) -> list[Row]:
    """Parameters of a calibration."""
    return [] if calibration is None else list(_parameters(calibration))


def _parameters(calibration: Calibration) -> Iterator[Row]:
    for group in calibration.groups:
        unit, factor = _UNITS[GROUPS[group].unit]
        for name in GROUPS[group].names:
            sigma = float(calibration.sigmas[name])
            yield Row(name, name, calibration.of(name), unit, sigma, factor)


def twin_rows(twin: Twin | None) -> list[Row]:
    """Parameters of a twin; those over the gain in SI."""
    if twin is None:
        return []
    sigmas = twin.sigmas
    return [Row(name, name, twin.of(name), _unit(name), sigmas[name]) for name in twin.names]


def _unit(name: str) -> str:
    if name.endswith("/gain"):
        return ""
    return next((unit for key, unit in _TWIN_UNITS.items() if name.startswith(key)), "")


def choice_rows(choices: tuple[Choice, ...]) -> list[tuple[str, str, str]]:
    """The models that were compared, as texts under `CHOICE_HEAD`."""
    return [
        (each.groups[-1], f"{1e9 * each.fitted:.0f} nT", f"{1e9 * each.held_out:.0f} nT")
        for each in choices
    ]


def with_error(value: float, sigma: float) -> tuple[str, str]:
    """A number and its standard deviation, to two digits of the latter or to whole numbers."""
    places = 1 - math.floor(math.log10(max(sigma, 1e-12)))
    if -3 < places <= 6:
        return f"{value:.{max(places, 0)}f}", f"{sigma:.{max(places, 0)}f}"
    digits = math.floor(math.log10(abs(value) or sigma)) + places
    return f"{value:.{max(digits, 0)}e}", f"{sigma:.1e}"
