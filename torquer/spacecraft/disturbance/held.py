"""Torque fixed in the body: a constant one, and a random one held for an interval."""

from typing import NamedTuple

from torquer.base import noise
from torquer.compile.engine import inlined
from torquer.maths.geometry.vec3 import add_scaled, put_vector

STREAM = 6
#: Steps for which a torque is held that never changes.
FOR_EVER = 1 << 62


class HeldTorque(NamedTuple):
    """Constants of the held torque for kernels; its random part is held `hold_steps`.

    All satellites have one, most of them of zeros: the code is compiled once for all.
    """

    constant_n_m: tuple
    random_n_m: float
    hold_steps: int


NO_HELD_TORQUE = HeldTorque((0.0, 0.0, 0.0), 0.0, FOR_EVER)


@inlined
def torque_held(held, seed, step):
    """The torque [N m, body] that is held at a step."""
    if held.random_n_m == 0.0:
        return held.constant_n_m
    sample = noise.normal3(seed, STREAM, step // held.hold_steps)
    return add_scaled(held.constant_n_m, held.random_n_m, sample)


@inlined
def draw_held(held, seed, step, cells):
    """Put the torque that holds from a step on into its cells, if it changes there.

    The constant part is there from the start.
    """
    if held.random_n_m > 0.0 and step % held.hold_steps == 0:
        put_vector(cells, torque_held(held, seed, step))


@inlined
def hold_end(held, step, last):
    """The step at which the random torque changes, `last` at the latest."""
    if held.random_n_m == 0.0:
        return last
    return min(last, step - step % held.hold_steps + held.hold_steps)
