"""D. Gerhardt, S. Palo (2010): a CubeSat with a bar magnet and hysteresis rods, CSSWE.

Inertia, magnet, rods, orbit and rates are those of the example, which a public program quotes from
the paper. How many rods lie on an axis, the first attitude and the model of the field are not among
them. The paper's rods lie on the limiting curves of their loops at any time: they jump from one to
the other whenever the field along them turns back.
"""

import functools
import math
from pathlib import Path

import numpy as np

from gallery.studies.flying import digits, first_attitude, fly_all, read
from torquer.base.conventions import MU_0_H_M
from torquer.compile.engine import kernel
from torquer.maths.geometry.attitudes import to_body
from torquer.maths.geometry.quaternion import derivative, normalise, rotate_inverse
from torquer.maths.geometry.vec3 import add_scaled, cross
from torquer.scenario.change import with_values
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate

NAME = "bar_magnet"
EXAMPLE = load_scenario(Path(__file__).parents[2] / "examples/passive_magnet.toml")
#: Published: within so many degrees of the field.
WITHIN_DEG = 10.0
#: Records in a revolution, of one a minute; seconds between given values of the field.
REVOLUTION, FIELD_S = 96, 10.0
COUNTS = (2, 3)
#: Starts, and how they fly: step of RK4 on the limiting curves [s]; None: the rods of `torquer`.
CASES = {"limiting curves": (12, 0.5), "short steps": (3, 0.05), "loops within": (4, None)}


@kernel
def _rates(q, w, b_inertial, b_rate, magnet, rods, moments):
    """Rates of attitude and rotation with rods across axis 1 on their limiting curves."""
    greatest, steepness, coercive = rods
    b, own = rotate_inverse(q, b_inertial), rotate_inverse(q, b_rate)
    turning = add_scaled(own, -1.0, cross(w, b))
    late_2 = coercive if turning[1] > 0.0 else -coercive
    late_3 = coercive if turning[2] > 0.0 else -coercive
    m_2 = greatest * math.atan(steepness * (b[1] / MU_0_H_M - late_2))
    m_3 = greatest * math.atan(steepness * (b[2] / MU_0_H_M - late_3))
    torque = cross((magnet, m_2, m_3), b)
    h = (moments[0] * w[0], moments[1] * w[1], moments[2] * w[2])
    g = cross(h, w)
    return derivative(q, w), (
        (torque[0] + g[0]) / moments[0],
        (torque[1] + g[1]) / moments[1],
        (torque[2] + g[2]) / moments[2],
    )


@kernel
def _moved(x, t, k):
    q, w = x
    return (
        (q[0] + t * k[0][0], q[1] + t * k[0][1], q[2] + t * k[0][2], q[3] + t * k[0][3]),
        add_scaled(w, t, k[1]),
    )


@kernel
def fly_on_limiting_curves(q, w, field, field_s, step_s, magnet, rods, moments, out):
    """RK4; field [n, 3] T every `field_s`; out: attitude at each of these instants."""
    h, steps, x = step_s, round(field_s / step_s), (q, w)
    for k in range(out.shape[0]):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x[0]
        b0 = (field[k, 0], field[k, 1], field[k, 2])
        b1 = (field[k + 1, 0], field[k + 1, 1], field[k + 1, 2])
        rate = add_scaled((b1[0] / field_s, b1[1] / field_s, b1[2] / field_s), -1.0 / field_s, b0)
        for i in range(steps):
            b = add_scaled(b0, i * h, rate)
            middle, end = add_scaled(b, 0.5 * h, rate), add_scaled(b, h, rate)
            k1 = _rates(x[0], x[1], b, rate, magnet, rods, moments)
            y = _moved(x, 0.5 * h, k1)
            k2 = _rates(y[0], y[1], middle, rate, magnet, rods, moments)
            y = _moved(x, 0.5 * h, k2)
            k3 = _rates(y[0], y[1], middle, rate, magnet, rods, moments)
            y = _moved(x, h, k3)
            k4 = _rates(y[0], y[1], end, rate, magnet, rods, moments)
            x = _moved(
                _moved(_moved(_moved(x, h / 6.0, k1), h / 3.0, k2), h / 3.0, k3), h / 6.0, k4
            )
            x = (normalise(x[0]), x[1])


def with_rods(count: int, quaternion=None):
    """The example with so many rods on each of two axes, from a first attitude or its own."""
    rods = {f"spacecraft.hysteresis_rods[{k}].count": count for k in range(2)}
    first = {} if quaternion is None else {"initial.quaternion": list(quaternion)}
    return with_values(EXAMPLE, {**rods, **first})


def angle_on_limiting_curves(scenario, step_s: float) -> np.ndarray:
    """Angle [deg] of the magnet from the field, every minute."""
    t = np.arange(0.0, scenario.length_s + 2.0 * FIELD_S, FIELD_S)
    rods, *_ = scenario.spacecraft.hysteresis_rods
    environment, motion = scenario.orbit_environment(), scenario.motion_at_start()
    field = environment.field(t, *environment.state(t))
    (row,) = scenario.magnets().rods[:1]
    curve = (float(row["dipole_a_m2"]), float(row["steepness_m_a"]), rods.coercive_a_m)
    q, magnet = np.zeros((len(t) - 1, 4)), scenario.spacecraft.permanent_magnet_a_m2[0]
    moments = tuple(np.diag(scenario.spacecraft.body.inertia).tolist())
    start = tuple(motion[:4].tolist()), tuple(motion[4:].tolist())
    fly_on_limiting_curves(*start, field, FIELD_S, step_s, magnet, curve, moments, q)
    return angle(q, field[:-1])[:: round(60.0 / FIELD_S)]


def angle(q: np.ndarray, b_inertial: np.ndarray) -> np.ndarray:
    """Angle [deg] between axis 1 and the field."""
    b = to_body(q, b_inertial)
    return np.degrees(np.arccos(b[:, 0] / np.linalg.norm(b, axis=1)))


def angle_flown(scenario) -> np.ndarray:
    """The same with rods that make loops within the limiting ones."""
    result = simulate(scenario)
    return angle(result["q_body_to_inertial"].values, result["b_inertial"].values)


def days_to_settle(angle_deg: np.ndarray) -> float:
    """Days after which whole revolutions stay within the limit; infinite if they do not."""
    whole = angle_deg[: len(angle_deg) // REVOLUTION * REVOLUTION].reshape(-1, REVOLUTION)
    outside = np.flatnonzero(whole.max(axis=1) > WITHIN_DEG)
    last = outside[-1] + 1 if len(outside) else 0
    return last * REVOLUTION / 1440.0 if last < len(whole) else math.inf


def fly(case: str, starts: int | None = None) -> list[dict]:
    """Days until each start settles, by the number of rods on an axis; None: more than 14."""
    given, step_s = CASES[case]

    def of(number: int) -> dict:
        members = {str(count): with_rods(count, first_attitude(2010, number)) for count in COUNTS}
        if step_s is None:
            angles = {count: angle_flown(each) for count, each in members.items()}
        else:
            on_curves = functools.partial(angle_on_limiting_curves, step_s=step_s)
            angles = {count: on_curves(each) for count, each in members.items()}
        return {count: digits(days_to_settle(found)) for count, found in angles.items()}

    return fly_all(of, range(starts or given))


def days_of(case: str, count: int) -> np.ndarray:
    """Stored days of a case's starts [n] with so many rods on an axis; infinite if more than 14."""
    days = [row[str(count)] for row in read(NAME)["cases"][case]["rows"]]
    return np.array([math.inf if each is None else each for each in days])
