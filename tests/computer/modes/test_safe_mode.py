"""The whole safe mode of the examples, sound and with one device failing at a time."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import torquer
from torquer import simulate
from torquer.campaign.faults.fly import fly_faults
from torquer.compile import engine
from torquer.computer.modes.check import findings
from torquer.report.campaign.faults import markdown

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ROOT = Path(__file__).parents[3]
FROM_S = 36000.0
ON_X3 = {"axes": [[0, 0, 1]], "half_field_deg": 45.0, "noise_deg": 0.1}


@pytest.fixture(scope="module")
def sound():
    return torquer.load_scenario(ROOT / "examples/safe_mode.toml")


def rates_deg_s(result):
    """Absolute rate over time."""
    return np.degrees(np.linalg.norm(result.omega_body.values, axis=1))


def last_angle_deg(result):
    """Mean angle of the third axis to the Sun in the last six hours."""
    axis = Rotation.from_quat(result.q_body_to_inertial.values).as_matrix()[:, :, 2]
    sun = result.sun_inertial.values
    cosine = np.sum(axis * sun, axis=1) / np.linalg.norm(sun, axis=1)
    angles = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return angles[result.time.values > 18.0 * 3600.0].mean()


def entered_s(result, region, state):
    """When a region first was in a state; infinity if never."""
    variable = result[f"mode_{region}"]
    there = variable.values == variable.attrs["flag_meanings"].split().index(state)
    return float(result.time.values[there.argmax()]) if there.any() else np.inf


def test_sound_it_points_to_the_sun_and_no_guard_trips(sound):
    faults = [found for found in findings(sound.control.modes) if found.is_fault]
    assert [(found.kind, found.region) for found in faults] == [
        ("waits for the unknown", "capture")
    ]
    result = simulate(sound)
    assert last_angle_deg(result) < 7.0  # the axis of greatest inertia is 5.2 deg off the third
    for guard in ("growth", "coil_x", "coil_y", "coil_z", "sun", "capture"):
        assert not result[f"mode_{guard}"].values.any()
    assert set(result.mode_main.values) == {0.0, 1.0}


@pytest.mark.parametrize("from_s", [100.0, FROM_S])
@pytest.mark.parametrize("kind", ["zeros", "stuck", "silent", "reversed"])
def test_field_brakes_and_sun_sensors_point_without_a_gyro(sound, kind, from_s):
    failures = [{"kind": kind, "from_s": from_s}]
    result = simulate(sound.replace("spacecraft.gyro.failures", failures))
    assert entered_s(result, "main", "without_gyro") < from_s + 300.0
    assert rates_deg_s(result)[-1] < 1.5


@pytest.mark.parametrize("kind", ["zeros", "stuck", "silent"])
def test_without_a_magnetometer_s_dot_brakes_and_points(sound, kind):
    failures = [{"kind": kind, "from_s": FROM_S}]
    result = simulate(sound.replace("spacecraft.magnetometer.failures", failures))
    assert entered_s(result, "main", "without_magnetometer") < FROM_S + 90.0
    assert rates_deg_s(result)[-1] < 2.0 and last_angle_deg(result) < 10.0


def test_stuck_sun_sensors_leave_the_axis_where_it_is(sound):
    silent = [{"kind": "silent", "from_s": FROM_S}]
    result = simulate(sound.replace("spacecraft.sun_sensors.failures", silent))
    assert entered_s(result, "main", "without_sun") < FROM_S + 60.0
    assert last_angle_deg(result) < 20.0


@pytest.mark.parametrize("coil", range(3))
@pytest.mark.parametrize("kind", ["reversed", "dead"])
def test_one_bad_coil_is_switched_off_and_the_others_point(sound, coil, kind):
    failures = [{"kind": kind, "coil": coil}]
    result = simulate(sound.replace("spacecraft.coils.failures", failures))
    assert entered_s(result, f"coil_{'xyz'[coil]}", "off") < 3600.0
    assert rates_deg_s(result)[-1] < 1.2 and last_angle_deg(result) < 12.0
    assert float(result.coil_energy) < 3000.0


def test_a_lost_sun_is_searched_for_and_found(sound):
    guarded = simulate(sound.replace("spacecraft.sun_sensors", ON_X3))
    idle = {"states": {"sun_known": {"final": True}, "sun_lost": {"final": True}}}
    unguarded = sound.replace("control.modes.regions.sun", idle)
    free = simulate(unguarded.replace("spacecraft.sun_sensors", ON_X3))
    assert last_angle_deg(guarded) < 7.0 < 60.0 < last_angle_deg(free)
    assert entered_s(free, "main", "searching") == np.inf > entered_s(guarded, "main", "searching")
    searching = np.flatnonzero(np.diff((guarded.mode_main.values == 2).astype(int)) == 1) + 1
    assert (guarded.mode_sun.values[searching] == 1).all()  # it searches only for a lost Sun


def rows_of(page):
    """Fault, instant, verdict and who noticed it, of each row of a table."""
    cells = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    return [(*row[:3], row[7]) for row in cells[2:]]


def test_the_page_shows_what_the_command_finds(sound):
    """Of faults whose outcome is far from any limit."""
    names = ["magnetometer silent", "coil 1 reversed", "coil 1 dead"]
    page = (ROOT / "docs/faults/safe_mode.md").read_text(encoding="utf-8")
    found = rows_of(markdown(fly_faults(sound, names)))
    assert found
    assert set(found) <= set(rows_of(page))
