"""What holding an attitude asks of coils and wheels, against their limits, by linear theory."""

import math

import numpy as np

from torquer.analysis.pointing.predicted import Effect, Part, wheel_speeds
from torquer.analysis.pointing.setting import Setting
from torquer.theory.validity import Doubt, Limit

COILS_GIVE = Limit("dipole asked of a coil over its limit", most=1.0,
                   why="a coil saturates, and the loop is no longer linear")  # fmt: skip
WHEELS_TURN = Limit("speed of a wheel over its limit", most=1.0, why="a wheel saturates")
#: Standard deviations that coils must still give.
_SIGMAS = 2.0


def saturations(setting: Setting, whole: Effect) -> list[Doubt]:
    """Doubts where all causes together ask for more than coils or wheels have.

    Of coils: the mean and two standard deviations, at the worst instant. Of wheels the speed, from
    the momentum that they take; none where other laws may unload them.
    """
    wheels = setting.scenario.spacecraft.wheels
    if setting.hold.answers == "torque":
        speeds = None if setting.scenario.control.laws else wheel_speeds(setting)
        if wheels is None or speeds is None:
            return []
        share = float(np.abs(speeds[setting.first :]).max() / wheels.speed_limit_rad_s)
        return [] if WHEELS_TURN.holds(share) else [Doubt(WHEELS_TURN, share)]
    share, coil, limit = most_of_a_coil(setting, whole)
    if COILS_GIVE.holds(share):
        return []
    words = (
        f"coil {coil} is asked for {share * limit:.3g} A m^2 (mean and {_SIGMAS:g} sigma, without "
        f"what linear theory has no number for) of {limit:.3g}: {COILS_GIVE.why}"
    )
    return [Doubt(COILS_GIVE, share, words)]


def most_of_a_coil(setting: Setting, whole: Effect) -> tuple[float, int, float]:
    """Greatest part of a limit that is asked of a coil, its number and its limit [A m^2].

    Noise of the readings goes straight into the command; what else it does to the rate is left out.
    """
    coils, first = setting.scenario.spacecraft.coils, setting.first
    assert coils is not None
    per_state = coils.shares() @ setting.loop.gains
    mean = np.einsum("nci,ni->nc", per_state, _states(setting, whole.pointing.mean))
    units = per_state @ _states(setting, whole.pointing.units)
    squares = np.sum(units**2, axis=2) + _noise(setting, per_state, whole)
    asked = (np.abs(mean) + _SIGMAS * np.sqrt(squares))[first:].max(axis=0)
    limits = coils.limits_a_m2()
    coil = int(np.argmax(asked / limits))
    return float(asked[coil] / limits[coil]), coil, float(limits[coil])


def _states(setting: Setting, turns: np.ndarray) -> np.ndarray:
    """Turns with their rates over the orbital one, as the loop has its state."""
    rates = np.gradient(turns, setting.loop.cycle_s * setting.hold.rate_rad_s, axis=0)
    return np.concatenate([turns, rates], axis=1)


def _noise(setting: Setting, per_state: np.ndarray, whole: Effect) -> np.ndarray:
    """Variances (n, coils) of what noise asks for."""

    def through(part: Part) -> np.ndarray:
        if part.spread is None:
            return np.zeros(per_state.shape[:2])
        turns = per_state[:, :, :3]
        return np.einsum("nci,nij,ncj->nc", turns, part.spread.turns, turns)

    gyro = setting.scenario.spacecraft.one_of("gyro")
    rate = math.radians(gyro.noise_deg_s) / setting.hold.rate_rad_s
    by_rate = rate**2 * np.sum(per_state[:, :, 3:] ** 2, axis=2)
    return through(whole.pointing) + through(whole.knowledge) + by_rate
