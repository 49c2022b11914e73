"""What tests of wheels' laws share: an orbit, readings on it, a law as a function, its flight."""

import math
from types import SimpleNamespace

import numpy as np
from law_cases import UNKNOWN, ZERO, answer_of, compiled, inputs
from scipy.spatial.transform import Rotation

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.environment.orbit import kepler

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


def cross(a, b):
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def flight(spec, inertia, eccentricity=0.0, gravity=False):
    """Body with wheels under a law: rates of (q, omega, h, r, v), with J and the orbit."""
    ask, inverse = machine(spec), np.linalg.inv(inertia)

    def rates(x):
        q, omega, h, r, v = np.split(x, (4, 7, 10, 13))
        size = math.sqrt(r @ r)
        a, b, c, w = q
        p, y, z = omega
        q_rate = 0.5 * np.array(
            [w * p + b * z - c * y, w * y + c * p - a * z, w * z + a * y - b * p, -omega @ q[:3]]
        )
        motor = ask(row(q, omega, h, r, v))
        outer = np.zeros(3)
        if gravity:
            up = Rotation.from_quat(q).inv().apply(r) / size
            outer = 3.0 * MU_EARTH_M3_S2 / size**3 * cross(up, inertia @ up)
        omega_rate = inverse @ (outer + motor - cross(omega, inertia @ omega + h))
        h_rate = -motor  # the motors' reaction, in body axes
        return np.concatenate([q_rate, omega_rate, h_rate, v, -MU_EARTH_M3_S2 / size**3 * r])

    return SimpleNamespace(rates=rates, inertia=inertia, eccentricity=eccentricity, spec=spec)


def stepped(f, x, h):
    k1 = f.rates(x)
    k2 = f.rates(x + h / 2 * k1)
    k3 = f.rates(x + h / 2 * k2)
    k4 = f.rates(x + h * k3)
    x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    x[:4] /= np.linalg.norm(x[:4])
    return x


def deviation(f, x):
    """(Turn from the wanted attitude, rate relative to the reference), by the definition."""
    body = Rotation.from_quat(x[:4])
    wanted = Rotation.from_euler("ZYX", f.spec.euler_deg, degrees=True)
    turning = np.zeros(3)
    if f.spec.reference == "orbital":
        r, v = x[10:13], x[13:]
        wanted = orbital_frame(r, v) * wanted
        turning = np.cross(r, v) / (r @ r)
    return wanted.inv() * body, x[4:7] - body.inv().apply(turning)


def start(f, turn_deg, omega, h, seed=0):
    """State turned away by an angle about a random axis, with a rate relative to the reference."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    r, v = orbit_at(0.0, f.eccentricity)
    x = np.concatenate([[0.0, 0.0, 0.0, 1.0], np.zeros(3), h, r, v])
    error, _ = deviation(f, x)
    turn = Rotation.from_rotvec(np.radians(turn_deg) * axis / np.linalg.norm(axis))
    x[:4] = (error.inv() * turn).as_quat()
    _, relative = deviation(f, x)
    x[4:7] = omega - relative
    return x


def random_inertia(rng):
    """A physical tensor (triangle inequality) in axes turned at random."""
    masses = rng.uniform(0.3, 2.0, 3)
    axes = Rotation.random(random_state=int(rng.integers(1000))).as_matrix()
    return axes @ np.diag(masses.sum() - masses) @ axes.T
