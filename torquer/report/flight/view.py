"""A result with what its pictures need: scenario, eclipses, wheels, interpolated attitude."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np
import xarray as xr

from torquer.analysis.attitude import AttitudeError, find_attitude_error
from torquer.analysis.budget import Budget, budget_along_run
from torquer.analysis.mode_use import RegionRecord, find_regions
from torquer.analysis.series import bands_where, settled_from
from torquer.analysis.summary import summarise
from torquer.analysis.wheel_use import FlownWheels, recorded_wheels
from torquer.base.time import decimal_year
from torquer.environment.field import at_geodetic
from torquer.maths.geometry.attitudes import dcm_body_to_reference, interpolate
from torquer.scenario.spec import Scenario
from torquer.simulation.results.dataset import flown_laws, flown_scenario

Part = TypeVar("Part")
#: Rotation between records [deg] up to which the attitude can be interpolated.
_FOLLOWED_DEG = 100.0
#: Most records in a picture; longer runs are thinned.
_MOST_RECORDS = 300_000


def known(part: Part | None) -> Part:
    """A part of a view, in pictures that are made only of views that have it."""
    assert part is not None
    return part


@dataclass(frozen=True)
class Mark:
    """An instant, marked by a vertical line and its label ("": the line alone)."""

    t_s: float
    label: str


@dataclass(frozen=True)
class View:
    """A result with what every picture needs; made by `make_view`."""

    result: xr.Dataset
    scenario: Scenario
    omega0_rad_s: float
    t_s: np.ndarray
    eclipses: tuple[tuple[float, float], ...]
    every: int = 1
    """Records of the run per record in `result`."""
    summary: dict = field(default_factory=dict)
    """Of all records."""

    @property
    def record_s(self) -> float:
        """Time between the records in `result` [s]."""
        return self.every * self.scenario.simulation.record_s

    def values(self, name: str) -> np.ndarray:
        """A variable of the result as an array, in SI units."""
        return self.result[name].values

    @property
    def has_coils(self) -> bool:
        """Whether the satellite has coils."""
        return self.scenario.spacecraft.coils is not None

    @cached_property
    def wheels(self) -> FlownWheels | None:
        """The reaction wheels; None for a satellite without."""
        return recorded_wheels(self.result, self.scenario)

    @cached_property
    def budget(self) -> Budget:
        """Disturbance torques at the records."""
        return budget_along_run(self.result)

    @cached_property
    def laws(self) -> dict[str, dict]:
        """Laws and estimators that were flown, by key."""
        return flown_laws(self.result)

    def kind_of(self, key: str) -> str:
        """The kind of entry at a key of `laws`: a law or an estimator."""
        return "law" if key in self.scenario.control.named().laws else "estimator"

    def spec_of(self, key: str):
        """The part of the scenario that gives an entry of `laws`."""
        control = self.scenario.control
        estimators = {"estimator": control.estimator, **control.estimators}
        return (control.named().laws | estimators)[key]

    @cached_property
    def regions(self) -> list[RegionRecord]:
        """Regions of a run with modes or a scheme."""
        return find_regions(self.result)

    @cached_property
    def attitude_error(self) -> AttitudeError | None:
        """Attitude error; None where no built-in law held an attitude."""
        return find_attitude_error(self.result)

    @cached_property
    def acquired_s(self) -> float | None:
        """Time by which the attitude was acquired; None if there was no such time."""
        if self.attitude_error is None:
            return None
        if not self.attitude_error.is_held.all():  # there is no one acquisition
            return None
        settled = settled_from(self.t_s, self.attitude_error.angle_deg)
        return None if settled is None else 2.0 * settled

    def marks(self, labelled: bool = True) -> tuple[Mark, ...]:
        """Failures of the wheels, without labels unless `labelled`."""
        happened = [] if self.wheels is None else self.wheels.events(self.end_s)
        return tuple(Mark(t, event if labelled else "") for t, event in happened)

    @property
    def end_s(self) -> float:
        """Time of the last record [s]."""
        return float(self.t_s[-1])

    @property
    def revolution_s(self) -> float:
        """Orbital period [s]."""
        return 2.0 * math.pi / self.omega0_rad_s

    @property
    def rate(self) -> np.ndarray:
        """Absolute rate [rad/s] at the records."""
        return np.linalg.norm(self.values("omega_body"), axis=1)

    def turn_between_records_deg(self, first: int = 0, last: int | None = None) -> float:
        """Largest rotation of the body [deg] between records, in rows first..last."""
        return math.degrees(float(self.rate[first:last].max())) * self.record_s

    def can_follow(self, first: int = 0, last: int | None = None) -> bool:
        """Whether records are close enough to interpolate the attitude."""
        return self.turn_between_records_deg(first, last) <= _FOLLOWED_DEG

    def to_inertial(self, t_s) -> np.ndarray:
        """Direction cosines [n, 3, 3], body to J, at times within the record, interpolated."""
        q = self.values("q_body_to_inertial")
        if len(self.t_s) == 1:
            return np.repeat(dcm_body_to_reference(q), len(t_s), axis=0)
        within = np.clip(t_s, self.t_s[0], self.end_s)
        return dcm_body_to_reference(interpolate(self.t_s, q, within))

    def at(self, name: str, t_s) -> np.ndarray:
        """A slowly changing vector [n, 3] at times within the record, interpolated."""
        columns = self.values(name).T
        return np.stack([np.interp(t_s, self.t_s, column) for column in columns], axis=1)

    @cached_property
    def field_map(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """(lon, lat, |B| [µT]) of the scenario's field at the orbit's mean height; None if the
        model is defined along the orbit only."""
        model = self.scenario.environment.field
        if not hasattr(model, "b_earth_fixed"):
            return None
        lat, lon = np.linspace(-90.0, 90.0, 61), np.linspace(-180.0, 180.0, 121)
        year, height_km = decimal_year(self.scenario.start), 1e-3 * self.values("altitude").mean()
        b = at_geodetic(model, year, lat[:, None], lon[None, :], height_km)
        return lon, lat, 1e6 * np.linalg.norm(b, axis=-1)


def make_view(result: xr.Dataset) -> View:
    """What the report needs of a result; `ValueError` for one without a single record."""
    if result.sizes["time"] == 0:
        raise ValueError("result: must hold at least one record; received none")
    summary, scenario = summarise(result), flown_scenario(result)
    every = -(-result.sizes["time"] // _MOST_RECORDS)
    if every > 1:
        last = result.sizes["time"] - 1
        result = result.isel(time=slice(last % every, None, every)).load()
    t = result["time"].values
    return View(
        result=result,
        scenario=scenario,
        omega0_rad_s=scenario.orbit.rate_rad_s(scenario.start),
        t_s=t,
        eclipses=tuple(bands_where(t, 1.0 - result["sunlit_fraction"].values)),
        every=every,
        summary=summary,
    )
