"""Units at the ends of names, for hints: a name near another one, of the same unit or converted."""

import difflib
import math
from collections.abc import Collection
from typing import NamedTuple


class Unit(NamedTuple):
    """How a unit is written, what it measures, and its size in one of the units of the same."""

    text: str
    measures: str
    size: float


_DEG = math.pi / 180.0
#: Units by how a name ends; the longest ending counts. Also of data sheets, which no key has.
UNITS = {
    "rad": Unit("rad", "angle", 1.0),
    "deg": Unit("deg", "angle", _DEG),
    "mrad": Unit("mrad", "angle", 1e-3),
    "arcmin": Unit("arcmin", "angle", _DEG / 60.0),
    "arcsec": Unit("arcsec", "angle", _DEG / 3600.0),
    "rad_s": Unit("rad/s", "rate", 1.0),
    "deg_s": Unit("deg/s", "rate", _DEG),
    "deg_h": Unit("deg/h", "rate", _DEG / 3600.0),
    "mrad_s": Unit("mrad/s", "rate", 1e-3),
    "rpm": Unit("rpm", "rate", math.pi / 30.0),
    "rad_s2": Unit("rad/s^2", "acceleration", 1.0),
    "deg_s2": Unit("deg/s^2", "acceleration", _DEG),
    "deg_sqrt_s": Unit("deg/sqrt(s)", "angle random walk", 1.0),
    "deg_sqrt_h": Unit("deg/sqrt(h)", "angle random walk", 1.0 / 60.0),
    "deg_s_sqrt_s": Unit("deg/s/sqrt(s)", "rate random walk", 1.0),
    "deg_h_sqrt_h": Unit("deg/h/sqrt(h)", "rate random walk", 1.0 / 216_000.0),
    "deg_s_sqrt_hz": Unit("deg/s/sqrt(Hz)", "density of a rate", 1.0),
    "nt_sqrt_hz": Unit("nT/sqrt(Hz)", "density of a field", 1.0),
    "s": Unit("s", "time", 1.0),
    "us": Unit("us", "time", 1e-6),
    "ms": Unit("ms", "time", 1e-3),
    "min": Unit("min", "time", 60.0),
    "h": Unit("h", "time", 3600.0),
    "hours": Unit("h", "time", 3600.0),
    "days": Unit("days", "time", 86400.0),
    "hz": Unit("Hz", "frequency", 1.0),
    "per_s": Unit("1/s", "frequency", 1.0),
    "m": Unit("m", "length", 1.0),
    "mm": Unit("mm", "length", 1e-3),
    "cm": Unit("cm", "length", 1e-2),
    "km": Unit("km", "length", 1e3),
    "m_s": Unit("m/s", "speed", 1.0),
    "km_s": Unit("km/s", "speed", 1e3),
    "m2": Unit("m^2", "area", 1.0),
    "cm2": Unit("cm^2", "area", 1e-4),
    "mm2": Unit("mm^2", "area", 1e-6),
    "kg": Unit("kg", "mass", 1.0),
    "g": Unit("g", "mass", 1e-3),
    "kg_m3": Unit("kg/m^3", "density", 1.0),
    "kg_m2": Unit("kg m^2", "inertia", 1.0),
    "kg_cm2": Unit("kg cm^2", "inertia", 1e-4),
    "kg_mm2": Unit("kg mm^2", "inertia", 1e-6),
    "g_cm2": Unit("g cm^2", "inertia", 1e-7),
    "m3": Unit("m^3", "volume", 1.0),
    "cm3": Unit("cm^3", "volume", 1e-6),
    "mm3": Unit("mm^3", "volume", 1e-9),
    "a_m": Unit("A/m", "magnetic field strength", 1.0),
    "t": Unit("T", "field", 1.0),
    "mt": Unit("mT", "field", 1e-3),
    "ut": Unit("uT", "field", 1e-6),
    "nt": Unit("nT", "field", 1e-9),
    "nt_s": Unit("nT/s", "rate of a field", 1e-9),
    "t_s": Unit("T/s", "rate of a field", 1.0),
    "gauss": Unit("gauss", "field", 1e-4),
    "a_m2": Unit("A m^2", "dipole", 1.0),
    "ma_m2": Unit("mA m^2", "dipole", 1e-3),
    "a_cm2": Unit("A cm^2", "dipole", 1e-4),
    "nt_per_a_m2": Unit("nT/(A m^2)", "field of a dipole", 1.0),
    "t_km3": Unit("T km^3", "dipole of the Earth", 1.0),
    "n_m": Unit("N m", "torque", 1.0),
    "mn_m": Unit("mN m", "torque", 1e-3),
    "un_m": Unit("uN m", "torque", 1e-6),
    "n_m_sqrt_s": Unit("N m sqrt(s)", "random torque", 1.0),
    "n_m_s": Unit("N m s", "momentum", 1.0),
    "mn_m_s": Unit("mN m s", "momentum", 1e-3),
    "un_m_s": Unit("uN m s", "momentum", 1e-6),
    "w": Unit("W", "power", 1.0),
    "mw": Unit("mW", "power", 1e-3),
    "v": Unit("V", "voltage", 1.0),
    "mv": Unit("mV", "voltage", 1e-3),
    "a": Unit("A", "current", 1.0),
    "ma": Unit("mA", "current", 1e-3),
    "ohm": Unit("ohm", "resistance", 1.0),
    "ppm": Unit("ppm", "share", 1.0),
    "a_m2_s": Unit("A m^2 s", "gain on a rate", 1.0),
    "a_m2_s_per_t": Unit("A m^2 s/T", "gain on a field's rate", 1.0),
    "a_m2_per_t": Unit("A m^2/T", "gain on a field", 1.0),
    "a_m2_per_n_m_s_t": Unit("A m^2/(N m s T)", "gain on a momentum", 1.0),
    "n_m_s_per_t2": Unit("N m s/T^2", "gain on a rate across the field", 1.0),
    "n_m_per_t2": Unit("N m/T^2", "gain on an angle across the field", 1.0),
}
_RANDOM_WALK, _NOISE = "angle random walk", "noise_deg_s"
#: So many names are looked at; alike before their units are names from this ratio on.
_MOST, _ALIKE = 8, 0.5


def unit_of(name: str) -> Unit | None:
    """The unit at the end of a name; None of a name without."""
    return UNITS.get(_ending(name))


def _ending(name: str) -> str:
    plain = f"_{'_'.join(_words(name))}"
    return max((end for end in UNITS if plain.endswith(f"_{end}")), key=len, default="")


def _words(name: str) -> list[str]:
    return name.lower().replace("-", "_").split("_")


def _is_slip_of(name: str, known: str) -> bool:
    """Whether a name ends in the known one's unit but for a letter, as in noise_dg_s."""
    own, other = _words(_ending(name)), _words(_ending(known))
    if not 0 < len(own) < len(other) or other[-len(own) :] != own:
        return False
    before = _words(name)[: -len(own)][-1:]
    return bool(difflib.get_close_matches("".join(before), [other[-len(own) - 1]], 1, 0.7))


def conversion(name: str, known: str) -> str | None:
    """How the number of a known name follows from that of a name, as a sentence.

    "" if it is the same number; None if it is that of another quantity.
    """
    own, other = unit_of(name), unit_of(known)
    if own is None or own == other or _is_slip_of(name, known):
        return ""
    if other is None:
        return None
    if own.measures == other.measures:
        return f"1 {own.text} is {own.size / other.size:.6g} {other.text}"
    if own.measures == _RANDOM_WALK and known == _NOISE:
        by_60 = " / 60" if own.text == "deg/sqrt(h)" else ""
        return f"It is the angle random walk in {own.text}{by_60} / sqrt(sample_s)"
    if (own.text, other.text) == ("Hz", "s"):
        return "It is 1 over the frequency"
    return None


def near_names(name: str, known: Collection[str], most: int, cutoff: float = 0.6) -> list[str]:
    """Known names near a name, nearest first, but for those of another quantity."""
    near = difflib.get_close_matches(name, known, max(most, _MOST), cutoff)
    near = [each for each in near if _says_same(name, each)]
    if (own := unit_of(name)) and own.measures == _RANDOM_WALK and _NOISE in known:
        near.append(_NOISE)
    return list(dict.fromkeys(each for each in near if conversion(name, each) is not None))[:most]


def _says_same(name: str, known: str) -> bool:
    """Whether two names are alike before their units: noise_deg_s is no slip for range_deg_s."""
    one, two = ("_".join(_words(each)).removesuffix(_ending(each)) for each in (name, known))
    alike = difflib.SequenceMatcher(None, one.strip("_"), two.strip("_")).ratio() >= _ALIKE
    return alike or unit_of(name) is None


def did_you_mean(name: str, known: Collection[str], cutoff: float = 0.6, dashes: str = "") -> str:
    """In brackets, for the end of a message: the nearest name, with the conversion; "" for none.

    `dashes`: what stands before the name of an option.
    """
    near = near_names(name, known, 1, cutoff)
    if not near:
        return ""
    how = conversion(name, near[0])
    return f" (did you mean {dashes}{near[0]}?{f' {how}' if how else ''})"
