"""S-dot: Sun pointing with coils, a Sun sensor and the model of the field; no magnetometer.

Try it: torquer run examples/sun_pointing.toml
"""

import math

import torquer


@torquer.law(parameters={"gain": 6e3}, needs=("ephemeris",))
def sdot(inputs, parameters, memory):
    """m = k cos(alpha) (omega x S), alpha the angle between S and B by the models on board.

    Source: SDOT (1.16). No dipole while no sensor sees the Sun.
    """
    (x, y, z), (wx, wy, wz) = inputs.sun_body, inputs.omega_body_rad_s
    b, s = inputs.ephemeris.b_inertial_t, inputs.ephemeris.sun_inertial
    strength = math.sqrt(b[0] ** 2 + b[1] ** 2 + b[2] ** 2)
    k = parameters.gain * (b[0] * s[0] + b[1] * s[1] + b[2] * s[2]) / strength
    return (k * (wy * z - wz * y), k * (wz * x - wx * z), k * (wx * y - wy * x))
