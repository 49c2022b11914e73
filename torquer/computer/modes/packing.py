"""From the names and units of a mode table to the numbers that kernels take."""

import math
from collections.abc import Iterable, Mapping
from itertools import accumulate, pairwise

import numpy as np

from torquer.computer.interface import ROWS, SENSORS
from torquer.computer.laws.held import Attitude
from torquer.computer.modes import table
from torquer.computer.modes.signals import AXES, NUMBER_OF, SIGNALS, UNITS
from torquer.maths.geometry.vec3 import as_symmetric

#: Rounding of a time must not cost a reading [s].
_ROUNDING_S = 1e-6


def check_choice(key: str, names: Iterable[str], received) -> None:
    """ValueError that lists `names`, unless `received` is one of them."""
    if received not in names:
        known = ", ".join(names) or "none"
        raise ValueError(f"{key}: must be one of {known}; received {received!r}")


def pack_modes(
    modes,
    laws: Mapping,
    estimators: Mapping,
    parameters: Mapping,
    sensors: Mapping,
    several: tuple[int, ...],
    wanted: Attitude | None,
):
    """(table, state before the first evaluation) of `modes`, a `torquer.computer.modes.spec.Modes`.

    `wanted`: what the law holds that `attitude_of` names.

    Rows lie in the order of the text: a region's transitions from any state, then those of its
    states.
    """
    states = [(name, key) for name, region in modes.regions.items() for key in region.states]
    numbers = {pair: number for number, pair in enumerate(states)}
    groups = {}
    for name, region in modes.regions.items():
        groups[name, None] = region.transitions
        groups |= {(name, key): state.transitions for key, state in region.states.items()}
    transitions = [(pair[0], one) for pair, group in groups.items() for one in group]
    conditions = [(name, condition) for name, one in transitions for condition in one.when]
    actions = [
        _actions(modes, *pair, laws, estimators, parameters) + _selections(modes, *pair, sensors)
        for pair in states
    ]
    spans_of = dict(zip(groups, _spans(groups.values()), strict=True))
    packed_table = table.ModeTable(
        np.array(_region_rows(modes, spans_of), table.REGION),
        np.array(_state_rows(modes, states, spans_of, actions), table.STATE),
        np.array(_transition_rows(transitions, numbers), table.TRANSITION),
        np.array(
            [_condition_row(modes, *one, numbers, sensors) for one in conditions], table.CONDITION
        ),
        np.array([one for of_state in actions for one in of_state], table.ACTION),
        **_directions(modes),
        **_wanted(wanted if modes.attitude is None else modes.attitude.held()),
        kinds=(*range(len(SENSORS)), *several, *(-1,) * (ROWS - len(SENSORS) - len(several))),
    )
    initial = [numbers[name, region.initial] for name, region in modes.regions.items()]
    return packed_table, table.first_state(packed_table, initial, len(modes.flags))


def _spans(groups: Iterable) -> list[tuple[int, int]]:
    """First place of each group and the one after its last, all groups in a row."""
    return list(pairwise(accumulate(map(len, groups), initial=0)))


def _region_rows(modes, spans_of: dict) -> list[tuple]:
    spans = _spans(region.states for region in modes.regions.values())
    return [(*span, *spans_of[name, None]) for name, span in zip(modes.regions, spans, strict=True)]


def _state_rows(modes, states: list, spans_of: dict, actions: list) -> list[tuple]:
    region = {name: number for number, name in enumerate(modes.regions)}
    spans = zip(states, _spans(actions), strict=True)
    return [(region[pair[0]], *spans_of[pair], *span) for pair, span in spans]


def _transition_rows(transitions: list, numbers: dict) -> list[tuple]:
    spans = _spans(transition.when for _, transition in transitions)
    return [
        (numbers[name, transition.to], *span, *_times(transition))
        for (name, transition), span in zip(transitions, spans, strict=True)
    ]


def _times(transition) -> tuple[float, ...]:
    """`for_s`, `at_least_s`, `at_most_s`, `back_off`, `most_entries`."""

    def time(value_s, otherwise_s):
        return otherwise_s if value_s is None else max(0.0, value_s - _ROUNDING_S)

    at_least_s = math.inf if transition.by_time_only else time(transition.at_least_s, 0.0)
    at_most_s = time(transition.at_most_s, math.inf)
    most = math.inf if transition.most_entries is None else float(transition.most_entries)
    return time(transition.for_s, 0.0), at_least_s, at_most_s, transition.back_off, most


def _condition_row(modes, region: str, condition, numbers: dict, sensors: Mapping) -> tuple:
    """`region`: the one whose transition has the condition."""
    unit = SIGNALS[condition.signal].unit
    sign, back, early = condition.sign, condition.back, _ROUNDING_S if unit == "s" else 0.0
    until = sign * math.inf if back is None else back * UNITS[unit] - early
    index = _index(modes, region, condition, numbers, sensors)
    since_entry, number = int(condition.since_entry), NUMBER_OF[condition.signal]
    return number, index, since_entry, sign, condition.limit * UNITS[unit] - early, until


def _index(modes, region: str, condition, numbers: dict, sensors: Mapping) -> int:
    if condition.state is not None:
        return numbers[modes.find_region("when", condition), condition.state]
    if condition.sensor is not None:
        check_choice("sensor", sensors, condition.sensor)
        return sensors[condition.sensor]
    if condition.coil is not None:
        return AXES.index(condition.coil)
    if condition.flag is not None:
        return modes.flags.index(condition.flag)
    return [*modes.regions].index(region)


def _actions(modes, region: str, name: str, laws, estimators, parameters) -> list[tuple]:
    """What a state does; every name must be known."""
    state, key = modes.regions[region].states[name], f"{modes.key_of(region)}states.{name}"
    found = []
    for law, factor in state.laws.items():
        check_choice(f"{key}.laws", laws, law)
        found.append((table.LAW, laws[law], factor))
    if state.estimator is not None:
        check_choice(f"{key}.estimator", estimators, state.estimator)
        found.append((table.ESTIMATOR, estimators[state.estimator], 0.0))
    for parameter, value in state.set.items():
        found += _settings(f"{key}.set", parameter, value, parameters)
    found += [(table.AXIS_OFF, AXES.index(axis), 0.0) for axis in state.coils_off]
    for law in state.laws_off:
        check_choice(f"{key}.laws_off", laws, law)
        found.append((table.LAW_OFF, laws[law], 0.0))
    for kind, switch in ((table.COILS, state.coils), (table.WHEELS, state.wheels)):
        if switch is not None:
            found.append((kind, 0, float(switch == "on")))
    return found


def _selections(modes, region: str, name: str, sensors: Mapping) -> list[tuple]:
    """Actions that choose one of several devices of a kind."""
    key = f"{modes.key_of(region)}states.{name}.select"
    found = []
    for kind, unit in modes.regions[region].states[name].select.items():
        check_choice(key, SENSORS, kind)
        check_choice(f"{key}.{kind}", sensors, unit)
        found.append((table.SELECT, SENSORS.index(kind), float(sensors[unit])))
    return found


def _settings(key: str, parameter: str, value, parameters: Mapping) -> list[tuple]:
    """Actions that set the numbers of one parameter."""
    of_law = [name for name in parameters if name.startswith(parameter.partition(".")[0] + ".")]
    check_choice(key, of_law or parameters, parameter)
    first, count = parameters[parameter]
    numbers = value if isinstance(value, tuple) else (value,)
    if len(numbers) != count:
        raise ValueError(f"{key}: {parameter} must have {count} numbers; received {len(numbers)}")
    return [(table.SET, first + i, number) for i, number in enumerate(numbers)]


def _directions(modes) -> dict:
    """Axis, target, inertia, wheel, noise; zeros for what no signal needs."""
    zeros = (0.0, 0.0, 0.0)
    sun, inertia = modes.target == "sun", modes.inertia_kg_m2
    return {
        "axis": modes.axis or zeros,
        "target": zeros if sun or modes.target is None else modes.target,
        "target_is_sun": float(sun),
        "inertia_kg_m2": zeros + zeros if inertia is None else as_symmetric(inertia),
        "wheel_momentum_n_m_s": modes.wheel_momentum_n_m_s or zeros,
        "noise": table.Noise() if modes.noise is None else modes.noise.pack(),
    }


def _wanted(held: Attitude | None) -> dict:
    """The wanted attitude, or the targets that give it; nothing where no signal refers to one."""
    if held is None:
        return {}
    if held.targets:
        return {"follows_targets": 1.0, "targets": held.targets}
    return {"orbital": float(held.orbital), "q_wanted": held.q_wanted}
