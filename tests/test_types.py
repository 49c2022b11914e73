"""What type checkers see: the parts of a scenario are of real types, its result has its methods."""

import sys
import textwrap

from mypy import api

PROGRAM = """
    import torquer
    from torquer.computer.laws import Bdot
    from torquer.environment.orbit import Circular

    scenario = torquer.load_scenario("s.toml")
    law, orbit, field = scenario.control.law, scenario.orbit, scenario.environment.field
    reveal_type(law)
    reveal_type(orbit)
    reveal_type(field)
    reveal_type(scenario.control.estimator)
    reveal_type(scenario.environment.atmosphere)
    assert isinstance(law, Bdot) and isinstance(orbit, Circular)
    reveal_type(law.gain_a_m2_s_per_t)
    reveal_type(orbit.altitude_km)
    print(law.gain, field.kind)
    reveal_type(torquer.LAWS)
    result = torquer.simulate(scenario)
    reveal_type(result.torquer)
    reveal_type(result.torquer.scenario)
    reveal_type(torquer.load("result.nc").torquer)
"""
#: What is revealed of each, in order; of a union, members that it must have.
REVEALED = (
    ("bdot.Bdot |", "user.UserLaw |", "scheme.Scheme |", "None"),
    ("circular.Circular |", "sgp4.Sgp4 |"),
    ("gauss.Igrf14 |", "tilted_dipole.TiltedDipole |"),
    ("sensors.SensorReadings |", "kalman_gyro.KalmanGyro |"),
    ("gost.Gost |", "None"),
    ("float",),
    ("float",),
    ("dict[str, type[Any]]",),
    ("accessor.Torquer",),
    ("spec.Scenario",),
    ("accessor.Torquer",),
)


def test_a_type_checker_without_plugins_sees_the_parts(tmp_path):
    file = tmp_path / "program.py"
    file.write_text(textwrap.dedent(PROGRAM))
    options = ["--config-file=", f"--cache-dir={tmp_path / 'cache'}", "--follow-imports=silent"]
    found, problems, _ = api.run([*options, f"--python-executable={sys.executable}", str(file)])
    assert not problems
    lines = found.splitlines()
    notes = [line.partition("Revealed type is ")[2] for line in lines if "Revealed" in line]
    assert len(notes) == len(REVEALED), found
    for note, parts in zip(notes, REVEALED, strict=True):
        for part in parts:
            assert part in note, (part, note)
    errors = [line for line in lines if ": error: " in line]
    assert len(errors) == 1 and '"Bdot" has no attribute "gain"' in errors[0], found
