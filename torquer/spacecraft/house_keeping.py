"""Electrical currents of devices, and temperatures: a node for the satellite, one for each device.

The satellite is a grey body in the Sun's light (a sphere's cross-section, a quarter of its surface)
and the Earth's infrared radiation, without reflected light; it radiates into space. A device is
warmer than the satellite by its dissipation times a thermal resistance, and follows with a lag.

Currents: of coils by their dipole, of wheels by torque and speed, of sensors a constant.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.spec import Spec
from torquer.compile.engine import kernel
from torquer.environment.sun import sunlit_fraction_at
from torquer.environment.table import lookup3
from torquer.maths.geometry.vec3 import as_vector, norm
from torquer.spacecraft.actuators.coils import Coils

ZERO_CELSIUS_K = 273.15
#: Stefan-Boltzmann constant [W/(m^2 K^4)].
STEFAN_BOLTZMANN = 5.670374419e-8
#: Sun's light at 1 AU [W/m^2]: Kopp and Lean 2011.
SUNLIGHT_W_M2 = 1361.0
#: Infrared radiation of the Earth at its surface [W/m^2], a mean: Gilmore, Spacecraft Thermal
#: Control Handbook, 2002.
EARTH_INFRARED_W_M2 = 237.0

_Positive = Annotated[float, Field(gt=0.0)]
_Share = Annotated[float, Field(gt=0.0, le=1.0)]


class HouseKeeping(Spec):
    """What currents and temperatures of a satellite follow from. Defaults: of Chibis-M's size,
    chosen; currents of magnetometer and gyro are typical ones of the data sheets of HMR2300 and
    ADIS16130."""

    voltage_v: _Positive = 12.0
    """Supply of all devices."""
    coil_w: _Positive = 1.0
    """Power of a coil at its limit where the scenario states none."""
    wheel_w: Annotated[float, Field(ge=0.0)] = 0.3
    """Power of a wheel that does nothing."""
    wheel_efficiency: _Share = 0.7
    """Mechanical over electrical power of a wheel."""
    gyro_a: Annotated[float, Field(ge=0.0)] = 0.073
    """Current of the gyros."""
    magnetometer_a: Annotated[float, Field(ge=0.0)] = 0.027
    """Current of the magnetometer."""
    sun_sensors_a: Annotated[float, Field(ge=0.0)] = 0.2
    """Current of the Sun sensors."""
    other_w: Annotated[float, Field(ge=0.0)] = 30.0
    """Dissipation of all that is not attitude control."""
    area_m2: _Positive = 1.0
    """Surface of the satellite."""
    absorptivity: _Share = 0.8
    """Part of the Sun's light that the surface takes."""
    emissivity: _Share = 0.8
    """Infrared radiation of the surface over that of a black one; also what it takes of it."""
    capacity_j_k: _Positive = 3e4
    """Heat capacity of the satellite."""
    initial_c: Annotated[float, Field(gt=-ZERO_CELSIUS_K, le=200.0)] = 15.0
    """Temperature of everything at the start."""
    device_k_w: Annotated[float, Field(ge=0.0)] = 5.0
    """Thermal resistance between a device and the satellite."""
    device_s: _Positive = 300.0
    """Time constant with which a device warms up."""


class Draw(NamedTuple):
    """What a device takes: current [A] of the supply, and heat [W] that it leaves."""

    current_a: float
    heat_w: float


NO_DRAW = Draw(0.0, 0.0)


class CoilDraw(NamedTuple):
    """A coil for `coils_draw`: shares of a dipole vector, 1 over its limit [1/(A m^2)], and at the
    limit its current [A] and power [W]. Plain numbers: there are few."""

    share: tuple[float, float, float]
    per_limit: float
    current_a: float
    power_w: float


def coil_draws(coils: Coils, model: HouseKeeping) -> list[CoilDraw]:
    """Coils as the scenario states them; without windings the current is power over voltage."""
    limits, powers = coils.limits_a_m2(), coils.powers_w()
    if powers is None:
        powers = np.full(len(limits), model.coil_w)
    currents = powers / model.voltage_v
    if windings := coils.each_winding():
        currents = np.full(len(limits), [each.current_a for each in windings])
    rows = zip(coils.shares(), 1.0 / limits, currents, powers, strict=True)
    return [CoilDraw(as_vector(share), *map(float, numbers)) for share, *numbers in rows]


def coils_draw(coils: list[CoilDraw], dipole_a_m2) -> Draw:
    """Of a commanded dipole [A m^2, body]: currents of all coils, as far as their limits."""
    current = heat = 0.0
    for coil in coils:
        (a, b, c), (x, y, z) = coil.share, dipole_a_m2
        part = min(abs(a * x + b * y + c * z) * coil.per_limit, 1.0)
        current += part * coil.current_a
        heat += part * part * coil.power_w
    return Draw(current, heat)


def wheels_draw(model: HouseKeeping, inertia_kg_m2, momenta, torques) -> Draw:
    """Of wheels with momenta [N m s] relative to the body and motor torques [N m], one of each.

    Braking takes nothing and gives nothing back; what is not mechanical power becomes heat.
    """
    driven = braked = 0.0
    for inertia, momentum, torque in zip(inertia_kg_m2, momenta, torques, strict=True):
        mechanical = torque * momentum / inertia
        driven, braked = driven + max(mechanical, 0.0), braked - min(mechanical, 0.0)
    power = model.wheel_w * len(momenta) + driven / model.wheel_efficiency
    return Draw(power / model.voltage_v, power - driven + braked)


@kernel
def light_and_distance(shadow, orbit, sun, t_s):
    """Visible part of the Sun's disc and distance from the Earth's centre [m], by tables."""
    r = lookup3(orbit, t_s)
    return sunlit_fraction_at(shadow, r, lookup3(sun, t_s)), norm(r)


def absorbed_w(model: HouseKeeping, sunlit_fraction: float, distance_m: float) -> float:
    """Power [W] that the surface takes of the Sun's light and the Earth's infrared radiation."""
    of_sun = 0.25 * model.area_m2 * model.absorptivity * SUNLIGHT_W_M2 * sunlit_fraction
    sine = min(EARTH_RADIUS_M / distance_m, 1.0) if distance_m > 0.0 else 0.0
    view = 0.5 * (1.0 - math.sqrt(1.0 - sine * sine))
    return of_sun + view * model.area_m2 * model.emissivity * EARTH_INFRARED_W_M2


def warmed(model: HouseKeeping, kelvin: float, power_w: float, seconds: float) -> float:
    """Temperature [K] of the satellite after a time with a constant power.

    The radiated power is linearised about the present temperature, which is stable for any time and
    has the right end.
    """
    radiates = model.emissivity * STEFAN_BOLTZMANN * model.area_m2 * kelvin**3
    rate = 4.0 * radiates / model.capacity_j_k
    step = (power_w - radiates * kelvin) / model.capacity_j_k
    return kelvin - step * math.expm1(-rate * seconds) / rate


def device_warmed(model: HouseKeeping, own_k, satellite_k, heat_w, seconds: float) -> float:
    """Temperature [K] of a device after a time at a constant dissipation [W]."""
    goal = satellite_k + model.device_k_w * heat_w
    return goal + (own_k - goal) * math.exp(-seconds / model.device_s)
