"""Outcomes taken from the motion of many members, one part of their flight after another."""

from collections.abc import Mapping

import numpy as np

from torquer.campaign.outcomes import (
    SIGNALS,
    TOTALS,
    OfStart,
    Outcome,
    base_signal,
    is_log,
    outcomes_with_series,
)
from torquer.campaign.signals import Axis, Flown, angle_to
from torquer.scenario.spec import Scenario


def outcome_signals(
    outcomes: Mapping[str, Outcome], scenario: Scenario, flown: Flown
) -> dict[str, np.ndarray]:
    """The signals (r, n) of outcomes by the outcomes' names, none for totals; not yet as fractions.

    `scenario`: what all members share is taken from it, the attitude that laws hold.
    """
    asked = {name: base_signal(each.signal) for name, each in outcomes.items()}
    signals = set(asked.values()).difference(TOTALS)
    known = {signal: _signal(signal, scenario, flown) for signal in signals}
    return {name: known[signal] for name, signal in asked.items() if signal in known}


def _signal(signal: str | Axis, scenario: Scenario, flown: Flown) -> np.ndarray:
    if isinstance(signal, Axis):
        return angle_to(signal, flown)
    return flown.logs[signal] if is_log(signal) else SIGNALS[signal](scenario, flown)


class Reduction:
    """Outcomes of n members, taken from one part of their flight after another.

    `kept`: numbers of the records at which `series` (n, t) of the signals are kept, by the first
    outcome of each.
    """

    def __init__(
        self, outcomes: Mapping[str, Outcome], scenario: Scenario, count: int, kept: np.ndarray
    ):
        self._outcomes, self._scenario, self._kept = outcomes, scenario, kept
        whats = {name: each.what for name, each in outcomes.items() if each.signal not in TOTALS}
        self._taken = {name: (what, what.begin(count)) for name, what in whats.items() if what}
        shape = (count, len(kept))
        kept_of = outcomes_with_series(outcomes)
        fractions = (name for name, each in outcomes.items() if isinstance(each.signal, OfStart))
        self._at_start = {name: np.full(count, np.nan) for name in fractions}
        self.series = {name: np.full(shape, np.nan, np.float32) for name in kept_of}

    def add(self, rows: slice, first: int, flown: Flown) -> None:
        """Go on with some members; `first`: number of the first of the records that come next."""
        signals = outcome_signals(self._outcomes, self._scenario, flown)
        for name, start in self._at_start.items():
            if first == 0:
                start[rows] = np.where(signals[name][0] == 0.0, np.nan, signals[name][0])
            signals[name] = signals[name] / start[rows]
        here = (self._kept >= first) & (self._kept < first + len(flown.t_s))
        for name, (what, taken) in self._taken.items():
            what.add(taken, rows, flown.t_s, signals[name])
        for name, series in self.series.items():
            series[rows, here] = signals[name][self._kept[here] - first].T

    def outcomes(self, totals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Outcomes by name, (n,) each, NaN where one has no value; `totals`: those of `TOTALS`."""
        return {
            name: np.array(totals[str(each.signal)], dtype=float)
            if name not in self._taken
            else self._taken[name][0].number(self._taken[name][1])
            for name, each in self._outcomes.items()
        }
