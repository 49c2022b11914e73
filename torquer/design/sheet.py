"""A commented scenario of a satellite from its size class and what its data sheet says."""

import math
import textwrap
import tomllib
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

import numpy as np

from torquer.base.limits import RequestError, given_values
from torquer.campaign.statistics import quantile
from torquer.design.detumbling import without_flights
from torquer.design.gain_sweep import GainSweep
from torquer.design.left_out import (
    SizeClass,
    Spread,
    centre_covariance,
    equal_box_m,
    exposed_parts,
    masses_of_box,
    residual_dipole_a_m2,
    sheet_rules,
    size_classes,
)
from torquer.design.requests import DetumbleRequest, SheetRequest
from torquer.scenario.load import scenario_from_text
from torquer.spacecraft.masses import MassProperties, mass_properties
from torquer.spacecraft.parts import AnyPart, Plate
from torquer.spacecraft.wheel_array.envelope import momentum_envelope, torque_envelope
from torquer.spacecraft.wheel_array.layout import WheelArray, four_sided_pyramid
from torquer.spacecraft.wheel_array.rates import worst_case

_TEMPLATE = Path(__file__).with_name("sheet_scenario.txt")
_MOTIONS = Path(__file__).with_name("sheet_motions.toml")
#: Rate that counts as stopped [deg/s]: well above that at which the field turns.
BELOW_DEG_S = 0.5
#: Releases of the campaign. Revolutions of a run: at least, times to stop by theory.
RUNS = 64
_LEAST, _TIMES = 4.0, 3.0
#: Part of what the wheels can do about their weakest axis that slews take, and at most [deg/s,
#: deg/s^2]; error that counts as held, over the noise of the attitude sensor.
_SLEWS, _MOST_SLEWS, _HELD = 0.25, (1.0, 0.1), 10.0
#: Keys of a request that take the place of the class's.
_OWN = ("mass_kg", "size_m", "limit_a_m2", "altitude_km", "inclination_deg")


class Sheet(NamedTuple):
    """A satellite from its data sheet.

    `satellite`: its class, with what was given in place of the class's values; `masses`, `parts`:
    mass properties, and what meets air and light; `box_m`: the uniform box of the same inertia;
    `dipole_a_m2`: size of the residual dipole; `gain` [A m^2 s/T] of B-dot by theory, and the time
    `promised_s` by which half of the releases stop with it; `text`: the scenario with its campaign.
    """

    satellite: SizeClass
    masses: MassProperties
    parts: tuple[AnyPart, ...]
    box_m: tuple[float, float, float]
    dipole_a_m2: Spread
    gain: float
    promised_s: float
    text: str


def from_sheet(request: SheetRequest) -> Sheet:
    """A scenario from a size class and what a data sheet says, with a campaign of what it does not.

        sheet = from_sheet(SheetRequest(like="3u", mass_kg=3.4, panels=2))
        sheet.gain, sheet.promised_s    # of B-dot, by theory
        Path("mine.toml").write_text(sheet.text)

    Inertia is that of a uniform box with its panels; air and light act on the faces of both; the
    residual dipole goes with the mass, unless it is given. RequestError for a class that is not
    known and for values that no satellite has.
    """
    satellite = _satellite(request)
    try:
        masses = masses_of_box(satellite.size_m, satellite.mass_kg, request.panels)
        parts = exposed_parts(satellite.size_m, satellite.mass_kg, request.panels)
    except ValueError as error:
        raise RequestError(*str(error).split(": ", 1)) from None
    whole = mass_properties(masses)
    dipole = residual_dipole_a_m2(satellite.mass_kg, request.dipole_a_m2)
    sheet = Sheet(
        satellite, whole, parts, equal_box_m(whole.inertia, satellite.mass_kg), dipole, 1.0, 1.0, ""
    )
    found = _by_theory(sheet, request)
    gain = float(f"{found.theory_gain:.3g}")
    sheet = sheet._replace(gain=gain, promised_s=quantile(found.releases_by_theory_s(gain), 0.5))
    period_s = 2.0 * math.pi / found.scenario.orbit.rate_rad_s(found.scenario.start)
    revolutions = math.ceil(max(_LEAST, _TIMES * sheet.promised_s / period_s))
    return sheet._replace(text=_text(sheet, request, revolutions))


def _satellite(request: SheetRequest) -> SizeClass:
    """The class, with what was given in place of its values."""
    known = size_classes()
    if request.like not in known:
        received = "nothing" if request.like is None else repr(request.like)
        raise RequestError("like", f"must be one of {', '.join(known)}; received {received}")
    return known[request.like]._replace(**given_values(request, *_OWN))


def _by_theory(sheet: Sheet, request: SheetRequest) -> GainSweep:
    """The case of B-dot without flights."""
    scenario = scenario_from_text(_text(sheet, replace(request, wheels=False), 1), "sheet")
    wanted = DetumbleRequest(
        tip_off_deg_s=sheet.satellite.tip_off_deg_s, rate_below_deg_s=BELOW_DEG_S
    )
    return without_flights(scenario, wanted)


def _text(sheet: Sheet, request: SheetRequest, revolutions: int) -> str:
    satellite, rules = sheet.satellite, sheet_rules()
    motions = tomllib.loads(_MOTIONS.read_text(encoding="utf-8"))
    motion = motions["wheels" if request.wheels else "tumbles"]
    words = {
        **{key: _number(value) for key, value in satellite._asdict().items() if _is_number(value)},
        **_words_of_class(satellite, request),
        **_words_of_body(sheet, request),
        **_words_of_dipole(sheet.dipole_a_m2, request),
        **_words_of_parts(sheet),
        **dict(zip(("f107_low", "f107", "f107_high"), rules["surface"]["f107"], strict=True)),
        "sources": _sources(satellite, request),
        "gain": _number(sheet.gain),
        "promise": f"{_number(sheet.promised_s / 3600.0, 3)} h for half of the releases",
        "revolutions": revolutions,
        "below_deg_s": BELOW_DEG_S,
        "runs": RUNS,
        **(_words_of_wheels(sheet) if request.wheels else {}),
    }
    parts = {key: Template(text.removesuffix("\n")).substitute(words)
             for key, text in motion.items()}  # fmt: skip
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(words | parts)


def _words_of_wheels(sheet: Sheet) -> dict[str, str]:
    """Slews that fit the wheels of the class, and the error that counts as held."""
    satellite, inertia = sheet.satellite, np.array(sheet.masses.inertia)
    axes = four_sided_pyramid(54.7356, 45.0)
    array = WheelArray(
        axes=tuple(map(tuple, axes.tolist())),
        momentum_limit_n_m_s=satellite.wheel_momentum_n_m_s,
        torque_limit_n_m=satellite.wheel_torque_n_m,
    )
    whole = (worst_case(each(array), inertia) for each in (momentum_envelope, torque_envelope))
    rate, acceleration = (
        min(most, _SLEWS * math.degrees(each.rate))
        for each, most in zip(whole, _MOST_SLEWS, strict=True)
    )
    return {
        "slew_deg_s": _number(_rounded_down(rate)),
        "slew_deg_s2": _number(_rounded_down(acceleration)),
        "held_deg": _number(_HELD * satellite.attitude_noise_deg),
    }


def _rounded_down(value: float) -> float:
    """To one digit."""
    unit = 10.0 ** math.floor(math.log10(value) + 1e-9)
    return math.floor(value / unit + 1e-9) * unit


def _words_of_class(satellite: SizeClass, request: SheetRequest) -> dict[str, Any]:
    rate = satellite.tip_off_deg_s / math.sqrt(3.0)
    return {
        "title": satellite.title,
        "asked": " ".join(_options(request)),
        "rate_deg_s": _plain((rate, -rate, rate)),
    }


def _options(request: SheetRequest) -> Iterator[str]:
    """The request as the options of `torquer init`."""
    for field in fields(request):
        if (value := getattr(request, field.name)) != field.default:
            words = value if isinstance(value, tuple) else (value,) if value is not True else ()
            shown = (each if isinstance(each, str) else f"{each:g}" for each in words)
            yield " ".join((f"--{field.name.replace('_', '-')}", *shown))


def _sources(satellite: SizeClass, request: SheetRequest) -> str:
    """Where the numbers come from, as a comment."""
    rules = sheet_rules()
    dipole = rules["dipole"]["source"]
    if request.dipole_a_m2 is not None:
        dipole = "as given; in the campaign a fifth less to a fifth more"
    sources = {
        "Class": satellite.source,
        "Inertia": rules["inertia"]["source"],
        "Residual dipole": dipole,
        "Air and light": rules["surface"]["source"],
        **({"Panels": rules["panel"]["source"]} if request.panels else {}),
    }
    lines = (textwrap.wrap(f"{what}: {each}.", 96) for what, each in sources.items())
    return "\n".join(f"#   {'  ' * (k > 0)}{line}" for each in lines for k, line in enumerate(each))


def _words_of_body(sheet: Sheet, request: SheetRequest) -> dict[str, str]:
    size, box = sheet.satellite.size_m, sheet.box_m
    low, high = (
        _plain([part * edge for edge in box]) for part in sheet_rules()["inertia"]["edges"]
    )
    moments = ", ".join(_number(sheet.masses.inertia[k][k]) for k in range(3))
    panels = f", {request.panels} panels" if request.panels else ""
    return {
        "size_words": " x ".join(map(_number, size)) + f" m{panels}",
        "and_panels": " and its panels" if panels else "",
        "moments": moments, "box_m": _plain(box), "box_low": low, "box_high": high,
    }  # fmt: skip


def _words_of_dipole(dipole: Spread, request: SheetRequest) -> dict[str, str]:
    measured = request.dipole_a_m2 is not None
    each = dipole.typical / math.sqrt(3.0)
    between = f"{_number(dipole.low)} to {_number(dipole.high)} A m^2"
    return {
        "dipole": _plain((each, each, each)),
        "dipole_words": f"{_number(dipole.typical)} A m^2 in all; {between} in the campaign",
        "drawn": "uniform" if measured else "log_uniform",
        "dipole_low": _number(dipole.low),
        "dipole_high": _number(dipole.high),
    }


def _words_of_parts(sheet: Sheet) -> dict[str, str]:
    """The exposed parts, and the shift of the centre of mass that moves them alike."""
    count, most = len(sheet.parts), sheet.satellite.centre_m
    rows = centre_covariance([0.5 * each for each in most], count)
    keys = (f'"spacecraft.aerodynamics.parts[{k}].centre_m"' for k in range(count))
    return {
        "parts": "\n".join(f"  {_part_in_toml(part)}," for part in sheet.parts),
        "centre_words": f"normal, two deviations {_plain(most)} m",
        "keys": "\n".join(f"  {key}," for key in keys),
        "changes": ", ".join(['"vector"'] * count),
        "covariance": "\n".join(f"  {_plain(row)}," for row in rows),
    }


def _part_in_toml(part: AnyPart) -> str:
    shape = ("axis", "area_m2") if isinstance(part, Plate) else ("size_m",)
    surface = ("centre_m", "drag_coefficient", "specular_reflectivity", "diffuse_reflectivity")
    keys = (f"{key} = {_plain(getattr(part, key))}" for key in (*shape, *surface))
    return f'{{ kind = "{part.kind}", {", ".join(keys)} }}'


def _is_number(value) -> bool:
    return isinstance(value, int | float)


def _number(value: float, digits: int = 4) -> str:
    """A number as people write it: 0.02, 2.1e-5; none of the size of rounding."""
    shown = f"{round(float(value), 12) + 0.0:.{digits}g}"
    return shown.replace("e-0", "e-").replace("e+0", "e")


def _plain(value) -> str:
    """A number, or a list of them."""
    return _number(value) if _is_number(value) else f"[{', '.join(map(_number, value))}]"
