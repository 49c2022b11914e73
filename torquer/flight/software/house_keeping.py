"""House-keeping of the simulated satellite: what sensors of current and temperature would read.

It is no part of the processor's memory: a reboot changes nothing of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from torquer.flight.software.modules.telemetry import DEVICES
from torquer.scenario.spec import Spacecraft
from torquer.simulation.outside.flight import Flight
from torquer.spacecraft.house_keeping import (
    NO_DRAW,
    ZERO_CELSIUS_K,
    Draw,
    HouseKeeping,
    absorbed_w,
    coil_draws,
    coils_draw,
    device_warmed,
    warmed,
    wheels_draw,
)


class Measured(NamedTuple):
    """Currents [A] of `DEVICES`; temperatures [degC] of the satellite, then of them."""

    currents_a: tuple[float, ...]
    temperatures_c: tuple[float, ...]


class Analogue:
    """Currents and temperatures of a satellite in flight.

    `state`: time [s] of the temperatures, temperatures [K] as in `Measured`; to be kept and put
    back with a snapshot.
    """

    def __init__(self, flight: Flight, craft: Spacecraft, model: HouseKeeping):
        self._flight, self._model = flight, model
        self._coils = [] if craft.coils is None else coil_draws(craft.coils, model)
        self._inertia = flight.wheel_inertia_kg_m2
        volt = model.voltage_v
        self._sensors = {
            name: Draw(current_a, volt * current_a)
            for name, current_a in (
                ("gyro", model.gyro_a),
                ("mag", model.magnetometer_a),
                ("sun", model.sun_sensors_a),
            )
        }
        kelvin = model.initial_c + ZERO_CELSIUS_K
        self.state = 0.0, (kelvin,) * (1 + len(DEVICES))

    def measure(self, t_s: float, powered: Mapping[str, bool], dipole_a_m2) -> Measured:
        """What the sensors read now: temperatures follow from what has been dissipated since.

        `powered`: power switches; `dipole_a_m2`: commanded. Between two readings all devices are
        taken to draw what they draw at the second.
        """
        draws = [self._draw(name, dipole_a_m2) if powered[name] else NO_DRAW for name in DEVICES]
        self._warm(t_s, [draw.heat_w for draw in draws])
        found = tuple(kelvin - ZERO_CELSIUS_K for kelvin in self.state[1])
        return Measured(tuple(draw.current_a for draw in draws), found)

    def _draw(self, device: str, dipole_a_m2) -> Draw:
        if device == "coils":
            return coils_draw(self._coils, dipole_a_m2)
        if device == "wheels":
            return wheels_draw(self._model, self._inertia, *self._flight.wheels())
        return self._sensors[device]

    def _warm(self, t_s: float, heat_w: list[float]) -> None:
        before_s, (satellite, *own) = self.state
        model, seconds = self._model, max(t_s - before_s, 0.0)
        power_w = absorbed_w(model, *self._flight.surroundings()) + model.other_w + sum(heat_w)
        satellite = warmed(model, satellite, power_w, seconds)
        devices = [
            device_warmed(model, kelvin, satellite, each, seconds)
            for kelvin, each in zip(own, heat_w, strict=True)
        ]
        self.state = t_s, (satellite, *devices)
