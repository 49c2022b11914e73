"""Several field models along one orbit: of a circle, an element set or a scenario."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from torquer.analysis.field.models import file_text, find_model, label, moment, stamp
from torquer.analysis.field.requests import FieldOrbitRequest
from torquer.base.explain import ScenarioError
from torquer.base.language import message
from torquer.base.limits import RequestError, given_values
from torquer.environment.along_orbit import Environment
from torquer.environment.field.along import fields_along
from torquer.environment.orbit import AnyOrbit, Circular, Sgp4

if TYPE_CHECKING:
    from torquer.scenario.spec import Scenario

#: Keys of a circular orbit.
CIRCLE = ("altitude_km", "inclination_deg", "raan_deg")
_MOST_MODELS, _MOST_STEPS = 6, 200_000


class OrbitCase(NamedTuple):
    """Orbit, start, Earth rotation, and the field of the scenario, if any.

    `dut1_s`: UT1 - UTC at the start.
    """

    orbit: AnyOrbit
    start: datetime
    earth_rotation: str = Environment().earth_rotation
    field: object = None
    name: str = ""
    dut1_s: float = 0.0


def field_orbit(asked: FieldOrbitRequest, scenario: Scenario | None = None) -> xr.Dataset:
    """The field along an orbit under one model or several, side by side.

        from torquer.analysis.field import FieldOrbitRequest, field_orbit
        field_orbit(FieldOrbitRequest(altitude_km=550.0, inclination_deg=97.6, start="2025-07-01"))

    The models are those named, after that of the scenario if there is one [igrf14]. A Dataset over
    `model` and `time` [s from the start]: position, `b_inertial` and `b_orbital` [T], `strength`
    [T], `angle_to_first` [deg]. `RequestError` for no orbit or more than one, and for a date that
    a model does not cover.
    """
    case = find_orbit_case(asked, scenario)
    t_s = instants(case.orbit.period_s, asked.revolutions, asked.duration_min, asked.step_s)
    return field_dataset(find_models(case, asked.model), case, t_s, "start")


def find_orbit_case(asked: FieldOrbitRequest, scenario: Scenario | None) -> OrbitCase:
    """The orbit of one of three sources: a circle, an element set, a scenario."""
    circle = given_values(asked, *CIRCLE)
    sources = [*[*circle][:1], *given_values(asked, "tle"), *["scenario"] * (scenario is not None)]
    if len(sources) != 1:
        received = " and ".join(f"{{{key}}}" for key in sources) or "none of them"
        raise RequestError(
            "",
            "orbit: must be given by {altitude_km} and {inclination_deg}, by {tle} or by "
            f"{{scenario}}; received {received}",
        )
    if scenario is not None:
        case = _case_from_scenario(scenario, asked.start)
    elif asked.tle is not None:
        orbit = _orbit_from_tle(asked.tle)
        begin = None if asked.start is None else moment(asked.start, "start")
        case = OrbitCase(orbit, begin or _epoch(orbit), name=asked.tle.name)
    else:
        case = make_circle(circle, asked.start, "start")
    dut1_s = asked.ut1_minus_utc_s
    return case if dut1_s is None else case._replace(dut1_s=dut1_s)


def make_circle(keys: dict, start: str | None, key: str) -> OrbitCase:
    """A circular orbit by its keys, from a start; `key`: that of the start in the request."""
    begin = None if start is None else moment(start, key)
    for name in CIRCLE[:2]:
        if name not in keys:
            raise RequestError(name, "must be given; received nothing")
    try:
        orbit = Circular(**keys)
    except ScenarioError as error:
        lines = str(error).split("\n")
        named = (re.sub(r"^(?!orbit)(\w+)(?=:)", r"{\1}", line) for line in lines)
        raise RequestError("", "\n".join(named)) from None
    if begin is None:
        raise RequestError("start", "must be given with {altitude_km}; received nothing")
    return OrbitCase(orbit, begin, name=f"{orbit.altitude_km:g} km, {orbit.inclination_deg:g}°")


def _case_from_scenario(scenario: Scenario, start: str | None) -> OrbitCase:
    environment = scenario.environment
    begin = scenario.start if start is None else moment(start, "start")
    return OrbitCase(
        scenario.orbit, begin, environment.earth_rotation, environment.field, scenario.name,
        environment.ut1_minus_utc_s,
    )  # fmt: skip


def _orbit_from_tle(path: Path) -> Sgp4:
    text = file_text(path, "tle")
    try:
        return Sgp4(tle=text)
    except ScenarioError as error:
        lines = str(error).split("\n")
    faults = (line.removeprefix("tle: ").replace("; orbit.", "; {scenario} with orbit.")
              for line in lines)  # fmt: skip
    raise RequestError("", "\n".join(f"{{tle}}: {fault}" for fault in faults))


def _epoch(orbit: Sgp4) -> datetime:
    """Epoch of an element set, to the second: two-digit years from 57 on are of the 1900s."""
    first = orbit.tle[0]
    year = int(first[18:20])
    begin = datetime(year + (1900 if year >= 57 else 2000), 1, 1, tzinfo=UTC)
    return begin + timedelta(seconds=round(86400.0 * (float(first[20:32]) - 1.0)))


def find_models(case: OrbitCase, names, default=("igrf14",)) -> tuple:
    """The case's own field and the named models, each once; else the default."""
    own = () if case.field is None else (case.field,)
    if not own and not names:
        names = default
    models: dict[str, object] = {}
    for model in (*own, *(find_model(name) for name in names or ())):
        models.setdefault(label(model), model)
    if len(models) > _MOST_MODELS:
        raise RequestError(
            "model", f"must be given at most {_MOST_MODELS} times; received {len(models)}"
        )
    return tuple(models.values())


def instants(period_s: float, revolutions, duration_min, step_s: float) -> np.ndarray:
    """Seconds from the start, both ends included."""
    if revolutions is not None and duration_min is not None:
        raise RequestError("duration_min", "must not be given with {revolutions}; received both")
    if duration_min is None:
        length = (1.0 if revolutions is None else revolutions) * period_s
    else:
        length = 60.0 * duration_min
    if length / step_s > _MOST_STEPS:
        raise RequestError(
            "step_s",
            f"must divide the time into at most {_MOST_STEPS} steps; received "
            f"{length / step_s:.3g} steps of {step_s:g} s",
        )
    t_s = step_s * np.arange(math.floor(length / step_s) + 1)
    return t_s if length - t_s[-1] < 1e-6 * step_s else np.append(t_s, length)


def field_dataset(models: tuple, case: OrbitCase, t_s, key: str) -> xr.Dataset:
    """The models' fields along an orbit; `key`: that of the start in the request, for the error of
    a date beyond a model's validity."""
    try:
        along = fields_along(models, case.orbit, case.start, t_s, case.earth_rotation, case.dut1_s)
    except ValueError as error:
        before, _, rest = str(error).partition("environment.field: ")
        if before or not rest:
            raise
        raise RequestError(key, rest) from None
    place = {
        "argument_of_latitude": ("time", along.u_deg, {"units": "deg"}),
        "latitude": ("time", along.lat_deg, {"units": "deg"}),
        "longitude": ("time", along.lon_deg, {"units": "deg"}),
        "height": ("time", along.height_km, {"units": "km"}),
    }
    whole, angle = {"units": "T"}, {"units": "deg"}
    inertial, orbital = {**whole, "frame": "J"}, {**whole, "frame": "X"}
    node = {**whole, "frame": "Y at the first instant"}
    fields = {
        "b_inertial": (("model", "time", "axis"), along.b_inertial, inertial),
        "b_orbital": (("model", "time", "orbital_axis"), along.b_orbital, orbital),
        "b_y": (("model", "time", "axis"), along.b_y, node),
        "strength": (("model", "time"), along.strength, whole),
        "angle_to_first": (("model", "time"), along.angle_to_first_deg, angle),
    }
    coordinates = {
        "model": [label(model) for model in models],
        "time": ("time", along.t_s, {"units": "s"}),
        "axis": ["x", "y", "z"],
        "orbital_axis": ["along-track", "orbit normal", "radial"],
    }
    about = {
        "title": message("{name}, from {start}", name=case.name, start=stamp(case.start)),
        "orbit": case.orbit.model_dump_json(),
        "start": case.start.isoformat(),
    }
    return xr.Dataset(place | fields, coordinates, about)
