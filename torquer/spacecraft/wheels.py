"""Reaction wheels on the satellite: their spec, what is read of them, how a torque is shared.

The wheels are driven by torque. At every reading the computer takes the speeds, asks the law of
the wheels for a torque on the body and shares it: by minimax with the limits of torque and of
momentum kept and the wheels' null space steered, or by least squares. It goes on asking wheels
that have died until their failure is noticed.
"""

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from torquer import noise
from torquer.engine import inlined, kernel
from torquer.geometry.vec3 import add_scaled, as_symmetric, scale
from torquer.spacecraft.rotors import (
    AXIS,
    BIAS,
    BREAKAWAY,
    CELLS,
    COULOMB,
    DEAD_FROM,
    INERTIA,
    MOMENTUM,
    MOMENTUM_LIMIT,
    MOTOR,
    READ,
    ROW,
    SPEED_LIMIT,
    STANDS,
    TORQUE_LIMIT,
    VISCOUS,
    Rotors,
    axis_of,
    relative_momentum,
)
from torquer.spec import Spec
from torquer.wheel_array.allocation import least_squares, within_limits
from torquer.wheel_array.layout import Limit
from torquer.wheel_array.presets import Wheels
from torquer.wheel_array.steering import Steering, lose, steer, steer_nearest, steering_of

STREAM = 7
_RPM = 2.0 * math.pi / 60.0
#: What stands for a step that never comes.
_NEVER = 1e18


class Driver(NamedTuple):
    """Constants of wheels and of the computer that drives them, for kernels; n wheels."""

    rotors: Rotors
    steering: Steering
    """As it is at the start; limits and bias that hold now are in the state."""
    noticed_from: np.ndarray
    """(n,): the step from which on the computer knows that a wheel is dead."""
    driven: bool
    """False: nobody drives the wheels, the motors are off."""
    by_least_squares: bool
    noise_rad_s: float
    parameters: np.ndarray
    """Those of the law of the wheels."""


@kernel
def read_wheels(driver, state, omega_body, seed, step):
    """Read the speeds into row READ of the state, as momenta; return their vector sum [N m s]."""
    rows, total, drawn = driver.rotors.rows, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(rows.shape[0]):
        if driver.noise_rad_s > 0.0 and k % 3 == 0:
            drawn = noise.normal3(seed, STREAM, 4 * step + k // 3)
        read = relative_momentum(rows, state, omega_body, k)
        state[READ, k] = read + rows[k, INERTIA] * driver.noise_rad_s * drawn[k % 3]
        total = add_scaled(total, state[READ, k], axis_of(rows, k))
    return total


@inlined
def _steering_now(first, state):
    limits = state[MOMENTUM_LIMIT], state[TORQUE_LIMIT]
    return Steering(first.wheels, *limits, state[BIAS], first.bias_after, first.work)


@kernel
def drive_wheels(driver, state, torque_body, interval_s, step):
    """Set the motors for an interval, so that the body gets a torque [N m] from the wheels.

    What is beyond the motors is cut with the direction kept; by minimax what would drive full
    wheels on is left out, too. `driver`: () for no wheels.
    """
    if len(driver) == 0 or not driver.driven:
        return
    steering, wanted = _steering_now(driver.steering, state), scale(-1.0, torque_body)
    for k in range(driver.noticed_from.shape[0]):
        if step >= driver.noticed_from[k] and state[TORQUE_LIMIT, k] > 0.0:
            lose(steering, k)
    if driver.by_least_squares:
        limit = steering.torque_limit
        greatest = least_squares(steering.wheels.axes, limit, wanted, state[MOTOR])
        within_limits(greatest, state[MOTOR])
    else:
        part = steer(steering, interval_s, state[READ], wanted, state[MOTOR])
        if part < 1.0:
            steer_nearest(steering, interval_s, state[READ], wanted, state[MOTOR])


class Failure(Spec):
    """A wheel, by its number from 0, whose motor dies; the computer notices some time later."""

    wheel: int = Field(ge=0)
    time_s: float = Field(ge=0.0)
    noticed_after_s: float = Field(default=0.0, ge=0.0)


_PerWheel = float | tuple[float, ...]


class ReactionWheels(Wheels):
    """Reaction wheels, driven by torque; a layout and limits as in a wheel design.

    `momentum_limit_n_m_s` is reached at `speed_limit_rpm`, which makes the rotors' inertia (it is
    part of the body's). Friction of a turning wheel: `coulomb_friction_n_m` and
    `viscous_friction_n_m_s` (N m per rad/s); a standing one needs more than `stiction_n_m` (left
    out: the Coulomb friction) to turn. `speed_noise_rpm`: standard deviation of a tachometer's
    reading. `initial_speed_rpm`: one number or one per wheel. `lost`: wheels dead from the start;
    `failures` in flight. `allocation`: 'minimax' or 'least_squares' (the pseudo-inverse).
    `minimum_speed_fraction`: keep the wheels above this part of their limits by a bias in the null
    space (left out: no bias). Without a law of the wheels their motors are off.

    By minimax what torque is left over evens the wheels out in their null space; while a dead
    wheel is not noticed, this and the bias disturb the body.
    """

    renamed: ClassVar = {"idle_share": "minimum_speed_fraction"}

    torque_limit_n_m: Limit | tuple[Limit, ...]
    speed_limit_rpm: float = Field(default=6000.0, gt=0.0)
    coulomb_friction_n_m: float = Field(default=0.0, ge=0.0)
    viscous_friction_n_m_s: float = Field(default=0.0, ge=0.0)
    stiction_n_m: float | None = Field(default=None, ge=0.0)
    speed_noise_rpm: float = Field(default=0.0, ge=0.0)
    initial_speed_rpm: _PerWheel = 0.0
    failures: tuple[Failure, ...] = ()
    allocation: Literal["minimax", "least_squares"] = "minimax"
    minimum_speed_fraction: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None

    @model_validator(mode="after")
    def _wheels_make_sense(self):
        count = len(self.layout.rows())
        if self.stiction_n_m is not None and self.stiction_n_m < self.coulomb_friction_n_m:
            raise ValueError(
                f"stiction_n_m: must not be below coulomb_friction_n_m = "
                f"{self.coulomb_friction_n_m:g}; received {self.stiction_n_m:g}"
            )
        if isinstance(self.initial_speed_rpm, tuple) and len(self.initial_speed_rpm) != count:
            raise ValueError(
                f"initial_speed_rpm: must be one number or one per wheel ({count}); "
                f"received {len(self.initial_speed_rpm)}"
            )
        if np.abs(self.initial_speed_rpm).max() > self.speed_limit_rpm:
            raise ValueError(
                f"initial_speed_rpm: must not exceed speed_limit_rpm = {self.speed_limit_rpm:g}; "
                f"received {self.initial_speed_rpm}"
            )
        if self.minimum_speed_fraction is not None and self.allocation != "minimax":
            raise ValueError(
                "allocation: must be 'minimax' with minimum_speed_fraction; "
                f"received {self.allocation!r}"
            )
        self._check_failures(count)
        return self

    def _check_failures(self, count: int) -> None:
        known = set(self.lost)
        for failure in self.failures:
            if failure.wheel >= count or failure.wheel in known:
                raise ValueError(
                    f"failures: wheel must be another working one from 0 to {count - 1} in each; "
                    f"received {failure.wheel}"
                )
            known.add(failure.wheel)

    @property
    def speed_limit_rad_s(self) -> float:
        """Greatest speed."""
        return self.speed_limit_rpm * _RPM

    def initial_speeds_rad_s(self) -> np.ndarray:
        """Speed of each wheel (n,) at the start."""
        return np.full(len(self.layout.rows()), self.initial_speed_rpm) * _RPM

    def rotor_inertia_kg_m2(self) -> np.ndarray:
        """Inertia of each rotor about its axis (n,)."""
        count = len(self.layout.rows())
        return np.full(count, self.momentum_limit_n_m_s) / self.speed_limit_rad_s

    def rotor_tensor_kg_m2(self) -> np.ndarray:
        """Sum of the rotors' inertia about their axes as a tensor (3, 3)."""
        axes = np.array(self.array().axes)
        return np.einsum("k,ki,kj->ij", self.rotor_inertia_kg_m2(), axes, axes)

    def pack(self, parameters: np.ndarray, step_s: float, driven: bool = True) -> Driver:
        """Constants for kernels; `parameters` are those of the law that drives the wheels."""
        array = self.array()
        rows = np.zeros((array.count, ROW))
        rows[:, AXIS:INERTIA] = array.axes
        rows[:, INERTIA] = self.rotor_inertia_kg_m2()
        rows[:, SPEED_LIMIT] = self.speed_limit_rad_s
        rows[:, COULOMB], rows[:, VISCOUS] = self.coulomb_friction_n_m, self.viscous_friction_n_m_s
        stiction = self.stiction_n_m
        rows[:, BREAKAWAY] = self.coulomb_friction_n_m if stiction is None else stiction
        rows[:, DEAD_FROM], noticed = self._steps_of_failures(array.count, step_s)
        return Driver(
            rotors=Rotors(rows, as_symmetric(self.rotor_tensor_kg_m2())),
            steering=steering_of(array, self.minimum_speed_fraction),
            noticed_from=noticed,
            driven=driven,
            by_least_squares=self.allocation == "least_squares",
            noise_rad_s=self.speed_noise_rpm * _RPM,
            parameters=parameters,
        )

    def _steps_of_failures(self, count: int, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        dead, noticed = np.full(count, _NEVER), np.full(count, _NEVER)
        dead[list(self.lost)] = 0.0
        for failure in self.failures:
            dead[failure.wheel] = math.ceil(failure.time_s / step_s - 1e-9)
            known_s = failure.time_s + failure.noticed_after_s
            noticed[failure.wheel] = math.ceil(known_s / step_s - 1e-9)
        return dead, noticed

    def first_state(self, driver: Driver, omega_body) -> np.ndarray:
        """State at the start, for a rate of the body [rad/s]."""
        rows, steering = driver.rotors.rows, driver.steering
        state = np.zeros((CELLS, len(rows)))
        speed = self.initial_speeds_rad_s()
        state[MOMENTUM] = rows[:, INERTIA] * (speed + rows[:, AXIS:INERTIA] @ omega_body)
        state[STANDS] = (speed == 0.0) & (rows[:, BREAKAWAY] > 0.0)
        state[MOMENTUM_LIMIT], state[TORQUE_LIMIT] = steering.momentum_limit, steering.torque_limit
        state[BIAS] = steering.bias
        return state
