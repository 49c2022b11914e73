"""The nearest design that works: one number of a satellite changed as little as is enough.

Each number is followed from the satellite's own value to a bound, in equal ratios or steps; between
the first value that works and the last that does not the search halves. Flights decide.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from torquer.analysis.causes import BIAS, DIPOLE, NOISE
from torquer.analysis.counter_tests import lessened
from torquer.scenario.change import found_at, with_values
from torquer.scenario.spec import Scenario

#: Values that are tried up to the bound, and halvings of the interval that is then left.
_RUNGS, _HALVINGS = 5, 3
#: Rungs that a value which fails with other starts is taken further.
_FURTHER = 2


class Lever(NamedTuple):
    """A number that a designer may change: its value now, or None where there is none, the bound,
    and the scenario with another value. `by_ratio`: tried values have equal ratios."""

    name: str
    unit: str
    now: Callable[[Scenario], float | None]
    bound: Callable[[Scenario], float]
    changed: Callable[[Scenario, float], Scenario]
    by_ratio: bool = True
    #: The cause that it makes less; None for what makes the coils stronger.
    cause: str | None = None


class Nearest(NamedTuple):
    """A lever's value [its unit] that works, `now` its own; None where none up to `bound` does.

    `verified`: of `runs` other starts, how many arrive there.
    """

    lever: str
    unit: str
    now: float
    value: float | None
    bound: float
    verified: int = 0
    runs: int = 0


def _key(key: str) -> Callable[[Scenario], float | None]:
    """A number at a key, or the length of a vector."""

    def now(scenario: Scenario) -> float | None:
        value = found_at(scenario, key)
        return None if value is None else float(np.linalg.norm(value))

    return now


def _put(key: str) -> Callable[[Scenario, float], Scenario]:
    return lambda scenario, value: with_values(scenario, {key: value})


def _part(name: str) -> Callable[[Scenario, float], Scenario]:
    return lambda scenario, part: lessened(scenario, name, part)


_dipole = _key("spacecraft.coils.residual_dipole_a_m2")


def _with_dipole(scenario: Scenario, dipole_a_m2: float) -> Scenario:
    return lessened(scenario, DIPOLE, dipole_a_m2 / (_dipole(scenario) or 1.0))


def _limit(scenario: Scenario) -> float | None:
    coils = scenario.spacecraft.coils
    return None if coils is None else float(coils.limits_a_m2().min())


def _with_limit(scenario: Scenario, limit: float) -> Scenario:
    coils = scenario.spacecraft.coils
    assert coils is not None
    limits = coils.limits_a_m2()
    new = (limits * (limit / limits.min())).tolist()
    one = np.ptp(limits) == 0.0
    return with_values(scenario, {"spacecraft.coils.limit_a_m2": new[0] if one else new})


def _pitch(scenario: Scenario) -> float | None:
    return float(scenario.spacecraft.body.wheel_momentum_n_m_s[1])


def _with_pitch(scenario: Scenario, momentum: float) -> Scenario:
    key = "spacecraft.body.wheel_momentum_n_m_s"
    x, _, z = scenario.spacecraft.body.wheel_momentum_n_m_s
    return with_values(scenario, {key: [x, momentum, z]})


def _most_pitch(scenario: Scenario) -> float:
    """A wheel of 32 times the momentum of the body's slowest axis at the orbital rate."""
    rate = scenario.orbit.rate_rad_s(scenario.start)
    return 32.0 * rate * float(scenario.spacecraft.body.principal()[0].max())


LEVERS: tuple[Lever, ...] = (
    Lever("residual dipole", "A m^2", _dipole, lambda s: 2.0**-10 * (_dipole(s) or 0.0),
          _with_dipole, cause=DIPOLE),
    Lever("noise of the sensors", "of its own", lambda _: 1.0, lambda _: 2.0**-10, _part(NOISE),
          cause=NOISE),
    Lever("bias of the sensors", "of its own", lambda _: 1.0, lambda _: 2.0**-10, _part(BIAS),
          cause=BIAS),
    Lever("limit of the coils", "A m^2", _limit, lambda s: 32.0 * (_limit(s) or 1.0), _with_limit),
    Lever("momentum of a pitch wheel", "N m s", _pitch, _most_pitch, _with_pitch, by_ratio=False),
    Lever("altitude", "km", _key("orbit.altitude_km"), lambda _: 1000.0, _put("orbit.altitude_km"),
          by_ratio=False),
    Lever("inclination", "deg", _key("orbit.inclination_deg"), lambda _: 90.0,
          _put("orbit.inclination_deg"), by_ratio=False),
)  # fmt: skip


#: Without a wheel, which a satellite that tumbles has no use for.
COILS_ALONE = tuple(lever for lever in LEVERS if lever.now is not _pitch)

#: Those with which a law that knows wheel and orbit may stay as it is.
SAME_LAW = tuple(lever for lever in COILS_ALONE if lever.unit not in ("km", "deg"))


def rungs(lever: Lever, scenario: Scenario) -> list[float]:
    """Values from the satellite's own to the bound, the own first; one where there is no way."""
    now, bound = lever.now(scenario), lever.bound(scenario)
    if now is None or now == bound or (lever.by_ratio and now == 0.0):
        return [now or 0.0]
    spaced = np.geomspace if lever.by_ratio else np.linspace
    return spaced(now, bound, _RUNGS + 1).tolist()


def nearest(
    scenario: Scenario,
    levers: Sequence[Lever],
    fly: Callable[[Scenario, int], tuple[int, int]],
    is_enough: Callable[[int, int], bool],
) -> list[Nearest]:
    """For each lever that has a way to go, the value next to the satellite's own that works.

    `fly`: starts that arrive, and in all, by scenario and seed; 0 of them where no law exists.
    """
    found = []
    for lever in levers:
        values = rungs(lever, scenario)
        if len(values) > 1:
            found.append(_follow(scenario, lever, values, fly, is_enough))
    return found


def _follow(scenario, lever: Lever, values: list[float], fly, is_enough) -> Nearest:
    def works(value: float, seed: int = 1) -> tuple[bool, int, int]:
        try:
            count, runs = fly(lever.changed(scenario, value), seed)
        except (ArithmeticError, ValueError):  # no such design, or no such satellite
            count, runs = 0, 0
        return is_enough(count, runs), count, runs

    first = next((k for k in range(1, len(values)) if works(values[k])[0]), None)
    none = Nearest(lever.name, lever.unit, values[0], None, values[-1])
    if first is None:
        return none
    bad, good = values[first - 1], values[first]
    for _ in range(_HALVINGS):
        middle = math.sqrt(bad * good) if lever.by_ratio else 0.5 * (bad + good)
        bad, good = (bad, middle) if works(middle)[0] else (middle, good)
    for value in [good, *values[first : first + _FURTHER]]:
        value = float(f"{value:.3g}")
        enough, count, runs = works(value, 2)
        if enough:
            return none._replace(value=value, verified=count, runs=runs)
    return none
