"""From a gain to the time that a law needs, and from a time to the gain, by the averaged motion.

Closed equations are linear in eps, and eps in the gain: one integration in the slow time s = eps u
serves every gain. The question is when the law's own quantity (momentum, nutation, distance to
the target) reaches a given fraction of its initial value.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from torquer.theory.slow.evolution.model import Case, Evolution, Slow
from torquer.theory.slow.evolution.sdot import sun_angle
from torquer.theory.slow.slow_motion import evolve
from torquer.theory.slow.spinner import Spinner

#: Slow time after which a law counts as never reaching its goal.
LONGEST = 500.0
_POINTS = 200
#: Below it a quantity (l, or radians) is rounding.
_ZERO = 1e-7


class Goal(NamedTuple):
    """The quantity that a law is to change: its name, and its value for slow variables (arrays)."""

    name: str
    of: Callable[[Slow, Case], np.ndarray]


def angle_to_target(slow: Slow, case: Case):
    """Angle [rad] of the momentum to the law's target."""
    x, y, z = np.asarray(case.target) / np.linalg.norm(case.target)
    across = x * np.cos(slow.sigma) + y * np.sin(slow.sigma)
    cosine = across * np.sin(slow.rho) + z * np.cos(slow.rho)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def angle_to_sun_line(slow: Slow, case: Case):
    """Angle [rad] of the momentum to the Sun or away from it, whichever is less."""
    gamma = sun_angle(slow, case)
    return np.minimum(gamma, math.pi - gamma)


_POINTING = Goal("angle of the momentum to the target", angle_to_target)
GOALS = {
    "bdot": Goal("angular momentum", lambda slow, case: slow.l),
    "bdot_any_field": Goal("angular momentum", lambda slow, case: slow.l),
    "nutation_damping": Goal(
        "momentum across the axis", lambda slow, case: slow.l * np.abs(np.sin(slow.theta))
    ),
    "spin_up": Goal("momentum along the axis", lambda slow, case: slow.l * np.cos(slow.theta)),
    "reorientation": _POINTING,
    "reorientation_as_printed": _POINTING,
    "preliminary_1": _POINTING,
    "preliminary_2": _POINTING,
    "sdot": Goal("angle of the momentum to the Sun's line", angle_to_sun_line),
}


def slow_time(evolution: Evolution, case: Case, start: Slow, part: float) -> float:
    """Slow time s = eps u until the law's quantity is `part` of its initial value; inf: never.

    `part` below 1 for what decays, above 1 for what grows (in magnitude, for a spin in the wrong
    sense). 0 if what decays is zero from the start; inf if what grows is, and if the momentum
    vanishes before.
    """
    if not (0.0 < part < math.inf and part != 1.0):
        raise ValueError(f"part: must be positive, finite and not 1; received {part}")
    case, goal = case._replace(eps=1.0), GOALS[evolution.name].of
    first, here, passed, span = float(goal(start, case)), start, 0.0, 1.0
    if abs(first) < _ZERO:
        return 0.0 if part < 1.0 else math.inf
    wanted = part * abs(first)
    while passed < LONGEST:
        found = _crossing(evolution, case, here, span, goal, wanted, part < 1.0)
        if isinstance(found, float):
            return float(passed + found)
        if math.isnan(found.l):  # the momentum vanishes
            return math.inf
        here, passed, span = found, passed + span, 2.0 * span
    return math.inf


def _crossing(evolution, case, start, span, goal, wanted, falls, finer=2):
    """Slow time of the first crossing within a span, or the state at its end if there is none."""
    s = np.linspace(0.0, span, _POINTS)
    path = evolve(evolution, case, start, s)
    value = goal(path, case)
    reached = value <= wanted if falls else value >= wanted
    if not reached.any():
        return Slow(*(float(x[-1]) for x in path))
    k = int(np.argmax(reached))
    if k == 0:
        return 0.0
    if finer:
        before = Slow(*(float(x[k - 1]) for x in path))
        rest = _crossing(evolution, case, before, s[1], goal, wanted, falls, finer - 1)
        return s[k - 1] + rest if isinstance(rest, float) else float(s[k])
    share = (wanted - value[k - 1]) / (value[k] - value[k - 1])
    return float(s[k - 1] + share * s[1])


class Times(NamedTuple):
    """Slow times over the directions of the momentum: least, median, greatest."""

    least: float
    median: float
    greatest: float


def even_directions(count: int = 60) -> list[tuple[float, float]]:
    """(rho, sigma) of points spread evenly over the sphere, excluding both poles."""
    if count < 1:
        raise ValueError(f"count: must be at least 1; received {count}")
    k = np.arange(count)
    rho = np.arccos(1.0 - (2.0 * k + 1.0) / count)
    sigma = np.mod(k * math.pi * (3.0 - math.sqrt(5.0)), 2.0 * math.pi)
    return list(zip(rho.tolist(), sigma.tolist(), strict=True))


class Start(NamedTuple):
    """Direction of the momentum [rad], and the slow time until the goal from there."""

    rho: float
    sigma: float
    slow: float


def starts_over_directions(
    evolution: Evolution, case: Case, theta: float, part: float, count: int = 60
) -> tuple[Start, Start, Start]:
    """Over all directions, from l = 1 and nutation `theta`: those of the least, the median and the
    greatest slow time to `part`."""
    each = sorted(
        (
            Start(rho, sigma, slow_time(evolution, case, Slow(1.0, rho, sigma, theta), part))
            for rho, sigma in even_directions(count)
        ),
        key=lambda start: start.slow,
    )
    return each[0], each[len(each) // 2], each[-1]


def times_over_directions(
    evolution: Evolution, case: Case, theta: float, part: float, count: int = 60
) -> Times:
    """Slow times to `part` over all directions of the momentum, from l = 1 and nutation `theta`."""
    starts = starts_over_directions(evolution, case, theta, part, count)
    return Times(*(start.slow for start in starts))


@dataclass(frozen=True)
class Row:
    """One row of a design table: gain, its small parameter, revolutions needed."""

    gain: float
    eps: float
    revolutions: Times


def gain_at(evolution: Evolution, spinner: Spinner, eps: float) -> float:
    """The gain with which the small parameter is `eps`."""
    return eps / evolution.small_parameter(1.0, spinner)


def design_table(
    evolution: Evolution, spinner: Spinner, times: Times, gains: Sequence[float]
) -> list[Row]:
    """Revolutions that each gain needs, from slow times."""
    rows = []
    for gain in gains:
        if not 0.0 < gain < math.inf:
            raise ValueError(f"gain: must be positive and finite; received {gain}")
        eps = evolution.small_parameter(float(gain), spinner)
        turns = Times(*(s / (2.0 * math.pi * eps) for s in times))
        rows.append(Row(float(gain), eps, turns))
    return rows


def gain_for(evolution: Evolution, spinner: Spinner, times: Times, revolutions: float) -> Times:
    """Gains for which the least, median and greatest time is `revolutions`."""
    if not 0.0 < revolutions < math.inf:
        raise ValueError(f"revolutions: must be positive and finite; received {revolutions}")
    return Times(*(gain_at(evolution, spinner, s / (2.0 * math.pi * revolutions)) for s in times))
