"""Which coil does not do what is commanded: the momentum's change against the commanded torque.

In axes that turn with the gyro's rotation alone, the momentum H = J omega + wheels (those with a
fixed momentum, too) changes by

  H(t) - H(0) = sum_i p_i int m_i (e_i x B) dt + sum_j d_j int e_j x B dt,

m_i the commanded dipole along a body axis e_i, p_i its effect (1: as commanded, 0: dead or stuck,
-1: reversed), d a dipole that is always there (of the body, or of a coil that is stuck on). Three
equations from each half minute; a Kalman filter solves them for all six unknowns. Each forgets: it
returns to the coil as built, with the first uncertainty, so that a coil is known only while it
works, and one that is switched off is suspected for some minutes only.
"""

import math

import numpy as np

from torquer.compile.engine import inlined
from torquer.computer.estimation.measurements.measurement import turn_to_now
from torquer.maths.geometry.quaternion import (
    from_rotation_vector,
    multiply,
    read_quaternion,
    rotate,
)
from torquer.maths.geometry.vec3 import (
    add,
    cross,
    is_finite,
    norm,
    put_vector,
    read_vector,
    scale,
    sub,
    sym_vec,
)

#: Time of the momentum's change [s], and the longest between two control steps.
_WINDOW_S, _LONGEST_S = 30.0, 10.0
#: Time [s] in which what is known is forgotten; variance of the effect before.
_FORGET_S, _FIRST = 14400.0, 1.0
#: A coil is suspected if its effect is below this value by so many standard deviations, those of a
#: sound coil by 0.5 more.
_EFFECT, _SIGMAS = 0.5, 2.0
#: A dipole that is always there is that of a coil which is stuck on if it is above this part of the
#: greatest commanded one.
_ALWAYS = 0.25
#: A change that is so many times what all coils can do, or so many standard deviations of the noise
#: more, is a failure of the gyro, not theirs.
_POSSIBLE, _NOISY = 2.0, 5.0
#: Disturbance torque over mean moment of inertia [1/s^2]: gravity gradient of a low orbit.
_DISTURBANCE = 2e-6
#: Number of equations over which the noise is averaged, greatest square of an innovation over its
#: variance that counts (for normal noise this changes the mean by 0.5 %), and least noise that is
#: believed.
_EQUATIONS, _OUTLIER, _LEAST_NOISE = 50.0, 9.0, 0.1
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

#: `effect`: p (3), d (3) [A m^2], and their covariance; `noise`: its variance over the greatest one
#: that is assumed; `greatest` dipole commanded so far; begin
#: of the window and H there; `impulse` (3, 6): the integrals so far, by unknowns; e_i x B at the
#: last step, and when that was; covariances of the unknowns with what an equation sees. All in axes
#: that turn with the gyro's rotation alone.
COILS_NOW = [
    ("effect", np.float64, (6,)),
    ("covariance", np.float64, (6, 6)),
    ("noise", np.float64),
    ("greatest", np.float64),
    ("window_s", np.float64),
    ("momentum", np.float64, (3,)),
    ("impulse", np.float64, (3, 6)),
    ("lever", np.float64, (3, 3)),
    ("lever_s", np.float64),
    ("seen", np.float64, (6,)),
]


def first_coils(checks: np.ndarray) -> None:
    """Coils as built."""
    checks["effect"][:, :3] = 1.0
    checks["noise"] = 1.0
    checks["covariance"][:, range(3), range(3)] = _FIRST
    checks["window_s"] = checks["lever_s"] = -math.inf


@inlined
def uncertainty(now, i):
    """So many standard deviations of an unknown as count."""
    return _SIGMAS * math.sqrt(max(now.covariance[i, i], 0.0))


@inlined
def is_ineffective(now, axis):
    """Whether the dipole along an axis clearly is not what is commanded, or always there."""
    always = abs(now.effect[3 + axis]) - uncertainty(now, 3 + axis)
    return now.effect[axis] + uncertainty(now, axis) < _EFFECT or always > _ALWAYS * now.greatest


@inlined
def all_reversed(now):
    """Whether all three coils seem reversed, as they do by a field of the wrong sign."""
    found = True
    for i in range(3):
        found = found and now.effect[i] + uncertainty(now, i) < 0.0
    return found


@inlined
def has_field_reversed(now):
    """1 where the coils together work against the command, -1 where with it; 0: not known."""
    total = variance = 0.0
    for i in range(3):
        total += now.effect[i]
        for j in range(3):
            variance += now.covariance[i, j]
    sure = _SIGMAS * math.sqrt(max(variance, 0.0))
    if total + sure < 0.0:
        return 1.0
    return -1.0 if total - sure > 0.0 else 0.0


@inlined
def momentum_at(table, now, inputs):
    """Momentum of body and wheels in axes that turn with the gyro's rotation alone."""
    own = sym_vec(table.inertia_kg_m2, read_vector(now.omega))
    wheels = add(inputs.wheel_momentum_body_n_m_s, table.wheel_momentum_n_m_s)
    return rotate(read_quaternion(now.q), add(own, wheels))


@inlined
def begin_window(table, now, inputs):
    """Begin to add up."""
    now.window_s = inputs.t_s
    put_vector(now.momentum, momentum_at(table, now, inputs))
    now.impulse[:, :] = 0.0


@inlined
def add_impulse(now, inputs):
    """Add what the dipole since the control step before has done, by the trapezoidal rule.

    The field that was read some time ago, and the axes at the gyro's latest reading, are turned to
    the present with the gyro's rate.
    """
    m, dt, omega = inputs.coil_dipole_body_a_m2, inputs.t_s - now.lever_s, read_vector(now.omega)
    turn = from_rotation_vector(scale(inputs.t_s - now.gyro_s, omega))
    q = multiply(read_quaternion(now.q), turn)
    b = turn_to_now(omega, inputs.t_s - inputs.read_at.magnetometer_s, inputs.b_body_t)
    for i in range(3):
        lever = rotate(q, cross(_AXES[i], b))
        for k in range(3):
            mean = 0.5 * (lever[k] + now.lever[i, k])
            now.impulse[k, i] += m[i] * mean * dt
            now.impulse[k, 3 + i] += mean * dt
            now.lever[i, k] = lever[k]
    now.lever_s = inputs.t_s


@inlined
def forget_coils(now):
    """Coils as built, after a failure of the gyro or the magnetometer."""
    forget(now, math.inf)
    now.noise = 1.0
    now.window_s = now.lever_s = -math.inf


@inlined
def forget(now, t_s):
    """Return towards coils as built in the time of a window; a larger dipole may be stuck on."""
    left = math.exp(-t_s / _FORGET_S)
    for i in range(6):
        built = 1.0 if i < 3 else 0.0
        now.effect[i] = built + left * (now.effect[i] - built)
        for j in range(6):
            now.covariance[i, j] *= left * left
        first = _FIRST if i < 3 else now.greatest * now.greatest
        now.covariance[i, i] += (1.0 - left * left) * first


@inlined
def correct(now, row, y, variance):
    """Kalman update by one equation y = row . effect + noise.

    `variance`: the greatest that the noise may have; how much of it there is, innovations show, the
    more of their variance is noise. (While the effects are uncertain, they show nothing.)
    """
    p, x = now.covariance, now.effect
    square, wrong = 0.0, y
    for i in range(6):
        now.seen[i] = 0.0
        for j in range(6):
            now.seen[i] += p[i, j] * row[j]
        square += row[i] * now.seen[i]
        wrong -= row[i] * x[i]
    noise = variance * now.noise
    square += noise
    excess = min(wrong * wrong / square, _OUTLIER) - 1.0
    learned = now.noise * (1.0 + excess * noise / (square * _EQUATIONS))
    now.noise = min(max(learned, _LEAST_NOISE), 1.0)
    for i in range(6):
        x[i] += now.seen[i] / square * wrong
        for j in range(6):
            p[i, j] -= now.seen[i] * now.seen[j] / square


@inlined
def close_window(table, now, inputs):
    """Compare the momentum's change with what the coils should have done."""
    t_s, momentum = inputs.t_s - now.window_s, momentum_at(table, now, inputs)
    change, noise = sub(momentum, read_vector(now.momentum)), table.noise
    j = table.inertia_kg_m2
    mean = (j[0] + j[1] + j[2]) / 3.0
    read, drift = mean * noise.rate_rad_s, 0.25 * noise.rate_tolerance * norm(momentum) * t_s
    disturbed = _DISTURBANCE * mean * t_s
    variance = 2.0 * read * read + drift * drift + disturbed * disturbed
    all_coils = math.sqrt(3.0) * now.greatest * norm(inputs.b_body_t) * t_s
    forget(now, t_s)
    if norm(change) <= _POSSIBLE * all_coils + _NOISY * math.sqrt(variance):
        for k in range(3):
            correct(now, now.impulse[k], change[k], variance)


@inlined
def follow_coils(table, now, inputs, sound):
    """Bring the coils' effects up to date; `sound`: gyro and magnetometer may be believed."""
    m = inputs.coil_dipole_body_a_m2
    sound = sound and is_finite(m)
    if not sound or inputs.t_s - now.lever_s > _LONGEST_S:
        now.window_s = now.lever_s = -math.inf
    if not sound:
        return
    greatest = max(abs(m[0]), abs(m[1]), abs(m[2]))
    if greatest > now.greatest:
        for i in range(3, 6):
            now.covariance[i, i] += greatest * greatest - now.greatest * now.greatest
        now.greatest = greatest
    if now.window_s == -math.inf:
        now.lever_s = inputs.t_s
        add_impulse(now, inputs)
        begin_window(table, now, inputs)
        return
    add_impulse(now, inputs)
    if inputs.t_s - now.window_s >= _WINDOW_S:
        close_window(table, now, inputs)
        begin_window(table, now, inputs)
