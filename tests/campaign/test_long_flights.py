"""Long flights of members: outcomes taken while they fly, by parts, in bounded memory."""

import numpy as np
import pytest
from memory_peak import peak_of
from tip_off import SCENARIO, campaign

from torquer.campaign import alone as alone_, along
from torquer.campaign.fleet import Fleet
from torquer.compile import engine
from torquer.scenario.change import with_values
from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes import group
from torquer.simulation.setup import size

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")

WAYS = {
    "at_end": True,
    "first_below": 1.5,
    "settles_below": 1.5,
    "part_below": 1.5,
    "greatest_after_s": 95.0,
    "mean_after_s": 95.0,
}
OUTCOMES = {
    **{key: {"signal": "rate_deg_s", "what": {key: each}} for key, each in WAYS.items()},
    **{
        f"{to}_deg": {"signal": {"axis": [0, 0, 1], "to": to}, "what": {"mean_after_s": 100.0}}
        for to in ("sun", "nadir", "field")
    },
    "orbital": {"signal": "rate_orbital_deg_s", "what": {"mean_after_s": 0.0}},
    "energy_j": {"signal": "coil_energy_j"},
}
MODES = """
control.laws.damping = { kind = "bdot", gain_a_m2_s_per_t = 1e5 }
control.laws.hold = { kind = "three_axis", rate_gain_n_m_s_per_t2 = 2e5, \
angle_gain_n_m_per_t2 = 50 }
[control.modes.states]
fast.laws = ["damping"]
fast.transitions = [{ to = "slow", when = { signal = "rate_deg_s", below = 2.0 } }]
slow.laws = ["hold"]
slow.transitions = [{ to = "fast", when = { signal = "rate_deg_s", above = 2.2 } }]
"""
LAW = '{ law = { kind = "bdot_rate", gain_a_m2_s_per_t = 1e5 }, sample_s = 1.0 }'


def scenario_of(kind: str):
    text = SCENARIO
    if kind == "modes":
        text = SCENARIO.replace(f"control = {LAW}", "control.sample_s = 1.0") + MODES
    scenario = scenario_from_text(text)
    if kind == "tenths":  # of a second: records at times that are no whole numbers
        return with_values(scenario, {"simulation.step_s": 0.1, "simulation.record_s": 0.3,
                                      "simulation.duration_s": 120.0,
                                      "control.sample_s": 0.3})  # fmt: skip
    return scenario


def fly(scenario, made, alone: bool):
    flying = Fleet(scenario, made)
    assert flying.why_not_in_lanes == "" or alone
    if alone:
        flying._lanes = None
    return flying.fly(np.arange(made.runs))


def assert_same(one, other):
    for kind in ("outcomes", "series"):
        for name, values in getattr(one, kind).items():
            assert np.array_equal(values, getattr(other, kind)[name], equal_nan=True), name


@pytest.mark.parametrize("kind", ["modes", "rk4", "tenths"])
def test_members_have_the_same_bits_in_whatever_parts_they_are_taken(kind, monkeypatch):
    """In lanes and alone; with parts, pieces and what is kept of them much shorter."""
    scenario = scenario_of(kind)
    outcomes = OUTCOMES
    if kind == "modes":
        error = {key: {"signal": "attitude_error_deg", "what": {key: WAYS[key]}} for key in WAYS}
        outcomes = OUTCOMES | {f"error_{key}": each for key, each in error.items()}
    made = campaign(scenario, runs=20, outcomes=outcomes, success={})
    ways = (True,) if kind == "modes" else (False, True)
    for rows in (1000, 10):  # of a piece, on which bits may depend: its tables are its own
        with monkeypatch.context() as patch:
            patch.setattr(size, "_PIECE_ROWS", rows)
            whole = [fly(scenario, made, alone) for alone in ways]
            assert np.isfinite(whole[0].outcomes["mean_after_s"]).all()
            assert_same(whole[0], whole[-1])
            patch.setattr(group, "RECORDS", 7)
            patch.setattr(alone_, "RECORDS", 7)
            patch.setattr(along, "PARTS", 2)
            patch.setattr(group, "PIECES", 2)
            for alone, expected in zip(ways, whole, strict=True):
                assert_same(fly(scenario, made, alone), expected)


def test_the_last_record_may_come_before_the_end(monkeypatch):
    scenario = scenario_of("rk4").replace("simulation.duration_s", 890.0)
    made = campaign(scenario, runs=3, outcomes=OUTCOMES, success={})
    whole = fly(scenario, made, True)
    for records in (2048, 7, 45):
        monkeypatch.setattr(group, "RECORDS", records)
        assert_same(fly(scenario, made, False), whole)


@pytest.mark.parametrize("alone", [False, True])
def test_memory_does_not_grow_with_the_length(alone, monkeypatch):
    """Of four times as many records; their motion alone would be 1.3 MB more a batch."""
    monkeypatch.setattr(group, "RECORDS", 64)
    monkeypatch.setattr(alone_, "RECORDS", 64)
    monkeypatch.setattr(size, "_PIECE_ROWS", 128)
    monkeypatch.setattr(group, "PIECES", 2)
    monkeypatch.setattr(along, "FOUND_AT_ONCE", 64)
    monkeypatch.setattr(along, "PARTS", 4)
    peaks = []
    for duration_s in (10240.0, 10240.0, 40960.0):  # the first one compiles
        scenario = with_values(scenario_of("rk4"), {"simulation.duration_s": duration_s})
        made = campaign(scenario, runs=2 if alone else 16, outcomes=OUTCOMES, success={})
        flying = Fleet(scenario, made)
        if alone:
            flying._lanes = None
        peaks.append(peak_of(lambda: flying.fly(np.arange(made.runs))))  # noqa: B023
    assert peaks[2] < peaks[1] + 1.5e5, peaks
