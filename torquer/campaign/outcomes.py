"""Outcomes of the members of a campaign: a number taken from a signal, or a total of the run.

[campaign.outcomes]
settling_s = { signal = "rate_deg_s", what = { settles_below = 1.0 } }
sun_error_deg = { signal = { axis = [0, 0, 1], to = "sun" }, what = { mean_after_s = 6000 } }
energy_j = { signal = "coil_energy_j" }

[campaign.success]
settling_s = { below = 7200 }
"""

from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from torquer.analysis.series import first_at, stays_from
from torquer.base.spec import Spec
from torquer.campaign.signals import (
    Axis,
    Flown,
    angle_to,
    attitude_error,
    rate,
    rate_orbital,
)
from torquer.campaign.variation import Number
from torquer.scenario.held import always_held, why_no_attitude
from torquer.scenario.spec import Scenario

#: The signal that depends on what the laws hold.
ATTITUDE_ERROR = "attitude_error_deg"
#: Signals over time by name.
SIGNALS = {
    "rate_deg_s": rate,
    "rate_orbital_deg_s": rate_orbital,
    ATTITUDE_ERROR: attitude_error,
}
#: Totals of a run by name, which are fields of `Flown`.
TOTALS = ("coil_energy_j", "peak_dipole_a_m2")
_Name = Literal[
    "rate_deg_s", "rate_orbital_deg_s", "attitude_error_deg", "coil_energy_j", "peak_dipole_a_m2"
]
_Time = Annotated[float, Field(ge=0.0)]


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

    def of(self, t_s: np.ndarray, signal: np.ndarray) -> np.ndarray:
        """Of a signal (r, n) at records t_s (r,): one number for each of n."""
        if self.at_end:
            return signal[-1]
        if self.settles_below is not None:
            return stays_from(t_s, signal < self.settles_below)
        if self.first_below is not None:
            return first_at(t_s, signal < self.first_below)
        if self.part_below is not None:
            return np.mean(signal < self.part_below, axis=0)
        late = signal[t_s >= self.after_s]
        if not len(late):
            return np.full(signal.shape[1], np.nan)
        if self.greatest_after_s is not None:
            return late.max(axis=0)
        # summed record by record: NumPy's mean would round one member differently from many
        return sum(late, start=np.zeros(signal.shape[1])) / len(late)


def _signal_kind(value) -> str:
    return "of an axis" if isinstance(value, Mapping | Axis) else "by name"


class Outcome(Spec):
    """A number taken from a run."""

    signal: Annotated[
        Annotated[_Name, Tag("by name")] | Annotated[Axis, Tag("of an axis")],
        Discriminator(_signal_kind),
    ]
    """Source of the number: 'rate_deg_s' (absolute rate), 'rate_orbital_deg_s' (relative to the
    orbital frame), 'attitude_error_deg' (from the attitude that the scenario's laws hold; with
    modes the laws of the present states, and no number while they hold none), a table with the
    angle of an `axis`, or a total of the run: 'coil_energy_j', 'peak_dipole_a_m2' (of one coil).
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


#: Outcomes of a campaign that names none.
DEFAULT = {
    "final_rate_deg_s": Outcome(signal="rate_deg_s", what=What(at_end=True)),
    "rate_stays_below_1_deg_s_from_s": Outcome(signal="rate_deg_s", what=What(settles_below=1.0)),
    "coil_energy_j": Outcome(signal="coil_energy_j"),
}


def needs_sun(outcomes: Mapping[str, Outcome]) -> bool:
    """Whether outcomes need the Sun: then `Flown` must have its direction."""
    signals = (outcome.signal for outcome in outcomes.values())
    return any(isinstance(signal, Axis) and signal.to == "sun" for signal in signals)


def needs_modes(outcomes: Mapping[str, Outcome], scenario: Scenario) -> bool:
    """Whether outcomes need the modes, on which the attitude held depends: see `Flown`."""
    asked = any(outcome.signal == ATTITUDE_ERROR for outcome in outcomes.values())
    return asked and always_held(scenario.control) is None


def check_outcomes(outcomes: Mapping[str, Outcome], scenario: Scenario) -> None:
    """ValueError for an outcome that a scenario's runs cannot have."""
    for name, outcome in outcomes.items():
        if outcome.signal == ATTITUDE_ERROR and (why := why_no_attitude(scenario.control)):
            raise ValueError(
                f"campaign.outcomes.{name}.signal: attitude_error_deg needs built-in laws that "
                f"hold an attitude, one at a time; received {why}"
            )
        if outcome.what is not None and outcome.what.after_s > scenario.length_s:
            raise ValueError(
                f"campaign.outcomes.{name}.what: must begin before the run ends at "
                f"{scenario.length_s:g} s; received {outcome.what.after_s:g} s"
            )


def outcome_signals(
    outcomes: Mapping[str, Outcome], scenario: Scenario, flown: Flown
) -> dict[str, np.ndarray]:
    """The signals (r, n) of outcomes by the outcomes' names, none for totals.

    `scenario`: what all members share is taken from it, the attitude that laws hold.
    """
    signals = {each.signal for each in outcomes.values()}.difference(TOTALS)
    known = {signal: _signal(signal, scenario, flown) for signal in signals}
    return {name: known[each.signal] for name, each in outcomes.items() if each.signal in known}


def _signal(signal: str | Axis, scenario: Scenario, flown: Flown) -> np.ndarray:
    if isinstance(signal, Axis):
        return angle_to(signal, flown)
    return SIGNALS[signal](scenario, flown)


def take_outcomes(
    outcomes: Mapping[str, Outcome], signals: Mapping[str, np.ndarray], flown: Flown
) -> dict[str, np.ndarray]:
    """Outcomes of n members by name, (n,) each; NaN where one has no value."""
    found = {}
    for name, outcome in outcomes.items():
        if outcome.signal in TOTALS:
            found[name] = np.array(getattr(flown, outcome.signal), dtype=float)
        else:
            found[name] = outcome.what.of(flown.t_s, signals[name])
    return found


def evaluate_success(
    success: Mapping[str, Threshold], found: Mapping[str, np.ndarray]
) -> np.ndarray | None:
    """Which members fulfil all conditions [n]; None where there are no conditions."""
    if not success:
        return None
    return np.all([threshold.holds(found[name]) for name, threshold in success.items()], axis=0)
