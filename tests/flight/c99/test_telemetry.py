"""Telemetry of an export: its fields are those of the packets' dictionary, its values those of the
flight software's packets."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from onboard_ground import ALL_MODES, DAY, scenario

import torquer
from torquer.base.user_source import plain_function
from torquer.compile import engine
from torquer.compile.engine import with_attributes
from torquer.computer.gate import Gate, within_bounds
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.export import make_texts
from torquer.flight.c99.interface import handed_in, inputs_for
from torquer.flight.c99.telemetry import left_out, told_fields
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.software.core import Core
from torquer.flight.software.modules import telemetry

#: What packets have in place of a number that is not known.
UNKNOWN = {telemetry._NO_Q[0], telemetry._NO_RATE[0], telemetry._UNKNOWN}
EXAMPLES = Path(__file__).parents[3] / "examples"
STEPS, TURN = 90, "examples/turn_to_the_sun.toml"


class Exported:
    """A computer in C with its telemetry, driven by what the flight software's computer knows."""

    def __init__(self, satellite: torquer.Scenario, folder: Path):
        computer = find_computer(satellite)
        made = translate_step(computer)
        for name, text in make_texts(computer, made, 1).items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text)
        command = [COMPILER, *FLAGS, "-O1", "-fPIC", "-shared", f"-I{folder}"]
        command += [folder / "adcs.c", folder / "adcs_tables.c", "-o", folder / "c.so", "-lm"]
        subprocess.run(command, check=True)
        self.c = ctypes.CDLL(str(folder / "c.so"))
        inputs = inputs_for(computer, made)
        self.told, self.gate = told_fields(computer, made, inputs), computer.gate
        kinds = {"double": ctypes.c_double, "uint32_t": ctypes.c_uint32}
        fields = [(each.field.name, kinds[each.kind] * each.count) for each in self.told]
        self.report = type("Report", (ctypes.Structure,), {"_fields_": fields})()
        self.places = [*handed_in(inputs).values()]
        self.state = ctypes.create_string_buffer(1 << 17)
        self.c.adcs_init(self.state)

    def step(self, known: np.ndarray) -> dict[str, list]:
        """Telemetry of a step for what the computer knows."""
        inputs, command = known[self.places].copy(), np.zeros(6)
        given, answer = (each.ctypes.data_as(ctypes.c_void_p) for each in (inputs, command))
        self.c.adcs_step(self.state, given, answer)
        self.c.adcs_telemetry(self.state, given, answer, ctypes.byref(self.report))
        return {each.field.name: [*getattr(self.report, each.field.name)] for each in self.told}


def sent(core: Core, gate: Gate) -> dict[str, list]:
    """Values of the flight software's packets, by field; NaN for what is not known. The command, of
    which they have what the laws ask for, as the gate limits it."""
    values, fields = iter(telemetry.extended_values(core.services)), {}
    for each in load_dictionary("chibis_m").down["extended"].fields:
        fields[each.name] = [next(values) for _ in range(each.count)]
        if each.name not in ("b", "gyro", "sun", "isolated"):
            fields[each.name] = [np.nan if v in UNKNOWN else v for v in fields[each.name]]
    dipole, torque = (gate.dipole_axes, gate.dipole), (gate.torque_axes, gate.torque)
    for name, bounds in (("dipole", dipole), ("torque", torque)):
        limited = plain_function(within_bounds)
        fields[name] = [*limited(*map(with_attributes, bounds), (*fields[name],))]
    return fields | {"state": [*telemetry.states(core.services)], "held": [0], "raised": [0]}


@needs_compiler
@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.slow
@pytest.mark.parametrize("file", sorted([ALL_MODES, DAY, TURN]))
def test_values_are_those_of_the_flight_softwares_packets(file, tmp_path):
    satellite = scenario(600.0, file=file)
    exported, core = Exported(satellite, tmp_path), Core(satellite)
    known = core.flight._run.state.board.known.view(np.float64).reshape(-1)
    seen = set()
    for step in range(STEPS):
        core.tick()
        expected, found = sent(core, exported.gate), exported.step(known)
        for name, values in found.items():
            theirs = expected[name][: len(values)]
            np.testing.assert_array_equal(values, theirs, f"{name}, step {step}")
            seen |= {name} if np.isfinite(values).any() and np.any(values) else set()
    assert {"omega", "b", "dipole"} <= seen, seen
    assert file != TURN or {"q_orbital", "omega_orbital", "sigma", "torque"} <= seen, seen


def told_of(name: str) -> list[str]:
    computer = find_computer(torquer.load_scenario(EXAMPLES / f"{name}.toml"))
    made = translate_step(computer)
    return [each.field.name for each in told_fields(computer, made, inputs_for(computer, made))]


def test_what_the_computer_has_not_is_not_told():
    """A lone B-dot has no estimate; the kernel of the orbital frame needs the place, too."""
    assert told_of("tip_off_campaign") == ["b", "dipole", "torque"]
    assert {"q_inertial", "omega", "sun"} <= {*told_of("sun_laws")}
    assert not {"q_orbital", "isolated", "b"} & {*told_of("sun_laws")}
    assert {"q_orbital", "sigma", "estimate_age"} <= {*told_of("magneto_gyro_micro")}


def test_fields_are_those_of_the_dictionary(make):
    computer = find_computer(make())
    made = translate_step(computer, again=0)
    told = told_fields(computer, made, inputs_for(computer, made))
    fields = load_dictionary("chibis_m").down["extended"].fields
    names = [each.field.name for each in told]
    assert names == [each.name for each in fields if each.name in names]
    assert {"q_orbital", "stb_mode", "on_board_ms", "state"} <= set(left_out(told))
    assert not set(left_out(told)) & set(names)
