"""A control law of one's own: B-dot that leaves the axis of symmetry (z) alone.

Try it: torquer run examples/my_law.toml
"""

import torquer


@torquer.law(parameters={"gain": 2e4}, memory=5)
def transverse_bdot(measured, parameters, memory):
    """-k dB/dt from two readings, x and y coils only. Memory: started, time, field (3)."""
    bx, by, bz = measured.b_body_t
    mx, my = 0.0, 0.0
    if memory[0] == 1.0:
        rate = parameters[0] / (measured.t_s - memory[1])
        mx, my = -rate * (bx - memory[2]), -rate * (by - memory[3])
    memory[0], memory[1] = 1.0, measured.t_s
    memory[2], memory[3], memory[4] = bx, by, bz
    return (mx, my, 0.0)
