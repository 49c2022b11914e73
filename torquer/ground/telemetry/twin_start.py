"""First guesses of a twin: ratios of its moments of inertia, attitudes that show the field."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from torquer.ground.telemetry.twin_flights import COUNT, Points, join_points, twin_inertia
from torquer.ground.telemetry.twin_readings import Readings
from torquer.scenario.spec import Scenario

#: Logarithms of the changes of two ratios of moments, angles about the field.
_RATIOS, _ANGLES = np.linspace(-0.3, 0.3, 5), 8
_STEP_S = 0.05


def guesses(scenario: Scenario, readings: Readings) -> Points:
    """Twins that have the field and the rate of the first row, whatever the rest may be.

    Rate and attitude are carried back to the flights' start by free rotation.
    """
    turns = Rotation.from_rotvec(
        np.outer(np.arange(_ANGLES) * 2.0 * np.pi / _ANGLES, _unit(readings.b_j[0]))
    )
    at_first = turns * _turning(_unit(readings.b[0]), _unit(readings.b_j[0]))
    parts = []
    for change in _changes():
        omega, back = _carried_back(
            twin_inertia(scenario, change), readings.omega[0], float(readings.t_s[0])
        )
        q = (at_first * back).as_quat()
        parts.append(Points(q, np.tile(omega, (_ANGLES, 1)), np.tile(change, (_ANGLES, 1))))
    return join_points(parts)


def _changes() -> list[np.ndarray]:
    """Physical parameters [10] with other ratios of the moments, whose product stays."""
    found = []
    for first in _RATIOS:
        for second in _RATIOS:
            change = np.zeros(COUNT)
            change[:3] = np.array([first, second, 0.0]) - (first + second) / 3.0
            found.append(change)
    return found


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _turning(a: np.ndarray, b: np.ndarray) -> Rotation:
    """The shortest rotation that takes a unit vector into another."""
    return Rotation.align_vectors(b[None], a[None])[0]


def _carried_back(inertia: np.ndarray, omega: np.ndarray, t_s: float) -> tuple:
    """Rate t_s earlier in free rotation, and the rotation from then until now reversed, such that
    the attitude then is that of now times it."""
    inverse, back = np.linalg.inv(inertia), Rotation.identity()
    steps = max(1, int(np.ceil(t_s / _STEP_S)))
    h = t_s / steps

    def rise(w):
        return -inverse @ np.cross(w, inertia @ w)

    for _ in range(steps if t_s > 0.0 else 0):
        middle = omega - 0.5 * h * rise(omega)
        back = back * Rotation.from_rotvec(-h * middle)
        omega = omega - h * rise(middle)
    return omega, back
