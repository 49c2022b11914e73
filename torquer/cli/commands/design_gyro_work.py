"""Work of `torquer design magneto-gyro`: gains of both stages, what they can do, flights, files."""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from torquer.analysis.notes.bdot_notes import tumbling_of
from torquer.base.strict_json import json_text
from torquer.cli.commands.design import GyroOptions
from torquer.cli.commands.design_gyro_case import GyroCase, case_of, held_attitude
from torquer.cli.commands.design_gyro_numbers import (
    EQUATOR,
    EVALUATIONS,
    costs_of,
    errors_of,
    margins_of,
    reach_of,
    total_of,
)
from torquer.cli.commands.design_gyro_scenario import (
    EXACT_DEG,
    campaign_of,
    campaign_table,
    designed_scenario,
)
from torquer.cli.compiling import compiling_shown
from torquer.cli.loading import check_orbit_environment, load_checked
from torquer.cli.options import CodeOptions
from torquer.cli.output import make_writable, writing_to
from torquer.computer.laws.magneto_gyro.law import MagnetoGyro
from torquer.design.pointing_flights import PointingFlights, fly_releases
from torquer.environment.earth.rotation import dcm_inertial_to_ecef
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import toml_of
from torquer.simulation.results.file import put
from torquer.theory.magneto_gyro.capture import DAMPING, Stage1Design, design_stage_1
from torquer.theory.magneto_gyro.day import DayLoop, Range
from torquer.theory.magneto_gyro.design import Stage2Design, design_stage_2
from torquer.theory.magneto_gyro.frozen import frozen_2
from torquer.theory.magneto_gyro.times import Hysteresis, TimeToPoint, time_to_point
from torquer.theory.magneto_gyro.wheels import BetterWheel, better_wheel

#: Below this h, where roll and yaw are hard to tell apart, a better wheel is looked for.
WEAK = 3.0
#: IGRF-14 in 2025: g10, g11, h11 [nT], for the form of the text.
_DIPOLE_NT = [-29350.0, -1410.3, 4545.5]
#: Flights: as many unless asked for, their orbits (least, times the theory's, more, most), and
#: control steps of all of them, some seconds of computing.
_FLIGHTS, _ORBITS, _MOST_STEPS = 12, (10.0, 1.5, 3.0, 200.0), 4e6


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
    from torquer.cli.commands.design_gyro_text import data_of, lines_of

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
    day, inclinations, altitudes = reach_of(case, loop)
    h, pitch_inertia = craft.gyrostat
    frozen = frozen_2(second.gains, stiffness=h, pitch_inertia=pitch_inertia, b=along.normal)
    law, errors = _law(case, first, second, how.form), errors_of(case, second, how.form)
    costs = sorted([(second.degree, total_of(errors)), *costs_of(case, how)])
    time = _time(case, MagnetoGyro.model_validate(law), first, day)
    return Made(
        case, how.form, first, second, -np.linalg.eigvals(frozen).real.max(), day,
        errors, tuple(costs), margins_of(case, loop), inclinations, altitudes, time,
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
        design_stage_2(craft, form=how.form, evaluations=min(EVALUATIONS, how.evaluations))
        raise ValueError(
            f"{EQUATOR} {case.inclination_deg:.4g} deg, where no stable loop was found"
        ) from None


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
        keys["coil_duty"] = control.coil_duty
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
