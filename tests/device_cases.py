"""Devices and those that assume something of them, made from their specs: no device is named.

A new device with a data sheet, or a new key about one, is in all tests that walk over these.
"""

import typing

from torquer.base.user_code import OwnFile
from torquer.computer.estimation import ESTIMATORS
from torquer.computer.modes.spec import SensorNoise
from torquer.scenario.spec import Spacecraft
from torquer.spacecraft.sensors.devices import SEVERAL

DIRECTIONS = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
#: Values of keys that must be given, whatever device has them.
REQUIRED = {
    "axes": DIRECTIONS,
    "normals": DIRECTIONS,
    "boresight": [0, 0, 1],
    "up": [1, 0, 0],
    "half_field_deg": 85.0,
    "limit_a_m2": 3.0,
    "layout": {"kind": "orthogonal"},
    "momentum_limit_n_m_s": 0.5,
    "torque_limit_n_m": 0.05,
}
#: Keys that must be given unless others are.
_ONE_OF_TWO = ("limit_a_m2",)


def spec_of(annotation):
    """The spec of a field of the spacecraft, which may be left out."""
    kinds = [kind for kind in (*typing.get_args(annotation), annotation) if hasattr(kind, "sheet")]
    return kinds[0] if kinds else None


#: Specs of all devices with a data sheet that need no file, by their keys in the spacecraft, and
#: of one of several.
DEVICES = {
    f"{name}.own" if name in SEVERAL else name: kind
    for name, field in Spacecraft.model_fields.items()
    if (kind := spec_of(field.annotation)) is not None and not issubclass(kind, OwnFile)
}


def least_keys(kind, name: str = "") -> dict:
    """The keys that must be given of a device; `name`: its own, which one of several has."""
    needed = [name for name, field in kind.model_fields.items() if field.is_required()]
    needed += [key for key in _ONE_OF_TWO if key in kind.model_fields]
    one_axis = {"axes": DIRECTIONS[:1]} if name.startswith("sun_heads.") else {}
    return {key: (REQUIRED | one_axis)[key] for key in needed}


def in_its_shape(kind, key: str, value: float):
    """A value for a key: a number, or a vector whose size it is where the key takes vectors."""
    default = kind.model_fields[key].default
    return [value, 0.0, 0.0] if isinstance(default, tuple) else value


def keys_of(name: str, what: str, value: float) -> dict:
    """The keys of a device with one value of its data sheet."""
    kind, key = DEVICES[name], getattr(DEVICES[name].sheet, what)
    own = {key: in_its_shape(kind, key, value / kind.sheet.factors.get(what, 1.0))}
    # a key that is about an axis is given with it
    given = {kind.sheet.axes: DIRECTIONS[0]} if what == "noise_about" else {}
    given |= {kind.sheet.correlation: 100.0} if what == "instability" else {}
    return least_keys(kind, name) | given | own


def craft_with(craft: dict, name: str, keys: dict) -> dict:
    """A spacecraft with a device, in place of those that cannot be with it."""
    key, _, own = name.partition(".")
    replaced = {SEVERAL[key].name} if own else set()
    if key.startswith("integrating_gyro"):
        replaced.add("gyro")
    kept = {other: value for other, value in craft.items() if other not in replaced}
    return {**kept, key: {own: keys} if own else keys}


def having(what: str) -> list[str]:
    """Names of the devices that have a key for something."""
    return [name for name, kind in DEVICES.items() if getattr(kind.sheet, what)]


#: A user's key for a device that is nearly ideal.
_STATED = {
    "magnetometer_noise_nt": 200.0, "sun_noise_deg": 0.5, "star_tracker_noise_deg": 0.01,
    "star_tracker_boresight_noise_deg": 0.05, "star_tracker_boresight": [0, 0, 1],
    "horizon_noise_deg": 0.3, "cell_noise": 0.02, "cell_normals": DIRECTIONS,
    "magnetometer_bias_sigma_nt": 300.0, "magnetometer_scale_sigma": 0.01,
    "magnetometer_misalignment_sigma_deg": 0.5, "gyro_bias_sigma_deg_s": 0.1,
    "gyro_scale_sigma": 0.01, "gyro_misalignment_sigma_deg": 0.5,
    "angle_random_walk_deg_sqrt_s": 0.01, "rate_random_walk_deg_s_sqrt_s": 1e-4,
    "dipole_sigma_a_m2": 0.02, "rate_sigma_deg_s": 0.5, "torque_noise_n_m_sqrt_s": 1e-6,
    "inertia_kg_m2": [1.0, 1.3, 1.7], "gyro_noise_deg_s": 0.02, "rate_tolerance_deg_s": 0.1,
}  # fmt: skip
SENSORS = ["magnetometer", "sun", "star_tracker", "horizon", "sun_cells"]


def users() -> dict[str, dict]:
    """Keys of each estimator and check that assumes something, with all that it may assume."""
    found = {}
    for kind, spec in {**ESTIMATORS, "noise": SensorNoise}.items():
        if hasattr(spec, "assumes"):
            own = {key: value for key, value in _STATED.items() if key in spec.model_fields}
            more = {"sensors": SENSORS} if "sensors" in spec.model_fields else {}
            found[kind] = own | more
    return found


def spec_with(kind: str, keys: dict):
    """The spec of one of them."""
    return {**ESTIMATORS, "noise": SensorNoise}[kind].model_validate(keys)


def pairs(*wanted: str) -> list[tuple[str, object]]:
    """Kinds of users with what each assumes of these."""
    return [
        (kind, assumed)
        for kind, keys in users().items()
        for assumed in spec_with(kind, keys).assumes
        if assumed.what in wanted or "*" in wanted
    ]
