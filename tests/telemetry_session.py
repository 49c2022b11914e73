"""Synthetic sessions of Chibis-M of 4 March 2012: a tumbling body, an imperfect magnetometer."""

from datetime import UTC, datetime

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from torquer.environment.along_orbit import Environment, OrbitEnvironment
from torquer.environment.orbit import Sgp4
from torquer.ground.telemetry.reading.quantities import make_session

TLE = (
    "1 38051U 11062C   12058.91450162  .00007227  00000-0  32146-3 0  1024",
    "2 38051  51.6521 324.5583 0011559   6.4829  88.0894 15.22465494  5160",
)
START = datetime(2012, 3, 4, 10, 31, 47, tzinfo=UTC)
BIAS = np.array([1500e-9, -900e-9, 2200e-9])
MATRIX = np.array([[1.01, 0.0, 0.0], [0.004, 0.99, 0.0], [-0.006, 0.003, 1.005]])
SHIFT_S = 2.0
#: Parameters in the order of the full model.
TRUE = np.array([*BIAS, 0.01, -0.01, 0.005, 0.004, -0.006, 0.003, SHIFT_S])


def environment(start=START):
    """The environment along the orbit of those elements."""
    return OrbitEnvironment(Environment(), Sgp4(tle=TLE), start)


def motion(t_s, seed, rate_deg_s=0.6):
    """A tumbling attitude (J to body) and its rate [n, 3] rad/s in the body."""
    rng = np.random.default_rng(1000 + seed)
    spin, cone = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    first = Rotation.random(random_state=seed)

    def at(t):
        turns = np.radians(rate_deg_s) * t[:, None]
        return (
            Rotation.from_rotvec(turns * spin) * Rotation.from_rotvec(0.37 * turns * cone) * first
        )

    step = 1e-3
    # d(R)/dt = -[omega] R for R that takes J to the body
    omega = -(at(t_s + step) * at(t_s - step).inv()).as_rotvec() / (2.0 * step)
    return at(t_s), omega


def session(seed, noise=50e-9, rows=117, cadence_s=31.0, correlation=0.0, rate_deg_s=0.6):
    """A session with b_measured, omega_measured, sun_measured, and its true field in the body."""
    t_s, env = cadence_s * np.arange(rows), environment()
    to_body, omega = motion(t_s + SHIFT_S, seed, rate_deg_s)
    r, v = env.state(t_s + SHIFT_S)
    b = to_body.apply(env.field(t_s + SHIFT_S, r, v))
    sun = env.sun(t_s) - r
    sun = to_body.apply(sun / np.linalg.norm(sun, axis=1, keepdims=True))
    white = np.random.default_rng(seed).normal(size=b.shape)
    coloured = lfilter([np.sqrt(1.0 - correlation**2)], [1.0, -correlation], white, axis=0)
    m = b @ np.linalg.inv(MATRIX).T + BIAS + noise * coloured
    utc = np.datetime64(START.replace(tzinfo=None), "ns") + (1e9 * t_s).astype("timedelta64[ns]")
    values = {"b_measured": m, "omega_measured": omega, "sun_measured": sun}
    return make_session(utc, values, source="synthetic"), b
