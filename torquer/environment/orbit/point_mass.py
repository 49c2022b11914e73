"""Trajectory of a point mass under gravity and drag, extended on demand.

Nodes lie every `NODE_S` from the anchor (the instant of the start state), each reached by
DOP853; between them position and velocity are read from the polynomial of degree 5 that meets
position, velocity and acceleration at both ends (error below 0.1 mm in low orbits). The nodes do
not depend on the order of requests, so that results are reproducible.
"""

import math
import threading
from datetime import datetime
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import EARTH_FLATTENING, EARTH_RADIUS_M
from torquer.base.time import DAY_S
from torquer.compile.engine import kernel
from torquer.environment.earth import gravity
from torquer.environment.earth.atmosphere.air import Air, air_velocity, density, height_m
from torquer.environment.earth.harmonics import Harmonics
from torquer.environment.earth.rotation_table import (
    RotationTable,
    day_of_year_at,
    rotation_at,
    rotation_table,
)
from torquer.maths.geometry.vec3 import add, mat_t_vec, mat_vec, norm, scale
from torquer.maths.integrate.dop853 import DONE, TOO_MANY_STEPS, dop853, rates_of, workspace

NODE_S = 60.0
#: Least and greatest number of nodes integrated at a time.
_FEW, _MANY = 60, 14400
#: Error that DOP853 may make per step: relative, and absolute in m and m/s.
RTOL, ATOL = 1e-13, 1e-9
_LOWEST_M = EARTH_RADIUS_M * (1.0 - EARTH_FLATTENING)
HIT_EARTH = 10
#: Distance from a bound of height at which steps that become too small have met it.
_AT_BOUND_KM = 1e-3


class Forces(NamedTuple):
    """Forces on the point mass: `drag_m2_kg` is half of drag coefficient times area over mass."""

    harmonics: Harmonics
    air: Air
    drag_m2_kg: float


class PointMass(NamedTuple):
    """The problem that DOP853 solves: y = position [m] and velocity [m/s], inertial.

    `day`: number of the day of the year, for the atmosphere. It jumps at midnight, so a problem
    covers one day.
    """

    forces: Forces
    rotation: RotationTable
    day: int


@kernel
def acceleration(problem, t, r, v):
    """Acceleration [m/s^2] at an inertial position and velocity; drag -1/2 c_d S/m rho |w| w."""
    forces = problem.forces
    dcm, sun = rotation_at(problem.rotation, t)
    r_ecef = mat_vec(dcm, r)
    pull = mat_t_vec(dcm, gravity.beyond_central(forces.harmonics, r_ecef))
    total = add(gravity.central(r), pull)
    if forces.drag_m2_kg == 0.0:
        return total
    rho = density(forces.air, r_ecef, mat_vec(dcm, sun), problem.day)
    w = air_velocity(r, v, dcm[2])
    return add(total, scale(-forces.drag_m2_kg * rho * norm(w), w))


@rates_of(PointMass)
def _rates(problem, t, y, dy):
    v = (y[3], y[4], y[5])
    a = acceleration(problem, t, (y[0], y[1], y[2]), v)
    dy[0], dy[1], dy[2] = v
    dy[3], dy[4], dy[5] = a


@kernel
def _midnight(rotation, t, end):
    """The midnight strictly between two times less than a day apart, or the second of them."""
    midnight = DAY_S * math.floor((rotation.midnight_s + max(t, end)) / DAY_S) - rotation.midnight_s
    return midnight if min(t, end) < midnight < max(t, end) else end


@kernel
def _fly(forces, rotation, t, step, y, h, work, nodes):
    """Fill `nodes` [n, 9] with r, v, a one step after the other from y.

    Returns (status, time reached, next step of DOP853, nodes filled); y is then that of this time.
    """
    for row in range(nodes.shape[0]):
        end = t + step
        while t != end:
            pause = _midnight(rotation, t, end)
            problem = PointMass(forces, rotation, day_of_year_at(rotation, 0.5 * (t + pause)))
            status, t, h, _ = dop853(problem, t, pause, y, RTOL, ATOL, h, work)
            if status != DONE:
                return status, t, h, row
        if norm((y[0], y[1], y[2])) < _LOWEST_M:
            return HIT_EARTH, t, h, row
        _note(problem, t, y, nodes[row])
    return DONE, t, h, nodes.shape[0]


@kernel
def _note(problem, t, y, node):
    """Write position, velocity and acceleration into a node."""
    r, v = (y[0], y[1], y[2]), (y[3], y[4], y[5])
    a = acceleration(problem, t, r, v)
    for i in range(3):
        node[i], node[i + 3], node[i + 6] = r[i], v[i], a[i]


@kernel
def _read(nodes, first, per_s, t, r, v):
    """Position and velocity at times t [n]: the polynomial of degree 5 between nodes."""
    step = 1.0 / per_s
    half = 0.5 * step * step
    last = nodes.shape[0] - 2
    for i in range(t.size):
        cell = min(max(math.floor(t[i] * per_s) - first, 0), last)
        u = t[i] * per_s - (cell + first)
        for c in range(3):
            x, y = nodes[cell, c], nodes[cell + 1, c]
            p, q = nodes[cell, c + 3] * step, nodes[cell + 1, c + 3] * step
            a, b = nodes[cell, c + 6] * half, nodes[cell + 1, c + 6] * half
            # what the part known at the start leaves of position, rate and curvature at the end
            d0, d1, d2 = y - x - p - a, q - p - 2.0 * a, b - a
            k3 = 10.0 * d0 - 4.0 * d1 + d2
            k4 = -15.0 * d0 + 7.0 * d1 - 2.0 * d2
            k5 = 6.0 * d0 - 3.0 * d1 + d2
            r[i, c] = x + u * (p + u * (a + u * (k3 + u * (k4 + u * k5))))
            slope = p + u * (2.0 * a + u * (3.0 * k3 + u * (4.0 * k4 + u * 5.0 * k5)))
            v[i, c] = slope * per_s


class Trajectory:
    """Nodes of one trajectory, before and after its anchor, as far as requested so far."""

    def __init__(
        self, forces: Forces, anchor: datetime, mode: str, state: np.ndarray, dut1_s: float = 0.0
    ):
        self._forces, self._anchor, self._mode, self._dut1_s = forces, anchor, mode, dut1_s
        self._work = workspace(6)
        self._lock = threading.Lock()
        rotation, start = self._rotation(0.0, 0.0), np.empty((1, 9))
        _note(PointMass(forces, rotation, day_of_year_at(rotation, 0.0)), 0.0, state, start[0])
        #: Forwards and backwards: nodes from the anchor on, and the next step of DOP853.
        self._branches = {1: [start, 0.0], -1: [start, 0.0]}

    def _rotation(self, first_s: float, last_s: float) -> RotationTable:
        return rotation_table(self._anchor, first_s, last_s, self._mode, self._dut1_s)

    def states(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position [n, 3] m and velocity [n, 3] m/s at seconds from the anchor."""
        with self._lock:
            self._reach(1, max(float(t_s.max()), NODE_S))
            self._reach(-1, -float(t_s.min()))
            back, ahead = self._branches[-1][0], self._branches[1][0]
        nodes = np.concatenate([back[:0:-1], ahead])
        r, v = np.empty((t_s.size, 3)), np.empty((t_s.size, 3))
        _read(nodes, 1 - len(back), 1.0 / NODE_S, t_s, r, v)
        return r, v

    def _reach(self, sign: int, distance_s: float) -> None:
        """Extend one direction until its nodes cover the distance."""
        while (len(self._branches[sign][0]) - 1) * NODE_S < distance_s:
            nodes, h = self._branches[sign]
            missing = math.ceil(distance_s / NODE_S) - (len(nodes) - 1)
            count = min(max(missing, _FEW, len(nodes) // 4), _MANY)
            begin = sign * (len(nodes) - 1) * NODE_S
            end = begin + sign * count * NODE_S
            rotation = self._rotation(min(begin, end), max(begin, end))
            more, y = np.empty((count, 9)), nodes[-1, :6].copy()
            status, t, h, filled = _fly(
                self._forces, rotation, begin, sign * NODE_S, y, h, self._work, more
            )
            whole = np.concatenate([nodes, more[:filled]])
            self._branches[sign] = [whole, h]
            if status != DONE and (len(whole) - 1) * NODE_S < distance_s:
                self._refuse(status, rotation, t, y)

    def _refuse(self, status: int, rotation: RotationTable, t: float, y: np.ndarray) -> None:
        """Raise `ValueError` with the place and the reason of the trajectory's end."""
        dcm, _ = rotation_at(rotation, t)
        height_km = 1e-3 * height_m(mat_vec(dcm, (y[0], y[1], y[2])))
        lowest, highest = self._forces.air.lowest_km, self._forces.air.highest_km
        end = f"{t:.6g} s after the start state"
        if status == HIT_EARTH or abs(height_km) < _AT_BOUND_KM:
            raise ValueError(
                "orbit: must stay above the Earth's surface; received one that is at or below it "
                f"{end}"
            )
        if min(abs(height_km - lowest), abs(height_km - highest)) < _AT_BOUND_KM:
            raise ValueError(
                f"orbit: must stay within the atmosphere model's {lowest:g}..{highest:g} km; "
                f"received one that leaves them {end}, last at {height_km:.4g} km"
            )
        speed = 1e-3 * norm((y[3], y[4], y[5]))
        raise ValueError(
            "orbit: must be such that it can be integrated; received one whose steps become too "
            f"{'many' if status == TOO_MANY_STEPS else 'small'} {end}, at a height of "
            f"{height_km:.4g} km and a speed of {speed:.4g} km/s"
        )
