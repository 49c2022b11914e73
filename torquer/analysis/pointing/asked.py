"""What holding an attitude asks of coils and wheels, against their limits, by linear theory."""

import math

import numpy as np

from torquer.analysis.pointing.predicted import Effect, Part, wheel_speeds
from torquer.analysis.pointing.setting import Setting
from torquer.theory.validity import Doubt, Limit

COILS_GIVE = Limit("dipole asked of a coil over its limit", most=1.0,
                   why="a coil saturates, and the loop is no longer linear")  # fmt: skip
WHEELS_TURN = Limit("speed of a wheel over its limit", most=1.0, why="a wheel saturates")
WHEELS_PUSH = Limit("torque asked of a wheel over its limit", most=1.0,
                    why="a wheel's motor saturates, and the loop is no longer linear")  # fmt: skip
#: Standard deviations that coils and motors must still give.
_SIGMAS = 2.0


def saturations(setting: Setting, whole: Effect | None) -> list[Doubt]:
    """Doubts where all causes together ask for more than coils or wheels have.

    Of coils, and of the motors of wheels: the mean and two standard deviations, at the worst
    instant; nothing is said where `whole` is None. Of wheels also the speed, from the momentum that
    they take. Nothing is said of wheels that other laws may unload.
    """
    if setting.hold.answers != "torque":
        return [] if whole is None else _driven(setting, whole)
    wheels = setting.scenario.spacecraft.wheels
    speeds = None if setting.scenario.control.laws else wheel_speeds(setting)
    if wheels is None or speeds is None:
        return []
    share = float(np.abs(speeds[setting.first :]).max() / wheels.speed_limit_rad_s)
    fast = [] if WHEELS_TURN.holds(share) else [Doubt(WHEELS_TURN, share)]
    return fast if whole is None else [*fast, *_pushed(setting, whole)]


def _pushed(setting: Setting, whole: Effect) -> list[Doubt]:
    """Of the torques of the wheels' motors."""
    array = setting.scenario.spacecraft.wheels.array()
    shares = np.linalg.pinv(np.array(array.axes).T)
    found = most_asked(setting, whole, shares, array.torque_limits())
    return _doubts(WHEELS_PUSH, *found, "wheel", "N m")


def _driven(setting: Setting, whole: Effect) -> list[Doubt]:
    """Of the dipoles of the coils."""
    coils = setting.scenario.spacecraft.coils
    assert coils is not None
    found = most_asked(setting, whole, coils.shares(), coils.limits_a_m2())
    return _doubts(COILS_GIVE, *found, "coil", "A m^2")


def _doubts(bound: Limit, share: float, number: int, most: float, said: str, unit: str):
    """What is asked of an actuator beyond its limit."""
    if bound.holds(share):
        return []
    words = (
        f"{said} {number} is asked for {share * most:.3g} {unit} (mean and {_SIGMAS:g} sigma, "
        f"without what linear theory has no number for) of {most:.3g}: {bound.why}"
    )
    return [Doubt(bound, share, words)]


def most_asked(
    setting: Setting, whole: Effect, shares: np.ndarray, limits: np.ndarray
) -> tuple[float, int, float]:
    """Greatest part of a limit that is asked of an actuator, its number and its limit.

    `shares` (actuators, 3): of each in a unit of what the law asks for along the body's axes;
    `limits` (actuators,). Noise of the readings goes straight into the command; what else it does
    to the rate is left out.
    """
    first = setting.first
    per_state = shares @ setting.loop.gains
    mean = np.einsum("nci,ni->nc", per_state, _states(setting, whole.pointing.mean))
    units = per_state @ _states(setting, whole.pointing.units)
    squares = np.sum(units**2, axis=2) + _noise(setting, per_state, whole)
    asked = (np.abs(mean) + _SIGMAS * np.sqrt(squares))[first:].max(axis=0)
    most = int(np.argmax(asked / limits))
    return float(asked[most] / limits[most]), most, float(limits[most])


def _states(setting: Setting, turns: np.ndarray) -> np.ndarray:
    """Turns with their rates over the orbital one, as the loop has its state."""
    rates = np.gradient(turns, setting.loop.cycle_s * setting.hold.rate_rad_s, axis=0)
    return np.concatenate([turns, rates], axis=1)


def _noise(setting: Setting, per_state: np.ndarray, whole: Effect) -> np.ndarray:
    """Variances (n, actuators) of what noise asks for."""

    def through(part: Part) -> np.ndarray:
        if part.spread is None:
            return np.zeros(per_state.shape[:2])
        turns = per_state[:, :, :3]
        return np.einsum("nci,nij,ncj->nc", turns, part.spread.turns, turns)

    gyro = setting.scenario.spacecraft.one_of("gyro")
    rate = math.radians(gyro.noise_deg_s) / setting.hold.rate_rad_s
    by_rate = rate**2 * np.sum(per_state[:, :, 3:] ** 2, axis=2)
    return through(whole.pointing) + through(whole.knowledge) + by_rate
