"""Causes of errors that a scenario has, each with the change that removes it: the one list of them.

Errors of devices come from their data sheets, torques from the table of disturbances. A pointing
budget has a line for each; a counter-test of a design flies without all of a group.

Classes are those of the ESA pointing error engineering handbook (ESSB-HB-E-003): constant in a
flight and random over the ensemble, periodic in the orbit, random, and drift.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from torquer.base.spec import Spec
from torquer.computer.estimation.sensors import SensorReadings
from torquer.environment.ephemeris import EphemerisModels
from torquer.scenario.spec import Scenario
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.disturbance import Disturbance

CONSTANT, PERIODIC, RANDOM, DRIFT = "constant", "periodic", "random", "drift"
GRAVITY, DIPOLE, AIR, HELD = "gravity gradient", "residual dipole", "air and light", "held torque"
TORQUE, FRICTION = "other torques", "friction of the wheels"
NOISE, BIAS, STEPS = "noise", "bias", "steps of devices"
COUPLING, RANGE = "field of the coils", "ranges of sensors"
GAPS = "failures and missing readings"
MODELS, SAMPLING = "models on board", "sampling and lag"
#: What is removed at once, in the order of answers.
GROUPS = (GRAVITY, DIPOLE, AIR, HELD, TORQUE, FRICTION, NOISE, BIAS, STEPS, COUPLING, RANGE, GAPS,
          MODELS, SAMPLING)  # fmt: skip
#: Those with which a law is designed, and without which it may be worse.
COUNTED_ON = (GRAVITY, SAMPLING)
#: Control step [s] that counts as continuous control.
_QUICK_S = 1.0
#: Errors by what `DataSheet` calls them: word, class, group.
OF_SHEETS = {
    "noise": ("noise", RANDOM, NOISE),
    "noise_about": ("noise", RANDOM, NOISE),
    "white": ("noise", RANDOM, NOISE),
    "random_scale": ("random error", RANDOM, NOISE),
    "bias": ("bias", CONSTANT, BIAS),
    "drift": ("drift", DRIFT, BIAS),
    "instability": ("instability", DRIFT, BIAS),
    "scale": ("scale", CONSTANT, BIAS),
    "misalignment": ("mounting", CONSTANT, BIAS),
    "albedo": ("albedo", PERIODIC, BIAS),
    "height": ("height", PERIODIC, BIAS),
    "soft_iron": ("soft iron", PERIODIC, BIAS),
    "resolution": ("resolution", RANDOM, STEPS),
    "quantum": ("resolution", RANDOM, STEPS),
    "by_coils": ("field of the coils", PERIODIC, COUPLING),
    "by_each_coil": ("field of the coils", PERIODIC, COUPLING),
    "by_driver": ("field of the coils", PERIODIC, COUPLING),
}
#: Errors that stand in no data sheet: word, class, group, keys of a device of any kind.
OF_KEYS = (
    ("dead band", RANDOM, STEPS, ("dead_band_a_m2",)),
    ("friction", PERIODIC, FRICTION,
     ("stiction_n_m", "coulomb_friction_n_m", "viscous_friction_n_m_s")),
    ("failures", PERIODIC, GAPS, ("failures", "lost", "polarity")),
    ("range", PERIODIC, RANGE, ("range_nt", "range_nt_s", "range_deg_s")),
    ("missing readings", PERIODIC, GAPS,
     ("rate_limit_deg_s", "sun_exclusion_deg", "moon_exclusion_deg", "earth_exclusion_deg")),
    ("times", PERIODIC, SAMPLING, ("sample_s", "delay_s", "lag_s", "pwm_period_s", "pwm_place")),
)  # fmt: skip
#: Torques by key of `[disturbance]`: name, words, class, group; None for what is no torque.
TORQUES: dict[str, tuple[str, str, str, str] | None] = {
    "constant_torque_n_m": ("constant_torque", "constant torque", CONSTANT, HELD),
    "random_torque_n_m": ("random_torque", "random torque", RANDOM, HELD),
    "random_hold_s": None,
    "solar_pressure": ("solar_pressure", "solar pressure", PERIODIC, AIR),
    "residual_dipole": ("oscillating_dipole", f"{DIPOLE}, along the orbit", PERIODIC, DIPOLE),
    "own": ("own", "torques of your own", PERIODIC, TORQUE),
}
#: By what word laws say that they read a device that every satellite has.
_NEEDS = {"magnetometer": "magnetometer", "gyro": "rate", "attitude_sensor": "attitude",
          "wheels": "tachometers"}  # fmt: skip


class Cause(NamedTuple):
    """A cause: name, words, class, group; `off`: values by keys of the scenario that remove it.

    `given`: numbers or vectors at some of these keys, of which a part is a smaller cause.
    """

    name: str
    label: str
    kind: str
    group: str
    off: Mapping[str, Any] = {}
    given: Mapping[str, Any] = {}

    @property
    def drawn(self) -> dict[str, float]:
        """Standard deviations of what each flight draws about zero on each axis, by key."""
        if self.kind != CONSTANT:
            return {}
        return {key: float(np.sqrt(np.mean(np.square(each)))) for key, each in self.given.items()}

    @property
    def differs(self) -> bool:
        """Whether flights differ by it."""
        return self.kind in (CONSTANT, RANDOM, DRIFT)


def causes_of(scenario: Scenario) -> list[Cause]:
    """The causes that a scenario has, with errors of sensors that nothing on board may read."""
    return _causes(scenario, [*scenario.spacecraft.devices()])


def acting_causes(scenario: Scenario) -> list[Cause]:
    """Those that its flights have: without errors of sensors that nothing on board reads."""
    craft = scenario.spacecraft
    return _causes(scenario, [key for key in craft.devices() if is_read(scenario, key)])


def _causes(scenario: Scenario, read: list[str]) -> list[Cause]:
    return [*_torques(scenario), *_devices(scenario, read), *_of_computer(scenario)]


def _of_keys(place: str, table: Spec, keys: Iterable[str]) -> tuple[dict, dict]:
    """Values without the keys of a table that are not as they are when left out; numbers there."""
    off, given = {}, {}
    for key in keys:
        if key not in type(table).model_fields:
            continue
        value = getattr(table, key)
        nothing = type(table).model_fields[key].get_default(call_default_factory=True)
        if value != nothing and any(_parts(value)):
            off[f"{place}.{key}"] = nothing
            if all(isinstance(each, int | float) for each in _parts(value)):
                given[f"{place}.{key}"] = value
    return off, given


def _parts(value) -> list:
    """A value, or those of a vector or matrix."""
    if isinstance(value, list | tuple):
        return [part for each in value for part in _parts(each)]
    return [value]


def _devices(scenario: Scenario, read: list[str]) -> Iterator[Cause]:
    """Errors of the devices: those of a sensor where something reads it."""
    flown = scenario.spacecraft.flown()
    for key, device in scenario.spacecraft.devices().items():
        is_read = key in read
        said = flown[key].said if key in flown else f"{device.sheet.name}s"
        for word, kind, group, keys in _rows(device.sheet) if is_read else ():
            yield from _of_device(key, device, (said, word), kind, group, keys)
        for word, kind, group, keys in OF_KEYS if is_read or key not in flown else ():
            label = flown[key].said if key in flown else key
            yield from _of_device(key, device, (label, word), kind, group, keys)


def _rows(sheet: DataSheet) -> list[tuple]:
    """Rows as those of `OF_KEYS` of a data sheet, keys of one word together."""
    named: dict[tuple, list[str]] = {}
    for what, row in OF_SHEETS.items():
        if key := getattr(sheet, what):
            named.setdefault(row, []).append(key)
    return [(*row, keys) for row, keys in named.items()]


def _of_device(key: str, device, words, kind: str, group: str, keys) -> Iterator[Cause]:
    off, given = _of_keys(f"spacecraft.{key}", device, keys)
    if not off:
        return
    if key == "coils" and group == BIAS:
        yield Cause("residual_dipole", DIPOLE, kind, DIPOLE, off, given)
    else:
        name = f"{key} {words[1]}".replace(" ", "_")
        yield Cause(name, ": ".join(words), kind, group, off, given)


def is_read(scenario: Scenario, key: str) -> bool:
    """Whether anything on board may read a device: what files of a user and modes read is not
    looked up."""
    control, flown = scenario.control, scenario.spacecraft.flown()
    laws, known = control.named().laws, control.named().known_laws()
    is_plain = control.modes is None and isinstance(control.estimator, SensorReadings)
    if key == "coils" or not is_plain or len(known) < len(laws):
        return True
    needs = frozenset().union(*(law.needs for law in known.values()))
    kind = flown[key].device.kind if key in flown else key
    return (_NEEDS[kind] if kind in _NEEDS else flown[key].device.need) in needs


def _torques(scenario: Scenario) -> Iterator[Cause]:
    craft, given = scenario.spacecraft, scenario.disturbance
    if scenario.environment.gravity_gradient:
        off = {"environment.gravity_gradient": False}
        yield Cause("gravity_gradient", "gravity gradient", PERIODIC, GRAVITY, off)
    if craft.aerodynamics:
        yield Cause("air", "aerodynamic", PERIODIC, AIR, _without_air(scenario))
    magnets = ("permanent_magnet_a_m2", "hysteresis_rods")
    off, _ = _of_keys("spacecraft", craft, magnets)
    if off:
        yield Cause("magnets", "magnets and rods", PERIODIC, TORQUE, off)
    for key in Disturbance.model_fields:
        row = TORQUES.get(key, (key, key.replace("_", " "), PERIODIC, TORQUE))
        off, sizes = _of_keys("disturbance", given, [key]) if given else ({}, {})
        if row is None or not off:
            continue
        if key == "residual_dipole":
            table = getattr(given, key)
            _, sizes = _of_keys(f"disturbance.{key}", table, ("constant_a_m2", "amplitude_a_m2"))
        yield Cause(*row, off, sizes)


def _without_air(scenario: Scenario) -> dict[str, Any]:
    """Changes that remove the aerodynamic torque; the parts go to the light if that has none."""
    off: dict[str, Any] = {"spacecraft.aerodynamics": None}
    light = scenario.disturbance.solar_pressure if scenario.disturbance else None
    air = scenario.spacecraft.aerodynamics
    if air is not None and light is not None and not light.parts:
        parts = [part.model_dump(mode="json") for part in air.parts]
        off["disturbance.solar_pressure.parts"] = parts
    return off


def _of_computer(scenario: Scenario) -> Iterator[Cause]:
    control = scenario.control
    if control.ephemeris != EphemerisModels():
        yield Cause("ephemeris", "models on board", PERIODIC, MODELS, {"control.ephemeris": {}})
    off, _ = _of_keys("control", control, ("failures",))
    if off:
        yield Cause("computer_failures", "computer: failures", PERIODIC, GAPS, off)
    off, _ = _of_keys("control", control, ("measure_s", "actuate_s"))
    if control.sample_s > _QUICK_S:
        off["control.sample_s"] = _QUICK_S
    if step_s := scenario.simulation.step_s:
        fits = _QUICK_S / np.ceil(_QUICK_S / step_s)
        off |= {"simulation.step_s": float(fits)} if "control.sample_s" in off else {}
    if off:
        yield Cause("cycle", "control cycle", PERIODIC, SAMPLING, off)
