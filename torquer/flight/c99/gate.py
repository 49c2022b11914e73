"""What the gate of an exported computer checks by: readings, limits, guards."""

import itertools

import numpy as np

from torquer.computer.computer import Blocks
from torquer.computer.gate import BOUND, CHECKED, EPHEMERIS, GUARD, OWN, SETTABLE, Gate
from torquer.scenario.spec import Scenario
from torquer.spacecraft.actuators.coils import Coils
from torquer.spacecraft.actuators.reaction_wheels import ReactionWheels
from torquer.spacecraft.sensors.devices import DEVICES
from torquer.spacecraft.wheel_array.envelope import Envelope

#: How many intervals between control steps a clock may leave out unquestioned.
_GAP_STEPS = 10.0
#: By how much of its age a reading may be older than the timetable says: rounding.
_ROUNDING = 1e-9


def make_gate(
    scenario: Scenario, blocks: Blocks, needs: frozenset[str], oldest_s: tuple[float, ...]
) -> Gate:
    """The gate of a scenario's computer; `oldest_s`: of the readings of each row."""
    craft = scenario.spacecraft
    memory = [each.first_memory() for each in blocks.all()]
    return Gate(
        _readings(scenario, oldest_s),
        *_bounds(np.zeros((0, 3)) if craft.coils is None else _dipole_bounds(craft.coils)),
        *_bounds(np.zeros((0, 3)) if craft.wheels is None else _torque_bounds(craft.wheels)),
        _guards(scenario),
        _settable(blocks),
        np.concatenate([*memory, []]),
        _ephemeris(needs),
        _own_memory(blocks),
        sum(not each.is_built_in for each in blocks.estimators.values()),
        _GAP_STEPS * max(scenario.control.sample_s, scenario.control.actuate_s or 0.0),
        int(bool(needs & {"attitude", "rate"})),
    )


def _readings(scenario: Scenario, oldest_s: tuple[float, ...]) -> np.ndarray:
    counts = {row: each.count for row, each in enumerate(DEVICES)}
    counts |= {each.row: each.device.count for each in scenario.spacecraft.units()}
    rows = [
        (row, counts[row], (1.0 + _ROUNDING) * age) for row, age in enumerate(oldest_s) if age > 0.0
    ]
    return np.array(rows, CHECKED)


def _dipole_bounds(coils: Coils) -> np.ndarray:
    """Shares of each coil in a dipole, as parts of its limit (n, 3)."""
    return coils.shares() / coils.limits_a_m2()[:, None]


def _torque_bounds(wheels: ReactionWheels) -> np.ndarray:
    """Faces of the set of torques that the wheels can make, as parts of their distance (n, 3)."""
    array = wheels.array()
    normals, bounds = Envelope(array.torque_limits()[:, None] * np.array(array.axes)).half_spaces
    thick = bounds > 0.0
    return normals[thick] / bounds[thick, None]


def _settable(blocks: Blocks) -> np.ndarray:
    numbers = [
        (int(name not in each.fixed), *limits)
        for each in blocks.all()
        for name, (first, count) in each.places().items()
        for limits in each.limits[first : first + count]
    ]
    return np.array(numbers, SETTABLE)


def _ephemeris(needs: frozenset[str]) -> np.ndarray:
    """All parts of the ephemeris, if there is one."""
    return np.ones(int("ephemeris" in needs), EPHEMERIS)


def _own_memory(blocks: Blocks) -> np.ndarray:
    """Places of the memory of the user's laws and estimators that have one."""
    ends = np.cumsum([0, *(len(each.first_memory()) for each in blocks.all())]).tolist()
    pairs = zip(blocks.all(), itertools.pairwise(ends), strict=True)
    rows = [at for each, at in pairs if at[0] < at[1] and not each.is_built_in]
    return np.array(rows, OWN)


def _bounds(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The narrowest bounds along axes in one row, if there are any; then all others."""
    along = np.count_nonzero(rows, axis=1) == 1
    axes = np.abs(rows[along]).max(axis=0, keepdims=True) if along.any() else rows[:0]
    return _records(axes), _records(rows[~along])


def _records(rows: np.ndarray) -> np.ndarray:
    return np.array([tuple(row) for row in rows.tolist()], BOUND)


def _guards(scenario: Scenario) -> np.ndarray:
    modes = scenario.control.named().modes
    rows, number = [], 0
    for place, region in enumerate(modes.regions.values() if modes else ()):
        if region.only_guards:
            rows.append((place, number + [*region.states].index(region.initial)))
        number += len(region.states)
    return np.array(rows, GUARD)
