"""What the author of a scenario with the law `wheel_tracking` should know before the run."""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.uses import Use, notes_on_laws
from torquer.base.conventions import EARTH_RADIUS_M
from torquer.computer.laws.wheel_tracking import WheelTracking
from torquer.scenario.spec import Scenario
from torquer.spacecraft.wheel_array.envelope import momentum_envelope, torque_envelope

#: Greatest angular acceleration of the direction to a place that is passed at a rate, in rate^2:
#: that of atan(rate t), 3 sqrt(3)/8.
_BEND = 0.65
#: Height below which there is no pass over a place [m].
_LOW_M = 1e5
_POINTS = 256
#: Angle [deg] between two targets, or one and the other's opposite, below which the turn about the
#: first is fast.
_NEAR_DEG = 5.0


def tracking_notes(scenario: Scenario) -> list[str]:
    """Notes on every law of this kind, one line each."""
    if scenario.spacecraft.wheels is None:
        return []
    checks = {
        "the torque of its slews": _slew_notes,
        "passes over the place": _pass_notes,
        "targets along one line": _line_notes,
    }
    return [*notes_on_laws(scenario, checks)]


def _slew_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """Whether wheels at rest have the torque that slews begin and end with."""
    if not isinstance(use.law, WheelTracking):
        return
    up = math.radians(use.law.greatest_acceleration_deg_s2)
    torque = up * float(scenario.spacecraft.body.principal()[0][-1])
    weakest = torque_envelope(scenario.spacecraft.wheels.array()).inner_radius
    if torque > weakest:
        yield (
            f"a slew at greatest_acceleration_deg_s2 = {use.law.greatest_acceleration_deg_s2:g} "
            f"takes up to {torque:.3g} N m, but the wheels give {weakest:.3g} N m about their "
            "weakest axis: the torque saturates, and the body falls behind"
        )


def _pass_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """What the wheels need where the satellite passes over the place on the ground."""
    law, moment = use.law, float(scenario.spacecraft.body.principal()[0][-1])
    if not isinstance(law, WheelTracking) or "ground" not in law.targets:
        return
    rate = _greatest_pass_rate(scenario)
    array = scenario.spacecraft.wheels.array()
    holds, gives = momentum_envelope(array).inner_radius, torque_envelope(array).inner_radius
    passes = f"a pass over the place turns the body at up to {math.degrees(rate):.2g} deg/s"
    if rate * moment > holds:
        yield (
            f"{passes}: {rate * moment:.3g} N m s, but the wheels hold {holds:.3g} N m s about "
            "their weakest axis"
        )
    if _BEND * rate**2 * moment > gives:
        yield (
            f"{passes} and takes {_BEND * rate**2 * moment:.3g} N m, but the wheels give "
            f"{gives:.3g} N m about their weakest axis"
        )


def _line_notes(scenario: Scenario, use: Use) -> Iterator[str]:
    """Whether the two targets come close to one line, where the turn about the axis is open."""
    if not isinstance(use.law, WheelTracking):
        return
    (target, second), (a, b) = use.law.targets, _directions(scenario, use.law)
    across = np.linalg.norm(np.cross(a, b), axis=1)
    near = np.degrees(np.arcsin(np.min(np.minimum(across, 1.0))))
    if near < _NEAR_DEG:
        yield (
            f"its targets ({target} and {second}) come within {near:.2g} deg of one line: there "
            "the body must turn fast about the axis, or slew; choose a second target off the first"
        )


def _directions(scenario: Scenario, law: WheelTracking) -> list[np.ndarray]:
    """Unit vectors (n, 3) to both targets during the run; for a place on the ground the nadir."""
    t_s, around = _times(scenario), scenario.orbit_environment()
    r, v = around.state(t_s)
    named = {
        "nadir": -r, "ground": -r, "velocity": v, "orbit_normal": np.cross(r, v),
        "sun": around.sun(t_s) - r,
    }  # fmt: skip
    found = [
        named[each] if isinstance(each, str) else np.broadcast_to(each, r.shape)
        for each in law.targets
    ]
    return [each / np.linalg.norm(each, axis=1, keepdims=True) for each in found]


def _times(scenario: Scenario) -> np.ndarray:
    """Times [s] over a revolution, or the run where that is shorter."""
    return np.linspace(0.0, min(scenario.orbit.period_s, scenario.length_s), _POINTS)


def _greatest_pass_rate(scenario: Scenario) -> float:
    """Greatest rate [rad/s] of the direction to a place that lies below, during the run.

    The ground's own motion is left out: it changes the rate by 7 % at most.
    """
    r, v = scenario.orbit_environment().state(_times(scenario))
    height, speed = np.linalg.norm(r, axis=1) - EARTH_RADIUS_M, np.linalg.norm(v, axis=1)
    return float(np.max(np.where(height > _LOW_M, speed / np.maximum(height, _LOW_M), 0.0)))
