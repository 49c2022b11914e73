"""The table of devices: each has its line here, and its key if a scenario describes it.

A new sensor is its file, with `DEVICE`, its measurement for filters, and these two lines. Then
`python docs/made_code.py` makes the kernels that name each device.
"""

import re
from collections import namedtuple
from typing import NamedTuple

from pydantic import Field, field_validator, model_validator

from torquer.base.spec import Spec
from torquer.spacecraft.sensors import (
    attitude_sensor,
    fine_sun_sensor,
    gyro,
    horizon_sensor,
    integrating_gyro,
    magnetometer,
    own_sensor,
    search_coil,
    sun_cells,
    sun_sensor,
    tachometers,
)
from torquer.spacecraft.sensors.attitude_sensor import AttitudeSensor
from torquer.spacecraft.sensors.device import MOST_UNITS, Device
from torquer.spacecraft.sensors.fine_sun_sensor import FineSunSensor
from torquer.spacecraft.sensors.gyro import Gyro
from torquer.spacecraft.sensors.horizon_sensor import HorizonSensor
from torquer.spacecraft.sensors.integrating_gyro import IntegratingGyro
from torquer.spacecraft.sensors.magnetometer import Magnetometer
from torquer.spacecraft.sensors.own_sensor import OwnSensor
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.search_coil import SearchCoil
from torquer.spacecraft.sensors.sun_cells import SunCells
from torquer.spacecraft.sensors.sun_sensor import SunSensors

#: Their places are their numbers, everywhere on board and in the loop.
DEVICES = (
    magnetometer.DEVICE,
    search_coil.DEVICE,
    gyro.DEVICE,
    sun_sensor.DEVICE,
    attitude_sensor.DEVICE,
    tachometers.DEVICE,
    horizon_sensor.DEVICE,
    sun_cells.DEVICE,
    integrating_gyro.DEVICE,
    fine_sun_sensor.DEVICE,
    own_sensor.DEVICE,
)

#: Most draws of random numbers for a reading; first stream of the first unit of several, each of
#: which has as many. A device that is added later has a stream beyond theirs: they keep their bits.
MOST_DRAWS = max(len(device.draws) for device in DEVICES)
FIRST_UNIT_STREAM = 16
#: Streams of random numbers for readings, from 0 on.
STREAMS = 1 + max(
    FIRST_UNIT_STREAM + MOST_DRAWS * MOST_UNITS - 1,
    *(stream for device in DEVICES for stream, _ in device.draws),
)
#: The devices of which a satellite may have several, by the keys under which it has them.
SEVERAL = {device.several: device for device in DEVICES if device.several}
_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
#: What no unit may be called: devices, and what conditions and results call otherwise.
_TAKEN = {*(device.name for device in DEVICES), *SEVERAL, "coils", "wheels"}
#: Constants of all devices for kernels.
SensorSets = namedtuple("SensorSets", [device.name for device in DEVICES if device.read])
#: The same of several, a row each, and how many there are.
UnitSets = namedtuple("UnitSets", SEVERAL)
UnitCounts = namedtuple("UnitCounts", SEVERAL)
#: No devices of which there are several.
NO_UNIT_COUNTS = UnitCounts(*(0,) * len(SEVERAL))


#: What a device needs at least.
_LEAST: dict[str, dict] = {
    "own_sensor": {"kind": "user", "file": "own.py"},
    "sun_sensors": {"axes": [[0.0, 0.0, 1.0]], "half_field_deg": 90.0},
    "fine_sun_sensor": {
        "boresight": [0.0, 0.0, 1.0],
        "up": [0.0, 1.0, 0.0],
        "half_field_deg": 60.0,
    },
}


def example_of(device: Device) -> Sampled:
    """A device as the shortest scenario describes it."""
    return device.spec.model_validate(_LEAST.get(device.name, {}))


class Flown(NamedTuple):
    """A sensor of a satellite: name, number on board, device, and what a scenario says of it."""

    name: str
    row: int
    device: Device
    spec: Sampled

    @property
    def said(self) -> str:
        """What it is called in sentences."""
        if self.name == self.device.name:
            return self.device.said
        return f"{self.device.said.removesuffix('s')} {self.name}"


#: Of two ways to give the same.
SUN_HEADS_TWICE = "sun_heads: must be left out with a list of sun_sensors; received both"


def by_name(rows) -> dict:
    """A list of tables with a `name` each, as tables by name."""
    if not rows:
        raise ValueError(": must hold a table for each of several sensors; received none")
    found: dict = {}
    for k, row in enumerate(rows):
        name = row.get("name") if isinstance(row, dict) else None
        if not isinstance(name, str):
            raise ValueError(
                f"[{k}].name: must be given, text, for each of several sensors; received "
                f"{row if name is None else name!r}"
            )
        if name in found:
            raise ValueError(
                f"[{k}].name: must differ for each of several sensors; received {name!r} again"
            )
        found[name] = {key: value for key, value in row.items() if key != "name"}
    return found


class Sensors(Spec):
    """Sensors of a satellite; those that are left out are ideal."""

    magnetometer: Magnetometer = Magnetometer()
    """Magnetometer; left out: an ideal one."""
    search_coil: SearchCoil | None = None
    """Search coil, which reads the field's rate of change; left out: an ideal one where it is used.
    """
    gyro: Gyro = Gyro()
    """Gyro; left out: an ideal one."""
    sun_sensors: SunSensors | None = None
    """Sun sensors; left out: ideal ones that see the whole sky."""
    attitude_sensor: AttitudeSensor = AttitudeSensor()
    """Attitude sensor; left out: an ideal one."""
    horizon_sensor: HorizonSensor | None = None
    """Horizon sensor; left out: an ideal one where it is used."""
    sun_cells: SunCells | None = None
    """Single Sun cells; left out: none."""
    integrating_gyro: IntegratingGyro | None = None
    """Gyro that accumulates angles; left out: none. It takes the place of the gyro."""
    fine_sun_sensor: FineSunSensor | None = None
    """Fine Sun sensor, one head; left out: none."""
    own_sensor: OwnSensor | None = None
    """Sensor of your own; left out: none."""
    magnetometers: dict[str, Magnetometer] = Field(default_factory=dict)
    """Several magnetometers by names of your choice, in place of one."""
    gyros: dict[str, Gyro] = Field(default_factory=dict)
    """Several gyros by name, in place of one."""
    star_trackers: dict[str, AttitudeSensor] = Field(default_factory=dict)
    """Several star trackers by name, in place of the attitude sensor."""
    sun_heads: dict[str, SunSensors] = Field(default_factory=dict)
    """Several Sun sensors of one axis each by name, each with a reading of its own, in place of
    `sun_sensors`. A list of tables `[[spacecraft.sun_sensors]]` is the same.
    """
    horizon_sensors: dict[str, HorizonSensor] = Field(default_factory=dict)
    """Several horizon sensors by name, in place of one."""
    integrating_gyros: dict[str, IntegratingGyro] = Field(default_factory=dict)
    """Several gyros that accumulate angles by name; they take the place of gyros."""
    fine_sun_sensors: dict[str, FineSunSensor] = Field(default_factory=dict)
    """Several fine Sun sensors by name, in place of one."""

    @model_validator(mode="before")
    @classmethod
    def _sun_sensors_in_a_list(cls, data):
        if isinstance(data, dict) and isinstance(data.get("sun_sensors"), list):
            if "sun_heads" in data:
                raise ValueError(SUN_HEADS_TWICE)
            rest = {key: value for key, value in data.items() if key != "sun_sensors"}
            try:
                return rest | {"sun_heads": by_name(data["sun_sensors"])}
            except ValueError as error:
                raise ValueError(f"sun_sensors{error}") from None
        return data

    @field_validator(*SEVERAL, mode="before")
    @classmethod
    def _by_name(cls, value):
        return by_name(value) if isinstance(value, list | tuple) else value

    @model_validator(mode="after")
    def _several_or_one(self):
        for key, device in SEVERAL.items():
            if self.describes(device.name) and getattr(self, key):
                raise ValueError(f"{device.name}: must be left out with {key}; received both")
        if (self.describes("gyro") or self.gyros) and self.integrating():
            raise ValueError("gyro: must be left out with an integrating gyro; received both")
        for name, head in self.sun_heads.items():
            if len(head.axes) != 1 or head.blind_zones:
                raise ValueError(
                    f"sun_heads.{name}: must have one axis and no blind zones, as one of several; "
                    f"received {len(head.axes)} axes, {len(head.blind_zones)} blind zones"
                )
        self._check_units()
        return self

    def describes(self, name: str) -> bool:
        """Whether a sensor is other than the one that is left out."""
        return getattr(self, name) != Sensors.model_fields[name].default

    def _check_units(self) -> None:
        """Names of units are names, unique over all kinds; there are not too many."""
        pairs, keys = [(key, name) for key in SEVERAL for name in getattr(self, key)], {}
        for key, name in pairs:
            if not _NAME.fullmatch(name) or name in _TAKEN:
                raise ValueError(
                    f"{key}: must have names of letters, digits and underscores, not that of a "
                    f"kind of device; received {name!r}"
                )
            if name in keys:
                raise ValueError(
                    f"{key}.{name}: must have a name that no other sensor has; received that of "
                    f"{keys[name]}.{name}"
                )
            keys[name] = key
        if len(keys) > MOST_UNITS:
            raise ValueError(
                f"{[*keys.values()][-1]}: must be, with all other kinds of which there are "
                f"several, at most {MOST_UNITS} sensors; received {len(keys)}"
            )

    def integrating(self) -> bool:
        """Whether gyros that accumulate angles take the place of gyros."""
        return self.integrating_gyro is not None or bool(self.integrating_gyros)

    def flown(self) -> dict[str, Flown]:
        """The sensors that a satellite has, by their keys; ideal ones that are left out, too."""
        found, row = {}, len(DEVICES)
        for number, device in enumerate(DEVICES):
            units = getattr(self, device.several) if device.several else {}
            spec = getattr(self, device.name, None)
            replaced = device.name == "gyro" and self.integrating()
            if spec is not None and not units and not replaced:
                found[device.name] = Flown(device.name, number, device, spec)
            for name, unit in units.items():
                found[f"{device.several}.{name}"] = Flown(name, row, device, unit)
                row += 1
        return found

    def standing_in(self, needs: frozenset[str]) -> list[Device]:
        """Devices that a satellite lacks, and of which an ideal one is read where it is needed."""
        has = {each.device.name for each in self.flown().values()}
        return [
            device
            for device in DEVICES
            if device.name not in has and device.stands_in and device.need in needs
        ]

    def one_of(self, name: str):
        """The device of a kind by which its readings are judged: of several the noisiest."""
        own = [each for each in self.flown().values() if each.device.name == name]
        if not own or own[0].name == name:
            return getattr(self, name)
        return max(own, key=lambda each: each.device.noise(each.spec)).spec

    def each_of(self, name: str) -> list:
        """All devices of a kind that a satellite has."""
        return [each.spec for each in self.flown().values() if each.device.name == name]

    def units(self) -> list[Flown]:
        """Devices of kinds of which there are several, in the order of their numbers."""
        return [each for each in self.flown().values() if each.row >= len(DEVICES)]

    def combined(self) -> dict[str, tuple[str, ...]]:
        """Names of the units that become one, by the kind as which laws read them."""
        found: dict[str, tuple[str, ...]] = {}
        for each in self.units():
            if each.device.combines:
                kind = each.device.kind
                found[kind] = (*found.get(kind, ()), each.name)
        return found

    def unit_kinds(self) -> tuple[int, ...]:
        """Number of the device of each unit, in the order of their numbers."""
        return tuple(DEVICES.index(each.device) for each in self.units())

    def rows(self) -> dict[str, int]:
        """Numbers on board by name, of each device and each unit."""
        own = {device.name: number for number, device in enumerate(DEVICES)}
        return own | {each.name: each.row for each in self.flown().values()}
