"""One coil along axis 1 brakes a body: K. Kondo and others (2024), B-dot and model prediction.

Dipoles [A m^2].
"""

import math

import torquer
from torquer.compile.engine import inlined

#: Steps of the prediction, and how often it is swept forward and back at most.
STEPS, SWEEPS = 10, 200
#: Change of a dipole [A m^2] after which a prediction is taken as it is.
SMALL = 1e-9


@torquer.law(
    parameters={"limit_a_m2": 1.0, "dead_band_t_s": 0.0},
    memory={"fastest_deg_s": 0.0},
    log={"fastest_deg_s": "deg/s"},
)
def b_dot(inputs, parameters, memory):
    """Full dipole against the field's rate along the coil; none within the dead band."""
    memory.fastest_deg_s = _fastest_deg_s(inputs.omega_body_rad_s)
    rate = inputs.b_rate_body_t_s[0]
    if abs(rate) <= parameters.dead_band_t_s:
        return 0.0, 0.0, 0.0
    return -math.copysign(parameters.limit_a_m2, rate), 0.0, 0.0


@torquer.law(
    parameters={"limit_a_m2": 1.0, "inertia_kg_m2": (0.02, 0.03, 0.04), "interval_s": 1.0,
                "of_rates": (1e4, 1e2, 5e1), "of_dipole": 0.1, "of_margin": 0.1, "turns": 0.0},
    memory={"m": (0.0,) * STEPS, "w": ((0.0, 0.0, 0.0),) * (STEPS + 1),
            "b": ((0.0, 0.0, 0.0),) * (STEPS + 1), "fastest_deg_s": 0.0, "left": 0.0},
    log={"fastest_deg_s": "deg/s", "left": "A m2"},
)  # fmt: skip
def predicted(inputs, parameters, memory):
    """First of the dipoles that cost least over the next steps, by the study's cost.

    Sum of w'Qw/2 + R1 m^2/2 - R2 sqrt(m_max^2 - m^2) over Euler steps, and w'Qw/2 at their end.
    Each sweep goes forward with the dipoles, back with the costates, and takes the dipoles that
    these ask for; `left`: the last change. `turns`: whether the field turns as the body does.
    """
    p, x, b = parameters, memory.w, memory.b
    for c in range(3):
        x[0][c], b[0][c] = inputs.omega_body_rad_s[c], inputs.b_body_t[c]
    memory.fastest_deg_s = _fastest_deg_s(inputs.omega_body_rad_s)
    for k in range(STEPS - 1):
        memory.m[k] = memory.m[k + 1]
    for _ in range(SWEEPS):
        _forward(x, b, memory.m, p)
        memory.left = _back(x, b, memory.m, p)
        if memory.left < SMALL:
            break
    return memory.m[0], 0.0, 0.0


@inlined
def _forward(x, b, m, p):
    """Rates and field of the steps; the field is that of the start unless it turns."""
    (j1, j2, j3), h = p.inertia_kg_m2, p.interval_s
    for k in range(STEPS):
        w, f, g = x[k], b[k], p.turns * h
        x[k + 1][0] = w[0] + h * (j2 - j3) / j1 * w[1] * w[2]
        x[k + 1][1] = w[1] + h * ((j3 - j1) * w[2] * w[0] - f[2] * m[k]) / j2
        x[k + 1][2] = w[2] + h * ((j1 - j2) * w[0] * w[1] + f[1] * m[k]) / j3
        b[k + 1][0] = f[0] + g * (f[1] * w[2] - f[2] * w[1])
        b[k + 1][1] = f[1] + g * (f[2] * w[0] - f[0] * w[2])
        b[k + 1][2] = f[2] + g * (f[0] * w[1] - f[1] * w[0])


@inlined
def _back(x, b, m, p):
    """Dipoles by the costates, from the last step to the first; their greatest change."""
    (j1, j2, j3), (q1, q2, q3), h = p.inertia_kg_m2, p.of_rates, p.interval_s
    a1, a2, a3 = (j2 - j3) / j1, (j3 - j1) / j2, (j1 - j2) / j3
    w, most = x[STEPS], 0.0
    l1, l2, l3 = q1 * w[0], q2 * w[1], q3 * w[2]
    for n in range(STEPS):
        k = STEPS - 1 - n
        w, f = x[k], b[k]
        new = _dipole(f[1] * l3 / j3 - f[2] * l2 / j2, p)
        most = max(most, abs(new - m[k]))
        m[k] += 0.8 * (new - m[k])
        n1 = l1 + h * (q1 * w[0] + a2 * w[2] * l2 + a3 * w[1] * l3)
        n2 = l2 + h * (q2 * w[1] + a1 * w[2] * l1 + a3 * w[0] * l3)
        l3 = l3 + h * (q3 * w[2] + a1 * w[1] * l1 + a2 * w[0] * l2)
        l1, l2 = n1, n2
    return most


@inlined
def _dipole(slope, p):
    """Root m of R1 m + R2 m / sqrt(m_max^2 - m^2) + slope, by Newton's method for the tangent."""
    first = p.of_dipole * p.limit_a_m2
    t = -slope / (first + p.of_margin)
    for _ in range(20):
        c = 1.0 / math.sqrt(1.0 + t * t)
        t -= (first * t * c + p.of_margin * t + slope) / (first * c * c * c + p.of_margin)
    return p.limit_a_m2 * t / math.sqrt(1.0 + t * t)


@inlined
def _fastest_deg_s(w):
    """Rate about the axis with the greatest [deg/s]."""
    return math.degrees(max(abs(w[0]), abs(w[1]), abs(w[2])))
