"""Random torques, which jump between two steps: when, and what they are from there on.

The interval up to the next jump is propagated by itself, so that every integrator meets a torque
that is smooth. What is drawn depends on seed and step alone.
"""

from torquer.compile.engine import inlined
from torquer.spacecraft.disturbance.held import draw_held, hold_end
from torquer.spacecraft.disturbance.unmodelled import draw_coefficients, next_jump


@inlined
def next_draw(dynamics, step, last):
    """The step at which a torque jumps next, `last` at the latest."""
    return next_jump(dynamics.unmodelled, step, hold_end(dynamics.held, step, last))


@inlined
def draw_torques_step(member, step):
    """Draw the torques of a member that jump at a step."""
    state, dynamics = member.state, member.constants
    draw_held(dynamics.held, member.seed, step, state.held)
    draw_coefficients(dynamics.unmodelled, member.seed, step, state.coefficients)
