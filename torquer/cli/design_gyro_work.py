"""Work of `torquer design magneto-gyro`: the satellite of a scenario, gains, errors, the law."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from torquer.cli.design import GyroOptions
from torquer.cli.loading import load_checked
from torquer.cli.options import CodeOptions, check_ranges
from torquer.cli.output import json_text, make_writable, writing_to
from torquer.control.pointing import HeldAttitude
from torquer.earth.rotation import dcm_inertial_to_ecef
from torquer.geometry.attitudes import dcm_body_to_reference
from torquer.scenario.spec import Scenario
from torquer.simulation.results.file import put
from torquer.theory.magneto_gyro.accuracy import (
    Revolution,
    noise_error,
    revolution_of,
    steady_motion,
)
from torquer.theory.magneto_gyro.along_orbit import FieldAlong, field_along, model_error
from torquer.theory.magneto_gyro.capture import (
    DAMPING,
    Stage1Design,
    design_stage_1,
    filter_rate_for,
)
from torquer.theory.magneto_gyro.craft import BRAKED, GyroCraft, greatest_tip_off
from torquer.theory.magneto_gyro.design import Stage2Design, design_stage_2
from torquer.theory.magneto_gyro.frozen import frozen_2
from torquer.theory.magneto_gyro.stage_2 import stage_2_loop

#: Below this h, or that far from 2, a greater wheel is recommended; its h.
_WEAK, _RECOMMENDED = 3.0, 4.0
#: IGRF-14 in 2025: g10, g11, h11 [nT], for the form of the text.
_DIPOLE_NT = [-29350.0, -1410.3, 4545.5]
#: Changes of the satellite, unknown to the law, for which the degree is given.
_MARGINS = ("inertia -20 %", "inertia +20 %", "wheel -10 %", "wheel +10 %")


@dataclass(frozen=True)
class _Made:
    """The case and what was designed for it; errors (roll, pitch, yaw) [deg] by their cause."""

    scenario: Scenario
    craft: GyroCraft
    along: FieldAlong
    first: Stage1Design
    second: Stage2Design
    frozen_degree: float
    errors: dict[str, np.ndarray]
    margins: dict[str, float]
    law: dict
    notes: tuple[str, ...]


def show(path: Path, how: GyroOptions, code: CodeOptions) -> int:
    """Print the design; write the law if a folder is given."""
    check_ranges(how)
    scenario = load_checked(path, code)
    if how.out is not None:
        make_writable(how.out)
    try:
        made = _made(scenario, how)
    except ArithmeticError as error:
        raise ValueError(str(error)) from None
    files = [] if how.out is None else _write(made, how.out)
    print(json_text(_data(made, files)) if how.json else "\n".join(_lines(made)))
    if files and not how.json:
        print(f"{how.out}: {', '.join(Path(file).name for file in files)}")
    return 0


def craft_of(scenario: Scenario) -> tuple[GyroCraft, tuple[str, ...]]:
    """The satellite in the axes of the attitude that is held, and what is left out.

    ValueError for a satellite on which the system cannot work.
    """
    craft, notes = scenario.spacecraft, []
    if craft.coils is None:
        raise ValueError("spacecraft.coils: must be given for magnetic control; received none")
    held = [x for x in scenario.control.named().laws.values() if isinstance(x, HeldAttitude)]
    turn = dcm_body_to_reference(np.array(held[0].q_wanted() if held else (0, 0, 0, 1.0)))
    inertia = turn @ np.array(craft.body.inertia_kg_m2) @ turn.T
    wheel = turn @ np.array(craft.body.wheel_momentum_n_m_s)
    if np.abs(inertia - np.diag(np.diag(inertia))).max() > 1e-9 * inertia.max():
        notes.append("products of inertia are left out")
    if np.hypot(wheel[0], wheel[2]) > 1e-3 * abs(wheel[1]):
        notes.append("the wheel's momentum across the pitch axis is left out")
    rate = 2.0 * math.pi / scenario.orbit.period_s
    x, y, z = np.diag(inertia).tolist()
    made = GyroCraft((x, y, z), float(wheel[1]), rate)
    if made.stiffness <= 0.0:
        raise ValueError(
            "spacecraft.body.wheel_momentum_n_m_s: must be above "
            f"{made.wheel_at(0.0):.4g} N m s along the orbit normal, (2 - lambda) J nu0; received "
            f"{made.wheel_n_m_s:g}"
        )
    return made, tuple(notes)


def _made(scenario: Scenario, how: GyroOptions) -> _Made:
    craft, notes = craft_of(scenario)
    frequency = _filter_rate(how)
    along = field_along(scenario.orbit_environment(), scenario.believed_environment())
    first = design_stage_1(craft, frequency, along.normals)
    if first.degree <= 0.0:
        raise ValueError(
            "spacecraft.body.wheel_momentum_n_m_s: must make stage 1 stable, as "
            f"{craft.wheel_at(_RECOMMENDED):.4g} N m s would (h = {_RECOMMENDED:g}); received "
            f"{craft.wheel_n_m_s:g} (h = {craft.stiffness:.3g})"
        )
    second = design_stage_2(
        craft, normals=along.normals, form=how.form, wanted_degree=how.degree,
        evaluations=how.evaluations,
    )  # fmt: skip
    around = _loop(craft, second, along, how.form)
    h, pitch_inertia = craft.gyrostat
    frozen = frozen_2(second.gains, stiffness=h, pitch_inertia=pitch_inertia, b=along.normal)
    return _Made(
        scenario, craft, along, first, second, -np.linalg.eigvals(frozen).real.max(),
        _errors(scenario, craft, around, along), _margins(craft, second, along, how.form),
        _law(scenario, craft, first, second, how.form),
        (*notes, *_warnings(craft, second, how)),
    )  # fmt: skip


def _filter_rate(how: GyroOptions) -> float:
    tip_off = math.radians(how.tip_off_deg_s)
    found = how.filter_rate_rad_s or filter_rate_for(tip_off)
    if tip_off > greatest_tip_off(found):
        raise ValueError(
            f"--filter-rate-rad-s: must be at least {tip_off / BRAKED:.4g} to brake "
            f"{how.tip_off_deg_s:g} deg/s (--tip-off-deg-s); received {found:g}"
        )
    return found


def _warnings(craft: GyroCraft, second: Stage2Design, how: GyroOptions) -> list[str]:
    found = []
    if craft.stiffness < _WEAK:
        found.append(
            f"h = {craft.stiffness:.3g} is near 2 or below it, where roll and yaw are hard to tell "
            f"apart: a wheel of {craft.wheel_at(_RECOMMENDED):.3g} N m s has h = {_RECOMMENDED:g}"
        )
    if second.degree < 0.9 * how.degree:
        found.append(f"the degree wanted, {how.degree:g}, was not reached")
    return found


def _loop(craft, second, along, form, satellite=None) -> Revolution:
    """The loop in the usual field, of the satellite or of another under the same law."""
    satellite = craft.satellite() if satellite is None else satellite
    loop = stage_2_loop(satellite, craft.gyrostat, second.gains, normal=along.normal, form=form)
    return revolution_of(loop)


def _errors(scenario, craft, around, along) -> dict[str, np.ndarray]:
    """Root mean squares [deg] by what causes them."""
    meter = scenario.spacecraft.magnetometer
    a, sample_s = along.strength_t, scenario.control.sample_s
    noise = (1e-9 * meter.noise_nt / a) ** 2 * craft.orbital_rate_rad_s * sample_s
    bias = [0.0, 0.0, 0.0, *(1e-9 / a * np.array(meter.bias_nt))]
    disturbance = scenario.disturbance
    torque = np.zeros(3) if disturbance is None else disturbance.constant_torque_n_m
    torque = [*(np.array(torque) / craft.torque_unit), 0.0, 0.0, 0.0]
    radians = {
        "noise": noise_error(around, [0.0] * 3 + [noise] * 3),
        "field model": model_error(around, along),
        "bias": _rms(steady_motion(around, bias)),
        "torque": _rms(steady_motion(around, torque)),
    }
    return {name: np.degrees(error) for name, error in radians.items()}


def _rms(motion) -> np.ndarray:
    return np.sqrt(np.mean(motion[:, :3] ** 2, axis=0))


def _margins(craft, second, along, form) -> dict[str, float]:
    """Degrees of the loop of a satellite that is not what the law knows."""
    s = craft.satellite()
    others = (
        *(s._replace(x=f * s.x, y=f * s.y, z=f * s.z) for f in (0.8, 1.2)),
        *(s._replace(wheel=f * s.wheel) for f in (0.9, 1.1)),
    )
    degrees = (_loop(craft, second, along, form, other).degree for other in others)
    return dict(zip(_MARGINS, degrees, strict=True))


def _law(scenario, craft, first: Stage1Design, second: Stage2Design, form: str) -> dict:
    """The law's keys, as in a scenario."""
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
    control = scenario.control
    if control.actuate_s:
        keys["coil_duty"] = control.actuate_s / (control.measure_s + control.actuate_s)
    held = [x for x in control.named().laws.values() if isinstance(x, HeldAttitude)]
    if held:
        keys |= {"euler_deg": list(held[0].euler_deg), "sequence": held[0].sequence}
    if form == "text":
        mode = scenario.environment.earth_rotation
        x, y, _ = dcm_inertial_to_ecef([0.0], scenario.start, mode)[0, 0]
        angle = math.degrees(math.atan2(y, x))
        keys |= {"form": form, "dipole_nt": _DIPOLE_NT, "meridian_deg": round(angle, 3)}
    return keys


def _lines(made: _Made) -> list[str]:
    """The design as text."""
    craft, first, second = made.craft, made.first, made.second
    tip_off = math.degrees(greatest_tip_off(first.filter_rate_rad_s))
    alias = craft.dipole_of_bias(1e-9, made.along.mean_square_t2)
    rows = [
        f"{made.scenario.name}: J = {craft.inertia:.4g} kg m^2, lambda = "
        f"{craft.pitch_inertia:.3f}, h = {craft.stiffness:.3f} ({craft.stiffness:.3f} above 0, "
        f"{abs(craft.stiffness - 2.0):.3f} from 2)",
        f"field: A = {1e9 * made.along.strength_t:.0f} nT, along the normal {made.along.normal:.3f}"
        f" of it ({made.along.least:.3f} to {made.along.greatest:.3f})",
        f"stage 1: brakes up to {tip_off:.2f} deg/s; Floquet degree {first.degree:.3f} per 1/nu0",
        f"stage 2: Floquet degree {second.degree:.3f} per 1/nu0; by the frozen model "
        f"{made.frozen_degree:.3f}",
        f"{'error, rms [deg]':<20}{'roll':>10}{'pitch':>10}{'yaw':>10}",
    ]
    for name, error in made.errors.items():
        rows.append(f"{name:<20}" + "".join(f"{x:>10.3g}" for x in error))
    rows.append("degree with " + ", ".join(f"{k}: {x:.3f}" for k, x in made.margins.items()))
    rows.append(
        f"a bias of 1 nT along pitch is taken for a dipole of {alias:.3g} A m^2, which is the "
        "least that can be told from it"
    )
    rows += [f"note: {note}" for note in made.notes]
    return [*rows, "", *_toml(made.law).splitlines()]


def _data(made: _Made, files: list[str]) -> dict:
    craft = made.craft
    return {
        "name": made.scenario.name,
        "inertia_kg_m2": craft.inertia,
        "pitch_inertia": craft.pitch_inertia,
        "stiffness": craft.stiffness,
        "least_wheel_n_m_s": craft.wheel_at(0.0),
        "decoupling_wheel_n_m_s": craft.wheel_at(2.0),
        "strength_t": made.along.strength_t,
        "normals": list(made.along.normals),
        "stage_1": made.first._asdict(),
        "greatest_tip_off_rad_s": greatest_tip_off(made.first.filter_rate_rad_s),
        "weights": made.second.weights._asdict(),
        "degree": made.second.degree,
        "frozen_degree": float(made.frozen_degree),
        "errors_deg": {name: error.tolist() for name, error in made.errors.items()},
        "margins": made.margins,
        "dipole_of_1_nt_a_m2": craft.dipole_of_bias(1e-9, made.along.mean_square_t2),
        "law": made.law,
        "notes": list(made.notes),
        "files": files,
    }


def _write(made: _Made, out: Path) -> list[str]:
    """law.toml."""
    with writing_to(out):
        return [str(put(out / "law.toml", _toml(made.law)))]


def _toml(law: dict) -> str:
    """The law as the table of a scenario."""
    rows = (f"{key} = {json.dumps(value)}" for key, value in law.items())
    return "\n".join(["[control.law]", *rows, ""])
