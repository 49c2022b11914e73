"""What the computer assumes of devices against what they are: noise, fixed errors, mounting.

The same rules hold for all devices and all that assume something of them.
"""

import math
from collections.abc import Iterator

import numpy as np

from torquer.analysis.notes.sizes import (
    Size,
    distance_m,
    earthlight_part,
    find_sizes,
    rate_at_start_deg_s,
)
from torquer.analysis.notes.users import (
    Pair,
    estimators_at_start,
    find_pairs,
    find_users,
    parts_on_board,
)
from torquer.scenario.spec import Scenario
from torquer.spacecraft.data_sheet import FIXED, FLOOR
from torquer.spacecraft.sensors.sampling import Sampled

#: How many times too small a stated noise may be: from twice on the usual gate of a filter rejects
#: every tenth sound reading of three components.
_TOO_LITTLE = 2.0
#: How many times too large a noise may be stated, to cover errors of models: a unit's prefix. The
#: noise of a gyro has no model's errors in it, and 60 is the root of an hour in seconds.
_TOO_MUCH = {"noise": 1000.0, "noise_about": 1000.0, "white": 30.0, "drift": 1000.0}
#: Part of what is read from which on a stated noise leaves no use of readings that are ten times
#: better.
_USELESS, _BETTER = 0.5, 10.0
#: Part of a stated noise above which an error that lasts shows: a hundred readings average to it.
_LASTING = 0.1
#: Angle [deg] between a direction as mounted and as known on board that no mounting has.
_TURNED_DEG = 5.0
#: Part by which a constant of the body may be known wrongly: the loop's gain halves or doubles.
_BODY_KNOWN = 0.5
#: Errors that stay and are not a device's own: of what is around it.
_AROUND = ("by_coils", "by_each_coil", "by_driver", "soft_iron")
#: Those that are matrices, of the errors of three components.
_MATRICES = ("by_each_coil", "soft_iron")
#: Keys of goals, and the quantity that shows whether they are met.
_GOALS = {
    "rate_below_deg_s": "rate",
    "rate_orbital_below_deg_s": "rate",
    "attitude_error_below_deg": "attitude",
    "commanded_error_below_deg": "attitude",
    "sun_angle_below_deg": "sun",
}


def assumption_notes(scenario: Scenario) -> list[str]:
    """Notes on what is assumed on board of devices, of the body and of goals, one line each."""
    sizes = find_sizes(scenario)
    return [
        *(note for pair in find_pairs(scenario) for note in _pair_notes(pair, sizes)),
        *_start_notes(scenario),
        *_body_notes(scenario),
        *_goal_notes(scenario),
    ]


def _pair_notes(pair: Pair, sizes: dict[str, Size]) -> Iterator[str]:
    assumed = pair.assumed
    if assumed.what in _TOO_MUCH:
        yield from _noise_notes(pair, sizes.get(pair.sheet.senses))
    if assumed.what in ("noise", "white") and pair.user.states_errors:
        yield from _fixed_notes(pair, sizes.get(pair.sheet.senses))
        yield from _albedo_notes(pair)
    if assumed.sigmas > 0.0:
        yield from _sigma_notes(pair)
    if assumed.what == "axes" and pair.name == "":
        yield from _axes_notes(pair)
    if assumed.what == "albedo":
        yield from _other_albedo_notes(pair)


def _noise_notes(pair: Pair, size: Size | None) -> Iterator[str]:
    """A noise that is stated far below that of the device, or absurdly above."""
    what, stated = pair.assumed.what, pair.stated
    if what == "noise_about" and _is_said_by_noise(pair):
        return
    low, high, unit = _actual(pair)
    said, own = pair.says(unit), _says_noise(pair, high, unit)
    if low > _TOO_LITTLE * stated and (what != "drift" or _shows(pair, low)):
        follows = "the estimate will be less certain than it states, and sound readings rejected"
        if not pair.user.states_errors:
            follows = "sound readings will count as failures"
        yield f"{said} must not be far below {own}: {follows}"
    useless = what == "noise" and size is not None and stated > _USELESS * size.least
    far_more = 0.0 < high * _TOO_MUCH[what] < stated
    if far_more or (useless and stated > _BETTER * high):
        follows = "readings will hardly be used" if pair.user.states_errors else "no failure shows"
        yield f"{said} is far above {own}: {follows}; is it in another unit?"


def _is_said_by_noise(pair: Pair) -> bool:
    """Whether the key of the noise says this of a device whose noise is the same about all axes."""
    shared = pair.assumed._replace(what="noise") in pair.user.spec.assumes
    return shared and pair.of_device("noise_about") is None


def _actual(pair: Pair) -> tuple[float, float, str]:
    """What a stated noise is about, of the device: from, to, and its unit."""
    what, sheet = pair.assumed.what, pair.sheet
    if what == "drift":
        drift = _drift(pair)
        return drift, drift, f"{sheet.unit}/sqrt(s)"
    shortest_s, longest_s = _intervals_s(pair)
    noise, white = _noise_of_reading(pair, what), pair.of_device("white")
    if what == "white":
        unit = sheet.unit.replace("/s", "/sqrt(s)")
        if white is not None:
            low, high = (_white(pair, each_s) for each_s in (longest_s, shortest_s))
            return low, high, unit
        return noise * math.sqrt(shortest_s), noise * math.sqrt(longest_s), unit
    if what == "noise" and white is not None:
        low, high = (_white(pair, s) / math.sqrt(s) for s in (longest_s, shortest_s))
        return low, high, sheet.unit
    return noise, noise, sheet.unit


def _white(pair: Pair, interval_s: float) -> float:
    """Noise of the rate between two angles, times the root of their interval, with rounding."""
    counted = _number(pair.of_device("quantum")) / math.sqrt(6.0 * interval_s)
    return math.hypot(_number(pair.of_device("white")), counted)


def _drift(pair: Pair) -> float:
    """Random walk of the bias that filters allow for a device: its own, and its instability.

    A bias that comes and goes with the standard deviation s in the time T grows as a walk of
    s sqrt(2/T) until it is s.
    """
    walk, floor = _number(pair.of_device("drift")), _number(pair.of_device("instability"))
    if floor == 0.0:
        return walk
    return math.hypot(walk, floor / FLOOR * math.sqrt(2.0 / _number(pair.of_device("correlation"))))


def _noise_of_reading(pair: Pair, what: str) -> float:
    """Noise of each component of a reading, that of rounding included."""
    noise = None if what == "white" else pair.of_device(what)
    noise = pair.of_device("noise") if noise is None else noise
    return math.hypot(_number(noise), _number(pair.of_device("resolution")) / math.sqrt(12.0))


def _number(value) -> float:
    return 0.0 if value is None else float(value)


def _intervals_s(pair: Pair) -> tuple[float, float]:
    """Shortest and longest interval between readings of a device that the computer takes."""
    own_s, control = pair.device.sample_s or 0.0, pair.scenario.control
    return max(own_s, control.sample_s), max(own_s, control.longest_hold_s)


def _shows(pair: Pair, drift: float) -> bool:
    """Whether a drift shows in the run: more of it at its end than a mean of all readings hides."""
    white, _, _ = _actual(pair._replace(assumed=pair.assumed._replace(what="white")))
    return drift * pair.scenario.length_s > white


def _says_noise(pair: Pair, value: float, unit: str) -> str:
    """The device's noise in words."""
    what, name = pair.assumed.what, f"spacecraft.{pair.key}"
    key = "drift" if what == "drift" else "noise"
    if key == "noise" and pair.sheet.white:
        key = "white"
    if what == "noise_about" and pair.of_device(what) is not None:
        key = what
    words = f"the {value:.3g}{' ' * bool(unit)}{unit} of {name}.{getattr(pair.sheet, key)}"
    if _number(pair.of_device("resolution")) and key == "noise":
        words += f" and {pair.sheet.resolution}"
    if _number(pair.of_device("quantum")) and key == "white":
        words += f" and {pair.sheet.quantum}"
    if _number(pair.of_device("instability")) and key == "drift":
        words += f" and {pair.sheet.instability}"
    if what == "white" and key != what:
        return f"{words} (noise times the root of {_intervals_s(pair)[1]:g} s)"
    return words


def _fixed_notes(pair: Pair, size: Size | None) -> Iterator[str]:
    """Errors that stay, for which a user states neither noise nor a state of its own."""
    assumed, user, sheet = pair.assumed, pair.user, pair.sheet
    states = {e.what: e for e in user.spec.assumes if e.device == assumed.device and e.sigmas}
    parts = {
        sheet.in_words(what): error
        for what in (*FIXED, *_AROUND)
        if what not in states and (error := _fixed_error(pair, what, size)) > 0.0
    }
    whole, noise = math.hypot(*parts.values()), pair.stated
    if assumed.what == "white":
        noise /= math.sqrt(_intervals_s(pair)[0])
    bias = states.get("bias")
    allowed = noise if bias is None else max(noise, bias.sigmas * user.value(bias))
    if whole > allowed:
        unit = f"{' ' * bool(sheet.unit)}{sheet.unit}"
        yield (
            f"{user.key} leaves no room for errors of spacecraft.{assumed.device} that do not "
            f"average out: {whole:.3g}{unit} of each component ({', '.join(parts)}), with "
            f"{allowed:.3g}{unit} allowed by {(bias or assumed).key} and no state for them: it "
            "will be wrong and sure of itself"
        )


def _fixed_error(pair: Pair, what: str, size: Size | None) -> float:
    """Root mean square of an error in each component of a reading, in the unit of the device."""
    value = pair.of_device(what)
    if value is None or size is None:
        return 0.0
    value = value - np.eye(3) if what == "soft_iron" else value
    count = 3 if what in _MATRICES else np.size(value)
    mean = float(np.sqrt(np.sum(value**2) / count))
    if what in ("by_coils", "by_each_coil"):
        return mean * _dipole_while_read(pair.scenario)
    if what == "by_driver" and _dipole_while_read(pair.scenario) == 0.0:
        return 0.0
    if what == "height":
        return math.degrees(1e3 * mean / distance_m(pair.scenario)) * math.sqrt(0.5)
    largest = {
        "scale": size.greatest,
        "soft_iron": size.greatest,
        "misalignment": math.radians(1.0) * size.greatest,
    }
    return mean * largest.get(what, 1.0)


def _dipole_while_read(scenario: Scenario) -> float:
    """Greatest dipole of a coil [A m^2] that is on while sensors are read; 0 if none is."""
    coils, control = scenario.spacecraft.coils, scenario.control
    laws = control.named().known_laws().values()
    driven = len(laws) < len(control.named().laws) or any(law.drives_coils for law in laws)
    if coils is None or control.measure_s > 0.0 or not driven:
        return 0.0
    return float(coils.limits_a_m2().max())


def _albedo_notes(pair: Pair) -> Iterator[str]:
    """Light of the Earth that a device sees and its user takes for sunlight."""
    albedo, device, user = _number(pair.of_device("albedo")), pair.assumed.device, pair.user
    known = [e for e in user.spec.assumes if e.device == device and e.what == "albedo"]
    if albedo == 0.0 or any(user.value(each) > 0.0 for each in known):
        return
    light = earthlight_part(pair.scenario, albedo)
    is_turn = pair.sheet.unit == "deg"
    error = math.degrees(math.asin(min(light, 1.0))) if is_turn else light
    if error <= _LASTING * pair.stated:
        return
    does = f"turns readings by up to {error:.2g} deg" if is_turn else f"adds up to {error:.2g}"
    ignored = f" ({', '.join(f'{each.key} = 0' for each in known)})" if known else ""
    yield (
        f"{user.key} takes the readings of spacecraft.{device} for sunlight alone{ignored}, but "
        f"they see an Earth of albedo {albedo:g}, which {does}, with a noise of "
        f"{pair.stated:g} ({pair.assumed.key}): it will be wrong and sure of itself"
    )


def _other_albedo_notes(pair: Pair) -> Iterator[str]:
    """An albedo on board that is not even half the true one, or more than twice."""
    own, stated = _number(pair.of_device("albedo")), pair.stated
    error = 2.0 * stated * getattr(pair.user.spec, f"{pair.assumed.key}_error", 0.0)
    less, more = sorted((own, stated))
    if stated > 0.0 and more > _TOO_LITTLE * less and abs(own - stated) > error:
        yield (
            f"{pair.user.says(pair.assumed, '')} takes off other light than the Earth's on "
            f"spacecraft.{pair.assumed.device}, of albedo {own:g}: the estimate will be wrong and "
            "sure of itself"
        )


def _sigma_notes(pair: Pair) -> Iterator[str]:
    """A fixed error of a device outside of what is stated for it."""
    value, what = pair.of_device(pair.assumed.what), pair.assumed.what
    error = 0.0 if value is None else float(np.linalg.norm(value))
    if error > pair.assumed.sigmas * pair.stated:
        unit = pair.sheet.unit_of(what)
        yield _outside(
            f"{pair.key_of_device(what)} of {error:.3g}{' ' * bool(unit)}{unit}",
            error / pair.stated,
            pair.says(unit),
            pair.user.states_errors,
        )


def _outside(error: str, times: float, stated: str, estimates: bool) -> str:
    if not estimates:
        return f"{error} is above {stated}: a sound sensor will count as failed"
    return (
        f"{error} lies {times:.3g} sigma outside of {stated}: the filter starts surer than it is "
        "right, and may reject sound readings"
    )


def _start_notes(scenario: Scenario) -> Iterator[str]:
    """A rate at the start outside of what a filter states for it, about zero."""
    works = estimators_at_start(scenario.control)
    for user in find_users(scenario):
        for assumed in user.spec.assumes:
            if assumed.device != "initial" or user.key not in works:
                continue
            rate, stated = rate_at_start_deg_s(scenario), user.value(assumed)
            if rate > assumed.sigmas * stated:
                said = user.says(assumed, "deg/s")
                yield _outside(f"the initial rate of {rate:.3g} deg/s", rate / stated, said, True)


def _axes_notes(pair: Pair) -> Iterator[str]:
    """Directions on board that are not those of the device."""
    own, key = pair.of_device("axes"), pair.assumed.key
    if own is None:
        return
    mounted, known = np.atleast_2d(own), np.atleast_2d(getattr(pair.user.spec, key))
    device = pair.key_of_device("axes")
    if len(mounted) != len(known):
        yield (
            f"{pair.user.key}.{key} has {len(known)} directions, {device} has {len(mounted)}: the "
            "estimate will be wrong"
        )
        return
    cosines = np.clip(np.sum(mounted * known, axis=1), -1.0, 1.0)
    worst = math.degrees(math.acos(float(cosines.min())))
    if worst > _TURNED_DEG:
        yield (
            f"{pair.user.key}.{key} is up to {worst:.3g} deg off {device}, more than any error of "
            "mounting: the estimate will be wrong"
        )


def _body_notes(scenario: Scenario) -> Iterator[str]:
    """Constants of the body that a part of the computer has, too, under the same key."""
    body = scenario.spacecraft.body
    for key, part in parts_on_board(scenario.control):
        for name in getattr(type(part), "model_fields", {}).keys() & type(body).model_fields.keys():
            own, known = getattr(body, name), getattr(part, name)
            if own is None or known is None:
                continue
            off = float(np.linalg.norm(np.subtract(known, own)))
            if off > _BODY_KNOWN * float(np.linalg.norm(own)):
                yield (
                    f"{key}.{name} is not that of spacecraft.body: of size "
                    f"{np.linalg.norm(known):.3g}, and {np.linalg.norm(own):.3g} in the body"
                )


def _goal_notes(scenario: Scenario) -> Iterator[str]:
    """Goals below fixed errors of a sensor by whose readings alone the laws work."""
    mission, quantities = scenario.mission, _read_as_they_are(scenario)
    sensors = scenario.spacecraft.sensors()
    for key, quantity in _GOALS.items() if mission is not None else ():
        goal = getattr(mission, key)
        for name, sensor in sensors.items():
            if goal is None or quantity not in quantities or sensor.sheet.senses != quantity:
                continue
            worst, what = max((_lasting(scenario, sensor, what), what) for what in _LASTS)
            if worst > goal:
                unit = sensor.sheet.unit
                yield (
                    f"mission.{key} of {goal:g} {unit} is below the error of {worst:.3g} {unit} "
                    f"that spacecraft.{name}.{getattr(sensor.sheet, what)} leaves in every reading"
                )


#: What of a sensor makes errors that last.
_LASTS = ("bias", "misalignment", "resolution", "albedo")


def _lasting(scenario: Scenario, sensor: Sampled, what: str) -> float:
    """Greatest error of one kind, in the unit of the sensor."""
    value = sensor.sheet.value(sensor, what)
    if value is None:
        return 0.0
    worst = float(np.linalg.norm(np.atleast_2d(value), axis=1).max())
    if what == "albedo":
        return math.degrees(math.asin(min(earthlight_part(scenario, worst), 1.0)))
    return 0.5 * worst if what == "resolution" else worst


def _read_as_they_are(scenario: Scenario) -> set[str]:
    """Quantities that laws need and take from sensors without an estimator."""
    control = scenario.control
    needs = {need for law in control.named().known_laws().values() for need in law.needs}
    is_raw = control.estimator.kind == "attitude_sensor" and not control.estimators
    return needs & ({"sun", "rate", "attitude"} if is_raw else {"sun"})
