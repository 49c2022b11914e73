"""Fault campaigns: which faults there are, when they strike, the rule of the verdict, flights."""

import math
from pathlib import Path

import numpy as np
import pytest

from torquer import load_scenario, simulate
from torquer.analysis.goals import find_goals
from torquer.analysis.notes.fault_notes import unnoticed_faults
from torquer.campaign.faults.contents import (
    as_plain,
    counts_in_words,
    fault_dataset,
    fault_table,
)
from torquer.campaign.faults.fly import choose_faults, fly_faults
from torquer.campaign.faults.kinds import find_faults
from torquer.campaign.faults.pairs import fly_pairs
from torquer.campaign.faults.strikes import strikes_in, without_guards
from torquer.campaign.faults.verdict import (
    DEGRADED,
    LOST,
    SAFE,
    VERDICTS,
    Flown,
    first_notice,
    judge,
    judge_flight,
    keep_flight,
)
from torquer.compile import engine
from torquer.scenario.change import value_at, with_values

EXAMPLES = Path(__file__).parents[2] / "examples"
needs_jit = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


#: A safe mode whose law, guards and conditions share one gyro: many of its faults are lost.
OF_ONE_GYRO = Path(__file__).parents[1] / "data/safe_mode_of_one_gyro.toml"


@pytest.fixture(scope="module")
def safe_mode():
    return load_scenario(OF_ONE_GYRO)


@pytest.mark.parametrize(
    ("example", "devices"),
    [
        ("safe_mode", "magnetometer, gyro, Sun sensors, coil 0, coil 1, coil 2, computer"),
        ("wheels_in_flight", "magnetometer, gyro, attitude sensor, coil 0, coil 1, coil 2, "
         "wheel 0, wheel 1, wheel 3, computer"),
    ],
)  # fmt: skip
def test_every_device_that_may_fail_fails_in_a_valid_scenario(example, devices):
    scenario = load_scenario(EXAMPLES / f"{example}.toml")
    faults = find_faults(scenario)
    assert ", ".join(dict.fromkeys(fault.device for fault in faults)) == devices
    assert len({fault.name for fault in faults}) == len(faults)
    for fault in faults:
        before = value_at(scenario, fault.key)
        *kept, added = value_at(fault.strikes(scenario, 600.0), fault.key)
        assert len(kept) == len(before)
        assert added[fault.time_key] == 600.0
        assert added.items() >= {k: _plain(v) for k, v in fault.failure.items()}.items()


def _plain(value):
    return tuple(value) if isinstance(value, list) else value


def test_a_fault_is_added_to_those_of_the_scenario(safe_mode):
    own = {"kind": "zeros", "from_s": 50.0, "until_s": 60.0}
    scenario = safe_mode.replace("spacecraft.gyro.failures", [own])
    (stuck,) = choose_faults(find_faults(scenario), ["GYRO stuck"])
    struck = stuck.strikes(scenario, 90.0).spacecraft.gyro.failures
    assert [(each.kind, each.from_s, each.until_s) for each in struck] == [
        ("zeros", 50.0, 60.0), ("stuck", 90.0, None),
    ]  # fmt: skip


def test_guards_are_the_regions_that_only_watch(safe_mode):
    assert safe_mode.control.modes.guards() == ["growth", "magnetometer", "field", "sun"]
    assert load_scenario(EXAMPLES / "chibis_m_day.toml").control.modes.guards() == [
        "gyro",
        "sun",
        "coil_x",
        "coil_y",
        "coil_z",
        "spin",
    ]
    free = without_guards(safe_mode).control.modes
    assert free.regions["main"] == safe_mode.control.modes.regions["main"]
    for name in safe_mode.control.modes.guards():
        region = free.regions[name]
        assert region.states.keys() == safe_mode.control.modes.regions[name].states.keys()
        assert not [*region.all_transitions()]
    plain = load_scenario(EXAMPLES / "chibis_m_detumble.toml")
    assert without_guards(plain) is plain


def flight(rate=1.0, angle=10.0, energy=1e3, ended="", **entered):
    """A flight; `entered`: when each state was entered."""
    times = {name.replace("_in_", "."): np.array(at, float) for name, at in entered.items()}
    last = {name: float(at[-1]) if at.size else -math.inf for name, at in times.items()}
    return Flown(ended, rate, (angle,), energy, last, times)


@pytest.mark.parametrize(
    ("one", "verdict", "why"),
    [
        (flight(), SAFE, ""),
        (flight(rate=2.0, angle=29.9, energy=3e3), SAFE, ""),
        (flight(rate=2.01), LOST, "rate up to 2.01 deg/s"),
        (flight(rate=math.nan), LOST, "rate up to nan deg/s"),
        (flight(angle=30.0), DEGRADED, "angle to the Sun up to 30 deg"),
        (flight(energy=3.1e3), DEGRADED, "3.1 times the energy"),
        (flight(ended="stopped"), LOST, "stopped"),
    ],
)
def test_the_rule(safe_mode, one, verdict, why):
    assert judge(one, flight(), find_goals(safe_mode)) == (verdict, why)


def test_a_satellite_that_is_to_spin_may_do_so(safe_mode):
    goals = find_goals(safe_mode)
    assert judge(flight(rate=5.9), flight(rate=3.0), goals)[0] == SAFE
    assert judge(flight(rate=6.1), flight(rate=3.0), goals)[0] == LOST


@pytest.mark.parametrize(
    ("fault", "nominal", "expected"),
    [
        (flight(a_in_b=[150.0]), flight(a_in_b=[]), (50.0, "a.b")),
        (flight(a_in_b=[20.0, 150.0, 400.0]), flight(a_in_b=[20.0]), (50.0, "a.b")),
        (flight(a_in_b=[20.0]), flight(a_in_b=[20.0]), (math.inf, "")),
        (flight(a_in_b=[150.0]), flight(a_in_b=[300.0]), (math.inf, "")),
        (flight(a_in_b=[150.0], c_in_d=[120.0]), flight(a_in_b=[], c_in_d=[0.0]), (20.0, "c.d")),
    ],
)
def test_noticed_is_what_only_the_fault_leads_to(fault, nominal, expected):
    assert first_notice(fault, nominal, 100.0) == expected


@pytest.fixture(scope="module")
def campaign(safe_mode):
    names = ["gyro zeros", "magnetometer silent", "magnetometer stuck", "coil 2 reversed"]
    return fly_faults(safe_mode, names, [36000.0])


@needs_jit
def test_the_faults_that_broke_the_safe_mode_are_found(campaign):
    """The rates that an audit of this safe mode measured."""
    found = {(row.fault.name, row.guarded): row.outcome for row in campaign.rows}
    zeros = found["gyro zeros", True]
    assert (zeros.verdict, zeros.noticed_by) == (LOST, "")
    assert zeros.rate_deg_s == pytest.approx(97.0, abs=0.5)
    silent = found["magnetometer silent", True]
    assert (silent.verdict, silent.noticed_by) == (SAFE, "magnetometer.stale")
    assert 29.0 <= silent.noticed_after_s <= 31.0
    assert found["magnetometer silent", False].verdict == DEGRADED
    assert found["magnetometer silent", False].noticed_by == ""
    assert found["magnetometer stuck", True].noticed_by == ""
    assert campaign.worst().fault.name == "gyro zeros"
    assert campaign.verdict == (SAFE, "")


@needs_jit
def test_a_row_is_its_scenario_flown(campaign):
    for row in campaign.rows[2:5]:
        one = keep_flight(simulate(campaign.scenario_of(row)))
        assert one.rate_deg_s == row.outcome.rate_deg_s
        assert one.energy_j == row.outcome.energy_j


@needs_jit
def test_workers_change_nothing(safe_mode, campaign):
    again = fly_faults(safe_mode, ["gyro zeros", "coil 2 reversed"], [36000.0], workers=1)
    known = {(row.fault.name, row.guarded): row.outcome for row in campaign.rows}
    assert all(known[row.fault.name, row.guarded] == row.outcome for row in again.rows)
    assert len(again.rows) == 4


@needs_jit
def test_faults_strike_in_every_mode(safe_mode):
    nominal = simulate(safe_mode)
    strikes, t = strikes_in(nominal), nominal["time"].values
    assert [strike.mode for strike in strikes] == ["detumbling", "sun_pointing"]
    for number, strike in enumerate(strikes):
        stay = np.flatnonzero(nominal["mode_main"].values == number)
        seen = nominal["sun_measured"].values[stay].any(axis=1)
        off_s = np.abs(t[stay] - t[stay].mean())
        (there,) = np.flatnonzero(t[stay] == strike.at_s)
        assert seen[there] and off_s[there] <= off_s[seen].min() + 30.0
    always = {"control.modes": None, "simulation.duration_s": 600.0}
    always["control.laws"] = {"damping": safe_mode.control.laws["damping"]}
    (strike,) = strikes_in(simulate(with_values(safe_mode, always)))
    assert strike.mode == "" and 0.0 < strike.at_s < 600.0


@needs_jit
def test_no_flight_contradicts_what_cannot_be_noticed(safe_mode):
    """The argument without flights: of what no condition can notice, none is noticed in flight."""
    assert unnoticed_faults(safe_mode).at_all == ["gyro silent, stuck, zeros"]
    names = ["gyro silent", "gyro stuck", "gyro zeros"]
    flights = fly_faults(safe_mode, names, [3000.0, 7000.0, 40000.0])
    assert [row.outcome.noticed_by for row in flights.rows] == [""] * 18


@needs_jit
def test_contents(campaign):
    data = fault_dataset(campaign)
    assert dict(data.sizes) == {"fault": 4, "strike": 1, "guards": 2}
    plain = as_plain(campaign)
    for row, flat in zip(campaign.rows, plain["flights"], strict=True):
        side = "with" if row.guarded else "without"
        here = data.sel(fault=row.fault.name, guards=side).isel(strike=0)
        assert VERDICTS[int(here["verdict"])] == row.outcome.verdict == flat["verdict"]
        assert float(here["rate_deg_s"]) == row.outcome.rate_deg_s == flat["rate_deg_s"]
        assert float(here["goal_0"]) == row.outcome.goals[0] == flat["goals"][0]
        assert str(here["noticed_by"].values) == row.outcome.noticed_by
    assert sum(plain["counts"]["with_guards"].values()) == 4
    head, rows = fault_table(campaign)
    assert len(rows) == 4 and {len(row) for row in rows} == {len(head)}


@needs_jit
def test_an_outcome_needs_no_goal(safe_mode):
    nominal = flight()._replace(goals=())
    outcome = judge_flight(flight(rate=9.0)._replace(goals=()), nominal, [], 10.0)
    assert (outcome.verdict, outcome.goals) == (LOST, ())


def test_messages(safe_mode):
    with pytest.raises(ValueError, match="workers: must be 1 or more; received 0"):
        fly_faults(safe_mode, workers=0)
    with pytest.raises(ValueError, match=r"only: must be part of the name of a fault, .* gyro, "):
        fly_faults(safe_mode, ["trombone"])


@needs_jit
def test_messages_after_the_flight_without_a_fault(safe_mode):
    with pytest.raises(ValueError, match=r"at_h: must be a time before the end of the flights, 24"):
        fly_faults(safe_mode, at_s=[9e4])
    steps = {"duration_s": 86400.0, "integrator": "rk4", "step_s": 1.0}
    broken = safe_mode.replace("simulation", steps)
    broken = broken.replace("disturbance", {"constant_torque_n_m": [1.0, 0.0, 0.0]})  # spun up
    with pytest.raises(ValueError, match="scenario: must fly to its end without a fault; received"):
        fly_faults(broken)


#: A tumbling body that fixed steps of RK4 damp by themselves.
BRAKED = {
    "spacecraft.body.inertia_kg_m2": [0.02, 0.02, 0.004], "spacecraft.coils.limit_a_m2": 0.2,
    "initial.rate_deg_s": [2.0, 0.0, 40.0],
    "control": {"law": {"kind": "bdot", "gain_a_m2_s_per_t": 2e4}, "sample_s": 1.0},
    "simulation": {"duration_s": 1800.0, "step_s": 1.0, "record_s": 10.0},
}  # fmt: skip


@needs_jit
def test_a_condition_ends_no_flight_with_a_fault(make):
    """What comes after it would be judged by nobody, and strikes after it would be none."""
    ends = {"simulation.end_when": {"signal": "rate_deg_s", "below": 50.0}}
    whole, same = (
        fly_faults(make({**BRAKED, **more}), ["coil 0"], [1200.0], workers=1) for more in ({}, ends)
    )
    assert same.nominal.ended == "" and same.rows == whole.rows
    assert same.scenario.simulation.end_when is None
    two, pairs = (
        fly_pairs(make({**BRAKED, **more}), 2, ["coil"], workers=1).rows for more in ({}, ends)
    )
    assert two == pairs


@needs_jit
def test_what_steps_did_is_told_beside_the_verdicts(make):
    found = fly_faults(make(BRAKED), ["coil 0 dead"], [600.0], workers=1)
    note = "the steps of RK4 damped up to "
    assert found.nominal.steps.startswith(note)
    lines = counts_in_words(found)
    assert lines[-2].startswith(f"Without a fault {note}")
    assert lines[-1].startswith(f"In 1 of 1 flights with faults, one of them: {note}")
    assert as_plain(found)["flights"][0]["steps"].startswith(note)
    assert as_plain(found)["without_fault"]["steps"] == found.nominal.steps
    fine = fly_faults(
        make({**BRAKED, "simulation.step_s": 0.1}), ["coil 0 dead"], [600.0], workers=1
    )
    assert fine.nominal.steps == "" and len(counts_in_words(fine)) == len(lines) - 2
