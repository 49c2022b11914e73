"""References of `wheel_tracking` and its slews: derivatives, targets, limits, errors at the end."""

import itertools

import numpy as np
import pytest
from law_cases import compiled, inputs
from scipy.spatial.transform import Rotation

from torquer.base.conventions import MU_EARTH_M3_S2
from torquer.computer.laws.wheel_tracking import WheelTracking
from torquer.environment.earth.rotation import dcm_inertial_to_ecef
from torquer.maths.geometry.frames import ecef_from_geodetic
from torquer.maths.geometry.vec3 import as_matrix

START, SUN = "2024-03-20T06:00:00Z", np.array([0.6, 0.64, 0.48])
INERTIA = np.array([[1.49, 0.054, 0.0442], [0.054, 1.51, 0.0], [0.0442, 0.0, 1.56]])
KEYS = {
    "axis": [0, 0, -1], "second_axis": [0.2, 1, 0.1], "bandwidth_rad_s": 0.1,
    "greatest_rate_deg_s": 1.0, "greatest_acceleration_deg_s2": 0.05,
    "inertia_kg_m2": INERTIA.tolist(), "gravity_feedforward": False,
}  # fmt: skip
PLACE = {"latitude_deg": 30.0, "longitude_deg": 20.0, "height_m": 500.0}
GROUND_M = ecef_from_geodetic(np.radians(30.0), np.radians(20.0), 500.0)
EARTH = dcm_inertial_to_ecef(np.zeros(1), START)[0]
#: Over the place at this time, on an eccentric orbit.
OVER_S = 300.0


def spec(target, second, **keys):
    place = PLACE if "ground" in (target, second) else {}
    return WheelTracking(target=target, second_target=second, **KEYS | place | keys)


def place_now(t_s):
    """The place on the ground [m], inertial."""
    return dcm_inertial_to_ecef(np.array([t_s]), START)[0].T @ GROUND_M


def orbit(t_s, aside_m=3e5):
    """Position and velocity on a two-body orbit which passes beside the place at `OVER_S`."""
    at = place_now(OVER_S)
    up = at / np.linalg.norm(at)
    along = np.cross(up, [0.3, -0.2, 0.9])
    along /= np.linalg.norm(along)
    r, v = at + 6e5 * up + aside_m * np.cross(up, along), 7700.0 * along + 100.0 * up
    steps = max(int(abs(t_s - OVER_S) / 2.0), 1)
    h, y = (t_s - OVER_S) / steps, np.concatenate([r, v])

    def slope(y):
        return np.concatenate([y[3:], -MU_EARTH_M3_S2 * y[:3] / np.linalg.norm(y[:3]) ** 3])

    for _ in range(steps):
        a = slope(y)
        b = slope(y + 0.5 * h * a)
        c = slope(y + 0.5 * h * b)
        y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + slope(y + h * c))
    return y[:3], y[3:]


class Flown:
    """A law that is called in order, with what it remembers."""

    def __init__(self, made):
        self.law = made.law().filled(lambda name: as_matrix(EARTH))
        self.ask, self.packed = compiled(self.law), self.law.pack()
        self.cells = self.law.first_memory()
        self.memory = self.law.record_of(self.cells)

    def torque(self, t_s, q=(0.0, 0.0, 0.0, 1.0), omega=(0.0, 0.0, 0.0), wheels=(0.0, 0.0, 0.0)):
        r, v = orbit(t_s)
        row = inputs(t_s, q=q, omega=omega, wheels=wheels, r=r, v=v, model_sun=SUN)
        return np.array(self.ask(row, self.packed, self.cells).torque_n_m)

    def reference(self):
        """Attitude, rate, angular acceleration of the reference, inertial."""
        m = self.memory
        return Rotation.from_quat(m.q_reference), m.omega_reference.copy(), m.alpha_reference.copy()


def reference_at(made, t_s):
    flown = Flown(made)
    flown.torque(t_s)
    return flown.reference()


NAMES = ("nadir", "sun", "velocity", "orbit_normal", "ground", (0.3, -0.5, 0.8))
PAIRS = [pair for pair in itertools.permutations(NAMES, 2)]


@pytest.mark.parametrize(("target", "second"), PAIRS, ids=str)
def test_rate_and_acceleration_are_derivatives_of_the_reference(target, second):
    made, t_s, h = spec(target, second), 240.0, 0.05
    before, now, after = (reference_at(made, t) for t in (t_s - h, t_s, t_s + h))
    omega = (after[0] * before[0].inv()).as_rotvec() / (2.0 * h)
    assert now[1] == pytest.approx(omega, abs=3e-8)
    assert now[2] == pytest.approx((after[1] - before[1]) / (2.0 * h), abs=3e-9)


@pytest.mark.parametrize("t_s", [120.0, 250.0, 300.0, 450.0])
def test_the_axis_points_through_the_place_on_the_ground(t_s):
    q, _, _ = reference_at(spec("ground", "sun"), t_s)
    ray = place_now(t_s) - orbit(t_s)[0]
    miss = ray - q.apply([0, 0, -1]) * (ray @ q.apply([0, 0, -1]))
    assert np.linalg.norm(miss) < 0.5  # m: the pole moves by 4 m a day
    second, normal = q.apply([0.2, 1, 0.1]), np.cross(ray, SUN)
    assert abs(second @ normal) < 1e-9 * np.linalg.norm(normal) and second @ SUN > 0.0


def test_out_of_sight_it_is_the_nadir():
    for t_s, least in ((-900.0, 0.0), (0.0, 60.0), (300.0, 80.0)):
        q, _, _ = reference_at(spec("ground", "sun", least_elevation_deg=least), t_s)
        r = orbit(t_s)[0]
        assert q.apply([0, 0, 1]) == pytest.approx(r / np.linalg.norm(r), abs=1e-12)


def test_sight_is_judged_by_the_elevation_above_the_ellipsoid():
    lat, lon = np.radians((30.0, 20.0))
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    up = dcm_inertial_to_ecef(np.array([200.0]), START)[0].T @ up
    ray = orbit(200.0)[0] - place_now(200.0)
    elevation = np.degrees(np.arcsin(ray @ up / np.linalg.norm(ray)))
    for off, seen in ((-0.01, True), (0.01, False)):
        q, _, _ = reference_at(spec("ground", "sun", least_elevation_deg=elevation + off), 200.0)
        points = -q.apply([0, 0, -1]) @ ray / np.linalg.norm(ray)
        assert (points > 1.0 - 1e-9) == seen


@pytest.mark.parametrize(("target", "second"), [("nadir", (0, 0, 1)), ("sun", "nadir")])
def test_two_directions_along_one_line_give_an_attitude_all_the_same(target, second):
    flown = Flown(spec(target, second))
    r = np.array([0.0, 0.0, -7e6]) if target == "nadir" else -7e6 * SUN
    row = inputs(0.0, q=(0, 0, 0, 1), r=r, v=(7e3, 0, 100.0), model_sun=SUN)
    assert np.isfinite(flown.ask(row, flown.packed, flown.cells).torque_n_m).all()
    points = flown.reference()[0].apply([0, 0, -1])
    assert points == pytest.approx(-r / 7e6 if target == "nadir" else SUN, abs=1e-12)


def commanded(flown, times, **body):
    """Turn (rotation vector) from the reference to what is steered, at these times."""
    found = []
    for t in times:
        flown.torque(t, **body)
        q, _, _ = flown.reference()
        found.append((q.inv() * Rotation.from_quat(flown.memory.q_commanded)).as_quat())
    return Rotation.from_quat(found)


def motion(relative, step):
    """Rates and accelerations [deg/s, deg/s^2] between attitudes in steps."""
    rate = np.degrees((relative[:-1].inv() * relative[1:]).as_rotvec()) / step
    middle = 0.5 * (rate[1:] + rate[:-1])
    return (
        np.linalg.norm(rate, axis=1),
        np.linalg.norm(np.diff(rate, axis=0), axis=1) / step,
        middle,
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_slew_keeps_its_limits_and_ends_at_rest(seed):
    rng = np.random.default_rng(seed)
    limit, up = 10.0 ** rng.uniform(-0.7, 0.5), 10.0 ** rng.uniform(-1.5, -0.5)
    made = spec("nadir", "sun", greatest_rate_deg_s=limit, greatest_acceleration_deg_s2=up)
    q = Rotation.random(random_state=seed)
    at_start, turning, _ = reference_at(made, 0.0)
    fast = rng.uniform(0.0, 0.5) * limit
    away = rng.normal(size=3)
    omega = q.inv().apply(turning) + np.radians(fast) * away / np.linalg.norm(away)
    angle = np.degrees((at_start.inv() * q).magnitude())
    length = 1.5 * 2.0 * limit / up + 2.0 * angle / limit + 4.0 * 3.95 * limit / up
    times = np.linspace(0.0, length, 1200)
    relative = commanded(Flown(made), times, q=q.as_quat(), omega=omega)
    rate, acceleration, _ = motion(relative, times[1])
    assert rate.max() < 1.001 * limit
    assert acceleration.max() < 1.01 * up and acceleration.max() > 0.4 * up
    assert np.degrees(relative[-1].magnitude()) < 1e-6 and rate[-1] < 1e-6
    # it begins with the body's attitude and rate
    assert (relative[0].inv() * at_start.inv() * q).magnitude() < 1e-7
    assert rate[0] == pytest.approx(fast, abs=1.5 * up * times[1])


def test_a_large_slew_uses_its_limits():
    """From rest: the shortest time for its shape, angle/rate + 1.5 rate/acceleration."""
    made = spec((1, 0, 0), (0, 0, 1))
    reference, _, _ = reference_at(made, 0.0)
    q = reference * Rotation.from_rotvec([0.0, np.radians(120.0), 0.0])
    times = np.arange(0.0, 152.0, 0.5)
    relative = commanded(Flown(made), times, q=q.as_quat())
    left = np.degrees(relative.magnitude())
    rate, acceleration, _ = motion(relative, 0.5)
    assert rate.max() == pytest.approx(1.0, rel=1e-6)
    assert acceleration.max() == pytest.approx(0.05, rel=1e-3)
    assert left[times >= 120.0 + 30.0].max() < 1e-6 < left[times <= 149.0].min()


def test_the_body_follows_a_slew_and_then_the_place():
    """Wheels that give what is asked: the body stays on what is steered, through rise and pass."""
    made = spec("ground", "orbit_normal", least_elevation_deg=20.0)
    flown, step, j = Flown(made), 0.5, INERTIA
    q, omega = Rotation.from_rotvec([0.3, -0.8, 0.5]), np.array([0.002, -0.001, 0.003])
    wheels, errors, lefts = np.zeros(3), [], []
    momentum = q.apply(j @ omega)
    for t in np.arange(-60.0, 420.0, step):
        torque = flown.torque(t, q=q.as_quat(), omega=omega, wheels=wheels)
        wanted = Rotation.from_quat(flown.memory.q_commanded)
        errors.append(np.degrees((wanted.inv() * q).magnitude()))
        lefts.append(float(flown.memory.slew_left_rad))
        for _ in range(5):  # the wheels take the torque, the whole momentum stays
            h = step / 5.0
            rate = np.linalg.solve(j, torque - np.cross(omega, j @ omega + wheels))
            q = q * Rotation.from_rotvec(h * (omega + 0.5 * h * rate))
            omega = omega + h * rate
            wheels = q.inv().apply(momentum) - j @ omega
    errors, lefts = np.array(errors), np.array(lefts)
    assert (lefts > 0.3).any() and lefts[-1] == 0.0
    assert errors.max() < 0.5 and errors[lefts == 0.0].max() < 0.2


def test_another_target_in_flight_makes_a_slew_without_a_jump():
    flown, step = Flown(spec("nadir", "sun")), 0.5
    at = flown.law.places()["first"][0]
    attitudes = []
    for k in range(300):
        if k in (100, 140):  # the second change meets a slew
            flown.packed[at] = 2.0 if k == 140 else 3.0
            flown.packed[flown.law.places()["second"][0]] = 4.0
        flown.torque(step * k, q=(0.5, 0.5, 0.5, 0.5))
        attitudes.append(flown.memory.q_commanded.copy())
    attitudes = Rotation.from_quat(attitudes)
    rate, acceleration, _ = motion(attitudes, step)
    assert rate.max() < 1.0 + 0.3 and acceleration.max() < 0.1
    assert flown.memory.slew_start_s == 70.0


def test_after_a_pause_it_begins_where_the_body_is():
    flown, elsewhere = Flown(spec("nadir", "sun")), Rotation.from_rotvec([0.0, 1.0, 2.0])
    for t in np.arange(0.0, 20.0, 1.0):
        flown.torque(t)
    for t in (21.0, 22.5):  # no pause: what is steered stays its own
        flown.torque(t, q=elsewhere.as_quat())
        assert flown.memory.slew_start_s == 0.0
    flown.torque(60.0, q=elsewhere.as_quat())
    assert flown.memory.slew_start_s == 60.0
    now = Rotation.from_quat(flown.memory.q_commanded)
    assert (now.inv() * elsewhere).magnitude() < 1e-7


def test_the_loop_is_that_of_bandwidth_and_damping():
    """A small error at rest, and a small rate: the torque of the two roots."""
    made = spec((1, 0, 0), (0, 0, 1), damping=0.7)
    reference, _, _ = reference_at(made, 0.0)
    for turn, rate in (([1e-4, -2e-4, 3e-4], [0, 0, 0]), ([0, 0, 0], [1e-5, 2e-5, -1e-5])):
        flown = Flown(made)
        flown.torque(0.0, q=reference.as_quat())
        q = reference * Rotation.from_rotvec(turn)
        torque = flown.torque(1.0, q=q.as_quat(), omega=rate)
        expected = -INERTIA @ (1.4 * 0.1 * np.array(rate) + 0.01 * np.array(turn))
        assert torque == pytest.approx(expected, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"second_axis": [0, 0, 2]}, "second_axis: must not lie along the axis"),
        ({"second_target": "nadir"}, "second_target: must not lie along the target"),
        ({"target": [1, 0, 0], "second_target": [-1, 0, 0]}, "second_target: must not lie along"),
        ({"target": "ground"}, "latitude_deg: must be given for the target 'ground'"),
        ({"latitude_deg": 3.0}, "latitude_deg: must be left out unless a target is 'ground'"),
        ({"greatest_rate_deg_s": 0.0}, "greatest_rate_deg_s"),
        ({"greatest_acceleration_deg_s2": -1.0}, "greatest_acceleration_deg_s2"),
        ({"target": "moon"}, "target"),
        ({"least_elevation_deg": 90.0}, "least_elevation_deg"),
    ],
)
def test_what_gives_no_attitude_or_no_slew_is_refused(keys, message):
    with pytest.raises(ValueError, match=message):
        WheelTracking(**KEYS | {"target": "nadir", "second_target": "sun"} | keys)


def test_it_needs_what_its_targets_take():
    assert "ephemeris" not in spec((1, 0, 0), (0, 0, 1)).needs
    assert {"model_sun", "ephemeris"} < spec("sun", (0, 0, 1)).needs
    assert "place" not in spec("sun", (0, 0, 1)).needs
    assert "place" in spec("sun", (0, 0, 1), gravity_feedforward=True).needs
    for name in ("nadir", "velocity", "orbit_normal", "ground"):
        assert "place" in spec(name, "sun").needs
