"""Torque of unknown nature: harmonics of the orbit whose coefficients jump."""

import math
from typing import NamedTuple

from pydantic import Field

from torquer.base import noise
from torquer.base.spec import Spec
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add_scaled, scale
from torquer.spacecraft.disturbance.held import FOR_EVER

STREAM = 8
#: Vectors that are drawn: constant, sine and cosine of the argument of latitude, of twice it.
TERMS = 5
#: Cells of the coefficients.
CELLS = 3 * TERMS


class Harmonics(NamedTuple):
    """The torque's present coefficients [N m, body] for kernels; `is_on`: 1, or 0 for none."""

    is_on: float
    constant: tuple
    sine: tuple
    cosine: tuple
    sine_2: tuple
    cosine_2: tuple


class Unmodelled(NamedTuple):
    """Standard deviations [N m] of the coefficients, and for how many steps they are held."""

    constant_n_m: float
    harmonic_1_n_m: float
    harmonic_2_n_m: float
    hold_steps: int


_ZERO = (0.0, 0.0, 0.0)
NO_HARMONICS = Harmonics(0.0, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO)
NONE_UNMODELLED = Unmodelled(0.0, 0.0, 0.0, FOR_EVER)


@inlined
def unmodelled_torque(harmonics, local_body, omega_body):
    """Torque [N m, body]: a0 + a1 sin u + b1 cos u + a2 sin 2u + b2 cos 2u.

    SDOT, section 3.2. u is the argument of latitude as `orbit_angle` has it.
    """
    if harmonics.is_on == 0.0:
        return (0.0, 0.0, 0.0)
    s, c = math.sin(local_body.orbit_angle[0]), math.cos(local_body.orbit_angle[0])
    torque = add_scaled(harmonics.constant, s, harmonics.sine)
    torque = add_scaled(torque, c, harmonics.cosine)
    torque = add_scaled(torque, 2.0 * s * c, harmonics.sine_2)
    return add_scaled(torque, (c - s) * (c + s), harmonics.cosine_2)


@inlined
def harmonic_torque(is_on, cells):
    """The torque with coefficients from their 15 cells."""
    return Harmonics(
        is_on,
        (cells[0], cells[1], cells[2]),
        (cells[3], cells[4], cells[5]),
        (cells[6], cells[7], cells[8]),
        (cells[9], cells[10], cells[11]),
        (cells[12], cells[13], cells[14]),
    )


@inlined
def draw_coefficients(unmodelled, seed, step, cells):
    """Put the coefficients that hold from a step on into their cells, if they jump there.

    `unmodelled`: () where none of `TORQUES` acts.
    """
    if len(unmodelled) == 0:
        return
    if step % unmodelled.hold_steps == 0:
        number = TERMS * (step // unmodelled.hold_steps)
        for k in range(TERMS):
            size = unmodelled.constant_n_m
            if k > 0:
                size = unmodelled.harmonic_1_n_m if k < 3 else unmodelled.harmonic_2_n_m
            coefficients = scale(size, noise.normal3(seed, STREAM, number + k))
            cells[3 * k], cells[3 * k + 1], cells[3 * k + 2] = coefficients


@inlined
def next_jump(unmodelled, step, last):
    """The step at which the coefficients jump next, `last` at the latest."""
    if len(unmodelled) == 0:
        return last
    return min(last, step - step % unmodelled.hold_steps + unmodelled.hold_steps)


class UnmodelledTorque(Spec):
    """Torque of unknown nature: a0 + a1 sin u + b1 cos u + a2 sin 2u + b2 cos 2u.

    Of SDOT, section 3.2. All components of the five vectors (body axes) are drawn again every
    `hold_s`, from normal distributions. u is the argument of latitude at the start, from where it
    grows with the mean orbital rate.
    """

    constant_n_m: float = Field(default=0.0, ge=0.0)
    """Standard deviation of the components of a0."""
    harmonic_1_n_m: float = Field(default=0.0, ge=0.0)
    """Standard deviation of the components of a1 and b1."""
    harmonic_2_n_m: float = Field(default=0.0, ge=0.0)
    """Standard deviation of the components of a2 and b2."""
    hold_s: float = Field(gt=0.0)
    """Time for which the coefficients are held before they are drawn again."""

    def pack(self, parts) -> Harmonics:
        """Constants for kernels, no coefficients drawn yet; the body's `parts` do not matter."""
        return NO_HARMONICS._replace(is_on=1.0)

    def pack_sizes(self, hold_steps: int) -> Unmodelled:
        """Constants for drawing coefficients."""
        return Unmodelled(self.constant_n_m, self.harmonic_1_n_m, self.harmonic_2_n_m, hold_steps)
