"""A published satellite with a bar magnet and hysteresis rods: CSSWE.

D. Gerhardt, S. Palo, 'Passive magnetic attitude control for CubeSat spacecraft' (SSC10, 2010): it
settles to within 10 deg of the field after 6.5 days. Inertia, magnet, rods, orbit and rates are
those of the example, which a public program quotes from the paper; the number of rods on an axis,
the model of the field and the first attitude are not among them.

Their rods lie on the limiting curves at any time, so that they brake a small oscillation as much
as dry friction would; those of Flatley and Henretty make loops within the limiting ones, whose area
falls with the cube of the amplitude. A twin with rods of the first kind settles in times among
which theirs lies.
"""

import math
from pathlib import Path

import numpy as np
import pytest

from torquer.base.conventions import MU_0_H_M
from torquer.compile import engine
from torquer.compile.engine import kernel
from torquer.maths.geometry.attitudes import to_body
from torquer.maths.geometry.quaternion import derivative, normalise, rotate_inverse
from torquer.maths.geometry.vec3 import add_scaled, cross
from torquer.scenario.load import load_scenario
from torquer.simulation.setup.simulate import simulate

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="weeks of flight: hours without JIT")
EXAMPLE = load_scenario(Path(__file__).parents[2] / "examples/passive_magnet.toml")
#: Published: within so many degrees after so many days.
WITHIN_DEG, AFTER_DAYS = 10.0, 6.5
#: Records in a revolution, of one a minute.
REVOLUTION = 96
#: First attitudes [deg]: the paper's is not known.
STARTS = ((0, 0, 0), (40, 70, 10), (-80, 20, 130), (150, -40, 60), (10, 30, -100), (90, 10, 20))


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
def fly_on_limiting_curves(q, w, field, field_s, magnet, rods, moments, out):
    """RK4 by 0.5 s; field [n, 3] T every `field_s`; out: attitude at each of these instants."""
    h, steps, x = 0.5, int(field_s / 0.5), (q, w)
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


def with_rods(count, start_deg=(0.0, 0.0, 0.0)):
    """The example with so many rods on each of two axes, from a first attitude."""
    given = EXAMPLE.replace("initial.euler_deg", list(start_deg))
    for k in range(2):
        given = given.replace(f"spacecraft.hysteresis_rods[{k}].count", count)
    return given


def twin_angle(count, start_deg):
    """Angle [deg] from the field with rods on the limiting curves, every minute."""
    scenario = with_rods(count, start_deg)
    t, (rods, *_) = (
        np.arange(0.0, scenario.length_s + 20.0, 10.0),
        scenario.spacecraft.hysteresis_rods,
    )
    environment, motion = scenario.orbit_environment(), scenario.motion_at_start()
    field = environment.field(t, *environment.state(t))
    (row,) = scenario.magnets().rods[:1]
    curve = (float(row["dipole_a_m2"]), float(row["steepness_m_a"]), rods.coercive_a_m)
    q, magnet = np.zeros((len(t) - 1, 4)), scenario.spacecraft.permanent_magnet_a_m2[0]
    moments = tuple(np.diag(scenario.spacecraft.body.inertia).tolist())
    start = tuple(motion[:4].tolist()), tuple(motion[4:].tolist())
    fly_on_limiting_curves(*start, field, 10.0, magnet, curve, moments, q)
    return angle(q, field[:-1])[::6]


def angle(q, b_inertial):
    """Angle [deg] between axis 1 and the field."""
    b = to_body(q, b_inertial)
    return np.degrees(np.arccos(b[:, 0] / np.linalg.norm(b, axis=1)))


def flown_angle(scenario):
    """The same of torquer's run, and the rate [deg/s]."""
    result = simulate(scenario)
    found = angle(result["q_body_to_inertial"].values, result["b_inertial"].values)
    return found, np.degrees(np.linalg.norm(result["omega_body"].values, axis=1))


def days_to_settle(angle_deg):
    """Days after which whole revolutions stay within the limit; infinite if they do not."""
    whole = angle_deg[: len(angle_deg) // REVOLUTION * REVOLUTION].reshape(-1, REVOLUTION)
    outside = np.flatnonzero(whole.max(axis=1) > WITHIN_DEG)
    last = outside[-1] + 1 if len(outside) else 0
    return last * REVOLUTION / 1440.0 if last < len(whole) else math.inf


@pytest.mark.slow
@pytest.mark.parametrize("count", (2, 3))
def test_published_time_lies_among_those_of_the_limiting_curves(count):
    """6.5 days, with two rods on an axis and with three: some starts settle sooner, some later.

    The medians are 9.5 and 3.8 days; the number of rods and the start are not known.
    """
    days = [days_to_settle(twin_angle(count, start)) for start in STARTS]
    assert min(days) < AFTER_DAYS < max(days) < 14.0, days


@pytest.mark.slow
def test_loops_within_the_limiting_ones_settle_later():
    """The example, by Flatley and Henretty: the published time is not reached."""
    found, rate = flown_angle(EXAMPLE)
    assert days_to_settle(found) > 1.5 * AFTER_DAYS
    # it is calmed all the same: the rate falls to that of the spin about the magnet
    assert rate[-REVOLUTION:].mean() < 0.15 * rate[0]
    assert np.median(found[-10 * REVOLUTION :]) < WITHIN_DEG


@pytest.mark.slow
def test_a_long_body_that_turns_about_the_field_stands_off_it():
    """With six rods m B = (J_t - J) w^2 cos(angle): torques of magnet and rotation balance."""
    scenario, late = with_rods(6), slice(-10 * REVOLUTION, None)
    result = simulate(scenario)
    b = result["b_inertial"].values[late]
    found = angle(result["q_body_to_inertial"].values[late], b)
    rate = np.linalg.norm(result["omega_body"].values[late], axis=1)
    along, *across = np.diag(scenario.spacecraft.body.inertia)
    pull = scenario.spacecraft.permanent_magnet_a_m2[0] * np.linalg.norm(b, axis=1)
    outward = (np.mean(across) - along) * rate**2 * np.cos(np.radians(found))
    assert np.mean(outward) == pytest.approx(np.mean(pull), rel=0.1)
    assert np.median(found) > 30.0


def test_rods_calm_the_example_from_the_first_day_on():
    """A day in flight: the rate falls steadily, and not without rods."""
    day = EXAMPLE.replace("simulation.duration_s", 86400.0)
    _, rate = flown_angle(day)
    daily = rate[: 15 * REVOLUTION].reshape(-1, REVOLUTION).mean(axis=1)
    assert np.all(np.diff(daily) < 0.0) and daily[-1] < 0.85 * daily[0]
    _, free = flown_angle(day.replace("spacecraft.hysteresis_rods", ()))
    assert abs(free[-REVOLUTION:].mean() / free[:REVOLUTION].mean() - 1.0) < 0.02
