"""The case of an averaged motion: law, satellite and orbit, as far as averaging covers them."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from torquer.base import validate
from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.computer.laws.pointing import HeldByWheels
from torquer.environment.field.averaged import Averaged, ascending_node, cone_angle, mean_strength
from torquer.maths.geometry.attitudes import axes_about
from torquer.maths.geometry.quaternion import rotate
from torquer.maths.geometry.vec3 import as_matrix, as_vector
from torquer.scenario.spec import Scenario
from torquer.theory.averaged.assumed import (
    CIRCULAR,
    SPINS,
    SYMMETRIC,
    TO_CONE_AXIS,
    WITHIN_LIMITS,
)
from torquer.theory.averaged.equations import LAWS
from torquer.theory.averaged.sampling import law_sampling
from torquer.theory.slow.evolution import EVOLUTIONS
from torquer.theory.slow.evolution.model import Case, Evolution
from torquer.theory.slow.gains import Sampling
from torquer.theory.slow.spinner import Spinner
from torquer.theory.validity import Limit

#: Laws of scenarios, with the law whose averaged motion they have.
_SAME = {
    "bdot_rate": "bdot", "bdot_derivative": "bdot", "bdot_model": "bdot",
    "nutation_damping_rate": "nutation_damping",
    "nutation_damping_derivative": "nutation_damping",
    "sdot_rate": "sdot",
}  # fmt: skip
#: The laws that true motions fly: with exact readings, of a rate of change too.
_FLOWN = {
    "bdot_rate": "bdot_rate", "nutation_damping_rate": "nutation_damping_rate",
    "bdot": "bdot_derivative", "nutation_damping": "nutation_damping_derivative",
    "sdot": "sdot_rate",
}  # fmt: skip
#: Laws that sample and hold, laws with a target, and laws without a spin axis of their own.
SAMPLED = ("bdot", "nutation_damping")
POINTED = ("reorientation", "preliminary_1", "preliminary_2", "sdot")
_ANY_AXIS = ("bdot", "sdot")


@dataclass(frozen=True)
class AveragedCase:
    """Law, satellite and orbit of an averaged motion.

    `gain` None: not given (a design needs none). `rho`, `sigma` [rad], None: any direction.
    `notes`: assumptions and omissions, one line each. `sampling`: of B-dot and nutation damping.
    `inertia` (rows [kg m^2]) and `rate_rad_s`: of the body as it is, spin axis third. `flown`: kind
    of the law that true motions fly. `assumed`: conditions of the averaged motion that the case
    itself must meet, with its numbers.
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
    inertia: tuple = ()
    rate_rad_s: tuple = ()
    flown: str = ""
    assumed: tuple[tuple[Limit, float], ...] = ()

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
    def damped_rate_rad_s(self) -> float:
        """Rate to be damped: of the body, or of its precession in nutation damping."""
        across = self.spinner.momentum_n_m_s / self.spinner.transverse_kg_m2
        if self.law == "nutation_damping":
            return across
        along = self.spinner.momentum_n_m_s / self.spinner.axial_kg_m2
        return math.hypot(across * math.sin(self.theta), along * math.cos(self.theta))

    @property
    def period_s(self) -> float:
        """Time of a revolution."""
        return 2.0 * math.pi / self.spinner.orbital_rate_rad_s


def case_from_scenario(scenario: Scenario) -> AveragedCase:
    """Orbit, field, body, motion, law and duty cycle of a scenario.

    ValueError unless one law of the coils always works and can be averaged.
    """
    key, spec = _only_law(scenario.control)
    kind = _SAME.get(spec.kind, spec.kind)
    if kind not in LAWS:
        raise ValueError(
            f"control.{key}.kind: must be one of {', '.join(LAWS)} to be averaged; "
            f"received {kind!r}"
        )
    r, v = (x[0] for x in scenario.orbit.state(np.zeros(1), scenario.start))
    orbit, notes, assumed = _circle(r, v)
    field = scenario.environment.field
    known = field if isinstance(field, Averaged) else Averaged()
    b0_t = mean_strength(known.prepare(0.0), orbit["radius_m"], orbit["inclination"])
    tensor = validate.inertia_tensor("inertia_kg_m2", scenario.spacecraft.body.inertia)
    state = scenario.initial.motion(r, v)
    axis = _axis(kind, spec, tensor)
    inclination_deg = math.degrees(orbit["inclination"])
    spinner, theta, remarks, body = as_spinner(
        tensor, axis, np.degrees(state[4:]), inclination_deg, b0_t, orbit["radius_m"]
    )
    momentum = rotate(tuple(state[:4]), as_vector(tensor @ state[4:]))
    rho, sigma = _polar(_to_z(momentum, orbit))
    gain, duty_note = _gain(key, spec, scenario.control)
    saturation = _saturation(scenario, spec, kind, spinner)
    case = AveragedCase(
        kind, gain, spinner, theta, rho, sigma, name=scenario.name,
        notes=(*notes, *remarks, *duty_note, *saturation[0]),
        sampling=law_sampling(scenario, spec) if kind in SAMPLED else None,
        inertia=body.inertia, rate_rad_s=body.rate_rad_s, flown=flown_kind(spec.kind),
        assumed=(*assumed, *body.assumed, *saturation[1]),
    )  # fmt: skip
    if kind not in POINTED:
        return case
    return spun_about_the_axis(_point(case, spec, scenario, orbit))


def spun_about_the_axis(case: AveragedCase) -> AveragedCase:
    """The case, for precise reorientation without its nutation, which that law neglects."""
    if case.law != "reorientation" or case.theta < math.radians(1.0):
        return case
    note = (
        f"reorientation assumes spin about the axis: a nutation of {math.degrees(case.theta):.0f} "
        "deg is neglected; damp it first"
    )
    assumed = (*case.assumed, (SPINS, math.degrees(case.theta)))
    return replace(case, theta=0.0, notes=(*case.notes, note), assumed=assumed)


class Body(NamedTuple):
    """The body as it is, its spin axis third: rows of its inertia tensor [kg m^2], its rate [rad/s]
    and what the averaged motion assumes of it."""

    inertia: tuple
    rate_rad_s: tuple
    assumed: tuple


def flown_kind(kind: str) -> str:
    """The law that true motions fly for a law of a scenario."""
    return _FLOWN.get(kind) or _FLOWN.get(_SAME.get(kind, kind), kind)


def as_spinner(
    tensor, axis, rate_deg_s, inclination_deg: float, b0_t: float, radius_m: float
) -> tuple[Spinner, float, tuple[str, ...], Body]:
    """(Axisymmetric satellite on its circular orbit, theta, notes, itself) of a body in motion.

    Body axes: inertia `tensor` [kg m^2], unit vector of the spin `axis`, rate.
    """
    momentum = tensor @ np.radians(rate_deg_s)
    length = float(np.linalg.norm(momentum))
    if length == 0.0:
        raise ValueError(
            "rate: must not be zero: averaging assumes a fast rotation; received 0 0 0"
        )
    axial = float(axis @ tensor @ axis)
    transverse = 0.5 * (float(np.trace(tensor)) - axial)
    theta = math.acos(min(1.0, max(-1.0, float(axis @ momentum) / length)))
    moments = np.linalg.eigvalsh(tensor - axial * np.outer(axis, axis))
    spread = abs(float((moments[-1] - sorted(moments, key=abs)[1]) / transverse))
    notes: tuple[str, ...] = ()
    if spread > 0.02:
        notes = (f"the transverse moments differ by {100 * spread:.0f} %: their mean is used",)
    spinner = Spinner(
        inclination_deg=inclination_deg,
        strength_t=b0_t,
        transverse_kg_m2=transverse,
        axial_kg_m2=axial,
        momentum_n_m_s=length,
        orbital_rate_rad_s=math.sqrt(MU_EARTH_M3_S2 / radius_m**3),
    )
    return spinner, theta, notes, _turned(tensor, axis, np.radians(rate_deg_s), spread)


def _turned(tensor, axis, rate, spread: float) -> Body:
    """The body in axes of which the third is its spin axis."""
    rows = axes_about(axis)
    return Body(as_matrix(rows @ tensor @ rows.T), as_vector(rows @ rate), ((SYMMETRIC, spread),))


def _only_law(control) -> tuple:
    """Key and spec of the law of the coils that always works."""
    laws, modes = control.named()
    coils = {key: law for key, law in laws.items() if not isinstance(law, HeldByWheels)}
    if modes is not None or len(coils) != 1:
        received = "modes or a scheme" if modes is not None else f"{len(coils)} laws of the coils"
        raise ValueError(f"control.law: must be one law to be averaged; received {received}")
    ((name, spec),) = coils.items()
    return control.key_of(name), spec


def _circle(r, v) -> tuple[dict, tuple, tuple]:
    """Circular approximation of an orbit, from its state in the inertial frame."""
    h = np.cross(r, v)
    size = 1.0 / (2.0 / np.linalg.norm(r) - v @ v / MU_EARTH_M3_S2)
    eccentricity = math.sqrt(max(0.0, 1.0 - h @ h / (MU_EARTH_M3_S2 * size)))
    notes: tuple[str, ...] = ()
    if eccentricity > 0.005:
        notes = (f"the orbit, of eccentricity {eccentricity:.3f}, is approximated by a circle",)
    node = np.array(ascending_node(as_vector(h)))
    inclination = math.atan2(math.hypot(h[0], h[1]), h[2])
    orbit = {"radius_m": float(size), "inclination": inclination, "node": node}
    return orbit, notes, ((CIRCULAR, eccentricity),)


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
    duty = control.coil_duty
    note = f"the coils are on {100 * duty:.0f} % of the time: effective gain {gain * duty:.4g}"
    return gain * duty, (note,)


def _saturation(scenario, spec, kind, spinner) -> tuple[tuple, tuple]:
    """What B-dot or S-dot may initially command over what the coils can produce, and a note."""
    limit = scenario.spacecraft.coils.limits_a_m2().max()
    if kind not in _ANY_AXIS:
        return (), ()
    rate = spinner.momentum_n_m_s / spinner.transverse_kg_m2
    if kind == "bdot":
        commanded, words = spec.gain_a_m2_s_per_t * rate * spinner.strength_t, ("", "brake")
    else:
        commanded, words = spec.gain_a_m2_s * rate, ("up to ", "act")
    assumed = ((WITHIN_LIMITS, float(commanded / limit)),)
    if commanded <= limit:
        return (), assumed
    note = (
        f"the law initially commands {words[0]}{commanded:.3g} A m^2 from coils limited to "
        f"{limit:.3g}: saturated, they {words[1]} more slowly than averaging predicts"
    )
    return (note,), assumed


def _point(case: AveragedCase, spec, scenario, orbit) -> AveragedCase:
    """With the law's target, as far as closed equations cover it."""
    target = getattr(spec, "target", "sun")
    if target == "sun":
        target = scenario.orbit_environment().sun(np.zeros(1))[0]
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
    assumed = (*case.assumed, (TO_CONE_AXIS, away))
    return replace(case, notes=(*case.notes, note), assumed=assumed)
