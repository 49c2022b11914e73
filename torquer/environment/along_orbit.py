"""The environment along an orbit: position, geomagnetic field, Sun and shadow."""

import math
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from torquer.base.conventions import ASTRONOMICAL_UNIT_M
from torquer.base.spec import Spec, unit_vector
from torquer.base.user_code import UserCode
from torquer.environment.earth.atmosphere import AnyAtmosphere
from torquer.environment.earth.atmosphere.air import air_velocities
from torquer.environment.earth.gravity import gravity_gradient_vector
from torquer.environment.earth.rotation import dcm_inertial_to_ecef, teme_to_gcrf
from torquer.environment.field import FIELDS, AnyField
from torquer.environment.field.drift import b_inertial_along, bends_s, check_span
from torquer.environment.moon import moon_position
from torquer.environment.orbit import AnyOrbit
from torquer.environment.sun import Shadow, find_shadow, sun_position, sunlit_fraction
from torquer.environment.table import (
    DEGREE,
    NotSmooth,
    ProvenTable,
    build,
    build_exact,
    build_proven,
)

_POSITION, _FIELD, _GRAVITY_GRADIENT = slice(0, 3), slice(3, 6), slice(6, 9)


class Environment(Spec):
    """Models of the environment.

    In low orbits the contact times of a spherical Earth's shadow are in error by 5 s on average, by
    30 s where the orbit grazes the shadow; those of the ellipsoid by 0.1 s, without refraction.
    With UT1 - UTC left at 0 the Earth's rotation is up to 0.9 s in error: 450 m at 500 km, 1.6 nT.
    Polar motion (20 m) is neglected.
    """

    field: AnyField = FIELDS["igrf14"]()
    """Geomagnetic field model. Its date advances during the run, which must end within the model's
    period of validity.
    """
    earth_rotation: Literal["precise", "sidereal"] = "precise"
    """'precise' (precession and nutation) or 'sidereal' (rotation by Greenwich sidereal time
    alone).
    """
    ut1_minus_utc_s: Annotated[float, Field(ge=-0.9, le=0.9)] = 0.0
    """UT1 - UTC at the start, from Bulletin A or B of the IERS; held constant during the run."""
    eclipse: Literal["conical", "oblate", "cylindrical", "none"] = "conical"
    """Model of the Earth's shadow: 'conical' (umbra and penumbra of a sphere of the equatorial
    radius), 'oblate' (the same for the WGS84 ellipsoid), 'cylindrical' or 'none' (always in
    sunlight).
    """
    sun_direction: unit_vector("sun_direction") | None = None
    """Fixes the Sun at 1 au in this inertial direction (a vector of any length), for comparison
    with theory; left out: the Sun follows its true path, which density models use in any case.
    """
    gravity_gradient: bool = True
    """Whether the gravity-gradient torque acts."""
    atmosphere: AnyAtmosphere | None = None
    """Density model, for `spacecraft.aerodynamics`."""
    co_rotating_atmosphere: bool = True
    """Whether the atmosphere rotates with the Earth; publications often assume that it does not."""
    table_tolerance: Annotated[float, Field(ge=0.0, le=1e-3)] = 1e-9
    """Bound on the relative error of the tabulated field and position; 0 evaluates the models at
    every stage of RK4 (exact, about ten times slower).
    """


@dataclass(frozen=True)
class OrbitEnvironment:
    """The environment along one orbit from one start; all vectors in the inertial frame J."""

    environment: Environment
    orbit: AnyOrbit
    start: datetime

    def state(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s at seconds since the start."""
        ut1_minus_utc_s = self.environment.ut1_minus_utc_s
        r, v = self.orbit.state(t_s, self.start, ut1_minus_utc_s)
        given, rotation = self.orbit.frame, self.environment.earth_rotation
        if (given, rotation) in (("TEME", "precise"), ("GCRF", "sidereal")):
            turn = teme_to_gcrf(t_s, self.start, ut1_minus_utc_s)
            to_j = "nij,nj->ni" if given == "TEME" else "nji,nj->ni"
            r, v = (np.einsum(to_j, turn, x) for x in (r, v))
        return r, v

    def dcm_to_ecef(self, t_s: np.ndarray) -> np.ndarray:
        """Direction cosines [n, 3, 3] from the inertial to the Earth-fixed frame."""
        given = self.environment
        return dcm_inertial_to_ecef(t_s, self.start, given.earth_rotation, given.ut1_minus_utc_s)

    def field(self, t_s: np.ndarray, r: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Field [n, 3] T, each at its own date; ValueError outside the model's validity."""
        if len(t_s):
            self.check_dates(float(np.min(t_s)), float(np.max(t_s)))
        return self._field(t_s, r, v)

    def check_dates(self, *times_s: float) -> None:
        """ValueError for a time outside the validity of the orbit or the field model.

        (A warning if the field model extrapolates.) Without an orbit, at positions that are given,
        the field model alone is asked.
        """
        if self.orbit is not None:
            self.orbit.check_span(self.start, *times_s)
        try:
            check_span(self.environment.field, self.start, *times_s)
        except ValueError as error:
            raise ValueError(f"environment.field: {error}") from None

    def _field(self, t_s: np.ndarray, r: np.ndarray, v: np.ndarray) -> np.ndarray:
        model = self.environment.field
        return b_inertial_along(model, self.start, t_s, r, v, self.dcm_to_ecef(t_s))

    def sun(self, t_s: np.ndarray) -> np.ndarray:
        """Position of the Sun [n, 3] m from the Earth's centre."""
        fixed = self.environment.sun_direction
        if fixed is not None:
            return np.tile(ASTRONOMICAL_UNIT_M * np.array(fixed), (len(t_s), 1))
        return sun_position(t_s, self.start, self.environment.earth_rotation)

    def moon(self, t_s: np.ndarray) -> np.ndarray:
        """Position of the Moon [n, 3] m from the Earth's centre."""
        return moon_position(t_s, self.start, self.environment.earth_rotation)

    def sunlit_fraction(self, t_s: np.ndarray, r: np.ndarray) -> np.ndarray:
        """Visible fraction of the Sun's disc [n]."""
        return sunlit_fraction(r, self.sun(t_s), self.shadow)

    @cached_property
    def shadow(self) -> Shadow:
        """The Earth's shadow; the pole drifts by 1e-4 rad a year, which moves it by 2 m."""
        model = self.environment.eclipse
        if model != "oblate":
            return find_shadow(model)
        return find_shadow(model, self.dcm_to_ecef(np.zeros(1))[0, 2])

    def sample(self, t_s: np.ndarray) -> np.ndarray:
        """Position, field and gravity-gradient vector [n, 9], as the table holds them.

        The last segment may extend beyond the run: dates are not checked.
        """
        r, v = self.state(t_s)
        return np.hstack([r, self._field(t_s, r, v), gravity_gradient_vector(r)])

    def flow(self, t_s: np.ndarray) -> np.ndarray:
        """Velocity relative to the air times the root of its density [n, 3] sqrt(Pa)."""
        r, v = self.state(t_s)
        to_ecef = self.dcm_to_ecef(t_s)
        r_ecef = np.einsum("nij,nj->ni", to_ecef, r)
        given = self.environment
        density = given.atmosphere.density(t_s, self.start, r_ecef, given.ut1_minus_utc_s)
        if given.co_rotating_atmosphere:
            v = air_velocities(r, v, to_ecef[:, 2, :])
        return np.sqrt(density)[:, None] * v

    @property
    def segment_s(self) -> float:
        """Initial length of the segments of the orbit's table [s].

        Between known positions a whole number of segments: polynomials meet where two segments do.
        """
        wanted, step_s = self.orbit.period_s / 100.0, self.orbit.step_s
        return wanted if step_s is None else step_s / math.ceil(step_s / wanted)

    def air_table(self, duration_s: float, start_s: float = 0.0):
        """Table of `flow`, without error bound: density models may have discontinuities."""
        return build(self.flow, duration_s, self.orbit.period_s / 200.0, DEGREE, start_s)

    def orbit_table(self, duration_s: float, step_s: float, start_s: float = 0.0) -> ProvenTable:
        """Table of `sample`, with a verified error bound, or exact at the stages of RK4.

        ValueError for a run outside the field model's validity.
        """
        end_s = start_s + duration_s
        self.check_dates(start_s, end_s)
        if self.environment.table_tolerance == 0.0:
            return build_exact(self.sample, duration_s, step_s, start_s)
        tolerance = self.environment.table_tolerance
        groups = (_POSITION, _FIELD, _GRAVITY_GRADIENT)
        bends = bends_s(self.environment.field, self.start, start_s, end_s)
        if self.orbit.step_s is not None:
            bends = np.append(self.orbit.knot_s(self.start), bends)
        try:
            return build_proven(
                self.sample, duration_s, self.segment_s, tolerance, groups, start_s, bends
            )
        except NotSmooth as error:
            parts = (self.orbit, self.environment.field)
            own = [part.own_key for part in parts if isinstance(part, UserCode)]
            jumps = f" (does {' or '.join(own)} jump? it must be smooth)" if own else ""
            raise ValueError(f"environment.table_tolerance: {error}{jumps}") from None

    def sun_table(self, duration_s: float, start_s: float = 0.0):
        """Table of the Sun's position; two days of its path are a smooth arc."""
        return build(self.sun, duration_s, min(duration_s, 2 * 86400.0), DEGREE, start_s)

    def moon_table(self, duration_s: float, start_s: float = 0.0):
        """Table of the Moon's position; a day of its path is a smooth arc."""
        return build(self.moon, duration_s, min(duration_s, 86400.0), DEGREE, start_s)
