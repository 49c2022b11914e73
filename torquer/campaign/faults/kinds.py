"""Single faults of a scenario: of each sensor that it describes, each coil, each wheel, computer.

A fault is data: the key of a list of failures, and the failure that is added to it.
"""

from collections.abc import Iterator
from typing import NamedTuple, get_args

from torquer.scenario.change import value_at, with_values
from torquer.scenario.spec import Scenario
from torquer.spacecraft.sensors.devices import Flown

#: Failures of every sensor, by their names here.
OF_SENSORS = {
    "silent": {"kind": "silent"},
    "stuck": {"kind": "stuck"},
    "zeros": {"kind": "zeros"},
    "not a number": {"kind": "nan"},
    "reversed": {"kind": "reversed"},
    **{f"reversed {axis}": {"kind": "reversed", "axis": axis} for axis in "xyz"},
    **{f"swapped {axes}": {"kind": "swapped", "axes": axes} for axes in ("xy", "yz", "xz")},
}
#: Size of the bias about one axis, and of the noise, by the unit of a sensor's errors.
SIZES = {
    "nt": (5000.0, 20000.0), "nt_s": (500.0, 2000.0), "deg_s": (0.3, 3.0), "deg": (20.0, 30.0),
}  # fmt: skip
#: For how long a computer is halted, and until it is back after a restart [s].
HALTED_S, RESTART_S = 3600.0, 60.0


class Fault(NamedTuple):
    """A single fault: what fails and how; `key` of the list of failures to which it is added.

    `failure`: as in a scenario file, without its times; `time_key`: the key of its beginning.
    `lasts_s`: how long it lasts; None: to the end of the run.
    """

    device: str
    kind: str
    key: str
    failure: dict
    time_key: str = "from_s"
    lasts_s: float | None = None

    @property
    def name(self) -> str:
        """What fails and how, such as "gyro stuck"."""
        return f"{self.device} {self.kind}"

    def strikes(self, scenario: Scenario, at_s: float) -> Scenario:
        """The scenario with this fault from a time on, in addition to failures of its own."""
        times = {self.time_key: at_s}
        if self.lasts_s is not None:
            times["until_s"] = at_s + self.lasts_s
        there = [_list_given(failure) for failure in value_at(scenario, self.key)]
        return with_values(scenario, {self.key: [*there, {**self.failure, **times}]})


def _list_given(failure: dict) -> dict:
    return {key: value for key, value in failure.items() if value is not None}


def find_faults(scenario: Scenario) -> list[Fault]:
    """All single faults of a scenario: of its sensors that may fail, and of all else."""
    craft = scenario.spacecraft
    sensors = {key: craft.flown()[key] for key in craft.sensors_that_may_fail()}
    return [
        *(fault for key, sensor in sensors.items() for fault in _sensor_faults(key, sensor)),
        *_coil_faults(scenario),
        *_wheel_faults(scenario),
        *_computer_faults(),
    ]


def _sensor_faults(name: str, sensor: Flown) -> Iterator[Fault]:
    device, key = sensor.said, f"spacecraft.{name}.failures"
    failing = get_args(type(sensor.spec).model_fields["failures"].annotation)[0]
    for kind, failure in OF_SENSORS.items():
        if failure["kind"] in failing.kinds():
            yield Fault(device, kind, key, failure)
    if not failing.error_keys:
        return
    bias_key, noise_key = failing.error_keys
    bias, noise = SIZES[bias_key.removeprefix("bias_")]
    for number, axis in enumerate("xyz"):
        vector = [bias if k == number else 0.0 for k in range(3)]
        yield Fault(device, f"bias {axis}", key, {"kind": "bias", bias_key: vector})
    yield Fault(device, "noise", key, {"kind": "noise", noise_key: noise})


def _coil_faults(scenario: Scenario) -> Iterator[Fault]:
    coils, key = scenario.spacecraft.coils, "spacecraft.coils.failures"
    if coils is None:
        return
    for number, limit in enumerate(coils.limits_a_m2().tolist()):
        device = f"coil {number}"
        yield Fault(device, "dead", key, {"coil": number, "kind": "dead"})
        yield Fault(device, "reversed", key, {"coil": number, "kind": "reversed"})
        stuck = {"coil": number, "kind": "stuck", "dipole_a_m2": limit}
        yield Fault(device, "stuck on", key, stuck)


def _wheel_faults(scenario: Scenario) -> Iterator[Fault]:
    """The motor of each wheel that works; the computer does not learn of it."""
    wheels = scenario.spacecraft.wheels
    if wheels is None:
        return
    failed = {*wheels.lost, *(failure.wheel for failure in wheels.failures)}
    never_s = scenario.length_s
    for number in range(len(wheels.layout.rows())):
        if number not in failed:
            failure = {"wheel": number, "noticed_after_s": never_s}
            yield Fault(f"wheel {number}", "dead", "spacecraft.wheels.failures", failure, "time_s")


def _computer_faults() -> Iterator[Fault]:
    key = "control.failures"
    halted = f"halted for {HALTED_S / 3600.0:g} h"
    yield Fault("computer", halted, key, {"kind": "halted"}, lasts_s=HALTED_S)
    yield Fault("computer", "restarted", key, {"kind": "restarted"}, lasts_s=RESTART_S)
