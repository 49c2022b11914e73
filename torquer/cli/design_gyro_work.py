"""Work of `torquer design magneto-gyro`: gains of both stages, what they can do, flights, files."""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from torquer.campaign.pointing_flights import PointingFlights, fly_releases
from torquer.cli.compiling import compiling_shown
from torquer.cli.design import GyroOptions
from torquer.cli.design_gyro_case import GyroCase, case_of, held_attitude
from torquer.cli.design_gyro_scenario import (
    EXACT_DEG,
    campaign_of,
    campaign_table,
    designed_scenario,
)
from torquer.cli.loading import check_orbit_environment, load_checked
from torquer.cli.options import CodeOptions, check_ranges
from torquer.cli.output import json_text, make_writable, writing_to
from torquer.control.magneto_gyro.law import MagnetoGyro
from torquer.earth.rotation import dcm_inertial_to_ecef
from torquer.notes.bdot_notes import tumbling_of
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import toml_of
from torquer.simulation.results.file import put
from torquer.theory.magneto_gyro.accuracy import noise_error, revolution_of, steady_motion
from torquer.theory.magneto_gyro.along_orbit import model_error
from torquer.theory.magneto_gyro.capture import DAMPING, Stage1Design, design_stage_1
from torquer.theory.magneto_gyro.day import (
    ALTITUDES_KM,
    INCLINATIONS_DEG,
    DayLoop,
    Range,
    degree_over_a_day,
    stable_range,
)
from torquer.theory.magneto_gyro.design import Stage2Design, design_stage_2
from torquer.theory.magneto_gyro.frozen import frozen_2
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop
from torquer.theory.magneto_gyro.times import Hysteresis, TimeToPoint, time_to_point
from torquer.theory.magneto_gyro.wheels import BetterWheel, better_wheel

#: Below this h, where roll and yaw are hard to tell apart, a better wheel is looked for.
WEAK = 3.0
#: IGRF-14 in 2025: g10, g11, h11 [nT], for the form of the text.
_DIPOLE_NT = [-29350.0, -1410.3, 4545.5]
#: Flights: as many unless asked for, their orbits (least, times the theory's, more, most), and
#: control steps of all of them, some seconds of computing.
_FLIGHTS, _ORBITS, _MOST_STEPS = 12, (10.0, 1.5, 3.0, 200.0), 4e6

#: Other degrees, over the wanted one, for which the error is found; loops of their searches.
_OTHER_DEGREES, _EVALUATIONS = (0.6, 1.2), 60
_EQUATOR = (
    "orbit: must not come so near to the magnetic equator that stage 2 is unstable; received an "
    "inclination of"
)


@dataclass(frozen=True)
class Made:
    """What was designed for a case, and what it can do.

    `errors`: (roll, pitch, yaw) [deg] by their cause; `costs`: (degree, error [deg] in all) of this
    design and of others; `margins`: degrees over a day by what differs from what the law knows;
    `flights`: of `scenario`, the designed one; None for none.
    """

    case: GyroCase
    form: str
    first: Stage1Design
    second: Stage2Design
    frozen_degree: float
    day_degree: float
    errors: dict[str, np.ndarray]
    costs: tuple[tuple[float, float], ...]
    margins: dict[str, float]
    inclinations: Range
    altitudes: Range
    time: TimeToPoint
    better: BetterWheel | None
    law: dict
    scenario: Scenario
    flights: PointingFlights | None = None

    @property
    def loop(self) -> DayLoop:
        """The designed loop for a whole day."""
        return DayLoop(self.case.craft, self.second.gains, self.form)


def show(path: Path, how: GyroOptions, code: CodeOptions) -> int:
    """Print the design; write law, scenario and pictures if a folder is given."""
    from torquer.cli.design_gyro_text import data_of, lines_of

    check_ranges(how)
    scenario = load_checked(path, code)
    check_orbit_environment(scenario)
    if how.out is not None:
        make_writable(how.out)
    try:
        made = _made(case_of(scenario, how), how)
    except ArithmeticError as error:
        raise ValueError(str(error)) from None
    count = _flights_that_fit(made.scenario) if how.fly is None else how.fly
    if count:
        campaign = campaign_of(made.scenario, made.case.tip_off_deg_s)
        with compiling_shown():
            made = replace(made, flights=fly_releases(made.scenario, campaign, count))
    files = [] if how.out is None else _write(made, how.out)
    print(json_text(data_of(made, how, files)) if how.json else "\n".join(lines_of(made, how)))
    if files and not how.json:
        print(f"{how.out}: {', '.join(Path(file).name for file in files)}")
    return 0


def _made(case: GyroCase, how: GyroOptions) -> Made:
    craft, along = case.craft, case.along
    first = design_stage_1(craft, case.filter_rate_rad_s, along.normals)
    if first.degree <= 0.0:
        better = better_wheel(craft, case.filter_rate_rad_s, how.degree, along.normals, how.form)
        would = "" if better is None else (
            f", as {better.wheel_n_m_s:.4g} N m s would (h = {better.stiffness:g})"
        )  # fmt: skip
        raise ValueError(
            f"spacecraft.body.wheel_momentum_n_m_s: must make stage 1 stable{would}; received "
            f"{craft.wheel_n_m_s:g} (h = {craft.stiffness:.3g})"
        )
    second = _second(case, how)
    better = None
    if craft.stiffness < WEAK or second.degree < 0.9 * how.degree:
        better = better_wheel(craft, case.filter_rate_rad_s, how.degree, along.normals, how.form)
    loop = DayLoop(craft, second.gains, how.form)
    day, inclinations, altitudes = _reach(case, loop)
    h, pitch_inertia = craft.gyrostat
    frozen = frozen_2(second.gains, stiffness=h, pitch_inertia=pitch_inertia, b=along.normal)
    law, errors = _law(case, first, second, how.form), _errors(case, second, how.form)
    costs = sorted([(second.degree, total_of(errors)), *_costs(case, how)])
    time = _time(case, MagnetoGyro.model_validate(law), first, day)
    return Made(
        case, how.form, first, second, -np.linalg.eigvals(frozen).real.max(), day,
        errors, tuple(costs), _margins(case, loop), inclinations, altitudes, time,
        better, law, designed_scenario(case.scenario, law, case.tip_off_deg_s, _orbits(case, time)),
    )  # fmt: skip


def _second(case: GyroCase, how: GyroOptions) -> Stage2Design:
    """Stage 2; ValueError if no loop found is stable here, while one is on a polar orbit."""
    craft, normals = case.craft, case.along.normals
    try:
        return design_stage_2(
            craft, normals=normals, form=how.form, wanted_degree=how.degree,
            evaluations=how.evaluations,
        )  # fmt: skip
    except ArithmeticError:
        design_stage_2(craft, form=how.form, evaluations=min(_EVALUATIONS, how.evaluations))
        raise ValueError(
            f"{_EQUATOR} {case.inclination_deg:.4g} deg, where no stable loop was found"
        ) from None


def _reach(case: GyroCase, loop: DayLoop) -> tuple[float, Range, Range]:
    """Degree over a day; inclinations and altitudes around the orbit's own with stable loops."""
    own = degree_over_a_day(loop, case.inclination_deg)
    if not own > 0.0:
        raise ValueError(
            f"{_EQUATOR} {case.inclination_deg:.4g} deg, where its degree over a day is {own:.3g}"
        )
    inclinations = stable_range(
        lambda x: degree_over_a_day(loop, x), case.inclination_deg, INCLINATIONS_DEG
    )
    altitudes = stable_range(
        lambda x: degree_over_a_day(loop.at(x), case.inclination_deg), case.altitude_km,
        ALTITUDES_KM,
    )  # fmt: skip
    return own, inclinations, altitudes


def _time(case: GyroCase, law: MagnetoGyro, first: Stage1Design, degree: float) -> TimeToPoint:
    tumbling = tumbling_of(case.scenario, law)
    switch = Hysteresis(math.radians(law.stage_2_angle_deg), law.mean_time_s)
    tip_off = math.radians(case.tip_off_deg_s)
    time = time_to_point(case.craft, tumbling, first, degree, tip_off, switch)
    if not math.isfinite(time.stage_2_s):
        raise ValueError(
            f"control.sample_s: must be shorter for stage 1 to brake {case.tip_off_deg_s:g} deg/s "
            f"(--tip-off-deg-s) with {tumbling.sampling.in_words}; received "
            f"{case.scenario.control.sample_s:g} s"
        )
    return time


def _orbits(case: GyroCase, time: TimeToPoint) -> float:
    """Orbits of a flight that should have pointed long before its end."""
    least, times, more, most = _ORBITS
    wanted = times * time.below(math.radians(EXACT_DEG)) / case.scenario.orbit.period_s + more
    return min(max(least, wanted), most)


def _flights_that_fit(scenario: Scenario) -> int:
    """Flights for which the command stays quick."""
    step_s = scenario.simulation.step_s or scenario.control.sample_s
    steps = scenario.steps() * scenario.grid_s / step_s
    return int(min(_FLIGHTS, max(1.0, _MOST_STEPS / steps)))


def _errors(case: GyroCase, second: Stage2Design, form: str) -> dict[str, np.ndarray]:
    """Root mean squares [deg] by what causes them, in the usual field."""
    scenario, craft, along = case.scenario, case.craft, case.along
    loop = stage_2_loop(
        craft.satellite(), craft.gyrostat, second.gains, normal=along.normal, form=form
    )
    around, meter = revolution_of(loop), scenario.spacecraft.magnetometer
    a, control = along.strength_t, scenario.control
    interval_s = control.cycle_s / control.steps_in_cycle
    noise = (1e-9 * meter.noise_nt / a) ** 2 * craft.orbital_rate_rad_s * interval_s
    bias = [0.0, 0.0, 0.0, *(1e-9 / a * np.array(meter.bias_nt))]
    disturbance = scenario.disturbance
    constant = np.zeros(3) if disturbance is None else disturbance.constant_torque_n_m
    torque = [*(np.array(constant) / craft.torque_unit), 0.0, 0.0, 0.0]
    radians = {
        "noise": noise_error(around, [0.0] * 3 + [noise] * 3),
        "field model": model_error(around, along),
        "bias": _rms(steady_motion(around, bias)),
        "torque": _rms(steady_motion(around, torque)),
    }
    return {name: np.degrees(error) for name, error in radians.items()}


def total_of(errors: dict[str, np.ndarray]) -> float:
    """Root mean square of the whole angle [deg], of errors by their independent causes."""
    return float(np.linalg.norm(list(errors.values())))


def _costs(case: GyroCase, how: GyroOptions) -> list[tuple[float, float]]:
    """Degrees and errors of designs for other degrees, where a stable loop is found."""
    found = []
    for part in _OTHER_DEGREES:
        try:
            other = design_stage_2(
                case.craft, normals=case.along.normals, form=how.form,
                wanted_degree=part * how.degree, evaluations=min(_EVALUATIONS, how.evaluations),
            )  # fmt: skip
        except ArithmeticError:
            continue
        found.append((other.degree, total_of(_errors(case, other, how.form))))
    return found


def _rms(motion) -> np.ndarray:
    return np.sqrt(np.mean(motion[:, :3] ** 2, axis=0))


def _margins(case: GyroCase, loop: DayLoop) -> dict[str, float]:
    """Degrees over a day of a satellite, or of an orbit, that is not what the law knows."""
    s, inclination = loop.craft.satellite(), case.inclination_deg
    others = {
        "inertia -20 %": s._replace(x=0.8 * s.x, y=0.8 * s.y, z=0.8 * s.z),
        "inertia +20 %": s._replace(x=1.2 * s.x, y=1.2 * s.y, z=1.2 * s.z),
        "wheel -10 %": s._replace(wheel=0.9 * s.wheel),
        "wheel +10 %": s._replace(wheel=1.1 * s.wheel),
    }
    found = {
        name: degree_over_a_day(loop._replace(actual=other), inclination)
        for name, other in others.items()
    }
    for change in (-10.0, 10.0):
        moved = degree_over_a_day(loop, inclination + change)
        found[f"inclination {change:+.0f} deg"] = moved
    return found


def _law(case: GyroCase, first: Stage1Design, second: Stage2Design, form: str) -> dict:
    """The law's keys, as in a scenario."""
    scenario, craft = case.scenario, case.craft
    g = [float(f"{x:.5g}") for x in second.gains]
    keys = {
        "kind": "magneto_gyro",
        "inertia_kg_m2": np.array(scenario.spacecraft.body.inertia_kg_m2).tolist(),
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
        keys["coil_duty"] = control.actuate_s / (control.measure_s + control.actuate_s)
    if held is not None:
        keys |= {"euler_deg": list(held.euler_deg), "sequence": held.sequence}
    if form == "text":
        mode = scenario.environment.earth_rotation
        x, y, _ = dcm_inertial_to_ecef([0.0], scenario.start, mode)[0, 0]
        angle = math.degrees(math.atan2(y, x))
        keys |= {"form": form, "dipole_nt": _DIPOLE_NT, "meridian_deg": round(angle, 3)}
    return keys


def law_toml(law: dict) -> str:
    """The law as the table of a scenario."""
    rows = (f"{key} = {json.dumps(value)}" for key, value in law.items())
    return "\n".join(["[control.law]", *rows, ""])


def _write(made: Made, out: Path) -> list[str]:
    """law.toml, scenario.toml with the law in a mode table and a campaign, and the pictures."""
    from torquer.report.theory.magneto_gyro import draw_gyro_design

    data = made.scenario.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    data["campaign"] = campaign_table(made.scenario, made.case.tip_off_deg_s)
    with writing_to(out):
        files = [
            put(out / "law.toml", law_toml(made.law)),
            put(out / "scenario.toml", toml_of(data)),
            *draw_gyro_design(made, out),
        ]
    return [str(file) for file in files]
