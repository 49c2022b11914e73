"""Work of `torquer design three-axis`: its case, table, JSON, map, laws as TOML."""

import json
import math
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from torquer.base.limits import given
from torquer.base.strict_json import json_text
from torquer.campaign.capture import Capture, capture
from torquer.cli.commands.design import DesignOptions, Key
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions, option
from torquer.cli.output import make_writable, writing_to
from torquer.computer.blocks.law import Law
from torquer.computer.estimation.sensors import SensorReadings
from torquer.computer.laws.pointing import HeldAttitude
from torquer.computer.laws.three_axis import ThreeAxis
from torquer.maths.geometry.vec3 import scale
from torquer.scenario.load import ScenarioError, scenario_from_data
from torquer.scenario.spec import Scenario
from torquer.simulation.results.file import put
from torquer.theory.three_axis.design import (
    SETTLED,
    Candidate,
    DesignTask,
    ThreeAxisDesign,
    assessed,
    design_gains,
)
from torquer.theory.three_axis.hold import AttitudeHold
from torquer.theory.three_axis.response import Noise, Offsets, greatest_angle
from torquer.theory.three_axis.sampled import Cycle, SampledHold
from torquer.theory.three_axis.search import Best

#: Options without which there is no satellite.
_NEEDED = ("inertia", "altitude_km", "inclination_deg", "limit_a_m2")
#: Where options stand in a scenario.
_PLACES = {
    field.name: each.place
    for field in fields(DesignOptions)
    for each in getattr(field.type, "__metadata__", ())
    if isinstance(each, Key)
}
#: The start of a satellite that is given by options: the field's date.
_START = "2025-01-01T00:00:00Z"
_HEAD = ("", "degree", "settling", "gain margin", "delay", "inertia", "error", "noise")
_UNITS = ("", "1/rad", "rev", "", "s", "%", "deg", "deg rms")


@dataclass(frozen=True)
class DesignCase:
    """What gains are designed for, in words and for `design_gains`; `notes`: what is left out.

    `own`: a law of the scenario that holds an attitude and to which linear theory applies.
    """

    scenario: Scenario
    task: DesignTask
    notes: tuple[str, ...]
    own: Law | None = None


@dataclass(frozen=True)
class _Made:
    """The design, its laws and the scenario's own by name, and what each captures, if asked."""

    design: ThreeAxisDesign
    candidates: dict[str, Candidate]
    captures: dict[str, Capture | None]


def case_of(path: Path | None, how: DesignOptions, code: CodeOptions) -> DesignCase:
    """The case from either source; `ValueError` if both or neither is given."""
    named = given(how, *_PLACES)
    if path is None:
        for key in _NEEDED:
            if key not in named:
                raise ValueError(f"{option(key)}: must be given (or SCENARIO); received nothing")
    elif named:
        raise ValueError(
            f"{option(next(iter(named)))}: must not be given with SCENARIO; received both"
        )
    scenario = _scenario_of(named) if path is None else _loaded(path, code)
    task, notes = _task(scenario, how)
    own = None if path is None else _own_law(scenario.control)
    return DesignCase(scenario, task, notes, own)


def _loaded(path: Path, code: CodeOptions) -> Scenario:
    """The scenario of a file; without a law an error that says which lines are enough."""
    try:
        return load_checked(path, code)
    except ScenarioError as error:
        nothing = "control: must be given; received nothing"
        enough = (
            ' (for a design a table [control] with sample_s and law = { kind = "off" } is enough)'
        )
        raise ScenarioError(str(error).replace(nothing, nothing + enough)) from None


def _scenario_of(named: dict) -> Scenario:
    """A scenario made from the options; errors name the option."""
    law = {"kind": "three_axis", "rate_gain_n_m_s_per_t2": 1.0, "angle_gain_n_m_per_t2": 1.0}
    data: dict = {
        "name": "design", "start": _START, "orbit": {"kind": "circular"}, "control": {"law": law},
        "initial": {"rate_deg_s": [0.0, 0.0, 0.0]}, "simulation": {"revolutions": 1.0},
    }  # fmt: skip
    for key, value in named.items():
        *tables, last = _PLACES[key].split(".")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[last] = list(value) if isinstance(value, tuple) else value
    try:
        return scenario_from_data(data)
    except ScenarioError as error:
        text = str(error)
        for key, place in _PLACES.items():
            text = text.replace(place, option(key))
        raise ValueError(text) from None


def _task(scenario: Scenario, how: DesignOptions) -> tuple[DesignTask, tuple[str, ...]]:
    """What is designed for, and what is left out."""
    craft, control = scenario.spacecraft, scenario.control
    if craft.coils is None:
        raise ValueError("spacecraft.coils: must be given for magnetic control; received none")
    held, notes = _attitude(control)
    hold = AttitudeHold.of_scenario(scenario, held.law(), how.revolutions)
    sensor, gyro, disturbance = craft.attitude_sensor, craft.gyro, scenario.disturbance
    hold_s, torque, random = control.sample_s, (0.0, 0.0, 0.0), 0.0
    if disturbance is not None:
        torque, random = disturbance.constant_torque_n_m, disturbance.random_torque_n_m
        hold_s = disturbance.random_hold_s or hold_s
    noise = Noise(math.radians(sensor.noise_deg), math.radians(gyro.noise_deg_s), random, hold_s)
    degree = math.radians(1.0)
    offsets = Offsets(scale(degree, sensor.error_deg), scale(degree, gyro.bias_deg_s))
    task = DesignTask(
        SampledHold(hold, Cycle.of_control(control), craft.coils.residual_dipole_a_m2),
        float(np.min(craft.coils.limit_a_m2)),
        how.linear_range_deg, how.gain_margin, torque, noise, offsets,
    )  # fmt: skip
    return task, (*notes, *_left_out(scenario))


def _attitude(control) -> tuple[ThreeAxis, tuple[str, ...]]:
    """The three-axis law for the attitude that a law of the scenario holds."""
    laws = [spec for spec in control.named().laws.values() if isinstance(spec, HeldAttitude)]
    keys = {"rate_gain_n_m_s_per_t2": 1.0, "angle_gain_n_m_per_t2": 1.0}
    if not laws:
        return ThreeAxis(**keys), (
            "no law holds an attitude: alignment with the orbital frame is assumed",
        )
    held = laws[0].model_dump(include={"reference", "euler_deg", "sequence"})
    return ThreeAxis(**keys, **held), ()


def _own_law(control) -> Law | None:
    """The only law, where it holds an attitude by coils and without memory."""
    laws = [spec.law() for spec in control.named().laws.values()]
    if len(laws) != 1 or not {"orbital", "q_wanted"} <= laws[0].values().keys():
        return None
    return laws[0] if laws[0].answers == "dipole" and not len(laws[0].first_memory()) else None


def _left_out(scenario: Scenario) -> tuple[str, ...]:
    """What the linear theory leaves out."""
    craft, found = scenario.spacecraft, []
    if craft.coils is not None and craft.coils.lag_s > 0.0:
        found.append("the lag of the coils is left out: compare it with the delay margin")
    if not isinstance(scenario.control.estimator, SensorReadings):
        found.append("the noise is that of the sensors, without the estimator")
    if craft.gyro.bias_drift_deg_s_sqrt_s > 0.0:
        found.append("the gyro's bias is taken as constant, without its drift")
    return tuple(found)


def show(path: Path | None, how: DesignOptions, code: CodeOptions) -> int:
    """Print the design; write the map and the laws if a folder is given."""
    case, out = case_of(path, how, code), how.out
    if out is not None:
        make_writable(out)
    try:
        made = _made(case, how)
    except ArithmeticError as error:
        raise ValueError(str(error)) from None
    files = [] if out is None else _write(case, made.design, out)
    if how.json:
        print(json_text(_data(case, made, how, files)))
        return 0
    print(*_lines(case, made, how), sep="\n")
    if files:
        print(f"{out}: {', '.join(Path(file).name for file in files)}")
    return 0


def _made(case: DesignCase, how: DesignOptions) -> _Made:
    design, captures = design_gains(case.task), {}
    candidates = dict(design.candidates)
    if case.own is not None:
        candidates["own"] = assessed(case.task, case.own)
    if how.capture_runs is not None:
        for name, each in candidates.items():
            starts = how.capture_runs, how.capture_rate_deg_s
            flown = (case.task, each, *starts, how.capture_within_deg)
            captures[name] = capture(case.scenario, *flown)
    return _Made(design, candidates, captures)


def _lines(case: DesignCase, made: _Made, how: DesignOptions) -> list[str]:
    """The design as text."""
    task, hold = case.task, case.task.sampled.hold
    cycle, field = task.sampled.cycle, hold.orbit_environment.environment.field.kind
    off = f", coils off for {cycle.off_s:g} s" if cycle.off_s else ""
    rows = [_HEAD, _UNITS, *(_row(hold, *each) for each in made.candidates.items())]
    minutes = 2.0 * math.pi / hold.rate_rad_s / 60.0
    lines = [
        f"{case.scenario.name}: three axes by coils, field {field} (repeats after "
        f"{hold.revolutions} rev of {minutes:.1f} min), dipole held for {cycle.hold_s:g} s{off}, "
        f"linear range {task.linear_range_deg:g} deg",
        *("".join(f"{cell:>12}" for cell in row) for row in rows),
    ]
    for name in ("formula", "refined"):
        k, k_a = _pair(made.candidates[name])
        lines.append(f"{name}: rate_gain_n_m_s_per_t2 = {k:.6g}, angle_gain_n_m_per_t2 = {k_a:.6g}")
    lines.append(_of_search(case.task, made.design.search))
    lines += [_captured(name, found) for name, found in made.captures.items()]
    notes = [
        f"{name}: {note}"
        for name, each in made.candidates.items()
        for note in (*unusable(each, how.capture_within_deg), *each.notes)
    ]
    return lines + [f"note: {note}" for note in (*case.notes, *notes)]


def unusable(candidate: Candidate, within_deg: float) -> tuple[str, ...]:
    """A note on a law that is stable, but with a greater steady error than is of use."""
    error = candidate.error
    if error is None or math.degrees(error.greatest_rad) <= within_deg:
        return ()
    return (
        f"unusable: its steady error of {math.degrees(error.greatest_rad):.3g} deg exceeds "
        f"{within_deg:g} deg (--capture-within-deg)",
    )


def _of_search(task: DesignTask, found: Best) -> str:
    """What the search for the second pair of gains says of it."""
    if not found.value > 0.0:
        return (
            "refined: no gains within the coils' limit are stable with a gain margin of "
            f"{task.gain_margin:g}; these grow most slowly"
        )
    return (
        "refined: no gains on the grids around it are better; the last grid has a spacing of "
        f"{100.0 * found.spacing.max():.2g} %"
    )


def _captured(name: str, found: Capture | None) -> str:
    """The result in one line."""
    if found is None:
        return f"{name}: captures nothing"
    low, high = (100.0 * end for end in found.interval)
    return (
        f"{name}: captures {found.captured} of {found.runs} random initial attitudes "
        f"({low:.0f}..{high:.0f} % with 95 % confidence) to within {found.within_deg:.3g} deg "
        f"in {found.revolutions:g} rev"
    )


def _row(hold, name: str, candidate: Candidate) -> tuple[str, ...]:
    revolutions = candidate.settling_s * hold.rate_rad_s / (2.0 * math.pi)
    start = (name, f"{candidate.degree:.4f}", f"{revolutions:.2f}")
    if candidate.margins is None or candidate.error is None:
        return (*start, *["-"] * 5)
    margins, error = candidate.margins, candidate.error
    gains = f"{margins.least_gain:.2g}..{margins.greatest_gain:.3g}"
    delay, inertia = f"{margins.delay_s:.0f}", f"{100.0 * margins.inertia:.0f}"
    angles = (f"{math.degrees(x):.3g}" for x in (error.greatest_rad, error.noise_rms_rad))
    return (*start, gains, delay, inertia, *angles)


def _pair(candidate: Candidate) -> tuple[float, float]:
    values = candidate.law.values()
    return values["rate_gain"], values["angle_gain"]


def _data(case: DesignCase, made: _Made, how: DesignOptions, files: list[str]) -> dict:
    task, hold = case.task, case.task.sampled.hold
    return {
        "name": case.scenario.name,
        "orbital_rate_rad_s": hold.rate_rad_s,
        "revolutions": hold.revolutions,
        "limit_a_m2": task.limit_a_m2,
        "linear_range_deg": task.linear_range_deg,
        "gain_margin": task.gain_margin,
        "settled_part": SETTLED,
        "strengths": dict(zip(("formula", "refined"), made.design.strengths, strict=True)),
        "gains_found": bool(made.design.search.value > 0.0),
        "grid_spacing": float(made.design.search.spacing.max()),
        "candidates": {
            name: {
                **_candidate(each, how.capture_within_deg),
                "capture": _capture(made.captures.get(name)),
            }
            for name, each in made.candidates.items()
        },
        "notes": list(case.notes),
        "files": files,
    }


def _candidate(candidate: Candidate, within_deg: float) -> dict:
    error, margins = candidate.error, candidate.margins
    return {
        "law": _keys(candidate.law),
        "degree_per_rad": candidate.degree,
        "continuous_degree_per_rad": candidate.continuous_degree,
        "averaged_degree_per_rad": candidate.averaged_degree,
        "settling_s": candidate.settling_s,
        "margins": margins and margins._asdict(),
        "error": error and {
            "greatest_deg": math.degrees(error.greatest_rad),
            "rms_deg": math.degrees(error.rms_rad),
            "noise_rms_deg": math.degrees(error.noise_rms_rad),
            "by_source_deg": {
                name: math.degrees(greatest_angle(turns)) for name, turns in error.by_source.items()
            },
            "greatest_dipole_a_m2": float(abs(error.dipoles_a_m2).max()),
        },
        "notes": [*unusable(candidate, within_deg), *candidate.notes],
    }  # fmt: skip


def _capture(found: Capture | None) -> dict | None:
    return None if found is None else {**asdict(found), "interval": list(found.interval)}


def _write(case: DesignCase, made: ThreeAxisDesign, out: Path) -> list[str]:
    """map.png and a TOML file of each law."""
    from torquer.report.theory.three_axis import draw_design

    with writing_to(out):
        files = [draw_design(case.task, made, out / "map.png")]
        for name, candidate in made.candidates.items():
            files.append(put(out / f"{name}.toml", _toml(candidate.law)))
    return [str(file) for file in files]


def _toml(law) -> str:
    """A law as the table of a scenario."""
    rows = (f"{key} = {json.dumps(value)}" for key, value in _keys(law).items())
    return "\n".join(["[control.law]", *rows, ""])


def _keys(law) -> dict:
    """A law's keys, as in a scenario file."""
    return law.spec.model_dump(mode="json")
