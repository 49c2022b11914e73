"""Numerically integrated orbit: gravity harmonics and drag, from any start state."""

import functools
import math
from datetime import UTC, datetime, timedelta
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from torquer.base import validate
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.spec import Spec, Vector
from torquer.base.time import leap_seconds_between, parse_utc, seconds_between
from torquer.compile.when_compiling import plainly
from torquer.environment.earth import gravity
from torquer.environment.earth.atmosphere import AnyAtmosphere, Nrlmsis, UserAtmosphere
from torquer.environment.earth.atmosphere.air import NO_AIR
from torquer.environment.earth.rotation_table import teme_to_gcrf_at
from torquer.environment.orbit.circular import Circular
from torquer.environment.orbit.kepler import Extent, Kepler, Orbit, check_farthest, mean_motion
from torquer.environment.orbit.osculating import extent_of, semi_major_axis
from torquer.environment.orbit.point_mass import Forces, Trajectory
from torquer.environment.orbit.sgp4 import Sgp4


class StateVector(Spec):
    """Position and velocity at the start, of a bound orbit above the Earth's surface."""

    kind: Literal["state_vector"] = "state_vector"
    position_km: Vector
    """Position in `start_frame`."""
    velocity_km_s: Vector
    """Velocity in `start_frame`."""

    @model_validator(mode="after")
    def _check(self):
        radius_km = math.dist(self.position_km, (0.0, 0.0, 0.0))
        if not radius_km * 1e3 > EARTH_RADIUS_M:
            raise ValueError(
                "position_km: must lie above the Earth's equatorial radius; received a distance "
                f"of {radius_km:.6g} km from its centre"
            )
        check_farthest(1e3 * radius_km)
        r, v = self.state(None)
        axis = semi_major_axis(r, v)
        if not axis > 0.0:
            raise ValueError(
                "velocity_km_s: must be below that of escape; received "
                f"{math.hypot(*self.velocity_km_s):.6g} km/s"
            )
        check_farthest(self.extent().apogee_m)
        return self

    def extent(self, start_utc=None) -> Extent:
        """Perigee, apogee and inclination of the osculating orbit."""
        r, v = (x[0] for x in self.state(None))
        return extent_of(r, v)

    def state(self, t_s, start_utc=None) -> tuple[np.ndarray, np.ndarray]:
        """Position [1, 3] m and velocity [1, 3] m/s at the start."""
        return 1e3 * np.array([self.position_km]), 1e3 * np.array([self.velocity_km_s])


class Drag(Spec):
    """Drag of a body by its area, mass and drag coefficient in an atmosphere."""

    mass_kg: float = Field(gt=0.0)
    """Mass of the satellite."""
    area_m2: float = Field(gt=0.0)
    """Cross-section to the flow, the same for all attitudes."""
    drag_coefficient: float = Field(default=2.2, gt=0.0)
    """Drag coefficient."""
    atmosphere: AnyAtmosphere
    """Density model; it must be one that compiled code can call."""

    @model_validator(mode="after")
    def _compiles(self):
        if isinstance(self.atmosphere, Nrlmsis | UserAtmosphere):
            self.atmosphere.pack()  # which says why it cannot
        return self

    @property
    def half_coefficient_m2_kg(self) -> float:
        """Half of drag coefficient times area over mass: drag per density and speed squared."""
        return 0.5 * self.drag_coefficient * self.area_m2 / self.mass_kg


#: What an orbit may start from, by kind.
STARTS = {"kepler": Kepler, "circular": Circular, "state_vector": StateVector, "sgp4": Sgp4}

AnyStart = Annotated[Kepler | Circular | StateVector | Sgp4, Field(discriminator="kind")]


class Numerical(Orbit):
    """Orbit under EGM2008 to a degree and order; drag, if given, is of a co-rotating atmosphere."""

    kind: Literal["numerical"] = "numerical"
    start: AnyStart
    """Osculating elements (kind 'kepler' or 'circular') or a state vector at the start of the run,
    or a two-line element set (kind 'sgp4'), whose state at its own epoch is taken.
    """
    start_frame: Literal["J", "TEME"] = "J"
    """Frame of elements and vectors: 'J', or 'TEME' for the mean equinox of date."""
    degree: int = Field(default=16, ge=0, le=gravity.MAX_DEGREE)
    """Degree of the gravity field."""
    order: int | None = Field(default=None, ge=0)
    """Order of the gravity field; left out: the degree."""
    drag: Drag | None = None
    """Drag of the satellite; left out: none."""
    earth_rotation: Literal["precise", "sidereal"] = "precise"
    """As in the environment, with which it should agree: 'precise' or 'sidereal'."""

    @model_validator(mode="after")
    def _order_exists(self):
        if self.order is not None and self.order > self.degree:
            raise ValueError(
                f"order: must lie within 0..{self.degree}, the degree; received {self.order}"
            )
        return self

    @property
    def frame(self) -> str:
        """Frame of `state`: GCRF, or TEME under plain sidereal rotation."""
        return "GCRF" if self.earth_rotation == "precise" else "TEME"

    def rate_rad_s(self, start_utc=None) -> float:
        """Mean motion [rad/s] of the osculating orbit of the start state."""
        epoch = tle_epoch(self.start) if isinstance(self.start, Sgp4) else None
        return mean_motion(semi_major_axis(*self.start.state([0.0], epoch)))

    def extent(self, start_utc=None) -> Extent:
        """Perigee, apogee and inclination of what the orbit starts from."""
        return self.start.extent(start_utc)

    def anchor(self, start_utc: str | datetime) -> datetime:
        """Instant of the start state: a TLE's epoch, else the start of the run."""
        return tle_epoch(self.start) if isinstance(self.start, Sgp4) else parse_utc(start_utc)

    def state(
        self, t_s, start_utc: str | datetime, dut1_s: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s at times [n] s after the start.

        In any order, also before the start. Integrated once, then interpolated (error below 1 mm).
        `dut1_s` is UT1 - UTC at the start. ValueError for an orbit that leaves the heights of its
        atmosphere model or hits the ground.
        """
        t_s = np.atleast_1d(validate.finite("t_s", t_s))
        if t_s.size == 0:
            return np.empty((0, 3)), np.empty((0, 3))
        anchor = self.anchor(start_utc)
        offset = seconds_between(anchor, start_utc)
        # UT1 is continuous through a leap second, so that UT1 - UTC jumps there
        dut1_there_s = dut1_s - leap_seconds_between(anchor, start_utc)
        with plainly(False):  # thousands of steps, also where a file is only checked
            flight = _trajectory(self, anchor, anchor.fold, dut1_there_s)
            return flight.states(np.ascontiguousarray(t_s + offset))

    def _start_state(self, anchor: datetime) -> np.ndarray:
        """Position and velocity [6] at the anchor in the frame of integration."""
        r, v = self.start.state(np.zeros(1), anchor)
        given = "TEME" if isinstance(self.start, Sgp4) else self.start_frame
        if given == "TEME" and self.earth_rotation == "precise":
            turn = teme_to_gcrf_at(anchor)
            r, v = r @ turn.T, v @ turn.T
        return np.concatenate([r[0], v[0]])

    def forces(self) -> Forces:
        """Forces for kernels."""
        harmonics = gravity.pack(self.degree, self.order)
        if self.drag is None:
            return Forces(harmonics, NO_AIR, 0.0)
        return Forces(harmonics, self.drag.atmosphere.pack(), self.drag.half_coefficient_m2_kg)


def tle_epoch(elements: Sgp4) -> datetime:
    """Epoch of a two-line element set, to the microsecond."""
    text = elements.tle[0]
    year = int(text[18:20])
    first = datetime(year + (1900 if year >= 57 else 2000), 1, 1, tzinfo=UTC)
    return first + timedelta(days=float(text[20:32]) - 1.0)


@functools.lru_cache(maxsize=16)
def _trajectory(orbit: Numerical, anchor: datetime, _fold: int, dut1_s: float) -> Trajectory:
    """The trajectory of an orbit from an anchor, shared in this process and extended on demand.

    `_fold`: of the anchor, which equal datetimes may not share (`torquer.base.time`).
    """
    start = orbit._start_state(anchor)
    return Trajectory(orbit.forces(), anchor, orbit.earth_rotation, start, dut1_s)
