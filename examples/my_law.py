"""A control law of one's own: B-dot that leaves the axis of symmetry (z) alone.

Try it: torquer run examples/my_law.toml
"""

import math

import torquer


@torquer.law(
    parameters={"gain": 2e4},
    memory={"has_reading": 0.0, "t_s": 0.0, "b_body_t": (0.0, 0.0, 0.0)},
    log={"field_rate_t_s": "T/s"},
)
def transverse_bdot(inputs, parameters, memory):
    """-k dB/dt from two readings, x and y coils only; logs the size of dB/dt across z."""
    bx, by, bz = inputs.b_body_t
    rate_x, rate_y = 0.0, 0.0
    if memory.has_reading == 1.0:
        interval_s = inputs.t_s - memory.t_s
        rate_x = (bx - memory.b_body_t[0]) / interval_s
        rate_y = (by - memory.b_body_t[1]) / interval_s
    memory.has_reading, memory.t_s = 1.0, inputs.t_s
    memory.b_body_t[0], memory.b_body_t[1], memory.b_body_t[2] = bx, by, bz
    memory.field_rate_t_s = math.sqrt(rate_x * rate_x + rate_y * rate_y)
    return (-parameters.gain * rate_x, -parameters.gain * rate_y, 0.0)
