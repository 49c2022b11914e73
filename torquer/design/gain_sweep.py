"""Gains of B-dot side by side: what theory says, what was flown, which gain is enough."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from torquer.base.rows import Row, as_data, as_html, as_text
from torquer.base.strict_json import finite_or_none
from torquer.campaign.statistics import quantile, rate_interval
from torquer.computer.laws.bdot import Bdot
from torquer.design.failure import Failure
from torquer.design.gain_flights import GainFlights, choose, usable_flights
from torquer.design.residual_rate import (
    CLEAR,
    LAST_REVOLUTIONS,
    Residual,
    common_residual,
    residual_of,
)
from torquer.design.stopping import releases_stop_along_s
from torquer.design.sweep_domain import judge_sweep
from torquer.scenario.mission import ORBITAL_RATES
from torquer.scenario.resolution import told_of_steps
from torquer.scenario.spec import Scenario
from torquer.theory.slow.detumbling import Tumbling, detumbling_time_s
from torquer.theory.slow.gains import Sampling
from torquer.theory.validity import Verdict

#: The part of the gain that overshoots up to which one is chosen.
SAFE = 0.5
#: The law of a scenario that has none.
ANY = Bdot(gain_a_m2_s_per_t=1.0)
#: Parts of the releases for which the time to stop is stated.
_PARTS = {0.5: "half", 0.9: "90 %", 1.0: "last"}


class Wanted(NamedTuple):
    """Rate after release, rate that counts as stopped [rad/s], time for it [s] or None.

    `is_given`: whether someone asked for the rate that counts as stopped.
    """

    tip_off_rad_s: float
    below_rad_s: float
    within_s: float | None
    is_given: bool = True

    @property
    def allowed_s(self) -> float:
        """Time [s] by which releases must have stopped; infinite if any in the flight counts."""
        return math.inf if self.within_s is None else self.within_s


class Raised(NamedTuple):
    """The usual rate that counts as stopped [deg/s], and the motion that remains, within which it
    lies: a higher one was taken."""

    usual_deg_s: float
    residual: Residual


@dataclass(frozen=True)
class GainSweep:
    """A satellite, what is wanted, what theory says, and flights by gain.

    `law`: the scenario's own of B-dot's kind, or None. `theory_gain` by theory, `most_gain` beyond
    which the law overshoots, `turning_gain` beyond which rotation about the field outlasts the
    rest [A m^2 s/T]. `raised`: why the rate that counts as stopped is not the usual one, or None;
    `failure`: why more than a tenth of the releases are late, or None.
    """

    scenario: Scenario
    law: Any
    wanted: Wanted
    tumbling: Tumbling
    sampling: Sampling
    theory_gain: float
    most_gain: float
    turning_gain: float
    revolutions: float
    flights: tuple[GainFlights, ...] = ()
    raised: Raised | None = None
    failure: Failure | None = None

    def theory_s(self, gain: float) -> float:
        """Mean time to stop by theory [s], over directions of the field that do not turn."""
        return detumbling_time_s(self.tumbling, gain, *self.wanted[:2])

    def releases_by_theory_s(self, gain: float) -> np.ndarray:
        """Times [s] of releases to stop by theory, in the field that turns along the orbit."""
        wanted = self.wanted[:2]
        return releases_stop_along_s(
            self.scenario, self.tumbling, gain, *wanted, self.theory_s(gain)
        )

    @cached_property
    def halves_by_theory_s(self) -> dict[float, float]:
        """Time [s] by theory in which half of the releases stop, by gain flown.

        Infinite where they do not in a day and in six times `theory_s`.
        """
        return {
            each.gain: quantile(self.releases_by_theory_s(each.gain), 0.5) for each in self.flights
        }

    @property
    def duration_s(self) -> float:
        """Duration of a flight [s]."""
        return (
            self.revolutions * 2.0 * math.pi / self.scenario.orbit.rate_rad_s(self.scenario.start)
        )

    @property
    def below_deg_s(self) -> float:
        """Rate that counts as stopped [deg/s]."""
        return math.degrees(self.wanted.below_rad_s)

    @property
    def _late_from_s(self) -> float:
        return self.duration_s * (1.0 - LAST_REVOLUTIONS / self.revolutions)

    def common_residual(self) -> Residual | None:
        """The motion that remains with every gain, if the limit lies within it."""
        most = SAFE * self.most_gain
        return common_residual(self.flights, most, self.below_deg_s, self._late_from_s)

    @property
    def chosen(self) -> GainFlights:
        """The flights with the gain chosen."""
        return choose(self.flights, self.wanted.within_s, SAFE * self.most_gain)

    @property
    def chosen_is(self) -> str:
        """Where the gain chosen ends the range from which it is chosen: beyond nothing is known."""
        usable = [each.gain for each in usable_flights(self.flights, SAFE * self.most_gain)]
        if self.chosen.gain == usable[0]:
            return "the least flown"
        if self.chosen.gain < usable[-1]:
            return ""
        return "the greatest flown" if len(usable) == len(self.flights) else (
            "the greatest flown that does not overshoot"
        )  # fmt: skip

    @property
    def reads_rate(self) -> bool:
        """Whether the law reads the gyro."""
        return "rate" in (self.law or ANY).needs

    def with_gain(self) -> Scenario:
        """The scenario with the gain chosen."""
        gain = {"gain_a_m2_s_per_t": float(f"{self.chosen.gain:.4g}")}
        law = (self.law or ANY).model_copy(update=gain)
        control = self.scenario.control
        named = control.named().laws
        key = control.key_of(next(iter(named))) if named else "law"
        return self.scenario.replace(f"control.{key}", law.model_dump(mode="json"))

    def table(self) -> list[list[Row]]:
        """A line for each gain."""
        return [self._row(each) for each in self.flights]

    def _row(self, each: GainFlights) -> list[Row]:
        theory_s = self.halves_by_theory_s[each.gain]
        count = each.settled_within(self.wanted.allowed_s)
        runs, energy_j, peak = len(each.settled_s), float(each.energy_j.mean()), self._peak(each)
        power_w = energy_j / self.duration_s
        settled = {f"{part:g}": (name, each.settled_by(part)) for part, name in _PARTS.items()}
        return [
            Row("gain_a_m2_s_per_t", "gain", each.gain, "A m^2 s/T", f"{each.gain:.3g}"),
            Row("theory_s", "theory", finite_or_none(theory_s), "h, half", _hours(theory_s)),
            Row("runs", value=runs),
            Row("stopped", "stopped", count, text=f"{count}/{runs}"),
            Row("interval", value=list(rate_interval(count, runs))),
            *(
                Row(f"first_s/{part:g}", value=finite_or_none(each.first_by(part)))
                for part in _PARTS
            ),
            Row("", "first half", unit="h", text=_hours(each.first_by(0.5))),
            *(
                Row(f"settled_s/{part}", name, finite_or_none(time_s), "h", _hours(time_s))
                for part, (name, time_s) in settled.items()
            ),
            Row("energy_j", "energy", energy_j, "J", f"{energy_j:.4g}"),
            Row("mean_power_w", "mean power", power_w, "W", f"{power_w:.3g}"),
            Row("peak_share", "peak", peak, "of limit", f"{100.0 * peak:.3g} %"),
        ]

    def _peak(self, each: GainFlights) -> float:
        """Greatest dipole of a coil over the least limit of the coils."""
        return float(each.peak_a_m2.max() / self.tumbling.coils.limits_a_m2().min())

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        wanted = self.wanted
        return {
            "name": self.scenario.name,
            "tip_off_deg_s": math.degrees(wanted.tip_off_rad_s),
            "rate_below_deg_s": self.below_deg_s,
            "rate_below_is": self._limit_is(),
            "residual_deg_s": None if self._residual is None else self._residual._asdict(),
            "within_s": wanted.within_s,
            "gain_a_m2_s_per_t": self.chosen.gain,
            "gain_is": self.chosen_is,
            "theory_gain_a_m2_s_per_t": self.theory_gain,
            "overshoot_gain_a_m2_s_per_t": finite_or_none(self.most_gain),
            "revolutions": self.revolutions,
            "flights": [as_data(row) for row in self.table()],
            "verdict": self.verdict.data(),
            "failure": self.failure and self.failure.data(),
            "notes": self.notes(),
        }

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the gain chosen and its time by theory hold."""
        residual = None if self.raised is not None else self._residual
        return judge_sweep(
            self.scenario, self.chosen, self.halves_by_theory_s[self.chosen.gain], residual,
            self.below_deg_s,
        )  # fmt: skip

    def lines(self) -> list[str]:
        """The answer as text."""
        notes = (f"note: {note}" for note in self.notes())
        return [*as_text(self.table(), 11), *self.words(), *self.verdict.lines(), *notes]

    def _repr_html_(self) -> str:
        return as_html(self.table(), [*self.words(), *self.verdict.lines(), *self.notes()])

    def words(self) -> list[str]:
        """The gain chosen, by which rule, and what is known of how many stop."""
        best, wanted = self.chosen, self.wanted
        count, runs = best.settled_within(wanted.allowed_s), len(best.settled_s)
        low, high = (100.0 * end for end in rate_interval(count, runs))
        until = "" if wanted.within_s is None else f" within {_hours(wanted.within_s)} h"
        lines = [
            self._gain_in_words(),
            f"{count} of {runs} releases at {math.degrees(wanted.tip_off_rad_s):.3g} deg/s stay "
            f"below {self.below_deg_s:.3g} deg/s{until} ({low:.0f}..{high:.0f} % "
            f"with 95 % confidence), each flown for {self.revolutions:g} rev",
            f"half of them are first below it after {_hours(best.first_by(0.5))} h, and stay below "
            f"from {_hours(best.settled_by(0.5))} h on",
        ]
        if wanted.within_s is not None and count < runs:
            lines.append(f"no gain stops all of them in time: {self._why_late(best)}")
        return [*lines, *(self.failure.lines() if self.failure else ())]

    def _gain_in_words(self) -> str:
        gain = self.chosen.gain
        if not self.chosen_is:
            return f"gain: gain_a_m2_s_per_t = {gain:.4g}"
        return f"gain: gain_a_m2_s_per_t = {gain:.4g}, {self.chosen_is}"

    @property
    def _residual(self) -> Residual | None:
        """The motion within which the usual limit lies, or else the one in use with this gain."""
        if self.raised is not None:
            return self.raised.residual
        return residual_of(self.chosen, self.below_deg_s, self._late_from_s)

    def _limit_is(self) -> str:
        if self.raised is not None:
            return "above the residual motion"
        return "given" if self.wanted.is_given else f"{ORBITAL_RATES:g} orbital rates"

    def _residual_notes(self) -> list[str]:
        """That the limit lies, or would lie, within the motion that remains."""
        residual, below = self._residual, self.below_deg_s
        if residual is None:
            return []
        remains = (
            f"the residual motion, {residual.mean:.2g} deg/s on average and up to "
            f"{residual.greatest:.2g} deg/s in the last two revolutions"
        )
        if self.raised is not None:
            return [
                f"{ORBITAL_RATES:g} orbital rates, {self.raised.usual_deg_s:.3g} deg/s, lie within "
                f"{remains}: they would be crossed again and again; {below:.3g} deg/s counts as "
                "stopped, which lies above; --rate-below-deg-s sets another rate"
            ]
        return [
            f"the limit of {below:.3g} deg/s lies within {remains}: from when on the rate stays "
            "below it is chance, and so is the gain chosen by it; see when it is first below, or "
            f"give a rate above {CLEAR * residual.greatest:.2g} deg/s"
        ]

    def _why_late(self, best: GainFlights) -> str:
        least_s = self.theory_s(1e4 * self.theory_gain)
        return (
            f"coils always at their limits would need about {_hours(least_s)} h on average, by "
            f"theory; with this gain a coil reached {100.0 * self._peak(best):.3g} % of its limit"
        )

    def notes(self) -> list[str]:
        """What theory says beyond the flights, and what is left out."""
        limit = math.degrees(self.sampling.limit_rad_s)
        notes = [f"B-dot brakes rates up to {limit:.4g} deg/s with {self.sampling.in_words}"]
        if math.isfinite(self.most_gain):
            notes.append(
                f"gains above {self.most_gain:.3g} A m^2 s/T overshoot in the strongest field of "
                "the orbit; at most half of that is chosen"
            )
        notes.append(
            "theory's times are those of half of the releases in the field along the orbit, "
            f"without disturbances; with gains above about {self.turning_gain:.3g} A m^2 s/T "
            "rotation about the field outlasts the rest"
        )
        steps = told_of_steps(self.chosen.damping, self.chosen.lag_deg)
        return [*steps, *self._residual_notes(), *notes, *self._sensor_notes()]

    def _sensor_notes(self) -> list[str]:
        craft, coils, notes = self.scenario.spacecraft, self.tumbling.coils, []
        noise_t, bias = (
            1e-9 * craft.one_of("magnetometer").noise_nt,
            np.linalg.norm(craft.one_of("gyro").bias_deg_s),
        )
        if self.sampling.difference_s > 0.0 and noise_t > 0.0:
            dipole = self.chosen.gain * noise_t * math.sqrt(2.0) / self.sampling.difference_s
            share = 100.0 * dipole / float(coils.limits_a_m2().min())
            notes.append(
                f"the magnetometer's noise commands {dipole:.2g} A m^2 RMS per axis with the gain "
                f"chosen, {share:.2g} % of the limit; a constant bias cancels in the difference"
            )
        if self.reads_rate and bias > 0.0:
            notes.append(f"the gyro's bias of {bias:.2g} deg/s is a rate that the law tends to")
        if coils.powers_w() is None:
            notes.append("energies and powers are those of coils that take 1 W at their limit")
        if self.reads_rate and self.scenario.control.estimator is not None:
            notes.append("the law reads the sensors, not the scenario's estimator")
        return notes


def _hours(time_s: float) -> str:
    return f"{time_s / 3600.0:.3g}" if math.isfinite(time_s) else "never"
