"""Second stage of the magneto-gyroscopic system: small angles, an estimator, a compensator.

In units of the satellite: time 1/nu0, torque J nu0^2, with nu0 the orbital rate and J the root of
the product of the moments of inertia about t and s; so all gains are plain numbers. Dipoles are in
J nu0^2 over the unit of the field. Angles are (roll, pitch, yaw), small turns about t, w, s.
"""

import math
from typing import NamedTuple

from torquer.compile.engine import inlined
from torquer.computer.blocks.parameters import AnyNumber, Positive
from torquer.maths.geometry.vec3 import add_scaled


class Stage2Gains(NamedTuple):
    """The 15 parameters, of torque (d angles, n rates), estimator (k), compensator (e).

    In units of the satellite: d_i = D_i/(J nu0^2), n_i = N_i/(J nu0); k_i = K_i/nu0 for i = 1, 3,
    5 and K_i/(J nu0^2) for i = 2, 4, 6; e_i = E_i/(J nu0^3). (The text has another unit for k_1,
    k_3, k_5, which is not that of a rate.)
    """

    d1: AnyNumber
    d2: AnyNumber
    d3: AnyNumber
    n1: AnyNumber
    n2: AnyNumber
    n3: AnyNumber
    k1: AnyNumber
    k2: AnyNumber
    k3: AnyNumber
    k4: AnyNumber
    k5: AnyNumber
    k6: AnyNumber
    e1: AnyNumber
    e2: AnyNumber
    e3: AnyNumber


class Guide(NamedTuple):
    """Cosine and sine of mu, which turns with the field in the orbit's plane; A, by which dipoles
    are divided; B_tS, by which readings are (length of the field in the orbit's plane)."""

    cos: float
    sin: float
    strength: float
    across: float


class Gyrostat(NamedTuple):
    """What the estimator knows of the satellite: stiffness h, ratio lambda of the moment of
    inertia about the pitch axis to J; h = H/(J nu0) + lambda - 2 with the wheel's momentum H."""

    stiffness: AnyNumber
    pitch_inertia: Positive


@inlined
def field_guide(b):
    """The guide by the calculated field itself: the form that follows the field model."""
    across = math.sqrt(b[0] * b[0] + b[2] * b[2])
    if across == 0.0:
        return Guide(1.0, 0.0, 0.0, 0.0)
    return Guide(b[0] / across, -b[2] / across, across, across)


@inlined
def dipole_guide(b):
    """The guide by the field of a dipole (B0 cos mu, B_n, -2 B0 sin mu): the form of the text."""
    half = 0.5 * b[2]
    equatorial = math.sqrt(b[0] * b[0] + half * half)
    if equatorial == 0.0:
        return Guide(1.0, 0.0, 0.0, 0.0)
    across = math.sqrt(b[0] * b[0] + b[2] * b[2])
    return Guide(b[0] / equatorial, -half / equatorial, 1.5 * equatorial, across)


@inlined
def turn(v, guide):
    """Components of a vector along t' and s', which turn with mu about w."""
    return v[0] * guide.cos - v[2] * guide.sin, v[0] * guide.sin + v[2] * guide.cos


@inlined
def turned_back(across, along, guide):
    """Components along t and s of those along t' and s'."""
    return across * guide.cos + along * guide.sin, along * guide.cos - across * guide.sin


@inlined
def control_dipole(angles, rates, gains, guide):
    """P_1: a dipole along w turns the pitch axis, one along t' and s' the pitch angle."""
    x1, z1 = turn(angles, guide)
    x2, z2 = turn(rates, guide)
    x2, z2 = x2 - z1, z2 + x1
    m1 = gains.d1 * x1 + gains.n1 * x2 + gains.d3 * z1 + gains.n3 * z2
    m2 = -(gains.d2 * angles[1] + gains.n2 * rates[1])
    a = guide.strength
    return m2 * guide.sin / a, m1 / a, m2 * guide.cos / a


@inlined
def seen_angles(reading, b, guide):
    """(U_theta, U_chi): the pitch and the turn about s' that the field's deviation shows.

    U_theta = (B_s (B_t - W_x) - B_t (B_s - W_z))/B_tS^2, U_chi = (B_w - W_y)/B_tS. Where the field
    has a part B_w along the pitch axis, U_theta is the pitch less B_w/B_tS of the turn about t'.
    """
    off_t, off_w, off_s = b[0] - reading[0], b[1] - reading[1], b[2] - reading[2]
    theta = (b[2] * off_t - b[0] * off_s) / (guide.across * guide.across)
    return theta, off_w / guide.across


@inlined
def model_accelerations(angles, rates, torque, craft):
    """Rates of the rates by the estimator's model: axisymmetric, a wheel, no gravity gradient."""
    h, pitch_inertia = craft
    roll = torque[0] - (h + 1.0) * angles[0] + h * rates[2]
    yaw = torque[2] - (h + 1.0) * angles[2] - h * rates[0]
    return roll, torque[1] / pitch_inertia, yaw


@inlined
def advance(angles, rates, torque, craft, tau):
    """Angles and rates of the model after tau, by the midpoint; of second order in tau."""
    half = 0.5 * tau
    first = model_accelerations(angles, rates, torque, craft)
    middle = add_scaled(angles, half, rates)
    speed = add_scaled(rates, half, first)
    second = model_accelerations(middle, speed, torque, craft)
    return add_scaled(angles, tau, speed), add_scaled(rates, tau, second)


@inlined
def corrections(d_theta, d_chi, gains, guide, craft):
    """Rates at which innovations correct angles and rates: N_5, N_1, N_3 and N_6, N_2, N_4."""
    roll, yaw = turned_back(gains.k5 * d_chi, gains.k3 * d_chi, guide)
    roll_rate, yaw_rate = turned_back(gains.k6 * d_chi, gains.k4 * d_chi, guide)
    angles = roll, gains.k1 * d_theta, yaw
    return angles, (roll_rate + yaw, gains.k2 * d_theta / craft.pitch_inertia, yaw_rate - roll)


@inlined
def compensation_rate(d_theta, d_chi, gains, guide):
    """Rate of the compensator's dipole P_2, in body axes.

    The text integrates its components in axes that turn with nu0 and divides by A: the same where
    mu turns with nu0 and A is constant; elsewhere a constant dipole would not stay compensated.
    """
    a, c, s = guide.strength, guide.cos, guide.sin
    across, along = gains.e1 * d_theta / a, gains.e2 * d_theta / a
    return -(across * c + along * s), gains.e3 * d_chi / a, -(along * c - across * s)
