"""Gains of the magneto-gyroscopic system for a satellite, what they can do, flights with them."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from torquer.analysis.notes.bdot_notes import as_tumbling
from torquer.base.limits import RequestError
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.computer.laws.magneto_gyro.stage_2 import Stage2Gains
from torquer.design.gyro.answer import GyroDesign
from torquer.design.gyro.case import GyroCase, make_case
from torquer.design.gyro.domain import STIFF, dipole_in_stage_2, judge_design
from torquer.design.gyro.failure import explain_pointing, fails
from torquer.design.gyro.flown_scenario import (
    EXACT_DEG,
    POINTED_DEG,
    designed_scenario,
    make_campaign,
    steps_of,
)
from torquer.design.gyro.notes import notes_on
from torquer.design.gyro.reach import (
    EQUATOR,
    EVALUATIONS,
    degree_costs,
    find_margins,
    pointing_errors,
    stable_reach,
    total_error,
)
from torquer.design.pointing_flights import fly_releases
from torquer.design.requests import MagnetoGyroRequest
from torquer.environment.earth.rotation import dcm_inertial_to_ecef
from torquer.scenario.spec import Scenario
from torquer.theory.magneto_gyro.capture import DAMPING, Stage1Design, design_stage_1
from torquer.theory.magneto_gyro.day import DayLoop
from torquer.theory.magneto_gyro.frozen import frozen_2
from torquer.theory.magneto_gyro.satellite import held_attitude
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Design, design_stage_2
from torquer.theory.magneto_gyro.times import Hysteresis, TimeToPoint, time_to_point
from torquer.theory.magneto_gyro.wheel_choice import BetterWheel, better_wheel

#: IGRF-14 in 2025: g10, g11, h11 [nT], for the form of the text.
_DIPOLE_NT = [-29350.0, -1410.3, 4545.5]
#: Flights: as many unless asked for, their orbits (least, times the theory's, more, most), and
#: control steps of all of them, some seconds of computing.
_FLIGHTS, _ORBITS, _MOST_STEPS = 12, (10.0, 1.5, 3.0, 200.0), 4e6
#: Loops tried for each of other laws where the one designed fails.
_FEWER = 30
#: Degrees, over the wanted one, of other laws for the same satellite.
_OTHER_DEGREES = (0.6, 1.0, 1.4)


def magneto_gyro(
    scenario: Scenario,
    request: MagnetoGyroRequest = MagnetoGyroRequest(),
    progress: Callable[[int, int], None] | None = None,
) -> GyroDesign:
    """Gains of the magneto-gyroscopic system: magnetometer, coils and a pitch wheel.

        made = magneto_gyro(torquer.load_scenario("my_satellite.toml"), MagnetoGyroRequest(fly=0))
        made.law                        # keys of the law, as in a scenario
        torquer.simulate(made.scenario)
        torquer.plot(made)              # figures by name

    The scenario describes the satellite: inertia, wheel_momentum_n_m_s of its body, orbit, field,
    model on board, noise and bias of the magnetometer. Its own laws and modes are replaced.
    Where more than a tenth of the releases flown do not point, `failure` says why, by flights.
    `progress`: called with releases flown and in total. ValueError for a satellite, or an orbit, on
    which the system cannot work.
    """
    try:
        made = _design(make_case(scenario, request), request)
    except ArithmeticError as error:
        raise ValueError(str(error)) from None
    count = _flights_that_fit(made.scenario) if request.fly is None else request.fly
    if count:
        campaign = make_campaign(made.scenario, made.case.tip_off_deg_s)
        made = replace(made, flights=fly_releases(made.scenario, campaign, count, progress))
    pointed_s = made.time.below(math.radians(POINTED_DEG))
    turned = made.dipole_turns_rad
    verdict = judge_design(made.case, made.first, turned, pointed_s, made.flights)
    failure = None
    if fails(made.flights):
        failure = explain_pointing(made, _other_laws(made))
    made = replace(made, verdict=verdict, failure=failure)
    return replace(made, notes=tuple(notes_on(made)))


def _other_laws(made: GyroDesign) -> dict[str, dict]:
    """Keys of laws for other degrees of stage 2, by what they are called."""
    found = {}
    for part in _OTHER_DEGREES:
        degree = part * made.request.degree
        asked = replace(made.request, degree=degree, evaluations=_FEWER)
        try:
            second = _second(made.case, asked)
        except (ArithmeticError, ValueError):
            continue
        law = _law(made.case, made.first, second, asked.form)
        found[f"gains for a degree of {degree:.2g} (--degree, --evaluations {_FEWER})"] = law
    return found


def _design(case: GyroCase, request: MagnetoGyroRequest) -> GyroDesign:
    craft, along, form = case.craft, case.along, request.form
    first = _first(case, request)
    time = _time(case, _law(case, first, None, form), first)  # refused before the long search
    second = _second(case, request)
    better = None
    if not STIFF.holds(craft.stiffness) or second.degree < 0.9 * request.degree:
        better = _better_wheel(case, request)
    day, inclinations, altitudes = stable_reach(case, loop := DayLoop(craft, second.gains, form))
    h, pitch_inertia = craft.gyrostat
    frozen = frozen_2(second.gains, stiffness=h, pitch_inertia=pitch_inertia, b=along.normal)
    law, errors = _law(case, first, second, form), pointing_errors(case, second, form)
    costs = sorted([(second.degree, total_error(errors)), *degree_costs(case, request)])
    time = time._replace(decay_per_s=day * craft.orbital_rate_rad_s)
    return GyroDesign(
        case, request, first, second, -np.linalg.eigvals(frozen).real.max(), day, errors,
        tuple(costs), find_margins(case, loop), inclinations, altitudes, time, better, law,
        designed_scenario(case.scenario, law, case.tip_off_deg_s, _orbits(case, time)),
        dipole_in_stage_2(case, second, form),
    )  # fmt: skip


def _better_wheel(case: GyroCase, request: MagnetoGyroRequest) -> BetterWheel | None:
    normals = case.along.normals
    return better_wheel(case.craft, case.filter_rate_rad_s, request.degree, normals, request.form)


def _first(case: GyroCase, request: MagnetoGyroRequest) -> Stage1Design:
    """Stage 1; ValueError with a wheel for which it would be stable, if it is not with this one."""
    craft = case.craft
    first = design_stage_1(
        craft, case.filter_rate_rad_s, case.along.normals, tuple(case.own_dipole),
        case.most_angle_gain,
    )  # fmt: skip
    if first.degree > 0.0:
        return first
    better = _better_wheel(case, request)
    would = "" if better is None else (
        f", as {better.wheel_n_m_s:.4g} N m s would (h = {better.stiffness:g})"
    )  # fmt: skip
    nutation = craft.wheel_n_m_s / craft.inertia
    why = "" if nutation < case.filter_rate_rad_s else (
        f", which nutates with {nutation:.3g} rad/s: the filters of stage 1 follow up to "
        f"{case.filter_rate_rad_s:.3g} (filter_rate_rad_s)"
    )  # fmt: skip
    raise ValueError(
        f"spacecraft.body.wheel_momentum_n_m_s: must make stage 1 stable{would}; received "
        f"{craft.wheel_n_m_s:g} (h = {craft.stiffness:.3g}){why}"
    )


def _second(case: GyroCase, request: MagnetoGyroRequest) -> Stage2Design:
    """Stage 2; ValueError if no loop found is stable here, while one is on a polar orbit."""
    craft, normals = case.craft, case.along.normals
    try:
        return design_stage_2(
            craft, normals=normals, form=request.form, wanted_degree=request.degree,
            evaluations=request.evaluations,
        )  # fmt: skip
    except ArithmeticError:
        design_stage_2(craft, form=request.form, evaluations=min(EVALUATIONS, request.evaluations))
        raise ValueError(
            f"{EQUATOR} {case.inclination_deg:.4g} deg, where no stable loop was found"
        ) from None


def _time(case: GyroCase, keys: dict, first: Stage1Design) -> TimeToPoint:
    """The time to point but for that of stage 2: with a degree of 1."""
    law = MagnetoGyro.model_validate(keys)
    tumbling = as_tumbling(case.scenario, law)
    switch = Hysteresis(math.radians(law.stage_2_angle_deg), law.mean_time_s)
    tip_off = math.radians(case.tip_off_deg_s)
    time = time_to_point(case.craft, tumbling, first, 1.0, tip_off, switch)
    if not math.isfinite(time.stage_2_s):
        raise RequestError(
            "control.sample_s",
            f"must be shorter for stage 1 to brake {case.tip_off_deg_s:g} deg/s (tip_off_deg_s) "
            f"with {tumbling.sampling.in_words}; received {case.scenario.control.sample_s:g} s",
            "tip_off_deg_s",
        )
    return time


def _orbits(case: GyroCase, time: TimeToPoint) -> float:
    """Orbits of a flight that should have pointed long before its end."""
    least, times, more, most = _ORBITS
    wanted = times * time.below(math.radians(EXACT_DEG)) / case.scenario.orbit.period_s + more
    return min(max(least, wanted), most)


def _flights_that_fit(scenario: Scenario) -> int:
    """Flights for which the command stays quick."""
    return int(min(_FLIGHTS, max(1.0, _MOST_STEPS / steps_of(scenario))))


def _law(case: GyroCase, first: Stage1Design, second: Stage2Design | None, form: str) -> dict:
    """The law's keys, as in a scenario; stage 2 without gains before it is designed."""
    scenario, craft = case.scenario, case.craft
    gains = [0.0] * len(Stage2Gains._fields) if second is None else second.gains
    g = [float(f"{x:.5g}") for x in gains]
    keys = {
        "kind": "magneto_gyro",
        "inertia_kg_m2": np.array(scenario.spacecraft.body.inertia).tolist(),
        "bias_momentum_n_m_s": craft.wheel_n_m_s,
        "orbital_rate_rad_s": craft.orbital_rate_rad_s,
        "capture_angle_gain": first.angle_gain,
        "capture_rate_gain": first.rate_gain,
        "filter_rate_rad_s": float(f"{first.filter_rate_rad_s:.5g}"),
        "filter_damping": DAMPING,
        "angle_gains": g[:3],
        "rate_gains": g[3:6],
        "estimator_gains": g[6:12],
        "compensator_gains": g[12:],
    }
    control, held = scenario.control, held_attitude(scenario)
    if control.actuate_s:
        keys["coil_duty"] = control.coil_duty
    if held is not None:
        keys |= {"euler_deg": list(held.euler_deg), "sequence": held.sequence}
    if form == "text":
        mode = scenario.environment.earth_rotation
        x, y, _ = dcm_inertial_to_ecef([0.0], scenario.start, mode)[0, 0]
        angle = math.degrees(math.atan2(y, x))
        keys |= {"form": form, "dipole_nt": _DIPOLE_NT, "meridian_deg": round(angle, 3)}
    return keys
