"""How large the quantities that sensors read are in a run, and what light of the Earth adds."""

import math
from typing import NamedTuple

import numpy as np

from torquer.base.conventions import EARTH_RADIUS_M
from torquer.scenario.spec import Scenario

#: Instants of a revolution at which the field is taken.
_INSTANTS = 50
_RADIAN_DEG = math.degrees(1.0)


class Size(NamedTuple):
    """Least and greatest size of a quantity, in the unit of its sensors, with words for each.

    `hidden_by`: part of the least which errors of single readings must exceed to hide it;
    `averages`: whether noise does not count as such an error; `quietest`: noise that no sensor is
    below.
    """

    least: float
    greatest: float
    as_least: str
    as_greatest: str
    hidden_by: float
    averages: bool
    quietest: float


def find_sizes(scenario: Scenario) -> dict[str, Size]:
    """Sizes of all quantities, by the names that data sheets have for them."""
    # the rest of a component that is 0.2 of the whole turns a direction by 11 deg
    turn = Size(_RADIAN_DEG, _RADIAN_DEG, "a radian", "a radian", 0.2, False, 1e-6)
    t_s, b_nt = _along_orbit(scenario)
    return {
        "field": _field(b_nt),
        "field_rate": _field_rate(scenario, t_s, b_nt),
        "rate": _rate(scenario),
        "sun": turn,
        "nadir": turn,
        "attitude": turn,
        "light": Size(1.0, 1.0, "full sunlight", "full sunlight", 0.2, False, 1e-7),
    }


def _along_orbit(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Instants [s] of a revolution, or of the run, and the field there [nT], inertial (n, 3)."""
    environment, revolution_s = scenario.orbit_environment(), scenario.orbit.period_s
    t_s = np.linspace(0.0, min(revolution_s, scenario.length_s), _INSTANTS)
    return t_s, 1e9 * environment.sample(t_s)[:, 3:6]


def _field(b_nt: np.ndarray) -> Size:
    field_nt = np.linalg.norm(b_nt, axis=1)
    least, greatest = float(field_nt.min()), float(field_nt.max())
    weakest = f"the field where it is weakest on this orbit, {least:.3g} nT"
    strongest = f"on this orbit, where the field reaches {greatest:.3g} nT"
    return Size(least, greatest, weakest, strongest, 0.2, False, 1e-3)


def _field_rate(scenario: Scenario, t_s: np.ndarray, b_nt: np.ndarray) -> Size:
    """Rate of the field in the body: at the start, or what the orbit alone makes of it."""
    orbital = np.linalg.norm(np.diff(b_nt, axis=0), axis=1).max() / (t_s[1] - t_s[0])
    turning = math.radians(rate_at_start_deg_s(scenario)) * np.linalg.norm(b_nt, axis=1).max()
    size = float(orbital + turning)
    words = f"the field's rate of {size:.3g} nT/s at the initial rate"
    return Size(size, size, words, f"by {words}", 0.2, False, 1e-6)


def _rate(scenario: Scenario) -> Size:
    """The rate at the start, or the orbital one that pointing to the Earth takes."""
    initial = rate_at_start_deg_s(scenario)
    orbital = math.degrees(scenario.orbit.rate_rad_s(scenario.start))
    size, name = max((initial, "initial"), (orbital, "orbital"))
    words = f"the {name} rate of {size:.3g} deg/s"
    return Size(
        size, initial, words, f"by the initial rate of {initial:.3g} deg/s", 1.0, True, 1e-9
    )


def rate_at_start_deg_s(scenario: Scenario) -> float:
    """Size of the absolute rate at the start."""
    return math.degrees(float(np.linalg.norm(scenario.motion_at_start()[4:])))


def earthlight_part(scenario: Scenario, albedo: float) -> float:
    """Greatest light of the Earth at the start, in parts of the Sun's: below it on the day side.

    A bright sphere's light falls as the square of the distance.
    """
    return albedo * (EARTH_RADIUS_M / distance_m(scenario)) ** 2


def distance_m(scenario: Scenario) -> float:
    """Distance from the Earth's centre at the start."""
    r, _ = scenario.orbit_environment().state(np.zeros(1))
    return float(np.linalg.norm(r[0]))
