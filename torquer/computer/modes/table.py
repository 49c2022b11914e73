"""Mode tables as kernels take them: regions, states, transitions, conditions, actions. Data.

Regions are state machines side by side. Once per control step `switch_modes` looks, in each
region, at the transitions from any state and then at those of the present state, in order; the
first that fires is taken. One kernel serves every table.

A condition is true, false or unknown (a Sun out of view has no angle); a transition's conditions
hold together if all are true, and do not if one is false. True lets the hold time run, false
resets it, unknown stops it meanwhile. A transition fires once its conditions are true and have
held for `for_s` and the state has lasted `at_least_s`; or when the state has lasted `at_most_s`.
"""

import math
from typing import NamedTuple

import numpy as np

from torquer.compile.engine import inlined, without_reference_counts
from torquer.computer.interface import ROWS, SENSORS
from torquer.computer.laws.targets import NO_TARGETS, Targets
from torquer.computer.modes.coil_check import COILS_NOW, first_coils
from torquer.computer.modes.sensor_alone import SENSOR_NOW
from torquer.computer.modes.sensor_check import SENSORS_NOW, check_sensors, first_sensors
from torquer.computer.modes.signals import signal_value
from torquer.computer.modes.turning import TURNING_NOW, first_turning


def _record(integers: str, numbers: str = "") -> np.dtype:
    """Fields of eight bytes each."""
    fields = [(name, np.int64) for name in integers.split()]
    return np.dtype(fields + [(name, np.float64) for name in numbers.split()], align=True)


#: States of a region, its transitions from any state: first and the one after the last.
REGION = _record("first_state after_state first_transition after_transition")
#: Region of a state, its own transitions, its actions.
STATE = _record("region first_transition after_transition first_action after_action")
#: `at_least_s` and `at_most_s` grow by the factor `back_off` with each entry of the state but the
#: first; after `most_entries` the transition is not taken any more.
TRANSITION = _record(
    "to first_condition after_condition", "for_s at_least_s at_most_s back_off most_entries"
)
#: `sign` 1: true above the threshold, -1: below. Once true, it stays so until beyond `back`. Both
#: are first values: those that hold are in CONDITION_NOW, where a command may change them.
#: `since_entry` 1: of the signal's change since the state was entered.
CONDITION = _record("signal index since_entry", "sign threshold back")
#: What a state does: `kind` is one of those below.
ACTION = _record("kind index", "value")
#: Law and its factor; estimator; parameter (place in the flat array) and value, set on entry;
#: whether coils and wheels may work; axis along which no dipole is commanded; law that does not
#: work, whichever state names it.
LAW, ESTIMATOR, SET, COILS, WHEELS, AXIS_OFF, LAW_OFF, SELECT = range(8)

#: What changes. `to`: the state to enter next, `commanded`: the one that is commanded from outside,
#: -1: none; `held`: 1 while no transition may fire.
REGION_NOW = _record("", "state since_s to commanded held")
STATE_NOW = _record("", "entries entered_s")
#: Since when the conditions have been true, later by the time for which they were unknown.
TRANSITION_NOW = _record("", "true_since_s")
#: `at_entry`: the signal's first known value in the state; minus infinity before.
CONDITION_NOW = _record("", "latched at_entry threshold back")
CLOCK = _record("", "evaluated_s")
#: What the checks of sensors and coils remember.
CHECKS_NOW = np.dtype([*SENSORS_NOW, *COILS_NOW, *TURNING_NOW])

NEVER_S = -math.inf
#: Three-valued logic: the least of several is their conjunction.
FALSE, UNKNOWN, TRUE = 0.0, 0.5, 1.0


class Noise(NamedTuple):
    """What the checks of sensors assume: noise of a component of magnetometer [T], Sun sensors
    [rad] and gyro [rad/s]; difference [rad/s] of rates that is no contradiction.
    """

    field_t: float = 0.0
    sun_rad: float = 0.0
    rate_rad_s: float = 0.0
    rate_tolerance: float = 0.0


class ModeTable(NamedTuple):
    """The constants; axis, target, inertia (xx, yy, zz, xy, xz, yz), fixed momentum of a wheel
    [body] and the wanted attitude to the orbital (`orbital` 1) or the inertial frame, or by targets
    (`follows_targets` 1), are what signals take; `noise` is what checks of sensors and coils take,
    zeros if there are none, and `oldest_s`: how old readings of each sensor become by the
    timetable.
    """

    regions: np.ndarray
    states: np.ndarray
    transitions: np.ndarray
    conditions: np.ndarray
    actions: np.ndarray
    axis: tuple = (0.0, 0.0, 0.0)
    target: tuple = (0.0, 0.0, 0.0)
    target_is_sun: float = 0.0
    inertia_kg_m2: tuple = (0.0,) * 6
    wheel_momentum_n_m_s: tuple = (0.0, 0.0, 0.0)
    orbital: float = 0.0
    q_wanted: tuple = (0.0, 0.0, 0.0, 1.0)
    follows_targets: float = 0.0
    targets: Targets = NO_TARGETS
    noise: Noise = Noise()
    oldest_s: tuple = (0.0,) * ROWS
    kinds: tuple = (*range(len(SENSORS)), *(-1,) * (ROWS - len(SENSORS)))

    @property
    def sensors(self) -> int:
        """Number of sensors, each of several counted."""
        return sum(kind >= 0 for kind in self.kinds)

    @property
    def is_checked(self) -> bool:
        """Whether sensors and coils are checked."""
        return self.noise.rate_tolerance > 0.0


class ModeState(NamedTuple):
    """All that changes, in records of numbers.

    `sensors`, `checks`: empty where sensors and coils are not checked. `flags`: of the table, 1
    for those that are raised from outside.
    """

    regions: np.ndarray
    states: np.ndarray
    transitions: np.ndarray
    conditions: np.ndarray
    clock: np.ndarray
    sensors: np.ndarray
    checks: np.ndarray
    flags: np.ndarray


#: Laws that always work.
NO_MODES = ModeTable(
    *(np.zeros(0, dtype) for dtype in (REGION, STATE, TRANSITION, CONDITION, ACTION))
)


def first_state(table: ModeTable, initial, flags: int = 0) -> ModeState:
    """Before the first evaluation, which enters the `initial` states, one number per region."""
    regions = np.zeros(len(table.regions), REGION_NOW)
    regions["state"] = regions["to"] = initial
    regions["since_s"], regions["commanded"] = NEVER_S, -1.0
    states = np.zeros(len(table.states), STATE_NOW)
    states["entered_s"] = NEVER_S
    sensors = np.zeros(table.sensors if table.is_checked else 0, SENSOR_NOW)
    for name in ("read_s", "failed_s", "blamed_s"):
        sensors[name] = NEVER_S
    conditions = np.zeros(len(table.conditions), CONDITION_NOW)
    conditions["at_entry"] = -math.inf
    for name in ("threshold", "back"):
        conditions[name] = table.conditions[name]
    checks = np.zeros(int(table.is_checked), CHECKS_NOW)
    first_sensors(checks)
    first_coils(checks)
    first_turning(checks)
    return ModeState(
        regions,
        states,
        np.full(len(table.transitions), NEVER_S).view(TRANSITION_NOW),
        conditions,
        np.full(1, NEVER_S).view(CLOCK),
        sensors,
        checks,
        np.zeros(flags),
    )


@inlined
def evaluate_condition(table, state, k, place):
    """Whether a condition is true; it remembers that it was (hysteresis)."""
    row, now = table.conditions[place], state.conditions[place]
    value = signal_value(row["signal"], table, state, k, row["index"])
    if math.isnan(value):
        return UNKNOWN
    if row["since_entry"] == 1:
        if now["at_entry"] == -math.inf:
            now["at_entry"] = value
        value -= now["at_entry"]
    beyond = row["sign"] * (value - now["threshold"]) > 0.0
    stays = now["latched"] > 0.0 and row["sign"] * (value - now["back"]) >= 0.0
    now["latched"] = 1.0 if beyond or stays else 0.0
    return TRUE if beyond or stays else FALSE


@inlined
def held_for_s(table, state, k, place):
    """How long the conditions of a transition have been true [s]; below zero if they are not."""
    row, now = table.transitions[place], state.transitions[place]
    truth = TRUE
    for condition in range(row["first_condition"], row["after_condition"]):
        one = evaluate_condition(table, state, k, condition)
        truth = one if one < truth else truth  # Numba's `min` does not compile for CUDA
    if truth == FALSE:
        now["true_since_s"] = NEVER_S
    elif truth == UNKNOWN:
        now["true_since_s"] += k.t_s - state.clock[0]["evaluated_s"]
    elif now["true_since_s"] == NEVER_S:
        now["true_since_s"] = k.t_s
    return k.t_s - now["true_since_s"] if truth == TRUE else -1.0


@inlined
def next_state(table, state, k, region):
    """The state that a region is to enter; -1: none.

    Transitions from any state are tried first, then the present state's own. One from any state is
    reset while the region is in the state that it leads to.
    """
    row, now = table.regions[region], state.regions[region]
    own, spent_s = table.states[int(now["state"])], k.t_s - now["since_s"]
    from_any = row["after_transition"] - row["first_transition"]
    own_ones = own["after_transition"] - own["first_transition"]
    to = -1.0
    for i in range(from_any + own_ones):
        place = row["first_transition"] + i
        if i >= from_any:
            place = own["first_transition"] + i - from_any
        transition = table.transitions[place]
        if i < from_any and transition["to"] == now["state"]:
            reset(table, state, place)
            continue
        held_s = held_for_s(table, state, k, place)
        entries = state.states[int(now["state"])]["entries"]
        longer = transition["back_off"] ** (entries - 1.0)
        done = held_s >= transition["for_s"] and spent_s >= longer * transition["at_least_s"]
        done = done or spent_s >= longer * transition["at_most_s"]
        if to < 0.0 and done and entries <= transition["most_entries"]:
            to = float(transition["to"])
    return to


@inlined
def reset(table, state, place):
    """Forget what a transition's conditions have been: since when true, latched, first values."""
    row = table.transitions[place]
    state.transitions[place]["true_since_s"] = NEVER_S
    for condition in range(row["first_condition"], row["after_condition"]):
        state.conditions[condition]["latched"] = 0.0
        state.conditions[condition]["at_entry"] = -math.inf


@inlined
def enter_next(table, state, t_s, region):
    """Leave the region's state for the next one."""
    now = state.regions[region]
    left, entered = table.states[int(now["state"])], int(now["to"])
    for place in range(left["first_transition"], left["after_transition"]):
        reset(table, state, place)
    now["state"], now["since_s"], now["to"] = now["to"], t_s, -1.0
    state.states[entered]["entries"] += 1.0
    state.states[entered]["entered_s"] = t_s


@inlined
def obey(now, evaluated_s):
    """Enter the state that is commanded, whatever the transitions say; none while held.

    The conditions of a held region go on being looked at: one that has held long enough fires as
    soon as the region is released.
    """
    if now["held"] > 0.0 and evaluated_s > NEVER_S:
        now["to"] = -1.0
    if now["commanded"] >= 0.0:
        now["to"], now["commanded"] = now["commanded"], -1.0


@inlined
def check(table, state, k):
    """Bring suspicions of sensors and coils up to date."""
    check_sensors(without_reference_counts(table), without_reference_counts(state), k)


@inlined
def switch_modes(table, state, k):
    """Whether a region has entered a state; the first evaluation enters the initial ones.

    All conditions see the states before this evaluation; those of a state are looked at from the
    evaluation after its first on.
    """
    table, state = without_reference_counts(table), without_reference_counts(state)
    if state.clock[0]["evaluated_s"] > NEVER_S:
        for region in range(len(table.regions)):
            state.regions[region]["to"] = next_state(table, state, k, region)
    for region in range(len(table.regions)):
        obey(state.regions[region], state.clock[0]["evaluated_s"])
    changed = False
    for region in range(len(table.regions)):
        if state.regions[region]["to"] >= 0.0:
            enter_next(table, state, k.t_s, region)
            changed = True
    state.clock[0]["evaluated_s"] = k.t_s
    return changed
