"""B-dot that keeps a rate of rotation, on UPMSat-2: A. Porras-Hermoso and others (2024), (4).

m = -k (dB/dt + omega_d x B) in body axes [A m^2]; a field at rest in a body that turns at omega_d
gives none.
"""

import torquer
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add, add_scaled, cross, scale

GAIN, RATE_RAD_S = 1e8, (0.0, 0.0, 0.1)


@torquer.law(parameters={"gain": GAIN, "rate_rad_s": RATE_RAD_S})
def continuous(inputs, parameters, memory):
    """The law at any time, with the field's rate in the body as it is."""
    p = parameters
    turning = add(inputs.b_rate_body_t_s, cross(p.rate_rad_s, inputs.b_body_t))
    return scale(-p.gain, turning)


@torquer.law(
    parameters={"gain": GAIN, "rate_rad_s": RATE_RAD_S, "sample_s": 0.1, "between_cycles": 0.0},
    memory={"phase": 0.0, "known": 0.0, "average": (0.0, 0.0, 0.0), "slope": (0.0, 0.0, 0.0),
            "before": (0.0, 0.0, 0.0), "dipole": (0.0, 0.0, 0.0)},
)  # fmt: skip
def on_board(inputs, parameters, memory):
    """In cycles of 20 samples: five readings, every second one, in the first half; coils on for a
    quarter from the middle.

    The rate of the field is the slope of these five readings, or the difference of their mean from
    that of the cycle before.
    """
    p, phase = parameters, memory.phase
    memory.phase = 0.0 if phase == 19.0 else phase + 1.0
    if phase < 10.0 and phase % 2.0 == 0.0:
        _take(inputs.b_body_t, phase / 2.0, p.sample_s, memory)
    if phase == 8.0:
        mean = (memory.average[0], memory.average[1], memory.average[2])
        rate = (memory.slope[0], memory.slope[1], memory.slope[2])
        if p.between_cycles == 1.0:
            rate = scale(memory.known / (20.0 * p.sample_s), add_scaled(mean, -1.0, memory.before))
        wanted = scale(-p.gain, add(rate, cross(p.rate_rad_s, mean)))
        for c in range(3):
            memory.dipole[c], memory.before[c] = wanted[c], mean[c]
        memory.known = 1.0
    if 10.0 <= phase < 15.0:
        return memory.dipole[0], memory.dipole[1], memory.dipole[2]
    return 0.0, 0.0, 0.0


@inlined
def _take(b, place, sample_s, memory):
    """Add one of five readings, 0 to 4, to their mean and their slope by least squares."""
    for c in range(3):
        if place == 0.0:
            memory.average[c] = memory.slope[c] = 0.0
        memory.average[c] += b[c] / 5.0
        memory.slope[c] += b[c] * (place - 2.0) / (20.0 * sample_s)
