"""Scenarios made at random with several devices of a kind: all valid, a line for each table.

Noise, sampling, delays, failures of every kind, selections, modes that select, filters with units.
"""

import json
import random

HEAD = """start = 2012-03-04T10:31:47Z
orbit = { kind = "circular", altitude_km = 550, inclination_deg = 60 }
environment.field.kind = "averaged"
spacecraft.body.inertia_kg_m2 = [1.0, 1.3, 1.7]
"""
DURATION_S, STEP_S = 60.0, 0.5
NAMES = ("main", "boom", "Left", "right_2", "x9", "aft")
#: Kinds by the key of several: key of one, and as which laws read them.
KINDS = {
    "magnetometers": ("magnetometer", "magnetometer"),
    "gyros": ("gyro", "gyro"),
    "sun_heads": ("sun_sensors", "sun_sensors"),
    "star_trackers": ("attitude_sensor", "attitude_sensor"),
    "horizon_sensors": ("horizon_sensor", "horizon_sensor"),
    "integrating_gyros": ("integrating_gyro", "gyro"),
    "fine_sun_sensors": ("fine_sun_sensor", ""),
}
#: Keys of errors that failures may add: of a constant one and of a random one.
ERRORS = {
    "magnetometers": ("bias_nt", "noise_nt", 3e3),
    "gyros": ("bias_deg_s", "noise_deg_s", 0.5),
    **dict.fromkeys(
        ("sun_heads", "star_trackers", "horizon_sensors"), ("bias_deg", "noise_deg", 5.0)
    ),
}


def as_toml(value) -> str:
    """A value in one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {as_toml(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    return json.dumps(value)


class Chance:
    """Random choices of one scenario."""

    def __init__(self, number: int):
        self.random = random.Random(number)

    def happens(self, part=0.5) -> bool:
        return self.random.random() < part

    def one(self, *values):
        return self.random.choice(values)

    def size(self, least, greatest) -> float:
        return float(f"{least * (greatest / least) ** self.random.random():.3g}")

    def vector(self, size) -> list[float]:
        return [float(f"{self.random.gauss(0.0, size):.4g}") for _ in range(3)]

    def some(self, values) -> list:
        return [value for value in values if self.happens()]


def sampling(chance) -> dict:
    """When a sensor is read, and how late."""
    if chance.happens(0.4):
        return {}
    sample_s = chance.one(0.5, 1.0, 2.0, 3.0, 7.5)
    return {"sample_s": sample_s, "delay_s": chance.one(0.0, 0.5, sample_s)}


def failure(chance, key) -> dict:
    """A failure that sensors of a kind may have."""
    kinds = ["silent", "stuck", "zeros", "nan", "infinite"]
    kinds += ["reversed", "swapped", "bias", "noise"] if key in ERRORS else []
    kind, from_s = chance.one(*kinds), chance.one(0.0, 7.0, 20.5, 41.0)
    found = {"kind": kind, "from_s": from_s}
    if chance.happens():
        found["until_s"] = from_s + chance.one(0.5, 5.0, 25.0)
    if kind == "swapped":
        found["axes"] = chance.one("xy", "yz", "xz")
    if kind == "reversed" and chance.happens():
        found["axis"] = chance.one("x", "y", "z")
    if kind == "bias":
        found[ERRORS[key][0]] = chance.vector(ERRORS[key][2])
    if kind == "noise":
        found[ERRORS[key][1]] = ERRORS[key][2]
    return found


def errors(chance, key) -> dict:
    """What a data sheet says of a sensor."""
    c = chance
    if key == "magnetometers":
        own = {"noise_nt": c.size(1, 300), "bias_nt": c.vector(100.0),
               "resolution_nt": c.size(1, 100), "scale_error": c.vector(0.01),
               "coil_disturbance_nt_per_a_m2": c.size(1, 100),
               "coil_offset_nt": c.vector(50.0),
               "soft_iron": [[1.0, c.size(1e-3, 0.1), 0.0], [0.0, 0.98, 0.0], [0.01, 0.0, 1.0]],
               "range_nt": c.size(1e4, 1e6)}  # fmt: skip
    elif key == "gyros":
        own = {"noise_deg_s": c.size(1e-4, 1e-1), "bias_deg_s": c.vector(0.1),
               "bias_drift_deg_s_sqrt_s": c.size(1e-6, 1e-3), "resolution_deg_s": c.size(1e-4, 0.1),
               "misalignment_deg": c.vector(1.0), "range_deg_s": c.size(0.5, 100)}  # fmt: skip
    elif key == "star_trackers":
        own = {"noise_deg": c.size(1e-3, 1.0), "boresight": c.vector(1.0),
               "moon_exclusion_deg": c.size(5, 60),
               "sun_exclusion_deg": c.size(5, 60), "earth_exclusion_deg": c.size(5, 60),
               "rate_limit_deg_s": c.size(0.5, 10), "error_deg": c.vector(0.1)}  # fmt: skip
    elif key == "horizon_sensors":
        own = {"noise_deg": c.size(0.01, 1.0), "bias_deg": c.vector(0.1),
               "horizon_km": c.one(0.0, 30.0)}  # fmt: skip
    elif key == "integrating_gyros":
        own = {"angle_random_walk_deg_sqrt_h": c.size(1e-3, 1.0),
               "rate_random_walk_deg_h_sqrt_h": c.size(1e-3, 10.0),
               "bias_deg_h": c.vector(10.0), "quantum_arcsec": c.size(0.01, 100.0),
               "range_deg_s": c.size(0.5, 100), "misalignment_deg": c.vector(1.0)}  # fmt: skip
    else:
        own = {"noise_deg": c.size(0.01, 1.0)}
    found = {name: value for name, value in own.items() if c.happens()}
    if key == "star_trackers" and any("exclusion" in name for name in found):
        found["boresight"] = own["boresight"]
    if key == "integrating_gyros" and c.happens():
        found |= {"bias_instability_deg_h": c.size(0.01, 10.0), "bias_correlation_s": 100.0}
    return found


def device(chance, key, several: bool) -> dict:
    """A sensor of a kind with all that it must have."""
    found = errors(chance, key) | sampling(chance)
    if key == "sun_heads":
        count = 1 if several else 2
        found["axes"] = [chance.vector(1.0) for _ in range(count)]
        found["half_field_deg"] = chance.size(30, 180)
    if key == "fine_sun_sensors":
        found |= {"boresight": chance.vector(1.0), "up": chance.vector(1.0), "half_field_deg": 80}
    if chance.happens(0.4):
        found["failures"] = [failure(chance, key) for _ in range(chance.one(1, 2))]
    return found


def sensors(chance) -> tuple[dict, dict]:
    """(Tables of the spacecraft by key, names of units by the key of several)."""
    tables, units, left = {}, {}, 12
    gyro = chance.one("gyros", "integrating_gyros")
    for key, (one, _) in KINDS.items():
        if key in ("gyros", "integrating_gyros") and key != gyro:
            continue
        count = min(chance.one(-1, 0, 1, 2, 3, 4), left)
        if count == 0:
            tables[one] = device(chance, key, several=False)
        if count > 0:
            left -= count
            names = [f"{name}_{key[0]}{key[2]}" for name in NAMES[:count]]
            units[key] = names
            each = {name: device(chance, key, several=True) for name in names}
            if chance.happens(0.3):
                listed = "sun_sensors" if key == "sun_heads" else key
                tables[listed] = [{"name": name} | own for name, own in each.items()]
            else:
                tables |= {f"{key}.{name}": own for name, own in each.items()}
    return tables, units


def combined(units) -> dict[str, list]:
    """Names of the units of which laws read one, by its kind."""
    return {KINDS[key][1]: names for key, names in units.items() if KINDS[key][1]}


def kalman(chance, units) -> dict:
    """A filter with some sensors, and noise of its own for some units."""
    words = {"magnetometer": ("magnetometer_noise_nt", 200.0, "magnetometers"),
             "sun": ("sun_noise_deg", 1.0, "sun_heads"),
             "star_tracker": ("star_tracker_noise_deg", 0.5, "star_trackers"),
             "horizon": ("horizon_noise_deg", 1.0, "horizon_sensors"),
             "fine_sun": ("fine_sun_noise_deg", 0.5, "fine_sun_sensors")}  # fmt: skip
    used = chance.some(words) or [chance.one("magnetometer", "star_tracker")]
    found = {"sensors": used} | {words[name][0]: words[name][1] for name in used}
    if "fine_sun" in used:
        found |= {"fine_sun_boresight": [0, 0, 1], "fine_sun_up": [0, 1, 0]}
    measured = [unit for name in used for unit in units.get(words[name][2], ())]
    if used != ["magnetometer"]:
        found["unit_noise"] = {unit: chance.size(0.1, 100.0) for unit in chance.some(measured)}
    if chance.happens():
        found |= {"kind": "kalman_gyro", "angle_random_walk_deg_sqrt_s": 0.01,
                  "rate_random_walk_deg_s_sqrt_s": 1e-4, "gyro_bias_sigma_deg_s": 0.2}  # fmt: skip
    else:
        found |= {"kind": "kalman_dynamics", "inertia_kg_m2": [1.0, 1.3, 1.7],
                  "torque_noise_n_m_sqrt_s": 1e-5, "rate_sigma_deg_s": 5.0}  # fmt: skip
    return found | ({"record_covariance": True} if chance.happens(0.2) else {})


def estimator(chance, units) -> dict:
    """Any estimator."""
    kind = chance.one("kalman", "kalman", "kalman", "triad", "rate_from_field", "attitude_sensor")
    if kind == "kalman":
        return kalman(chance, units)
    noise = {"magnetometer_noise_nt": 100.0, "sun_noise_deg": 1.0, "rate": "gyro"}
    return {"kind": kind} | (noise if kind == "triad" else {})


def condition(chance, units) -> dict:
    """A condition about a sensor: one of several, a kind, or the estimate."""
    names = [*(name for own in units.values() for name in own), "magnetometer", "gyro"]
    signal = chance.one("reading_age_s", "sensor_suspected", "estimate_doubts", "time_s")
    if signal == "time_s":
        return {"signal": signal, "above": chance.one(5.0, 20.0)}
    limit = {"above": chance.one(0.5, 4.0) if signal == "reading_age_s" else 0.5}
    return {"signal": signal, "sensor": chance.one(*names)} | limit


def modes(chance, units) -> dict[str, object]:
    """Lines of a mode table whose states select."""

    def selects() -> dict:
        return {kind: chance.one(*names) for kind, names in chance.some(combined(units).items())}

    states = {}
    for name, to in (("a", "b"), ("b", "a")):
        states[f"control.modes.states.{name}"] = {
            "laws": ["law"], "select": selects(),
            "transitions": [{"to": to, "when": condition(chance, units)},
                            {"to": to, "at_least_s": chance.one(10.0, 25.0)}],
        }  # fmt: skip
    states["control.modes.states.a"] |= {"estimator": chance.one("none", "other", "estimator")}
    return {
        "control.modes.inertia_kg_m2": [1.0, 1.3, 1.7],
        "control.modes.noise": {"magnetometer_noise_nt": 100, "sun_noise_deg": 1.0,
                                "gyro_noise_deg_s": 0.02, "rate_tolerance_deg_s": 0.1},
        "control.estimators.other": estimator(chance, units), **states,
    }  # fmt: skip


LAWS = (
    {"kind": "bdot", "gain_a_m2_s_per_t": 1e6},
    {"kind": "bdot_rate", "gain_a_m2_s_per_t": 1e5},
    {"kind": "three_axis", "angle_gain_n_m_per_t2": 1.0, "rate_gain_n_m_s_per_t2": 1e3,
     "reference": "orbital"},
    {"kind": "preliminary_1", "gain_a_m2_per_t": 1e3, "axis": [0, 0, 1], "target": "sun"},
)  # fmt: skip


def random_scenario(number: int, fixed_steps: bool | None = None) -> str:
    """The text of scenario `number`."""
    chance = Chance(number)
    tables, units = sensors(chance)
    lines = {f"spacecraft.{key}": table for key, table in tables.items()}
    lines["spacecraft.coils.limit_a_m2"] = 3.0
    lines["initial"] = {"rate_deg_s": chance.vector(1.0), "euler_deg": chance.vector(60.0)}
    lines["seed"] = number
    for kind in chance.some(combined(units)):
        most = ("mean", "vote", "spare") if len(combined(units)[kind]) > 2 else ("mean", "spare")
        how = chance.one(*most)
        warm = {"warm_up_s": chance.one(0.0, 5.0)} if how == "spare" else {}
        lines[f"control.select.{kind}"] = {"kind": how} | warm
    lines["control.estimator"] = estimator(chance, units)
    law = dict(chance.one(*LAWS))
    if lines["control.estimator"]["kind"] == "rate_from_field":
        law = dict(LAWS[1])  # the others need an attitude
    if chance.happens():
        lines["control.laws.law"] = law
        lines |= modes(chance, units)
    else:
        lines["control.law"] = law
    lines["control.sample_s"] = chance.one(0.5, 1.0, 2.0)
    if chance.happens(0.3):
        measure_s = 2.0 * lines["control.sample_s"]
        lines |= {"control.measure_s": measure_s, "control.actuate_s": measure_s}
        lines["control.control_while_actuating"] = chance.happens()
    if chance.happens(0.2):
        lines["control.failures"] = [
            {"kind": chance.one("halted", "restarted"), "from_s": 15.0, "until_s": 22.0}
        ]
    simulation = {"duration_s": DURATION_S, "record_s": chance.one(1.0, 2.0, 5.0)}
    fixed = chance.happens(0.7) if fixed_steps is None else fixed_steps
    lines["simulation"] = simulation | ({"step_s": STEP_S} if fixed else {})
    return HEAD + "".join(f"{key} = {as_toml(value)}\n" for key, value in lines.items())
