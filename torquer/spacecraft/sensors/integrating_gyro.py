"""Rate-integrating gyro by its data sheet: an angle accumulated about each axis.

The error of the rate is white noise N, a fixed bias, a first-order Gauss-Markov bias of standard
deviation sigma and correlation time T, and a random walk K. The Allan variance of its means over a
time t, by IEEE Std 952, annex C, is with x = t/T

    N^2/t + K^2 t/3 + 2 sigma^2/x [1 - (3 - 4 exp(-x) + exp(-2x))/(2x)].

The last term alone is greatest, and the deviation flat, at x = 1.893: there it is (0.618 sigma)^2.
This deviation is the bias instability that a data sheet reads off the floor of its plot.

A reading is the angle since the start, as counters keep it: between any two readings, however far
apart, the angle turned is their difference.
"""

import math
from typing import ClassVar, NamedTuple

from pydantic import Field, model_validator

from torquer.base.spec import Vector
from torquer.compile.engine import inlined
from torquer.maths.geometry.quaternion import conjugate, multiply, to_rotation_vector
from torquer.maths.geometry.vec3 import add, add_scaled, as_vector, cross, mat_vec, scale
from torquer.spacecraft.data_sheet import FLOOR, DataSheet
from torquer.spacecraft.failures import PlainFailure
from torquer.spacecraft.sensors.device import Device, nothing_around
from torquer.spacecraft.sensors.sampling import Sampled
from torquer.spacecraft.sensors.sensing import mounting_matrix, through_electronics

#: Random numbers: of the bias, its walk, the angle.
MARKOV_STREAM, WALK_STREAM, ANGLE_STREAM = 12, 13, 14
_HOUR_S, _ROOT_HOUR = 3600.0, 60.0
#: y up to which y - tanh(y) is a series: the difference would lose digits.
_SERIES = 0.05


class IntegratingGyroSet(NamedTuple):
    """Constants of the gyro for kernels.

    `mounting`: body to channels; `angle_rad_sqrt_s`: angle random walk; `markov_rad_s`, `markov_s`:
    standard deviation and correlation time of the Gauss-Markov bias; `walk_rad_s_sqrt_s`: rate
    random walk.
    """

    mounting: tuple
    bias_rad_s: tuple
    angle_rad_sqrt_s: float
    markov_rad_s: float
    markov_s: float
    walk_rad_s_sqrt_s: float
    range_rad_s: float
    quantum_rad: float


class IntegratingGyroState(NamedTuple):
    """What the gyro is at one instant: two biases [rad/s], the angle [rad] before its quanta."""

    markov_rad_s: tuple
    walked_rad_s: tuple
    angle_rad: tuple


@inlined
def turned_angle(q, omega, q_next, omega_next, interval_s):
    """Integral [rad] of the body rate over an interval, from attitude and rate at both its ends.

    The attitude obeys q' = q (omega, 0)/2. Magnus' expansion of the rotation vector from q to
    q_next, with a(t) the integral from the start: phi = a + 1/2 int a x omega dt + ... For a rate
    that is linear in time the second term is h^2/12 omega x omega_next: it is taken off. (It is
    coning: axes that turn about each other leave a turn that no axis has measured.)

    All terms are odd in the interval about its middle: the error is of the fifth order, of the
    third without this one; of the third, too, where a torque jumps within the interval. For a
    tumbling body it is below 0.003 (omega h)^5. The turn must be less than half a revolution, of
    which quaternions know only the shorter way.
    """
    phi = to_rotation_vector(multiply(conjugate(q), q_next))
    return add_scaled(phi, -interval_s * interval_s / 12.0, cross(omega, omega_next))


@inlined
def start_gyro(gyro, drawn):
    """State at the start: the Gauss-Markov bias is one of any time, all else is zero.

    `drawn`: three standard normal numbers.
    """
    zero = (0.0, 0.0, 0.0)
    return IntegratingGyroState(scale(gyro.markov_rad_s, drawn), zero, zero)


@inlined
def _less_tanh(y):
    """y - tanh(y) for y >= 0, to twelve digits."""
    z = y * y
    higher = z * (17.0 / 315.0 - z * (62.0 / 2835.0 - z * (1382.0 / 155925.0)))
    series = y * z * (1.0 / 3.0 - z * (2.0 / 15.0 - higher))
    return series if y < _SERIES else y - math.tanh(y)


@inlined
def markov_step(sigma, correlation_s, interval_s):
    """What an interval does to a Gauss-Markov bias and to the angle that it adds.

    (Part of the bias that stays; angle [rad] of a bias of 1 rad/s; the new part of the bias and the
    angle that comes with it, both of one normal number; variance of the rest of the angle.)
    """
    y = 0.5 * interval_s / correlation_s
    stays, lost = math.exp(-2.0 * y), -math.expm1(-2.0 * y)
    turn = correlation_s * lost
    new = sigma * math.sqrt(lost * (1.0 + stays))
    along = sigma * turn * math.sqrt(lost / (1.0 + stays))
    size = 2.0 * sigma * correlation_s
    return stays, turn, new, along, size * size * _less_tanh(y)


@inlined
def integrate_rate(gyro, state, interval_s, angle_body, drawn_markov, drawn_walk, drawn_angle):
    """(State, reading [rad] of the accumulated angle) an interval later.

    `angle_body`: integral of the body's rate over it, by `turned_angle`, in as many parts as the
    motion needs; `drawn_...`: three standard normal numbers each. Biases and angle have the
    covariance of the continuous processes: any division of the interval gives the same statistics.
    Of a random walk over h: K^2 h of the bias, K^2 h^3/3 of the angle, K^2 h^2/2 of both. The mean
    rate over the interval, with its errors, is clipped at the range.
    """
    h = interval_s
    stays, turn, new, along, rest = markov_step(gyro.markov_rad_s, gyro.markov_s, h)
    walk = gyro.walk_rad_s_sqrt_s * math.sqrt(h)
    white = gyro.angle_rad_sqrt_s * gyro.angle_rad_sqrt_s * h + walk * walk * h * h / 12.0 + rest
    angle = add_scaled(mat_vec(gyro.mounting, angle_body), h, add(gyro.bias_rad_s, state[1]))
    angle = add_scaled(angle, turn, state[0])
    angle = add_scaled(angle, along, drawn_markov)
    angle = add_scaled(angle, 0.5 * walk * h, drawn_walk)
    angle = add_scaled(angle, math.sqrt(white), drawn_angle)
    after = IntegratingGyroState(
        add_scaled(scale(stays, state[0]), new, drawn_markov),
        add_scaled(state[1], walk, drawn_walk),
        add(state[2], through_electronics(angle, gyro.range_rad_s * h, 0.0)),
    )
    return after, through_electronics(after.angle_rad, math.inf, gyro.quantum_rad)


@inlined
def read(gyro, here, sky, drawn_markov, drawn_walk, drawn_angle):
    """The accumulated angle; attitude, rate and biases are kept from its last reading.

    `here.own`: Gauss-Markov bias, walked bias, angle (three numbers each); attitude, rate and time
    of the last reading; 1 once there has been one.
    """
    own, x = here.own, here.motion
    state = start_gyro(gyro, drawn_markov)
    angle = through_electronics(state.angle_rad, math.inf, gyro.quantum_rad)
    if own[17] == 1.0:
        state = IntegratingGyroState(
            (own[0], own[1], own[2]), (own[3], own[4], own[5]), (own[6], own[7], own[8])
        )
        q, omega = (own[9], own[10], own[11], own[12]), (own[13], own[14], own[15])
        interval_s = here.t_s - own[16]
        turned = turned_angle(q, omega, x.q, x.omega, interval_s)
        state, angle = integrate_rate(
            gyro, state, interval_s, turned, drawn_markov, drawn_walk, drawn_angle
        )
    own[0], own[1], own[2] = state.markov_rad_s
    own[3], own[4], own[5] = state.walked_rad_s
    own[6], own[7], own[8] = state.angle_rad
    own[9], own[10], own[11], own[12] = x.q
    own[13], own[14], own[15] = x.omega
    own[16], own[17] = here.t_s, 1.0
    return angle


class IntegratingGyro(Sampled):
    """Rate-integrating gyro: the angle accumulated about each axis; ideal by default.

    Unlike the last sample of a rate gyro, the angle between two readings keeps all that happened
    between them: its noise does not depend on how often it is read.
    """

    sheet: ClassVar = DataSheet(
        name="integrating gyro",
        senses="rate",
        unit="deg/s",
        bias="bias_deg_h",
        drift="rate_random_walk_deg_h_sqrt_h",
        range="range_deg_s",
        scale="scale_error",
        misalignment="misalignment_deg",
        white="angle_random_walk_deg_sqrt_h",
        instability="bias_instability_deg_h",
        correlation="bias_correlation_s",
        quantum="quantum_arcsec",
        factors={
            "quantum": 1.0 / 3600.0,
            "bias": 1.0 / _HOUR_S,
            "drift": 1.0 / _HOUR_S / _ROOT_HOUR,
            "white": 1.0 / _ROOT_HOUR,
            "instability": 1.0 / _HOUR_S,
        },
    )
    # axes exchanged or reversed would make the accumulated angle jump; a constant error of it
    # would be none of its increments
    failures: tuple[PlainFailure, ...] = ()
    """Intervals in which its readings are missing or wrong."""

    range_deg_s: float = Field(default=1e6, gt=0.0)
    """Range: the mean rate about each axis between readings is clipped there."""
    angle_random_walk_deg_sqrt_h: float = Field(default=0.0, ge=0.0)
    """Angle random walk: standard deviation of the angle after one hour, by white noise."""
    bias_instability_deg_h: float = Field(default=0.0, ge=0.0)
    """Bias instability: Allan deviation where its plot is flat, at 1.89 correlation times, without
    the part of the random walks. (Where it is the coefficient of IEEE Std 952, give 0.664 of it.)
    """
    bias_correlation_s: float | None = Field(default=None, gt=0.0)
    """Correlation time of the bias that makes the bias instability; given with it."""
    rate_random_walk_deg_h_sqrt_h: float = Field(default=0.0, ge=0.0)
    """Rate random walk: standard deviation of the change of the bias after one hour."""
    bias_deg_h: Vector = (0.0, 0.0, 0.0)
    """Fixed bias."""
    scale_error: Vector = (0.0, 0.0, 0.0)
    """Relative scale-factor error of each axis."""
    misalignment_deg: Vector = (0.0, 0.0, 0.0)
    """Rotation vector of the misalignment, small."""
    quantum_arcsec: float = Field(default=0.0, ge=0.0)
    """Angle of one count: a reading is a whole number of them; 0: none."""

    @model_validator(mode="after")
    def _correlation_given(self):
        if self.bias_instability_deg_h > 0.0 and self.bias_correlation_s is None:
            raise ValueError(
                "bias_correlation_s: must be given with bias_instability_deg_h; received none"
            )
        return self

    def pack(self) -> IntegratingGyroSet:
        """Constants for kernels."""
        per_hour = math.radians(1.0) / _HOUR_S
        return IntegratingGyroSet(
            mounting_matrix(self.scale_error, self.misalignment_deg),
            scale(per_hour, as_vector(self.bias_deg_h)),
            math.radians(self.angle_random_walk_deg_sqrt_h) / _ROOT_HOUR,
            per_hour * self.bias_instability_deg_h / FLOOR,
            self.bias_correlation_s or 1.0,  # any, where there is no such bias
            per_hour * self.rate_random_walk_deg_h_sqrt_h / _ROOT_HOUR,
            math.radians(self.range_deg_s),
            math.radians(self.quantum_arcsec / 3600.0),
        )


#: For kernels: none.
NO_INTEGRATING_GYRO = IntegratingGyroSet(
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    bias_rad_s=(0.0, 0.0, 0.0),
    angle_rad_sqrt_s=0.0,
    markov_rad_s=0.0,
    markov_s=1.0,
    walk_rad_s_sqrt_s=0.0,
    range_rad_s=math.inf,
    quantum_rad=0.0,
)
_SIZES = ("angle_rad_sqrt_s", "markov_rad_s", "walk_rad_s_sqrt_s")
DEVICE = Device(
    "integrating_gyro",
    given="angle_body_rad",
    said="integrating gyro",
    symbol="angle",
    units="rad",
    meaning="last reading of the integrating gyro: angles accumulated since the start",
    spec=IntegratingGyro,
    absent=NO_INTEGRATING_GYRO,
    need="integrating_gyro",
    read=read,
    sky=nothing_around,
    draws=((MARKOV_STREAM, _SIZES), (WALK_STREAM, _SIZES), (ANGLE_STREAM, _SIZES)),
    quantum="quantum_rad",
    several="integrating_gyros",
    integrates=True,
)
