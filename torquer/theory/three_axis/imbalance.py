"""Imbalance of wheels: the turns by which a body shakes.

A rotor's dynamic imbalance U_d [kg m^2] makes a torque U_d W^2 that turns with it across its axis;
its static one U_s [kg m] a force U_s W^2 across it, and at a distance r from the centre of mass a
torque r x F. Far above the loop's bandwidth the body is free: the amplitude of its turn is
J^-1 T/W^2, whatever the speed W. J. Wertz (ed.), 'Spacecraft attitude determination and control'
(1978), 18.4, has the torques.
"""

import numpy as np

from torquer.theory.validity import Limit

#: How many times the loop's bandwidth a wheel must turn for the body to be free: the loop's part of
#: the torque is a hundredth.
ABOVE = 10.0
FAST = Limit(
    "part of the time in which a wheel turns slower than ten times the loop's bandwidth", most=0.02,
    why="the loop answers to the imbalance, and there is less of the turn",
    of="turns by the imbalance of wheels",
    shown="W^2/|W^2 - 2 zeta kappa i W - kappa^2|, below one there for zeta above 0.7",
)  # fmt: skip


def shaken(inertia, axes, dynamic_kg_m2: float, static_kg_m: float, distance_m: float):
    """Covariance (3, 3) [rad^2] of the turns over time, of wheels about axes (n, 3).

    Wheels of different speeds add as independent; the places of the wheels are not known: any
    direction of r is as likely as any other.
    """
    found = np.zeros((3, 3))
    for axis in np.asarray(axes):
        across = 0.5 * (np.eye(3) - np.outer(axis, axis))
        arm = distance_m**2 / 3.0 * (np.eye(3) - across)  # mean of (r x F)(r x F)^T over r
        found += dynamic_kg_m2**2 * across + static_kg_m**2 * arm
    inverse = np.linalg.inv(np.asarray(inertia))
    return inverse @ found @ inverse.T
