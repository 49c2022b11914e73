"""Signals: the quantities that conditions of a mode table look at.

A signal is a function `(table, state, inputs, index) -> float`, in SI units; not a number where
it is unknown. `index` is the number of the state, sensor or region that its condition names.
Adding one: its function, its line in `SIGNALS`, and its lines in `signal_value`.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.laws.pointing import deviation, reference_motion, short_way
from torquer.computer.modes.coil_check import all_reversed, has_field_reversed, is_ineffective
from torquer.computer.modes.sensor_alone import MAGNETOMETER
from torquer.computer.modes.sensor_check import SUSPECTED_S, is_field_doubtful
from torquer.maths.geometry.quaternion import rotate_inverse
from torquer.maths.geometry.vec3 import add, cross, dot, norm, sym_vec

#: SI units in one unit of a signal, as users write it.
UNITS = {
    "deg/s": math.pi / 180.0,
    "deg": math.pi / 180.0,
    "s": 1.0,
    "nT": 1e-9,
    "N m s": 1.0,
    "yes/no": 1.0,
    "times": 1.0,
    "part": 1.0,
}
#: Axes of the dipole by the names that conditions use.
AXES = ("x", "y", "z")


@inlined
def angle(a, b):
    """Angle between two vectors [rad]; not a number if one of them is zero or unknown."""
    sine, cosine = norm(cross(a, b)), dot(a, b)
    return math.nan if sine == 0.0 and cosine == 0.0 else math.atan2(sine, cosine)


@inlined
def momentum(table, inputs):
    """J omega and the fixed momentum of a wheel, in body axes."""
    own = sym_vec(table.inertia_kg_m2, inputs.estimate.omega_body_rad_s)
    return add(own, table.wheel_momentum_n_m_s)


@inlined
def target_body(table, inputs):
    """Unit vector to the target in the body; zeros while the target is a Sun out of view."""
    if table.target_is_sun > 0.0:
        return inputs.sun_body
    return rotate_inverse(inputs.estimate.q_body_to_inertial, table.target)


@inlined
def rate(table, state, inputs, index):
    """Absolute angular rate."""
    return norm(inputs.estimate.omega_body_rad_s)


@inlined
def spin(table, state, inputs, index):
    """Rate about the axis."""
    return dot(table.axis, inputs.estimate.omega_body_rad_s)


@inlined
def nutation(table, state, inputs, index):
    """Angle between the line of the axis and the momentum: 0 for a spin either way."""
    off = angle(table.axis, momentum(table, inputs))
    return math.pi - off if off > 0.5 * math.pi else off


@inlined
def momentum_rate(table, state, inputs, index):
    """Magnitude of the momentum over the mean moment of inertia: nutation does not change it."""
    mean = (table.inertia_kg_m2[0] + table.inertia_kg_m2[1] + table.inertia_kg_m2[2]) / 3.0
    return norm(momentum(table, inputs)) / mean


@inlined
def axis_to_target(table, state, inputs, index):
    """Angle between axis and target."""
    return angle(table.axis, target_body(table, inputs))


@inlined
def momentum_to_target(table, state, inputs, index):
    """Angle between momentum and target."""
    return angle(momentum(table, inputs), target_body(table, inputs))


@inlined
def axis_to_sun(table, state, inputs, index):
    """Angle between axis and Sun, by the Sun sensors."""
    return angle(table.axis, inputs.sun_body)


@inlined
def from_wanted(table, inputs):
    """(Quaternion from the wanted attitude to the body, rate relative to its reference frame)."""
    return deviation(inputs, table.q_wanted, *reference_motion(inputs, table.orbital))


@inlined
def attitude_error(table, state, inputs, index):
    """Angle of the turn from the wanted attitude to the estimated one."""
    error, _ = from_wanted(table, inputs)
    return 2.0 * math.atan2(norm(short_way(error)), abs(error[3]))


@inlined
def attitude_rate(table, state, inputs, index):
    """Angular rate relative to the frame of the wanted attitude."""
    _, relative = from_wanted(table, inputs)
    return norm(relative)


@inlined
def sun_in_view(table, state, inputs, index):
    """1 while a Sun sensor sees the Sun, else 0."""
    return 1.0 if norm(inputs.sun_body) > 0.0 else 0.0


@inlined
def sunlit_fraction(table, state, inputs, index):
    """Visible part of the Sun's disc, by the ephemeris."""
    return inputs.ephemeris.sunlit_fraction


@inlined
def field(table, state, inputs, index):
    """Magnitude of the field that the magnetometer reads."""
    return norm(inputs.b_body_t)


@inlined
def wheel_momentum(table, state, inputs, index):
    """Magnitude of the wheels' momentum."""
    return norm(inputs.wheel_momentum_body_n_m_s)


@inlined
def estimate_age(table, state, inputs, index):
    """Time since the estimate was made; infinite before the first."""
    return inputs.t_s - inputs.estimate.t_s


@inlined
def estimate_sigma(table, state, inputs, index):
    """Standard deviation of the estimated attitude."""
    return inputs.estimate.sigma_rad


@inlined
def estimate_doubts(table, state, inputs, index):
    """1 while the estimator judges a sensor's readings to be wrong, else 0."""
    isolated = inputs.estimate.isolated
    value = isolated[0]
    for k in range(1, len(isolated)):
        value = isolated[k] if index == k else value
    return value


@inlined
def reading_age(table, state, inputs, index):
    """Time since a sensor's latest reading was taken; infinite before the first."""
    read_at = inputs.read_at
    taken_s = read_at.magnetometer_s
    taken_s = read_at.search_coil_s if index == 1 else taken_s
    taken_s = read_at.gyro_s if index == 2 else taken_s
    taken_s = read_at.sun_sensors_s if index == 3 else taken_s
    taken_s = read_at.attitude_sensor_s if index == 4 else taken_s
    taken_s = read_at.tachometers_s if index == 5 else taken_s
    taken_s = read_at.horizon_sensor_s if index == 6 else taken_s
    taken_s = read_at.sun_cells_s if index == 7 else taken_s
    return inputs.t_s - taken_s


@inlined
def time(table, state, inputs, index):
    """Time since the start of the run."""
    return inputs.t_s


@inlined
def time_in_state(table, state, inputs, index):
    """How long a region has been in its state."""
    return inputs.t_s - state.regions[index]["since_s"]


@inlined
def entries(table, state, inputs, index):
    """How often a state has been entered, the present time included."""
    return state.states[index]["entries"]


@inlined
def in_state(table, state, inputs, index):
    """1 while the state's region is in it, else 0."""
    region = table.states[index]["region"]
    return 1.0 if state.regions[region]["state"] == index else 0.0


@inlined
def sensor_suspected(table, state, inputs, index):
    """1 while a sensor is suspected: silent, stuck, or in contradiction to others and models."""
    now = state.sensors[index]
    suspected_s = max(now.failed_s, now.blamed_s)
    if index == MAGNETOMETER and all_reversed(state.checks[0]):
        return 1.0
    return 1.0 if inputs.t_s - suspected_s <= SUSPECTED_S else 0.0


@inlined
def coil_suspected(table, state, inputs, index):
    """1 while the dipole along a body axis clearly does not do what is commanded, else 0.

    A field of the wrong sign, which makes all coils seem reversed, is not theirs.
    """
    now = state.checks[0]
    of_field = all_reversed(now) or is_field_doubtful(now)
    return 1.0 if is_ineffective(now, index) and not of_field else 0.0


@inlined
def coils_reversed(table, state, inputs, index):
    """1 while the coils work against the command, all of them or by a field of the wrong sign.

    A law of differences brakes then with its sign changed.
    """
    return 1.0 if has_field_reversed(state.checks[0]) > 0.0 else 0.0


@inlined
def flag(table, state, inputs, index):
    """1 while the flag is raised from outside, by flight software or by command, else 0."""
    return state.flags[index]


class Signal(NamedTuple):
    """A signal: its function, its unit as users write it, what it must be given.

    `needs`: keys of the mode table (`axis`, `target`, `inertia_kg_m2`, `attitude`, `noise`) and of
    the condition (`state`, `sensor`, `coil`, `flag`). `may_stay_unknown`: it can lack a value for
    good, so that a state must not wait for it alone. `reads`: what the computer must provide, as
    for a law's `needs`. `observes`: the devices whose failure changes it: names of `SENSORS` or
    'coils'; 'rate' and 'attitude' for what the estimate takes from; 'estimator' for all that an
    estimator compares; 'sensor' for the one that the condition names.
    """

    function: Callable
    unit: str
    needs: tuple[str, ...] = ()
    may_stay_unknown: bool = False
    reads: frozenset[str] = frozenset()
    observes: tuple[str, ...] = ()

    @property
    def docs(self) -> str:
        """What it is, in a sentence."""
        return self.function.__doc__


_EPHEMERIS, _SUN = frozenset({"ephemeris"}), frozenset({"sun"})
#: All signals by name; their places here are their numbers in the kernel.
SIGNALS = {
    "rate_deg_s": Signal(rate, "deg/s", observes=("rate",)),
    "spin_deg_s": Signal(spin, "deg/s", ("axis",), observes=("rate",)),
    "nutation_deg": Signal(nutation, "deg", ("axis", "inertia_kg_m2"), observes=("rate",)),
    "momentum_rate_deg_s": Signal(momentum_rate, "deg/s", ("inertia_kg_m2",), observes=("rate",)),
    "axis_to_target_deg": Signal(
        axis_to_target, "deg", ("axis", "target"), True, observes=("attitude", "sun_sensors")
    ),
    "momentum_to_target_deg": Signal(
        momentum_to_target, "deg", ("target", "inertia_kg_m2"), True,
        observes=("rate", "attitude", "sun_sensors"),
    ),
    "attitude_error_deg": Signal(
        attitude_error, "deg", ("attitude",), True, _EPHEMERIS, ("attitude",)
    ),
    "attitude_rate_deg_s": Signal(
        attitude_rate, "deg/s", ("attitude",), True, _EPHEMERIS, ("attitude", "rate")
    ),
    "axis_to_sun_deg": Signal(axis_to_sun, "deg", ("axis",), True, _SUN, ("sun_sensors",)),
    "sun_in_view": Signal(sun_in_view, "yes/no", reads=_SUN, observes=("sun_sensors",)),
    "sunlit_fraction": Signal(sunlit_fraction, "part", reads=_EPHEMERIS),
    "field_nt": Signal(field, "nT", observes=("magnetometer",)),
    "wheel_momentum_n_m_s": Signal(wheel_momentum, "N m s", observes=("tachometers",)),
    "estimate_age_s": Signal(estimate_age, "s", observes=("attitude", "rate")),
    "estimate_sigma_deg": Signal(estimate_sigma, "deg", (), True, observes=("attitude",)),
    "estimate_doubts": Signal(estimate_doubts, "yes/no", ("sensor",), observes=("estimator",)),
    "reading_age_s": Signal(reading_age, "s", ("sensor",), observes=("sensor",)),
    "sensor_suspected": Signal(
        sensor_suspected, "yes/no", ("sensor", "noise", "inertia_kg_m2"), reads=_EPHEMERIS,
        observes=("sensor", "magnetometer", "gyro", "sun_sensors"),
    ),
    "coil_suspected": Signal(
        coil_suspected, "yes/no", ("coil", "noise", "inertia_kg_m2"), reads=_EPHEMERIS,
        observes=("coils", "magnetometer", "gyro"),
    ),
    "coils_reversed": Signal(
        coils_reversed, "yes/no", ("noise", "inertia_kg_m2"), reads=_EPHEMERIS,
        observes=("coils", "magnetometer", "gyro"),
    ),
    "time_s": Signal(time, "s"),
    "time_in_state_s": Signal(time_in_state, "s"),
    "entries": Signal(entries, "times", ("state",)),
    "in_state": Signal(in_state, "yes/no", ("state",)),
    "flag": Signal(flag, "yes/no", ("flag",)),
}  # fmt: skip
NUMBER_OF = {name: number for number, name in enumerate(SIGNALS)}

_NOT_NEGATIVE = (0.0, math.inf)
#: Least and greatest value of a signal, in its unit; one that is not here may have any.
RANGES = {
    **dict.fromkeys(("rate_deg_s", "momentum_rate_deg_s", "attitude_rate_deg_s"), _NOT_NEGATIVE),
    **dict.fromkeys(("field_nt", "wheel_momentum_n_m_s", "estimate_sigma_deg"), _NOT_NEGATIVE),
    **dict.fromkeys(("estimate_age_s", "reading_age_s", "time_s"), _NOT_NEGATIVE),
    **dict.fromkeys(("time_in_state_s", "entries"), _NOT_NEGATIVE),
    **dict.fromkeys(("axis_to_target_deg", "momentum_to_target_deg"), (0.0, 180.0)),
    **dict.fromkeys(("attitude_error_deg", "axis_to_sun_deg"), (0.0, 180.0)),
    **dict.fromkeys(("sun_in_view", "sunlit_fraction", "in_state"), (0.0, 1.0)),
    **dict.fromkeys(("estimate_doubts", "sensor_suspected", "coil_suspected"), (0.0, 1.0)),
    **dict.fromkeys(("coils_reversed", "flag"), (0.0, 1.0)),
    "nutation_deg": (0.0, 90.0),
}
#: What of the estimate a signal is computed from: it is unknown while that is.
ESTIMATED = {
    "rate_deg_s": {"rate"},
    "spin_deg_s": {"rate"},
    "nutation_deg": {"rate"},
    "momentum_rate_deg_s": {"rate"},
    "attitude_error_deg": {"attitude"},
    "attitude_rate_deg_s": {"attitude", "rate"},
    "axis_to_target_deg": {"attitude"},
    "momentum_to_target_deg": {"attitude", "rate"},
    "estimate_sigma_deg": {"sigma"},
}


@inlined
def signal_value(signal, table, state, inputs, index):
    """The signal of a number, its place in `SIGNALS`; unknown if there is none.

    The chain is written out: one function within another for each signal compiles for seconds.
    """
    if signal == 0:
        return rate(table, state, inputs, index)
    if signal == 1:
        return spin(table, state, inputs, index)
    if signal == 2:
        return nutation(table, state, inputs, index)
    if signal == 3:
        return momentum_rate(table, state, inputs, index)
    if signal == 4:
        return axis_to_target(table, state, inputs, index)
    if signal == 5:
        return momentum_to_target(table, state, inputs, index)
    if signal == 6:
        return attitude_error(table, state, inputs, index)
    if signal == 7:
        return attitude_rate(table, state, inputs, index)
    if signal == 8:
        return axis_to_sun(table, state, inputs, index)
    if signal == 9:
        return sun_in_view(table, state, inputs, index)
    if signal == 10:
        return sunlit_fraction(table, state, inputs, index)
    if signal == 11:
        return field(table, state, inputs, index)
    if signal == 12:
        return wheel_momentum(table, state, inputs, index)
    if signal == 13:
        return estimate_age(table, state, inputs, index)
    if signal == 14:
        return estimate_sigma(table, state, inputs, index)
    if signal == 15:
        return estimate_doubts(table, state, inputs, index)
    if signal == 16:
        return reading_age(table, state, inputs, index)
    if signal == 17:
        return sensor_suspected(table, state, inputs, index)
    if signal == 18:
        return coil_suspected(table, state, inputs, index)
    if signal == 19:
        return coils_reversed(table, state, inputs, index)
    if signal == 20:
        return time(table, state, inputs, index)
    if signal == 21:
        return time_in_state(table, state, inputs, index)
    if signal == 22:
        return entries(table, state, inputs, index)
    if signal == 23:
        return in_state(table, state, inputs, index)
    if signal == 24:
        return flag(table, state, inputs, index)
    return math.nan
