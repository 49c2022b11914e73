"""The boundary of an exported computer: whatever is handed in, its command is finite and within
limits, and Python's gate answers with the same bits."""

import ctypes
import itertools
import math
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from flight.c99.in_c import COMPILER, FLAGS, needs_compiler
from flight.c99.plain_replay import computer_and_board
from slow_cases import slow_after

import torquer
from torquer.compile.engine import records
from torquer.computer import gate as gates
from torquer.computer.blocks.limits import FREE
from torquer.computer.interface import GYRO, KNOWN, PLACES
from torquer.flight.c99.computer import find_computer, translate_step
from torquer.flight.c99.export import export_c
from torquer.flight.c99.interface import handed_in, inputs_for, named_constants
from torquer.flight.c99.recording import record_steps
from torquer.spacecraft.sensors.device import MOST_PARTS

EXAMPLES = Path(__file__).parents[3] / "examples"
STEPS = 400
#: A loop around the interface, with the state inside.
AROUND = """
#include "adcs.h"
#include <string.h>
static adcs_state state;
void begin(void) { adcs_init(&state); }
uint32_t take_step(const adcs_inputs *inputs, adcs_command *command)
{
    return adcs_step(&state, inputs, command);
}
int command_mode(int region, int mode) { return (int)adcs_command_mode(&state, region, mode); }
int set_parameter(int place, double value) { return (int)adcs_set_parameter(&state, place, value); }
double parameter(int place) { return adcs_parameter(&state, place); }
int set_flag(int flag, int on) { return (int)adcs_set_flag(&state, flag, on != 0); }
int flag(int number) { return adcs_flag(&state, number); }
int hold(int region, int on) { return (int)adcs_hold(&state, region, on != 0); }
int held(int region) { return adcs_is_held(&state, region); }
int commanded(int region) { return adcs_commanded_mode(&state, region); }
int mode(int region) { return adcs_mode(&state, region); }
void damage_clock(int number, double value)
{
    memcpy((unsigned char *)&state + ADCS_STATE_BYTES - 32 + 8 * number, &value, sizeof value);
}
int rebase(double shift_s) { return (int)adcs_rebase(&state, shift_s); }
double offset_s(void) { return adcs_clock_offset_s(&state); }
void restart(void) { adcs_restart_estimators(&state); }
"""


class Exported:
    """An example in C and in Python, with the inputs of a recorded flight."""

    def __init__(self, name: str, folder: Path):
        self.scenario = torquer.load_scenario(EXAMPLES / f"{name}.toml")
        self.parts = find_computer(self.scenario)
        export_c(self.scenario, folder, steps=1)
        made = translate_step(self.parts)
        self.gate, given = made.checks, inputs_for(self.parts, made)
        self.recorded = record_steps(self.scenario, STEPS, made, given)
        self.inputs = self.recorded.inputs
        (folder / "around.c").write_text(AROUND)
        sources = [folder / each for each in ("adcs.c", "adcs_tables.c", "around.c")]
        command = [COMPILER, *FLAGS, "-O1", "-fPIC", "-shared", f"-I{folder}", *sources]
        subprocess.run([*command, "-o", folder / "around.so", "-lm"], check=True)
        self.c = ctypes.CDLL(str(folder / "around.so"))
        self.c.parameter.restype = self.c.offset_s.restype = ctypes.c_double
        self.places = [*handed_in(given).values()]

    def in_c(self, row: np.ndarray):
        """Command and status of a step in C."""
        command = np.zeros(6)
        pointers = [each.ctypes.data_as(ctypes.c_void_p) for each in (row, command)]
        status = self.c.take_step(*pointers)
        return command, status

    def both(self, rows: np.ndarray):
        """Commands and statuses of steps in C, whose bits are those of Python."""
        self.c.begin()
        computer, board = computer_and_board(self.scenario)
        gate, now, given = records(self.gate), records(gates.first_gate()), np.zeros(1, KNOWN)
        numbers, given = given.view(np.float64), records(given)
        commands, statuses = [], []
        for k, row in enumerate(np.ascontiguousarray(rows)):
            numbers[self.places] = row
            command, status = self.in_c(row)
            answer = gates.gated_step(gate, computer, board, now, given)
            expected = np.array([*answer.dipole_a_m2, *answer.torque_n_m])
            assert status == answer.status, (k, status, answer.status)
            assert command.tobytes() == expected.tobytes(), (k, command, expected)
            commands.append(command)
            statuses.append(status)
        return np.array(commands), np.array(statuses)

    def limited(self, commands: np.ndarray) -> bool:
        """Whether commands are finite, and within the limits of coils and wheels."""
        gate = self.gate
        sides = ((gate.dipole_axes, gate.dipole, commands[:, :3]),
                 (gate.torque_axes, gate.torque, commands[:, 3:]))  # fmt: skip
        shares = [
            np.abs(vectors @ np.array(rows).T).max()
            for axes, bounds, vectors in sides
            for rows in (np.diag(axes.tolist()[0]) if len(axes) else [], bounds.tolist())
            if len(rows)
        ]
        return bool(np.isfinite(commands).all()) and max(shares) <= 1.0


def times_of(exported) -> list[int]:
    """Places of the times of readings among the inputs."""
    read_s = PLACES["read_s"]
    return [k for k, place in enumerate(exported.places) if read_s.start <= place < read_s.stop]


BAD = [math.nan, math.inf, -math.inf, 1e300, -1e300, 5e-324, 0.0]


def spoil(rng, exported, rows, bad: slice):
    """Rows of which those of a stretch are spoiled, each in a way of its own."""
    rows, times = rows.copy(), times_of(exported)
    for k in range(bad.start, bad.stop):
        way = rng.integers(6)
        if way == 0:  # any numbers
            count = rows.shape[1]
            places = rng.choice(count, rng.integers(1, min(8, count + 1)), replace=False)
            rows[k, places] = rng.choice(BAD, len(places))
        elif way == 1:  # all of them
            rows[k] = rng.choice(BAD)
        elif way == 2:  # bits
            words = rows[k].view(np.uint64)
            words[rng.integers(rows.shape[1])] ^= np.uint64(1) << np.uint64(rng.integers(64))
        elif way == 3:  # the clock
            rows[k, 0] += rng.choice([-1e5, -10.0, 1e5, 1e9])
        elif way == 4:  # stamps
            rows[k, times] += rng.choice([-1e5, -1.0, 1.0, 1e5])
        else:  # readings exchanged
            rows[k, 1:] = rng.permutation(rows[k, 1:])
    return rows


NAMES = ("magneto_gyro_micro", "chibis_m_detumble", "turn_to_the_sun", "safe_mode")


@pytest.fixture(scope="module", params=slow_after(1, NAMES))
def exported(request, tmp_path_factory):
    return Exported(request.param, tmp_path_factory.mktemp(request.param))


@needs_compiler
@pytest.mark.verifies("REQ-BRD-005")
def test_a_sound_flight_meets_nothing_but_limits(exported):
    commands, statuses = exported.both(exported.inputs)
    assert exported.limited(commands)
    known = gates.COMMAND_LIMITED | gates.NO_ESTIMATE | gates.GUARDED
    assert not (statuses & ~known).any(), np.unique(statuses)
    assert commands.tobytes() == exported.recorded.commands.tobytes()


@needs_compiler
@pytest.mark.verifies("REQ-BRD-001")
@pytest.mark.parametrize("seed", range(6))
def test_spoiled_inputs_leave_a_finite_command_within_limits(exported, seed):
    rows = spoil(np.random.default_rng(seed), exported, exported.inputs, slice(50, 120))
    commands, statuses = exported.both(rows)
    assert exported.limited(commands)
    assert (statuses[50:120] != 0).sum() > 20
    after = statuses[125:]
    taken = gates.TIME_NOT_FINITE | gates.TIME_BACK | gates.TIME_AHEAD | gates.READING_NOT_IN_ORDER
    assert not (after & taken).any(), np.unique(after)
    is_back = np.any(commands[130:] != commands[130])
    assert is_back or (statuses[130:] & gates.GUARDED).all()  # a guard has switched it off


@needs_compiler
@pytest.mark.verifies("REQ-BRD-002")
@pytest.mark.parametrize("number", BAD[:3])
def test_one_bad_sample_disables_no_law(exported, number):
    """Each input in turn, for one step alone: what the laws command afterwards goes on changing."""
    for place in range(1, exported.inputs.shape[1], 3):
        rows = exported.inputs[:120].copy()
        rows[40, place] = number
        commands, _ = exported.both(rows)
        assert exported.limited(commands)
        assert len({each.tobytes() for each in commands[60:]}) > 10, place


@needs_compiler
@pytest.mark.verifies("REQ-BRD-002")
@pytest.mark.parametrize("number", BAD[:3])
def test_an_ephemeris_that_is_no_number_is_said(exported, number):
    """Each of its numbers in turn, at one step alone; nothing that is measured is meant."""
    ephemeris = range(PLACES["position_x"].start, PLACES["sunlit_fraction"].stop)
    places = [k for k, place in enumerate(exported.places) if place in ephemeris]
    rows = exported.inputs[: 40 + 3 * len(places)].copy()
    steps = [20 + 2 * k for k in range(len(places))]
    rows[steps, places] = number
    commands, statuses = exported.both(rows)
    said = (statuses & gates.EPHEMERIS_NOT_FINITE) != 0
    assert np.flatnonzero(said).tolist() == steps
    assert exported.limited(commands) and not (statuses & gates.READING_NOT_FINITE).any()


@needs_compiler
@pytest.mark.verifies("REQ-BRD-003")
def test_a_clock_that_is_set_costs_one_step(exported):
    """Back by a day, ahead by a day: refused once, then the computer goes on."""
    for shift_s, first in ((-86400.0, gates.TIME_BACK), (86400.0, gates.TIME_AHEAD)):
        rows = exported.inputs.copy()
        rows[100:, [0, *times_of(exported)]] += shift_s
        commands, statuses = exported.both(rows)
        assert statuses[100] == first and statuses[101] & gates.CLOCK_SET
        assert not commands[100].any() and exported.limited(commands)
        assert not (statuses[102:] & (first | gates.CLOCK_SET | gates.READING_NOT_IN_ORDER)).any()


@needs_compiler
@pytest.mark.verifies("REQ-BRD-003")
@pytest.mark.parametrize("time_s", [1e20, -1e20, 1e300, 2.0 * gates.LATEST_S])
def test_a_time_at_which_no_step_moves_the_clock_is_never_believed(exported, time_s):
    """However often: a clock of 1e20 s has a resolution of 16384 s, and laws would see no time."""
    rows = exported.inputs[:200].copy()
    rows[100:104, 0] = time_s
    commands, statuses = exported.both(rows)
    assert (statuses[100:104] == gates.TIME_NOT_FINITE).all() and not commands[100:104].any()
    assert not (statuses[104:] & (gates.TIME_BACK | gates.TIME_AHEAD | gates.CLOCK_SET)).any()
    assert len({each.tobytes() for each in commands[110:]}) > 10


@needs_compiler
def test_a_clock_that_the_ground_sets_costs_nothing(exported):
    exported.c.begin()
    rows = np.ascontiguousarray(exported.inputs.copy())
    expected, _ = exported.both(rows)
    exported.c.begin()
    shift_s = 4096.0
    for k, row in enumerate(rows):
        if k == 100:
            assert exported.c.rebase(ctypes.c_double(shift_s)) == gates.DONE
        if k >= 100:
            row[[0, *times_of(exported)]] += shift_s
        command, status = exported.in_c(row)
        assert not status & (gates.TIME_AHEAD | gates.CLOCK_SET)
        np.testing.assert_allclose(command, expected[k], rtol=1e-6, atol=1e-12)


@needs_compiler
@pytest.mark.verifies("REQ-BRD-004")
def test_a_clock_is_set_to_no_time_that_no_clock_shows(exported):
    exported.c.begin()
    rows = np.ascontiguousarray(exported.inputs.copy())
    expected, _ = exported.both(rows)
    exported.c.begin()
    far = [sign * size for sign in (1.0, -1.0) for size in (1e10, 1e20, 1e300, math.inf)]
    for k, row in enumerate(rows):
        if k == 100:
            for shift_s in (math.nan, *far):
                assert exported.c.rebase(ctypes.c_double(shift_s)) == gates.NOT_A_NUMBER
        command, _ = exported.in_c(row)
        np.testing.assert_array_equal(command, expected[k])
    half = ctypes.c_double(0.6 * gates.LATEST_S)
    assert exported.c.rebase(half) == gates.DONE
    assert exported.c.rebase(half) == gates.NOT_A_NUMBER
    assert exported.c.offset_s() == half.value


#: What an error of the memory may make of offset and time of the gate's clock, by their numbers.
DAMAGED = [(k, value) for k in (0, 1) for value in (math.nan, math.inf, 1e300, -1e300, 2e11)]


@needs_compiler
@pytest.mark.verifies("REQ-BRD-003")
@pytest.mark.parametrize(("number", "value"), DAMAGED)
def test_a_damaged_clock_begins_again_by_the_call_that_sets_it(exported, number, value):
    c, rows = exported.c, np.ascontiguousarray(exported.inputs[:60])
    c.begin()
    for k, row in enumerate(rows):
        if k == 20:
            c.damage_clock(number, ctypes.c_double(value))
        if k == 25:
            assert c.rebase(ctypes.c_double(math.nan)) == gates.NOT_A_NUMBER
            assert c.rebase(ctypes.c_double(0.0)) == gates.DONE
        command, status = exported.in_c(row)
        assert np.isfinite(command).all()
        if k == 20:
            met = gates.TIME_BACK | gates.TIME_AHEAD | gates.READING_NOT_IN_ORDER
            assert status & met or (number == 1 and math.isnan(value))  # that the step replaces
        if k >= 25:
            off = gates.TIME_NOT_FINITE | gates.TIME_BACK | gates.TIME_AHEAD | gates.CLOCK_SET
            assert not status & (off | gates.READING_NOT_IN_ORDER)


@needs_compiler
@pytest.mark.parametrize(("number", "value"), DAMAGED)
def test_so_it_does_by_the_kernel(exported, number, value):
    gate, (_, board) = records(exported.gate), computer_and_board(exported.scenario)
    now = gates.first_gate()
    now["t_s"] = 7.0
    now[("offset_s", "t_s")[number]] = value
    assert gates.rebase(gate, board, records(now), 5.0) == gates.DONE
    assert now.tobytes() == gates.first_gate().tobytes()
    assert (board.known["read_s"][:, gate.readings["row"]] == -math.inf).all()


@needs_compiler
@pytest.mark.verifies("REQ-BRD-003")
def test_the_offset_of_the_clock_is_read_back(exported):
    """What the ground has told; what a step back has shown, which is found by its second step."""
    c, rows = exported.c, np.ascontiguousarray(exported.inputs[:30].copy())
    c.begin()
    assert c.offset_s() == 0.0
    for told in (16.0, -8.0):
        assert c.rebase(ctypes.c_double(told)) == gates.DONE
    assert c.offset_s() == 8.0
    rows[:, [0, *times_of(exported)]] += 8.0
    rows[20:, [0, *times_of(exported)]] -= 4096.0
    offsets = []
    for row in rows:
        exported.in_c(row)
        offsets.append(c.offset_s())
    assert offsets[:21] == [8.0] * 21
    last_s = rows[19, 0] - 8.0  # by the computer's clock, which goes on from it
    assert offsets[21:] == [rows[20, 0] - last_s] * 9
    c.begin()
    assert c.offset_s() == 0.0


@needs_compiler
@pytest.mark.verifies("REQ-BRD-004")
def test_setters_refuse_what_there_is_not(exported):
    c, parts = exported.c, exported.parts
    c.begin()
    modes = parts.scenario.control.named().modes
    regions = list(modes.regions.values()) if modes else []
    number = itertools.count()
    own = [{next(number) for _ in region.states} for region in regions]
    for region, mode in itertools.product(range(-2, len(own) + 3), range(-2, 60)):
        is_there = 0 <= region < len(own) and mode in own[region]
        before = c.commanded(region)
        assert c.command_mode(region, mode) == (gates.DONE if is_there else gates.NO_SUCH)
        assert c.commanded(region) == (mode if is_there else before)
        assert 0 <= region < len(own) or before == -1
    for region in (-1, 0, len(own), 2**31 - 1):
        is_there = 0 <= region < len(own)
        assert c.hold(region, 1) == (gates.DONE if is_there else gates.NO_SUCH)
        assert c.held(region) == is_there
    flags = len(modes.flags) if modes else 0
    for flag in (-1, *range(flags), flags, 2**31 - 1):
        assert c.set_flag(flag, 1) == (gates.DONE if 0 <= flag < flags else gates.NO_SUCH)
        assert c.flag(flag) == (0 <= flag < flags)
    settable = parts.gate.parameters["settable"].tolist()
    for place in (-1, *range(len(settable)), len(settable), 2**31 - 1):
        there = 0 <= place < len(settable)
        before = c.parameter(place)
        for value in (math.nan, math.inf):
            refused = gates.NOT_A_NUMBER if there else gates.NO_SUCH
            assert c.set_parameter(place, ctypes.c_double(value)) == refused
        outcome = c.set_parameter(place, ctypes.c_double(0.25))
        expected = gates.NO_SUCH if not there else gates.DONE if settable[place] else gates.FIXED
        assert outcome == expected
        after = c.parameter(place)
        assert after == 0.25 if outcome == gates.DONE else str(after) == str(before)


@needs_compiler
@pytest.mark.verifies("REQ-BRD-004")
def test_parameters_are_set_within_the_limits_of_their_keys(exported):
    """At each limit and beside it, in C and by the kernel in Python; what is refused changes
    nothing."""
    c, (_, board) = exported.c, computer_and_board(exported.scenario)
    c.begin()
    gate, blocks = records(exported.gate), exported.parts.blocks
    limits = [each for block in blocks.all() for each in block.limits]
    settable = exported.parts.gate.parameters["settable"].tolist()
    assert any(each != FREE for each in limits)
    for place, own in enumerate(limits):
        first = board.parameters[place]
        assert own.hold(first)
        ends = [each for each in (own.least, own.greatest) if math.isfinite(each)]
        beside = [math.nextafter(each, to) for each in ends for to in (-math.inf, math.inf)]
        for value in (*ends, *beside, -1e300, 1e300, 0.0, first):
            before = c.parameter(place)
            outcome = c.set_parameter(place, ctypes.c_double(value))
            assert gates.set_parameter(gate, board, place, value) == outcome
            taken = gates.DONE if own.hold(value) else gates.OUT_OF_RANGE
            assert outcome == (taken if settable[place] else gates.FIXED), (place, value)
            now = value if outcome == gates.DONE else before
            assert c.parameter(place) == board.parameters[place] == now


@needs_compiler
@pytest.mark.verifies("REQ-BRD-004")
def test_a_commanded_mode_is_read_back_until_its_step(exported):
    """A region that is held, so that no transition leaves the state in the same step."""
    c, modes = exported.c, exported.parts.scenario.control.named().modes
    number, regions = itertools.count(), list(modes.regions.values()) if modes else []
    own = [[next(number) for _ in region.states] for region in regions]
    row = np.ascontiguousarray(exported.inputs[0])
    for region, states in enumerate(own):
        c.begin()
        assert c.commanded(region) == -1
        assert c.hold(region, 1) == c.command_mode(region, states[-1]) == gates.DONE
        assert (c.commanded(region), c.mode(region)) == (states[-1], states[0])
        exported.in_c(row)
        assert (c.commanded(region), c.mode(region)) == (-1, states[-1])
    assert c.commanded(-1) == c.commanded(len(own)) == -1


@needs_compiler
@pytest.mark.slow
@pytest.mark.verifies("REQ-BRD-002")
@pytest.mark.parametrize("number", BAD[:3])
def test_an_estimator_of_ones_own_that_keeps_no_number_begins_again(tmp_path, number):
    """The mean of `own_parts` would be none for ever after one reading; forty later it is near."""
    own = Exported("own_parts", tmp_path)
    rows = own.inputs[:150].copy()
    gyro = PLACES["readings"].start + MOST_PARTS * GYRO
    rows[60, own.places.index(gyro)] = number
    commands, statuses = own.both(rows)
    begun = (statuses & gates.BEGUN_ANEW) != 0
    assert np.flatnonzero(begun).tolist() == [60]
    sound, _ = own.both(own.inputs[:150])
    assert not commands[60].any() and commands[:60].tobytes() == sound[:60].tobytes()
    assert np.abs(commands - sound)[100:].max() < 1e-3 * np.abs(sound).max()


@pytest.mark.parametrize("name", ["chibis_m_flight", "magneto_gyro_micro", "own_parts"])
def test_each_parameter_says_its_limits_or_why_it_has_none(name):
    computer = find_computer(torquer.load_scenario(EXAMPLES / f"{name}.toml"))
    one = r"(at least|at most|above|below|any finite \(.+\))[^;]*"
    said = [said for _, said in named_constants(computer)["parameters"].values()]
    assert said
    for each in said:
        assert re.fullmatch(rf"[\w.]+, \d+ numbers(, not set in flight|: {one}(; {one})*)", each)


LIMITED = """
import torquer
@torquer.law(parameters={"gain": 1.0, "free": 2.0}, limits={"gain": (0.0, 4.0)})
def limited(inputs, parameters, memory):
    return (parameters.gain * inputs.b_body_t[0], parameters.free, 0.0)
"""


def own_law(tmp_path, parameters=""):
    """A scenario whose law is one's own and declares limits."""
    (tmp_path / "limited.py").write_text(LIMITED)
    text = (EXAMPLES / "my_law.toml").read_text().replace("my_law.py", "limited.py")
    text = re.sub(r"parameters = .*", parameters, text)
    (tmp_path / "limited.toml").write_text(text)
    return torquer.load_scenario(tmp_path / "limited.toml")


def test_limits_of_a_law_of_ones_own_hold_in_flight_and_in_the_header(tmp_path):
    scenario = own_law(tmp_path)
    computer = find_computer(scenario)
    gate, (_, board) = records(computer.gate), computer_and_board(scenario)
    answers = [gates.set_parameter(gate, board, 0, value) for value in (-5e-324, 0.0, 4.0, 4.1)]
    assert answers == [gates.OUT_OF_RANGE, gates.DONE, gates.DONE, gates.OUT_OF_RANGE]
    gain, free = (said for _, said in named_constants(computer)["parameters"].values())
    assert gain == "law.gain, 1 numbers: at least 0, at most 4"
    assert free == "law.free, 1 numbers: any finite (its law declares no limits)"


def test_and_in_the_scenario(tmp_path):
    must = r"parameters\.gain: must be at least 0, at most 4; received 5"
    scenario = own_law(tmp_path, "parameters = { gain = 5.0 }")
    with pytest.raises(ValueError, match=must):
        scenario.control.law.law()
