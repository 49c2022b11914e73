"""Several devices of a kind: constants for the loop, and how the computer makes one of them."""

import numpy as np

from torquer.base.shared import of_all, shared
from torquer.computer.blocks.adapter import flat
from torquer.computer.interface import GYRO, ROWS
from torquer.computer.selection import (
    ANGLES,
    ATTITUDE,
    DIRECTION,
    HOW,
    NO_SELECTION,
    SELECTED,
    SOURCE,
    VECTOR,
    Selection,
    SelectionSpec,
    silent_after_s,
    stuck_after_s,
)
from torquer.scenario.spec import Scenario, Spacecraft
from torquer.spacecraft.failures import TURNS_ATTITUDE, TURNS_DIRECTION
from torquer.spacecraft.sensors.device import MOST_UNITS, Device
from torquer.spacecraft.sensors.devices import DEVICES, SEVERAL, Flown, example_of

_FORMS = {TURNS_DIRECTION: DIRECTION, TURNS_ATTITUDE: ATTITUDE}
#: Noise of a device that has none, over the least of the others.
_NEXT_TO_NONE = 0.1


@shared
def unit_rows(craft: Spacecraft, device: Device) -> np.ndarray:
    """Constants of several devices of a kind, a row each; as many rows as there may be.

    Without any there are none: what is compiled for lanes depends on it.
    """
    rows = [flat(device.to_unit(spec)) for spec in getattr(craft, device.several).values()]
    width = _unit_width(device.several)
    found = np.zeros((MOST_UNITS if rows else 0, width))
    found[: len(rows)] = np.reshape(rows, (len(rows), width))
    return found


@of_all
def _unit_width(key: str) -> int:
    device = SEVERAL[key]
    return len(flat(device.to_unit(example_of(device))))


@shared
def make_selection(scenario: Scenario, oldest_s: tuple[float, ...]) -> Selection:
    """How the computer makes one of several devices; `oldest_s`: how old readings become."""
    flown = list(scenario.spacecraft.flown().values())
    kinds, sources = [], np.zeros(ROWS, SOURCE)
    for number, device in enumerate(DEVICES):
        own = [each for each in flown if each.device is device]
        is_kind = len(own) > 0 and (own[0].row != number or device.integrates)
        if not (is_kind and device.combines):
            continue
        sensor = GYRO if device.integrates else number
        spec = scenario.control.select.get(DEVICES[sensor].name, SelectionSpec())
        form = ANGLES if device.integrates else _FORMS.get(device.turns, VECTOR)
        kinds.append(
            (sensor, own[0].row, len(own), HOW[spec.kind], form, device.count, spec.warm_up_s)
        )
        for each, row in zip(own, _sources(own, oldest_s), strict=True):
            sources[each.row] = row
    return Selection(np.array(kinds, SELECTED), sources) if kinds else NO_SELECTION


def _sources(flown: list[Flown], oldest_s: tuple[float, ...]) -> list[tuple[float, float, float]]:
    """Weight, times after which it is silent and stuck, of each of several."""
    noise = np.array([each.device.noise(each.spec) for each in flown])
    least = noise[noise > 0.0].min() if noise.any() else 1.0
    sizes = np.maximum(noise / least, _NEXT_TO_NONE if noise.any() else 1.0)
    return [
        (
            size**-2.0,
            silent_after_s(oldest_s[each.row]),
            stuck_after_s(oldest_s[each.row], each.device.may_repeat(each.spec)),
        )
        for each, size in zip(flown, sizes, strict=True)
    ]
