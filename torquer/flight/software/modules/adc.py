"""Currents and temperatures of devices: their limits, and what is done beyond them.

After SDOT App. A: the ground sets limits of temperatures and of currents for the supervisor. A
device that draws more than its limit is switched off, and stays so until the ground switches it on;
of a temperature beyond its limits the ground is told.
"""

from __future__ import annotations

from pydantic import Field, model_validator

from torquer.base.spec import Spec
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.house_keeping import Measured
from torquer.flight.software.modules.module import Module
from torquer.flight.software.modules.telemetry import DEVICES, bits
from torquer.spacecraft.house_keeping import HouseKeeping


class AdcSettings(Spec):
    """Limits of temperatures and currents."""

    temperature_min: float = -40.0
    """Least temperature [degC]."""
    temperature_max: float = 85.0
    """Greatest temperature [degC]."""
    current_max: float = Field(default=2.0, gt=0.0)
    """Greatest current of a device [A]."""
    report_s: float = Field(default=60.0, ge=0.0)
    """Time between two packets on currents and temperatures; 0: none."""
    model: HouseKeeping = HouseKeeping()
    """What currents and temperatures are simulated with: as the software file has it."""

    @model_validator(mode="after")
    def _ordered(self):
        if not self.temperature_min < self.temperature_max:
            raise ValueError(
                "temperature_min: must be less than temperature_max, "
                f"{self.temperature_max:g} degC; received {self.temperature_min:g} degC"
            )
        return self


class Adc(Module):
    """Measures currents and temperatures, and acts on their limits."""

    name = "adc"
    Settings = AdcSettings
    period_s = 10.0

    def __init__(self, settings: AdcSettings):
        super().__init__(settings)
        self.due_s = 0.0
        self.measured: Measured | None = None
        self.over: set[str] = set()
        self.beyond: set[int] = set()

    def start(self, core) -> None:
        """The first packet comes after the first period."""
        self.due_s = core.t_s + self.settings.report_s

    def step(self, core) -> None:
        """Measure, act, tell."""
        self.measured = measured = core.measure()
        self._watch_currents(core, measured.currents_a)
        self._watch_temperatures(core, measured.temperatures_c)
        if self.settings.report_s and core.t_s >= self.due_s and core.sends("housekeeping"):
            self.due_s = core.t_s + self.settings.report_s
            core.send("housekeeping", self.values(measured))

    def values(self, measured: Measured) -> tuple:
        """Values of the packet `housekeeping`."""
        settings = self.settings
        limits = settings.temperature_min, settings.temperature_max, settings.current_max
        return (
            *measured.currents_a,
            *measured.temperatures_c,
            bits(device in self.over for device in DEVICES),
            bits(number in self.beyond for number in range(1 + len(DEVICES))),
            *limits,
        )

    def status(self) -> dict[str, float]:
        """Whether a device was switched off for its current, whether a temperature is beyond."""
        return {"over": float(bool(self.over)), "beyond": float(bool(self.beyond))}

    def on_adc_limits(self, core, values) -> Reason:
        """Change the limits: they act from the next measurement on, which is now due."""
        low, high, current = values
        code = self.change(core, temperature_min=low, temperature_max=high, current_max=current)
        if code is Reason.DONE:
            self.due_s = core.t_s
        return code

    def _watch_currents(self, core, currents_a) -> None:
        """Switch off what draws too much, until the ground switches it on again."""
        for device, current_a in zip(DEVICES, currents_a, strict=True):
            if core.status(device).get("power"):
                self.over.discard(device)
            if current_a > self.settings.current_max and device in core.modules:
                self.over.add(device)
                core.power(device, False)
                core.report(self.name, Reason.OVER_CURRENT, core.dictionary.modules[device])

    def _watch_temperatures(self, core, temperatures_c) -> None:
        """Note each temperature that leaves its limits, or comes back."""
        low, high = self.settings.temperature_min, self.settings.temperature_max
        beyond = {n for n, value in enumerate(temperatures_c) if not low <= value <= high}
        modules = core.dictionary.modules
        for number in sorted(beyond - self.beyond):
            device = DEVICES[number - 1] if number else self.name
            core.report(self.name, Reason.TEMPERATURE, modules.get(device, 0))
        self.beyond = beyond
