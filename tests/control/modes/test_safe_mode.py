"""The whole safe mode of the examples: sound, and each fault with its guard and without."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import torquer
from torquer import simulate
from torquer.compile import engine
from torquer.control.modes.check import findings

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
EXAMPLES = Path(__file__).parents[3] / "examples"


def _example():
    spec = importlib.util.spec_from_file_location("faults", EXAMPLES / "safe_mode_failures.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


EXAMPLE = _example()


@pytest.fixture(scope="module")
def sound():
    return torquer.load_scenario(EXAMPLES / "safe_mode.toml")


def last_angle_deg(result):
    """Mean angle of the axis to the Sun in the last six hours."""
    return EXAMPLE.to_sun_deg(result)[result.time.values > 18.0 * 3600.0].mean()


def pair(sound, fault):
    """The results with the guard against a fault, and without it."""
    guard, key, value = EXAMPLE.FAULTS[fault]
    faulty = sound.replace(key, value)
    return simulate(faulty), simulate(EXAMPLE.unguarded(faulty, guard))


def test_sound_it_points_to_the_sun_and_no_guard_trips(sound):
    assert [found for found in findings(sound.control.modes) if found.is_fault] == []
    result = simulate(sound)
    assert last_angle_deg(result) < 7.0  # the axis of greatest inertia is 5.2 deg off the third
    for guard in ("growth", "magnetometer", "field", "sun"):
        assert not result[f"mode_{guard}"].values.any()


def test_coils_the_wrong_way_round_are_switched_off(sound):
    guarded, free = pair(sound, "two coils the wrong way round")
    assert EXAMPLE.rates_deg_s(guarded)[-1] < 12.0 < 50.0 < EXAMPLE.rates_deg_s(free)[-1]


def test_a_spinning_satellite_keeps_its_axis_if_no_old_dipole_turns_it(sound):
    guarded, free = pair(sound, "magnetometer silent from 10 h on")
    assert last_angle_deg(guarded) < 30.0 < 60.0 < last_angle_deg(free)
    assert float(guarded.coil_energy) < 0.3 * float(free.coil_energy)


def test_zeros_of_the_magnetometer_do_no_harm_to_these_laws(sound):
    """They rest in a field of zeros: the guard makes no difference but at the first readings."""
    guarded, free = pair(sound, "magnetometer zeros from 10 h on")
    assert (guarded.mode_field.values[guarded.time.values > 36060.0] == 1).all()
    assert last_angle_deg(guarded) == pytest.approx(last_angle_deg(free), abs=2.0)


def test_a_lost_sun_is_searched_for_and_found(sound):
    guarded, free = pair(sound, "one Sun sensor left, on x3")
    assert last_angle_deg(guarded) < 7.0 < 60.0 < last_angle_deg(free)
    assert not (free.mode_main.values == 2).any()
    searching = np.flatnonzero(np.diff((guarded.mode_main.values == 2).astype(int)) == 1) + 1
    assert searching.size
    assert (guarded.mode_sun.values[searching] == 1).all()  # it searches only for a lost Sun
