"""Reaction wheels on the satellite: their spec and their tachometers.

The wheels are driven by torque; how the computer shares a torque among them is defined in
`torquer.computer.allocation`.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from torquer.base import noise
from torquer.base.spec import Spec
from torquer.compile.engine import kernel, records
from torquer.maths.geometry.vec3 import add_scaled, as_symmetric
from torquer.spacecraft.actuators.rotors import (
    ROTOR,
    ROTOR_STATE,
    Rotors,
    relative_momentum,
    rotor_axis,
)
from torquer.spacecraft.data_sheet import DataSheet
from torquer.spacecraft.wheel_array.layout import Limit
from torquer.spacecraft.wheel_array.presets import Wheels

STREAM = 7
_RPM = 2.0 * math.pi / 60.0


@kernel
def read_tachometers(rotors, noise_rad_s, state, omega_body, seed, sample, momenta):
    """Read the speeds, as momenta (n,) [N m s] relative to the body; return their vector sum."""
    rows, total, noise_sample = rotors.rows, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(rows.shape[0]):
        if noise_rad_s > 0.0 and k % 3 == 0:
            noise_sample = noise.normal3(seed, STREAM, 4 * sample + k // 3)
        read = relative_momentum(rows, state, omega_body, k)
        momenta[k] = read + rows[k].inertia * noise_rad_s * noise_sample[k % 3]
        total = add_scaled(total, momenta[k], rotor_axis(rows, k))
    return total


class Failure(Spec):
    """A wheel whose motor fails; the computer detects the failure some time later."""

    wheel: int = Field(ge=0)
    """Number of the wheel, from 0."""
    time_s: float = Field(ge=0.0)
    """Time since the start at which its motor fails."""
    noticed_after_s: float = Field(default=0.0, ge=0.0)
    """Time from the failure until the computer detects it."""


_PerWheel = float | tuple[float, ...]


class ReactionWheels(Wheels):
    """Reaction wheels, driven by torque; a layout and limits as in a wheel design.

    `momentum_limit_n_m_s` is reached at `speed_limit_rpm`, which determines the rotors' inertia (a
    part of the body's). Without a law that drives them the motors are off.

    With minimax, the torque that the demand leaves available evens out the wheels in their null
    space; while a failed wheel is undetected, this and the bias of the speeds disturb the body.
    """

    #: Of its tachometers.
    sheet: ClassVar = DataSheet(
        name="tachometer", senses="", unit="rpm", noise="speed_noise_rpm", range="speed_limit_rpm"
    )
    torque_limit_n_m: Limit | tuple[Limit, ...]
    """Greatest motor torque, one number or one per wheel."""
    speed_limit_rpm: float = Field(default=6000.0, gt=0.0)
    """Speed at which a wheel has its greatest momentum."""
    coulomb_friction_n_m: float = Field(default=0.0, ge=0.0)
    """Coulomb friction of a spinning wheel."""
    viscous_friction_n_m_s: float = Field(default=0.0, ge=0.0)
    """Viscous friction of a spinning wheel, N m per rad/s."""
    stiction_n_m: float | None = Field(default=None, ge=0.0)
    """Torque needed to start a wheel from rest; left out: the Coulomb friction."""
    speed_noise_rpm: float = Field(default=0.0, ge=0.0)
    """Standard deviation of a tachometer's reading."""
    initial_speed_rpm: _PerWheel = 0.0
    """Speed at the start, one number or one per wheel."""
    failures: tuple[Failure, ...] = ()
    """Failures in flight."""
    allocation: Literal["minimax", "least_squares"] = "minimax"
    """How the demanded torque is shared: 'minimax' (the greatest share of a limit is as small as
    possible) or 'least_squares' (the pseudo-inverse).
    """
    minimum_speed_fraction: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Fraction of their limits above which a bias in the null space keeps the wheels' speeds; left
    out: no bias.
    """

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

    @property
    def speed_noise_rad_s(self) -> float:
        """Standard deviation of a tachometer's reading."""
        return self.speed_noise_rpm * _RPM

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

    def pack(self, step_s: float) -> Rotors:
        """Constants of the rotors for kernels."""
        axes = np.array(self.array().axes)
        rows, stiction = np.zeros(len(axes), ROTOR), self.stiction_n_m
        for k, c in enumerate("xyz"):
            rows[f"axis_{c}"] = axes[:, k]
        rows["inertia"] = self.rotor_inertia_kg_m2()
        rows["speed_limit"] = self.speed_limit_rad_s
        rows["coulomb"], rows["viscous"] = self.coulomb_friction_n_m, self.viscous_friction_n_m_s
        rows["breakaway"] = self.coulomb_friction_n_m if stiction is None else stiction
        rows["dead_from"] = self.dead_from_step(step_s)
        return Rotors(records(rows), as_symmetric(self.rotor_tensor_kg_m2()))

    def dead_from_step(self, step_s: float) -> np.ndarray:
        """The step (n,) from which on each motor has failed; infinite for one that never fails."""
        dead = np.full(len(self.layout.rows()), np.inf)
        dead[list(self.lost)] = 0.0
        for failure in self.failures:
            dead[failure.wheel] = math.ceil(failure.time_s / step_s - 1e-9)
        return dead

    def noticed_from_step(self, step_s: float) -> np.ndarray:
        """The step (n,) from which on the computer knows of a failure in flight."""
        noticed = np.full(len(self.layout.rows()), np.inf)
        for failure in self.failures:
            known_s = failure.time_s + failure.noticed_after_s
            noticed[failure.wheel] = math.ceil(known_s / step_s - 1e-9)
        return noticed

    def first_state(self, rotors: Rotors, omega_body) -> np.ndarray:
        """State of the rotors at the start, for a rate of the body [rad/s]."""
        rows, speed = rotors.rows, self.initial_speeds_rad_s()
        state = np.zeros(len(rows), ROTOR_STATE)
        axes = np.array([rotor_axis(rows, k) for k in range(len(rows))])
        state["momentum"] = rows["inertia"] * (speed + axes @ omega_body)
        state["stands"] = (speed == 0.0) & (rows["breakaway"] > 0.0)
        return records(state)
