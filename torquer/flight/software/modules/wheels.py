"""Driver of the wheels: manual control, all at once or one by one, and which of them are in use.

Each wheel's tachometer shows whether it follows its motor's command. One that does not is lost: the
computer is told to drive the others only. An axis is lost when no wheel in use has a part of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from pydantic import Field

from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.actuators import Actuator, Factor, ManualSettings
from torquer.flight.software.modules.telemetry import bits, calibration

#: Part of an axis that wheels must have to make a torque about it.
_NO_PART = 1e-6
#: Revolutions per minute in one radian per second.
_RPM = 60.0 / (2.0 * math.pi)


class WheelSettings(ManualSettings):
    """Settings of the wheels' driver."""

    window_s: float = Field(default=60.0, gt=0.0)
    """Time over which change of momentum and commanded torque are compared."""
    least_n_m_s: float = Field(default=1e-3, gt=0.0)
    """Commanded change of a wheel's momentum below which nothing is concluded."""
    following: float = Field(default=0.3, gt=0.0, lt=1.0)
    """Part of the commanded change that a wheel must make to follow."""
    full_n_m_s: float = Field(default=0.0175, gt=0.0)
    """Momentum of a wheel beyond which it may be full, and need not follow."""
    failures: int = Field(default=3, ge=1)
    """Windows in a row without following after which a wheel is lost."""
    report_s: float = Field(default=60.0, ge=0.0)
    """Time between two packets on the wheels; 0: none."""
    tachometers: tuple[Factor, ...] = ()
    """By what the readings of the tachometers are multiplied, one for each wheel; none: by 1."""


class Wheels(Actuator):
    """Reaction wheels; their tachometers show which of them follow.

    `lost`: wheels that did not follow; `switched_off`: by command, one by one; `alone`: the one
    that is under manual control, while the others' motors are off.
    """

    name = device = "wheels"
    Settings = WheelSettings
    command = "torque_n_m"

    def __init__(self, settings: WheelSettings):
        super().__init__(settings)
        self.lost: list[bool] = []
        self.switched_off: list[bool] = []
        self.in_row: list[int] = []
        self.alone: int | None = None
        self.lost_axes = [False, False, False]
        self.first: list[float] | None = None
        self.impulse: list[float] = []
        self.first_s = self.last_s = self.due_s = 0.0

    def start(self, core) -> None:
        """All wheels are in use that were neither lost nor switched off; after a boot all.

        The first packet comes after the first period.
        """
        super().start(core)
        count = len(core.wheel_axes)
        if len(self.lost) != count:
            self.lost, self.switched_off = [False] * count, [False] * count
            self.in_row = [0] * count
        self.first, self.due_s = None, core.t_s + self.settings.report_s
        self._use(core)

    def step(self, core) -> None:
        """Add up the commanded impulses; compare at the end of a window."""
        super().step(core)
        if not self.lost:
            return
        momenta, torques = core.wheels()
        self._follow(core, momenta, torques)
        if self.settings.report_s and core.t_s >= self.due_s and core.sends("wheels"):
            self.due_s = core.t_s + self.settings.report_s
            core.send("wheels", self.values(core, momenta, torques))

    def values(self, core, momenta, torques) -> tuple:
        """Values of the packet `wheels`: as many as it has room for, unknown for those beyond."""
        room = core.dictionary.down["wheels"].fields[0].count
        missing = [math.nan] * (room - len(momenta))
        pairs = zip(momenta, core.wheel_inertia_kg_m2, strict=True)
        speeds = [_RPM * momentum / inertia for momentum, inertia in pairs]
        return (
            *speeds[:room],
            *missing,
            *torques[:room],
            *missing,
            bits(self._in_use()[:room]),
            bits(self.lost[:room]),
        )

    def raw(self, core, unit: int) -> tuple | None:
        """Time [s] of the tachometers' latest reading; the wheels' momentum [N m s, body] (0), or
        speed [rad/s] and momentum of one wheel (from 1 on); None for one that there is not."""
        taken_s = core.inputs.read_at.tachometers_s
        if unit == 0:
            return (taken_s, *core.inputs.wheel_momentum_body_n_m_s)
        if unit > len(self.lost):
            return None
        momentum = core.wheels()[0][unit - 1]
        return taken_s, momentum / core.wheel_inertia_kg_m2[unit - 1], momentum

    def power(self, core, on: bool) -> Reason:
        """Switch the power of all: without it there are no motors and no tachometers."""
        self.is_powered, self.first = on, None
        core.silence("tachometers", not on)
        return self._end_manual(core)

    @property
    def supplies(self) -> bool:
        """Whether there is a calibration."""
        return bool(self.settings.tachometers)

    def supply(self, computer) -> None:
        """Give the computer the tachometers' factors."""
        computer.calibrate_tachometers(self._factors(computer))

    def in_force(self, core):
        """The tachometers' factors."""
        return [calibration(core, self.name, self._factors(core.computer))]

    def _factors(self, computer) -> tuple[float, ...]:
        return self.settings.tachometers or (1.0,) * computer.wheel_count

    def on_wheels_calibration(self, core, values) -> Reason:
        """A factor of the readings of one wheel's tachometer."""
        wheel, factor = values
        factors = list(self._factors(core.computer))
        if wheel >= len(factors):
            return Reason.VALUE
        factors[wheel] = factor
        return self.change(core, tachometers=tuple(factors))

    def on_wheels_manual(self, core, values) -> Reason:
        """A torque on the body [N m] for a time."""
        if not any(self._in_use()):
            return Reason.STATE
        if self.alone is not None:
            self._end_manual(core)
        return self.manual(core, values)

    def on_wheels_automatic(self, core, values) -> Reason:
        """The laws command the torque again; wheels that were lost get another chance."""
        self.lost, self.in_row = [False] * len(self.lost), [0] * len(self.lost)
        return self._end_manual(core)

    def on_wheel_manual(self, core, values) -> Reason:
        """A motor torque [N m] of one wheel for a time, while the others' motors are off."""
        wheel, torque, duration_s = values
        if wheel >= len(self.lost):
            return Reason.VALUE
        if self.lost[wheel] or self.switched_off[wheel]:
            return Reason.STATE
        on_body = [-torque * part for part in core.wheel_axes[wheel]]
        code = self.manual(core, (*on_body, duration_s))
        if code is Reason.DONE:
            self.alone = wheel
            self._use(core)
        return code

    def on_wheel_power(self, core, values) -> Reason:
        """Switch one wheel's motor; one that was lost gets another chance."""
        wheel, on = values
        if wheel >= len(self.lost) or on > 1:
            return Reason.VALUE
        self.switched_off[wheel], self.lost[wheel] = not on, False
        self.in_row[wheel] = 0
        self._use(core)
        return Reason.DONE

    def automatic(self, core) -> Reason:
        """The laws command again, and all wheels that can."""
        return self._end_manual(core)

    def status(self) -> dict[str, float]:
        """As of every actuator; whether an axis is lost, and which."""
        axes = zip("xyz", self.lost_axes, strict=True)
        found = {f"lost_{axis}": float(lost) for axis, lost in axes}
        return super().status() | found | {"lost": float(any(self.lost_axes))}

    def _end_manual(self, core) -> Reason:
        self.alone = None
        self._use(core)
        return super().automatic(core)

    def _in_use(self) -> list[bool]:
        """Whether each wheel can be driven."""
        both = zip(self.lost, self.switched_off, strict=True)
        return [self.is_powered and not (lost or off) for lost, off in both]

    def _use(self, core) -> None:
        """Tell the computer which wheels it drives; note the axes that are lost."""
        if self.lost:
            can = self._in_use()
            self.lost_axes = lost_axes(core.wheel_axes, can)
            alone = self.alone
            core.use_wheels([on and alone in (None, wheel) for wheel, on in enumerate(can)])

    def _follow(self, core, momenta, torques) -> None:
        """Compare what each wheel has gained in a window with what its motor was to give."""
        if not self.is_powered or not math.isfinite(core.inputs.read_at.tachometers_s):
            self.first = None
            return
        interval_s, self.last_s = core.t_s - self.last_s, core.t_s
        if self.first is not None:
            for wheel, torque in enumerate(torques):
                self.impulse[wheel] += torque * interval_s
            if core.t_s - self.first_s < self.settings.window_s:
                return
            self._compare(core, momenta)
        self.first, self.first_s, self.impulse = momenta, core.t_s, [0.0] * len(momenta)

    def _compare(self, core, momenta) -> None:
        settings, found = self.settings, False
        for wheel, (wanted, now) in enumerate(zip(self.impulse, momenta, strict=True)):
            is_full = now * math.copysign(1.0, wanted) > settings.full_n_m_s
            if abs(wanted) < settings.least_n_m_s or is_full or self.lost[wheel]:
                continue
            follows = (now - self.first[wheel]) / wanted > settings.following
            self.in_row[wheel] = 0 if follows else self.in_row[wheel] + 1
            self.errors += not follows
            if self.in_row[wheel] >= settings.failures:
                self.lost[wheel] = found = True
                core.report("wheels", Reason.WHEEL_FAILED, wheel)
        if found:
            self._use(core)


def lost_axes(axes: Sequence, in_use: Sequence[bool]) -> list[bool]:
    """About which body axes wheels with these axes (n, 3) make no torque, of those in use."""
    rows = np.array([axis for axis, on in zip(axes, in_use, strict=True) if on]).reshape(-1, 3)
    reached = np.linalg.pinv(rows) @ rows if len(rows) else np.zeros((3, 3))
    return [bool(np.linalg.norm(reached[k] - np.eye(3)[k]) > _NO_PART) for k in range(3)]
