"""What the Kalman filters share: one step with its start, gate and restart; their spec.

The filters are multiplicative: a quaternion is estimated, and a small rotation from it, which is
put back into the quaternion after every measurement. E. Lefferts, F. Markley, M. Shuster, 'Kalman
filtering for spacecraft attitude estimation' (1982).
"""

import math
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from torquer.compile.engine import inlined, plugged
from torquer.estimation.covariance import (
    ATTITUDE,
    States,
    forget,
    put_uncorrelated,
    turn_attitude,
    update,
    variance_of,
)
from torquer.estimation.estimator import Estimator
from torquer.estimation.measurements.magnetometer import MAGNETOMETER, magnetometer
from torquer.estimation.measurements.measurement import Sensing
from torquer.estimation.measurements.sun_sensors import SUN_SENSORS, sun_sensors
from torquer.estimation.triad import (
    LEAST_SINE,
    both_read_s,
    by_two,
    field_at,
    put_quaternion,
    quaternion_of,
    sine_between,
)
from torquer.geometry.quaternion import from_rotation_vector, multiply, normalised
from torquer.geometry.vec3 import cross, dot, put_vector, unit
from torquer.interface import UNKNOWN_ESTIMATE, Estimate
from torquer.spec import Spec

#: Variance [rad^2] of an attitude of which nothing is known, in a linear filter.
UNINFORMED = math.pi * math.pi / 3.0
#: Variance before the readings of a start, over that of TRIAD: the readings count twice, which
#: makes the covariance too small by one part in this number.
_WIDER = 1000.0
NOTHING = (math.nan, math.nan, math.nan)
#: Key of each sensor's noise, in the order of the sensors' numbers.
NOISE_KEYS = {"magnetometer": "magnetometer_noise_nt", "sun": "sun_noise_deg"}


@plugged
def step(inputs, parameters, memory, begin, propagate, rate_of):
    """Estimate of a filter: propagated to now, then updated by new readings of the sensors.

    What differs between filters: `propagate(inputs, parameters, memory, dt)`; `rate_of`, of the
    same arguments: (rate, bias of the gyro, mean variance of the rate); `begin`: see `start`.
    """
    if not has_attitude(inputs, parameters, memory, begin):
        return UNKNOWN_ESTIMATE
    dt = inputs.t_s - memory.t_s
    advance(inputs, parameters, memory, dt, propagate, rate_of)
    return stated(inputs, parameters, memory, dt, rate_of)


@plugged
def advance(inputs, parameters, memory, dt, propagate, rate_of):
    """Propagate a filter to now, dt seconds, and take the readings."""
    propagate(inputs, parameters, memory, dt)
    memory.t_s = inputs.t_s
    omega, _, _ = rate_of(inputs, parameters, memory, dt)
    take_readings(inputs, parameters, memory, omega)


@plugged
def stated(inputs, parameters, memory, dt, rate_of):
    """What the filter states dt seconds after its last step."""
    omega, bias, variance = rate_of(inputs, parameters, memory, dt)
    sigma = math.sqrt(variance_of(memory.covariance, ATTITUDE))
    return Estimate(memory.t_s, quaternion_of(memory.q), omega, bias, sigma, math.sqrt(variance))


@inlined
def take_readings(inputs, parameters, memory, omega):
    """Update by each sensor that has been read since; the body turns with omega."""
    gates, at = parameters.sensing, inputs.read_at
    m = magnetometer(inputs, parameters, memory, omega)
    take(gates, memory, m, MAGNETOMETER, at.magnetometer_s, memory.innovation_magnetometer)
    m = sun_sensors(inputs, parameters, memory, omega)
    take(gates, memory, m, SUN_SENSORS, at.sun_sensors_s, memory.innovation_sun)


@inlined
def take(gates, memory, m, sensor, read_s, innovation):
    """Update by a sensor's measurement, and correct the states, unless the gate rejects it.

    `innovation`: cells for the whitened innovation, NaN where there is none.
    """
    put_vector(innovation, NOTHING)
    if m.count == 0:
        return
    memory.read_s[sensor] = read_s
    gate = gates.gate_3 if m.count == 3 else gates.gate_2
    _, accepted, e = update(memory.covariance, memory.gain, memory.correction, m, gate)
    put_vector(innovation, (e[0], e[1], e[2] if m.count == 3 else math.nan))
    if accepted:
        memory.rejected_in_a_row[sensor] = 0.0
        put_back(memory)
    else:
        memory.rejected_in_a_row[sensor] += 1.0
        memory.refused += 1.0


@inlined
def put_back(memory):
    """Move the change of the states into quaternion and states; refer the error to the new axes."""
    c = memory.correction
    turn = from_rotation_vector((c[0], c[1], c[2]))
    turn_attitude(memory.covariance, turn)
    put_quaternion(memory.q, normalised(multiply(quaternion_of(memory.q), turn)))
    for i in range(3, c.shape[0]):
        memory.states[i - 3] += c[i]


@plugged
def has_attitude(inputs, parameters, memory, begin):
    """Whether the filter has an attitude: its own, or one from a start or restart in this step."""
    sensing = parameters.sensing
    must = must_begin(inputs, sensing, memory)
    afresh = not must and memory.rejected_in_a_row.max() >= sensing.most_refused
    if must or afresh:
        return start(inputs, parameters, memory, afresh, begin) or not must
    if 3.0 * variance_of(memory.covariance, ATTITUDE) > sensing.lost:
        start_by_triad(inputs, parameters, memory)  # the other states stay as they are known
    return True


@inlined
def must_begin(inputs, sensing, memory):
    """Whether the filter must start: at first, after a long gap, or where others know better.

    It was away if the last estimate is not its own.
    """
    e, own = inputs.estimate, variance_of(memory.covariance, ATTITUDE)
    away = e.t_s != memory.t_s
    gap = inputs.t_s - memory.t_s > sensing.gap
    better = e.t_s > memory.t_s and e.sigma_rad * e.sigma_rad < own
    return memory.starts == 0.0 or (away and (gap or better))


@plugged
def start(inputs, parameters, memory, afresh, begin):
    """Start the filter; whether there is an attitude to start from.

    `afresh`: forget the other states; otherwise they are kept. `begin(inputs, parameters, memory,
    taken_over, idle_s, afresh)` completes the start of a filter. `taken_over`: the attitude is that
    of another estimator; `idle_s`: time for which states that are kept have not been propagated.
    """
    idle_since_s, forgets = memory.t_s, afresh or memory.starts == 0.0
    taken_over = takes_over(inputs, parameters.sensing, memory)
    known = taken_over or start_by_triad(inputs, parameters, memory)
    if not (known or start_by_field(inputs, parameters, memory)):
        return False
    if forgets:
        forget(parameters.prior, memory.states, memory.covariance)
    idle_s = 0.0 if forgets else memory.t_s - idle_since_s
    begin(inputs, parameters, memory, taken_over, idle_s, afresh)
    return True


@inlined
def start_by_triad(inputs, parameters, memory):
    """Attitude by TRIAD from readings of this step; whether there is one that is good enough.

    The filter then takes the same readings, from a covariance so wide that they count once: thus
    its own covariance is right with a magnetometer bias, too. The more accurate direction comes
    first. The time of the filter becomes that of the readings.
    """
    sensing, at = parameters.sensing, both_read_s(inputs, memory.read_s[MAGNETOMETER])
    b, sun = inputs.b_body_t, inputs.sun_body
    if min(sensing.r_field, sensing.r_sun) == 0.0 or at == -math.inf:
        return False
    if not sine_between(b, sun) > LEAST_SINE:
        return False
    r, s = (sensing.r_field + parameters.prior.magnetometer_bias) / dot(b, b), sensing.r_sun
    sun_inertial = inputs.ephemeris.sun_inertial
    q, total = by_two(b, sun, field_at(inputs, at), sun_inertial, r, s, s <= r)
    if not total <= sensing.lost:
        return False
    put_attitude(memory, at, q, min(_WIDER * total, UNINFORMED))
    return True


@inlined
def start_by_field(inputs, parameters, memory):
    """Attitude by the field alone, for a filter without Sun sensors; whether there is one.

    Of all attitudes that fit the reading it is the smallest rotation from the inertial axes; the
    remaining angle is found as the field turns along the orbit: see `hypotheses`. (The Sun's
    direction does not turn: from it alone that angle is never found.)
    """
    sensing, at, b = parameters.sensing, inputs.read_at.magnetometer_s, inputs.b_body_t
    if sensing.r_field == 0.0 or sensing.r_sun > 0.0 or dot(b, b) == 0.0:
        return False
    if at <= memory.read_s[MAGNETOMETER]:
        return False
    v, reference = unit(b), unit(field_at(inputs, at))
    x, y, z = cross(v, reference)
    q = normalised((x, y, z, 1.0 + dot(v, reference)))
    if dot(v, reference) < -0.999999:  # half a turn about any axis across
        x, y, z = unit(cross(v, (1.0, 0.0, 0.0) if abs(v[0]) < 0.8 else (0.0, 1.0, 0.0)))
        q = (x, y, z, 0.0)
    put_attitude(memory, at, q, parameters.prior.attitude)
    return True


@inlined
def takes_over(inputs, sensing, memory):
    """Take over an attitude of another estimator; whether there is one that is not too old."""
    e = inputs.estimate
    age = inputs.t_s - e.t_s
    if not (e.t_s > memory.t_s and age <= sensing.gap and e.sigma_rad >= 0.0):
        return False
    if not math.isfinite(e.q_body_to_inertial[0] + e.omega_body_rad_s[0]):
        return False
    # no variance exceeds the sum of all three, however unlike they are
    put_attitude(memory, e.t_s, e.q_body_to_inertial, 3.0 * e.sigma_rad * e.sigma_rad)
    memory.read_s[:] = e.t_s
    return True


@inlined
def put_attitude(memory, t_s, q, variance):
    """Start from an attitude of this variance about each axis; no reading is rejected so far."""
    memory.t_s = t_s
    memory.starts += 1.0
    memory.rejected_in_a_row[:] = 0.0
    put_quaternion(memory.q, q)
    put_uncorrelated(memory.covariance, ATTITUDE, variance)


def memory_of(n: int) -> dict:
    """Memory of a filter of n states that has not started; `states`: those beyond the attitude."""
    row = (0.0,) * n
    return {
        "t_s": -math.inf,
        "read_s": (-math.inf,) * len(NOISE_KEYS),
        "q": (math.nan, *NOTHING),
        "states": row[3:],
        "covariance": (row,) * n,
        "gain": (row,) * 3,
        "correction": row,
        "innovation_magnetometer": NOTHING,
        "innovation_sun": NOTHING,
        "rejected_in_a_row": (0.0,) * len(NOISE_KEYS),
        "refused": 0.0,
        "starts": 0.0,
    }


#: What filters log.
LOG = dict.fromkeys(("innovation_magnetometer", "innovation_sun", "refused", "starts"), "1")


def keys_of(spec: type[Spec]) -> str:
    """A spec's docstring after its first line, to be appended to those of its kinds."""
    return "\n\n" + (spec.__doc__ or "").partition("\n\n")[2]


class Filter(Spec):
    """A Kalman filter; noise as the filter believes it.

    The filter starts by TRIAD, and again where the standard deviation of the attitude, that of all
    axes together, exceeds `lost_sigma_deg`, or after `most_refused` readings of a sensor rejected
    one after another. Without Sun sensors it starts with several hypotheses about the turn around
    the field, and states their spread until they agree; without a magnetometer it must be handed an
    attitude. Where other estimators have worked before it, in other modes, it takes over
    an attitude that is not older than `longest_gap_s` and better than its own; after a longer gap
    it starts again.
    """

    gives: ClassVar = frozenset({"attitude", "rate"})
    #: The kernel, and what it remembers beyond `memory_of`.
    kernel: ClassVar[Callable]
    remembers: ClassVar[dict] = {}
    #: The kernel for the magnetometer alone, and what makes its further memory for n states.
    by_field: ClassVar[tuple[Callable, Callable[[int], dict]]]
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
    """Probability of rejecting a reading although filter and reading are sound."""
    lost_sigma_deg: float = Field(default=30.0, gt=0.0, le=180.0)
    """Standard deviation of the attitude, of all axes together, above which the filter starts
    again.
    """
    most_refused: int = Field(default=30, ge=1)
    """Number of readings of a sensor rejected one after another, after which the filter starts
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
        for sensor, key in NOISE_KEYS.items():
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

    def prior(self, **others: float) -> States:
        """Variances of the states at the start; `others`: of those that filters do not share."""
        bias_t = 1e-9 * (self.magnetometer_bias_sigma_nt or 0.0)
        return States(UNINFORMED, magnetometer_bias=bias_t**2, **others)

    def sensing(self) -> Sensing:
        """Noise of the sensors and limits of the filter for the kernels."""
        from scipy.special import chdtri  # a third of a second of importing

        return Sensing(
            (1e-9 * (self.magnetometer_noise_nt or 0.0)) ** 2,
            math.radians(self.sun_noise_deg or 0.0) ** 2,
            float(chdtri(2, self.gate)),
            float(chdtri(3, self.gate)),
            math.radians(self.lost_sigma_deg) ** 2,
            float(self.most_refused),
            self.longest_gap_s,
        )

    def constants(self) -> Any:
        """Parameters for the kernel: `prior`, `sensing` and those of the filter's motion."""
        raise NotImplementedError

    def initial_variances(self) -> dict[str, float]:
        """Variance of each component of the filter's states at the start, by the states' names."""
        return {name: v for name, v in self.constants().prior._asdict().items() if v > 0.0}

    def estimator(self) -> Estimator:
        """The filter, not yet started."""
        cls, parameters = type(self), self.constants()
        n, kernel = 3 * len(self.initial_variances()), cls.kernel
        memory = memory_of(n) | cls.remembers
        if self.starts_by_field:
            kernel, more = cls.by_field
            memory |= more(n)
        return Estimator(self.kind, kernel, parameters, memory, self.logs(), self.needs, spec=self)

    @property
    def starts_by_field(self) -> bool:
        """Whether the filter has the magnetometer alone: it starts with several hypotheses."""
        return self.sensors == ("magnetometer",)

    @property
    def needs(self) -> frozenset[str]:
        """Ephemeris, and the Sun sensors where they are used."""
        return frozenset({"ephemeris", *({"sun"} & set(self.sensors))})

    def logs(self) -> dict[str, str]:
        """What is logged: names in the memory and units."""
        by_field = {"hypotheses": "1"} if self.starts_by_field else {}
        covariance = {"states": "", "covariance": ""} if self.record_covariance else {}
        return LOG | by_field | covariance
