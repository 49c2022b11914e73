"""Causes of pointing errors that a scenario has: their class, how each is removed, what is drawn.

Classes as in the ESA pointing error engineering handbook (ESSB-HB-E-003): constant in a flight and
random over the ensemble, periodic in the orbit, random, and drift.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from torquer.computer.laws.pointing import HeldAttitude, HeldByWheels
from torquer.scenario.change import found_at, with_values
from torquer.scenario.spec import Scenario
from torquer.spacecraft.disturbance import TORQUES

CONSTANT, PERIODIC, RANDOM, DRIFT = "constant", "periodic", "random", "drift"
_ZERO = (0.0, 0.0, 0.0)
#: What a budget calls the causes that are always there.
ALWAYS = "gravity_and_reference"


@dataclass(frozen=True)
class Cause:
    """A cause: name, words, class; `off`: values by the scenario's keys that remove it.

    `drawn`: standard deviations of what each flight draws about zero on each axis, by key; `none`:
    why linear theory gives no number for it, "" where it does.
    """

    name: str
    label: str
    kind: str
    off: Mapping[str, Any] = field(default_factory=dict)
    drawn: Mapping[str, float] = field(default_factory=dict)
    none: str = ""

    @property
    def differs(self) -> bool:
        """Whether flights differ by it."""
        return bool(self.drawn) or self.kind in (RANDOM, DRIFT)


def holder_of(scenario: Scenario) -> tuple[str, HeldAttitude]:
    """Name and spec of the law that holds the attitude; ValueError unless it is the only one, and
    works all the time."""
    named = scenario.control.named()
    found = {name: law for name, law in named.laws.items() if isinstance(law, HeldAttitude)}
    if len(found) != 1 or named.modes is not None:
        received = "modes" if named.modes is not None else f"{len(found)} such laws"
        raise ValueError(
            "control: must have one law that holds an attitude, and no modes, for a pointing "
            f"budget; received {received}"
        )
    return next(iter(found.items()))


#: Vectors that stay as they are through a flight: name, label, key.
_FIXED = (
    ("residual_dipole", "residual dipole", "spacecraft.coils.residual_dipole_a_m2"),
    ("constant_torque", "constant torque", "disturbance.constant_torque_n_m"),
    ("mounting", "attitude sensor: mounting", "spacecraft.attitude_sensor.error_deg"),
    ("rate_bias", "gyro: bias", "spacecraft.gyro.bias_deg_s"),
    ("rate_scale", "gyro: scale", "spacecraft.gyro.scale_error"),
    ("rate_mounting", "gyro: mounting", "spacecraft.gyro.misalignment_deg"),
)
#: Sizes of what is random: name, label, class, key.
_RANDOM = (
    ("random_torque", "random torque", RANDOM, "disturbance.random_torque_n_m"),
    ("rate_noise", "gyro: noise", RANDOM, "spacecraft.gyro.noise_deg_s"),
    ("rate_drift", "gyro: drift of the bias", DRIFT, "spacecraft.gyro.bias_drift_deg_s_sqrt_s"),
    ("rate_steps", "gyro: resolution", RANDOM, "spacecraft.gyro.resolution_deg_s"),
    ("tachometers", "tachometers: noise", RANDOM, "spacecraft.wheels.speed_noise_rpm"),
    ("coil_error", "coils: random error", RANDOM, "spacecraft.coils.random_error"),
    ("coil_steps", "coils: resolution", RANDOM, "spacecraft.coils.resolution_a_m2"),
    ("coil_dead_band", "coils: dead band", RANDOM, "spacecraft.coils.dead_band_a_m2"),
)
#: Torques by their keys that are not known along the orbit, whatever the motion.
_UNKNOWN = ("unmodelled", "energy_sink")
#: Key of the torque that is also a dipole of the coils, and its name here.
_DIPOLE, OSCILLATING = "residual_dipole", "oscillating_dipole"
#: Torques along the orbit, by their keys.
ALONG = tuple(name for name in TORQUES if name not in (*_UNKNOWN, _DIPOLE))
_MAGNETOMETER = ("noise_nt", "bias_nt", "scale_error", "misalignment_deg")


def causes_of(scenario: Scenario) -> list[Cause]:
    """The causes that a scenario has, the one that is always there first."""
    return [*_causes(scenario)]


def _causes(scenario: Scenario) -> Iterator[Cause]:
    craft = scenario.spacecraft
    yield Cause(ALWAYS, "gravity gradient, motion of the reference", PERIODIC)
    if craft.aerodynamics:
        yield Cause("air", "aerodynamic", PERIODIC, _without_air(scenario))
    if found_at(scenario, key := f"disturbance.{_DIPOLE}") is not None:
        yield Cause(OSCILLATING, "residual dipole, along the orbit", PERIODIC, {key: None})
    for name in ALONG:
        if found_at(scenario, key := f"disturbance.{name}") is not None:
            yield Cause(name, name.replace("_", " "), PERIODIC, {key: None})
    for name, label, key in _FIXED:
        size = np.asarray(found_at(scenario, key) or _ZERO)
        if size.any():
            sigma = float(np.sqrt(np.mean(size**2)))
            yield Cause(name, label, CONSTANT, {key: _ZERO}, {key: sigma})
    yield from _of_attitude_sensor(scenario)
    for name, label, kind, key in _RANDOM:
        if np.any(found_at(scenario, key) or 0.0):
            yield Cause(name, label, kind, {key: 0.0}, none=_why_none(scenario, name))
    yield from _rest(scenario)


def _of_attitude_sensor(scenario: Scenario) -> Iterator[Cause]:
    sensor = scenario.spacecraft.attitude_sensor
    about = sensor.boresight_noise_deg
    if sensor.noise_deg or about:
        key = "spacecraft.attitude_sensor"
        off = {f"{key}.noise_deg": 0.0} | ({f"{key}.boresight_noise_deg": 0.0} if about else {})
        yield Cause("attitude_noise", "attitude sensor: noise", RANDOM, off)


def _rest(scenario: Scenario) -> Iterator[Cause]:
    """Causes with rules of their own."""
    craft, control, given = scenario.spacecraft, scenario.control, scenario.disturbance
    wheels, key = craft.wheels, "spacecraft.wheels"
    if wheels and (wheels.coulomb_friction_n_m or wheels.viscous_friction_n_m_s):
        off: dict[str, Any] = {
            f"{key}.stiction_n_m": None,
            f"{key}.coulomb_friction_n_m": 0.0,
            f"{key}.viscous_friction_n_m_s": 0.0,
        }
        yield Cause(
            "friction", "wheels: friction", PERIODIC, off, none=_why_none(scenario, "friction")
        )
    if scenario.believed_environment() != scenario.orbit_environment():
        yield Cause("ephemeris", "models on board", PERIODIC, {"control.ephemeris": {}})
    if not isinstance(holder_of(scenario)[1], HeldByWheels):
        yield from _of_magnetometer(scenario)
    others = [name for name in control.laws if name != holder_of(scenario)[0]]
    if others:
        kept = {name: law for name, law in control.laws.items() if name not in others}
        why = "what the other laws ask for depends on the wheels' momentum"
        yield Cause(
            "other_laws", f"laws: {', '.join(others)}", PERIODIC, {"control.laws": kept}, none=why
        )
    for name in (*_UNKNOWN, "own"):
        if given and getattr(given, name):
            off = {f"disturbance.{name}": {} if name == "own" else None}
            why = "it is not a torque that linear theory knows along the orbit"
            yield Cause(name, f"{name.replace('_', ' ')} torque", PERIODIC, off, none=why)


def _of_magnetometer(scenario: Scenario) -> Iterator[Cause]:
    sensor, key = scenario.spacecraft.one_of("magnetometer"), "spacecraft.magnetometer"
    errors = [name for name in _MAGNETOMETER if np.any(getattr(sensor, name))]
    if errors:
        off = {f"{key}.{name}": np.zeros_like(getattr(sensor, name)).tolist() for name in errors}
        why = "it turns the dipole that is asked for by a part of itself: no effect of first order"
        yield Cause("magnetometer", "magnetometer", RANDOM, off, none=why)


def _why_none(scenario: Scenario, name: str) -> str:
    """Why linear theory has no number for a cause of the scenario."""
    craft, wheels = scenario.spacecraft, scenario.spacecraft.wheels
    gyro = craft.one_of("gyro")
    if name == "rate_steps" and gyro.noise_deg_s < gyro.resolution_deg_s / 2.0:
        return "steps above twice the noise are no random error (a limit cycle)"
    if name in ("coil_steps", "coil_dead_band"):
        return "the loop goes round a limit cycle where it asks for less than the coils give"
    if name == "coil_error":
        return "it is a part of the dipole that is asked for: no effect of first order"
    if name == "friction" and len(wheels.layout.rows()) > 3 and wheels.allocation == "minimax":
        return (
            "speeds of more than three wheels that are shared by minimax follow from a search "
            "(allocation = 'least_squares' has a prediction)"
        )
    return ""


def _without_air(scenario: Scenario) -> dict[str, Any]:
    """Changes that remove the aerodynamic torque; the parts go to the light if that has none."""
    off: dict[str, Any] = {"spacecraft.aerodynamics": None}
    light = scenario.disturbance.solar_pressure if scenario.disturbance else None
    air = scenario.spacecraft.aerodynamics
    if air is not None and light is not None and not light.parts:
        parts = [part.model_dump(mode="json") for part in air.parts]
        off["disturbance.solar_pressure.parts"] = parts
    return off


def without(scenario: Scenario, causes: list[Cause]) -> Scenario:
    """The scenario without some of its causes."""
    changes = {key: value for cause in causes for key, value in cause.off.items()}
    return with_values(scenario, changes) if changes else scenario
