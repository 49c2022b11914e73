"""A pointing budget: what errs in pointing, stability and knowledge, predicted and flown.

In the form of the ESA handbook (ESSB-HB-E-003, ECSS-E-HB-60-10A, ECSS-E-ST-60-10C): each cause with
its class; absolute, relative and knowledge errors; the statistical interpretation is the mixed one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from torquer.analysis.causes import Cause
from torquer.analysis.counter_tests import without
from torquer.analysis.pointing.asked import saturations
from torquer.analysis.pointing.causes import ALWAYS, causes_of
from torquer.analysis.pointing.predicted import Effect, predict
from torquer.analysis.pointing.setting import Setting, held_scenario, make_setting
from torquer.analysis.pointing.statistics import (
    Errors,
    predicted_errors,
    predicted_stability,
)
from torquer.base.rows import Row, as_data, as_html, as_text, degrees_text
from torquer.design.pointing_budget_flights import FlightErrors, Flights, FlownErrors
from torquer.design.pointing_imbalance import imbalance
from torquer.design.requests import PointingRequest
from torquer.scenario.spec import Scenario
from torquer.theory.validity import LEAN, Doubt, Verdict

#: Errors by key: absolute, relative to the mean of a window, of knowledge.
KINDS = {"ape": "APE", "rpe": "RPE", "ake": "AKE"}
INTERPRETATION = "mixed: over all instants that count and over the ensemble of flights"
ALL = "all"


@dataclass(frozen=True)
class BudgetLine:
    """A cause, or all of them: errors by key of `KINDS`, predicted and flown.

    `why_none`: why nothing is predicted, "" where it is; `flown`: None without flights.
    """

    cause: Cause
    predicted: dict[str, Errors] | None
    why_none: str
    flown: FlownErrors | None

    def measured(self, kind: str):
        """What flights have of an error, by key of `KINDS`; None without them."""
        if self.flown is None:
            return None
        return dict(zip(KINDS, (self.flown.absolute, self.flown.relative, self.flown.knowledge),
                        strict=True))[kind]  # fmt: skip

    def ratio(self, kind: str) -> float | None:
        """Flown over predicted rms of an error; None where one is not there, or is nothing."""
        measured = self.measured(kind)
        if measured is None or self.predicted is None:
            return None
        expected = self.predicted[kind].rms_rad
        return measured.errors.rms_rad / expected if expected > _NOTHING_RAD else None


_BEYOND = f"beyond {math.degrees(LEAN.most):.2g} deg, where the linear theory ends"
#: Below it an error is rounding, or that of the integrator [rad].
_NOTHING_RAD = math.radians(1e-5)


@dataclass(frozen=True)
class PointingBudget:
    """The causes of pointing errors, and all of them together.

    `from_s`: from when on errors count; `window_s`: of stability, in whole control cycles; `steps`:
    what those of the integrator did in flight, if it is not small.
    """

    scenario: Scenario
    request: PointingRequest
    causes: tuple[BudgetLine, ...]
    total: BudgetLine
    from_s: float
    window_s: float
    verdict: Verdict
    steps: tuple[str, ...] = ()

    def table(self) -> list[list[Row]]:
        """A line for each cause, and one for all."""
        part = f"{100.0 * self.request.confidence:.4g} %"
        return [_row(line, part) for line in (*self.causes, self.total)]

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        rows = {line.cause.name: as_data(row) for line, row in self._lines_and_rows()}
        asked = self.request
        return {
            "scenario": self.scenario.name,
            "interpretation": INTERPRETATION,
            "confidence": asked.confidence,
            "window_s": self.window_s,
            "from_s": self.from_s,
            "until_s": self.scenario.length_s,
            "flights": asked.flights,
            "causes": {name: row for name, row in rows.items() if name != ALL},
            "all": rows[ALL],
            "verdict": self.verdict.data(),
            "notes": self.notes(),
        }

    def _lines_and_rows(self):
        return zip((*self.causes, self.total), self.table(), strict=True)

    def lines(self) -> list[str]:
        """The answer as text."""
        width = 2 + max(len(line.cause.label) for line in (*self.causes, self.total))
        return [self.headline(), *as_text(self.table(), 11, width), *self.verdict.lines(),
                *(f"note: {note}" for note in self.notes())]  # fmt: skip

    def headline(self) -> str:
        """What the numbers are."""
        part = f"{100.0 * self.request.confidence:.4g} %"
        return (
            f"{self.scenario.name}: pointing budget [deg], rms of the angle predicted and flown "
            f"(flights: {self.request.flights}), from {self.from_s:.4g} s to "
            f"{self.scenario.length_s:.4g} s; stability (RPE) over {self.window_s:.4g} s; last: "
            f"the APE that {part} do not exceed. Statistics are {INTERPRETATION}."
        )

    def csv(self) -> str:
        """The table for spreadsheets: a line for each cause, numbers in degrees."""
        keys = [f"{kind}_{side}" for kind in KINDS for side in ("predicted", "flown")]
        lines = [",".join(("cause", "class", *(f"{key}_rms_deg" for key in keys)))]
        for line, row in self._lines_and_rows():
            data = as_data(row)
            values = (
                (data[kind][side] or {}).get("rms_deg")
                for kind in KINDS for side in ("predicted", "flown")
            )  # fmt: skip
            numbers = ("" if x is None else f"{x:.9g}" for x in values)
            lines.append(",".join((line.cause.name, line.cause.kind, *numbers)))
        return "\n".join(lines) + "\n"

    def notes(self) -> list[str]:
        """What has no number, and why; what flights draw."""
        found = [f"{x.cause.label}: none ({x.why_none})" for x in self.causes if x.why_none]
        missing = [x.cause.label for x in self.causes if x.why_none]
        if missing and self.total.predicted is not None:
            found.append(f"the prediction for all is without: {'; '.join(missing)}")
        drawn = [x.cause.label for x in self.causes if x.cause.drawn]
        if drawn:
            found.append(
                "each flight draws about zero, with the root mean square of the scenario's numbers "
                f"on each axis: {', '.join(drawn)}"
            )
        return [*found, *self.steps]

    def _repr_html_(self) -> str:
        return as_html(self.table(), [self.headline(), *self.verdict.lines(), *self.notes()])


def _row(line: BudgetLine, part: str) -> list[Row]:
    cells = [
        Row("", "", text=line.cause.label),
        Row("label", value=line.cause.label),
        Row("class", "class", line.cause.kind, text=line.cause.kind),
    ]
    for kind, label in KINDS.items():
        cells += _cells(line, kind, label)
    cells += _quantiles(line, part)
    return [*cells, Row("why_none", value=line.why_none or None)]


def _cells(line: BudgetLine, kind: str, label: str) -> list[Row]:
    """Predicted and flown root mean squares of an error."""
    predicted = None if line.predicted is None else line.predicted[kind]
    measured = line.measured(kind)
    return [
        *_numbers(f"{kind}/predicted", f"{label} pred.", predicted),
        *_numbers(f"{kind}/flown", f"{label} flown", measured and measured.errors),
        Row(f"{kind}/flown_relative_sigma", value=measured and measured.relative_sigma),
        Row(f"{kind}/flown_over_predicted", value=line.ratio(kind)),
    ]


def _numbers(key: str, label: str, errors: Errors | None) -> list[Row]:
    if errors is None:
        return [Row(key), Row("", label, text="none" if "pred." in label else "-")]
    rms = math.degrees(errors.rms_rad)
    return [
        Row(f"{key}/rms_deg", label, rms, text=degrees_text(rms)),
        Row(f"{key}/axes_deg", value=[math.degrees(x) for x in errors.axes_rad.tolist()]),
        Row(f"{key}/quantile_deg", value=math.degrees(errors.quantile_rad)),
    ]


def _quantiles(line: BudgetLine, part: str) -> list[Row]:
    """For people: the absolute error that the confidence does not exceed."""
    predicted = None if line.predicted is None else line.predicted["ape"]
    measured = line.measured("ape")
    pairs = (("pred.", predicted), ("flown", measured and measured.errors))
    return [
        Row("", f"{part} {name}", text=degrees_text(math.degrees(x.quantile_rad)) if x else "-")
        for name, x in pairs
    ]


def pointing_budget(
    scenario: Scenario,
    request: PointingRequest = PointingRequest(),
    progress: Callable[[int, int], None] | None = None,
) -> PointingBudget:
    """Errors of pointing, stability and knowledge by cause, predicted and flown.

        budget = pointing_budget(torquer.load_scenario("my_satellite.toml"))
        budget.data()["all"]["ape"]["predicted"]["rms_deg"]
        torquer.plot(budget)

    The satellite starts in the attitude that its law holds, at rest there. A flight with a cause
    has it beside gravity and the reference's motion, which are always there; the error of one
    without it is taken off. `progress` is called with flights done and in total. ValueError for a
    scenario without linear theory: modes, an estimator, sensors read at their own times, a law that
    is not smooth.
    """
    held = held_scenario(scenario)
    setting, causes = make_setting(held, request.window_s), causes_of(held)
    found = {each.name: _within_theory(setting, predict(setting, each)) for each in causes}
    flights = _Flown(setting, causes, request, progress)
    lines = [_line(setting, request, cause, found[cause.name], flights) for cause in causes]
    known = [effect for effect in found.values() if isinstance(effect, Effect)]
    shaken = imbalance(setting, request)
    if shaken is not None:
        cause, effect = shaken
        lines.append(_line(setting, request, cause, effect, None))
        known += [effect] if isinstance(effect, Effect) else []
    whole: Effect | str = "nothing is predicted"
    for effect in known:
        whole = effect if isinstance(whole, str) else whole.plus(effect)
    beyond = [effect for effect in found.values() if effect == _BEYOND]
    whole = _BEYOND if beyond else _within_theory(setting, whole)
    everything = Cause(ALL, "all", "", "")
    total = _line(setting, request, everything, whole, flights)
    window_s = setting.size * setting.loop.cycle_s
    from_s = float(setting.loop.t_s[setting.first])
    verdict = _verdict(setting, total, whole)
    return PointingBudget(
        scenario, request, tuple(lines), total, from_s, window_s, verdict, flights.steps
    )


def _within_theory(setting: Setting, effect: Effect | str) -> Effect | str:
    """An effect, or why there is none: what it turns, or what is known, lies beyond small turns."""
    if isinstance(effect, str):
        return effect
    for part in effect:
        if not LEAN.holds(predicted_errors(part, setting.first, setting.size, 0.95).quantile_rad):
            return _BEYOND
    return effect


def _verdict(setting: Setting, total: BudgetLine, whole: Effect | str) -> Verdict:
    """Whether all causes together stay where turns are small, and within the actuators' limits."""
    if isinstance(whole, str):
        doubt = Doubt(LEAN, math.nan, f"all causes: {total.why_none}")
        return Verdict((doubt, *saturations(setting, None)))
    return Verdict(tuple(saturations(setting, whole)))


def _line(setting, request, cause: Cause, effect: Effect | str, flights) -> BudgetLine:
    flown = None if flights is None else flights.of(cause)
    if isinstance(effect, str):
        return BudgetLine(cause, None, effect, flown)
    counted = setting.first, setting.size, request.confidence
    predicted = {
        "ape": predicted_errors(effect.pointing, *counted),
        "rpe": predicted_stability(effect.pointing, *counted),
        "ake": predicted_errors(effect.knowledge, *counted),
    }
    return BudgetLine(cause, predicted, "", flown)


class _Flown:
    """The flights of a budget, each kind when its line is made."""

    def __init__(
        self,
        setting: Setting,
        causes: list[Cause],
        request: PointingRequest,
        progress: Callable[[int, int], None] | None,
    ):
        self._setting, self._causes, self._count = setting, causes, request.flights
        self._progress = progress
        self._flights = Flights(setting, request.confidence)
        self._baseline: FlightErrors | None = None
        self._done, self._total = 0, sum(self._flights_of(cause) for cause in causes)
        self._total += request.flights

    @property
    def steps(self) -> tuple[str, ...]:
        """What the steps of the integrator did."""
        return self._flights.steps

    def _flights_of(self, cause: Cause) -> int:
        return self._count if cause.differs else min(1, self._count)

    def of(self, cause: Cause) -> FlownErrors | None:
        """Flights with a cause, or all of them; None if none are wanted."""
        if self._count == 0:
            return None
        scenario, others = self._setting.scenario, [x for x in self._causes if x.name != cause.name]
        if cause.name == ALL:
            return self._flights.with_causes(scenario, self._causes, None, self._count, self._flown)
        bare = without(scenario, others)
        if cause.name == ALWAYS:
            self._baseline = self._flights.alone(bare)
            return self._flights.with_causes(bare, [cause], None, 1, self._flown)
        count = self._flights_of(cause)
        return self._flights.with_causes(bare, [cause], self._baseline, count, self._flown)

    def _flown(self, flights: int) -> None:
        self._done += flights
        if self._progress:
            self._progress(self._done, self._total)
