"""Laws of the literature that detumble, and what a user's law knows of the satellite, as C."""

import numpy as np
import pytest
from computer.blocks.test_of_satellite import LAW
from computer.laws.test_detumbling_laws import FLOWN
from flight.c99.in_c import needs_compiler
from flight.c99.test_export import built, replayed
from tip_off import SCENARIO

import torquer
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text


@pytest.fixture
def scenario(tmp_path):
    """All of them together: their dipoles are added."""
    (tmp_path / "law.py").write_text(LAW)
    laws = {kind: {"kind": kind, **keys} for kind, keys in FLOWN.items()}
    laws["own"] = {"kind": "user", "file": str(tmp_path / "law.py")}
    made = scenario_from_text(SCENARIO.replace("law = {", "laws.first = {"))
    return made.replace("control.laws", laws).replace("spacecraft.magnetometer.noise_nt", 30.0)


@needs_compiler
@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_they_have_the_same_bits_in_c(scenario, tmp_path):
    """In a replay, and put back into the simulation."""
    torquer.export_c(scenario, tmp_path / "c", steps=100)
    done = replayed(built(tmp_path / "c"), tmp_path / "c")
    same = "100 control steps: the same bits in commands and state\n"
    assert (done.returncode, done.stdout) == (0, same), done
    own = torquer.simulate(scenario, until_s=200.0)
    in_c = torquer.simulate(scenario, until_s=200.0, computer=tmp_path / "c")
    assert np.array_equal(own["command_body"].values, in_c["command_body"].values)
    assert np.array_equal(own["omega_body"].values, in_c["omega_body"].values)
    assert np.abs(own["command_body"].values[-1]).min() > 0.0
