"""Random torques, which jump between two steps: when, and what they are from there on.

The interval up to the next jump is propagated by itself, so that every integrator meets a torque
that is smooth. What is drawn depends on seed and step alone.
"""

from torquer.engine import internal
from torquer.spacecraft.disturbance.held import draw_held, end_of_hold
from torquer.spacecraft.disturbance.unmodelled import draw_coefficients, next_jump


@internal
def next_draw(plant, step, last):
    """The step at which a torque jumps next, `last` at the latest."""
    return next_jump(plant.unmodelled, step, end_of_hold(plant.held, step, last))


@internal
def draw_torques(plant, state, seed, step):
    """Draw the torques that jump at a step."""
    draw_held(plant.held, seed, step, state.held)
    draw_coefficients(plant.unmodelled, seed, step, state.coefficients)
