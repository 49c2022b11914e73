"""B-dot of the field's direction, as mean dipole of coils that are pulsed once in each step.

Plain, or with a gain that is weighted by how fast the body tumbles: R. Fonod, E. Gill (2018).
"""

import math

import torquer

#: Of the average of the field's turning: share of a new sample, and its weight in the gain.
NEW, WEIGHT = 1.0 / 200.0, 16.0
#: The average [1/step, halved] at which the weighted gain is the plain one.
AT_REST = 0.065


@torquer.law(
    parameters={
        "gain_a_m2_t_s": 1.2073916906534135e-06,
        "weighted": 0.0,
        "on_share": 0.6,
        "full_a_m2": (0.002, 0.002, 0.002),
        "rise_s": 0.01,
        "sample_s": 0.25,
    },
    memory={"known": 0.0, "b": (0.0, 0.0, 0.0), "turning": (0.25, 0.25, 0.25), "on_s": 0.0},
    log={"on_s": "s"},
)
def bdot(inputs, parameters, memory):
    """On for so long of each step as the dipole asks, less half of what the current's rise takes.

    `on_s`: time on of all coils together.
    """
    q, b = parameters, inputs.b_body_t
    size = math.sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
    rate, m = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    for c in range(3):
        along = b[c] / size
        if memory.known == 1.0:
            rate[c] = (along - memory.b[c]) / q.sample_s
            new = 0.5 * abs(rate[c]) * q.sample_s
            memory.turning[c] = NEW * new + (1.0 - NEW) * memory.turning[c]
        memory.b[c] = along
    memory.known = 1.0
    gain = q.gain_a_m2_t_s
    if q.weighted == 1.0:
        p = memory.turning
        turning = math.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
        gain /= 1.0 + WEIGHT * (turning - 0.5 * math.sqrt(3.0) * AT_REST * q.sample_s)
    for c in range(3):
        wanted = -gain * rate[c] / size
        on_s = q.on_share * q.sample_s * min(1.0, abs(wanted) / q.full_a_m2[c])
        memory.on_s += on_s
        if wanted != 0.0:  # a pulse shorter than its rise counts as one of the other sense
            m[c] = math.copysign(q.full_a_m2[c] / q.sample_s, wanted) * (on_s - q.rise_s)
    return m[0], m[1], m[2]
