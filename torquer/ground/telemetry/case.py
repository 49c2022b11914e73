"""Flight data checked against the field along the orbit, as `torquer telemetry` does."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.base.limits import RequestError
from torquer.computer.estimation.filter import Filter
from torquer.ground.telemetry.attitude import load_filter
from torquer.ground.telemetry.calibration import MODELS, split_shift
from torquer.ground.telemetry.diagnosis.causes import Known
from torquer.ground.telemetry.examination import Examination, Split
from torquer.ground.telemetry.examine import examine
from torquer.ground.telemetry.modulus import session_middle
from torquer.ground.telemetry.orbit import age_days, load_neighbours, load_orbit
from torquer.ground.telemetry.reading.mapping import load_mapping
from torquer.ground.telemetry.reading.positions import say_place
from torquer.ground.telemetry.reading.read import Session, read
from torquer.ground.telemetry.request import Model, TelemetryRequest
from torquer.ground.telemetry.vector import MODEL
from torquer.scenario.load import load_scenario
from torquer.scenario.spec import Scenario

#: Groups of parameters of a calibration by its last part.
_GROUPS = dict(zip(get_args(Model), (*MODELS, MODEL), strict=True))


class Case(NamedTuple):
    """Telemetry and all that it is checked with, loaded; `about`: the orbit in words."""

    session: Session
    orbit: Any
    about: str
    filter: Filter | None
    twin: Scenario | None
    asked: TelemetryRequest

    def examine(self) -> Examination:
        """The telemetry, examined; minutes with a twin."""
        asked = self.asked
        groups = None if asked.model is None else _GROUPS[asked.model]
        found = examine(
            self.session,
            self.orbit,
            groups,
            60.0 * asked.leave_out_first_min,
            self.filter,
            self.twin,
            self._known(),
        )
        return found._replace(orbit=self.about, split=_split(found, asked))

    def _known(self) -> Known:
        """What the diagnosis may rely on."""
        data = self.session.data
        if self.orbit is None:
            return Known(self.session.zone_is_stated)
        at = session_middle(data)
        age, others = age_days(self.orbit, at), load_neighbours(self.orbit, at)
        return Known(self.session.zone_is_stated, age, others)


def check(
    files: Path | str | Sequence[Path | str], asked: TelemetryRequest | None = None
) -> Examination:
    """Check the magnetometer in flight data against the field along the orbit, and calibrate it.

    `files`: CSV, Parquet, NetCDF, CDF or a ground archive. RequestError for a mistake in the
    request or in a file that it names, ValueError for one in the telemetry.

        from torquer.ground.telemetry import TelemetryRequest, check

        found = check("pass.nc", TelemetryRequest(orbit=Path("my_satellite.tle")))
        found.verdict                    # "calibrated to 48 nT with bias, scale, ..."
        found.calibration.bias           # [3] T
        found.calibrated                 # an xarray.Dataset with units
    """
    return load_case(files, asked or TelemetryRequest()).examine()


def load_case(files: Path | str | Sequence[Path | str], asked: TelemetryRequest) -> Case:
    """The telemetry of files, with the orbit, filter and scenario that a request names."""
    mapping = None if asked.mapping is None else load_mapping(asked.mapping)
    session = read(files, mapping)
    orbit, about = None, "positions of the telemetry"
    if mapping is not None and mapping.place is not None:
        if asked.orbit is not None:
            raise RequestError(
                "orbit", "must be left out where the mapping states a place; received both"
            )
        about = say_place(mapping.place)
    if asked.orbit is not None:
        at = session_middle(session.data)
        orbit, about = load_orbit(asked.orbit, at, asked.satellite, asked.most_age_days)
    elif asked.satellite is not None:
        raise RequestError("satellite", "must be given with an orbit; received it without")
    filter_ = None if asked.filter is None else load_filter(asked.filter)
    twin = None if asked.twin is None else load_scenario(asked.twin)
    return Case(session, orbit, about, filter_, twin, asked)


def _split(found: Examination, asked: TelemetryRequest) -> Split | None:
    """The shift that was fitted, split by the errors of clock and elements, if these are stated."""
    clock_s, along_km, fit = asked.clock_sigma_s, asked.along_track_sigma_km, found.calibration
    if fit is None or "shift" not in fit.groups or clock_s is None or along_km is None:
        return None
    speed = float(np.sqrt(MU_EARTH_M3_S2 / float(np.mean(found.calibrated["Radius"]))))
    shift, sigma = fit.of("shift"), float(fit.sigmas["shift"])
    clock, along = split_shift(shift, sigma, clock_s, 1e3 * along_km, speed)
    return Split((float(clock[0]), float(clock[1])), (float(along[0]) / 1e3, float(along[1]) / 1e3))
