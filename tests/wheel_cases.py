"""What tests of wheels' laws share: an orbit, readings on it, a law as a function of them."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from torquer import engine
from torquer.control.law import compile_law
from torquer.conventions import Measured
from torquer.orbit import kepler

ZERO = (0.0, 0.0, 0.0)
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


def row(q, omega, h=ZERO, r=None, v=None):
    """What is measured; position and velocity are not numbers unless given."""
    place = (math.nan,) * 3
    known = [place if x is None else tuple(np.asarray(x).tolist()) for x in (r, v)]
    vectors = [tuple(np.asarray(x, dtype=float).tolist()) for x in (omega, q, h)]
    omega, q, h = vectors
    return Measured(0.0, ZERO, ZERO, omega, ZERO, q, *known, place, place, h)


def machine(spec):
    """A law's compiled function of a row alone; under a disabled compiler the plain one."""
    law = spec.law()
    found = compile_law(law.function)
    function = found.compiled if engine.COMPILED else found
    parameters, memory = law.pack(), np.array(law.memory)
    return lambda measured: np.array(function(measured, parameters, memory))
