"""Kernel of the magneto-gyroscopic system: both stages, the switch between them, their memory.

The switch works on two means over a time constant: of the angle between the field as read and as
calculated, and of the rate that stage 1 sees. Both stages' filters always run. Without a calculated
field there is no dipole, and nothing is learned.
"""

import math
from typing import Annotated, NamedTuple

from torquer.base.conventions import EARTH_RATE_RAD_S, FIELD_RADIUS_M
from torquer.compile.engine import inlined, kernel
from torquer.computer.blocks.law import NOTHING_STATED
from torquer.computer.blocks.limits import Limits
from torquer.computer.blocks.parameters import (
    AnyNumber,
    AnyNumbers,
    NotNegative,
    OnOff,
    Positive,
    UnitNumbers,
)
from torquer.computer.laws.bdot import GAP, shortest_with
from torquer.computer.laws.magneto_gyro.relay import COILS, relay_dipole
from torquer.computer.laws.magneto_gyro.stage_1 import (
    angle_function,
    capture_dipole,
    filter_vector,
    rate_function,
)
from torquer.computer.laws.magneto_gyro.stage_2 import (
    Gyrostat,
    Stage2Gains,
    advance,
    compensation_rate,
    control_dipole,
    corrections,
    dipole_guide,
    field_guide,
    seen_angles,
    turn,
)
from torquer.computer.laws.pointing import reference_motion
from torquer.maths.geometry.quaternion import (
    from_rotation_vector,
    multiply,
    rotate,
    rotate_inverse,
)
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    cross,
    dot,
    norm,
    put_vector,
    read_vector,
    scale,
    sub,
)

_ZERO = (0.0, 0.0, 0.0)
#: Part of an orbit [rad], about a minute, up to which an interval is never taken for a gap.
_LONG = 0.05
#: Memory: calls; filters of stage 1 (12 cells); the estimator (6: angles and rates about t, w, s
#: relative to them); the dipole that the compensator has found, of the satellite itself, in the
#: body (3); the switch: stage, its first time, means; the estimate that others may read.
MEMORY = {
    "has_call": 0.0, "called_s": 0.0, "shortest_call_s": 0.0,
    "model_low_t": _ZERO, "model_rate_t_s": _ZERO,
    "reading_low_t": _ZERO, "reading_rate_t_s": _ZERO,
    "angles_rad": _ZERO, "rates_rad_s": _ZERO,
    "residual_dipole_a_m2": _ZERO,
    "stage": 1.0, "since_s": 0.0, "mean_angle_rad": 0.0, "mean_rate_rad_s": 0.0,
    "estimate": NOTHING_STATED,
}  # fmt: skip


class Stage1(NamedTuple):
    """K [N m], N [N m s], w [rad/s] and damping of the filters; how coils are driven, threshold and
    dipole [A m^2] of relay coils."""

    angle_gain: Positive
    rate_gain: Positive
    filter_rate: float
    filter_damping: float
    coils: Annotated[float, Limits(min(COILS.values()), max(COILS.values()))]
    threshold: NotNegative
    relay_dipole: NotNegative


class Switch(NamedTuple):
    """Mean angle [rad] and rate [rad/s] below which stage 2 begins; angle above which it ends; time
    constant of the means [s]."""

    angle: float
    rate: float
    return_angle: float
    time: float


class Dipole(NamedTuple):
    """Whether stage 2 follows the Earth's dipole (1) or the field model (0); Gauss's coefficients
    (g11, h11, g10) [T]; angle of the prime meridian from the first inertial axis at the start."""

    used: OnOff
    gauss: AnyNumbers
    meridian: AnyNumber


class MagnetoGyroParameters(NamedTuple):
    """Satellite: J [kg m^2], nu0 [rad/s], stiffness and pitch inertia; wanted attitude to the
    orbital frame (quaternion); both stages, part of the time with coils on, switch, dipole."""

    inertia: Positive
    orbital_rate: float
    craft: Gyrostat
    q_wanted: UnitNumbers
    stage_1: Stage1
    gains: Stage2Gains
    coil_duty: float
    switch: Switch
    dipole: Dipole


class Fields(NamedTuple):
    """In axes of the wanted attitude: field as read, field as calculated [T], square of that."""

    reading: tuple
    model: tuple
    square: float


@inlined
def _interval(t_s, orbital_rate, memory):
    """Time since the last call; 0 at the first one and after a gap, in which no law was at work.

    Windows with the coils on, between two pairs of readings, are not taken for one.
    """
    interval_s, shortest_s = t_s - memory.called_s, memory.shortest_call_s
    follows, is_long = (
        memory.has_call == 1.0 and interval_s > 0.0,
        orbital_rate * interval_s > _LONG,
    )
    is_gap = is_long and shortest_s > 0.0 and interval_s > GAP * shortest_s
    if follows and (is_gap or shortest_s == 0.0 or interval_s < shortest_s):
        memory.shortest_call_s = shortest_with(shortest_s, interval_s)
    memory.has_call, memory.called_s = 1.0, t_s
    return interval_s if follows and not is_gap else 0.0


@inlined
def _start(fields, t_s, memory):
    """Filters at rest at the first values, stage 1, nothing learned."""
    put_vector(memory.model_low_t, fields.model)
    put_vector(memory.reading_low_t, fields.reading)
    put_vector(memory.model_rate_t_s, (0.0, 0.0, 0.0))
    put_vector(memory.reading_rate_t_s, (0.0, 0.0, 0.0))
    _forget(memory)
    memory.stage, memory.since_s = 1.0, t_s
    memory.mean_angle_rad, memory.mean_rate_rad_s = math.pi, 0.0


@inlined
def _forget(memory):
    """Estimator and compensator at zero."""
    put_vector(memory.angles_rad, (0.0, 0.0, 0.0))
    put_vector(memory.rates_rad_s, (0.0, 0.0, 0.0))
    put_vector(memory.residual_dipole_a_m2, (0.0, 0.0, 0.0))


@inlined
def _stage_1_dipole(fields, p, memory, interval_s):
    """(Dipole of stage 1, rate that it sees [rad/s]); the filters are advanced."""
    s, w, b = p.stage_1, fields.reading, fields.model
    filter_vector(
        memory.model_low_t, memory.model_rate_t_s, b, s.filter_rate, s.filter_damping, interval_s
    )
    filter_vector(
        memory.reading_low_t, memory.reading_rate_t_s, w, s.filter_rate, s.filter_damping,
        interval_s,
    )  # fmt: skip
    u = angle_function(w, b, fields.square)
    w_rate, b_rate = read_vector(memory.reading_rate_t_s), read_vector(memory.model_rate_t_s)
    v = rate_function(w, w_rate, b, b_rate, fields.square)
    return capture_dipole(w, u, v, fields.square, s.angle_gain, s.rate_gain), norm(v)


@inlined
def _switch(fields, rate, switch, memory, interval_s, t_s):
    """Advance the means; change the stage where they ask for it."""
    across = norm(cross(fields.reading, fields.model))
    angle = math.atan2(across, dot(fields.reading, fields.model))
    part = -math.expm1(-interval_s / switch.time)
    memory.mean_angle_rad += part * (angle - memory.mean_angle_rad)
    memory.mean_rate_rad_s += part * (rate - memory.mean_rate_rad_s)
    if memory.stage == 1.0:
        is_small = memory.mean_angle_rad < switch.angle and memory.mean_rate_rad_s < switch.rate
        if is_small and t_s - memory.since_s > 2.0 * switch.time:
            memory.stage, memory.since_s = 2.0, t_s
            _forget(memory)
    elif memory.mean_angle_rad > switch.return_angle:
        memory.stage, memory.since_s = 1.0, t_s


@inlined
def _earth_dipole_field(inputs, q_reference, dipole):
    """Field of the Earth's dipole in the orbital frame [T]: (a/r)^3 (3 (g.s) s - g), s up."""
    r = norm(inputs.ephemeris.r_inertial_m)
    turn = dipole.meridian + EARTH_RATE_RAD_S * inputs.t_s
    x, y, z = dipole.gauss
    g = (x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn), z)
    t, w, s = rotate_inverse(q_reference, g)
    ratio = FIELD_RADIUS_M / r
    return scale(ratio * ratio * ratio, (-t, -w, 2.0 * s))


@inlined
def _stage_2_dipole(fields, guide, p, applied, memory, interval_s):
    """Dipole of stage 2: the model is advanced under the dipole that the coils had, corrected by
    the field, and asked for the torque. `applied`, and the result, in the wanted attitude's axes.
    """
    rate, gains, craft = p.orbital_rate, p.gains, p.craft
    unit = p.inertia * rate * rate
    tau = rate * interval_s
    angles, rates = (
        read_vector(memory.angles_rad),
        scale(1.0 / rate, read_vector(memory.rates_rad_s)),
    )
    compensation = scale(-1.0 / unit, rotate(p.q_wanted, read_vector(memory.residual_dipole_a_m2)))
    torque = cross(sub(scale(1.0 / unit, applied), compensation), fields.reading)
    angles, rates = advance(angles, rates, torque, craft, tau)
    theta, chi = seen_angles(fields.reading, fields.model, guide)
    d_theta, d_chi = theta - angles[1], chi - turn(angles, guide)[1]
    of_angles, of_rates = corrections(d_theta, d_chi, gains, guide, craft)
    angles, rates = add_scaled(angles, tau, of_angles), add_scaled(rates, tau, of_rates)
    found = compensation_rate(d_theta, d_chi, gains, guide)
    compensation = add_scaled(compensation, tau, found)
    put_vector(memory.angles_rad, angles)
    put_vector(memory.rates_rad_s, scale(rate, rates))
    put_vector(memory.residual_dipole_a_m2, rotate_inverse(p.q_wanted, scale(-unit, compensation)))
    wanted = add(control_dipole(angles, rates, gains, guide), compensation)
    return scale(unit / p.coil_duty, wanted)


@inlined
def _state_estimate(q_reference, turning, q_wanted, memory):
    """State attitude and absolute rate by the angles from the orbital frame and their rates.

    They have no standard deviation: innovations show neither a bias of the magnetometer nor errors
    of the field model, which exceed the noise.
    """
    held = from_rotation_vector(read_vector(memory.angles_rad))
    q = multiply(multiply(q_reference, held), q_wanted)
    relative = rotate_inverse(q_wanted, read_vector(memory.rates_rad_s))
    omega = add(rotate_inverse(q, turning), relative)
    cells = memory.estimate
    cells[0] = 1.0
    cells[1], cells[2], cells[3], cells[4] = q
    cells[5], cells[6], cells[7] = omega


@kernel
def magneto_gyro(inputs, parameters, memory):
    """Dipole of stage 1 or 2, by the switch between them. After MGS.

    The estimator takes the dipole that the coils had since the last call, within their limits.
    """
    p, t_s = parameters, inputs.t_s
    memory.estimate[0] = 0.0
    q_reference, turning = reference_motion(inputs, 1.0)
    model = rotate_inverse(q_reference, inputs.ephemeris.b_inertial_t)
    fields = Fields(rotate(p.q_wanted, inputs.b_body_t), model, dot(model, model))
    guide = field_guide(model)
    if p.dipole.used == 1.0:
        guide = dipole_guide(_earth_dipole_field(inputs, q_reference, p.dipole))
    if fields.square == 0.0 or guide.strength == 0.0:
        return (0.0, 0.0, 0.0)
    interval_s = _interval(t_s, p.orbital_rate, memory)
    if interval_s == 0.0:
        _start(fields, t_s, memory)
    dipole, rate = _stage_1_dipole(fields, p, memory, interval_s)
    _switch(fields, rate, p.switch, memory, interval_s, t_s)
    if memory.stage == 2.0:
        applied = rotate(p.q_wanted, inputs.coil_dipole_body_a_m2)
        dipole = _stage_2_dipole(fields, guide, p, applied, memory, interval_s)
        _state_estimate(q_reference, turning, p.q_wanted, memory)
        return rotate_inverse(p.q_wanted, dipole)
    wanted, s = rotate_inverse(p.q_wanted, dipole), p.stage_1
    return relay_dipole(wanted, s.coils, s.threshold, s.relay_dipole)
