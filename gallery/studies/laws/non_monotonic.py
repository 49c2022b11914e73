"""Six laws that brake a tumbling satellite with coils, as J. Willis and others (2024) compare them.

Dipoles [A m^2] in body axes; the coils clip them. Gains are the published ones.
"""

import math

import torquer
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import (
    add,
    add_scaled,
    cross,
    dot,
    norm,
    scale,
    solve,
    sub,
    sym_vec,
    unit,
)

#: Of the satellite [A m^2], [kg m^2]: xx, yy, zz, xy, xz, yz.
LIMIT = (0.06997731147540984, 0.05313, 0.06976755555555556)
INERTIA = (0.004517287234042553, 0.005147606382978724, 0.0036768617021276597,
           -0.00031515957446808514, 0.0, 0.0)  # fmt: skip
#: Numbers of a generator of noise: seed' = seed times FACTOR, modulo MODULUS.
FACTOR, MODULUS = 16807.0, 2147483647.0


@torquer.law(parameters={"gain": 4e-5})
def b_cross(inputs, parameters, memory):
    """B-cross of the field's direction and the gyro: m = k/B^2 (omega x B)."""
    b = inputs.b_body_t
    return scale(parameters.gain / dot(b, b), cross(inputs.omega_body_rad_s, b))


@torquer.law(parameters={"gain": 1.0, "noise_t_s": 0.0}, memory={"seed": (1.0, 3.0, 7.0)})
def b_dot(inputs, parameters, memory):
    """B-dot: m = -k/B dB/dt."""
    b = inputs.b_body_t
    rate = _noisy(inputs.b_rate_body_t_s, parameters.noise_t_s, memory.seed)
    return scale(-parameters.gain / norm(b), rate)


@torquer.law(
    parameters={"gain": 0.4, "sample_s": 0.1, "softening_t": 1e-6},
    memory={key: (0.0, 0.0, 0.0) for key in ("b1", "b2", "b3", "b4")},
)
def b_dot_variant(inputs, parameters, memory):
    """A variant of B-dot with a dipole across the field; dB/dt of five readings in a row."""
    b, e = inputs.b_body_t, parameters.softening_t
    rate = (0.0, 0.0, 0.0)
    rate = add_scaled(scale(25.0, b), -48.0, memory.b1)
    rate = add_scaled(add_scaled(rate, 36.0, memory.b2), -16.0, memory.b3)
    rate = scale(1.0 / (12.0 * parameters.sample_s), add_scaled(rate, 3.0, memory.b4))
    for c in range(3):
        memory.b4[c], memory.b3[c] = memory.b3[c], memory.b2[c]
        memory.b2[c], memory.b1[c] = memory.b1[c], b[c]
    turned = cross(b, rate)
    across = add_scaled(scale(-1.0, cross(b, turned)), e, turned)
    return scale(-parameters.gain / (norm(b) * (e * e + dot(b, b))), across)


@torquer.law(parameters={"gain": 2e3, "limit_a_m2": LIMIT, "inertia_kg_m2": INERTIA})
def momentum(inputs, parameters, memory):
    """Smooth bang-bang of the momentum across the field: m = m_max tanh(k h x b)."""
    h = sym_vec(parameters.inertia_kg_m2, inputs.omega_body_rad_s)
    return _smooth(cross(h, unit(inputs.b_body_t)), parameters.gain, parameters.limit_a_m2)


@torquer.law(parameters={"gain": 5e-2, "selective": 4.0, "inertia_kg_m2": INERTIA})
def projection(inputs, parameters, memory):
    """B-cross of the momentum, weaker the nearer it is to the field's line."""
    b, h = (
        inputs.b_body_t,
        sym_vec(parameters.inertia_kg_m2, inputs.omega_body_rad_s),
    )
    along = abs(dot(b, h)) / (norm(b) * (norm(h) + 1e-8))
    gain = parameters.gain * math.exp(-parameters.selective * along) / dot(b, b)
    return scale(gain, cross(h, b))


@torquer.law(
    parameters={"gain": 3e3, "future": 100.0, "ahead_s": 600.0, "noise_t_s": 0.0,
                "limit_a_m2": LIMIT, "inertia_kg_m2": INERTIA},
    memory={"seed": (1.0, 3.0, 7.0)},
)  # fmt: skip
def non_monotonic(inputs, parameters, memory):
    """The study's law; the field's own rate is that of a search coil, without the body's turn."""
    p, b, w = parameters, inputs.b_body_t, inputs.omega_body_rad_s
    rate = _noisy(inputs.b_rate_body_t_s, p.noise_t_s, memory.seed)
    later = add_scaled(b, p.ahead_s, add(rate, cross(w, b)))
    wanted = _of_two_fields(unit(b), unit(later), sym_vec(p.inertia_kg_m2, w), p.future)
    return _smooth(wanted, p.gain, p.limit_a_m2)


@torquer.law(
    parameters={"gain": 3e3, "future": 100.0, "ahead_s": 600.0, "tau_s": 30.0, "sample_s": 0.1,
                "limit_a_m2": LIMIT, "inertia_kg_m2": INERTIA},
    memory={"known": 0.0, "b": (0.0, 0.0, 0.0), "own": (0.0, 0.0, 0.0)},
)  # fmt: skip
def non_monotonic_filtered(inputs, parameters, memory):
    """The same with the field's rate of magnetometer and gyro alone: an alpha-beta filter.

    Its axes turn with the gyro; `tau_s` is how long it looks back, a sample for differences.
    """
    p, b, w = parameters, inputs.b_body_t, inputs.omega_body_rad_s
    a = min(1.0, 2.0 * p.sample_s / p.tau_s)
    beta = a * a / (2.0 - a) / p.sample_s
    if memory.known == 0.0:
        memory.known = 1.0
        for c in range(3):
            memory.b[c] = b[c]
    own = _turned(memory.own, w, p.sample_s)
    expected = add_scaled(_turned(memory.b, w, p.sample_s), p.sample_s, own)
    error = sub(b, expected)
    for c in range(3):
        memory.b[c] = expected[c] + a * error[c]
        memory.own[c] = own[c] + beta * error[c]
    later = add_scaled(b, p.ahead_s, memory.own)
    wanted = _of_two_fields(unit(b), unit(later), sym_vec(p.inertia_kg_m2, w), p.future)
    return _smooth(wanted, p.gain, p.limit_a_m2)


@inlined
def _smooth(wanted, gain, limit):
    """Dipole that goes over to the limit of each coil."""
    return (
        limit[0] * math.tanh(gain * wanted[0]),
        limit[1] * math.tanh(gain * wanted[1]),
        limit[2] * math.tanh(gain * wanted[2]),
    )


@inlined
def _of_two_fields(b1, b2, h, future):
    """First of two impulses that least leave of momentum h, one in each field's plane.

    Least of |h - T1|^2 + a |h - T1 - T2|^2 + |m1|^2 + |m2|^2, T = m x b. The rest r after both
    solves a system of order three: [(I + P1)(I + a P2) + a P1] r = h, P = I - b b'.
    """
    a, c = future, dot(b1, b2)
    rows = (_row(0, b1, b2, a, c), _row(1, b1, b2, a, c), _row(2, b1, b2, a, c))
    rest = solve(rows, h)
    after_one = add_scaled(scale(1.0 + a, rest), -a * dot(b2, rest), b2)
    return cross(add_scaled(after_one, a, rest), b1)


@inlined
def _row(i, b1, b2, a, c):
    """Row of that matrix."""
    row = add_scaled(scale(-(1.0 + 2.0 * a) * b1[i], b1), a * c * b1[i] - 2.0 * a * b2[i], b2)
    one = 2.0 + 3.0 * a
    return (
        row[0] + (one if i == 0 else 0.0),
        row[1] + (one if i == 1 else 0.0),
        row[2] + (one if i == 2 else 0.0),
    )


@inlined
def _turned(v, w, interval_s):
    """A vector at rest in inertial axes, in body axes that have turned at a rate for a while."""
    rate = norm(w)
    angle = rate * interval_s
    s = math.sin(angle) / rate if rate > 1e-12 else interval_s
    c = (1.0 - math.cos(angle)) / (rate * rate) if rate > 1e-12 else 0.0
    turn = cross(w, v)
    return add_scaled(add_scaled(v, -s, turn), c, cross(w, turn))


@inlined
def _noisy(v, sigma, seed):
    """A vector with noise: each part a sum of twelve uniform numbers, nearly normal."""
    return (
        v[0] + sigma * _normal(seed, 0),
        v[1] + sigma * _normal(seed, 1),
        v[2] + sigma * _normal(seed, 2),
    )


@inlined
def _normal(seed, c):
    total = -6.0
    for _ in range(12):
        seed[c] = (seed[c] * FACTOR) % MODULUS
        total += seed[c] / MODULUS
    return total
