"""A result seen by the report: its scenario, its orbit's rhythm, and what must be said about it."""

import json
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from torquer.control.off import Off
from torquer.environment.field import at_geodetic
from torquer.report.series import angle_deg, bands_where
from torquer.scenario.notes import notes_of
from torquer.simulation.result import COMPLETE, scenario_of
from torquer.simulation.spec import Scenario
from torquer.time import decimal_year

#: Turn between two records [deg] up to which the attitude between them can be told.
_FOLLOWED_DEG = 100.0


@dataclass(frozen=True)
class View:
    """A result with what every picture needs; made by `view_of`."""

    result: xr.Dataset
    scenario: Scenario
    omega0_rad_s: float
    t_s: np.ndarray
    eclipses: tuple[tuple[float, float], ...]

    def values(self, name: str) -> np.ndarray:
        """A variable of the result as an array, in SI units."""
        return self.result[name].values

    @property
    def end_s(self) -> float:
        """Time of the last record [s]."""
        return float(self.t_s[-1])

    @property
    def revolution_s(self) -> float:
        """Time of a revolution [s]."""
        return 2.0 * math.pi / self.omega0_rad_s

    @property
    def rate(self) -> np.ndarray:
        """Absolute rate [rad/s] at the records."""
        return np.linalg.norm(self.values("omega_body"), axis=1)

    def turn_between_records_deg(self, first: int = 0, last: int | None = None) -> float:
        """Greatest turn of the body [deg] between two records among rows first..last."""
        return math.degrees(float(self.rate[first:last].max())) * self.scenario.simulation.record_s

    def can_follow(self, first: int = 0, last: int | None = None) -> bool:
        """Whether records are close enough to tell the attitude between them."""
        return self.turn_between_records_deg(first, last) <= _FOLLOWED_DEG

    def to_inertial(self, t_s) -> np.ndarray:
        """Direction cosines [n, 3, 3], body to J, at times within the record, interpolated."""
        from scipy.spatial.transform import Rotation, Slerp

        turns = Rotation.from_quat(self.values("q_body_to_inertial"))
        if len(self.t_s) == 1:
            return np.repeat(turns.as_matrix(), len(t_s), axis=0)
        return Slerp(self.t_s, turns)(np.clip(t_s, self.t_s[0], self.end_s)).as_matrix()

    def at(self, name: str, t_s) -> np.ndarray:
        """A slowly changing vector [n, 3] at times within the record, interpolated."""
        columns = self.values(name).T
        return np.stack([np.interp(t_s, self.t_s, column) for column in columns], axis=1)

    @cached_property
    def field_map(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """(lon, lat, |B| [µT]) of the scenario's field at the orbit's mean height; None if the
        model is tied to the orbit and so has no map."""
        model = self.scenario.environment.field
        if not hasattr(model, "b_earth_fixed"):
            return None
        lat, lon = np.linspace(-90.0, 90.0, 61), np.linspace(-180.0, 180.0, 121)
        year, height_km = decimal_year(self.scenario.start), 1e-3 * self.values("altitude").mean()
        b = at_geodetic(model, year, lat[:, None], lon[None, :], height_km)
        return lon, lat, 1e6 * np.linalg.norm(b, axis=-1)


def view_of(result: xr.Dataset) -> View:
    """What the report needs of a result; `ValueError` for one without a single record."""
    if result.sizes["time"] == 0:
        raise ValueError("result: must hold at least one record; received none")
    scenario = scenario_of(result)
    t = result["time"].values
    return View(
        result=result,
        scenario=scenario,
        omega0_rad_s=scenario.orbit.rate_rad_s(scenario.start),
        t_s=t,
        eclipses=tuple(bands_where(t, 1.0 - result["lit"].values)),
    )


def fresh_rows(view: View) -> np.ndarray:
    """Rows recorded at a sampling instant: there, and only there, the reading belongs to the time.

    Between samples the record holds the last reading, which a turning body has left behind. The
    last row is such a one as well: it is written before the sensors are read again.
    """
    control, step_s = view.scenario.control, view.scenario.simulation.step_s
    steps = np.round(view.t_s / step_s).astype(np.int64)
    cycle, measure, sample = (
        round(x / step_s) for x in (control.cycle_s, control.measure_s, control.sample_s)
    )
    phase = steps % cycle
    fresh = (phase <= measure) & (phase % sample == 0)
    return np.flatnonzero(fresh[:-1])


def orbit_normals(view: View) -> np.ndarray:
    """Direction of the orbital momentum [n, 3] in J."""
    return np.cross(view.values("position_inertial"), view.values("velocity_inertial"))


def body_axes_from_vertical_deg(view: View) -> np.ndarray:
    """Angle [deg] of the body's x, y, z axes [n, 3] from the local vertical (up)."""
    up = view.values("position_inertial")
    axes = view.to_inertial(view.t_s)
    return np.stack([angle_deg(axes[:, :, i], up) for i in range(3)], axis=1)


def notes(view: View) -> list[str]:
    """What the reader should know before the numbers, one line each."""
    attrs = view.result.attrs
    told = []
    if attrs["ended"] != COMPLETE:
        told.append(f"this run is not complete: {attrs['ended']}")
    if attrs["law_runs_as"] != "compiled":
        told.append(f"the law {attrs['law']} runs as {attrs['law_runs_as']}")
    return [*told, *_notes_on_the_law(view), *_notes_on_the_record(view)]


def _notes_on_the_law(view: View) -> list[str]:
    law, control = view.scenario.control.law, view.scenario.control
    flown = json.loads(view.result.attrs["law_parameters"])
    if law.kind in ("user", view.result.attrs["law"]) and _same_gain(law, flown):
        return notes_of(view.scenario)
    # what is said of the scenario's own law does not hold for the one that took its place
    without_law = control.model_copy(update={"law": Off()})
    told = notes_of(view.scenario.model_copy(update={"control": without_law}))
    name = view.result.attrs["law"]
    return [f"the law {name} took the place of the scenario's own, {law.kind}", *told]


def _same_gain(law, flown: dict) -> bool:
    gain = getattr(law, "gain_a_m2_s_per_t", None)
    return gain is None or flown.get("gain") == gain


def _notes_on_the_record(view: View) -> list[str]:
    told = []
    if not view.can_follow():
        told.append(
            f"the body turns up to {view.turn_between_records_deg():.0f} deg between two records "
            f"({view.scenario.simulation.record_s:g} s apart): pictures of vectors in body axes "
            "show the envelope of fast turning, not each turn"
        )
    over = np.abs(view.values("b_body")).max(axis=1) > (
        1e-9 * view.scenario.spacecraft.magnetometer.range_nt
    )
    if over.any():
        part = f"{over.mean():.0%} of the record"
        told.append(f"the field was beyond the magnetometer's range in {part}")
    return told
