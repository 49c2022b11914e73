"""Exact linear model of stage 1, order 12: satellite, field, filters that differentiate it.

State: angles (roll, pitch, yaw), their rates; of the filters of the field that is read, how low
pass and its rate differ from those of the calculated field. Inputs: torque on the body, error of
the magnetometer.
"""

import math

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.computer.laws.magneto_gyro.stage_1 import angle_function, capture_dipole
from torquer.maths.geometry.vec3 import add, add_scaled, cross, dot, scale, sub
from torquer.theory.magneto_gyro.loop import (
    DIPOLE,
    SATELLITE,
    Satellite,
    accelerations,
    field_at,
    field_deviation,
    field_slope,
    put_column,
    unit_at,
)
from torquer.theory.periodic.periodic_systems import PeriodicSystem

ORDER, INPUTS = 12, 6


@inlined
def _filtered_slope(tau, along, up, frequency, damping):
    """What the filter makes of the calculated field: its derivative, smaller and late."""
    square = frequency * frequency
    real, imaginary = square - 1.0, 2.0 * damping * frequency
    per = square / (real * real + imaginary * imaginary)
    slope = scale(per * real, field_slope(tau, along, up))
    return add_scaled(slope, per * imaginary, field_at(tau, along, up, 0.0))


@inlined
def _rates(x, torque, error, b, b_slope, satellite, gains):
    """Derivative of a state, four triples; `gains`: K, N, frequency and damping of the filters."""
    angles, rates, low, low_rate = x
    angle_gain, rate_gain, frequency, damping = gains
    off, square = field_deviation(angles, error, b), dot(b, b)
    u = angle_function(off, b, square)
    v = scale(-1.0 / square, add(cross(off, b_slope), cross(b, low_rate)))
    control = cross(capture_dipole(b, u, v, square, angle_gain, rate_gain), b)
    pulled = scale(frequency * frequency, sub(off, low))
    return (
        rates,
        accelerations(angles, rates, add(control, torque), satellite),
        low_rate,
        add_scaled(pulled, -2.0 * damping * frequency, low_rate),
    )


@inlined
def _unpack(tau, p):
    satellite, gains = Satellite(p[0], p[1], p[2], p[3], p[4]), (p[8], p[9], p[10], p[11])
    b_slope = field_slope(tau, p[5], p[6])
    if p[12] == 0.0:
        b_slope = _filtered_slope(tau, p[5], p[6], p[10], p[11])
    return satellite, gains, field_at(tau, p[5], p[6], p[7]), b_slope


@kernel
def stage_1_matrix(tau, parameters, out):
    """A(tau) of the loop."""
    nothing = (0.0, 0.0, 0.0)
    satellite, gains, b, b_slope = _unpack(tau, parameters)
    for j in range(12):
        x = unit_at(j, 0), unit_at(j, 3), unit_at(j, 6), unit_at(j, 9)
        put_column(_rates(x, nothing, nothing, b, b_slope, satellite, gains), out, j)


@kernel
def stage_1_inputs(tau, parameters, out):
    """How torque and error of the magnetometer drive the loop, `[12, 6]`."""
    zero = (0.0, 0.0, 0.0)
    satellite, gains, b, b_slope = _unpack(tau, parameters)
    x = zero, zero, zero, zero
    for j in range(6):
        rates = _rates(x, unit_at(j, 0), unit_at(j, 3), b, b_slope, satellite, gains)
        put_column(rates, out, j)


#: `angle_gain` K/(J nu0^2), `rate_gain` N/(J nu0), `frequency` of the filters over nu0; `ideal`: 1
#: for a filter that would make the exact derivative of the calculated field, as the text assumes.
STAGE_1 = PeriodicSystem(
    "stage_1",
    stage_1_matrix,
    ORDER,
    2.0 * math.pi,
    {
        **SATELLITE, **DIPOLE, "angle_gain": 6.0, "rate_gain": 4.0, "frequency": 97.0,
        "damping": 0.7, "ideal": 0.0,
    },
)  # fmt: skip


def stage_1_driven_by(loop: PeriodicSystem, tau: float) -> np.ndarray:
    """Inputs of the loop of stage 1 at tau, `[12, 6]`: torque, error of the magnetometer."""
    out = np.empty((ORDER, INPUTS))
    stage_1_inputs(float(tau), loop.pack(), out)
    return out
