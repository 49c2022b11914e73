"""The boundary of the computer on board: what flight software hands in is checked, and so is the
answer.

A control step that others call may be given anything: readings that are no numbers, stamps that go
back, a clock that has been set. `gated_step` hands on what can be used, answers a command that is
finite and within the limits of coils and wheels, and says in a word of bits what it has met.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, kernel
from torquer.computer.computer import control_step
from torquer.computer.estimation.estimator import has_failed
from torquer.computer.inputs import read_ephemeris
from torquer.computer.interface import (
    NO_COMMAND,
    UNKNOWN_ESTIMATE,
    Command,
    put_ephemeris,
    put_estimate,
    reading3,
)
from torquer.maths.geometry.vec3 import doubt_of, is_finite

#: What a step has met, bit by bit, with what it means for whoever called it.
MET = {
    "time_not_finite": "t_s is no number within 1e10 s of 0: no step was taken",
    "time_back": "t_s is before that of the last step: no step was taken",
    "time_ahead": "t_s is far ahead of the last step: no step was taken",
    "clock_set": "the second time in a row from another clock: the computer goes on with it",
    "reading_not_finite": "a reading has a number that is not finite: it counts as none",
    "reading_not_in_order": "a reading is of later than t_s, or of before the one known: not taken",
    "reading_old": "a reading that is used is older than the schedule of the scenario makes it",
    "command_not_finite": "what the laws command is no number: zeros, and the laws begin again",
    "command_limited": "the command is beyond the limits of coils or wheels: scaled to them",
    "no_estimate": "laws use attitude or rate, and the estimate has none",
    "guarded": "a region that only guards has left its first state",
    "law_failed": "a law or estimator of your own has left its tables, or divided by zero",
    "not_begun": "the state was not begun by this export: no step was taken",
    "ephemeris_not_finite": "the ephemeris has a number that is not finite: what needs it waits",
    "begun_anew": "a law or estimator of your own kept what is not finite: it begins again",
}
(
    TIME_NOT_FINITE, TIME_BACK, TIME_AHEAD, CLOCK_SET, READING_NOT_FINITE, READING_NOT_IN_ORDER,
    READING_OLD, COMMAND_NOT_FINITE, COMMAND_LIMITED, NO_ESTIMATE, GUARDED, LAW_FAILED,
    NOT_BEGUN, EPHEMERIS_NOT_FINITE, BEGUN_ANEW,
) = (1 << bit for bit in range(len(MET)))  # fmt: skip
#: All bits. What is masked by it is known to be small: 32-bit processors turn it into a float at
#: once, and a number of 64 bits by a function.
ANY = (1 << len(MET)) - 1

#: Times, and how far clocks are apart, are below it [s]: at 1e20 s a clock that was believed would
#: not tell steps apart any more.
LATEST_S = 1e10

#: No clock of the gate, whose offset adds to such times, shows it [s].
_NO_CLOCK_S = 10.0 * LATEST_S

#: A sensor or device whose readings are checked: its row, the numbers of a reading, how old the
#: scenario lets it become [s].
CHECKED = np.dtype([("row", np.int64), ("count", np.int64), ("oldest_s", np.float64)])
#: A bound: |(x, y, z) . v| must not exceed 1.
BOUND = np.dtype([(name, np.float64) for name in "xyz"])
#: Whether a number of a parameter may be set in flight, and within what limits: see `Limits`.
SETTABLE = np.dtype(
    [
        *(("settable", np.int64), ("least", np.float64), ("greatest", np.float64)),
        *(("above", np.int64), ("below", np.int64)),
    ]
)
#: A region that only guards, and its first state.
GUARD = np.dtype([("region", np.int64), ("first", np.int64)])
#: Parts of the ephemeris, and their fields in the computer's record.
EPHEMERIS_PARTS = {
    name: tuple(f"{field}_{c}" for c in "xyz")
    for name, field in (
        ("place", "position"), ("velocity", "velocity"), ("field", "model_b"),
        ("field_rate", "model_b_rate"), ("to_sun", "to_sun"),
    )
} | {"sunlit_fraction": ("sunlit_fraction",)}  # fmt: skip
#: Parts of the ephemeris that are used: 1 for each.
EPHEMERIS = np.dtype([(name, np.int64) for name in EPHEMERIS_PARTS])
#: The memory of a law or an estimator of the user's.
OWN = np.dtype([("m0", np.int64), ("m1", np.int64)])
#: What the gate remembers: the clock of the computer is that of the caller less `offset_s`;
#: `t_s`: of the last step by the computer's clock, `other_s`: by the caller's, of a step that was
#: not taken, NaN for none; `status`: what the last step met.
GATE_NOW = np.dtype([(name, np.float64) for name in ("offset_s", "t_s", "other_s", "status")])


#: What becomes of a command from outside.
OUTCOMES = {
    "done": "it holds from the next step on",
    "no_such": "there is no such region, state of the region, flag or parameter",
    "not_a_number": "the value is no finite number, or a time that no clock shows",
    "fixed": "the parameter shapes its block and is not set in flight",
    "not_begun": "the state was not begun by this export: nothing is set",
    "out_of_range": "the value is beyond the limits of the parameter",
}
DONE, NO_SUCH, NOT_A_NUMBER, FIXED, NOT_SET, OUT_OF_RANGE = range(len(OUTCOMES))


class Gate(NamedTuple):
    """What the gate checks by. `first`: memory of laws and estimators at the start; `gap_s`: the
    longest time from one step to the next that needs no second opinion; `needs_estimate`: 1 if laws
    do. `parameters`: a row for each number. `ephemeris`: one row, none if no part of it is used;
    `own`: of the user's laws and estimators that have a memory; `own_estimators`: how many
    estimators are the user's. `dipole`, `torque`: bounds of the command; `..._axes`: those along
    single axes in one row, none if there are none.
    """

    readings: np.ndarray
    dipole_axes: np.ndarray
    dipole: np.ndarray
    torque_axes: np.ndarray
    torque: np.ndarray
    guards: np.ndarray
    parameters: np.ndarray
    first: np.ndarray
    ephemeris: np.ndarray
    own: np.ndarray
    own_estimators: int
    gap_s: float
    needs_estimate: int


class Answer(NamedTuple):
    """The command [A m^2, N m], body axes, what the step met, and what the laws asked for."""

    dipole_a_m2: tuple
    torque_n_m: tuple
    status: int
    asked: Command


def first_gate() -> np.ndarray:
    """The gate before the first step, whose time may be any."""
    now = np.zeros(1, GATE_NOW)
    now["t_s"], now["other_s"] = -np.inf, np.nan
    return now


@inlined
def own_time(now, given_s):
    """A time by the computer's clock [s]. A sum: in single precision what lies between two times
    is no time, and has fewer digits."""
    return given_s + -now.offset_s


@inlined
def judge_clock(gate, now, given_s):
    """What is to be said of the time of a step; below `CLOCK_SET` and not 0: it is not taken.

    One stamp that is off is not believed. A second one that goes on from it is another clock:
    ahead, time has passed; back, the clock was set, and the computer's own goes on from where it
    was, so that no estimator and no mode sees time go back. Meets REQ-BRD-003.
    """
    if not abs(given_s) < LATEST_S:
        return TIME_NOT_FINITE
    t_s = own_time(now, given_s)
    gap_s = gate.gap_s
    back = t_s < now.t_s
    ahead = t_s > now.t_s + gap_s and now.t_s > -math.inf
    if not back and not ahead:
        now.other_s = math.nan
        return 0
    follows = now.other_s <= given_s and given_s <= now.other_s + gap_s
    before_s = now.other_s
    now.other_s = given_s
    if not follows:
        return TIME_BACK if back else TIME_AHEAD
    if back:
        now.offset_s = before_s + -now.t_s
    now.other_s = math.nan
    return CLOCK_SET


@inlined
def take_reading(known, given, row, count):
    """Put the numbers of a reading into what is known."""
    for part in range(count):
        known.readings[row, part] = given.readings[row, part]


@inlined
def is_number(given, row, count):
    """Whether all numbers of a reading are finite; it has three or more."""
    doubt = doubt_of(reading3(given, row))
    for part in range(3, count):
        doubt += 0.0 * given.readings[row, part]
    return doubt == 0.0


@inlined
def take_readings(gate, now, known, given):
    """Put the readings that are in order into what is known; what was met.

    Meets REQ-BRD-002.
    """
    met = 0
    for n in range(gate.readings.shape[0]):
        checked = gate.readings[n]
        row = checked.row
        read_s = own_time(now, given.read_s[row])
        if not (known.read_s[row] <= read_s and read_s <= known.t_s):
            met |= READING_NOT_IN_ORDER
            continue
        known.read_s[row] = read_s
        take_reading(known, given, row, checked.count)
        if read_s > -math.inf:
            met |= 0 if is_number(given, row, checked.count) else READING_NOT_FINITE
            met |= READING_OLD if known.t_s - read_s > checked.oldest_s else 0
    return met


@inlined
def doubt_of_ephemeris(gate, given):
    """Zero if all parts of the ephemeris that are used are finite; else NaN."""
    doubt = 0.0
    for n in range(gate.ephemeris.shape[0]):
        used = gate.ephemeris[n]
        if used.place >= 1:
            doubt += doubt_of((given.position_x, given.position_y, given.position_z))
        if used.velocity >= 1:
            doubt += doubt_of((given.velocity_x, given.velocity_y, given.velocity_z))
        if used.field >= 1:
            doubt += doubt_of((given.model_b_x, given.model_b_y, given.model_b_z))
        if used.field_rate >= 1:
            doubt += doubt_of((given.model_b_rate_x, given.model_b_rate_y, given.model_b_rate_z))
        if used.to_sun >= 1:
            doubt += doubt_of((given.to_sun_x, given.to_sun_y, given.to_sun_z))
        if used.sunlit_fraction >= 1:
            doubt += 0.0 * given.sunlit_fraction
    return doubt


@inlined
def greatest_share(axes, bounds, v):
    """The greatest part of a bound that a vector takes; 1 where it takes less."""
    worst = 1.0
    x, y, z = v
    for n in range(axes.shape[0]):
        along = max(abs(axes[n].x * x), abs(axes[n].y * y))
        worst = max(worst, max(along, abs(axes[n].z * z)))
    for n in range(bounds.shape[0]):
        worst = max(worst, abs(bounds[n].x * x + bounds[n].y * y + bounds[n].z * z))
    return worst


@inlined
def scaled(v, share):
    """A vector that takes a share of its bounds, within them: rounding included."""
    if share > 1.0:
        part = (1.0 - 4.0 * 2.220446049250313e-16) / share
        return (part * v[0], part * v[1], part * v[2])
    return v


@inlined
def within_bounds(axes, bounds, v):
    """A vector, scaled to its bounds where it is beyond them."""
    return scaled(v, greatest_share(axes, bounds, v))


@inlined
def is_guarded(gate, board):
    """Whether a region that only guards is in another state than its first one."""
    left = False
    for n in range(gate.guards.shape[0]):
        guard = gate.guards[n]
        left = left or int(board.modes.regions[guard.region].state) != guard.first
    return left


@inlined
def forget(gate, board, blocks):
    """Let blocks remember what they do at the start."""
    for n in range(blocks.shape[0]):
        for place in range(blocks[n].m0, blocks[n].m1):
            board.memory[place] = gate.first[place]


@inlined
def has_kept_no_number(gate, board, block):
    """Whether a number in the memory of a block is not finite, and was at the start."""
    kept = False
    for place in range(block.m0, block.m1):
        lost = not math.isfinite(board.memory[place]) and math.isfinite(gate.first[place])
        kept = kept or lost
    return kept


@inlined
def begin_anew(gate, board):
    """Let the user's laws and estimators begin again that have kept no number; what was met.

    One bad reading would stay in a mean for ever, and no comparison with it would be true any more.
    Those of the package let go by themselves.
    """
    met = 0
    for n in range(gate.own.shape[0]):
        block = gate.own[n]
        if has_kept_no_number(gate, board, block):
            met = BEGUN_ANEW
            for place in range(block.m0, block.m1):
                board.memory[place] = gate.first[place]
    return met


@inlined
def drop_failed(gate, known):
    """No estimate in place of one of the user's that cannot be used: nothing of it is kept."""
    if gate.own_estimators > 0 and has_failed(known):
        put_estimate(known, UNKNOWN_ESTIMATE)


@inlined
def check_answer(gate, computer, board, made):
    """The command within its limits, and what was met.

    Meets REQ-BRD-001.
    """
    met = 0
    known = board.known[0]
    dipole, torque = made.dipole_a_m2, made.torque_n_m
    if not (is_finite(dipole) and is_finite(torque)):
        forget(gate, board, computer.law_blocks)
        dipole, torque, met = NO_COMMAND.dipole_a_m2, NO_COMMAND.torque_n_m, COMMAND_NOT_FINITE
    by_coils = greatest_share(gate.dipole_axes, gate.dipole, dipole)
    by_wheels = greatest_share(gate.torque_axes, gate.torque, torque)
    met |= COMMAND_LIMITED if by_coils > 1.0 or by_wheels > 1.0 else 0
    if gate.needs_estimate > 0:
        has_none = math.isnan(known.estimate_q_w) and math.isnan(known.estimate_omega_x)
        met |= NO_ESTIMATE if has_none else 0
    met |= GUARDED if is_guarded(gate, board) else 0
    asked = Command(dipole, torque)
    return Answer(scaled(dipole, by_coils), scaled(torque, by_wheels), met, asked)


@kernel
def gated_step(gate, computer, board, gate_now, inputs):
    """A control step for what others hand in: see the head of this file.

    `gate_now`: a record of `GATE_NOW`; `inputs`: one of `KNOWN`, whose estimate is not looked at.
    A step that is not taken commands nothing and changes nothing but the gate. Meets REQ-BRD-001,
    REQ-BRD-005.
    """
    now = gate_now[0]
    given = inputs[0]
    known = board.known[0]
    met = judge_clock(gate, now, given.t_s)
    if met > 0 and met < CLOCK_SET:
        now.status = float(met & ANY)
        return Answer(NO_COMMAND.dipole_a_m2, NO_COMMAND.torque_n_m, met, NO_COMMAND)
    is_first = now.t_s == -math.inf
    known.t_s = own_time(now, given.t_s)
    now.t_s = known.t_s
    known.coils_x, known.coils_y, known.coils_z = given.coils_x, given.coils_y, given.coils_z
    put_ephemeris(known, read_ephemeris(given))
    met |= take_readings(gate, now, known, given)
    met |= 0 if doubt_of_ephemeris(gate, given) == 0.0 else EPHEMERIS_NOT_FINITE
    answer = check_answer(gate, computer, board, control_step(computer, board))
    met |= answer.status
    if not is_first:  # in the loop each step is the first of a gate: a simulation does not do it
        met |= begin_anew(gate, board)
        drop_failed(gate, known)
    now.status = float(met & ANY)
    return Answer(answer.dipole_a_m2, answer.torque_n_m, met, answer.asked)


@kernel
def restart_estimators(gate, computer, board):
    """Let the estimators begin again; there is no estimate until they have one."""
    forget(gate, board, computer.estimator_blocks)
    put_estimate(board.known[0], UNKNOWN_ESTIMATE)


@inlined
def is_damaged(now):
    """Whether the clock of the gate shows what none does: an error of the memory."""
    began = now.t_s != -math.inf
    return not abs(now.offset_s) < _NO_CLOCK_S or (began and not abs(now.t_s) < _NO_CLOCK_S)


@inlined
def begin_clock(gate, board, now):
    """Let the clock begin again with the time of the next step, whatever was read before."""
    now.offset_s, now.t_s, now.other_s = 0.0, -math.inf, math.nan
    for n in range(gate.readings.shape[0]):
        board.known[0].read_s[gate.readings[n].row] = -math.inf


@kernel
def rebase(gate, board, gate_now, shift_s):
    """Follow a clock that has been set forward by `shift_s`; what became of it.

    A clock that is damaged begins again. Meets REQ-BRD-003, REQ-BRD-004.
    """
    if not abs(shift_s) < LATEST_S:
        return NOT_A_NUMBER
    if is_damaged(gate_now[0]):
        begin_clock(gate, board, gate_now[0])
        return DONE
    offset_s = gate_now[0].offset_s + shift_s
    if not abs(offset_s) < LATEST_S:
        return NOT_A_NUMBER
    gate_now[0].offset_s = offset_s
    return DONE


@kernel
def command_mode(computer, board, region, mode):
    """Have a region enter one of its states at the next step; what became of it.

    Meets REQ-SVR-001, REQ-BRD-004.
    """
    regions = computer.modes.regions
    if regions.shape[0] == 0:
        return NO_SUCH
    if region < 0 or region >= regions.shape[0]:
        return NO_SUCH
    if mode < regions[region].first_state or mode >= regions[region].after_state:
        return NO_SUCH
    board.modes.regions[region].commanded = float(mode)
    return DONE


@kernel
def hold(computer, board, region, on):
    """Keep the transitions of a region from firing, or let them again; what became of it.

    Meets REQ-SVR-005, REQ-BRD-004.
    """
    if computer.modes.regions.shape[0] == 0:
        return NO_SUCH
    if region < 0 or region >= computer.modes.regions.shape[0]:
        return NO_SUCH
    board.modes.regions[region].held = 1.0 if on else 0.0
    return DONE


@kernel
def set_flag(board, flag, on):
    """Raise or lower a flag; what became of it.

    Meets REQ-BRD-004.
    """
    if board.modes.flags.shape[0] == 0:
        return NO_SUCH
    if flag < 0 or flag >= board.modes.flags.shape[0]:
        return NO_SUCH
    board.modes.flags[flag] = 1.0 if on else 0.0
    return DONE


@kernel
def set_parameter(gate, board, place, value):
    """Set a number of a parameter [SI]; what became of it.

    Meets REQ-SVR-006, REQ-BRD-004.
    """
    if gate.parameters.shape[0] == 0:
        return NO_SUCH
    if place < 0 or place >= gate.parameters.shape[0]:
        return NO_SUCH
    if not math.isfinite(value):
        return NOT_A_NUMBER
    limits = gate.parameters[place]
    if limits.settable == 0:
        return FIXED
    if value < limits.least or value > limits.greatest:
        return OUT_OF_RANGE
    if limits.above > 0 and value == limits.least:
        return OUT_OF_RANGE
    if limits.below > 0 and value == limits.greatest:
        return OUT_OF_RANGE
    board.parameters[place] = value
    return DONE
