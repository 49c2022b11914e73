"""An axisymmetric satellite on a circular orbit: the setting of the averaged motion."""

import math
from typing import Literal, NamedTuple

from pydantic import Field, model_validator

from torquer.base.conventions import EARTH_RATE_RAD_S
from torquer.base.spec import Spec, unit_vector
from torquer.environment.field.averaged import cone_angle
from torquer.theory.slow.orbit_field import AVERAGED, DIRECT_DIPOLE, TILTED_DIPOLE, OrbitField
from torquer.theory.slow.second_moments import closed_moments

MODELS = {"averaged": AVERAGED, "direct_dipole": DIRECT_DIPOLE, "tilted_dipole": TILTED_DIPOLE}


class Setting(NamedTuple):
    """Constants for kernels: field, moments of inertia across and along the axis [kg m^2], unit
    of momentum L0 [N m s], orbital rate [rad/s], gain of the day angle per unit of u, whether the
    field's own turn counts in dB/dt (1) or the rotation is taken as fast (0), and the unit vector
    to the Sun in the field's frame (zeros: not seen)."""

    field: OrbitField
    transverse: float
    axial: float
    momentum: float
    orbital_rate: float
    days_per_orbit: float
    field_turn: float
    sun: tuple


class Spinner(Spec):
    """Axisymmetric body (A = B), circular orbit, field model.

    `strength_t`: B0 of the averaged field, mu_e/r^3 of the dipoles. `momentum_n_m_s`: L0, the unit
    in which l = L/L0 counts. `field_turn`: whether dB/dt includes the field's own rotation along
    the orbit; without it the satellite's rotation is taken as fast. `sun`: direction to the Sun in
    the field's frame, of any length, for laws that point to it; it stays there, without eclipses.
    Any consistent units are allowed: with all defaults of 1 the gain of a law is its small
    parameter.
    """

    inclination_deg: float = Field(ge=0.0, le=180.0)
    field: Literal["averaged", "direct_dipole", "tilted_dipole"] = "averaged"
    strength_t: float = Field(default=1.0, gt=0.0)
    transverse_kg_m2: float = Field(default=1.0, gt=0.0)
    axial_kg_m2: float = Field(default=1.0, gt=0.0)
    momentum_n_m_s: float = Field(default=1.0, gt=0.0)
    orbital_rate_rad_s: float = Field(default=1.0, gt=0.0)
    tilt_deg: float = Field(default=168.3, ge=0.0, le=180.0)
    earth_rate_rad_s: float = Field(default=EARTH_RATE_RAD_S, ge=0.0)
    field_turn: bool = False
    sun: unit_vector("sun") | None = None  # type: ignore[valid-type]

    @model_validator(mode="after")
    def _triangle(self):
        if self.axial_kg_m2 > 2.0 * self.transverse_kg_m2 * (1.0 + 1e-12):
            raise ValueError(
                "axial_kg_m2: must not exceed twice transverse_kg_m2 (triangle inequality); "
                f"received {self.axial_kg_m2} and {self.transverse_kg_m2}"
            )
        return self

    @property
    def ratio(self) -> float:
        """C/A."""
        return self.axial_kg_m2 / self.transverse_kg_m2

    @property
    def eta(self) -> tuple[float, float]:
        """Rates of phi (times l cos theta) and psi (times l) in orbital rates: eta1, eta2."""
        unit = self.momentum_n_m_s / self.orbital_rate_rad_s
        spin = unit * (1.0 / self.axial_kg_m2 - 1.0 / self.transverse_kg_m2)
        return spin, unit / self.transverse_kg_m2

    def orbit_field(self) -> OrbitField:
        """The field as the kernels take it."""
        inclination = math.radians(self.inclination_deg)
        angle = cone_angle(inclination) if self.field == "averaged" else inclination
        return OrbitField(MODELS[self.field], self.strength_t, angle, math.radians(self.tilt_deg))

    def moments(self) -> tuple:
        """Averaged second moments of the field over its strength, closed form."""
        return closed_moments(self.orbit_field(), math.radians(self.inclination_deg))

    def pack(self) -> Setting:
        """The setting as the kernels take it."""
        return Setting(
            self.orbit_field(),
            self.transverse_kg_m2,
            self.axial_kg_m2,
            self.momentum_n_m_s,
            self.orbital_rate_rad_s,
            self.earth_rate_rad_s / self.orbital_rate_rad_s,
            float(self.field_turn),
            self.sun or (0.0, 0.0, 0.0),
        )
