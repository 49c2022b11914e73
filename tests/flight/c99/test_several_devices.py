"""Several devices of a kind in C: what the computer makes of them has the same bits."""

import pytest
from flight.c99.in_c import needs_compiler
from flight.c99.test_export import built, replayed

import torquer
from torquer.compile import engine

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
TEXT = """
start = 2025-06-01T00:00:00Z
seed = 5
orbit = {{ kind = "circular", altitude_km = 500, inclination_deg = 97.4 }}
spacecraft.body.inertia_kg_m2 = [0.03, 0.04, 0.02]
spacecraft.coils.limit_a_m2 = 0.2
initial.rate_deg_s = [2, -1.5, 1]
simulation.duration_s = 300
[spacecraft.magnetometers]
boom = {{ noise_nt = 50 }}
panel = {{ noise_nt = 200, failures = [{{ kind = "nan", from_s = 20, until_s = 40 }}] }}
deck = {{ noise_nt = 100 }}
[control]
sample_s = 1.0
law = {law}
select.magnetometer.kind = "{how}"
"""
BDOT, OFF = '{ kind = "bdot", gain_a_m2_s_per_t = 2e4 }', '{ kind = "off" }'


@needs_compiler
@pytest.mark.parametrize(
    "how, law", [("mean", BDOT), ("mean", OFF), ("spare", OFF), ("vote", BDOT), ("vote", OFF)]
)
def test_a_replay_has_the_same_bits_of_commands_and_state(how, law, tmp_path):
    path = tmp_path / "several.toml"
    path.write_text(TEXT.format(how=how, law=law))
    torquer.export_c(torquer.load_scenario(path), tmp_path / "c", steps=60)
    done = replayed(built(tmp_path / "c"), tmp_path / "c")
    same = "60 control steps: the same bits in commands and state\n"
    assert (done.returncode, done.stdout) == (0, same), done
