"""What each cause does to the attitude and to what is known of it, by linear theory."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from torquer.analysis.budget import budget_while_held
from torquer.analysis.causes import DIPOLE, Cause
from torquer.analysis.counter_tests import without
from torquer.analysis.pointing.causes import ALWAYS, OTHER_LAWS, causes_of
from torquer.analysis.pointing.setting import Setting, torque_of
from torquer.maths.geometry.attitudes import rotation_vector
from torquer.spacecraft.sensors.sensing import mounting_matrix
from torquer.theory.three_axis.effects import Spread, states_under, under_walk, under_white
from torquer.theory.three_axis.linearise import wanted_motion

_DEGREE = math.radians(1.0)
#: Why there is no number.
_UNKNOWN = "it is not a torque or an error that linear theory knows along the orbit"
_NOT_FIRST_ORDER = (
    "it changes the dipole that is asked for by a part of itself: no effect of first order"
)
_LIMIT_CYCLE = "the loop goes round a limit cycle where it asks for less than the coils give"


class Part(NamedTuple):
    """An error as small turns [rad, body axes] at n commands.

    `mean` (n, 3): the same in every flight; `units` (n, 3, m): for each independent number of
    variance one that a flight draws; `spread`: of what is random in the flight, None for nothing.
    """

    mean: np.ndarray
    units: np.ndarray
    spread: Spread | None = None

    def plus(self, other: "Part") -> "Part":
        """Both, independent of each other."""
        spreads = [each for each in (self.spread, other.spread) if each is not None]
        both = spreads[0] if spreads else None
        if len(spreads) == 2:
            both = Spread(*(a + b for a, b in zip(*spreads, strict=True)))
        units = np.concatenate([self.units, other.units], axis=2)
        return Part(self.mean + other.mean, units, both)


class Effect(NamedTuple):
    """What a cause does: error of the attitude (control), error of what is known of it."""

    pointing: Part
    knowledge: Part

    def plus(self, other: "Effect") -> "Effect":
        """Both causes at once."""
        return Effect(self.pointing.plus(other.pointing), self.knowledge.plus(other.knowledge))


def no_error(count: int) -> Part:
    """No error at n commands."""
    return Part(np.zeros((count, 3)), np.zeros((count, 3, 0)))


def predict(setting: Setting, cause: Cause) -> Effect | str:
    """The effect of a cause, or why there is no number for it."""
    if cause.name.startswith("magnetometer"):
        return _NOT_FIRST_ORDER
    effect = _EFFECTS.get(cause.name)
    return _UNKNOWN if effect is None else effect(setting, cause)


def _under(setting: Setting, pushes: np.ndarray) -> np.ndarray:
    """Turns (n, 3, m) under pushes of the state (n, 6, m)."""
    return states_under(setting.loop, pushes)[:, :3]


def _control_only(setting: Setting, **found) -> Effect:
    none = no_error(len(setting.loop.t_s))
    return Effect(none._replace(**found), none)


def _under_torque(setting: Setting, torque: np.ndarray) -> Effect:
    """Of a torque (n, 3) that is the same in every flight."""
    pushes = setting.loop.torque @ torque[:, :, None]
    return _control_only(setting, mean=_under(setting, pushes)[:, :, 0])


def _of_reference(setting: Setting, cause: Cause) -> Effect:
    turns = _under(setting, setting.loop.own[:, :, None])
    return _control_only(setting, mean=turns[:, :, 0])


def _sigma(cause: Cause) -> float:
    (sigma,) = cause.drawn.values()
    return sigma


def _of_dipole(setting: Setting, cause: Cause) -> Effect:
    """A dipole of each axis in the field: the torque m x B."""
    b = setting.loop.b_body_t
    torques = _sigma(cause) * np.cross(np.eye(3)[None], b[:, None, :]).transpose(0, 2, 1)
    return _control_only(setting, units=_under(setting, setting.loop.torque @ torques))


def _of_constant_torque(setting: Setting, cause: Cause) -> Effect:
    return _control_only(setting, units=_under(setting, setting.loop.torque * _sigma(cause)))


def _of_random_torque(setting: Setting, cause: Cause) -> Effect:
    """Held longer or shorter than a cycle it has the same spectral density."""
    given, loop = setting.scenario.disturbance, setting.loop
    assert given is not None
    hold_s = given.random_hold_s or setting.scenario.control.sample_s
    size = given.random_torque_n_m * math.sqrt(hold_s / loop.cycle_s)
    return _control_only(setting, spread=under_white(loop, size * loop.torque, setting.size))


def _oscillating(setting: Setting, cause: Cause) -> Effect:
    """The part of the residual dipole that `disturbance` has, without that of the coils."""
    off = [each for each in causes_of(setting.scenario) if each.label == DIPOLE]
    found = budget_while_held(without(setting.scenario, off))
    torque = found.disturbance["residual_dipole"][: len(setting.loop.t_s)]
    return _under_torque(setting, torque)


def _along(name: str) -> Callable:
    """The effect of a torque along the orbit as it is at the wanted attitude."""

    def effect(setting: Setting, cause: Cause) -> Effect:
        return _under_torque(setting, torque_of(setting, name))

    return effect


# errors of the readings


def _white_known(covariance: np.ndarray, setting: Setting) -> Part:
    """An error of what is known, drawn anew at each command."""
    count = len(setting.loop.t_s)
    windows = count // setting.size
    each = np.tile(covariance, (count, 1, 1)), np.tile(covariance / setting.size, (windows, 1, 1))
    return no_error(count)._replace(spread=Spread(*each))


def _of_attitude_noise(setting: Setting, cause: Cause) -> Effect:
    sensor, loop = setting.scenario.spacecraft.attitude_sensor.pack(), setting.loop
    axis = np.array(sensor.boresight)
    root = sensor.noise_rad * np.eye(3)
    root = root + (sensor.boresight_noise_rad - sensor.noise_rad) * np.outer(axis, axis)
    spread = under_white(loop, loop.reading[:, :, :3] @ root, setting.size)
    return Effect(
        no_error(len(loop.t_s))._replace(spread=spread), _white_known(root @ root.T, setting)
    )


def _of_mounting(setting: Setting, cause: Cause) -> Effect:
    loop, size = setting.loop, _DEGREE * _sigma(cause)
    none = no_error(len(loop.t_s))
    turns = _under(setting, size * loop.reading[:, :, :3])
    known = np.tile(size * np.eye(3), (len(loop.t_s), 1, 1))
    return Effect(none._replace(units=turns), none._replace(units=known))


def _white_rate(setting: Setting, size_rad_s: float) -> Effect:
    loop = setting.loop
    spread = under_white(loop, size_rad_s * loop.reading[:, :, 3:], setting.size)
    return _control_only(setting, spread=spread)


def _of_rate_noise(setting: Setting, cause: Cause) -> Effect:
    return _white_rate(setting, _DEGREE * setting.scenario.spacecraft.gyro.noise_deg_s)


def _of_rate_steps(setting: Setting, cause: Cause) -> Effect | str:
    """Rounding of a noisy reading: uniform over a step."""
    gyro = setting.scenario.spacecraft.gyro
    if gyro.noise_deg_s < gyro.resolution_deg_s / 2.0:
        return "steps above twice the noise are no random error (a limit cycle)"
    step = setting.scenario.spacecraft.gyro.resolution_deg_s
    return _white_rate(setting, _DEGREE * step / math.sqrt(12.0))


def _of_rate_bias(setting: Setting, cause: Cause) -> Effect:
    pushes = _DEGREE * _sigma(cause) * setting.loop.reading[:, :, 3:]
    return _control_only(setting, units=_under(setting, pushes))


def _of_rate_drift(setting: Setting, cause: Cause) -> Effect:
    drift = _DEGREE * setting.scenario.spacecraft.gyro.bias_drift_deg_s_sqrt_s
    loop = setting.loop
    spread = under_walk(loop, drift * loop.reading[:, :, 3:], setting.size)
    return _control_only(setting, spread=spread)


def _of_rate_matrix(setting: Setting, cause: Cause) -> Effect:
    """Scale errors or a turn of the gyro: what it reads of the wanted rate, too much."""
    scale, size = cause.name == "gyro_scale", _sigma(cause)
    errors = []
    for axis in np.eye(3):
        keys = ((size * axis), (0.0, 0.0, 0.0))
        first, second = keys if scale else keys[::-1]
        errors.append(np.array(mounting_matrix(tuple(first), tuple(second))) - np.eye(3))
    read = np.einsum("mij,nj->nim", np.array(errors), setting.rate_rad_s)
    return _control_only(setting, units=_under(setting, setting.loop.reading[:, :, 3:] @ read))


def _of_ephemeris(setting: Setting, cause: Cause) -> Effect:
    """The wanted attitude by the place that the computer believes."""
    hold, loop, scenario = setting.hold, setting.loop, setting.scenario
    r, v = scenario.believed_environment().state(loop.t_s)
    at = hold.instants(loop.t_s * hold.rate_rad_s)._replace(r_m=r, v_m_s=v)
    q, rates = np.empty((len(r), 4)), np.empty((len(r), 3))
    wanted_motion(hold.reference, at, q, rates)
    turn = rotation_vector(setting.q_wanted, q)
    # the rate of the reference is taken off in the body's axes, which turn with the attitude read
    faster = (rates - setting.rate_rad_s + np.cross(turn, setting.rate_rad_s)) / hold.rate_rad_s
    read = -np.concatenate([turn, faster], axis=1)
    asked = np.einsum("nij,nj->ni", loop.gains, read)
    pushes = loop.answer @ asked[:, :, None]
    return _control_only(setting, mean=_under(setting, pushes)[:, :, 0])


# actuators


def _of_tachometers(setting: Setting, cause: Cause) -> Effect:
    """The wanted rate times an error of the momentum that is read."""
    wheels, loop = setting.scenario.spacecraft.wheels, setting.loop
    sizes = wheels.rotor_inertia_kg_m2() * wheels.speed_noise_rad_s
    momenta = sizes[:, None] * np.array(wheels.array().axes)
    torques = np.cross(setting.rate_rad_s[:, None, :], momenta[None]).transpose(0, 2, 1)
    return _control_only(setting, spread=under_white(loop, loop.torque @ torques, setting.size))


def wheel_speeds(setting: Setting) -> np.ndarray | None:
    """Speeds (n, wheels) [rad/s] while the attitude is held; None where momentum alone does not
    tell them."""
    wheels = setting.scenario.spacecraft.wheels
    axes, inertia = np.array(wheels.array().axes), wheels.rotor_inertia_kg_m2()
    if len(axes) > 3 and wheels.allocation != "least_squares":
        return None
    first = inertia * wheels.initial_speeds_rad_s()
    momentum = setting.momentum_n_m_s
    assert momentum is not None
    gained = momentum - momentum[0]
    return (first + gained @ np.linalg.pinv(axes)) / inertia


def _of_friction(setting: Setting, cause: Cause) -> Effect | str:
    """What brakes a rotor turns the body: c sign W + v W along each axis.

    A wheel passes standstill at once where the torque that the attitude takes of it exceeds the
    friction before and the stiction after; else it stands for a while.
    """
    wheels, speeds = setting.scenario.spacecraft.wheels, wheel_speeds(setting)
    if speeds is None:
        return (
            "speeds of more than three wheels that are shared by minimax follow from a search "
            "(allocation = 'least_squares' has a prediction)"
        )
    sticks = wheels.coulomb_friction_n_m if wheels.stiction_n_m is None else wheels.stiction_n_m
    taken = np.gradient(speeds * wheels.rotor_inertia_kg_m2(), setting.loop.cycle_s, axis=0)
    passes = np.diff(np.sign(speeds), axis=0) != 0.0
    if np.any(passes & (np.abs(taken[1:]) <= wheels.coulomb_friction_n_m + sticks)):
        return "a wheel comes to rest, where stiction holds it"
    torque = wheels.coulomb_friction_n_m * np.sign(speeds) + wheels.viscous_friction_n_m_s * speeds
    return _under_torque(setting, torque @ np.array(wheels.array().axes))


def _none(why: str) -> Callable:
    return lambda setting, cause: why


#: By the names of causes; of torques along the orbit those of `torquer.analysis.budget.NAMES`.
_EFFECTS: dict[str, Callable[[Setting, Cause], Effect | str]] = {
    ALWAYS: _of_reference,
    OTHER_LAWS: _none("what the other laws ask for depends on the wheels' momentum"),
    "air": _along("aerodynamic"),
    "solar_pressure": _along("solar_pressure"),
    "eddy_currents": _along("eddy_currents"),
    "oscillating_dipole": _oscillating,
    "residual_dipole": _of_dipole,
    "constant_torque": _of_constant_torque,
    "random_torque": _of_random_torque,
    "attitude_sensor_noise": _of_attitude_noise,
    "attitude_sensor_mounting": _of_mounting,
    "gyro_noise": _of_rate_noise,
    "gyro_resolution": _of_rate_steps,
    "gyro_bias": _of_rate_bias,
    "gyro_drift": _of_rate_drift,
    "gyro_scale": _of_rate_matrix,
    "gyro_mounting": _of_rate_matrix,
    "ephemeris": _of_ephemeris,
    "wheels_noise": _of_tachometers,
    "wheels_friction": _of_friction,
    "coils_random_error": _none(_NOT_FIRST_ORDER),
    "coils_resolution": _none(_LIMIT_CYCLE),
    "coils_dead_band": _none(_LIMIT_CYCLE),
}
