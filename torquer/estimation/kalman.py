"""What the Kalman filters share: start, readings, innovation gate, restart, their spec.

The filters are multiplicative: a quaternion is estimated, and a small rotation from it, which is
put back into the quaternion after every measurement. E. Lefferts, F. Markley, M. Shuster, 'Kalman
filtering for spacecraft attitude estimation' (1982).
"""

import math
from typing import Annotated, Literal, NamedTuple

from pydantic import Field, model_validator

from torquer.engine import inlined
from torquer.estimation.covariance import (
    IDENTITY,
    biased_measurement,
    direction_measurement,
    mat_scale,
    put_uncorrelated,
    turn_attitude,
    update,
    variance_of,
)
from torquer.estimation.triad import (
    LEAST_SINE,
    both_read_s,
    field_at,
    put_quaternion,
    quaternion_of,
    sine_between,
    triad,
    triad_covariance,
)
from torquer.geometry.quaternion import (
    from_rotation_vector,
    multiply,
    normalised,
    rotate_inverse,
)
from torquer.geometry.vec3 import add, cross, dot, put_vector, scale, sub, unit
from torquer.spec import Spec

#: Variance [rad^2] of an attitude of which nothing is known, in a linear filter.
UNINFORMED = math.pi * math.pi / 3.0
#: Variance before the readings at a start, over that of TRIAD: counted twice they would make the
#: covariance too small by this part.
_WIDER = 1000.0
NOTHING = (math.nan, math.nan, math.nan)


class Sensing(NamedTuple):
    """What all filters know of sensors and trust.

    Whether magnetometer and Sun sensors are used; their noise as variances [T^2, rad^2],
    `r_start`: with the magnetometer's bias as it is at the start; place of
    the magnetometer's bias among the states (0: none); greatest normalised innovations squared of
    2 and 3 components; greatest sum of the attitude's variances [rad^2], number of readings
    refused one after another and time without a step [s] after which the filter starts again.
    """

    magnetometer: float
    sun: float
    r_field: float
    r_start: float
    r_sun: float
    bias_at: float
    gate_2: float
    gate_3: float
    lost: float
    refused: float
    gap: float


@inlined
def as_of_now(omega, age, v):
    """A vector read `age` seconds ago in body axes of now; the body turns with omega."""
    if age <= 0.0:
        return v
    return rotate_inverse(from_rotation_vector(scale(age, omega)), v)


@inlined
def put_back(memory, places):
    """Move the change of the states into quaternion and states; refer the error to the new axes."""
    c = memory.correction
    turn = from_rotation_vector((c[0], c[1], c[2]))
    turn_attitude(memory.covariance, c.shape[0], turn)
    put_quaternion(memory.q, normalised(multiply(quaternion_of(memory.q), turn)))
    for i in range(3, places):
        memory.states[i - 3] += c[i]


@inlined
def take(memory, measurement, gate):
    """Update by a measurement, unless the gate refuses it."""
    found = update(memory.covariance, memory.gain, memory.correction, measurement, gate)
    if found.accepted:
        put_back(memory, memory.correction.shape[0])
    else:
        memory.refused += 1.0
    return found


@inlined
def put_across(cells, innovation):
    """Write the whitened innovation of a direction, which has no third component."""
    cells[0], cells[1], cells[2] = innovation[0], innovation[1], math.nan


@inlined
def take_field(inputs, sensing, memory, omega):
    """Update by the magnetometer, if it has been read since."""
    put_vector(memory.innovation_magnetometer, (math.nan, math.nan, math.nan))
    at, b = inputs.read_at.magnetometer_s, inputs.b_body_t
    if sensing.magnetometer == 0.0 or at <= memory.field_s or dot(b, b) == 0.0:
        return
    memory.field_s = at
    expected = rotate_inverse(quaternion_of(memory.q), field_at(inputs, at))
    age = inputs.t_s - at
    if sensing.bias_at > 0.0:
        place = int(sensing.bias_at)
        states = memory.states
        bias = (states[place - 3], states[place - 2], states[place - 1])
        read = add(as_of_now(omega, age, sub(b, bias)), bias)
        m = biased_measurement(expected, read, bias, place, sensing.r_field)
        found = take(memory, m, sensing.gate_3)
        put_vector(memory.innovation_magnetometer, found.innovation)
    else:
        m = direction_measurement(expected, as_of_now(omega, age, b), sensing.r_field)
        found = take(memory, m, sensing.gate_2)
        put_across(memory.innovation_magnetometer, found.innovation)
    memory.field_refused = 0.0 if found.accepted else memory.field_refused + 1.0


@inlined
def take_sun(inputs, sensing, memory, omega):
    """Update by the Sun sensors, if they have been read since and see the Sun."""
    put_vector(memory.innovation_sun, (math.nan, math.nan, math.nan))
    at, sun = inputs.read_at.sun_sensors_s, inputs.sun_body
    if sensing.sun == 0.0 or at <= memory.sun_s or dot(sun, sun) == 0.0:
        return
    memory.sun_s = at
    expected = rotate_inverse(quaternion_of(memory.q), inputs.ephemeris.sun_inertial)
    read = as_of_now(omega, inputs.t_s - at, sun)
    m = direction_measurement(expected, read, sensing.r_sun)
    found = take(memory, m, sensing.gate_2)
    put_across(memory.innovation_sun, found.innovation)
    memory.sun_refused = 0.0 if found.accepted else memory.sun_refused + 1.0


@inlined
def must_begin(inputs, sensing, memory):
    """Whether the filter has to begin: first of all, after a long gap, or where others know better.

    It was away where the last estimate is not its own.
    """
    e, own = inputs.estimate, variance_of(memory.covariance, memory.correction.shape[0], 0)
    away = e.t_s != memory.t_s
    gap = inputs.t_s - memory.t_s > sensing.gap
    better = e.t_s > memory.t_s and e.sigma_rad * e.sigma_rad < own
    return memory.starts == 0.0 or (away and (gap or better))


@inlined
def is_lost(sensing, memory):
    """Whether the attitude is too uncertain."""
    total = 3.0 * variance_of(memory.covariance, memory.correction.shape[0], 0)
    return total > sensing.lost


@inlined
def is_refusing(sensing, memory):
    """Whether too many readings of a sensor have been refused one after another."""
    return max(memory.field_refused, memory.sun_refused) >= sensing.refused


@inlined
def start_by_triad(inputs, sensing, memory):
    """Attitude by TRIAD from readings of this step; whether there is one that is good enough.

    The filter then takes the same readings, from a covariance so wide that they count once: so its
    own is right with the magnetometer's bias, too. The more accurate direction comes first. The
    time of the filter becomes that of the readings.
    """
    at = both_read_s(inputs, memory.field_s)
    b, sun = inputs.b_body_t, inputs.sun_body
    if sensing.magnetometer * sensing.sun == 0.0 or at == -math.inf:
        return False
    if not sine_between(b, sun) > LEAST_SINE:
        return False
    beta, b_inertial, sun_inertial = unit(b), field_at(inputs, at), inputs.ephemeris.sun_inertial
    r, s = sensing.r_start / dot(b, b), sensing.r_sun
    if s <= r:
        q, p = triad(sun, b, sun_inertial, b_inertial), triad_covariance(sun, beta, s, r)
    else:
        q, p = triad(b, sun, b_inertial, sun_inertial), triad_covariance(beta, sun, r, s)
    total = p[0][0] + p[1][1] + p[2][2]
    if not total <= sensing.lost:
        return False
    put_attitude(memory, at, q, min(_WIDER * total, UNINFORMED))
    return True


@inlined
def start_by_field(inputs, sensing, memory, prior):
    """Attitude by the field alone, for a filter without Sun sensors; whether there is one.

    Of all that fit the reading the one that turns the inertial axes least: as the field turns
    along the orbit, the rest is found. (The Sun stands still: by it alone it never would be.)
    `prior`: variance of the attitude before the reading.
    """
    at, b = inputs.read_at.magnetometer_s, inputs.b_body_t
    if sensing.magnetometer == 0.0 or sensing.sun != 0.0 or dot(b, b) == 0.0:
        return False
    if at <= memory.field_s:
        return False
    v, reference = unit(b), unit(field_at(inputs, at))
    x, y, z = cross(v, reference)
    q = normalised((x, y, z, 1.0 + dot(v, reference)))
    if dot(v, reference) < -0.999999:  # half a turn about any axis across
        x, y, z = unit(cross(v, (1.0, 0.0, 0.0) if abs(v[0]) < 0.8 else (0.0, 1.0, 0.0)))
        q = (x, y, z, 0.0)
    put_attitude(memory, at, q, prior)
    return True


@inlined
def takes_over(inputs, sensing, memory):
    """Whether another estimator has left an attitude that is not too old, which is taken over."""
    e = inputs.estimate
    age = inputs.t_s - e.t_s
    if not (e.t_s > memory.t_s and age <= sensing.gap and e.sigma_rad >= 0.0):
        return False
    if not math.isfinite(e.q_body_to_inertial[0] + e.omega_body_rad_s[0]):
        return False
    # no variance exceeds the sum of all three, however unlike they are
    put_attitude(memory, e.t_s, e.q_body_to_inertial, 3.0 * e.sigma_rad * e.sigma_rad)
    memory.field_s = memory.sun_s = e.t_s
    return True


@inlined
def put_attitude(memory, t_s, q, variance):
    """Begin with an attitude of this variance about each axis; no reading is refused so far."""
    memory.t_s = t_s
    memory.starts += 1.0
    memory.field_refused = memory.sun_refused = 0.0
    put_quaternion(memory.q, q)
    n = memory.correction.shape[0]
    put_uncorrelated(memory.covariance, n, 0, mat_scale(variance, IDENTITY))


def memory_of(states: tuple, **more) -> dict:
    """Memory of a filter that has not started; `states`: beyond the attitude, at the start."""
    n = 3 + len(states)
    return {
        "t_s": -math.inf,
        "field_s": -math.inf,
        "sun_s": -math.inf,
        "q": (math.nan, *NOTHING),
        "states": states,
        "covariance": (0.0,) * (n * n),
        "gain": (0.0,) * (3 * n),
        "correction": (0.0,) * n,
        "innovation_magnetometer": NOTHING,
        "innovation_sun": NOTHING,
        "field_refused": 0.0,
        "sun_refused": 0.0,
        "refused": 0.0,
        "starts": 0.0,
        **more,
    }


#: What filters log.
LOG = {
    "innovation_magnetometer": "1",
    "innovation_sun": "1",
    "refused": "1",
    "starts": "1",
}


def keys_of(spec: type[Spec]) -> str:
    """What a spec's docstring says after its first line, for those of its kinds."""
    return "\n\n" + (spec.__doc__ or "").partition("\n\n")[2]


class Filter(Spec):
    """A Kalman filter; noise as the filter believes it.

    The filter starts by TRIAD, and again where the standard deviation of the attitude, that of all
    axes together, exceeds `lost_sigma_deg`, or after `most_refused` readings of a sensor refused
    one after another. Without Sun sensors it begins with any attitude that fits the field; without
    a magnetometer it must be handed one. Where other estimators have worked before it, in other
    modes, it takes over an attitude that is not older than `longest_gap_s` and better than its own;
    after a longer gap it starts again.
    """

    sensors: tuple[Literal["magnetometer", "sun"], ...] = ("magnetometer", "sun")
    """Sensors that the filter uses."""
    magnetometer_noise_nt: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation of each component of a magnetometer reading, errors of the field model
    included; given if the filter uses the magnetometer.
    """
    sun_noise_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    """Standard deviation of each component of a Sun reading; given if the filter uses Sun sensors.
    """
    magnetometer_bias_sigma_nt: Annotated[float, Field(gt=0.0)] | None = None
    """Estimate the magnetometer's bias, too, with this standard deviation about zero at the start;
    left out: no bias.
    """
    gate: float = Field(default=1e-5, gt=0.0, lt=1.0)
    """Probability of refusing a reading although filter and reading are sound."""
    lost_sigma_deg: float = Field(default=30.0, gt=0.0, le=180.0)
    """Standard deviation of the attitude, of all axes together, above which the filter starts
    again.
    """
    most_refused: int = Field(default=30, ge=1)
    """Number of readings of a sensor refused one after another, after which the filter starts
    again.
    """
    longest_gap_s: float = Field(default=10.0, gt=0.0)
    """Age up to which the filter takes over another estimator's attitude, or its own after a pause.
    """
    record_covariance: bool = False
    """Record the states beyond the attitude, and the covariance matrix row by row."""

    @model_validator(mode="after")
    def _noise_of_each_sensor(self):
        if not self.sensors or len(set(self.sensors)) < len(self.sensors):
            raise ValueError(
                f"sensors: must name one or two different sensors; received {list(self.sensors)}"
            )
        keys = {"magnetometer": "magnetometer_noise_nt", "sun": "sun_noise_deg"}
        for sensor, key in keys.items():
            value = getattr(self, key)
            if (value is None) == (sensor in self.sensors):
                must = "given" if value is None else "left out"
                received = "none" if value is None else f"{value:g}"
                raise ValueError(
                    f"{key}: must be {must} with sensors = {list(self.sensors)}; "
                    f"received {received}"
                )
        if self.magnetometer_bias_sigma_nt is not None and "magnetometer" not in self.sensors:
            raise ValueError(
                "magnetometer_bias_sigma_nt: must be left out without the magnetometer among the "
                f"sensors; received {self.magnetometer_bias_sigma_nt:g}"
            )
        return self

    def sensing(self, bias_at: int) -> Sensing:
        """Constants for the kernels; `bias_at`: place of the magnetometer's bias, if there is."""
        from scipy.special import chdtri  # a third of a second of importing

        return Sensing(
            float("magnetometer" in self.sensors),
            float("sun" in self.sensors),
            (1e-9 * (self.magnetometer_noise_nt or 0.0)) ** 2,
            (1e-9 * (self.magnetometer_noise_nt or 0.0)) ** 2 + self.bias_variance_t2,
            math.radians(self.sun_noise_deg or 0.0) ** 2,
            float(bias_at if self.magnetometer_bias_sigma_nt else 0),
            float(chdtri(2, self.gate)),
            float(chdtri(3, self.gate)),
            math.radians(self.lost_sigma_deg) ** 2,
            float(self.most_refused),
            self.longest_gap_s,
        )

    @property
    def needs(self) -> frozenset[str]:
        """Ephemeris, and the Sun sensors where they are used."""
        return frozenset({"ephemeris", *({"sun"} & set(self.sensors))})

    @property
    def bias_variance_t2(self) -> float:
        """Variance of the magnetometer's bias at the start."""
        return (1e-9 * (self.magnetometer_bias_sigma_nt or 0.0)) ** 2

    def logs(self) -> dict[str, str]:
        """What is logged: names in the memory and units."""
        return LOG | ({"states": "", "covariance": ""} if self.record_covariance else {})
