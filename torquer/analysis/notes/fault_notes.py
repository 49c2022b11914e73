"""Which single faults nothing in a mode table can notice, by what its conditions observe.

The argument uses no flight. A sensor that is silent, is stuck or reads zeros says the same all the
time. A condition about this sensor alone then learns nothing, unless it is about the age of the
reading (silence) or a limit that zeros fall below. A condition that observes another device, too,
compares the two. One that observes the motion by other devices sees the fault by its effect, if it
has one; so do all conditions about the motion for a coil.
"""

from collections.abc import Iterator
from typing import NamedTuple

from torquer.computer.modes.signals import SIGNALS
from torquer.computer.modes.spec import Condition, Modes
from torquer.scenario.spec import Scenario
from torquer.spacecraft.failures import in_words

SILENT, STUCK, ZEROS = "silent", "stuck", "zeros"
COILS = "coils"
#: Estimates without an estimator: the sensors of rate and attitude.
_TRIVIAL: dict[str, dict[str, set[str]]] = {
    "attitude_sensor": {"rate": {"gyro"}, "attitude": {"attitude_sensor"}, "estimator": set()},
    "law": {"rate": {"magnetometer"}, "attitude": {"magnetometer"}, "estimator": set()},
    "none": {"rate": set(), "attitude": set(), "estimator": set()},
}
#: Units of signals about the motion.
_OF_MOTION = ("deg", "deg/s")


class Unnoticed(NamedTuple):
    """Faults in words; `at_all`: no condition can notice them; `by_motion`: at most one about the
    motion that follows."""

    at_all: list[str]
    by_motion: list[str]


class _Seen(NamedTuple):
    """A condition and the devices that it observes."""

    condition: Condition
    devices: frozenset[str]

    @property
    def of_motion(self) -> bool:
        return SIGNALS[self.condition.signal].unit in _OF_MOTION and bool(self.devices)

    def shows(self, device: str, kind: str) -> bool:
        """Whether it can notice a fault of a device by itself or by comparison."""
        if device not in self.devices:
            return False
        if self.devices != {device} or "sensor" in SIGNALS[self.condition.signal].needs:
            return self.devices != {device} or kind == SILENT
        return kind == ZEROS and self.condition.below is not None and not self.of_motion


def unnoticed_faults(scenario: Scenario) -> Unnoticed:
    """The single faults that nothing in the modes of a scenario can notice; none without modes."""
    modes = scenario.control.named().modes
    if modes is None:
        return Unnoticed([], [])
    seen = [*_conditions(scenario, modes)]
    found: dict[bool, list[str]] = {False: [], True: []}
    for device, kinds in _faults(scenario):
        missed = [kind for kind in kinds if not any(each.shows(device, kind) for each in seen)]
        if missed:
            by_motion = any(each.of_motion and device not in each.devices for each in seen)
            found[by_motion].append(f"{in_words(device)} {', '.join(missed)}")
    return Unnoticed(found[False], found[True])


def fault_lines(scenario: Scenario) -> list[str]:
    """Single faults that go unnoticed, as lines of text."""
    return lines_of(unnoticed_faults(scenario))


def lines_of(unnoticed: Unnoticed) -> list[str]:
    """What goes unnoticed, as lines of text."""
    at_all, by_motion = unnoticed
    lines = [f"no condition of the modes can notice: {'; '.join(at_all)}"] if at_all else []
    if by_motion:
        lines.append(f"noticed at most by the motion that follows: {'; '.join(by_motion)}")
    return lines


def _faults(scenario: Scenario) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Devices and their faults."""
    craft = scenario.spacecraft
    for key in craft.sensors_that_may_fail():
        yield craft.flown()[key].name, (SILENT, STUCK, ZEROS)
    if scenario.spacecraft.coils is not None:
        yield COILS, ("dead", "reversed", "stuck on")


def _conditions(scenario: Scenario, modes: Modes) -> Iterator[_Seen]:
    sources = _sources(scenario, modes)
    for _, condition in modes.all_conditions():
        devices: set[str] = set()
        for name in SIGNALS[condition.signal].sources:
            own = {condition.sensor} if name == "sensor" else {name}
            devices |= sources.get(name, own)
        yield _Seen(condition, frozenset(devices))


def _sources(scenario: Scenario, modes: Modes) -> dict[str, set[str]]:
    """The sensors from which estimators in use take rate and attitude, and which they compare."""
    control = scenario.control
    specs = {"estimator": control.estimator, **control.estimators}
    chosen = {state.estimator for state in modes.states()} - {None} | {"estimator"}
    craft = scenario.spacecraft
    every = {craft.flown()[key].name for key in craft.sensors_that_may_fail()}
    found: dict[str, set[str]] = {"rate": set(), "attitude": set(), "estimator": set()}
    for name in chosen:
        kind = specs[name].kind if name in specs else name
        own = _TRIVIAL.get(kind, dict.fromkeys(found, every))
        found = {what: found[what] | own[what] for what in found}
    return found
