"""True motions beside the averaged ones: the body as it is, in the field of the tilted dipole.

The law is flown with exact readings, B-dot's with the field's own turning in dB/dt; coils neither
saturate nor lag. Three short motions take some hundredths of a second.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.computer.laws.built_in import BUILT_IN
from torquer.environment.field.averaged import mean_of_extremes
from torquer.maths.geometry.frames import dcm_z_to_y
from torquer.theory.averaged.case import POINTED, AveragedCase
from torquer.theory.slow.evolution.model import Slow
from torquer.theory.slow.full_motion import by_euler_from, slow_variables_of
from torquer.theory.slow.gain_and_time import GOALS, Start, slow_time, starts_over_directions
from torquer.theory.slow.spinner import Spinner
from torquer.theory.validity import Doubt, Limit

_TURN = 2.0 * math.pi
#: Phases of a motion: angle about the momentum, day angle [rad].
_PHASES = ((0.0, 0.0), (_TURN / 3.0, 2.0 * _TURN / 3.0), (2.0 * _TURN / 3.0, _TURN / 3.0))
#: Length of a motion, over the time of the formula; revolutions where that is never.
_LONGER, _NEVER = 2.5, 200.0
#: The dipole's direction to the Earth's axis [deg], IGRF-14 in 2025.
_TILT_DEG = 180.0 - 9.21
#: Turns of the body that a motion may have, and points of it that are looked at, window by window.
_MOST_TURNS, _POINTS, _WINDOW = 5000.0, 800, 8
#: Change of the quantity, over itself, below which a motion tells nothing.
_TELLS = 0.1
_RTOL = 1e-7


class Flight(NamedTuple):
    """A true motion beside the formula: revolutions of both until the goal, infinite for never.

    `span`: revolutions flown; `left`: the quantity at their end, over its initial value; `ratio`:
    revolutions flown over those of the formula, None where the motion is too short to tell.
    """

    rho_deg: float
    formula: float
    flown: float
    span: float
    left: float
    ratio: float | None

    @property
    def needed(self) -> float:
        """Revolutions until the goal; of a motion too short for it, by the ratio; NaN: unknown."""
        if self.ratio is None:
            return math.nan
        is_short = self.span < 0.999 * _LONGER * self.formula < math.inf
        return self.formula * self.ratio if is_short else self.flown

    def data(self) -> dict:
        """Plain data; None for never, and for a ratio that is not finite."""
        return {key: x if x is None or math.isfinite(x) else None
                for key, x in self._asdict().items()}  # fmt: skip


class Flights(NamedTuple):
    """True motions of a case."""

    each: tuple[Flight, ...]

    @property
    def needed(self) -> float:
        """Median of the revolutions until the goal, of the motions that tell; NaN if none does."""
        needed = sorted(x for flight in self.each if not math.isnan(x := flight.needed))
        return needed[len(needed) // 2] if needed else math.nan

    @property
    def ratios(self) -> list[float]:
        """Of those that tell."""
        return sorted(flight.ratio for flight in self.each if flight.ratio is not None)

    @property
    def ratio(self) -> float | None:
        """Their median; None if none tells."""
        return self.ratios[len(self.ratios) // 2] if self.ratios else None

    def doubt(self, median: Limit, one: Limit) -> Doubt | None:
        """What they say against the formula, with the limits of their ratios; None: nothing."""
        if self.ratio is None:
            return None
        off = [each for each in self.ratios if not one.holds(each)]
        value = self.ratio if not median.holds(self.ratio) else (off or [self.ratio])[0]
        if median.holds(value):
            return None
        words = ""
        if value == 0.0:
            arrives = any(math.isfinite(flight.flown) for flight in self.each)
            words = (
                "the formula says never, but true motions go there"
                if arrives
                else "the formula says never, but true motions go on towards it"
            )
        elif math.isinf(value):
            words = "the formula gives a time, but a true motion does not come there"
        return Doubt(median, value, words)

    def line(self) -> str:
        """In words."""
        if not self.each:
            return "there from the start: nothing flown"
        if not self.ratios:
            span = max(flight.span for flight in self.each)
            return f"flown {len(self.each)} times, {span:.3g} revolutions: too short to tell"
        flown = sorted(flight.flown for flight in self.each)
        times = [f"{x:.3g}" for x in flown if math.isfinite(x)]
        never = len(flown) - len(times)
        words = " to ".join(dict.fromkeys((times[0], times[-1]))) if times else ""
        if never:
            span = max(flight.span for flight in self.each)
            left = [100.0 * flight.left for flight in self.each if math.isinf(flight.flown)]
            reach = " to ".join(dict.fromkeys(f"{x:.3g}" for x in (min(left), max(left))))
            not_in = f"not within {span:.3g} revolutions (there {reach} %)"
            some = f"in {never} of {len(flown)} {not_in}"
            words = f"{words} revolutions, {some}" if times else not_in
        else:
            words += " revolutions"
        return f"flown {len(flown)} times: {words}"


def find_starts(case: AveragedCase, part: float) -> tuple[Start, Start, Start]:
    """Those of the least, the median and the greatest time; all equal where the direction is
    known."""
    if case.rho is not None:
        start = Slow(1.0, case.rho, case.sigma, case.theta)
        known = Start(case.rho, case.sigma, slow_time(case.evolution, case.constants, start, part))
        return known, known, known
    return starts_over_directions(case.evolution, case.constants, case.theta, part)


def fly(case: AveragedCase, part: float, gain: float, starts: tuple[Start, ...]) -> Flights:
    """True motions of a case with a gain, until `part` of the initial value."""
    eps = case.evolution.small_parameter(gain, case.spinner)
    if all(start.slow == 0.0 for start in starts):
        return Flights(())
    flights = (
        _fly(case, part, gain, eps, start, phase)
        for start, phase in zip(starts, _PHASES, strict=True)
    )
    return Flights(tuple(flights))


def _fly(case, part, gain, eps, start, phase) -> Flight:
    rho, sigma, slow = start
    formula, rho_deg = slow / (_TURN * eps), math.degrees(start.rho)
    turns = max(float(np.linalg.norm(case.rate_rad_s)) / case.spinner.orbital_rate_rad_s, 1.0)
    span = min(_LONGER * formula if math.isfinite(formula) else _NEVER, _MOST_TURNS / turns)
    u = np.linspace(0.0, _TURN * span, _POINTS)
    try:
        value = _quantity(case, gain, rho, sigma, phase, u)
    except RuntimeError:  # a motion faster than can be followed
        return Flight(rho_deg, formula, math.inf, 0.0, 1.0, None)
    first, falls = abs(value[0]), part < 1.0
    if first < 1e-7:
        return Flight(rho_deg, formula, 0.0, 0.0, 0.0, None)
    windows = value.reshape(-1, _WINDOW)
    ends = windows.max(axis=1) if falls else windows.min(axis=1)
    there = ends <= part * first if falls else ends >= part * first
    left = float(ends[-1] / first)
    if there.any():
        flown = float(u[::_WINDOW][np.argmax(there)]) / _TURN
        return Flight(rho_deg, formula, flown, span, left, flown / formula)
    ratio = _ratio_at_end(case, eps, start, part, span, left)
    return Flight(rho_deg, formula, math.inf, span, left, ratio)


def _ratio_at_end(case, eps, start, part, span, left) -> float | None:
    """Of a motion that has not come to the goal: the formula's time to where it has come."""
    rho, sigma, slow = start
    moved = abs(math.log(left)) > _TELLS if left > 0.0 else False
    if math.isinf(slow):
        return 0.0 if moved and (left < 1.0) == (part < 1.0) else None
    if not moved or (left < 1.0) != (part < 1.0):
        return math.inf if span * _TURN * eps >= 0.5 * slow else None
    constants = case.constants._replace(eps=1.0)
    until = slow_time(case.evolution, constants, Slow(1.0, rho, sigma, case.theta), left)
    return span * _TURN * eps / until if until > 0.0 else None


def _quantity(case: AveragedCase, gain: float, rho, sigma, phase, u) -> np.ndarray:
    """What the law is to change, along the true motion from a direction of the momentum."""
    to_y = np.array(dcm_z_to_y(math.radians(_cone_deg(case))))
    spinner = _in_true_field(case, to_y)
    inertia, rate = np.array(case.inertia), np.array(case.rate_rad_s)
    along = to_y @ [math.sin(rho) * math.cos(sigma), math.sin(rho) * math.sin(sigma), math.cos(rho)]
    attitude = _attitude(inertia @ rate, along, phase[0])
    law = _law(case, gain, to_y)
    states = by_euler_from(
        law, spinner, inertia, [*attitude.as_quat(), *rate], u, day=phase[1], rtol=_RTOL
    )
    turned = Rotation.from_matrix(to_y.T) * Rotation.from_quat(states[:, :4])
    in_z = np.column_stack([turned.as_quat(), states[:, 4:]])
    slow = slow_variables_of(inertia, case.spinner.momentum_n_m_s, in_z)
    return GOALS[case.law].of(slow, case.constants)


def _cone_deg(case: AveragedCase) -> float:
    return math.degrees(case.spinner.orbit_field().angle)


def _in_true_field(case: AveragedCase, to_y) -> Spinner:
    """Orbit and the tilted dipole whose field has the strength B0 of the averaged one."""
    inclination = math.radians(case.spinner.inclination_deg)
    equatorial = case.spinner.strength_t / mean_of_extremes(1.0, inclination)
    sun = tuple((to_y @ case.target).tolist()) if case.law == "sdot" else None
    return case.spinner.model_copy(
        update={
            "field": "tilted_dipole", "tilt_deg": _TILT_DEG, "field_turn": True,
            "strength_t": equatorial, "sun": sun,
        }
    )  # fmt: skip


def _attitude(momentum_body, along, angle: float) -> Rotation:
    """An attitude with the momentum along a direction, turned about it by an angle."""
    body = momentum_body / np.linalg.norm(momentum_body)
    about = Rotation.from_rotvec(angle * np.asarray(along))
    return about * _onto(along) * _onto(body).inv()


def _onto(direction) -> Rotation:
    """A rotation that takes the third axis to a direction."""
    x, y, z = direction
    rho, sigma = math.atan2(math.hypot(x, y), z), math.atan2(y, x)
    return Rotation.from_euler("ZY", [sigma, rho])


def _law(case: AveragedCase, gain: float, to_y):
    spec: Any = BUILT_IN[case.flown]
    keys: dict[str, Any] = {getattr(spec, "gain_key", "gain_a_m2_s_per_t"): gain}
    if case.law in POINTED and case.law != "sdot":
        keys["target"] = tuple((to_y @ case.target).tolist())
    if "inertia_kg_m2" in spec.model_fields:
        keys["inertia_kg_m2"] = case.inertia
    if "momentum_n_m_s" in spec.model_fields:
        keys["momentum_n_m_s"] = float(np.linalg.norm(case.target)) * case.spinner.momentum_n_m_s
    return spec(**keys).law()
