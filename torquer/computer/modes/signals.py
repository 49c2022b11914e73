"""Signals: the quantities that conditions of a mode table look at.

A signal is a function `(table, state, k, index) -> float`, in SI units; not a number where it is
unknown. `k` is the record of what is known (`KNOWN`), which `read_inputs` shows as the inputs of a
law. `index` is the number of the state, sensor or region that its condition names. Adding one: its
function and its line in `SIGNALS`.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.informed import known_vector
from torquer.computer.inputs import read_inputs
from torquer.computer.interface import MAGNETOMETER
from torquer.computer.laws.pointing import deviation, reference_motion, short_way
from torquer.computer.laws.targets import reference_of
from torquer.computer.modes.coil_check import all_reversed, has_field_reversed, is_ineffective
from torquer.computer.modes.sensor_check import SUSPECTED_S, is_field_doubtful
from torquer.computer.modes.turning import fastest_turn
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
#: Greatest value of a signal by its unit; others have none.
GREATEST = {"yes/no": 1.0, "part": 1.0, "deg": 180.0}
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
        return known_vector(inputs.sun_body)
    return rotate_inverse(inputs.estimate.q_body_to_inertial, table.target)


@inlined
def rate(table, state, k, index):
    """Absolute angular rate."""
    inputs = read_inputs(k)
    return norm(inputs.estimate.omega_body_rad_s)


@inlined
def spin(table, state, k, index):
    """Rate about the axis."""
    inputs = read_inputs(k)
    return dot(table.axis, inputs.estimate.omega_body_rad_s)


@inlined
def nutation(table, state, k, index):
    """Angle between the line of the axis and the momentum: 0 for a spin either way."""
    inputs = read_inputs(k)
    off = angle(table.axis, momentum(table, inputs))
    return math.pi - off if off > 0.5 * math.pi else off


@inlined
def momentum_rate(table, state, k, index):
    """Magnitude of the momentum over the mean moment of inertia: nutation does not change it."""
    inputs = read_inputs(k)
    mean = (table.inertia_kg_m2[0] + table.inertia_kg_m2[1] + table.inertia_kg_m2[2]) / 3.0
    return norm(momentum(table, inputs)) / mean


@inlined
def axis_to_target(table, state, k, index):
    """Angle between axis and target."""
    inputs = read_inputs(k)
    return angle(table.axis, target_body(table, inputs))


@inlined
def momentum_to_target(table, state, k, index):
    """Angle between momentum and target."""
    inputs = read_inputs(k)
    return angle(momentum(table, inputs), target_body(table, inputs))


@inlined
def axis_to_sun(table, state, k, index):
    """Angle between axis and Sun, by the Sun sensors."""
    inputs = read_inputs(k)
    return angle(table.axis, known_vector(inputs.sun_body))


@inlined
def from_wanted(table, inputs):
    """(Quaternion from the wanted attitude to the body, rate relative to its reference frame)."""
    if table.follows_targets > 0.0:
        reference = reference_of(inputs, table.targets)
        return deviation(inputs, (0.0, 0.0, 0.0, 1.0), reference.q, reference.omega)
    return deviation(inputs, table.q_wanted, *reference_motion(inputs, table.orbital))


@inlined
def attitude_error(table, state, k, index):
    """Angle of the turn from the wanted attitude to the estimated one."""
    inputs = read_inputs(k)
    error, _ = from_wanted(table, inputs)
    return 2.0 * math.atan2(norm(short_way(error)), abs(error[3]))


@inlined
def attitude_rate(table, state, k, index):
    """Angular rate relative to the frame of the wanted attitude."""
    inputs = read_inputs(k)
    _, relative = from_wanted(table, inputs)
    return norm(relative)


@inlined
def sun_in_view(table, state, k, index):
    """1 while a Sun sensor sees the Sun, else 0."""
    inputs = read_inputs(k)
    return 1.0 if norm(known_vector(inputs.sun_body)) > 0.0 else 0.0


@inlined
def sunlit_fraction(table, state, k, index):
    """Visible part of the Sun's disc, by the ephemeris."""
    return k.sunlit_fraction


@inlined
def field(table, state, k, index):
    """Magnitude of the field that the magnetometer reads."""
    inputs = read_inputs(k)
    return norm(known_vector(inputs.b_body_t))


@inlined
def wheel_momentum(table, state, k, index):
    """Magnitude of the wheels' momentum."""
    inputs = read_inputs(k)
    return norm(known_vector(inputs.wheel_momentum_body_n_m_s))


@inlined
def estimate_age(table, state, k, index):
    """Time since the estimate was made; infinite before the first."""
    return k.t_s - k.estimate_s


@inlined
def estimate_sigma(table, state, k, index):
    """Standard deviation of the estimated attitude."""
    return k.sigma_rad


@inlined
def estimate_doubts(table, state, k, index):
    """1 while the estimator judges a sensor's readings to be wrong, else 0."""
    return k.isolated[index]


@inlined
def reading_age(table, state, k, index):
    """Time since a sensor's latest reading was taken; infinite before the first."""
    return k.t_s - k.read_s[index]


@inlined
def time(table, state, k, index):
    """Time since the start of the run."""
    return k.t_s


@inlined
def time_in_state(table, state, k, index):
    """How long a region has been in its state."""
    return k.t_s - state.regions[index]["since_s"]


@inlined
def entries(table, state, k, index):
    """How often a state has been entered, the present time included."""
    return state.states[index]["entries"]


@inlined
def in_state(table, state, k, index):
    """1 while the state's region is in it, else 0."""
    region = table.states[index]["region"]
    return 1.0 if state.regions[region]["state"] == index else 0.0


@inlined
def sensor_suspected(table, state, k, index):
    """1 while a sensor is suspected: silent, stuck, or in contradiction to others and models."""
    now = state.sensors[index]
    suspected_s = max(now.failed_s, now.blamed_s)
    if index == MAGNETOMETER and all_reversed(state.checks[0]):
        return 1.0
    return 1.0 if k.t_s - suspected_s <= SUSPECTED_S else 0.0


@inlined
def coil_suspected(table, state, k, index):
    """1 while the dipole along a body axis clearly does not do what is commanded, else 0.

    A field of the wrong sign, which makes all coils seem reversed, is not theirs.
    """
    now = state.checks[0]
    of_field = all_reversed(now) or is_field_doubtful(now)
    return 1.0 if is_ineffective(now, index) and not of_field else 0.0


@inlined
def coils_reversed(table, state, k, index):
    """1 while the coils work against the command, all of them or by a field of the wrong sign.

    A law of differences brakes then with its sign changed.
    """
    return 1.0 if has_field_reversed(state.checks[0]) > 0.0 else 0.0


@inlined
def turn(table, state, k, index):
    """Rate by whatever still turns with the satellite: the fastest of gyro, field and Sun.

    Wrong signs and swapped axes do not change it, whichever sensor is suspected.
    """
    return fastest_turn(state.checks[0], k.t_s)


@inlined
def flag(table, state, k, index):
    """1 while the flag is raised from outside, by flight software or by command, else 0."""
    return state.flags[index]


class Signal(NamedTuple):
    """A signal: its function, its unit as users write it, what it must be given.

    `needs`: keys of the mode table (`axis`, `target`, `inertia_kg_m2`, `attitude` or `attitude_of`,
    `noise`) and of the condition (`state`, `sensor`, `coil`, `flag`). `may_stay_unknown`: it can
    lack a value for good, so that a state must not wait for it alone. `estimated`: the parts of the
    estimate that it is computed from ('rate', 'attitude', 'sigma'); it is unknown while one of them
    is. `reads`: what the computer must provide, as for a law's `needs`. `observes`: what else
    changes it by a failure: names of `SENSORS` or 'coils'; 'rate' and 'attitude' for what the
    estimate takes from; 'estimator' for all that an estimator compares; 'sensor' for the one that
    the condition names.
    `least` and `greatest` value, in its unit; left out: 0, and that of `GREATEST`.
    """

    function: Callable
    unit: str
    needs: tuple[str, ...] = ()
    may_stay_unknown: bool = False
    estimated: tuple[str, ...] = ()
    reads: frozenset[str] = frozenset()
    observes: tuple[str, ...] = ()
    least: float = 0.0
    greatest: float | None = None

    @property
    def docs(self) -> str:
        """What it is, in a sentence."""
        return self.function.__doc__

    @property
    def sources(self) -> frozenset[str]:
        """All that it observes, by the estimate, too."""
        return frozenset({*self.estimated, *self.observes} - {"sigma"})

    @property
    def range(self) -> tuple[float, float]:
        """Its least and greatest value, in its unit."""
        if self.greatest is not None:
            return self.least, self.greatest
        return self.least, GREATEST.get(self.unit, math.inf)


_EPHEMERIS, _SUN = frozenset({"ephemeris"}), frozenset({"sun"})
_RATE, _ATTITUDE = ("rate",), ("attitude",)
#: All signals by name; their places here are their numbers in the kernel.
SIGNALS = {
    "rate_deg_s": Signal(rate, "deg/s", estimated=_RATE),
    "spin_deg_s": Signal(spin, "deg/s", ("axis",), estimated=_RATE, least=-math.inf),
    "nutation_deg": Signal(
        nutation, "deg", ("axis", "inertia_kg_m2"), estimated=_RATE, greatest=90.0
    ),
    "momentum_rate_deg_s": Signal(momentum_rate, "deg/s", ("inertia_kg_m2",), estimated=_RATE),
    "axis_to_target_deg": Signal(
        axis_to_target, "deg", ("axis", "target"), True, _ATTITUDE, observes=("sun_sensors",)
    ),
    "momentum_to_target_deg": Signal(
        momentum_to_target, "deg", ("target", "inertia_kg_m2"), True, ("rate", "attitude"),
        observes=("sun_sensors",),
    ),
    "attitude_error_deg": Signal(
        attitude_error, "deg", ("attitude",), True, _ATTITUDE, _EPHEMERIS
    ),
    "attitude_rate_deg_s": Signal(
        attitude_rate, "deg/s", ("attitude",), True, ("attitude", "rate"), _EPHEMERIS
    ),
    "axis_to_sun_deg": Signal(
        axis_to_sun, "deg", ("axis",), True, reads=_SUN, observes=("sun_sensors",)
    ),
    "sun_in_view": Signal(sun_in_view, "yes/no", reads=_SUN, observes=("sun_sensors",)),
    "sunlit_fraction": Signal(sunlit_fraction, "part", reads=_EPHEMERIS),
    "field_nt": Signal(field, "nT", observes=("magnetometer",)),
    "wheel_momentum_n_m_s": Signal(wheel_momentum, "N m s", observes=("tachometers",)),
    "estimate_age_s": Signal(estimate_age, "s", observes=("attitude", "rate")),
    "estimate_sigma_deg": Signal(
        estimate_sigma, "deg", (), True, ("sigma",), observes=("attitude",), greatest=math.inf
    ),
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
    "turn_deg_s": Signal(
        turn, "deg/s", ("noise", "inertia_kg_m2"), reads=_EPHEMERIS,
        observes=("gyro", "magnetometer", "sun_sensors"),
    ),
    "time_s": Signal(time, "s"),
    "time_in_state_s": Signal(time_in_state, "s"),
    "entries": Signal(entries, "times", ("state",)),
    "in_state": Signal(in_state, "yes/no", ("state",)),
    "flag": Signal(flag, "yes/no", ("flag",)),
}  # fmt: skip
NUMBER_OF = {name: number for number, name in enumerate(SIGNALS)}


def _chain() -> Callable:
    """`signal_value` as text, from the table.

    One function within another for each signal, instead, compiles for seconds.
    """
    functions = {f"_{number}": one.function for number, one in enumerate(SIGNALS.values())}
    text = "def signal_value(signal, table, state, k, index):\n"
    for number, name in enumerate(functions):
        text += f"    if signal == {number}:\n"
        text += f"        return {name}(table, state, k, index)\n"
    text += "    return nan\n"
    names: dict = {**functions, "nan": math.nan, "__name__": __name__}
    exec(compile(text, __file__, "exec"), names)
    return inlined(names["signal_value"])


#: `signal_value(number, table, state, k, index)`: the signal of a number; unknown if there is
#: none.
signal_value = _chain()
