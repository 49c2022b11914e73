"""The measurements of filters, from the table of devices: vectors first, single components last."""

from importlib import import_module

from torquer.computer.estimation.measurements.measured import Measured
from torquer.spacecraft.sensors.device import MOST_UNITS
from torquer.spacecraft.sensors.devices import DEVICES


def _measured() -> dict[str, Measured]:
    """Measurements by the names of their devices."""
    found = {
        device.name: import_module(f"{__package__}.{device.measurement}").MEASURED
        for device in DEVICES
        if device.measurement
    }
    return dict(sorted(found.items(), key=lambda pair: pair[1].channels > 1))


#: Measurements by the keys of the devices, in the order of a filter's channels.
MEASURED = _measured()
#: The same by what filters call them.
BY_NAME = {measured.name: measured for measured in MEASURED.values()}
#: The devices that they measure with.
DEVICE_OF = {
    measured.name: device
    for device in DEVICES
    for name, measured in MEASURED.items()
    if device.name == name
}
#: First channel of each, by what filters call it.
CHANNEL_OF: dict[str, int] = {}
for _name, _each in BY_NAME.items():
    CHANNEL_OF[_name] = sum(BY_NAME[before].channels for before in CHANNEL_OF)
#: Number of channels of kinds whose readings are vectors, and of all.
VECTORS = sum(each.channels == 1 for each in MEASURED.values())
#: First channel of several devices of a kind, one each.
UNITS_AT = sum(each.channels for each in MEASURED.values())
CHANNELS = UNITS_AT + MOST_UNITS
#: Channels whose readings are vectors, which are watched.
WATCHERS = VECTORS + MOST_UNITS
#: Numbers of the constants of one of several: its kind's channel, its own.
UNIT_NUMBERS = 11
FIELD_CHANNEL, STAR_CHANNEL = CHANNEL_OF["magnetometer"], CHANNEL_OF["star_tracker"]
#: Channel from which on measurements are single components; the first one stands for all of its
#: device where directions are asked for.
FIRST_CELL = VECTORS
#: How many directions a channel stands for where sensors are compared.
DIRECTIONS = tuple(each.directions for each in MEASURED.values() for _ in range(each.channels))
#: Labels of the channels.
LABELS = tuple(
    each.name if each.channels == 1 else f"{each.name.removesuffix('s')}_{part}"
    for each in MEASURED.values()
    for part in range(each.channels)
)
