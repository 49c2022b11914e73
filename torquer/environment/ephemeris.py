"""What the on-board computer believes of its surroundings: its own models of field, orbit, time.

It evaluates them at its own clock's time. Their errors are systematic: they change with the orbit,
not from reading to reading, and no filter averages them out.
"""

from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer.base.spec import Spec, unit_vector
from torquer.environment.along_orbit import OrbitEnvironment
from torquer.environment.field import AnyField
from torquer.environment.field.drift import check_span
from torquer.environment.orbit import AnyOrbit
from torquer.environment.orbit.fitted_elements import fitted_elements
from torquer.environment.sun import Shadow
from torquer.environment.table import ProvenTable, Table

_PER_MILLION = 1e-6


class EphemerisModels(Spec):
    """Models from which the computer's ephemeris comes; what is left out is the truth.

    The ephemeris is what laws, estimators and modes know of position, velocity, field and Sun.
    `inputs.t_s` and the times of readings remain true.
    """

    field: AnyField | None = None
    """Field model on board, such as one of a lower degree or held at an earlier year; left out:
    that of the environment.
    """
    orbit: AnyOrbit | None = None
    """Orbit on board, such as a two-line element set received days ago; left out: the true one."""
    tle_age_days: Annotated[float, Field(ge=0.0, le=60.0)] | None = None
    """Age at the start of two-line elements on board, which are fitted to three days of the true
    orbit, of kind 'numerical', before their epoch; left out: none.
    """
    along_track_error_m: float = 0.0
    """Distance by which the computer believes the satellite to be ahead on its orbit."""
    cross_track_error_m: float = 0.0
    """Distance by which it believes the satellite to be off the orbit's plane, towards the orbital
    angular momentum.
    """
    radial_error_m: float = 0.0
    """Distance by which it believes the satellite to be too high."""
    sun_direction: unit_vector("sun_direction") | None = None
    """Inertial direction (a vector of any length) in which the computer takes the Sun to stay; left
    out: that of the environment.
    """
    clock_error_s: Annotated[float, Field(ge=-86400.0, le=86400.0)] = 0.0
    """Time by which its clock is fast at the start: place, rotation of the Earth and Sun are those
    of a later instant.
    """
    clock_drift_ppm: Annotated[float, Field(ge=-1000.0, le=1000.0)] = 0.0
    """Rate by which its clock gains on the true time."""

    @model_validator(mode="after")
    def _one_orbit(self):
        if self.orbit is not None and self.tle_age_days is not None:
            raise ValueError(
                "tle_age_days: must be left out with orbit, in whose place it is; received "
                f"{self.tle_age_days:g}"
            )
        return self

    def along(self, truth: OrbitEnvironment) -> "AnyEnvironment":
        """The surroundings as the computer believes them to be: `truth` itself without errors."""
        own = replace(truth, orbit=self._orbit(truth))
        given = {"field": self.field, "sun_direction": self.sun_direction}
        models = {name: model for name, model in given.items() if model is not None}
        if models:
            own = replace(own, environment=own.environment.model_copy(update=models))
        if own == truth and self.clock_error_s == self.clock_drift_ppm == 0.0:
            return truth
        rate = 1.0 + _PER_MILLION * self.clock_drift_ppm
        return OnBoardEnvironment(own, self.clock_error_s, rate)

    def orbit_on_board(self, truth: OrbitEnvironment) -> AnyOrbit:
        """The orbit on board without the errors that are stated."""
        if self.tle_age_days is not None:
            dut1_s = truth.environment.ut1_minus_utc_s
            return fitted_elements(truth.orbit, truth.start, self.tle_age_days, dut1_s)
        return truth.orbit if self.orbit is None else self.orbit

    def _orbit(self, truth: OrbitEnvironment):
        orbit = self.orbit_on_board(truth)
        errors = (self.along_track_error_m, self.cross_track_error_m, self.radial_error_m)
        return Displaced(orbit, *errors) if any(errors) else orbit


@dataclass(frozen=True)
class Displaced:
    """An orbit as `torquer.environment.orbit` has them, displaced by constant errors [m].

    Along the track the satellite is ahead by the time that it takes for this distance; across it
    and radially it is moved as the orbital frame is turned.
    """

    orbit: AnyOrbit
    along_m: float
    cross_m: float
    radial_m: float

    @property
    def frame(self) -> str:
        """Frame of `state`."""
        return self.orbit.frame

    @property
    def period_s(self) -> float:
        """Time of a revolution [s]."""
        return self.orbit.period_s

    @property
    def step_s(self) -> float | None:
        """Interval between known positions [s]; None for an orbit in closed form."""
        return self.orbit.step_s

    def knot_s(self, start_utc) -> float:
        """Time of the first known position [s]."""
        return self.orbit.knot_s(start_utc)

    def check_span(self, start_utc, *times_s: float) -> None:
        """ValueError for times [s] after the start at which the orbit is not known well enough."""
        self.orbit.check_span(start_utc, *times_s)

    def state(self, t_s, start_utc, dut1_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s at times [n] s after the start."""
        r, v = self.orbit.state(t_s, start_utc, dut1_s)
        if self.along_m:
            ahead_s = self.along_m / np.linalg.norm(v, axis=1)
            r, v = self.orbit.state(np.atleast_1d(t_s) + ahead_s, start_utc, dut1_s)
        normal = np.cross(r, v)
        turning = normal / np.sum(r * r, axis=1)[:, None]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        off = self.cross_m * normal + self.radial_m * r / np.linalg.norm(r, axis=1)[:, None]
        return r + off, v + np.cross(turning, off)


@dataclass(frozen=True)
class OnBoardEnvironment:
    """The environment as the computer's models give it at true times, all vectors in J.

    `own`: its models, at the time of its clock, which shows `clock_error_s` at the start and runs
    `clock_rate` times as fast as the true time.
    """

    own: OrbitEnvironment
    clock_error_s: float
    clock_rate: float

    def clock(self, t_s):
        """What the computer's clock shows at true times since the start [s]."""
        return self.clock_error_s + self.clock_rate * t_s

    def check_dates(self, *times_s: float) -> None:
        """ValueError (a warning if the model extrapolates) for a time outside its validity."""
        model, start = self.own.environment.field, self.own.start
        try:
            self.own.orbit.check_span(start, *map(self.clock, times_s))
            check_span(model, start, *map(self.clock, times_s))
        except ValueError as error:
            if str(error).startswith("control.ephemeris."):  # a part of the user's own
                raise
            within = "." if str(error).startswith("orbit.") else ": "
            raise ValueError(f"control.ephemeris{within}{error}") from None

    def state(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s."""
        return self.own.state(self.clock(t_s))

    def field(self, t_s: np.ndarray, r: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Field [n, 3] T at positions and velocities of `state`."""
        return self.own.field(self.clock(t_s), r, v)

    def sun(self, t_s: np.ndarray) -> np.ndarray:
        """Position of the Sun [n, 3] m from the Earth's centre."""
        return self.own.sun(self.clock(t_s))

    @property
    def shadow(self) -> Shadow:
        """The Earth's shadow."""
        return self.own.shadow

    def orbit_table(self, duration_s: float, step_s: float, start_s: float = 0.0) -> ProvenTable:
        """Table of position, field and gravity-gradient vector over true time.

        As `OrbitEnvironment.orbit_table`.
        """
        rate, first_s = self.clock_rate, self.clock(start_s)
        found = self.own.orbit_table(rate * duration_s, rate * step_s, first_s)
        return replace(found, table=self._over_true_time(found.table))

    def sun_table(self, duration_s: float, start_s: float = 0.0) -> Table:
        """Table of the Sun's position over true time."""
        found = self.own.sun_table(self.clock_rate * duration_s, self.clock(start_s))
        return self._over_true_time(found)

    def _over_true_time(self, table: Table) -> Table:
        """A table over the time of the computer's clock as one over true time."""
        start_s = (table.start_s - self.clock_error_s) / self.clock_rate
        return table._replace(per_second=self.clock_rate * table.per_second, start_s=start_s)


#: The environment as a computer believes it to be: the true one, or one by its own models.
AnyEnvironment = OrbitEnvironment | OnBoardEnvironment


class ModelErrors(NamedTuple):
    """Root mean square of what the computer believes less what is true, along an orbit.

    Size of the field's vector [T], its strength [T], angle between the two fields [rad], distance
    of the positions [m].
    """

    field_t: float
    strength_t: float
    angle_rad: float
    position_m: float


def model_errors(truth: OrbitEnvironment, believed: AnyEnvironment, t_s) -> ModelErrors | None:
    """Errors of the models on board at times (n,) [s]; None where they are the truth."""
    if believed == truth:
        return None
    (r, v), (own_r, own_v) = truth.state(t_s), believed.state(t_s)
    b, own_b = truth.field(t_s, r, v), believed.field(t_s, own_r, own_v)
    sizes = np.linalg.norm(b, axis=1), np.linalg.norm(own_b, axis=1)
    return ModelErrors(
        _rms(np.linalg.norm(own_b - b, axis=1)),
        _rms(sizes[1] - sizes[0]),
        _rms(np.arctan2(np.linalg.norm(np.cross(b, own_b), axis=1), np.sum(b * own_b, axis=1))),
        _rms(np.linalg.norm(own_r - r, axis=1)),
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
