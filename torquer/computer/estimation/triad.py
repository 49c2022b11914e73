"""TRIAD: attitude from two directions, the first of which is reproduced exactly.

H. Black, 'A passive system for determining the attitude of a satellite' (1964); its covariance by
M. Shuster and S. Oh, 'Three-axis attitude determination from vector observations' (1981).
"""

import math
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from torquer.base.columns import radians
from torquer.base.spec import Spec
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.parameters import OnOff
from torquer.computer.estimation.covariance import IDENTITY, mat_add, mat_scale, outer
from torquer.computer.estimation.estimator import Estimator
from torquer.computer.informed import known_vector
from torquer.computer.interface import UNKNOWN_ESTIMATE, Estimate
from torquer.maths.geometry.frames import mat_mul, transpose
from torquer.maths.geometry.quaternion import (
    conjugate,
    from_dcm,
    multiply,
    put_quaternion,
    read_quaternion,
)
from torquer.maths.geometry.vec3 import (
    add_scaled,
    cross,
    dot,
    norm,
    put_vector,
    read_vector,
    scale,
    unit,
)
from torquer.spacecraft.data_sheet import Assumed

#: Sine of the angle between two directions below which they are taken for parallel.
LEAST_SINE = 0.01
#: Angle [rad] by which directions may disagree besides noise: misalignments and errors of models
#: that users leave out are smaller, broken sensors' are not.
CONTRADICTION_RAD = 0.05
#: Readings no further apart in time than this count as simultaneous [s].
SAME_TIME_S = 1e-6


@inlined
def make_triad(first, second):
    """Rows of three orthogonal unit vectors: the first, the normal of both, their product."""
    w1 = unit(first)
    w2 = unit(cross(w1, second))
    return (w1, w2, cross(w1, w2))


@inlined
def triad(first_body, second_body, first_inertial, second_inertial):
    """Attitude quaternion, body to inertial, from two directions (any lengths, not parallel)."""
    in_body = make_triad(first_body, second_body)
    in_inertial = make_triad(first_inertial, second_inertial)
    return from_dcm(mat_mul(transpose(in_inertial), in_body))


@inlined
def triad_covariance(first_body, second_body, first_variance, second_variance):
    """Covariance (3x3) of the attitude error in body axes [rad^2].

    Unit vectors in body axes; variances [rad^2] about each axis across them.
    """
    normal, cosine = cross(first_body, second_body), dot(first_body, second_body)
    share = 1.0 / dot(normal, normal)
    both = mat_add(outer(first_body, second_body), 1.0, outer(second_body, first_body))
    p = mat_scale(first_variance, mat_add(IDENTITY, share * cosine, both))
    along = share * (second_variance - first_variance)
    return mat_add(p, along, outer(first_body, first_body))


@inlined
def sine_between(a, b):
    """Sine of the angle between two vectors; 0 if one of them is zero."""
    square = dot(a, a) * dot(b, b)
    return norm(cross(a, b)) / math.sqrt(square) if square > 0.0 else 0.0


class TriadParameters(NamedTuple):
    """Whether the Sun comes first, sensor noise [T, rad], and whether a gyro gives the rate."""

    sun_first: OnOff
    sigma_field: float
    sigma_sun: float
    gyro: OnOff


@inlined
def rate_between(before, now, interval):
    """Mean rate [rad/s] that takes one attitude into another by the shorter rotation."""
    x, y, z, w = multiply(conjugate(before), now)
    sine = math.sqrt(x * x + y * y + z * z)
    angle = 2.0 * math.atan2(sine, abs(w))
    factor = angle / (sine * interval) if sine > 0.0 else 2.0 / interval
    return scale(math.copysign(factor, w), (x, y, z))


@inlined
def both_read_s(inputs, since_s):
    """When magnetometer and Sun sensors were read together, after `since_s`; else minus infinity.

    Directions read at different times belong to different attitudes.
    """
    at = inputs.read_at.magnetometer_s
    together = abs(at - inputs.read_at.sun_sensors_s) < SAME_TIME_S
    return at if together and at > since_s else -math.inf


@inlined
def field_at(inputs, t_s):
    """Model field [T, inertial] at the time of a reading, a little before now."""
    place = inputs.ephemeris
    return add_scaled(place.b_inertial_t, t_s - inputs.t_s, place.b_rate_inertial_t_s)


@inlined
def contradict(b, sun, b_inertial, sun_inertial, variance):
    """Whether the angle between field and Sun in the body is not the one in the inertial frame.

    `variance`: of the angle [rad^2]. No attitude makes both directions fit then.
    """
    seen = math.atan2(norm(cross(b, sun)), dot(b, sun))
    there = math.atan2(norm(cross(b_inertial, sun_inertial)), dot(b_inertial, sun_inertial))
    return abs(seen - there) > CONTRADICTION_RAD + 6.0 * math.sqrt(variance)


@inlined
def by_two(b, sun, b_inertial, sun_inertial, r, s, sun_first):
    """(Attitude, sum of its variances) by TRIAD from the field and the Sun.

    `r`, `s`: variances [rad^2] about each axis across the directions of field and Sun.
    """
    if sun_first:
        q, p = triad(sun, b, sun_inertial, b_inertial), triad_covariance(sun, unit(b), s, r)
    else:
        q, p = triad(b, sun, b_inertial, sun_inertial), triad_covariance(unit(b), sun, r, s)
    return q, p[0][0] + p[1][1] + p[2][2]


@kernel
def triad_estimator(inputs, parameters, memory):
    """Attitude from magnetometer and Sun sensors; unknown while either has no direction.

    The rate is that of the gyro, or the mean one since the previous attitude.
    """
    b, sun, t_s = inputs.b_body_t, inputs.sun_body, both_read_s(inputs, memory.t_s)
    if t_s > -math.inf:
        known = sine_between(b, sun) > LEAST_SINE
        q, sigma = (math.nan, math.nan, math.nan, math.nan), math.nan
        if known:
            r, s = parameters.sigma_field * parameters.sigma_field / dot(b, b), parameters.sigma_sun
            inertial, first = inputs.ephemeris.sun_inertial, parameters.sun_first != 0.0
            q, total = by_two(b, sun, field_at(inputs, t_s), inertial, r, s * s, first)
            sigma = math.sqrt(total / 3.0)
        turned = rate_between(read_quaternion(memory.q), q, t_s - memory.t_s)
        put_vector(memory.omega_body_rad_s, turned)
        before = memory.sigma if memory.known != 0.0 else math.nan
        memory.sigma_rate = math.sqrt(before * before + sigma * sigma) / (t_s - memory.t_s)
        memory.sigma, memory.t_s = sigma, t_s
        memory.known = 1.0 if known else 0.0
        put_quaternion(memory.q, q)
    if memory.known == 0.0:
        return UNKNOWN_ESTIMATE
    omega, sigma_rate = read_vector(memory.omega_body_rad_s), memory.sigma_rate
    if parameters.gyro != 0.0:
        omega, sigma_rate = known_vector(inputs.omega_body_rad_s), math.nan
    q = read_quaternion(memory.q)
    e = UNKNOWN_ESTIMATE
    bias, isolated, units = e.gyro_bias_rad_s, e.isolated, e.isolated_units
    return Estimate(memory.t_s, q, omega, bias, memory.sigma, sigma_rate, isolated, units)


class Triad(Spec):
    """TRIAD: attitude from magnetometer and Sun sensors, in sunlight only.

    The noises include errors of the field model; the stated accuracy follows from them.
    """

    kind: Literal["triad"] = "triad"
    gives: ClassVar = frozenset({"attitude", "rate"})
    assumes: ClassVar = (
        Assumed("magnetometer_noise_nt", "magnetometer", "noise"),
        Assumed("sun_noise_deg", "sun_sensors", "noise"),
    )
    first: Literal["magnetometer", "sun"] = "sun"
    """Direction that the attitude reproduces exactly, that of the more accurate sensor."""
    magnetometer_noise_nt: float = Field(gt=0.0)
    """Standard deviation of each component of a magnetometer reading."""
    sun_noise_deg: float = Field(gt=0.0, le=180.0)
    """Standard deviation of each component of a Sun reading."""
    rate: Literal["gyro", "difference"] = "difference"
    """Where the rate comes from: the 'gyro', or the 'difference' of two attitudes."""

    def estimator(self, units=()) -> Estimator:
        """The estimator with this noise."""
        nothing = (math.nan, math.nan, math.nan)
        return Estimator(
            self.kind,
            triad_estimator,
            TriadParameters(
                float(self.first == "sun"),
                1e-9 * self.magnetometer_noise_nt,
                radians(self.sun_noise_deg),
                float(self.rate == "gyro"),
            ),
            {
                "t_s": -math.inf,
                "known": 0.0,
                "q": (math.nan, *nothing),
                "sigma": math.nan,
                "omega_body_rad_s": nothing,
                "sigma_rate": math.nan,
            },
            needs=frozenset({"ephemeris", "sun"}),
            spec=self,
        )
