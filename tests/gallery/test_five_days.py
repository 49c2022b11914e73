"""The five-day flight: what the text says of the sense of x1, the readings, what is read off."""

from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gallery import five_days
from gallery.entries import wheel_10
from torquer.analysis.attitude import orbital_axes
from torquer.compile import engine
from torquer.simulation.setup.run import prepare

needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="minutes without JIT")
UP, ALONG, NORMAL = np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), np.array([0.0, 1, 0])


def frame(radius: int, normal: int) -> np.ndarray:
    """Axes (rows) of the right-handed orbital frame with the radius and the normal as numbered."""
    axes = np.zeros((3, 3))
    axes[radius], axes[normal] = UP, NORMAL
    third = 3 - radius - normal
    axes[third] = np.cross(axes[(third + 1) % 3], axes[(third + 2) % 3])
    return axes


def test_half_pi_turn_aligns_x1_in_two_of_three_frames():
    """WHEEL (6.6): x1 in the motion, x3 in the normal; the text has kept an angle of pi/2."""
    found = {}
    for radius, normal in permutations(range(3), 2):
        orbital = frame(radius, normal)
        assert np.linalg.det(orbital) == pytest.approx(1.0)
        for axis in orbital:
            x1, _, x3 = Rotation.from_rotvec(0.5 * np.pi * axis).apply(orbital)
            if abs(x1 @ ALONG) > 0.5 and abs(x3 @ NORMAL) > 0.5:
                found[radius + 1, normal + 1] = round(float(x1 @ ALONG))
    assert found == {(1, 3): 1, (3, 2): 1, (2, 1): -1}


@needs_jit
@pytest.mark.parametrize("against", [False, True])
def test_readings_differ_by_half_a_turn_about_the_normal(against):
    case = five_days.Case(against, five_days.TURNS, 0.003, None)
    scenario = five_days.scenario(case, 0.001, 1.0)
    r, v = scenario.orbit_environment().state(np.zeros(1))
    cells = prepare(scenario).state.cells[0]
    body = Rotation.from_quat([cells[f"q_{c}"] for c in "xyzw"]).inv()
    along, normal, up = (body * orbital_axes(r, v)[0]).as_matrix().T
    sense = -1.0 if against else 1.0
    assert along == pytest.approx([sense, 0.0, 0.0], abs=1e-9)
    assert normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert up == pytest.approx([0.0, -sense, 0.0], abs=1e-9)


def straight(total, node=(0.0, 0.0, 0.0)) -> five_days.Flight:
    """Ten days of a momentum (n, 3) or one that grows evenly to `total` in the five days."""
    time = np.arange(0.0, 2.0 * five_days.END_S + 1.0, five_days.RECORD_S)
    growing = time[:, None] / five_days.END_S * np.asarray(total)
    return five_days.Flight(time, 0.0 * growing, growing, np.tile(node, (len(time), 1)))


def test_steady_torque_adds_its_full_momentum_along_the_node():
    node = np.array([0.6, -0.8, 0.0])
    flight = five_days.with_steady_torque(straight((1.0, 2.0, 3.0), node), -2.0)
    at_end = flight.total[flight.time_s == five_days.END_S][0]
    assert at_end == pytest.approx(np.array([1.0, 2.0, 3.0]) - 2.0 * node)
    assert flight.total[0] == pytest.approx(np.zeros(3))


def test_wheel_limit_time_is_that_of_even_growth():
    at = (60.0, 45.0)
    one = np.abs(wheel_10.wheels_at(straight((0.0, 0.0, 1.0)), at)).max(axis=1)
    per_day = one[-1] / 10.0
    flight = straight((0.0, 0.0, 18.0 / per_day / 7.0))
    assert wheel_10.saturated_h(flight, at) == pytest.approx(7.0 * 24.0, rel=1e-9)
    assert wheel_10.saturated_h(straight((0.0, 0.0, 1.0)), at) == np.inf
