"""The case of `torquer theory`, from options or a scenario; one clear line per mistake."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from torquer import validate
from torquer.control.pointing import HeldByWheels
from torquer.conventions import EARTH_RADIUS_M, MU_EARTH_M3_S2
from torquer.environment.field.averaged import (
    Averaged,
    ascending_node,
    cone_angle,
    mean_of_extremes,
    mean_strength,
)
from torquer.geometry.quaternion import rotate
from torquer.geometry.vec3 import as_vector
from torquer.orbit.kepler import check_farthest
from torquer.theory.evolution import EVOLUTIONS
from torquer.theory.evolution.model import Case, Evolution
from torquer.theory.gains import Sampling
from torquer.theory.spinner import Spinner

LAWS = (
    "bdot", "nutation_damping", "spin_up", "reorientation", "preliminary_1", "preliminary_2",
    "sdot",
)  # fmt: skip
#: Laws of scenarios that have the averaged motion of another.
_SAME = {
    "bdot_rate": "bdot", "bdot_derivative": "bdot", "bdot_model": "bdot",
    "nutation_damping_rate": "nutation_damping",
    "nutation_damping_derivative": "nutation_damping",
    "sdot_rate": "sdot",
}  # fmt: skip
_RATE_DEG_S = (5.0, 5.0, 5.0)
_SAMPLED = ("bdot", "nutation_damping")
_POINTED = ("reorientation", "preliminary_1", "preliminary_2", "sdot")
#: Laws without a spin axis of their own.
_ANY_AXIS = ("bdot", "sdot")


@dataclass(frozen=True)
class AveragedCase:
    """Law, satellite and orbit of an averaged motion.

    `gain` None: not given (a design needs none). `rho`, `sigma` [rad], None: any direction.
    `notes`: assumptions and omissions, one line each. `sampling`: of B-dot and nutation damping.
    """

    law: str
    gain: float | None
    spinner: Spinner
    theta: float
    rho: float | None = None
    sigma: float = 0.0
    target: tuple = (0.0, 0.0, 1.0)
    notes: tuple[str, ...] = ()
    name: str = ""
    sampling: Sampling | None = None

    @property
    def evolution(self) -> Evolution:
        """Its closed equations."""
        return EVOLUTIONS[self.law]

    @property
    def constants(self) -> Case:
        """Constants of the equations; eps = 1 without a gain."""
        constants = self.evolution.case(self.gain or 1.0, self.spinner, self.target)
        return constants if self.gain else constants._replace(eps=1.0)

    @property
    def period_s(self) -> float:
        """Time of a revolution."""
        return 2.0 * math.pi / self.spinner.orbital_rate_rad_s


def part_of(case: AveragedCase, to_percent: float | None) -> float:
    """Target fraction of the initial value."""
    grows = case.law == "spin_up"
    part = (200.0 if grows else 10.0) if to_percent is None else to_percent
    in_range("--to", "to", part, 0.0)
    if grows and not 100.0 < part < math.inf:
        raise ValueError(f"--to: must be above 100 for spin_up, which grows; received {part:g}")
    if not grows and not 0.0 < part < 100.0:
        raise ValueError(f"--to: must lie between 0 and 100; received {part:g}")
    return part / 100.0


def case_of(law, given: dict, scenario: Path | None, design: bool) -> AveragedCase:
    """The case from either source; `ValueError` if both or neither is given."""
    named = [f"--{key.replace('_', '-')}" for key, value in given.items() if value is not None]
    if law is not None and law not in LAWS:
        raise ValueError(f"LAW: must be one of {', '.join(LAWS)}; received {law!r}")
    if scenario is not None:
        if named:
            raise ValueError(f"{named[0]}: must not be given with --scenario; received both")
        return _of_scenario(law, scenario)
    if law is None:
        raise ValueError(f"LAW: must be one of {', '.join(LAWS)}; received nothing")
    needed = ("inclination_deg", "inertia", *(() if design else ("gain",)))
    for key in (*needed, *(("sun_deg",) if law == "sdot" else ())):
        if given[key] is None:
            option = f"--{key.replace('_', '-')}"
            raise ValueError(f"{option}: must be given (or --scenario); received nothing")
    if law != "sdot" and given["sun_deg"] is not None:
        raise ValueError(f"--sun-deg: must be left out for {law}; received {given['sun_deg']:g}")
    return _spun(_of_options(law, given))


def _spun(case: AveragedCase) -> AveragedCase:
    """Precise reorientation assumes spin about the axis: its nutation is neglected."""
    if case.law != "reorientation" or case.theta < math.radians(1.0):
        return case
    note = (
        f"reorientation assumes spin about the axis: theta0 of {math.degrees(case.theta):.0f} "
        "deg is neglected; damp it first"
    )
    return replace(case, theta=0.0, notes=(*case.notes, note))


def _positive(**values) -> None:
    for name, value in values.items():
        if value is not None and not 0.0 < value < math.inf:
            option = f"--{name.replace('_', '-')}"
            raise ValueError(f"{option}: must be a positive number; received {value:g}")


def in_range(option: str, key: str, value: float | None, low: float | None = None) -> None:
    """Raise `ValueError` for a number beyond the range of the quantity that the key names."""
    if value is not None and (must := validate.out_of_range(key, value, low)):
        raise ValueError(f"{option}: must be {must}; received {value:g}")


def _within(option: str, value: float | None, high: float) -> None:
    if value is not None and not 0.0 <= value <= high:
        raise ValueError(f"{option}: must lie within 0..{high:g} deg; received {value:g}")


def _of_options(law: str, given: dict) -> AveragedCase:
    _positive(**{k: given[k] for k in ("altitude_km", "strength_nt", "gain", "sample_s")})
    in_range("--strength-nt", "strength_nt", given["strength_nt"], 0.0)
    in_range("--gain", "gain_a_m2_per_t", given["gain"], 0.0)
    for rate in given["rate_deg_s"] or ():
        in_range("--rate-deg-s", "rate_deg_s", rate)
    _within("--inclination-deg", given["inclination_deg"], 180.0)
    _within("--rho-deg", given["rho_deg"], 180.0)
    _within("--sun-deg", given["sun_deg"], 180.0)
    inclination = math.radians(given["inclination_deg"])
    radius_m, b0_t = _radius_and_strength(given["altitude_km"], given["strength_nt"], inclination)
    moments = np.diag(validate.inertia_tensor("--inertia", given["inertia"]))
    rate = given["rate_deg_s"] or _RATE_DEG_S
    notes = (
        ()
        if given["rate_deg_s"]
        else ("the initial rate is the default: set it with --rate-deg-s",)
    )
    motion = _spinning(np.diag(moments), np.array([0.0, 0.0, 1.0]), rate)
    spinner, theta, remarks = _spinner(motion, given["inclination_deg"], b0_t, radius_m)
    rho = None if given["rho_deg"] is None else math.radians(given["rho_deg"])
    name = f"{(radius_m - EARTH_RADIUS_M) / 1e3:.4g} km, {given['inclination_deg']:g} deg"
    sampling, sun = _sampling(law, given["sample_s"], given["lag_s"]), given["sun_deg"]
    target = (0.0, 0.0, 1.0)
    if sun is not None:
        target = (math.sin(math.radians(sun)), 0.0, math.cos(math.radians(sun)))
        if rho is not None:
            notes = (*notes, "the momentum lies in the plane of the cone axis and the Sun")
    return AveragedCase(
        law, given["gain"], spinner, theta, rho, target=target, notes=(*notes, *remarks), name=name,
        sampling=sampling,
    )  # fmt: skip


def _sampling(law: str, sample_s: float | None, lag_s: float | None) -> Sampling | None:
    """Sample and hold at one interval, also that of the law's differences."""
    if sample_s is None and lag_s is None:
        return None
    if law not in _SAMPLED:
        option, value = ("--lag-s", lag_s) if sample_s is None else ("--sample-s", sample_s)
        raise ValueError(f"{option}: must be left out for {law}; received {value:g}")
    if sample_s is None:
        raise ValueError("--sample-s: must be given with --lag-s; received nothing")
    if not 0.0 <= (lag_s or 0.0) < math.inf:
        raise ValueError(f"--lag-s: must be 0 or positive; received {lag_s:g}")
    return Sampling(sample_s, sample_s, lag_s or 0.0)


def _radius_and_strength(altitude_km, strength_nt, inclination) -> tuple[float, float]:
    """Radius [m] and B0 [T]; the direct dipole supplies one of them if it is not given."""
    equatorial = Averaged().mu_e_t_km3 * 1e9
    if altitude_km is not None:
        radius_m = EARTH_RADIUS_M + 1e3 * altitude_km
        check_farthest(radius_m)
        b0_t = mean_of_extremes(equatorial / radius_m**3, inclination)
        return radius_m, b0_t if strength_nt is None else 1e-9 * strength_nt
    if strength_nt is None:
        raise ValueError("--altitude-km: it or --strength-nt must be given; received neither")
    radius_m = (mean_of_extremes(equatorial, inclination) / (1e-9 * strength_nt)) ** (1.0 / 3.0)
    if radius_m <= EARTH_RADIUS_M:
        most = 1e9 * mean_of_extremes(equatorial / EARTH_RADIUS_M**3, inclination)
        raise ValueError(
            f"--strength-nt: must be below {most:.0f} nT, its value on the ground, without "
            f"--altitude-km; received {strength_nt:g}"
        )
    check_farthest(radius_m)
    return radius_m, 1e-9 * strength_nt


def _spinning(tensor, axis, rate_deg_s) -> tuple:
    """(A, C, length of the momentum, theta, spread of the transverse moments)."""
    rate = np.radians(validate.finite("--rate-deg-s", rate_deg_s, (3,)))
    momentum = tensor @ rate
    length = float(np.linalg.norm(momentum))
    if length == 0.0:
        raise ValueError(
            "rate: must not be zero: averaging assumes a fast rotation; received 0 0 0"
        )
    axial = float(axis @ tensor @ axis)
    transverse = 0.5 * (float(np.trace(tensor)) - axial)
    theta = math.acos(min(1.0, max(-1.0, float(axis @ momentum) / length)))
    moments = np.linalg.eigvalsh(tensor - axial * np.outer(axis, axis))
    spread = (moments[-1] - sorted(moments, key=abs)[1]) / transverse
    return transverse, axial, length, theta, abs(float(spread))


def _spinner(motion, inclination_deg, b0_t, radius_m) -> tuple[Spinner, float, tuple]:
    transverse, axial, length, theta, spread = motion
    notes: tuple[str, ...] = ()
    if spread > 0.02:
        notes = (f"the transverse moments differ by {100 * spread:.0f} %: their mean is used",)
    try:
        spinner = Spinner(
            inclination_deg=inclination_deg,
            strength_t=b0_t,
            transverse_kg_m2=transverse,
            axial_kg_m2=axial,
            momentum_n_m_s=length,
            orbital_rate_rad_s=math.sqrt(MU_EARTH_M3_S2 / radius_m**3),
        )
    except ValidationError as error:
        first = error.errors()[0]
        must = first["msg"].removeprefix("Input should be ")
        raise ValueError(
            f"{first['loc'][0]}: must be {must}; received {first['input']:g}"
        ) from None
    return spinner, theta, notes


def _of_scenario(law: str | None, path: Path) -> AveragedCase:
    """Orbit, field, body, motion, law and duty cycle from a scenario file."""
    from torquer.notes.bdot_notes import sampling_of
    from torquer.scenario.load import load_scenario

    scenario = load_scenario(path)
    key, spec = _only_law(scenario.control)
    kind = _SAME.get(spec.kind, spec.kind)
    if kind not in LAWS:
        raise ValueError(
            f"control.{key}.kind: must be one of {', '.join(LAWS)} to be averaged; "
            f"received {kind!r}"
        )
    if law not in (None, kind):
        raise ValueError(f"LAW: must be the scenario's, {kind}, or left out; received {law!r}")
    r, v = (x[0] for x in scenario.orbit.state(np.zeros(1), scenario.start))
    orbit, notes = _circle(r, v)
    field = scenario.environment.field
    known = field if isinstance(field, Averaged) else Averaged()
    b0_t = mean_strength(known.prepare(0.0), orbit["radius_m"], orbit["inclination"])
    tensor = validate.inertia_tensor("inertia_kg_m2", scenario.spacecraft.body.inertia_kg_m2)
    state = scenario.initial.motion(r, v)
    axis = _axis(kind, spec, tensor)
    motion = _spinning(tensor, axis, np.degrees(state[4:]))
    spinner, theta, remarks = _spinner(
        motion, math.degrees(orbit["inclination"]), b0_t, orbit["radius_m"]
    )
    momentum = rotate(tuple(state[:4]), as_vector(tensor @ state[4:]))
    rho, sigma = _polar(_to_z(momentum, orbit))
    gain, duty_note = _gain(key, spec, scenario.control)
    case = AveragedCase(
        kind, gain, spinner, theta, rho, sigma, name=scenario.name,
        notes=(*notes, *remarks, *duty_note, *_saturation(scenario, spec, kind, spinner)),
        sampling=sampling_of(scenario, spec) if kind in _SAMPLED else None,
    )  # fmt: skip
    return _spun(_pointed(case, spec, scenario, orbit)) if kind in _POINTED else case


def _only_law(control) -> tuple:
    """Key and spec of the law of the coils that always works."""
    laws, modes = control.named()
    coils = {key: law for key, law in laws.items() if not isinstance(law, HeldByWheels)}
    if modes is not None or len(coils) != 1:
        received = "modes or a scheme" if modes is not None else f"{len(coils)} laws of the coils"
        raise ValueError(f"control.law: must be one law to be averaged; received {received}")
    ((name, spec),) = coils.items()
    return control.key_of(name), spec


def _circle(r, v) -> tuple[dict, tuple]:
    """Circular approximation of an orbit, from its state in the inertial frame."""
    h = np.cross(r, v)
    size = 1.0 / (2.0 / np.linalg.norm(r) - v @ v / MU_EARTH_M3_S2)
    eccentricity = math.sqrt(max(0.0, 1.0 - h @ h / (MU_EARTH_M3_S2 * size)))
    notes: tuple[str, ...] = ()
    if eccentricity > 0.005:
        notes = (f"the orbit, of eccentricity {eccentricity:.3f}, is approximated by a circle",)
    node = np.array(ascending_node(as_vector(h)))
    inclination = math.atan2(math.hypot(h[0], h[1]), h[2])
    return {"radius_m": float(size), "inclination": inclination, "node": node}, notes


def _to_z(vector, orbit) -> np.ndarray:
    """A vector of the inertial frame in Z."""
    node, cone = orbit["node"], cone_angle(orbit["inclination"])
    second = np.cross([0.0, 0.0, 1.0], node)
    x, y, z = vector @ node, vector @ second, vector[2]
    c, s = math.cos(cone), math.sin(cone)
    return np.array([x, c * y + s * z, c * z - s * y])


def _polar(vector) -> tuple[float, float]:
    return math.atan2(math.hypot(vector[0], vector[1]), vector[2]), math.atan2(vector[1], vector[0])


def _axis(kind, spec, tensor) -> np.ndarray:
    """Spin axis of the law; for B-dot and S-dot the principal axis closest to one of symmetry."""
    if kind not in _ANY_AXIS:
        return np.array(spec.axis)
    moments, axes = np.linalg.eigh(tensor)
    first = abs(moments[1] - moments[2]) < abs(moments[0] - moments[1])
    return axes[:, 0 if first else 2]


def _gain(key: str, spec, control) -> tuple[float, tuple]:
    """Effective gain: the gain times the duty cycle; `key`: that of the law in `control`."""
    gain_key = getattr(spec, "gain_key", "gain_a_m2_s_per_t")
    gain = getattr(spec, gain_key)
    if gain is None:
        raise ValueError(
            f"control.{key}.{gain_key}: must be given: averaging does not cover relays; received "
            f"a relay of {spec.relay_dipole_a_m2:g} A m^2"
        )
    if control.measure_s == 0.0:
        return gain, ()
    duty = control.actuate_s / control.cycle_s
    note = f"the coils are on {100 * duty:.0f} % of the time: effective gain {gain * duty:.4g}"
    return gain * duty, (note,)


def _saturation(scenario, spec, kind, spinner) -> tuple:
    """A note if B-dot or S-dot may initially command more than the coils can produce."""
    limit = np.max(scenario.spacecraft.coils.limit_a_m2)
    if kind not in _ANY_AXIS:
        return ()
    rate = spinner.momentum_n_m_s / spinner.transverse_kg_m2
    if kind == "bdot":
        commanded, words = spec.gain_a_m2_s_per_t * rate * spinner.strength_t, ("", "brake")
    else:
        commanded, words = spec.gain_a_m2_s * rate, ("up to ", "act")
    if commanded <= limit:
        return ()
    return (
        f"the law initially commands {words[0]}{commanded:.3g} A m^2 from coils limited to "
        f"{limit:.3g}: saturated, they {words[1]} more slowly than averaging predicts",
    )


def _pointed(case: AveragedCase, spec, scenario, orbit) -> AveragedCase:
    """With the law's target, as far as closed equations cover it."""
    target = getattr(spec, "target", "sun")
    if target == "sun":
        target = scenario.surroundings().sun(np.zeros(1))[0]
    there = _to_z(np.asarray(target, dtype=np.float64), orbit)
    there = there / np.linalg.norm(there)
    if case.law == "reorientation":
        length = spec.momentum_n_m_s / case.spinner.momentum_n_m_s
        return replace(case, target=tuple((length * there).tolist()))
    if case.law == "sdot":
        return replace(case, target=tuple(there.tolist()))
    away = math.degrees(math.acos(min(1.0, max(-1.0, there[2]))))
    if away < 1.0:
        return case
    note = (
        f"the target is {away:.0f} deg from the cone axis, where {case.law} has no closed "
        "equations: the cone axis is used"
    )
    return replace(case, notes=(*case.notes, note))
