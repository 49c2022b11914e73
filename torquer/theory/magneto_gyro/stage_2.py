"""Exact linear model of stage 2, order 15: estimator and compensator of the law, satellite, field.

State: angles (roll, pitch, yaw), their rates; the estimator's angles and rates; the compensator's
dipole in body axes. Inputs: torque on the body, error of the magnetometer. The parts of the
controller are those of the flown law, with a continuous computer.
"""

import math

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.computer.laws.magneto_gyro.stage_2 import (
    Guide,
    Gyrostat,
    Stage2Gains,
    compensation_rate,
    control_dipole,
    corrections,
    dipole_guide,
    field_guide,
    model_accelerations,
    seen_angles,
    turn,
)
from torquer.maths.geometry.vec3 import add, cross
from torquer.theory.magneto_gyro.loop import (
    DIPOLE,
    SATELLITE,
    Satellite,
    accelerations,
    field_at,
    field_deviation,
    put_column,
    unit_at,
)
from torquer.theory.periodic.periodic_systems import PeriodicSystem

ORDER, INPUTS = 15, 6
#: Forms of stage 2 by their number: it turns with the Earth's dipole, or with the field model.
FORMS = {"text": 0.0, "field": 1.0}


@inlined
def _unpack(p):
    satellite = Satellite(p[0], p[1], p[2], p[3], p[4])
    gains = Stage2Gains(
        p[11], p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19], p[20], p[21], p[22], p[23],
        p[24], p[25],
    )  # fmt: skip
    return satellite, Gyrostat(p[9], p[10]), gains


@inlined
def _guide(tau, b, form):
    """With what the controller turns; the text's mu is tau, its A is 1."""
    guide = field_guide(b)
    return guide if form == 1.0 else Guide(math.cos(tau), math.sin(tau), 1.0, guide.across)


@inlined
def _rates(x, torque, error, b, guide, satellite, craft, gains):
    """Derivative of a state, five triples."""
    angles, rates, seen, seen_rates, compensation = x
    control = cross(control_dipole(seen, seen_rates, gains, guide), b)
    total = add(add(control, cross(compensation, b)), torque)
    reading = add(b, field_deviation(angles, error, b))
    theta, chi = seen_angles(reading, b, guide)
    d_theta, d_chi = theta - seen[1], chi - turn(seen, guide)[1]
    of_angles, of_rates = corrections(d_theta, d_chi, gains, guide, craft)
    return (
        rates,
        accelerations(angles, rates, total, satellite),
        add(seen_rates, of_angles),
        add(model_accelerations(seen, seen_rates, control, craft), of_rates),
        compensation_rate(d_theta, d_chi, gains, guide),
    )


@inlined
def _fill(b, guide, parameters, out):
    nothing = (0.0, 0.0, 0.0)
    satellite, craft, gains = _unpack(parameters)
    for j in range(15):
        x = unit_at(j, 0), unit_at(j, 3), unit_at(j, 6), unit_at(j, 9), unit_at(j, 12)
        put_column(_rates(x, nothing, nothing, b, guide, satellite, craft, gains), out, j)


@kernel
def stage_2_matrix(tau, parameters, out):
    """A(tau) of the loop."""
    b = field_at(tau, parameters[5], parameters[6], parameters[7])
    _fill(b, _guide(tau, b, parameters[8]), parameters, out)


@kernel
def stage_2_matrix_in_dipole(b, parameters, out):
    """A of the loop in a field b of a dipole, a triple in t, w, s in any unit."""
    guide = field_guide(b) if parameters[8] == 1.0 else dipole_guide(b)
    _fill(b, guide, parameters, out)


@kernel
def stage_2_inputs(tau, parameters, out):
    """How torque and error of the magnetometer drive the loop, `[15, 6]`."""
    p, zero = parameters, (0.0, 0.0, 0.0)
    satellite, craft, gains = _unpack(p)
    b = field_at(tau, p[5], p[6], p[7])
    guide = _guide(tau, b, p[8])
    x = zero, zero, zero, zero, zero
    for j in range(6):
        rates = _rates(x, unit_at(j, 0), unit_at(j, 3), b, guide, satellite, craft, gains)
        put_column(rates, out, j)


STAGE_2 = PeriodicSystem(
    "stage_2",
    stage_2_matrix,
    ORDER,
    2.0 * math.pi,
    {
        **SATELLITE, **DIPOLE, "form": 1.0, "stiffness": 6.6, "pitch_inertia": 0.6,
        **dict.fromkeys(Stage2Gains._fields, 0.0),
    },
)  # fmt: skip


def stage_2_loop(satellite, craft, gains, *, normal=0.0, form="field", field=None):
    """The loop of a `Satellite` under the controller for a `Gyrostat` with `Stage2Gains`.

    `normal`: the field's part along the orbit normal over A, (2/3) cot of the inclination to the
    magnetic equator; `field`: `DIPOLE` (the default) or `CONE`.
    """
    if form not in FORMS:
        raise ValueError(f"form: must be one of {', '.join(FORMS)}; received {form!r}")
    values = {**(DIPOLE if field is None else field), "normal": float(normal)}
    values |= {"stiffness": craft.stiffness, "pitch_inertia": craft.pitch_inertia}
    values |= {**satellite._asdict(), "form": FORMS[form], **Stage2Gains(*gains)._asdict()}
    return STAGE_2.with_parameters(**values)


def driven_by(loop: PeriodicSystem, tau: float) -> np.ndarray:
    """Inputs of the loop of stage 2 at tau, `[15, 6]`: torque, error of the magnetometer."""
    out = np.empty((ORDER, INPUTS))
    stage_2_inputs(float(tau), loop.pack(), out)
    return out
