"""Guards of a safe mode against bugs that flew: each bug with the guard and without it."""

import numpy as np
import pytest

from torquer import simulate
from torquer.compile import engine
from torquer.computer.modes.check import findings
from torquer.scenario.load import presets, scenario_from_text

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

CHIBIS_M = """
start = 2012-03-04T10:31:47Z
seed = {seed}
orbit = {{ kind = "circular", altitude_km = 550, inclination_deg = 51.7 }}
spacecraft.body.preset = "chibis_m_body"
spacecraft.coils = {{ preset = "chibis_m_coils", polarity = {polarity} }}
spacecraft.magnetometer = {{ preset = "hmr2300r", failures = [{magnetometer}] }}
spacecraft.gyro = {{ preset = "adis16130", failures = [{gyro}] }}
initial = {{ rate_deg_s = [3, -4, 2], euler_deg = [{angle}, 20, 30] }}
simulation = {{ revolutions = {revolutions}, record_s = 20.0 }}
[control]
sample_s = 1.0
[control.laws]
damping = {{ kind = "bdot", gain_a_m2_s_per_t = 1e6 }}
[control.modes]
inertia_kg_m2 = [[1.0255, 0.0014, -0.0724], [0.0014, 1.5393, 0.0019], [-0.0724, 0.0019, 1.8172]]
[control.modes.noise]
magnetometer_noise_nt = 100
sun_noise_deg = 0.2
gyro_noise_deg_s = 0.02
rate_tolerance_deg_s = 0.06
"""
DAMPING = """
[control.modes.regions.main.states.damping]
laws = ["damping"]
final = true
"""
GUARD = """
[control.modes.regions.guard]
preset = "{}"
"""
RIGHT = "[1, 1, 1]"


def flown(modes, **keys):
    """The result of eight revolutions of B-dot under a mode table."""
    keys = {"seed": 1, "polarity": RIGHT, "magnetometer": "", "gyro": "", "angle": 10,
            "revolutions": 8} | keys  # fmt: skip
    return simulate(scenario_from_text(CHIBIS_M.format(**keys) + modes))


def rates_deg_s(result):
    """Absolute rate at the records."""
    return np.degrees(np.linalg.norm(result.omega_body.values, axis=1))


def entered_s(result, region, number):
    """When a region first was in its state of a number; infinity if never."""
    there = result[f"mode_{region}"].values == number
    return float(result.time.values[there.argmax()]) if there.any() else np.inf


@pytest.mark.parametrize("polarity", ["[-1, -1, 1]", "[-1, 1, -1]", "[1, -1, -1]", "[-1, -1, -1]"])
def test_coils_of_the_wrong_sign_are_switched_off(polarity):
    """Two coils or three the wrong way round speed the satellite up, to many times its rate."""
    free = rates_deg_s(flown(DAMPING, polarity=polarity))
    guarded = flown(DAMPING + GUARD.format("rate_growth_guard"), polarity=polarity)
    assert free[-1] > 8.0 * free[0]
    assert entered_s(guarded, "guard", 1) < 5400.0
    off = guarded.mode_guard.values == 1
    assert not guarded.dipole_body.values[1:][off[1:] & off[:-1]].any()


def test_a_tripped_guard_lets_the_coils_try_again_twice():
    """After an hour and after four more; each attempt costs what a trip allows."""
    guarded = flown(DAMPING + GUARD.format("rate_growth_guard"), polarity="[-1, -1, 1]")
    off, rates = guarded.mode_guard.values == 1, rates_deg_s(guarded)
    t = guarded.time.values
    tripped_s, back_s = (t[np.flatnonzero(np.diff(off.astype(int)) == way) + 1] for way in (1, -1))
    assert len(tripped_s) == 3 and len(back_s) == 2 and off[-1]
    assert back_s - tripped_s[:2] == pytest.approx([3600.0, 4.0 * 3600.0], abs=20.0)
    assert rates[t < back_s[0]].max() < rates[0] + 4.0 and rates.max() < rates[0] + 12.0


@pytest.mark.parametrize("angle", range(0, 360, 30))
def test_the_guard_does_not_trip_on_sound_coils(angle):
    """Nor on nutation, by which the rate alone grows by up to a third."""
    result = flown(DAMPING + GUARD.format("rate_growth_guard"), angle=angle, revolutions=3)
    assert entered_s(result, "guard", 1) == np.inf
    assert rates_deg_s(result)[-1] < 1.0


@pytest.mark.parametrize("angle", range(0, 360, 60))
def test_the_last_guard_does_not_trip_on_sound_coils(angle):
    """Nor where only the field is left to show the rate."""
    gyro = '{ kind = "zeros", from_s = 100 }' if angle % 120 else ""
    result = flown(DAMPING + GUARD.format("spin_guard"), angle=angle, gyro=gyro, revolutions=3)
    assert entered_s(result, "guard", 2) == np.inf
    assert rates_deg_s(result)[-1] < 1.0
    assert entered_s(result, "guard", 1) < 3.0 * 5740.0


def test_the_last_guard_tries_coils_of_the_wrong_sign_less_and_less():
    """After one hour and after two more; each attempt costs what it allows."""
    guarded = flown(DAMPING + GUARD.format("spin_guard"), polarity="[-1, -1, 1]")
    off, rates = guarded.mode_guard.values == 2, rates_deg_s(guarded)
    t = guarded.time.values
    tripped_s, back_s = (t[np.flatnonzero(np.diff(off.astype(int)) == way) + 1] for way in (1, -1))
    assert len(back_s) >= 3 and not guarded.dipole_body.values[1:][off[1:] & off[:-1]].any()
    expected = [3600.0, 7200.0, 14400.0]
    assert back_s[:3] - tripped_s[:3] == pytest.approx(expected, abs=20.0)
    assert rates[t < back_s[0]].max() < rates[0] + 4.5
    assert rates.max() < rates[0] + 4.5 + 1.5 * len(back_s)


def test_growth_guard_misses_one_coil_of_the_wrong_sign():
    """The two others brake as much as it drives: the rate stays, and the guard sees nothing."""
    result = flown(DAMPING + GUARD.format("rate_growth_guard"), polarity="[1, -1, 1]")
    assert entered_s(result, "guard", 1) == np.inf
    assert 1.0 < rates_deg_s(result)[-1] < 6.0


def test_a_silent_magnetometer_leaves_the_last_dipole_on():
    silent = '{ kind = "silent", from_s = 1000 }'
    free = flown(DAMPING, magnetometer=silent)
    guarded = flown(DAMPING + GUARD.format("stale_magnetometer_guard"), magnetometer=silent)
    last = free.command_body.sel(time=1020.0).values
    assert last.any()
    assert (free.command_body.sel(time=slice(1020, None)).values == last).all()
    assert not guarded.command_body.sel(time=slice(1040, None)).values.any()
    assert float(free.coil_energy) > 10.0 * float(guarded.coil_energy)


def test_the_coils_work_again_once_the_magnetometer_does():
    gap = '{ kind = "silent", from_s = 1000, until_s = 2000 }'
    result = flown(DAMPING + GUARD.format("stale_magnetometer_guard"), magnetometer=gap)
    assert not result.command_body.sel(time=slice(1040, 2020)).values.any()
    assert rates_deg_s(result)[-1] < 1.0


def test_a_field_of_zeros_switches_the_coils_off():
    zeros = '{ kind = "zeros", from_s = 1000, until_s = 2000 }'
    result = flown(DAMPING + GUARD.format("zero_field_guard"), magnetometer=zeros)
    states = result.mode_guard
    assert not states.sel(time=slice(None, 1000)).values.any()
    assert states.sel(time=slice(1010, 2020)).values.all()
    assert not states.sel(time=slice(2040, None)).values.any()
    assert rates_deg_s(result)[-1] < 1.0


RESTING = """
[control.modes.regions.main.states.damping]
laws = ["damping"]
transitions = [{{ to = "resting", when = [{}], for_s = 60 }}]
[control.modes.regions.main.states.resting]
final = true
"""
SLOW = '{ signal = "rate_deg_s", below = 0.5 }'
IS_READ = '{ signal = "rate_deg_s", above = 0.001 }'


def test_a_gyro_of_zeros_ends_the_damping_too_early():
    """A rate of exactly zero is none: a second condition asks for some noise."""
    zeros = '{ kind = "zeros", from_s = 600 }'
    free = flown(RESTING.format(SLOW), gyro=zeros)
    guarded = flown(RESTING.format(f"{SLOW}, {IS_READ}"), gyro=zeros)
    assert entered_s(free, "main", 1) < 700.0
    assert rates_deg_s(free)[-1] > 2.0
    assert entered_s(guarded, "main", 1) == np.inf
    assert rates_deg_s(guarded)[-1] < 0.5
    sound = flown(RESTING.format(f"{SLOW}, {IS_READ}"))
    assert entered_s(sound, "main", 1) < np.inf


NEVER_HOLDS = """
[control.modes.regions.main.states.damping]
laws = ["damping"]
transitions = [
  {{ to = "resting", when = {{ signal = "rate_deg_s", below = 0.12 {} }}, for_s = 600 }},
]
[control.modes.regions.main.states.resting]
final = true
"""


def test_a_hold_time_without_hysteresis_never_ends():
    """Turning with the field, at 0.1 to 0.15 deg/s, the noisy rate is above 0.12 every minute: each
    time the ten minutes begin again. A way back of 0.3 lets them pass."""
    assert entered_s(flown(NEVER_HOLDS.format("")), "main", 1) == np.inf
    held = flown(NEVER_HOLDS.format(", back_above = 0.3"))
    assert entered_s(held, "main", 1) < np.inf


#: Regions for any satellite; those of Chibis-M's logic go together (`test_chibis_m`).
GUARDS = [name for name in presets("region") if not name.startswith("chibis_m")]


@pytest.mark.parametrize("name", GUARDS)
def test_the_guards_themselves_are_sound(name):
    text = CHIBIS_M.format(seed=1, polarity=RIGHT, magnetometer="", gyro="", angle=0, revolutions=1)
    scenario = scenario_from_text(text + DAMPING + GUARD.format(name))
    assert [found for found in findings(scenario.control.modes) if found.is_fault] == []
