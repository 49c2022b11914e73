"""Work of `field orbit` and `field cone`: the field along an orbit as tables, JSON, pictures."""

import math
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError

from torquer.base.limits import given
from torquer.base.strict_json import json_text
from torquer.cli.commands.field import ConeOptions, OrbitOptions
from torquer.cli.commands.field_at import label, model_of, moment, stamp
from torquer.cli.options import option as option_of
from torquer.cli.output import make_writable, writing_to
from torquer.environment.along_orbit import Environment
from torquer.environment.field.along import FieldsAlong, angles_deg, fields_along
from torquer.environment.orbit import AnyOrbit, Circular, Sgp4

#: Default models of `torquer field cone`.
CONE_MODELS = ("igrf14", "tilted_dipole", "direct_dipole", "averaged")
_MOST_MODELS, _MOST_STEPS = 6, 200_000
#: Rows of the thinned table.
_ROWS = 19
_SIZES = ("least_nt", "mean_nt", "greatest_nt")


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


# ------------------------------------------------------------ what is computed


def case_of(how: OrbitOptions, option: str = "--start") -> OrbitCase:
    """The orbit of one of three sources: a circle, an element set, a scenario.

    `option`: the one that gave the start.
    """
    circle = given(how, "altitude_km", "inclination_deg", "raan_deg")
    sources = [*map(option_of, [*circle][:1]), *map(option_of, given(how, "tle", "scenario"))]
    if len(sources) != 1:
        raise ValueError(
            "orbit: must be given by --altitude-km and --inclination-deg, by --tle or by "
            f"--scenario; received {' and '.join(sources) or 'none of them'}"
        )
    begin = None if how.start is None else moment(how.start, option)
    if how.scenario:
        case = _case_of_scenario(how.scenario, begin)
    else:
        orbit = _orbit_of_tle(how.tle) if how.tle else _circular(circle)
        if begin is None and not how.tle:
            raise ValueError("--start: must be given with --altitude-km; received nothing")
        circular = f"{how.altitude_km:g} km, {how.inclination_deg:g}°" if not how.tle else ""
        name = how.tle.name if how.tle else circular
        case = OrbitCase(orbit, begin or _epoch(orbit), Environment().earth_rotation, name=name)
    dut1_s = how.ut1_minus_utc_s
    return case if dut1_s is None else case._replace(dut1_s=dut1_s)


def _case_of_scenario(path: Path, begin: datetime | None) -> OrbitCase:
    from torquer.scenario.load import load_scenario

    scenario = load_scenario(path)
    environment = scenario.environment
    start = begin or scenario.start
    return OrbitCase(
        scenario.orbit, start, environment.earth_rotation, environment.field, scenario.name,
        environment.ut1_minus_utc_s,
    )  # fmt: skip


def _circular(keys: dict) -> Circular:
    for key in ("altitude_km", "inclination_deg"):
        if key not in keys:
            raise ValueError(f"{option_of(key)}: must be given; received nothing")
    try:
        return Circular(**keys)
    except ValidationError as error:
        lines = _lines(error, keys)
    raise ValueError("\n".join(re.sub(r"^(?!orbit)\w+(?=:)", _as_option, line) for line in lines))


def _as_option(key: re.Match) -> str:
    return option_of(key[0])


def _lines(error: ValidationError, data: dict) -> list[str]:
    from torquer.scenario.explain import explain

    return explain(error, data)


def _orbit_of_tle(path: Path) -> Sgp4:
    from torquer.scenario.load import text_of

    text = text_of(path, "--tle")
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


def _models(case: OrbitCase, names, default=("igrf14",)) -> tuple:
    """The case's own field and the named models, each once; else the default."""
    own = () if case.field is None else (case.field,)
    if not own and not names:
        names = default
    models: dict[str, object] = {}
    for model in (*own, *(model_of(name) for name in names or ())):
        models.setdefault(label(model), model)
    if len(models) > _MOST_MODELS:
        raise ValueError(
            f"--model: must be given at most {_MOST_MODELS} times; received {len(models)}"
        )
    return tuple(models.values())


def instants(period_s: float, revolutions, duration_min, step_s: float) -> np.ndarray:
    """Seconds from the start, both ends included."""
    if revolutions is not None and duration_min is not None:
        raise ValueError("--duration-min: must not be given with --revolutions; received both")
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


# ------------------------------------------------------------ along an orbit


def orbit(how: OrbitOptions) -> int:
    """Print the field along an orbit; draw it if a folder is given."""
    case = case_of(how)
    t_s = instants(case.orbit.period_s, how.revolutions, how.duration_min, how.step_s)
    models = _models(case, how.model)
    if how.out is not None:
        make_writable(how.out)
    along = _along(models, case, t_s, "--start")
    labels = [label(model) for model in models]
    if how.out is not None:
        from torquer.report.field.along import draw_along

        with writing_to(how.out):
            draw_along(along, labels, f"{case.name}, from {stamp(case.start)}", how.out)
    if how.json:
        print(json_text(_along_data(case, along, labels), None))
        return 0
    print(
        f"{case.name}, {case.orbit.kind} orbit, from {stamp(case.start)}, {t_s[-1] / 60.0:.4g} min"
    )
    print("\n".join(["", *_summary_lines(along, labels), "", *_row_lines(along, labels[0])]))
    if how.out is not None:
        print(f"\n{how.out}: inertial.png, orbital.png")
    return 0


def _along(models: tuple, case: OrbitCase, t_s, option: str) -> FieldsAlong:
    """The fields; the error for a date beyond a model's validity names the option that gave it."""
    try:
        return fields_along(models, case.orbit, case.start, t_s, case.earth_rotation, case.dut1_s)
    except ValueError as error:
        key, _, rest = str(error).partition("environment.field: ")
        if key or not rest:
            raise
        raise ValueError(f"{option}: {rest}") from None


def _along_data(case: OrbitCase, along: FieldsAlong, labels: list[str]) -> dict:
    """Data of `--json`: the orbit once, then the field of each model."""
    return {
        "orbit": case.orbit.model_dump(),
        "start": case.start.isoformat(),
        "time_s": _rounded(along.t_s, 6),
        "argument_of_latitude_deg": _rounded(along.u_deg, 6),
        "latitude_deg": _rounded(along.lat_deg, 6),
        "longitude_deg": _rounded(along.lon_deg, 6),
        "height_km": _rounded(along.height_km, 6),
        "fields": [
            {
                "model": name,
                "b_inertial_nt": _rounded(1e9 * along.b_inertial[m], 4),
                "b_orbital_nt": _rounded(1e9 * along.b_orbital[m], 4),
                "strength_nt": _rounded(1e9 * along.strength[m], 4),
                "angle_to_first_deg": _rounded(along.angle_to_first_deg[m], 6),
            }
            for m, name in enumerate(labels)
        ],
    }


def _summary_lines(along: FieldsAlong, labels: list[str]) -> list[str]:
    wide = max(14, *map(len, labels))
    compared = len(labels) > 1
    head = f"{'':<{wide}}{'|B| min':>11}{'mean':>9}{'max nT':>13}"
    lines = [head + (f"   angle to {labels[0]}: mean, max deg" if compared else "")]
    for name, size, angle in zip(labels, along.strength, along.angle_to_first_deg, strict=True):
        least, mean, most = (1e9 * f(size) for f in (np.min, np.mean, np.max))
        line = f"{name:<{wide}}{least:>11.0f}{mean:>9.0f}{most:>13.0f}"
        if compared and name != labels[0]:
            line += f"{'':<{len(labels[0]) + 5}}{angle.mean():>14.3f}{angle.max():>14.3f}"
        lines.append(line)
    return lines


def _row_lines(along: FieldsAlong, first: str) -> list[str]:
    """A thinned table of the first model."""
    rows = np.unique(np.linspace(0, len(along.t_s) - 1, _ROWS).round().astype(int))
    lines = [
        f"{first} in nT, inertial (x y z) and orbital (along-track, orbit normal, radial)",
        f"{'t min':>8}{'u deg':>7}{'lat':>7}{'lon':>8}{'km':>7}"
        f"{'x':>9}{'y':>8}{'z':>8}{'along':>9}{'normal':>8}{'radial':>8}{'|B|':>8}",
    ]
    for n in rows:
        place = f"{along.lat_deg[n]:>7.1f}{along.lon_deg[n]:>8.1f}{along.height_km[n]:>7.0f}"
        inertial, orbital = 1e9 * along.b_inertial[0, n], 1e9 * along.b_orbital[0, n]
        numbers = (*inertial, *orbital, 1e9 * along.strength[0, n])
        widths = (9, 8, 8, 9, 8, 8, 8)
        shown = "".join(f"{x:>{w}.0f}" for x, w in zip(numbers, widths, strict=True))
        lines.append(f"{along.t_s[n] / 60.0:>8.2f}{along.u_deg[n]:>7.1f}{place}{shown}")
    return lines


def _rounded(values, digits: int) -> list:
    return np.round(values, digits).tolist()


# ------------------------------------------------------------ the cone


def cone(how: ConeOptions) -> int:
    """Draw the cone and the hodographs; print the largest deviation from the cone."""
    from torquer.analysis.field.field_cone import cone_of
    from torquer.report.field.cone import draw_cone, write_cone_page

    circle = OrbitOptions(
        altitude_km=how.altitude_km, inclination_deg=how.inclination_deg, raan_deg=how.raan_deg,
        start=how.date,
    )  # fmt: skip
    case = case_of(circle, "--date")
    models = _models(case, how.model, CONE_MODELS)
    period_s = case.orbit.period_s
    t_s = instants(period_s, how.revolutions, None, period_s / 360.0)
    make_writable(how.out)
    along = _along(models, case, t_s, "--date")
    labels, title = [label(m) for m in models], f"{case.name}, from {stamp(case.start)}"
    shape = cone_of(case.orbit)
    with writing_to(how.out):
        draw_cone(along, labels, shape, title, how.out / "cone.png")
        write_cone_page(along, labels, shape, title, how.out / "cone.html")
    data = _cone_data(case, along, labels, shape)
    if how.json:
        print(json_text(data))
        return 0
    print(f"{title}: cone of half-angle {shape.half_angle_deg:.3f} deg, {shape.b0_t * 1e9:.0f} nT")
    print(f"{'':<15}{'|B| min':>10}{'mean':>8}{'max nT':>13}{'from the cone':>15} deg at most")
    for each in data["models"]:
        sizes = (f"{each[k]:>{w}.0f}" for k, w in zip(_SIZES, (10, 8, 13), strict=True))
        print(f"{each['model']:<15}{''.join(sizes)}{each['greatest_off_cone_deg']:>15.3f}")
    print(f"{how.out}: cone.png, cone.html")
    return 0


def _sizes_nt(strength_t) -> dict[str, float]:
    found = (np.min(strength_t), np.mean(strength_t), np.max(strength_t))
    return {key: float(1e9 * size) for key, size in zip(_SIZES, found, strict=True)}


def _cone_data(case: OrbitCase, along: FieldsAlong, labels: list[str], shape) -> dict:
    off = np.abs(angles_deg(along.b_y, shape.axis_y) - shape.half_angle_deg)
    models = [
        {
            "model": name,
            **_sizes_nt(size),
            "greatest_off_cone_deg": float(each.max()),
        }
        for name, size, each in zip(labels, along.strength, off, strict=True)
    ]
    return {
        "orbit": case.orbit.model_dump(),
        "start": case.start.isoformat(),
        "half_angle_deg": shape.half_angle_deg,
        "b0_nt": 1e9 * shape.b0_t,
        "models": models,
    }
