"""What `torquer design magneto-gyro` prints: the design in lines, and as JSON."""

import math

import numpy as np

from torquer.campaign.statistics import number, quantile
from torquer.cli.commands.design import GyroOptions
from torquer.cli.commands.design_gyro_scenario import EXACT_DEG, POINTED_DEG
from torquer.cli.commands.design_gyro_work import WEAK, Made, law_toml
from torquer.theory.magneto_gyro.craft import greatest_tip_off
from torquer.theory.magneto_gyro.day import Range

#: Parts of the flights by which times are stated.
_PARTS = {"half": 0.5, "90 %": 0.9, "last": 1.0}
#: Orbits of braking and turning beyond which the coils are called weak.
_LONG = 20.0
#: Degree over a day below which an orbit is called near to the limit.
_NEAR = 0.1


def lines_of(made: Made, how: GyroOptions) -> list[str]:
    """The design as text."""
    case, craft = made.case, made.case.craft
    alias = craft.dipole_of_bias(1e-9, case.along.mean_square_t2)
    rows = [
        *_of_gains(made),
        *_of_reach(made),
        *_of_times(made),
        f"{'error, rms [deg]':<20}{'roll':>10}{'pitch':>10}{'yaw':>10}",
    ]
    for name, error in made.errors.items():
        rows.append(f"{name:<20}" + "".join(f"{x:>10.3g}" for x in error))
    if any(error > 0.0 for _, error in made.costs):
        costs = ", ".join(f"{degree:.3f}: {error:.3g}" for degree, error in made.costs)
        rows.append(f"error in all [deg] with a degree of {costs}")
    rows.append(
        f"a bias of 1 nT along pitch is taken for a dipole of {alias:.3g} A m^2, which is the "
        "least that can be distinguished from it"
    )
    rows += [f"note: {note}" for note in notes_of(made, how)]
    return [*rows, "", *law_toml(made.law).splitlines()]


def _of_gains(made: Made) -> list[str]:
    case, craft, along = made.case, made.case.craft, made.case.along
    tip_off = math.degrees(greatest_tip_off(made.first.filter_rate_rad_s))
    return [
        f"{case.scenario.name}: J = {craft.inertia:.4g} kg m^2, lambda = "
        f"{craft.pitch_inertia:.3f}, h = {craft.stiffness:.3f} ({craft.stiffness:.3f} above 0, "
        f"{abs(craft.stiffness - 2.0):.3f} from 2)",
        f"field: A = {1e9 * along.strength_t:.0f} nT, along the normal {along.normal:.3f}"
        f" of it ({along.least:.3f} to {along.greatest:.3f})",
        f"stage 1: brakes up to {tip_off:.2f} deg/s; Floquet degree {made.first.degree:.3f} per "
        "1/nu0",
        f"stage 2: Floquet degree {made.second.degree:.3f} per 1/nu0; by the frozen model "
        f"{made.frozen_degree:.3f}; over a day {made.day_degree:.3f}",
    ]


def _of_reach(made: Made) -> list[str]:
    """Where the law works by linear theory, and with what differences."""
    case, rows = made.case, []
    margins = [f"{name}: {x:.3f}" for name, x in made.margins.items()]
    for first, part in (("over a day with ", margins[:4]), ("over a day with ", margins[4:])):
        rows.append(first + ", ".join(part))
    ends = _ends(made.inclinations, "deg")
    rows.append(f"stable at inclinations {ends}, at {case.altitude_km:.0f} km")
    ends = _ends(made.altitudes, "km")
    rows.append(f"stable at altitudes {ends}, at {case.inclination_deg:.4g} deg with this wheel")
    return rows


def _ends(found: Range, unit: str) -> str:
    if found.low is None and found.high is None:
        return "of any size tried"
    if found.low is None:
        return f"up to {found.high:.0f} {unit}"
    if found.high is None:
        return f"from {found.low:.0f} {unit}"
    return f"of {found.low:.0f} to {found.high:.0f} {unit}"


def _of_times(made: Made) -> list[str]:
    period_s, time = made.case.scenario.orbit.period_s, made.time
    flights = made.flights
    heads = [] if flights is None else [*_PARTS, f"never (of {len(flights.error_deg)})"]
    rows = [f"{'time to point [orbits]':<24}" + "".join(f"{x:>14}" for x in ("theory", *heads))]
    for limit in (POINTED_DEG, EXACT_DEG):
        cells = [f"{time.below(math.radians(limit)) / period_s:.2f}"]
        if flights is not None:
            settled = flights.settled_s(limit)
            cells += [_orbits(quantile(settled, x) / period_s) for x in _PARTS.values()]
            cells.append(f"{np.count_nonzero(np.isinf(settled))}")
        rows.append(f"{f'stays below {limit:g} deg':<24}" + "".join(f"{x:>14}" for x in cells))
    parts = (time.braking_s, time.turning_s, time.switch_s)
    braking, turning, switch = (f"{x / period_s:.2f}" for x in parts)
    rows.append(
        f"by theory {braking} orbits of braking from {made.case.tip_off_deg_s:.3g} deg/s, "
        f"{turning} of turning the wheel, {switch} of switching, then stage 2"
    )
    return rows


def _orbits(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "-"


def notes_of(made: Made, how: GyroOptions) -> list[str]:
    """What the user should know."""
    return [*made.case.notes, *_of_wheel(made, how), *_of_orbit(made), *_of_coils(made),
            *_of_flights(made)]  # fmt: skip


def _of_wheel(made: Made, how: GyroOptions) -> list[str]:
    craft, better, found = made.case.craft, made.better, []
    if craft.stiffness < WEAK:
        found.append(
            f"h = {craft.stiffness:.3g} is near 2 or below it, where roll and yaw are hard to tell "
            "apart"
        )
    if made.second.degree < 0.9 * how.degree:
        found.append(f"the degree wanted, {how.degree:g}, was not reached")
    if better is not None and better.least > min(made.first.degree, made.second.degree):
        found.append(
            f"a wheel of {better.wheel_n_m_s:.4g} N m s has h = {better.stiffness:g} and degrees "
            f"of {better.first:.3f} (stage 1) and {better.second:.3f} (stage 2)"
        )
    return found


def _of_orbit(made: Made) -> list[str]:
    """Differences with which it is unstable; an orbit near the limit."""
    unstable = [name for name, degree in made.margins.items() if degree <= 0.0]
    found = [f"stage 2 is unstable with {' and with '.join(unstable)}"] if unstable else []
    if made.day_degree >= min(_NEAR, 0.5 * made.second.degree):
        return found
    return [
        *found,
        f"an inclination of {made.case.inclination_deg:.4g} deg is near the limit: over a day the "
        f"degree is {made.day_degree:.3f}",
    ]


def _of_coils(made: Made) -> list[str]:
    """Where the coils are too weak, and what they would need."""
    case, found = made.case, []
    coils, period_s = case.coils, case.scenario.orbit.period_s
    limit = float(coils.limits_a_m2().min())
    slow = (made.time.braking_s + made.time.turning_s) / period_s
    if slow > _LONG:
        found.append(
            f"the coils are weak: with {limit:g} A m^2 they take {slow:.3g} orbits to brake the "
            f"satellite and turn the wheel; {_LONG:g} orbits need about "
            f"{limit * slow / _LONG:.3g} A m^2"
        )
    residual = float(np.linalg.norm(coils.residual_dipole_a_m2))
    if residual > 0.5 * limit:
        found.append(
            f"the satellite's own dipole of {residual:.3g} A m^2, which the coils are to "
            f"compensate, is more than half of their limit of {limit:g} A m^2"
        )
    g, unit = made.second.gains, case.craft.torque_unit / case.along.strength_t
    per_rad = unit * max(math.hypot(g.n1, g.n3), abs(g.n2))
    if math.radians(EXACT_DEG) * per_rad > limit:
        found.append(
            f"{EXACT_DEG:g} deg of error saturates the coils in stage 2: it asks for "
            f"{math.radians(EXACT_DEG) * per_rad:.3g} A m^2, they have {limit:g}"
        )
    return found


def _of_flights(made: Made) -> list[str]:
    if made.flights is None:
        return []
    missing = np.count_nonzero(np.isinf(made.flights.settled_s(POINTED_DEG)))
    if not missing:
        return []
    orbits = made.scenario.simulation.revolutions
    return [
        f"{missing} of {len(made.flights.error_deg)} releases do not stay below {POINTED_DEG:g} "
        f"deg within {orbits:g} orbits"
    ]


def data_of(made: Made, how: GyroOptions, files: list[str]) -> dict:
    """All of it as plain data."""
    case, craft = made.case, made.case.craft
    return {
        "name": case.scenario.name,
        "inertia_kg_m2": craft.inertia,
        "pitch_inertia": craft.pitch_inertia,
        "stiffness": craft.stiffness,
        "least_wheel_n_m_s": craft.wheel_at(0.0),
        "decoupling_wheel_n_m_s": craft.wheel_at(2.0),
        "better_wheel": made.better and made.better._asdict(),
        "strength_t": case.along.strength_t,
        "normals": list(case.along.normals),
        "stage_1": made.first._asdict(),
        "tip_off_deg_s": case.tip_off_deg_s,
        "greatest_tip_off_rad_s": greatest_tip_off(made.first.filter_rate_rad_s),
        "weights": made.second.weights._asdict(),
        "degree": made.second.degree,
        "frozen_degree": float(made.frozen_degree),
        "degree_over_a_day": made.day_degree,
        "errors_deg": {name: error.tolist() for name, error in made.errors.items()},
        "costs": [{"degree": degree, "error_deg": error} for degree, error in made.costs],
        "margins": made.margins,
        "inclinations_deg": made.inclinations._asdict(),
        "altitudes_km": made.altitudes._asdict(),
        "time_to_point": _times_data(made),
        "dipole_of_1_nt_a_m2": craft.dipole_of_bias(1e-9, case.along.mean_square_t2),
        "law": made.law,
        "notes": notes_of(made, how),
        "files": files,
    }


def _times_data(made: Made) -> dict:
    """Times [s] by theory and in flights; a time that fewer flights have is null."""
    flights, limits = made.flights, (POINTED_DEG, EXACT_DEG)
    theory = {f"below_{x:g}_deg_s": made.time.below(math.radians(x)) for x in limits}
    found = {"theory": {**made.time._asdict(), "stage_2_s": made.time.stage_2_s, **theory}}
    if flights is None:
        return {**found, "flights": None}
    flown: dict = {"runs": len(flights.error_deg)}
    for limit in limits:
        settled = flights.settled_s(limit)
        flown[f"below_{limit:g}_deg"] = {
            "never": int(np.count_nonzero(np.isinf(settled))),
            "settled_s": {f"{x:g}": number(quantile(settled, x)) for x in _PARTS.values()},
        }
    return {**found, "flights": flown}
