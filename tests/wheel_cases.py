"""What tests of wheels' laws share: an orbit, readings on it, a law as a function of them."""

import numpy as np
from law_cases import UNKNOWN, ZERO, answer_of, compiled, inputs
from scipy.spatial.transform import Rotation

from torquer.orbit import kepler

AXIS_M = 7.2e6
RATE = kepler.mean_motion(AXIS_M)


def orbit_at(t, eccentricity):
    """Position [m] and velocity [m/s] of a two-body orbit."""
    r, v = kepler.states(t, AXIS_M, eccentricity, (30.0, 63.0, 50.0), 0.4)
    return r[0], v[0]


def orbital_frame(r, v):
    """Turn from the orbital frame (along the motion, normal, up) to the inertial one."""
    up, normal = r / np.linalg.norm(r), np.cross(r, v)
    normal /= np.linalg.norm(normal)
    return Rotation.from_matrix(np.column_stack([np.cross(normal, up), normal, up]))


def row(q, omega, h=ZERO, r=UNKNOWN, v=UNKNOWN):
    """What is known at an instant; position and velocity are not numbers unless given."""
    return inputs(q=q, omega=omega, wheels=h, r=r, v=v)


def machine(spec):
    """A law's compiled function of its inputs alone: dipole or torque."""
    law = spec.law()
    function, parameters, memory = compiled(law), law.pack(), law.first_memory()
    return lambda known: answer_of(law, function(known, parameters, memory))
