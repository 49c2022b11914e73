"""The `control` table of a scenario: laws, estimator, modes, and when they work."""

import math
from fractions import Fraction
from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from torquer.base.spec import Spec
from torquer.base.validate import storable_name
from torquer.computer.blocks.law import Law
from torquer.computer.estimation import AnyEstimator
from torquer.computer.estimation.sensors import SensorReadings
from torquer.computer.laws import AnyLaw, OnlyLaw
from torquer.computer.modes.packing import check_choice
from torquer.computer.modes.scheme import as_modes
from torquer.computer.modes.spec import Modes
from torquer.computer.scheme import Scheme
from torquer.computer.selection import SelectionSpec
from torquer.environment.ephemeris import EphemerisModels
from torquer.spacecraft.failures import ComputerFailure

Positive = Annotated[float, Field(gt=0.0)]
#: Names by which a mode chooses an estimator that is not in the table of them.
_ESTIMATORS_KNOWN = ("attitude_sensor", "none", "estimator")
#: Least interval of the time grid [s].
LEAST_STEP = Fraction(1, 10**9)
#: More steps than any run can take: years of computing.
MOST_STEPS = 10**13


class Program(NamedTuple):
    """Laws by name, and the mode table that determines when they work; None if they always do."""

    laws: dict
    modes: Modes | None

    def known_laws(self) -> dict[str, Law]:
        """Laws as the computer calls them, by name: those that are in no file of a user."""
        return {
            name: spec.law()
            for name, spec in self.laws.items()
            if spec.kind not in ("user", "given_in_python")
        }


class Control(Spec):
    """What the on-board computer does, and when.

    Plain sample and hold: leave `measure_s` at 0; a control step every `sample_s`, the command held
    until the next. With a measurement window the coils are off for `measure_s` while the laws are
    called every `sample_s`, then follow the latest dipole for `actuate_s`; wheels follow every
    command. With `control_while_actuating` control steps continue every `sample_s` while the coils
    act: estimators and the wheels' laws then work all the time, but without the magnetometer, which
    the coils disturb; the dipole is held.
    """

    law: OnlyLaw | None = None
    """A single law, or a scheme; for several laws use `laws` instead."""
    laws: dict[str, AnyLaw] = Field(default_factory=dict)
    """Several laws under names of your choice; their commands are added."""
    estimator: AnyEstimator = SensorReadings()
    """Source of attitude and rate; left out: attitude sensor and gyro."""
    estimators: dict[str, AnyEstimator] = Field(default_factory=dict)
    """Further estimators under names of your choice, for modes to choose from."""
    ephemeris: EphemerisModels = EphemerisModels()
    """Models of field, orbit and time on board; left out: the truth."""
    modes: Modes | None = None
    """Mode table, whose states determine which laws and which estimator work when."""
    select: dict[str, SelectionSpec] = Field(default_factory=dict)
    """How several devices of a kind become what laws and modes read, by the key of the kind, such
    as `magnetometer`; left out: the mean of those that seem sound.
    """
    sample_s: Positive = 1.0
    """Interval between control steps."""
    measure_s: float = Field(default=0.0, ge=0.0)
    """Length of the measurement window, during which the coils are off; 0: none."""
    actuate_s: Positive | None = None
    """Time for which the coils hold the dipole after a measurement window."""
    control_while_actuating: bool = False
    """Control every `sample_s` also while the coils act, for estimators and wheels."""
    failures: tuple[ComputerFailure, ...] = ()
    """Intervals in which the computer does not work."""

    @model_validator(mode="after")
    def _laws_given(self):
        if (self.law is None) == (not self.laws):
            received = "neither" if self.law is None else "both"
            raise ValueError(f"law: either it or laws must be given; received {received}")
        return self

    @model_validator(mode="after")
    def _names_differ(self):
        for key, names in (("laws", self.laws), ("estimators", self.estimators)):
            for name in names:
                storable_name(key, name)
        for name in self.estimators:
            if name in _ESTIMATORS_KNOWN:
                raise ValueError(
                    f"estimators.{name}: must not be named {', '.join(_ESTIMATORS_KNOWN)}: "
                    f"these exist already; received {name!r}"
                )
        for name in self.laws:
            if name in ("estimator", *self.estimators):
                raise ValueError(
                    f"laws.{name}: must have a name that no estimator has; received {name!r}"
                )
        return self

    @model_validator(mode="after")
    def _windows_fit(self):
        if self.measure_s > 0.0:
            if self.actuate_s is None:
                raise ValueError("actuate_s: must be given with measure_s; received none")
            whole_steps("measure_s", self.measure_s, self.sample_s, "sample_s")
        elif self.actuate_s is not None and self.actuate_s != self.sample_s:
            raise ValueError(
                "actuate_s: without measure_s the dipole is held for sample_s = "
                f"{self.sample_s:g} s; received {self.actuate_s:g} s"
            )
        if self.control_while_actuating:
            if self.measure_s == 0.0:
                raise ValueError(
                    "control_while_actuating: must be left out without measure_s, where the "
                    "computer controls all the time; received true"
                )
            whole_steps("actuate_s", self.actuate_s, self.sample_s, "sample_s")
        return self

    @model_validator(mode="after")
    def _modes_fit(self):
        if self.modes is None:
            if self.estimators:
                raise ValueError(
                    "modes: must be given with estimators, to choose them; received none"
                )
            return self
        if not self.laws:
            raise ValueError("laws: must be given with modes, by the names that states use")
        used = {name for state in self.modes.states() for name in state.laws}
        if idle := [name for name in self.laws if name not in used]:
            raise ValueError(
                f"laws.{idle[0]}: must be named by a state of modes; received no such state"
            )
        known = {*_ESTIMATORS_KNOWN, *self.estimators}
        for state in self.modes.states():
            if state.estimator is not None:
                check_choice("modes: a state's estimator", sorted(known), state.estimator)
            for name in state.laws:
                check_choice("modes: a state's law", self.laws, name)
            for name in state.laws_off:
                check_choice("modes: a law that a state switches off", self.laws, name)
        return self

    def named(self) -> "Program":
        """Laws by name and mode table; those of a scheme."""
        if isinstance(self.law, Scheme):
            modes, laws = as_modes(self.law)
            return Program(laws, modes)
        return Program({"law": self.law} if self.law is not None else self.laws, self.modes)

    def key_of(self, name: str) -> str:
        """The key of a law in this table."""
        return "law" if self.law is not None else f"laws.{name}"

    def restarts(self) -> bool:
        """Whether the computer restarts during the run."""
        return any(failure.kind == "restarted" for failure in self.failures)

    @property
    def steps_in_cycle(self) -> int:
        """Control steps in a cycle."""
        acting = round(self.actuate_s / self.sample_s) - 1 if self.control_while_actuating else 0
        return round(self.measure_s / self.sample_s) + 1 + acting

    @property
    def longest_hold_s(self) -> float:
        """The longest time from one control step to the next."""
        if self.control_while_actuating:
            return self.sample_s
        return max(self.sample_s, self.actuate_s or 0.0)

    @property
    def cycle_s(self) -> float:
        """Length of the whole cycle."""
        return self.measure_s + self.actuate_s if self.measure_s > 0.0 else self.sample_s

    @property
    def coil_duty(self) -> float:
        """Part of the time in which the coils may act."""
        return self.actuate_s / self.cycle_s if self.actuate_s else 1.0


def common_divisor(times_s: dict[str, float]) -> float:
    """Greatest common divisor of times as decimal numbers [s], by key; at least a nanosecond.

    Of twelve digits: 0.1 + 0.2 is 0.3.
    """
    parts = [Fraction(f"{time_s:.12g}") for time_s in times_s.values()]
    below = math.lcm(*(part.denominator for part in parts))
    divisor = Fraction(math.gcd(*(int(part * below) for part in parts)), below)
    if divisor < LEAST_STEP:
        finest = max(times_s, key=lambda key: Fraction(f"{times_s[key]:.12g}").denominator)
        raise ValueError(
            f"{finest}: must have a common divisor of 1e-9 s or more with the other times; "
            f"received {times_s[finest]!r} s"
        )
    return float(divisor)


def whole_steps(name: str, length_s: float, step_s: float, step_name: str = "step_s") -> int:
    """Number of steps in a time; ValueError unless it is a whole number above zero."""
    ratio = length_s / step_s
    steps = round(ratio) if ratio < MOST_STEPS else 0
    if steps < 1 or not math.isclose(steps * step_s, length_s, rel_tol=1e-9):
        raise ValueError(
            f"{name}: must be a whole multiple of {step_name} = {step_s:g} s; "
            f"received {length_s:g} s"
        )
    return steps
