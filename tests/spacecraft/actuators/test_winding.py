"""Coils given by turns, area and current: limits and powers follow, and never contradict."""

import math

import numpy as np
import pytest

import torquer
from torquer import ScenarioError, simulate
from torquer.analysis.summary import summarise
from torquer.compile import engine
from torquer.design.coil_design import coil
from torquer.design.requests import CoilRequest
from torquer.simulation.results.restore import scenario_in
from torquer.spacecraft.actuators.coils import Coils

in_flight = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
WINDING = {"turns": 400, "area_m2": 0.006, "current_a": 0.1, "resistance_ohm": 30.0}
MORE = {"turns": 50, "area_m2": 0.02, "current_a": 0.3, "core_gain": 4.0, "resistance_ohm": 2.0}


def test_limit_and_power_follow():
    coils = Coils(windings=WINDING)
    assert coils.limits_a_m2() == pytest.approx([0.24] * 3)  # N I A
    assert coils.powers_w() == pytest.approx([0.3] * 3)  # I^2 R
    each = Coils(windings=[WINDING, MORE, WINDING])
    assert each.limits_a_m2() == pytest.approx([0.24, 1.2, 0.24])
    assert each.powers_w() == pytest.approx([0.3, 0.18, 0.3])
    assert each.power_w() == pytest.approx(0.26)
    bare = Coils(windings={k: v for k, v in WINDING.items() if k != "resistance_ohm"})
    assert bare.powers_w() is None and bare.power_w() is None
    stated = Coils(windings=bare.windings, power_at_limit_w=0.5)
    assert stated.powers_w() == pytest.approx([0.5] * 3)


def test_kernels_get_the_same_as_of_the_limits_themselves():
    wound = Coils(windings=[WINDING, MORE, WINDING]).pack().rows
    for k, (limit, power) in enumerate([(0.24, 0.3), (1.2, 0.18), (0.24, 0.3)]):
        plain = Coils(limit_a_m2=limit, power_at_limit_w=power).pack().rows[k]
        assert wound[k]["limit_a_m2"] == pytest.approx(plain["limit_a_m2"], rel=1e-15)
        assert wound[k]["power"] == pytest.approx(plain["power"], rel=1e-14)


@in_flight
def test_a_change_of_the_winding_changes_what_follows_after_storing_too(make, tmp_path):
    changes = {"spacecraft.coils": {"windings": WINDING}}
    law = {"control.law": {"kind": "bdot", "gain_a_m2_s_per_t": 1e6}}
    result = simulate(make(changes | law))
    torquer.save(result, tmp_path / "run.nc")
    stored = torquer.load(tmp_path / "run.nc")
    scenario = scenario_in(stored)
    more = scenario.replace("spacecraft.coils.windings.turns", 800)
    assert scenario.spacecraft.coils.limits_a_m2() == pytest.approx([0.24] * 3)
    assert more.spacecraft.coils.limits_a_m2() == pytest.approx([0.48] * 3)
    assert float(result["peak_coil_dipole"]) == pytest.approx(0.24)
    summary = summarise(stored)
    assert summary["coil_energy_j"] == float(result["coil_energy"])
    assert summary["coil_full_power_s"] == pytest.approx(float(result["coil_energy"]) / 0.3)


def test_the_design_of_a_coil_gives_its_winding():
    """The windings of an answer are coils of the dipole asked for and of the power stated."""
    answer = coil(CoilRequest(dipole_a_m2=0.3, diameter_m=0.1, mass_kg=0.1))
    for row, winding in zip(answer.coils, answer.windings(), strict=True):
        coils = Coils(windings=winding)
        assert winding.area_m2 == pytest.approx(math.pi * 0.1**2 / 4.0)
        assert coils.limits_a_m2() == pytest.approx([0.3] * 3)
        assert coils.powers_w() == pytest.approx([row.power_w] * 3)
    assert len(answer.coils) > 5


@pytest.mark.parametrize(
    ("coils", "message"),
    [
        ({}, "limit_a_m2: must be given without windings; received none"),
        ({"limit_a_m2": 1.0, "windings": WINDING},
         "limit_a_m2: must be left out with windings; received both"),
        ({"windings": WINDING, "power_at_limit_w": 1.0},
         "power_at_limit_w: must be left out with windings that have resistance_ohm; received 1"),
        ({"windings": [WINDING, WINDING]},
         "windings: must be one table or one per coil (3 axes); received 2 tables"),
        ({"windings": [WINDING, {**WINDING, "resistance_ohm": None}, WINDING]},
         "windings[1].resistance_ohm: must be given for all coils or for none; received none"),
        ({"windings": {**WINDING, "turns": 0}}, "windings.turns: must be"),
        ({"windings": {**WINDING, "area_m2": 1e12, "turns": 10**9}}, "windings.current_a: must "
         "give a coil of at most 1e+09 A m^2; received 0.1, which gives 1e+20 A m^2"),
    ],
)  # fmt: skip
def test_windings_that_do_not_fit_are_refused(make, coils, message):
    with pytest.raises(ScenarioError) as found:
        make({"spacecraft.coils": coils})
    assert f"spacecraft.coils.{message}" in str(found.value)


def test_notes_know_of_the_limit_that_follows(make):
    from torquer.analysis.notes.notes import write_notes

    residual = {"residual_dipole_a_m2": [0.0, 0.0, 0.5]}
    notes = write_notes(make({"spacecraft.coils": {"windings": WINDING} | residual}))
    assert any("exceeds the 0.24 A m^2 of a coil" in note for note in notes)
    assert np.isfinite(Coils(windings=MORE).limits_a_m2()).all()
