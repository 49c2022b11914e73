"""Whether RK4's fixed step resolves a motion: checked before the run, for its initial motion.

The loop makes this check at every event (`propagate.interval`), and adds up the numerical damping
and lag of the steps.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from torquer.base.columns import radians, root, stacked, unstacked
from torquer.maths.geometry.vec3 import as_symmetric, as_vector
from torquer.maths.integrate.rk4 import MOST_NUTATION, MOST_TURN, rk4_damping
from torquer.spacecraft.frequencies import nutation_square
from torquer.spacecraft.wheel_array.layout import total_momentum

#: Part of an amplitude, and phase lag of the rotation [deg], that RK4 may cost without a note.
QUIET_DAMPING, QUIET_LAG_DEG = 0.01, 1.0


class Speeds(NamedTuple):
    """How fast the body rotates, and how fast it nutates [rad/s]."""

    rate: float
    nutation: float


def momentum_at_start(spacecraft, omega) -> tuple:
    """Momentum [N m s, body] of a `Spacecraft` and its wheels that starts at a rate [rad/s]."""
    body, wheels = spacecraft.body, spacecraft.wheels
    x, y, z = omega
    parts = zip(body.inertia, body.wheel_momentum_n_m_s, strict=True)
    # a product of arrays would round columns in another way
    momentum = [row[0] * x + row[1] * y + row[2] * z + fixed for row, fixed in parts]
    if wheels is None:
        return as_vector(momentum)
    own = wheels.rotor_inertia_kg_m2() * wheels.initial_speeds_rad_s()
    added = total_momentum(wheels.array().axes, own)
    return as_vector([one + other for one, other in zip(momentum, added, strict=True)])


def speeds_at_start(spacecraft, initial) -> Speeds:
    """Speeds of a `Spacecraft` with an `InitialMotion`; the orbital rate is left out."""
    omega, turning = tuple(map(radians, initial.rate_deg_s)), stacked(spacecraft.body.inertia)
    momentum = momentum_at_start(spacecraft, omega)
    if spacecraft.wheels is not None:
        turning = turning - spacecraft.wheels.rotor_tensor_kg_m2()
    inverse = as_symmetric(unstacked(np.linalg.inv(turning), 2))
    square = nutation_square(inverse, momentum, omega)
    return Speeds(root(sum(each * each for each in omega)), root(abs(square)))


def check_step(speeds: Speeds, step_s: float) -> None:
    """ValueError if a step of RK4 is too long to follow a motion with these speeds."""
    text = (("nutation", speeds.nutation, MOST_NUTATION), ("initial rate", speeds.rate, MOST_TURN))
    for what, speed, most in text:
        if speed * step_s > most:
            raise ValueError(
                f"simulation.step_s: must be at most {most / speed:.3g} s for RK4 to follow the "
                f"{what} of {math.degrees(speed):.3g} deg/s, or left out for adaptive steps; "
                f"received {step_s:g} s"
            )


#: What to do about the steps of RK4.
TAKE_SHORTER = "take shorter steps, or adaptive ones (no step_s)"


def part_damped(exponent):
    """Fraction of an amplitude that falls by exp(-exponent), numbers or arrays."""
    return -np.expm1(-exponent)


def lost_amplitude(speed: float, step_s: float, duration_s: float) -> float:
    """Fraction of the amplitude of an oscillation [rad/s] that RK4 damps out in a run."""
    return float(part_damped(rk4_damping(speed * speed, step_s, duration_s / step_s)))


def step_that_keeps(part: float, speed: float, duration_s: float) -> float:
    """Step [s] with which RK4 damps out this small fraction of an amplitude in a run."""
    return (144.0 * part / (duration_s * speed**6)) ** 0.2


def notes_on_steps(result) -> Iterator[str]:
    """Notes on the numerical damping and lag of RK4's steps in a run, if not small."""
    if "rk4_damping" not in result:
        return
    lag_deg = math.degrees(float(result["rk4_lag"]))
    yield from told_of_steps(float(result["rk4_damping"]), lag_deg)


def told_of_steps(damping: float, lag_deg: float) -> Iterator[str]:
    """What steps of RK4 did to a motion, if it is not small: part of the amplitude, and lag."""
    if damping >= QUIET_DAMPING:
        yield (
            f"the steps of RK4 damped up to {100.0 * damping:.3g} % of the amplitude of nutation "
            f"or libration during this run: {TAKE_SHORTER}"
        )
    if lag_deg >= QUIET_LAG_DEG:
        yield (
            f"the steps of RK4 made the rotation lag by about {lag_deg:.3g} deg during this run: "
            f"{TAKE_SHORTER}"
        )
