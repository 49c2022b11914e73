"""States of filters by name: where they stand in the covariance, which of them a filter has."""

from typing import NamedTuple

from torquer.engine import inlined
from torquer.estimation.covariance import put_uncorrelated


class States(NamedTuple):
    """Something for each state (three components) that filters know, in the covariance's order.

    Units of the components: attitude error rad, rates rad/s, dipole A m^2, field T.
    """

    attitude: float
    gyro_bias: float = 0.0
    rate: float = 0.0
    residual_dipole: float = 0.0
    magnetometer_bias: float = 0.0


@inlined
def slices_of(prior):
    """First row of each state in the covariance; 0 for one that the filter does not have.

    `prior`: variances at the start; a state without one is none of the filter's.
    """
    gyro_bias = 3 if prior.gyro_bias > 0.0 else 0
    rate = gyro_bias + 3 if prior.rate > 0.0 else 0
    dipole = max(gyro_bias, rate) + 3 if prior.residual_dipole > 0.0 else 0
    bias = max(gyro_bias, rate, dipole) + 3 if prior.magnetometer_bias > 0.0 else 0
    return States(0, gyro_bias, rate, dipole, bias)


@inlined
def state_of(states, at):
    """A state beyond the attitude error, by its first row in the covariance; zeros for none."""
    if at == 0:
        return (0.0, 0.0, 0.0)
    return (states[at - 3], states[at - 2], states[at - 1])


@inlined
def put_state(states, at, v):
    """Write a state beyond the attitude error."""
    states[at - 3], states[at - 2], states[at - 1] = v


@inlined
def forget(prior, states, p):
    """All states beyond the attitude error as at the start: zeros, uncorrelated."""
    at = 0
    for variance in prior:
        if variance > 0.0:
            if at > 0:
                put_state(states, at, (0.0, 0.0, 0.0))
                put_uncorrelated(p, at, variance)
            at += 3
