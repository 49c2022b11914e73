"""The case of an averaged motion from a request or a scenario, with every mistake named."""

import math
from dataclasses import fields

import numpy as np

from torquer.base import validate
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.base.limits import RequestError, given_values
from torquer.environment.field.averaged import Averaged, mean_of_extremes
from torquer.environment.orbit.kepler import check_farthest
from torquer.scenario.spec import Scenario
from torquer.theory.averaged.case import (
    SAMPLED,
    AveragedCase,
    as_spinner,
    case_from_scenario,
    flown_kind,
    spun_about_the_axis,
)
from torquer.theory.averaged.equations import LAWS
from torquer.theory.averaged.requests import ALWAYS, LawRequest
from torquer.theory.slow.gains import Sampling

#: Initial rates where none is given; reorientation assumes a spin about its axis.
_RATE_DEG_S, _SPIN_DEG_S = (5.0, 5.0, 5.0), (0.0, 0.0, 5.0)
_DEFAULT_RATE = "the initial rate is the default, 5 deg/s about {}"


def find_case(
    law: str | None, asked: LawRequest, scenario: Scenario | None, needs_gain: bool
) -> AveragedCase:
    """The case from either source; `ValueError` if both or neither is given."""
    laws = ", ".join(LAWS)
    if law is not None and law not in LAWS:
        raise ValueError(f"LAW: must be one of {laws}; received {law!r}")
    named = given_values(
        asked, *(each.name for each in fields(LawRequest) if each.name not in ALWAYS)
    )
    if scenario is not None:
        return _case_beside(law, named, scenario)
    if law is None:
        raise ValueError(f"LAW: must be one of {laws}; received nothing")
    needed = ("inclination_deg", "inertia", *["gain"] * needs_gain, *["sun_deg"] * (law == "sdot"))
    for key in needed:
        if key not in named:
            raise RequestError(key, "must be given (or {scenario}); received nothing")
    if law != "sdot" and asked.sun_deg is not None:
        raise RequestError("sun_deg", f"must be left out for {law}; received {asked.sun_deg:g}")
    return spun_about_the_axis(_case_asked(law, asked, asked.inclination_deg or 0.0))


def _case_beside(law: str | None, named: dict, scenario: Scenario) -> AveragedCase:
    """The case of a scenario, which a request may not change."""
    for key in named:
        raise RequestError(key, "must not be given with {scenario}; received both")
    case = case_from_scenario(scenario)
    if law not in (None, case.law):
        raise ValueError(f"LAW: must be the scenario's, {case.law}, or left out; received {law!r}")
    return case


def _case_asked(law: str, asked: LawRequest, inclination_deg: float) -> AveragedCase:
    radius_m, b0_t = _radius_and_strength(asked, math.radians(inclination_deg))
    tensor = _check("inertia", validate.inertia_tensor, asked.inertia)
    for each in asked.rate_deg_s or ():
        if must := validate.out_of_range("rate_deg_s", each):
            raise RequestError("rate_deg_s", f"must be {must}; received {each:g}")
    spins = law == "reorientation"
    usual = _SPIN_DEG_S if spins else _RATE_DEG_S
    rate = _check("rate_deg_s", validate.finite, asked.rate_deg_s or usual, (3,))
    axis, rho = np.array([0.0, 0.0, 1.0]), None
    where = "the spin axis" if spins else "each axis"
    notes = () if asked.rate_deg_s else (_DEFAULT_RATE.format(where),)
    spinner, theta, remarks, body = as_spinner(tensor, axis, rate, inclination_deg, b0_t, radius_m)
    sampling = _sampling(law, asked.sample_s, asked.lag_s)
    if asked.rho_deg is not None:
        rho = math.radians(asked.rho_deg)
        if asked.sun_deg is not None:
            notes = (*notes, "the momentum lies in the plane of the cone axis and the Sun")
    sun = math.radians(asked.sun_deg or 0.0)
    name = f"{(radius_m - EARTH_RADIUS_M) / 1e3:.4g} km, {inclination_deg:g} deg"
    return AveragedCase(
        law, asked.gain, spinner, theta, rho, target=(math.sin(sun), 0.0, math.cos(sun)),
        notes=(*notes, *remarks), name=name, sampling=sampling, inertia=body.inertia,
        rate_rad_s=body.rate_rad_s, flown=flown_kind(law), assumed=body.assumed,
    )  # fmt: skip


def _check(key: str, check, *values):
    """What a function of `validate` lets pass; its error is one of the request."""
    try:
        return check(key, *values)
    except ValueError as error:
        raise RequestError(key, str(error).removeprefix(f"{key}: ")) from None


def _sampling(law: str, sample_s: float | None, lag_s: float | None) -> Sampling | None:
    """Sample and hold at one interval, over which the law also takes its differences."""
    if sample_s is None and lag_s is None:
        return None
    if law not in SAMPLED:
        key, value = ("lag_s", lag_s) if sample_s is None else ("sample_s", sample_s)
        raise RequestError(key, f"must be left out for {law}; received {value:g}")
    if sample_s is None:
        raise RequestError("sample_s", "must be given with {lag_s}; received nothing")
    if not 0.0 <= (lag_s or 0.0) < math.inf:
        raise RequestError("lag_s", f"must be 0 or positive; received {lag_s:g}")
    return Sampling(sample_s, sample_s, lag_s or 0.0)


def _radius_and_strength(asked: LawRequest, inclination: float) -> tuple[float, float]:
    """Radius [m] and B0 [T]; the direct dipole supplies one of them if it is not given."""
    equatorial, strength_nt = Averaged().mu_e_t_km3 * 1e9, asked.strength_nt
    if asked.altitude_km is not None:
        radius_m = EARTH_RADIUS_M + 1e3 * asked.altitude_km
        check_farthest(radius_m)
        b0_t = mean_of_extremes(equatorial / radius_m**3, inclination)
        return radius_m, b0_t if strength_nt is None else 1e-9 * strength_nt
    if strength_nt is None:
        raise RequestError("altitude_km", "it or {strength_nt} must be given; received neither")
    radius_m = (mean_of_extremes(equatorial, inclination) / (1e-9 * strength_nt)) ** (1.0 / 3.0)
    if radius_m <= EARTH_RADIUS_M:
        most = 1e9 * mean_of_extremes(equatorial / EARTH_RADIUS_M**3, inclination)
        raise RequestError(
            "strength_nt",
            f"must be below {most:.0f} nT, its value on the ground, without {{altitude_km}}; "
            f"received {strength_nt:g}",
        )
    check_farthest(radius_m)
    return radius_m, 1e-9 * strength_nt


def target_fraction(case: AveragedCase, to_percent: float | None) -> float:
    """Target fraction of the initial value."""
    grows = case.law == "spin_up"
    part = (200.0 if grows else 10.0) if to_percent is None else to_percent
    must = validate.out_of_range("to", part, 0.0)
    must = must and f"be {must}"
    if not must and grows and not 100.0 < part < math.inf:
        must = "be above 100 for spin_up, which grows"
    if not must and not grows and not 0.0 < part < 100.0:
        must = "lie between 0 and 100"
    if must:
        raise RequestError("to", f"must {must}; received {part:g}")
    return part / 100.0
