"""The whole safe mode of the examples: sound, and faults with its guards and without."""

from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer import simulate
from torquer.analysis.goals import angle_of_axis_deg
from torquer.campaign.faults.fly import fly_faults
from torquer.campaign.faults.strikes import without_guards
from torquer.compile import engine
from torquer.control.modes.check import findings
from torquer.report.campaign.faults import markdown

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
ROOT = Path(__file__).parents[3]
FROM_10_H = {"from_s": 36000.0}


@pytest.fixture(scope="module")
def sound():
    return torquer.load_scenario(ROOT / "examples/safe_mode.toml")


def last_angle_deg(result):
    """Mean angle of the axis to the Sun in the last six hours."""
    last = result.isel(time=np.flatnonzero(result.time.values > 18.0 * 3600.0))
    return angle_of_axis_deg(last, (0.0, 0.0, 1.0)).mean()


def last_rate_deg_s(result):
    """Rate at the end."""
    return float(np.degrees(np.linalg.norm(result.omega_body.values[-1])))


def pair(sound, key, value):
    """The results of a fault with the guards, and without them."""
    faulty = sound.replace(key, value)
    return simulate(faulty), simulate(without_guards(faulty))


def test_sound_it_points_to_the_sun_and_no_guard_trips(sound):
    assert [found for found in findings(sound.control.modes) if found.is_fault] == []
    result = simulate(sound)
    assert last_angle_deg(result) < 7.0  # the axis of greatest inertia is 5.2 deg off the third
    for guard in ("growth", "magnetometer", "field", "sun"):
        assert not result[f"mode_{guard}"].values.any()


def test_coils_the_wrong_way_round_are_switched_off(sound):
    guarded, free = pair(sound, "spacecraft.coils.polarity", [1, -1, -1])
    assert last_rate_deg_s(guarded) < 12.0 < 50.0 < last_rate_deg_s(free)


def test_a_spinning_satellite_keeps_its_axis_if_no_old_dipole_turns_it(sound):
    silent = [{"kind": "silent", **FROM_10_H}]
    guarded, free = pair(sound, "spacecraft.magnetometer.failures", silent)
    assert last_angle_deg(guarded) < 30.0 < 60.0 < last_angle_deg(free)
    assert float(guarded.coil_energy) < 0.3 * float(free.coil_energy)


def test_zeros_of_the_magnetometer_do_no_harm_to_these_laws(sound):
    """They rest in a field of zeros: the guard makes no difference but at the first readings."""
    zeros = [{"kind": "zeros", **FROM_10_H}]
    guarded, free = pair(sound, "spacecraft.magnetometer.failures", zeros)
    assert (guarded.mode_field.values[guarded.time.values > 36060.0] == 1).all()
    assert last_angle_deg(guarded) == pytest.approx(last_angle_deg(free), abs=2.0)


def test_a_lost_sun_is_searched_for_and_found(sound):
    on_x3 = {"axes": [[0, 0, 1]], "half_field_deg": 45.0, "noise_deg": 0.1}
    guarded, free = pair(sound, "spacecraft.sun_sensors", on_x3)
    assert last_angle_deg(guarded) < 7.0 < 60.0 < last_angle_deg(free)
    assert not (free.mode_main.values == 2).any()
    searching = np.flatnonzero(np.diff((guarded.mode_main.values == 2).astype(int)) == 1) + 1
    assert searching.size
    assert (guarded.mode_sun.values[searching] == 1).all()  # it searches only for a lost Sun


def rows_of(page):
    """Fault, instant, verdict and who noticed it, of each row of a table."""
    cells = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    return [(*row[:3], row[7]) for row in cells[2:]]


def test_the_page_shows_what_the_command_finds(sound):
    """Of faults whose outcome is far from any limit."""
    names = ["gyro zeros", "magnetometer silent", "Sun sensors reversed z", "coil 1 stuck on"]
    page = (ROOT / "docs/faults/safe_mode.md").read_text(encoding="utf-8")
    found = rows_of(markdown(fly_faults(sound, names)))
    assert len(found) == 8
    assert set(found) <= set(rows_of(page))
