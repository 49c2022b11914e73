"""The sensors that a Kalman filter uses, and their noise as it believes it: keys of its spec."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from torquer.base.spec import Spec, unit_vector
from torquer.computer.estimation.measurements.measurement import SENSOR_OF, VECTORS
from torquer.computer.interface import SENSORS
from torquer.spacecraft.failures import in_words
from torquer.spacecraft.sensors.sun_cells import CELLS, Normals

#: Key of each sensor's noise, in the order of the filter's channels.
NOISE_KEYS = {sensor: f"{sensor}_noise_deg" for sensor in SENSOR_OF} | {
    "magnetometer": "magnetometer_noise_nt",
    "sun_cells": "cell_noise",
}
#: What they are called in text.
SENSOR_WORDS = {name: in_words(SENSORS[number]) for name, number in SENSOR_OF.items()} | {
    "star_tracker": "star tracker"
}
#: Labels of the filter's channels.
SENSOR_LABELS = (*tuple(SENSOR_OF)[:VECTORS], *(f"sun_cell_{k}" for k in range(CELLS)))


class SensorKeys(Spec):
    """Sensors of a filter, and their noise as the filter believes it."""

    sensors: tuple[Literal["magnetometer", "sun", "star_tracker", "horizon", "sun_cells"], ...] = (
        "magnetometer",
        "sun",
    )
    """Sensors that the filter uses; the star tracker is the attitude sensor."""
    magnetometer_noise_nt: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation of each component of a magnetometer reading, errors of the field model
    included; given if the filter uses the magnetometer.
    """
    sun_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of each component of a Sun reading; given if the filter uses Sun sensors.
    """
    star_tracker_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of a reading of the star tracker about each axis across its boresight;
    given if the filter uses it.
    """
    star_tracker_boresight_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of a reading of the star tracker about its boresight; left out: the same
    as across it.
    """
    star_tracker_boresight: unit_vector("boresight") | None = None
    """Boresight of the star tracker in the body; given with its noise about it."""
    horizon_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of each component of a reading of the horizon sensor, that of the horizon
    included; given if the filter uses it.
    """
    cell_noise: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Standard deviation of the signal of a Sun cell, in parts of full sunlight, errors of its
    scale included; given if the filter uses Sun cells.
    """
    cell_normals: Normals | None = None
    """Normals of the Sun cells in the body, at most six; given if the filter uses them."""
    cell_half_field_deg: float = Field(default=90.0, gt=0.0, le=90.0)
    """Angle from its normal up to which a Sun cell is used."""
    cell_albedo: float = Field(default=0.0, ge=0.0, le=1.0)
    """Albedo of the Earth by which its light is taken off the signals of Sun cells; 0: it is not.
    """
    cell_albedo_error: float = Field(default=0.0, ge=0.0)
    """Relative standard deviation of the Earth's light on a Sun cell, by which its signal is
    trusted less.
    """

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
    def _parts_of_sensors(self):
        about = (self.star_tracker_boresight_noise_deg, self.star_tracker_boresight)
        used = "star_tracker" in self.sensors
        if (about[0] is None) != (about[1] is None) or (about[0] is not None and not used):
            raise ValueError(
                "star_tracker_boresight_noise_deg, star_tracker_boresight: must be given together, "
                f"with the star tracker among the sensors; received {about[0]}, {about[1]}"
            )
        if (self.cell_normals is not None) != ("sun_cells" in self.sensors):
            received = "none" if self.cell_normals is None else f"{len(self.cell_normals)}"
            must = "given" if self.cell_normals is None else "left out"
            raise ValueError(
                f"cell_normals: must be {must} with sensors = {list(self.sensors)}; "
                f"received {received}"
            )
        return self

    def cells(self) -> tuple[tuple[float, float, float, float], ...]:
        """Normal and cosine of the half field of each Sun cell; 2 where there is none."""
        cosine, normals = math.cos(math.radians(self.cell_half_field_deg)), self.cell_normals or ()
        missing = ((0.0, 0.0, 1.0, 2.0),) * (CELLS - len(normals))
        return (*((*normal, cosine) for normal in normals), *missing)

    def after_last(self) -> int:
        """The number after that of the last sensor used."""
        if "sun_cells" in self.sensors:
            return VECTORS + len(self.cell_normals or ())
        return 1 + max(list(NOISE_KEYS).index(sensor) for sensor in self.sensors)
