"""What a user's law knows of the satellite: its inertia and the limits of its coils."""

import numpy as np
import pytest
from tip_off import SCENARIO, campaign

import torquer
from torquer.campaign.fleet import Fleet
from torquer.campaign.sampling import member_scenario
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text
from torquer.simulation.results.restore import scenario_in
from torquer.simulation.setup.prepare import make_blocks
from torquer.simulation.setup.run import prepare

LAW = """
import math

import torquer

@torquer.law(parameters={"gain": 50.0}, satellite=("inertia_kg_m2", "coil_limits_a_m2"))
def braking(inputs, parameters, memory):
    x, y, z = inputs.omega_body_rad_s
    j, most = parameters.inertia_kg_m2, parameters.coil_limits_a_m2
    h = (
        j[0][0] * x + j[0][1] * y + j[0][2] * z,
        j[1][0] * x + j[1][1] * y + j[1][2] * z,
        j[2][0] * x + j[2][1] * y + j[2][2] * z,
    )
    bx, by, bz = inputs.b_body_t
    k = parameters.gain / math.sqrt(bx * bx + by * by + bz * bz)
    m = (k * (h[1] * bz - h[2] * by), k * (h[2] * bx - h[0] * bz), k * (h[0] * by - h[1] * bx))
    return (
        max(-most[0], min(most[0], m[0])),
        max(-most[1], min(most[1], m[1])),
        max(-most[2], min(most[2], m[2])),
    )
"""
J = [[1.0, 0.1, 0.0], [0.1, 1.3, 0.0], [0.0, 0.0, 1.7]]


@pytest.fixture
def own(tmp_path):
    (tmp_path / "law.py").write_text(LAW)
    scenario = scenario_from_text(SCENARIO).replace("spacecraft.body.inertia_kg_m2", J)
    law = {"kind": "user", "file": str(tmp_path / "law.py")}
    return scenario.replace("control.law", law)


def parameters(scenario):
    (law,) = make_blocks(scenario).laws.values()
    return law.values()


def test_they_follow_from_the_scenario_unless_it_gives_them(own):
    found = parameters(own.replace("spacecraft.coils.limit_a_m2", [3.0, 2.0, 1.0]))
    assert np.array_equal(found["inertia_kg_m2"], J) and found["gain"] == 50.0
    assert found["coil_limits_a_m2"] == pytest.approx((3.0, 2.0, 1.0))
    believed = np.diag([2.0, 2.0, 3.0]).tolist()
    other = own.replace("control.law.parameters", {"inertia_kg_m2": believed, "gain": 7.0})
    found = parameters(other)
    assert np.array_equal(found["inertia_kg_m2"], believed) and found["gain"] == 7.0
    assert found["coil_limits_a_m2"] == pytest.approx((3.0, 3.0, 3.0))


def test_the_reach_along_an_axis_is_that_of_all_coils_together(own):
    """Two coils at 45 deg to x and y, one along z: along x both of them work."""
    root = 0.5**0.5
    axes = [[root, root, 0.0], [root, -root, 0.0], [0.0, 0.0, 1.0]]
    coils = {"axes": axes, "limit_a_m2": [3.0, 3.0, 2.0]}
    found = parameters(own.replace("spacecraft.coils", coils))["coil_limits_a_m2"]
    assert found == pytest.approx((3.0 / root, 3.0 / root, 2.0))


def test_a_law_given_in_python_has_them_too(own):
    @torquer.law(satellite=("inertia_kg_m2",))
    def scaled(inputs, parameters, memory):
        return (parameters.inertia_kg_m2[0][0], 0.0, 0.0)

    run = prepare(own, law=scaled)
    (law,) = run.blocks.laws.values()
    assert np.array_equal(law.values()["inertia_kg_m2"], J)
    assert np.array_equal(run.scenario.control.law.parameters["inertia_kg_m2"], J)


@pytest.mark.parametrize("name", ["mass_kg", "gain"])
def test_other_names_are_refused(name):
    line = rf"^law mine: satellite must be of inertia_kg_m2, coil_limits.*received '{name}'$"
    with pytest.raises(ValueError, match=line):

        @torquer.law(parameters={"gain": 1.0}, satellite=(name,))
        def mine(inputs, parameters, memory):
            return (0.0, 0.0, 0.0)


def test_without_coils_there_are_no_limits_to_know(own, tmp_path):
    (tmp_path / "law.py").write_text(LAW.replace("def braking", "def wheels").replace(
        "coil_limits_a_m2\"))", "coil_limits_a_m2\"), answers=\"torque\")"))  # fmt: skip
    bare = own.model_copy(update={"spacecraft": own.spacecraft.model_copy(update={"coils": None})})
    with pytest.raises(ValueError, match=r"^spacecraft\.coils: must be given for a law that asks"):
        make_blocks(bare)


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_each_member_knows_its_own_satellite(own):
    """Side by side, as alone, and from the scenario of its result."""
    inertia = {"spacecraft.body.inertia_kg_m2": {"relative": {"uniform": [0.5, 1.5]}}}
    made = campaign(own, runs=20, vary=inertia)
    flying = Fleet(own, made)
    assert flying.why_not_in_lanes == ""
    flown = flying.fly(np.arange(20))
    assert len(np.unique(flown.outcomes["coil_energy_j"])) == 20
    for member in (0, 13):
        alone = torquer.simulate(member_scenario(own, made, member))
        assert float(alone["coil_energy"]) == flown.outcomes["coil_energy_j"][member]
    again = torquer.simulate(scenario_in(alone))
    assert np.array_equal(again["omega_body"].values, alone["omega_body"].values)
