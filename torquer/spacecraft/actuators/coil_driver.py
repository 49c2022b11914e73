"""Drivers of coils: steps of their dipole, a dead band, random errors, pulse-width modulation.

A coil that is modulated has its limit, in one sense or the other, for a part of each period, and
nothing for the rest: on average the commanded dipole. The pulse stands at the beginning, in the
middle or at the end of the period: the later it comes, the more the field has turned since the
reading that the command is for. Periods are counted from the start of a run,
so that which part of one it is follows from the time alone.
"""

import math

import numpy as np

from torquer.base.noise import normal3
from torquer.compile.engine import inlined
from torquer.spacecraft.actuators.coils import coil_targets, find_goal

#: Beyond those of all units of sensors, below those of failures.
STREAM = 1023
#: Part of a period that is none: of rounding where it is counted for weeks.
_NOTHING = 1e-7


@inlined
def driven_dipole(coil, command_a_m2):
    """Dipole [A m^2] that the driver gives for a command: 0 in the dead band, else rounded."""
    value, step = command_a_m2, coil.step_a_m2
    if step > 0.0:
        value = step * np.floor(value / step + 0.5)  # math.floor is of 64 bits only
    value = min(max(value, -coil.most_a_m2), coil.most_a_m2)
    return 0.0 if abs(command_a_m2) < coil.dead_band_a_m2 else value


@inlined
def drawn_error(seed, step, coils, i):
    """Standard normal number of coil i for the command of a step; three coils share a sample."""
    samples = (coils + 2) // 3
    x, y, z = normal3(seed, STREAM, samples * step + i // 3)
    place = i % 3
    return x if place == 0 else (y if place == 1 else z)


@inlined
def drive_as_given(coils, state, seed, step):
    """Change the targets of commanded coils to what their driver gives."""
    count = coils.rows.shape[0]
    for i in range(count):
        given = driven_dipole(coils.rows[i], state[i].command_a_m2)
        if coils.errs != 0:
            given *= 1.0 + coils.rows[i].error * drawn_error(seed, step, count, i)
        state[i].target_a_m2 = state[i].given_a_m2 = given
    return coil_targets(coils, state)


@inlined
def phase_at(period_s, t_s):
    """Time [s] since the beginning of the period of t_s."""
    return max(t_s - np.floor(t_s / period_s + _NOTHING) * period_s, 0.0)


@inlined
def time_on(coil, mean_a_m2, period_s):
    """For how long [s] of each period a coil is on for a mean dipole."""
    return min(abs(mean_a_m2) * coil.per_limit, 1.0) * period_s


@inlined
def pulse_of(coils, coil, mean_a_m2):
    """When in each period a coil is switched on and off [s]; both are one for a coil at rest."""
    period = coils.pwm_period_s
    length = time_on(coil, mean_a_m2, period)
    begin = coils.pwm_place * (period - length)
    return begin, begin + length


@inlined
def next_switch(coils, state, t_s):
    """When after t_s the next coil is switched, or a period begins [s]."""
    period = coils.pwm_period_s
    phase, first = phase_at(period, t_s), period
    after = phase + _NOTHING * period
    for i in range(coils.rows.shape[0]):
        on, off = pulse_of(coils, coils.rows[i], state[i].mean_a_m2)
        if off > on and on > after:
            first = min(first, on)
        if off > on and off > after:
            first = min(first, off)
    return t_s + (first - phase)


@inlined
def switch_coils(coils, state, t_s):
    """Switch the coils as they are from t_s to the next switching; what they go to then."""
    period = coils.pwm_period_s
    after = phase_at(period, t_s) + _NOTHING * period
    for i in range(coils.rows.shape[0]):
        mean, limit = state[i].mean_a_m2, coils.rows[i].limit_a_m2
        on, off = pulse_of(coils, coils.rows[i], mean)
        is_on = on <= after and off > after
        state[i].target_a_m2 = math.copysign(limit, mean) if is_on else 0.0
        if coils.lag_s == 0.0:
            state[i].dipole_a_m2 = state[i].target_a_m2
    return find_goal(coils, state)
