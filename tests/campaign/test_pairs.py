"""Pairs of faults: how they are drawn, what becomes of them, the pairs that once spun up."""

import json
from pathlib import Path

import numpy as np
import pytest

from torquer import load_scenario, simulate
from torquer.campaign.faults.fly import simulate_or_stop
from torquer.campaign.faults.kinds import find_faults
from torquer.campaign.faults.pair_contents import pair_table, pairs_as_plain
from torquer.campaign.faults.pairs import draw_pair, fly_pairs
from torquer.campaign.faults.verdict import LOST
from torquer.compile import engine
from torquer.flight.software.faults import FaultsFile, with_device_faults
from torquer.scenario.change import with_values

ROOT = Path(__file__).parents[2]
OF_ONE_GYRO = ROOT / "tests/data/safe_mode_of_one_gyro.toml"
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.fixture(scope="module")
def safe_mode():
    return load_scenario(OF_ONE_GYRO)


def struck(example, *faults):
    """An example with faults: name and time of each."""
    tables = [{"fault": name, "at_s": at_s} for name, at_s in faults]
    scenario = load_scenario(ROOT / f"examples/{example}.toml")
    return with_device_faults(scenario, FaultsFile.model_validate({"faults": tables}))


def last_rate_deg_s(result):
    """Mean rate of the last 200 records."""
    omega = result.omega_body.values[-200:]
    return float(np.degrees(np.linalg.norm(omega, axis=1)).mean())


def test_pairs_are_drawn_one_by_one(safe_mode):
    faults = find_faults(safe_mode)
    pairs = [draw_pair(safe_mode, faults, number) for number in range(400)]
    assert draw_pair(safe_mode, faults, 7) == pairs[7]
    assert all(first != second for first, second in (pair.faults for pair in pairs))
    at_once = [pair.at_s[0] == pair.at_s[1] for pair in pairs]
    assert 0.42 < np.mean(at_once) < 0.58
    first, second = np.array([pair.at_s for pair in pairs]).T
    length_s = safe_mode.length_s
    assert first.max() < 0.5 * length_s and (second - first).max() < 0.25 * length_s
    assert (second >= first).all() and first.min() < 0.05 * length_s
    other = with_values(safe_mode, {"seed": safe_mode.seed + 1})
    assert [draw_pair(other, faults, n).faults for n in range(9)] != [p.faults for p in pairs[:9]]


def test_times_of_the_first_fault_may_be_given(safe_mode):
    faults, given = find_faults(safe_mode), (600.0, 7200.0)
    pairs = [draw_pair(safe_mode, faults, number, given) for number in range(50)]
    assert {pair.at_s[0] for pair in pairs} == {*given}


@pytest.fixture(scope="module")
def flown(safe_mode):
    return fly_pairs(safe_mode, 6, ["gyro", "coil 0"], workers=2)


@needs_jit
def test_workers_and_number_change_nothing(safe_mode, flown):
    again = fly_pairs(safe_mode, 3, ["gyro", "coil 0"], workers=1)
    assert again.rows == flown.rows[:3]


@needs_jit
def test_the_worst_is_flown_again_by_scenario_and_by_faults(safe_mode, flown):
    worst = flown.worst()
    file = FaultsFile.model_validate(worst.pair.tables())
    for scenario in (flown.scenario_of(worst), with_device_faults(safe_mode, file)):
        t = (result := simulate_or_stop(scenario)).time.values
        tail = result.omega_body.values[t >= t[-1] - scenario.orbit.period_s]
        rate = float(np.degrees(np.linalg.norm(tail, axis=1)).max())
        assert rate == worst.outcome.rate_deg_s


@needs_jit
def test_contents_of_pairs(flown):
    plain, (head, rows) = pairs_as_plain(flown), pair_table(flown)
    assert json.loads(json.dumps(plain))["pairs"] == 6 == len(plain["flights"])
    counts = plain["counts"]
    assert counts["safe"] + counts["degraded"] + counts["lost"] == 6
    assert len(rows) == counts["lost"] > 0 and {len(row) for row in rows} == {len(head)}
    lost = [flight for flight in plain["flights"] if flight["verdict"] == LOST]
    assert counts["lost_unnoticed"] == sum(not flight["coils_off_by"] for flight in lost)
    assert [row[0] for row in rows] == [str(flight["number"]) for flight in lost]


def test_messages(safe_mode):
    with pytest.raises(ValueError, match="pairs: must be 1 or more; received 0"):
        fly_pairs(safe_mode, 0)
    with pytest.raises(ValueError, match="only: must leave two faults or more for pairs; received"):
        fly_pairs(safe_mode, 3, ["gyro zeros"])


#: Pairs whose coils spun the satellite up, unnoticed by all guards but the last one.
SPUN_UP = [
    ("chibis_m_day", ("Sun sensors reversed", 25021.0), ("magnetometer zeros", 25021.0)),
    ("chibis_m_flight", ("magnetometer reversed y", 16000.0), ("Sun sensors reversed", 17500.0)),
    ("chibis_m_flight", ("magnetometer zeros", 10064.0), ("Sun sensors reversed", 10064.0)),
    ("safe_mode", ("magnetometer bias y", 4919.0), ("Sun sensors reversed x", 4919.0)),
    ("safe_mode", ("magnetometer not a number", 23252.0), ("Sun sensors reversed", 23252.0)),
]


@needs_jit
@pytest.mark.slow
@pytest.mark.parametrize("case", SPUN_UP, ids=lambda case: f"{case[0]}, {case[1][0]}")
def test_the_last_guard_switches_the_coils_off(case):
    scenario = struck(*case)
    idle = {"states": {"idle": {"final": True}}}
    without = with_values(scenario, {"control.modes.regions.spin": idle})
    guarded, free = simulate(scenario), simulate(without)
    states = guarded.mode_spin.attrs["flag_meanings"].split()
    off = guarded.mode_spin.values == states.index("coils_off")
    assert last_rate_deg_s(free) > 10.0
    assert off.any() and last_rate_deg_s(guarded) < 5.5
    assert not guarded.command_body.values[1:][off[1:] & off[:-1]].any()
    retried = np.diff(off.astype(int)) == -1
    assert retried.any()


@needs_jit
@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "first", "second"),
    [
        ("chibis_m_flight", "magnetometer silent", "Sun sensors not a number"),
        ("safe_mode", "gyro silent", "magnetometer not a number"),
        ("safe_mode", "magnetometer not a number", "gyro not a number"),
        ("safe_mode", "magnetometer silent", "Sun sensors not a number"),
    ],
)
def test_no_number_ends_no_flight(example, first, second):
    """Not even where the sensor is gone by which it would be found out."""
    result = simulate(struck(example, (first, 16000.0), (second, 17500.0)))
    assert np.isfinite(result.command_body.values).all()
    assert last_rate_deg_s(result) < 2.0


@needs_jit
@pytest.mark.slow
def test_a_rotor_that_hangs_at_its_limit_ends_no_flight():
    """The body turns it away from its greatest speed as fast as its motor drives it there."""
    scenario = struck("chibis_m_day", ("Sun sensors bias z", 1353.0), ("coil 2 stuck on", 1353.0))
    result = simulate(with_values(scenario, {"simulation.duration_s": 41000.0}))
    assert result.attrs["how_it_ended"] == "complete"
    limit = scenario.spacecraft.wheels.speed_limit_rad_s
    assert np.abs(result.wheel_speed.values).max() <= limit * (1.0 + 1e-9)
