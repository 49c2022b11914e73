"""Every device against the run: noise, bias, range, resolution, scale, mounting.

The same rules hold for all devices, by what their data sheets name.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from torquer.analysis.notes.sizes import Size, find_sizes, rate_at_start_deg_s
from torquer.analysis.notes.users import find_users
from torquer.scenario.spec import Scenario
from torquer.spacecraft.data_sheet import DataSheet

#: Part of its whole range which the noise of an instrument must not exceed.
_NOISE_OF_RANGE = 0.2
#: Relative error of scale that no calibration leaves: the factor itself may have been meant.
_WRONG_SCALE = 0.5
#: Misalignment [deg] that no mounting has.
_MISALIGNED_DEG = 20.0


class Device(NamedTuple):
    """A device of a scenario: its name, its spec, the size of what it senses (None: not known)."""

    name: str
    spec: Any
    sheet: DataSheet
    size: Size | None

    @property
    def key(self) -> str:
        """Its key in a scenario."""
        return f"spacecraft.{self.name}"

    def largest(self, what: str) -> float:
        """The largest component that it states of one of its keys; 0 for none."""
        value = self.sheet.value(self.spec, what)
        return 0.0 if value is None or not value.size else float(np.abs(value).max())

    def longest(self, what: str) -> float:
        """The longest vector that it states of one of its keys; 0 for none."""
        value = self.sheet.value(self.spec, what)
        return 0.0 if value is None else float(np.linalg.norm(np.atleast_2d(value), axis=1).max())

    def says(self, what: str, value: float) -> str:
        """Key and value in words."""
        unit = self.sheet.unit_of(what)
        return f"{self.key}.{getattr(self.sheet, what)} of {value:.6g}{' ' * bool(unit)}{unit}"


def find_devices(scenario: Scenario) -> list[Device]:
    """The devices of a scenario that have a data sheet."""
    sizes = find_sizes(scenario)
    return [
        Device(name, spec, spec.sheet, sizes.get(spec.sheet.senses))
        for name, spec in scenario.spacecraft.devices().items()
    ]


def device_notes(scenario: Scenario) -> list[str]:
    """Notes on what devices state of themselves, one line each."""
    devices = find_devices(scenario)
    by_itself = [note for device in devices for rule in _RULES for note in rule(device)]
    return [*by_itself, *_bias_notes(scenario, devices), *_limit_notes(scenario, devices)]


def _quiet_notes(device: Device) -> Iterator[str]:
    """Noise that no sensor is below is a number in another unit."""
    noise, size = device.largest("noise"), device.size
    if size is None or not 0.0 < noise < size.quietest:
        return
    unit, name = device.sheet.unit, device.sheet.name
    meant = f"tesla ({noise * 1e9:g} nT)" if unit == "nT" else "another unit"
    yield f"{device.says('noise', noise)} is below that of any {name}: is it in {meant}?"


def _noise_notes(device: Device) -> Iterator[str]:
    """Noise as large as what is read."""
    size = device.size
    for what in ("noise", "noise_about"):
        noise = device.largest(what)
        if size is None:
            full = device.largest("range")
            if full and noise > _NOISE_OF_RANGE * full:
                yield (
                    f"{device.says(what, noise)} is {noise / full:.2g} of its range of {full:g} "
                    f"{device.sheet.unit}: readings hardly show anything"
                )
        elif not size.averages and noise > size.hidden_by * size.least:
            yield (
                f"{device.says(what, noise)} is {noise / size.least:.2g} of {size.as_least}: "
                "readings hardly show its direction"
            )


def _resolution_notes(device: Device) -> Iterator[str]:
    """Steps of the readings as large as what is read: half of one is the greatest error."""
    step, size = device.largest("resolution"), device.size
    if size is not None and 0.5 * step > size.hidden_by * size.least:
        left = "readings are zero" if size.averages else "readings hardly show its direction"
        yield (
            f"{device.says('resolution', step)} is {step / size.least:.2g} of {size.as_least}: "
            f"{left}"
        )


def _range_notes(device: Device) -> Iterator[str]:
    size, sheet = device.size, device.sheet
    if size is not None and sheet.range and device.largest("range") < size.greatest:
        yield (
            f"{device.says('range', device.largest('range'))} is exceeded {size.as_greatest}: "
            "readings will saturate"
        )


def _scale_notes(device: Device) -> Iterator[str]:
    value = device.sheet.value(device.spec, "scale")
    errors = np.zeros(1) if value is None else np.ravel(value)
    worst = float(errors[np.argmax(np.abs(errors))])
    if abs(worst) > _WRONG_SCALE:
        yield (
            f"{device.says('scale', worst)} is not an error of calibration, which is below "
            f"{_WRONG_SCALE:g}: 0 is a sensor that reads right, and readings will be wrong by "
            f"{100.0 * abs(worst):.3g} %"
        )


def _mounting_notes(device: Device) -> Iterator[str]:
    """Sensors whose misalignment is not one of mounting."""
    angle = device.longest("misalignment")
    if angle > _MISALIGNED_DEG:
        yield (
            f"{device.says('misalignment', angle)} is not an error of mounting: beyond 90 deg laws "
            "that damp by this sensor may drive the rotation"
        )


#: Rules about a device and the run alone.
_RULES = (
    _quiet_notes,
    _noise_notes,
    _resolution_notes,
    _range_notes,
    _scale_notes,
    _mounting_notes,
)


def _bias_notes(scenario: Scenario, devices: list[Device]) -> Iterator[str]:
    """A bias beyond what is read, which no filter on board looks for; or beyond the range."""
    looked_for = {
        each.device
        for user in find_users(scenario)
        for each in user.spec.assumes
        if each.what == "bias" and user.states_errors
    }
    for device in devices:
        bias, size, full = device.longest("bias"), device.size, device.largest("range")
        kind = scenario.spacecraft.kind_of(device.name)
        if size is None:
            continue
        if bias > full:
            yield (
                f"{device.says('bias', bias)} exceeds the range of {full:g} {device.sheet.unit}: "
                "readings will saturate"
            )
        elif bias > max(size.least, size.greatest) and kind not in looked_for:
            yield (
                f"{device.says('bias', bias)} exceeds {size.as_least}: readings are more of the "
                "bias than of it, and nothing on board estimates it"
            )


def _limit_notes(scenario: Scenario, devices: list[Device]) -> Iterator[str]:
    """Sensors that read nothing at the initial rate, in a run without modes that wait for them."""
    if scenario.control.named().modes is not None:
        return
    rate = rate_at_start_deg_s(scenario)
    for device in devices:
        limit = device.largest("rate_limit")
        if 0.0 < limit < rate:
            yield (
                f"{device.says('rate_limit', limit)} is exceeded by the initial rate of "
                f"{rate:.3g} deg/s: it gives no readings until the rotation is slower"
            )
