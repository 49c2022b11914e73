"""Files of wheel designs: an array, a body, and their requirements; TOML, like scenarios.

A scenario with wheels serves as a design, too: that of its wheels and its body.
"""

import math
from pathlib import Path

import numpy as np
from pydantic import Field, model_validator

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.explain import validate_tables
from torquer.base.spec import Spec, Vector
from torquer.environment.orbit.kepler import FARTHEST_KM, mean_motion
from torquer.scenario.load import (
    ScenarioError,
    name_after,
    parse_toml,
    read_text,
    scenario_from_data,
)
from torquer.scenario.spec import Scenario
from torquer.spacecraft.aerodynamics import Aerodynamics
from torquer.spacecraft.body import Body
from torquer.spacecraft.parts import AnyPart
from torquer.spacecraft.wheel_array.layout import Limit
from torquer.spacecraft.wheel_array.presets import Wheels
from torquer.theory.slow.wheel_accumulation import (
    PHASES,
    Growth,
    Held,
    air_torque,
    held_torque,
    momentum_growth,
    orbital_axes,
)

#: Keys of laws that limit slews, by what they demand of the wheels.
_OF_SLEWS = {
    "rate_deg_s": "greatest_rate_deg_s", "acceleration_deg_s2": "greatest_acceleration_deg_s2",
}  # fmt: skip


class Demand(Spec):
    """What the array must be able to do."""

    rate_deg_s: float | None = Field(default=None, gt=0.0)
    """Rate about every axis, from rest."""
    acceleration_deg_s2: float | None = Field(default=None, gt=0.0)
    """Angular acceleration about every axis; needs `wheels.torque_limit_n_m`."""
    momentum_n_m_s: tuple[Limit, Limit, Limit] | None = None
    """Greatest momentum to be stored along x1, x2, x3, in all combinations."""


class Accumulation(Spec):
    """Momentum build-up in an attitude held on a circular orbit.

    x1 is along the motion, x3 along the orbit normal, x2 down.
    """

    altitude_km: float = Field(gt=0.0, le=FARTHEST_KM)
    """Altitude above the equatorial radius."""
    inclination_deg: float | None = Field(default=None, ge=0.0, le=180.0)
    """Inclination, for an atmosphere that rotates with the Earth; left out: it is at rest."""
    offset_deg: Vector = (0.0, 0.0, 0.0)
    """Offset of the attitude, rotations about x1, x2, x3."""
    push_n_m: Vector = (0.0, 0.0, 0.0)
    """Any other constant torque in body axes."""
    density_kg_m3: float = Field(default=0.0, ge=0.0)
    """Mean density of the atmosphere over the orbit, for `parts`."""
    parts: tuple[AnyPart, ...] = ()
    """Surfaces that the atmosphere acts on."""

    @model_validator(mode="after")
    def _air_meets_something(self):
        if (self.density_kg_m3 > 0.0) != bool(self.parts):
            raise ValueError(
                "density_kg_m3: must be above 0 with parts, and 0 without; "
                f"received {self.density_kg_m3:g} with {len(self.parts)} parts"
            )
        return self

    @property
    def radius_m(self) -> float:
        """Radius of the orbit [m]."""
        return EARTH_RADIUS_M + 1e3 * self.altitude_km

    def growth(self, inertia_kg_m2) -> Growth:
        """Momentum that the wheels take up, for an inertia tensor (3, 3)."""
        rate = mean_motion(self.radius_m)
        axes = orbital_axes(np.radians(self.offset_deg))
        steady = held_torque(inertia_kg_m2, rate, axes, self.push_n_m)
        torque = np.tile(steady, (PHASES, 1))
        if self.parts:
            surface = Aerodynamics(parts=self.parts).pack()
            given = self.inclination_deg
            tilt = None if given is None else math.radians(given)
            torque += air_torque(surface, self.density_kg_m3, self.radius_m, rate, axes, tilt)
        return momentum_growth(Held(rate, axes[2], torque))


class WheelDesign(Spec):
    """A wheel array on a satellite, and what it must be able to do."""

    name: str = Field(default="wheels", pattern=r"^\w[\w.-]*$")
    """Name of the design; left out: that of the file."""
    description: str = ""
    """What the design is for, in a sentence."""
    wheels: Wheels
    """The array: layout and limits."""
    body: Body
    """Inertia of the satellite."""
    demand: Demand = Demand()
    """What the array must be able to do."""
    accumulation: Accumulation | None = None
    """Attitude and disturbances, for the time to saturation; left out: not computed."""

    @model_validator(mode="after")
    def _some_wheel_works(self):
        if len(self.wheels.lost) == self.wheels.array().count:
            raise ValueError(f"wheels.lost: must leave a wheel; received {self.wheels.lost}")
        return self

    @model_validator(mode="after")
    def _accelerations_have_torques(self):
        if self.demand.acceleration_deg_s2 is not None and self.wheels.torque_limit_n_m is None:
            raise ValueError(
                "wheels.torque_limit_n_m: must be given with demand.acceleration_deg_s2; received "
                "none"
            )
        return self


def load_wheels(path) -> WheelDesign:
    """The design, or the scenario, of a TOML file; `ScenarioError` with one line per mistake."""
    path = Path(path)
    return wheels_from_text(read_text(path, "design"), name_after(path), path.parent)


def wheels_from_text(text: str, name: str = "wheels", folder: Path = Path()) -> WheelDesign:
    """The design of a TOML text, which may be a scenario's.

    `name` is used where the text gives none; files that a scenario names are in `folder`.
    """
    data = {"name": name, **parse_toml(text, "design")}
    return (
        _from_scenario(data, folder) if "spacecraft" in data else validate_tables(WheelDesign, data)
    )


def _from_scenario(data: dict, folder: Path) -> WheelDesign:
    return wheels_of(scenario_from_data(data, folder))


def wheels_of(scenario: Scenario) -> WheelDesign:
    """The wheels and the body of a scenario, and the slews that its laws make, as demands.

    `ScenarioError` for one without wheels.
    """
    craft = scenario.spacecraft
    if craft.wheels is None:
        raise ScenarioError("spacecraft.wheels: must be given for a wheel design; received none")
    wheels = {key: getattr(craft.wheels, key) for key in Wheels.model_fields}
    texts = {"name": scenario.name, "description": scenario.description}
    given = {"wheels": wheels, "body": craft.body, "demand": slews_of(scenario), **texts}
    return validate_tables(WheelDesign, given)


def slews_of(scenario: Scenario) -> dict[str, float]:
    """Greatest rate and angular acceleration of the slews of a scenario's laws, as demands."""
    laws, found = scenario.control.named().laws.values(), {}
    for demand, key in _OF_SLEWS.items():
        given = [getattr(law, key, None) for law in laws]
        if known := [each for each in given if each is not None]:
            found[demand] = max(known)
    return found
