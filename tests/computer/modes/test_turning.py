"""How fast a body turns, by whatever turns with it: gyro, field and Sun, sound and not."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from torquer.compile import engine
from torquer.computer.interface import GYRO, MAGNETOMETER, SENSORS, SUN_SENSORS
from torquer.computer.modes.table import CHECKS_NOW
from torquer.computer.modes.turning import fastest_turn, first_turning, follow_turning

OMEGA = np.radians((1.5, -2.0, 1.8))
FIELD_T, SUN = np.array([2.5e-5, 1.2e-5, -2e-5]), np.array([0.6, 0.0, 0.8])
NAMES = {"gyro": GYRO, "field": MAGNETOMETER, "sun": SUN_SENSORS}
SWAPPED = np.array([[0, 1, 0], [1, 0, 0], [0, 0, 1]])
WRONG = {"reversed": -np.eye(3), "reversed y": np.diag([1, -1, 1]), "swapped xy": SWAPPED}


def python(function):
    """A kernel as plain Python."""
    return getattr(function, "py_func", function)


def turned(seconds=60, omega=OMEGA, seen=("gyro", "field", "sun"), change=None, every=1):
    """The rate [deg/s] after so long, by the sensors that are `seen`.

    `change`: of what a sensor reads; None of it is a sensor that fails by itself.
    """
    checks, t_s = np.zeros(1, CHECKS_NOW), 0.0
    first_turning(checks)
    now = engine.with_attributes(checks)[0]
    for k in range(0, seconds + 1, every):
        t_s, body = float(k), Rotation.from_rotvec(omega * k).inv()
        v = {"gyro": omega, "field": body.apply(FIELD_T), "sun": body.apply(SUN)}
        read = {name: (change or (lambda _, w: w))(name, v[name]) for name in seen}
        sensors = [SimpleNamespace(failed_s=-math.inf, is_read=0.0, read_s=t_s) for _ in SENSORS]
        for name in seen:
            sensors[NAMES[name]].is_read = 1.0
            if read[name] is None:
                sensors[NAMES[name]].failed_s = t_s
        given = {name: tuple(w) for name, w in read.items() if w is not None}
        inputs = SimpleNamespace(
            t_s=t_s,
            omega_body_rad_s=given.get("gyro", (math.nan,) * 3),
            b_body_t=given.get("field", (math.nan,) * 3),
            sun_body=given.get("sun", (math.nan,) * 3),
        )
        python(follow_turning)(now, sensors, inputs)
    return math.degrees(python(fastest_turn)(now, t_s))


def across(v):
    """Rate [deg/s] across a direction: what its turn shows at each instant."""
    u = v / np.linalg.norm(v)
    return math.degrees(np.linalg.norm(OMEGA - (OMEGA @ u) * u))


@pytest.mark.parametrize("every", [1, 4])
def test_the_fastest_is_the_rate(every):
    assert turned(every=every) == pytest.approx(math.degrees(np.linalg.norm(OMEGA)), rel=1e-9)


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("name", NAMES)
def test_wrong_axes_change_nothing(name, wrong):
    right = turned(seen=(name,))
    assert turned(seen=(name,), change=lambda _, v: WRONG[wrong] @ v) == pytest.approx(right)


@pytest.mark.parametrize(("name", "v"), [("field", FIELD_T), ("sun", SUN)])
def test_a_direction_shows_the_turn_across_it(name, v):
    """Of a cone about the rate the mean is along it: the part across, times its sine again."""
    sine = across(v) / math.degrees(np.linalg.norm(OMEGA))
    assert sine * across(v) * 0.95 < turned(seen=(name,), seconds=600) < across(v)


@pytest.mark.parametrize("name", NAMES)
def test_what_fails_by_itself_does_not_turn(name):
    def spoilt(sensor, v):
        return None if sensor == name else v

    assert math.isnan(turned(seen=(name,), change=spoilt))
    others = [each for each in NAMES if each != name]
    assert turned(change=spoilt) == pytest.approx(turned(seen=others))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(5))
def test_noise_is_no_turn(name, seed):
    rng = np.random.default_rng(seed)
    sizes = {"gyro": math.radians(3.0), "field": 2e-5, "sun": math.radians(30.0)}

    def noisy(sensor, v):
        return v + sizes[sensor] * rng.normal(size=3)

    still = turned(omega=np.zeros(3), seen=(name,), change=noisy, seconds=120)
    assert still < 1.2


@pytest.mark.parametrize("seen", [("gyro",), ("field",), ("sun",)])
@pytest.mark.parametrize("v", [(math.nan, 0.0, 1.0), (math.inf, 0.0, 1.0), (0.0, 0.0, 0.0)])
def test_nothing_and_no_number_leave_a_number_or_unknown(seen, v):
    found = turned(seen=seen, change=lambda _, __: v)
    assert math.isnan(found) or found == 0.0


def test_a_turn_is_forgotten():
    """Two minutes after the last reading it is not known any more, sooner than it would mislead."""
    checks = np.zeros(1, CHECKS_NOW)
    now = engine.with_attributes(checks)[0]
    first_turning(checks)
    now.turning[0, :] = (100.0, 30.0, 0, 0, 0, 0.0, 0.03, 0.04, 0.0025)
    assert python(fastest_turn)(now, 219.0) == pytest.approx(0.05)
    assert math.isnan(python(fastest_turn)(now, 221.0))
