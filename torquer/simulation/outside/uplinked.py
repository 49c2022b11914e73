"""What the ground sends up for the computer on board: orbit and models, calibration.

Models are in use from the next control step on, a calibration from the next reading or command of
the coils on. All of it is part of a flight's state: of snapshots, and of results that are resumed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from torquer.computer.calibration import (
    CALIBRATED,
    IDENTITY,
    NO_BIAS,
    calibrate_coils,
    calibrate_sensor,
    calibrate_tachometers,
    nothing_calibrated,
)
from torquer.computer.interface import SENSORS
from torquer.environment.chosen_models import AS_LAUNCHED, Choice, NoSuchModel, chosen_models
from torquer.environment.ephemeris import AnyEnvironment, EphemerisModels
from torquer.simulation.loop.step import WORKED
from torquer.simulation.loop.timetable import READ, all_actions
from torquer.simulation.outside.directed import Directed, finite_numbers


class Uplinked(Directed):
    """A flight whose computer takes up what the ground sends."""

    def chosen_ephemeris(
        self, elements: tuple[str, str] | None = None, choice: Choice = AS_LAUNCHED
    ) -> EphemerisModels:
        """Models for `set_ephemeris` by two-line elements and a choice of the ground.

        `NoSuchModel`, a ValueError, for what this computer does not have.
        """
        scenario = self._run.scenario
        launched, truth = scenario.control.ephemeris, scenario.orbit_environment()
        return chosen_models(launched, truth, elements, choice)

    def set_ephemeris(self, models: EphemerisModels | None = None) -> None:
        """Have the ephemeris on board come from these models; None: from the scenario's.

        `NoSuchModel`, a ValueError, where nothing on board needs an ephemeris; ValueError for
        models that do not hold until the end of the flight. Nothing is changed then.
        """
        self._direct("set_ephemeris")
        run = self._run
        if not run.plan.needs_ephemeris:
            raise NoSuchModel("set_ephemeris: must be left out where nothing needs an ephemeris")
        has_worked = int(run.state.at[1]) == WORKED
        from_s = run.now_s - (0.0 if has_worked else run.plan.step_s)
        run.take_up(run.scenario.control.ephemeris if models is None else models, from_s)

    def ephemeris_apart(self, models: EphemerisModels) -> tuple[float, float]:
        """How far models are from what the computer believes now.

        Distance of the places [m], angle between the planes of the orbits [rad].
        """
        given = models.along(self._run.scenario.orbit_environment())
        (r, v), (own_r, own_v) = self._place(given), self._place(self._believed())
        normal, own = np.cross(r, v), np.cross(own_r, own_v)
        angle = math.atan2(float(np.linalg.norm(np.cross(normal, own))), float(normal @ own))
        return float(np.linalg.norm(r - own_r)), angle

    def calibrate(self, sensor: str, matrix=IDENTITY, bias=NO_BIAS) -> None:
        """Correct the readings of magnetometer, gyro or Sun sensors.

        Corrected is `matrix` (9, row by row), which must have an inverse, times the reading less
        `bias` (3) [SI]. ValueError, also where this satellite has none or several of the kind.
        """
        self._direct("calibrate")
        number = self._calibrated(sensor)
        numbers = finite_numbers("matrix", matrix, 9), finite_numbers("bias", bias, 3)
        if not abs(np.linalg.det(np.reshape(numbers[0], (3, 3)))) > 0.0:
            raise ValueError(f"matrix: must have an inverse; received {matrix!r}")
        calibrate_sensor(self._run.state.calibration, number, *numbers)

    def calibrate_coils(self, factors: Iterable[float]) -> None:
        """Multiply the dipole that coils are commanded to by three positive factors.

        What laws know of their dipole is what comes out then.
        """
        self._direct("calibrate_coils")
        if not self._run.scenario.spacecraft.coils:
            raise NoSuchModel("calibrate_coils: must be left out for a satellite without coils")
        calibrate_coils(self._run.state.calibration, _positive("factors", factors, 3))

    def calibrate_tachometers(self, factors: Iterable[float]) -> None:
        """Multiply what the wheels' tachometers read by positive factors, one for each wheel."""
        self._direct("calibrate_tachometers")
        count = len(self._run.state.rotors)
        if not count:
            raise NoSuchModel(
                "calibrate_tachometers: must be left out for a satellite without wheels"
            )
        calibrate_tachometers(self._run.state.calibration, _positive("factors", factors, count))

    @property
    def wheel_count(self) -> int:
        """Number of the satellite's wheels."""
        return len(self._run.state.rotors)

    def restart_computer(self) -> None:
        """As of `Directed`; what the ground has sent up must be taken up again, too."""
        super().restart_computer()
        self._run.state.calibration[...] = nothing_calibrated()
        if self._run.uplinked:
            self.set_ephemeris()

    def _calibrated(self, sensor: str) -> int:
        """The number of a sensor that can be calibrated."""
        known = [SENSORS[number] for number in CALIBRATED]
        if sensor not in known:
            raise ValueError(f"sensor: must be one of {', '.join(known)}; received {sensor!r}")
        number = SENSORS.index(sensor)
        if not all_actions(self._run.plan.timetable) & (READ << number):
            raise NoSuchModel(f"sensor: must be read, and be one alone; received {sensor!r}")
        return number

    def _believed(self) -> AnyEnvironment:
        return self._run.believed()[-1][1]

    def _place(self, environment: AnyEnvironment) -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and velocity [m/s] by an environment now."""
        r, v = environment.state(np.array([self._run.now_s]))
        return r[0], v[0]


def _positive(name: str, values: Iterable[float], count: int) -> tuple[float, ...]:
    found = finite_numbers(name, values, count)
    if not min(found) > 0.0:
        raise ValueError(f"{name}: must be positive; received {values!r}")
    return found
