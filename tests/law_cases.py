"""What tests of laws share: what a computer knows at an instant, a law as the loop calls it."""

import math

import numpy as np
from known import put_known

from torquer.compile import engine
from torquer.computer.inputs import Inputs, ReadingTimes
from torquer.computer.interface import Ephemeris, Estimate, nothing_known

ZERO = (0.0, 0.0, 0.0)
UNKNOWN = (math.nan, math.nan, math.nan)
NO_TURN = (0.0, 0.0, 0.0, 1.0)


def floats(v):
    """A tuple of Python's floats."""
    return tuple(float(x) for x in v)


def inputs(
    t_s=0.0,
    b=ZERO,
    b_rate=ZERO,
    omega=ZERO,
    sun=ZERO,
    q=NO_TURN,
    wheels=ZERO,
    r=UNKNOWN,
    v=UNKNOWN,
    model_b=UNKNOWN,
    model_b_rate=UNKNOWN,
    model_sun=UNKNOWN,
    coils=ZERO,
    nadir=ZERO,
    cells=(0.0,) * 6,
):
    """Readings taken at this instant; the estimate is what attitude sensor and gyro read."""
    t_s, omega, q = float(t_s), floats(omega), floats(q)
    place = (floats(x) for x in (r, v, model_b, model_b_rate, model_sun))
    return Inputs(
        t_s,
        b_body_t=floats(b),
        b_rate_body_t_s=floats(b_rate),
        omega_body_rad_s=omega,
        sun_body=floats(sun),
        q_body_to_inertial=q,
        wheel_momentum_body_n_m_s=floats(wheels),
        nadir_body=floats(nadir),
        sun_cells=floats(cells),
        coil_dipole_body_a_m2=floats(coils),
        read_at=ReadingTimes(*[t_s] * len(ReadingTimes._fields)),
        estimate=Estimate(t_s, q, omega),
        ephemeris=Ephemeris(*place),
    )


def compiled(block):
    """A block's function (inputs, packed parameters, cells of memory) -> answer, as in the loop.

    The loop holds the inputs as a record, which is filled here from a tuple. Under a disabled
    compiler the same adapter in plain Python.
    """
    made, known = block.in_loop(), engine.records(nothing_known())
    function = made.compiled if engine.COMPILED else made

    def call(row, packed, cells):
        put_known(known, row)
        return function(known, packed, cells)

    return call


def by_hand(law):
    """A law's plain Python function (inputs, packed parameters, cells of memory).

    Its answer is in the terms of the law: a dipole, a torque, or a command.
    """

    def call(known, packed, cells):
        return law(known, law.record_from(packed), law.record_of(cells))

    return call


def answer_of(law, command):
    """What the law answers with, of its command: dipole, torque, or all six numbers."""
    dipole, torque = np.array(command.dipole_a_m2), np.array(command.torque_n_m)
    both = np.concatenate([dipole, torque])
    return {"dipole": dipole, "torque": torque, "command": both}[law.answers]
