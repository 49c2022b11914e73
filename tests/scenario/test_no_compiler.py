"""Loading and checking a scenario needs neither the compiler nor SciPy."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import torquer
from torquer.compile import engine

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Scenarios whose laws are of the package.
OWN = [path for path in sorted(EXAMPLES.glob("*.toml")) if "file =" not in path.read_text("utf-8")]
HEAVY = "print(*sorted({'numba', 'llvmlite', 'scipy'} & {name.partition('.')[0] for name in "
HEAVY += "sys.modules}))"


def words(script):
    environment = {**os.environ, "PYTHONPATH": str(Path(torquer.__file__).parents[1])}
    environment.pop("NUMBA_DISABLE_JIT", None)
    ended = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=300
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.split()


def test_loading_every_example_without_code_loads_no_compiler():
    assert len(OWN) >= 18
    script = "import sys; from torquer.scenario.load import load_scenario\n"
    for path in OWN:
        script += f"assert load_scenario({str(path)!r}).name\n"
    assert words(script + HEAVY) == []


@pytest.mark.skipif(not engine.COMPILED, reason="nothing is compiled")
def test_what_computes_much_is_compiled_even_there():
    """An orbit is integrated when the attitude at the start is stated relative to it."""
    script = """
import sys
from torquer.compile.when_compiling import is_plain, plainly
from torquer.environment.orbit.numerical import Numerical
from torquer.environment.orbit.point_mass import Trajectory
seen = []
states = Trajectory.states
Trajectory.states = lambda self, t_s: seen.append(is_plain.get()) or states(self, t_s)
start = {"kind": "circular", "altitude_km": 500.0, "inclination_deg": 52.0}
with plainly():
    Numerical(start=start, degree=2).state([0.0, 10.0], "2026-01-01T00:00:00Z")
    print(is_plain.get(), *seen)
"""
    assert words(script) == ["True", "False"]
