"""Options of the field commands: models, dates, orbits, instants; one clear line per mistake."""

import math
import re
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError

from torquer.environment.along_orbit import Environment
from torquer.environment.field import FIELDS
from torquer.environment.field.coefficients import max_degree
from torquer.environment.field.gauss import Gauss
from torquer.orbit import AnyOrbit, Circular, Sgp4
from torquer.time import parse_utc

ELEMENTS = ("X", "Y", "Z", "H", "F", "D", "I")
#: Default models of `torquer field cone`.
CONE_MODELS = ("igrf14", "tilted_dipole", "direct_dipole", "averaged")
MOST_MODELS = 6
_MOST_STEPS = 200_000
#: Heights [km] for which a model of the core field is meaningful.
_LOWEST_KM, _HIGHEST_KM = -10.0, 50_000.0


class OrbitCase(NamedTuple):
    """Orbit, start, Earth rotation, and the field of the scenario, if any.

    `dut1_s`: UT1 - UTC at the start.
    """

    orbit: AnyOrbit
    start: datetime
    earth_rotation: str
    field: object = None
    name: str = ""
    dut1_s: float = 0.0


def moment(text: str, option: str = "--date") -> datetime:
    """UTC of a date (at 00:00), a time with a zone, or a decimal year."""
    try:
        return _within_years(_moment(text))
    except (ValueError, OverflowError):
        raise ValueError(
            f"{option}: must be a date (2025-07-01), a time with a zone (2025-07-01T12:00Z) or a "
            f"decimal year (2025.5), within 1900 to 2099; received {text!r}"
        ) from None


def _moment(text: str) -> datetime:
    if re.fullmatch(r"\d{4}(\.\d*)?", text):
        year = int(text[:4])
        begin, end = (datetime(y, 1, 1, tzinfo=UTC) for y in (year, year + 1))
        return begin + (end - begin) * (float(text) - year)
    try:
        day = date.fromisoformat(text)
    except ValueError:
        return parse_utc(text)
    return datetime(day.year, day.month, day.day, tzinfo=UTC)


def _within_years(instant: datetime) -> datetime:
    if not 1900 <= instant.year < 2100:
        raise ValueError
    return instant


def model_of(text: str, degree: int | None = None):
    """The field model of `name` or `name:degree`."""
    name, _, digits = text.partition(":")
    if name not in FIELDS:
        raise ValueError(f"--model: must be one of {', '.join(FIELDS)}; received {name!r}")
    degree = _degree(text, digits) if digits or text.endswith(":") else degree
    if degree is None:
        return FIELDS[name]()
    if not issubclass(FIELDS[name], Gauss):
        raise ValueError(f"--degree: must go with igrf14 or wmm2025; received it with {name}")
    if not 1 <= degree <= max_degree(name):
        raise ValueError(
            f"--degree: must lie within 1..{max_degree(name)} for {name}; received {degree}"
        )
    return FIELDS[name](degree=degree)


def extrapolated(model, wanted: bool):
    """The model, to be used beyond its validity if so asked."""
    if not wanted:
        return model
    if "extrapolate" not in type(model).model_fields:
        raise ValueError(
            f"--extrapolate: must go with a model that has dates; received it with {model.kind}"
        )
    return model.model_copy(update={"extrapolate": True})


def _degree(text: str, digits: str) -> int:
    if not re.fullmatch(r"\d{1,4}", digits):
        raise ValueError(f"--model: must end with a degree, as in igrf14:6; received {text!r}")
    return int(digits)


def label(model) -> str:
    """A model's name in tables and pictures, marked where it is not the plain model."""
    if getattr(model, "extrapolate", False):
        model = model.model_copy(update={"extrapolate": False})
    if model == FIELDS[model.kind]():
        return model.kind
    if isinstance(model, Gauss) and model == FIELDS[model.kind](degree=model.degree):
        whole = model.degree == max_degree(model.kind)
        return model.kind if whole else f"{model.kind}:{model.degree}"
    return f"{model.kind} (scenario)"


def with_models(case: OrbitCase, names, default=("igrf14",)) -> tuple:
    """The case's own field and the named models, each once; else the default."""
    own = () if case.field is None else (case.field,)
    if not own and not names:
        names = default
    models: dict[str, object] = {}
    for model in (*own, *(model_of(name) for name in names or ())):
        models.setdefault(label(model), model)
    if len(models) > MOST_MODELS:
        raise ValueError(
            f"--model: must be given at most {MOST_MODELS} times; received {len(models)}"
        )
    return tuple(models.values())


def case_of(circular: dict, tle, scenario, start: str | None, option: str = "--start") -> OrbitCase:
    """The orbit of one of three sources: a circle, an element set, a scenario."""
    given = [f"--{key.replace('_', '-')}" for key, value in circular.items() if value is not None]
    sources = [*given[:1], *(["--tle"] if tle else []), *(["--scenario"] if scenario else [])]
    if len(sources) != 1:
        raise ValueError(
            "orbit: must be given by --altitude-km and --inclination-deg, by --tle or by "
            f"--scenario; received {' and '.join(sources) or 'none of them'}"
        )
    begin = None if start is None else moment(start, option)
    if scenario:
        return _case_of_scenario(scenario, begin)
    orbit = _orbit_of_tle(tle) if tle else _circular(circular)
    if begin is None and not tle:
        raise ValueError("--start: must be given with --altitude-km; received nothing")
    name = Path(tle).name if tle else f"{orbit.altitude_km:g} km, {orbit.inclination_deg:g}°"
    return OrbitCase(orbit, begin or _epoch(orbit), Environment().earth_rotation, name=name)


def with_ut1(case: OrbitCase, ut1_minus_utc_s: float | None) -> OrbitCase:
    """The case with the given UT1 - UTC, if any."""
    if ut1_minus_utc_s is None:
        return case
    if not abs(ut1_minus_utc_s) <= 0.9:
        raise ValueError(
            f"--ut1-minus-utc-s: must lie within -0.9..0.9; received {ut1_minus_utc_s:g}"
        )
    return case._replace(dut1_s=ut1_minus_utc_s)


def _case_of_scenario(path: Path, begin: datetime | None) -> OrbitCase:
    from torquer.scenario.load import load_scenario

    scenario = load_scenario(path)
    around = scenario.environment
    start = begin or scenario.start
    return OrbitCase(
        scenario.orbit, start, around.earth_rotation, around.field, scenario.name,
        around.ut1_minus_utc_s,
    )  # fmt: skip


def _circular(keys: dict) -> Circular:
    given = {key: value for key, value in keys.items() if value is not None}
    for key in ("altitude_km", "inclination_deg"):
        if key not in given:
            raise ValueError(f"--{key.replace('_', '-')}: must be given; received nothing")
    try:
        return Circular(**given)
    except ValidationError as error:
        lines = _lines(error, given)
    raise ValueError("\n".join(re.sub(r"^\w+(?=:)", _option, line) for line in lines))


def _lines(error: ValidationError, data: dict) -> list[str]:
    from torquer.scenario.explain import explain

    return explain(error, data)


def _option(key: re.Match) -> str:
    return "orbit" if key[0] == "orbit" else f"--{key[0].replace('_', '-')}"


def _orbit_of_tle(path: Path) -> Sgp4:
    from torquer.scenario.load import text_of

    text = text_of(Path(path), "--tle")
    try:
        return Sgp4(tle=text)
    except ValidationError as error:
        lines = _lines(error, {"tle": text})
    raise ValueError("\n".join(f"--tle: {line.removeprefix('tle: ')}" for line in lines))


def _epoch(orbit: Sgp4) -> datetime:
    """Epoch of an element set, to the second: two-digit years from 57 on are of the 1900s."""
    first = orbit.tle[0]
    year = int(first[18:20])
    begin = datetime(year + (1900 if year >= 57 else 2000), 1, 1, tzinfo=UTC)
    return begin + timedelta(seconds=round(86400.0 * (float(first[20:32]) - 1.0)))


def instants(period_s: float, revolutions, duration_min, step_s: float) -> np.ndarray:
    """Seconds from the start, both ends included."""
    if revolutions is not None and duration_min is not None:
        raise ValueError("--duration-min: must not be given with --revolutions; received both")
    given = (("--revolutions", revolutions), ("--duration-min", duration_min), ("--step-s", step_s))
    for name, value in given:
        if value is not None and not 0.0 < value < math.inf:
            raise ValueError(f"{name}: must be a positive number; received {value:g}")
    if duration_min is None:
        length = (1.0 if revolutions is None else revolutions) * period_s
    else:
        length = 60.0 * duration_min
    if length / step_s > _MOST_STEPS:
        raise ValueError(
            f"--step-s: must divide the time into at most {_MOST_STEPS} steps; received "
            f"{length / step_s:.3g} steps of {step_s:g} s"
        )
    t_s = step_s * np.arange(math.floor(length / step_s) + 1)
    return t_s if length - t_s[-1] < 1e-6 * step_s else np.append(t_s, length)


def check_place(lat: float, lon: float, alt_km: float) -> None:
    """Raise `ValueError` for an invalid place, or one beyond the range of the models."""
    ranges = (
        ("--lat", lat, -90.0, 90.0, "deg"),
        ("--lon", lon, -180.0, 360.0, "deg"),
        ("--alt-km", alt_km, _LOWEST_KM, _HIGHEST_KM, "km"),
    )
    for name, value, low, high, unit in ranges:
        if not low <= value <= high:
            raise ValueError(
                f"{name}: must lie within {low:g}..{high:g} {unit}; received {value:g}"
            )


def check_earth_fixed(model) -> None:
    """Raise `ValueError` for a model without values at points."""
    if not hasattr(model, "b_earth_fixed"):
        others = ", ".join(k for k, v in FIELDS.items() if hasattr(v, "b_earth_fixed"))
        raise ValueError(
            f"--model: {model.kind} is defined along an orbit only; must be one of {others}"
        )
