"""The goals of a run: the limits of its mission, or those usual for its laws."""

from typing import NamedTuple

import numpy as np

from torquer.analysis.attitude import attitude_error_in
from torquer.analysis.series import Variables, angle_deg
from torquer.base.language import Message, message
from torquer.computer.laws.spin_axis import Pointed
from torquer.maths.geometry.attitudes import to_reference
from torquer.scenario.held import held_by, slews_in_flight
from torquer.scenario.mission import ORBITAL_RATES, Mission
from torquer.scenario.spec import Scenario

#: Limits that are usual for laws, where the scenario names none.
HELD_BY_WHEELS_DEG, HELD_BY_COILS_DEG, POINTED_DEG = 1.0, 10.0, 15.0
_DAMPING = "bdot"
_TO_THE_SUN = ("sun_cross", "spin_to_sun")


#: What limits are for, as words of a sentence and at the beginning of one.
SIGNALS = {
    "rate": "Rate",
    "rate relative to the orbital frame": "Rate relative to the orbital frame",
    "attitude error": "Attitude error",
    "error from the commanded attitude": "Error from the commanded attitude",
    "angle to the Sun": "Angle to the Sun",
    "angle to the target": "Angle to the target",
}


class Goal(NamedTuple):
    """A limit for a signal: the signal in words, its unit, and the reason for the limit.

    `axis` in the body and `target` (a direction in J, None for the Sun) are those of an angle.
    """

    signal: str
    below: float
    unit: str
    why: str
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    target: tuple[float, float, float] | None = None

    @property
    def in_words(self) -> Message:
        """The limit as a part of a sentence."""
        return below_in_words(self.signal, self.below, self.unit)


NAMED = "[mission]"


def below_in_words(signal: str, below: float, unit: str) -> Message:
    """A signal below its limit, as a part of a sentence."""
    return message("{signal} below {below:.3g} {unit}", signal=signal, below=below, unit=unit)


def find_goals(scenario: Scenario) -> list[Goal]:
    """The goals of a scenario; none for uncontrolled motion."""
    if scenario.mission is not None:
        return _name_limit(scenario.mission)
    return _usual(scenario)


def _name_limit(mission: Mission) -> list[Goal]:
    limits = (
        ("rate", mission.rate_below_deg_s, "deg/s"),
        ("rate relative to the orbital frame", mission.rate_orbital_below_deg_s, "deg/s"),
        ("attitude error", mission.attitude_error_below_deg, "deg"),
        ("error from the commanded attitude", mission.commanded_error_below_deg, "deg"),
        ("angle to the Sun", mission.sun_angle_below_deg, "deg"),
    )
    return [
        Goal(signal, below, unit, NAMED, mission.axis)
        for signal, below, unit in limits
        if below is not None
    ]


def _usual(scenario: Scenario) -> list[Goal]:
    """Usual goals, from the laws that work at the end: attitude, else direction, else rate.

    Of laws that slew again and again the attitude that they command, not the one at its end.
    None where regions of modes work side by side: only the author knows their common purpose.
    """
    laws = _last_laws(scenario)
    if len(held_by(scenario.control, laws)) == 1:
        known = scenario.control.named().known_laws()
        by_wheels = any(known[name].drives_wheels for name in laws if name in known)
        limit = HELD_BY_WHEELS_DEG if by_wheels else HELD_BY_COILS_DEG
        why = (
            message("usual for an attitude held by wheels")
            if by_wheels
            else message("usual for an attitude held by coils")
        )
        slews = slews_in_flight(scenario.control)
        signal = "error from the commanded attitude" if slews else "attitude error"
        return [Goal(signal, limit, "deg", why)]
    for spec in laws.values():
        if spec.kind in _TO_THE_SUN or (isinstance(spec, Pointed) and spec.target == "sun"):
            why = message("usual for coils")
            return [Goal("angle to the Sun", POINTED_DEG, "deg", why, spec.axis)]
        if isinstance(spec, Pointed) and not isinstance(spec.target, str):
            why, target = message("usual for coils"), spec.target
            return [Goal("angle to the target", POINTED_DEG, "deg", why, spec.axis, target)]
    if any(spec.kind.startswith(_DAMPING) for spec in laws.values()):
        rate = np.degrees(scenario.orbit.rate_rad_s(scenario.start))
        why = message("{n:g} orbital rates, usual for damping by coils", n=ORBITAL_RATES)
        return [Goal("rate", float(ORBITAL_RATES * rate), "deg/s", why)]
    return []


def _last_laws(scenario: Scenario) -> dict:
    """Specs of laws by name: with modes those of the last state that has any, else all."""
    laws, modes = scenario.control.named()
    if modes is None:
        return laws
    if len(modes.regions) > 1:
        return {}
    used = [state.laws for state in modes.states() if state.laws]
    return {name: laws[name] for name in (used[-1] if used else ())}


def goal_signal(goal: Goal, part: Variables, scenario: Scenario) -> np.ndarray | None:
    """The signal of a goal at the records of a scenario's run; None where it does not exist."""
    if goal.signal == "rate":
        return np.degrees(np.linalg.norm(part["omega_body"].values, axis=1))
    if goal.signal == "rate relative to the orbital frame":
        return np.degrees(np.linalg.norm(part["omega_orbital"].values, axis=1))
    if goal.signal in ("attitude error", "error from the commanded attitude"):
        error = attitude_error_in(part, scenario)
        if error is None:
            return None
        return error.angle_deg if goal.signal == "attitude error" else error.commanded_deg
    return angle_from_axis_deg(part, goal.axis, goal.target)


def angle_from_axis_deg(part: Variables, axis, target=None) -> np.ndarray:
    """Angle [deg] of an axis of the body from a direction in J, or from the Sun if that is None."""
    pointed = to_reference(part["q_body_to_inertial"].values, axis)
    wanted = part["sun_inertial"].values if target is None else np.broadcast_to(target, (1, 3))
    return angle_deg(pointed, wanted)
