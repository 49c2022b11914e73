"""Outcomes of the members of a campaign: a number taken from a signal, or a total of the run.

[campaign.outcomes]
settling_s = { signal = "rate_deg_s", what = { settles_below = 1.0 } }
sun_error_deg = { signal = { axis = [0, 0, 1], to = "sun" }, what = { mean_after_s = 6000 } }
stopped_s = { signal = { of_start = "momentum_n_m_s" }, what = { first_below = 0.01 } }
on_time_s = { signal = "law.on_s[0]", what = { at_end = true } }
energy_j = { signal = "coil_energy_j" }

[campaign.success]
settling_s = { below = 7200 }
"""

from collections.abc import Mapping
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from torquer.analysis.series import first_at, stays_from
from torquer.base.spec import Spec
from torquer.campaign.signals import (
    Axis,
    attitude_error,
    momentum,
    rate,
    rate_about,
    rate_fastest_axis,
    rate_orbital,
    wheel_momentum,
)
from torquer.campaign.variation import Number
from torquer.scenario.held import always_held, held_attitudes, why_no_attitude
from torquer.scenario.spec import Scenario

#: The signal that depends on what the laws hold.
ATTITUDE_ERROR = "attitude_error_deg"
#: Signals that need the momentum of the wheels.
MOMENTA = {"momentum_n_m_s": momentum, "wheel_momentum_n_m_s": wheel_momentum}
#: Signals over time by name.
SIGNALS = {
    "rate_deg_s": rate,
    "rate_x_deg_s": rate_about(0),
    "rate_y_deg_s": rate_about(1),
    "rate_z_deg_s": rate_about(2),
    "rate_fastest_axis_deg_s": rate_fastest_axis,
    "rate_orbital_deg_s": rate_orbital,
    ATTITUDE_ERROR: attitude_error,
    **MOMENTA,
}
#: Totals of a run by name: energy, and the greatest dipole of one coil.
TOTALS = ("coil_energy_j", "peak_dipole_a_m2")
_OVER_TIME = Literal[
    "rate_deg_s", "rate_x_deg_s", "rate_y_deg_s", "rate_z_deg_s", "rate_fastest_axis_deg_s",
    "rate_orbital_deg_s", "attitude_error_deg", "momentum_n_m_s", "wheel_momentum_n_m_s",
]  # fmt: skip
_Name = Literal[_OVER_TIME, "coil_energy_j", "peak_dipole_a_m2"]
#: A number that a law or an estimator logs: KEY.NAME as results have it, with its places.
_LogName = Annotated[str, Field(pattern=r"^[\w.]+\.\w+(\[\d+\])*$")]
_Time = Annotated[float, Field(ge=0.0)]


class OfStart(Spec):
    """A signal as a fraction of its value at the start of the run."""

    of_start: Annotated[
        Annotated[_OVER_TIME, Tag("by name")] | Annotated[_LogName, Tag("of a log")],
        Discriminator(lambda value: "of a log" if is_log(value) else "by name"),
    ]
    """The signal by its name; of a signal that is 0 at the start there is no fraction."""


def is_log(signal) -> bool:
    """Whether a signal is what a law or an estimator logs."""
    return isinstance(signal, str) and "." in signal


class Taken(NamedTuple):
    """What has been taken so far of a signal of n members: a value (n,) of so many records (n,)."""

    value: np.ndarray
    records: np.ndarray


class What(Spec):
    """What is taken from a signal; one of these keys is given.

    Times are those of records. A number that does not exist (the signal never settles) is missing:
    NaN.
    """

    settles_below: Number | None = None
    """Time [s] from which the signal stays below this value to the end of the run."""
    first_below: Number | None = None
    """Time [s] at which the signal is first below this value."""
    at_end: Literal[True] | None = None
    """The signal at the end of the run."""
    greatest_after_s: _Time | None = None
    """Greatest value of the signal from this time on."""
    mean_after_s: _Time | None = None
    """Mean of the signal from this time on."""
    part_below: Number | None = None
    """Fraction of the run during which the signal is below this value."""

    @model_validator(mode="after")
    def _one_is_given(self):
        given = [key for key in type(self).model_fields if getattr(self, key) is not None]
        if len(given) != 1:
            known, received = ", ".join(type(self).model_fields), " and ".join(given) or "none"
            raise ValueError(f"must have one of {known}; received {received}")
        return self

    @property
    def after_s(self) -> float:
        """Time [s] from which on the signal counts."""
        return self.greatest_after_s or self.mean_after_s or 0.0

    @property
    def _is_mean(self) -> bool:
        return self.mean_after_s is not None or self.part_below is not None

    def begin(self, count: int) -> Taken:
        """Nothing taken yet of the signals of `count` members."""
        least = -np.inf if self.greatest_after_s is not None else np.nan
        return Taken(np.full(count, 0.0 if self._is_mean else least), np.zeros(count, np.int64))

    def add(self, taken: Taken, rows: slice, t_s: np.ndarray, signal: np.ndarray) -> None:
        """Go on with the signal (r, n) of some members at the records t_s (r,) that come next.

        Into how many parts a flight is cut does not change a bit: a mean is summed record by record
        (NumPy's would round one member differently from many), all else is compared or counted.
        """
        signal = signal[t_s >= self.after_s]
        value, t_s = taken.value[rows], t_s[t_s >= self.after_s]
        taken.records[rows] += len(t_s)
        if not len(t_s):
            return
        if self.at_end:
            value[:] = signal[-1]
        elif self.settles_below is not None:
            below = signal < self.settles_below
            goes_on = below.all(axis=0) & ~np.isnan(value)
            value[:] = np.where(goes_on, value, stays_from(t_s, below))
        elif self.first_below is not None:
            first = first_at(t_s, signal < self.first_below)
            value[:] = np.where(np.isnan(value), first, value)
        elif self.part_below is not None:
            value += np.count_nonzero(signal < self.part_below, axis=0)
        elif self.greatest_after_s is not None:
            value[:] = np.maximum(value, signal.max(axis=0))
        else:
            value[:] = sum(signal, start=value)

    def number(self, taken: Taken) -> np.ndarray:
        """The number for each of n members, of all that has been taken."""
        value = taken.value / np.maximum(taken.records, 1) if self._is_mean else taken.value
        return np.where(taken.records > 0, value, np.nan)


def _signal_kind(value) -> str:
    if isinstance(value, OfStart) or (isinstance(value, Mapping) and "of_start" in value):
        return "of the start"
    if isinstance(value, Mapping | Axis):
        return "of an axis"
    return "of a log" if is_log(value) else "by name"


class Outcome(Spec):
    """A number taken from a run."""

    signal: Annotated[
        Annotated[_Name, Tag("by name")]
        | Annotated[_LogName, Tag("of a log")]
        | Annotated[Axis, Tag("of an axis")]
        | Annotated[OfStart, Tag("of the start")],
        Discriminator(_signal_kind),
    ]
    """Source of the number. Of the rotation it is 'rate_deg_s' (absolute rate), 'rate_x_deg_s' to
    'rate_z_deg_s' (about an axis of the body, with its sign), 'rate_fastest_axis_deg_s' (the
    greatest of these, without a sign) or 'rate_orbital_deg_s' (relative to the orbital frame).
    Others are 'attitude_error_deg', 'momentum_n_m_s' (of body and wheels) and
    'wheel_momentum_n_m_s'. Or what a law or an estimator logs, by its name in results: 'law.on_s',
    of a vector 'law.on_s[0]'. Or a table with the angle of an `axis`, or with `of_start`. Or a
    total of the run: 'coil_energy_j', 'peak_dipole_a_m2' (of one coil). The error is from the
    attitude that the scenario's laws hold, of targets the one that these give at the time. With
    modes these are the laws of the present states; there is no number while they hold none.
    """
    what: What | None = None
    """Which number is taken from the signal; left out for totals of the run."""

    @model_validator(mode="after")
    def _what_fits(self):
        if self.signal in TOTALS:
            if self.what is not None and not self.what.at_end:
                raise ValueError(
                    f"what: must be left out, or at_end = true, of {self.signal}; received "
                    f"{self.what.model_dump(exclude_none=True)}"
                )
        elif self.what is None:
            raise ValueError("what: must be given for a signal; received none")
        return self


class Threshold(Spec):
    """What an outcome must be for a run to succeed."""

    below: Number | None = None
    """The outcome must be below this value, in its own unit."""
    above: Number | None = None
    """The outcome must be above this value, in its own unit."""

    @model_validator(mode="after")
    def _one_is_given(self):
        if (self.below is None) == (self.above is None):
            received = "none" if self.below is None else "both"
            raise ValueError(f"must have below or above; received {received}")
        return self

    def holds(self, values: np.ndarray) -> np.ndarray:
        """Whether it holds of values [n]; of a missing one it does not."""
        return values < self.below if self.below is not None else values > self.above


#: A signal of an outcome.
AnySignal = str | Axis | OfStart
#: Outcomes of a campaign that names none.
DEFAULT = {
    "final_rate_deg_s": Outcome(signal="rate_deg_s", what=What(at_end=True)),
    "rate_stays_below_1_deg_s_from_s": Outcome(signal="rate_deg_s", what=What(settles_below=1.0)),
    "coil_energy_j": Outcome(signal="coil_energy_j"),
}


def base_signal(signal: AnySignal) -> str | Axis:
    """A signal, or the one that it is a fraction of."""
    return signal.of_start if isinstance(signal, OfStart) else signal


def log_names(outcomes: Mapping[str, Outcome]) -> dict[str, str]:
    """The logs that outcomes are taken from, each with the first outcome that has it."""
    found: dict[str, str] = {}
    for name, outcome in outcomes.items():
        signal = base_signal(outcome.signal)
        if isinstance(signal, str) and is_log(signal):
            found.setdefault(signal, name)
    return found


def needs_momentum(outcomes: Mapping[str, Outcome]) -> bool:
    """Whether outcomes need a momentum: then `Flown` must have what is carried."""
    return any(base_signal(outcome.signal) in MOMENTA for outcome in outcomes.values())


def outcomes_with_series(outcomes: Mapping[str, Outcome]) -> list[str]:
    """Outcomes whose signals are kept over time: the first one of each signal."""
    first: dict[AnySignal, str] = {}
    for name, each in outcomes.items():
        if each.signal not in TOTALS:
            first.setdefault(each.signal, name)
    return [*first.values()]


def needs_sun(outcomes: Mapping[str, Outcome], scenario: Scenario) -> bool:
    """Whether outcomes need the Sun, or targets may be it: then `Flown` must have its direction."""
    signals = [base_signal(outcome.signal) for outcome in outcomes.values()]
    follows = any(held.targets for held in held_attitudes(scenario.control))
    return (ATTITUDE_ERROR in signals and follows) or any(
        isinstance(signal, Axis) and signal.to == "sun" for signal in signals
    )


def needs_field(outcomes: Mapping[str, Outcome]) -> bool:
    """Whether outcomes need the field: then `Flown` must have it."""
    signals = (outcome.signal for outcome in outcomes.values())
    return any(isinstance(signal, Axis) and signal.to == "field" for signal in signals)


def needs_modes(outcomes: Mapping[str, Outcome], scenario: Scenario) -> bool:
    """Whether outcomes need the modes, on which the attitude held depends: see `Flown`."""
    asked = any(base_signal(outcome.signal) == ATTITUDE_ERROR for outcome in outcomes.values())
    return asked and always_held(scenario.control) is None


def check_outcomes(outcomes: Mapping[str, Outcome], scenario: Scenario) -> None:
    """ValueError for an outcome that a scenario's runs cannot have."""
    for name, outcome in outcomes.items():
        asked = base_signal(outcome.signal)
        if asked == ATTITUDE_ERROR and (why := why_no_attitude(scenario.control)):
            raise ValueError(
                f"campaign.outcomes.{name}.signal: attitude_error_deg needs built-in laws that "
                f"hold an attitude, one at a time; received {why}"
            )
        if outcome.what is not None and outcome.what.after_s > scenario.length_s:
            raise ValueError(
                f"campaign.outcomes.{name}.what: must begin before the run ends at "
                f"{scenario.length_s:g} s; received {outcome.what.after_s:g} s"
            )


def evaluate_success(
    success: Mapping[str, Threshold], found: Mapping[str, np.ndarray]
) -> np.ndarray | None:
    """Which members fulfil all conditions [n]; None where there are no conditions."""
    if not success:
        return None
    return np.all([threshold.holds(found[name]) for name, threshold in success.items()], axis=0)
