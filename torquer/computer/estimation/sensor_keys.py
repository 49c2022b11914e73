"""The sensors that a Kalman filter uses, and their noise as it believes it: keys of its spec."""

from typing import TYPE_CHECKING, Any, Literal

from pydantic import model_validator

from torquer.base.spec import Spec
from torquer.computer.estimation.measurements.table import BY_NAME, CHANNEL_OF, DEVICE_OF, LABELS
from torquer.spacecraft.data_sheet import Assumed

#: Key of each sensor's noise, in the order of the filter's channels.
NOISE_KEYS = {name: measured.noise for name, measured in BY_NAME.items()}
#: What they are called in text.
SENSOR_WORDS = {name: measured.said for name, measured in BY_NAME.items()}
#: Labels of the filter's channels.
SENSOR_LABELS = LABELS
if TYPE_CHECKING:  # keys of all measurements
    OwnKeys: Any = Spec
    SensorName = str
else:
    OwnKeys = type("OwnKeys", tuple(each.keys for each in reversed(BY_NAME.values())), {})
    SensorName = Literal[tuple(BY_NAME)]


class SensorKeys(OwnKeys):
    """Sensors of a filter, and their noise as the filter believes it."""

    sensors: tuple[SensorName, ...] = ("magnetometer", "sun")
    """Sensors that the filter uses; the star tracker is the attitude sensor."""

    @property
    def assumes(self) -> tuple[Assumed, ...]:
        """What the keys say of the sensors used."""
        found = []
        for sensor in self.sensors:
            measured, device = BY_NAME[sensor], DEVICE_OF[sensor].name
            found.append(Assumed(measured.noise, device, "noise"))
            for what, key in measured.says.items():
                if what == "noise_about" and getattr(self, key) is None:
                    key = measured.noise
                found.append(Assumed(key, device, what))
        return tuple(each for each in found if getattr(self, each.key) is not None)

    @model_validator(mode="after")
    def _noise_of_each_sensor(self):
        if not self.sensors or len(set(self.sensors)) < len(self.sensors):
            raise ValueError(
                f"sensors: must name one or more different sensors; received {list(self.sensors)}"
            )
        for sensor, key in NOISE_KEYS.items():
            value = getattr(self, key)
            if (value is None) == (sensor in self.sensors):
                must = "given" if value is None else "left out"
                received = "none" if value is None else f"{value:g}"
                raise ValueError(
                    f"{key}: must be {must} with sensors = {list(self.sensors)}; "
                    f"received {received}"
                )
        return self

    @model_validator(mode="after")
    def _keys_of_a_sensor_hold_together(self):
        for measured in BY_NAME.values():
            measured.check(self)
        return self

    def after_last(self) -> int:
        """The number after that of the last channel used."""
        last = max(self.sensors, key=list(CHANNEL_OF).index)
        return CHANNEL_OF[last] + BY_NAME[last].parts(self)
