"""Members with a law or an estimator of a user's file fly together, whatever numbers vary."""

import numpy as np
import pytest
from tip_off import SCENARIO, campaign

import torquer
from torquer.campaign import fleet
from torquer.campaign.sampling import member_scenario
from torquer.compile import engine
from torquer.computer.blocks.user import load_law
from torquer.scenario.load import scenario_from_text
from torquer.simulation.lanes.laws import law_in_lanes
from torquer.simulation.setup.run import prepare

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
LAW = """
import torquer
from gains import FACTOR

@torquer.law(
    parameters={"gain": 1e5, "along": (1.0, 1.0, 1.0)}, memory={"calls": 0.0, "b": (0.0, 0.0, 0.0)}
)
def damp(inputs, parameters, memory):
    memory.calls += 1.0
    b, before = inputs.b_body_t, memory.b
    out = [0.0, 0.0, 0.0]
    for k in range(3):
        if memory.calls > 1.5:
            out[k] = -FACTOR * parameters.gain * parameters.along[k] * (b[k] - before[k])
        memory.b[k] = b[k]
    return out[0], out[1], out[2]
"""
INERTIA = {"spacecraft.body.inertia_kg_m2": {"relative": {"uniform": [0.8, 1.2]}}}
BIAS = {"spacecraft.magnetometer.bias_nt": {"normal": {"mean": [0, 0, 0], "sigma": 500.0}}}
GAIN = {"control.law.parameters.gain": {"log_uniform": [1e4, 1e6]}}
ALONG = {"control.law.parameters.along": {"uniform": [[0.5, 0.5, 0.5], [1.0, 2.0, 1.0]]}}
RATE = {"initial.rate_deg_s": {"direction": "uniform", "magnitude": {"uniform": [0.5, 5.0]}}}


@pytest.fixture
def own(tmp_path):
    """The tip-off with a law of a file that imports one next to it."""
    (tmp_path / "gains.py").write_text("FACTOR = 2.0\n")
    (tmp_path / "law.py").write_text(LAW)
    law = {"kind": "user", "file": str(tmp_path / "law.py"), "parameters": {}}
    scenario = scenario_from_text(SCENARIO).replace("spacecraft.magnetometer.noise_nt", 20.0)
    law["parameters"] = {"gain": 2e5, "along": [1.0, 1.0, 1.0]}
    return scenario.replace("control.law", law)


@pytest.mark.parametrize(
    "vary",
    [RATE, INERTIA, BIAS, GAIN, ALONG, INERTIA | BIAS | GAIN | ALONG | RATE],
    ids=["rate", "inertia", "bias", "gain", "along", "all"],
)
def test_members_with_a_law_of_a_file_have_the_bits_of_each_alone(own, monkeypatch, vary):
    made, prepared = campaign(own, runs=24, vary=vary), []
    monkeypatch.setattr(fleet, "prepare", lambda *a, **k: prepared.append(a) or prepare(*a, **k))
    flying = fleet.Fleet(own, made)
    assert flying.why_not_in_lanes == ""
    prepared.clear()
    flown = flying.fly(np.arange(24))
    assert prepared == []
    for member in (0, 7, 23):
        alone = torquer.simulate(member_scenario(own, made, member))
        rate = np.degrees(np.linalg.norm(alone["omega_body"].values, axis=1))[-1]
        assert flown.outcomes["final_rate_deg_s"][member] == rate
        assert flown.outcomes["coil_energy_j"][member] == float(alone["coil_energy"])


def test_a_law_loaded_again_is_the_same_function_until_its_text_changes(tmp_path):
    """Also where a file that it imports changes, and in each of two equal files."""
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "gains.py").write_text("FACTOR = 2.0\n")
        (tmp_path / folder / "law.py").write_text(LAW)
    first = load_law(tmp_path / "a" / "law.py")
    assert load_law(tmp_path / "a" / "law.py").function is first.function
    assert load_law(tmp_path / "b" / "law.py").function is not first.function
    (tmp_path / "a" / "gains.py").write_text("FACTOR = 3.0\n")
    changed = load_law(tmp_path / "a" / "law.py")
    assert changed.function is not first.function
    (tmp_path / "a" / "law.py").write_text(LAW.replace("1.5", "2.5"))
    assert load_law(tmp_path / "a" / "law.py").function is not changed.function


def test_laws_that_are_no_text_alone_stay_apart(tmp_path):
    """Closures of one text with other values, and plain Python that remembers what it did."""
    closed, plain = tmp_path / "closed.py", tmp_path / "plain.py"
    closed.write_text(
        "import torquer\n\ndef made(x):\n    @torquer.law\n"
        "    def law(inputs, parameters, memory):\n        return x, 0.0, 0.0\n    return law\n\n"
        "one, two = made(1.0), made(2.0)\n"
    )
    assert load_law(closed, "one").function is not load_law(closed, "two").function
    plain.write_text(
        "seen = []\n\ndef law(inputs, parameters, memory):\n    seen.append(1)\n"
        "    return len(seen) * 1.0, 0.0, 0.0\n"
    )
    assert load_law(plain, "law").function is not load_law(plain, "law").function


def test_a_law_that_unpacks_its_memory_is_told_what_to_write(tmp_path):
    text = """
import torquer

@torquer.law(memory={"b": (0.0, 0.0, 0.0)})
def unpacks(inputs, parameters, memory):
    x, y, z = memory.b
    return x, y, z
"""
    (tmp_path / "unpacks.py").write_text(text)
    with pytest.raises(ValueError, match=r"\(unpacks\.py, line 6\); read .*b\[0\]"):
        law_in_lanes(load_law(tmp_path / "unpacks.py"))
