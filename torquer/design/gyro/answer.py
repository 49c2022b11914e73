"""A magneto-gyroscopic design: gains of both stages and what they can do, as text and as data."""

import math
from dataclasses import dataclass

import numpy as np

from torquer.base.rows import Row, as_data, as_html, as_text
from torquer.base.strict_json import finite_or_none
from torquer.campaign.statistics import quantile
from torquer.design.failure import Failure
from torquer.design.gyro.case import GyroCase
from torquer.design.gyro.flown_scenario import EXACT_DEG, POINTED_DEG
from torquer.design.pointing_flights import PointingFlights
from torquer.design.requests import MagnetoGyroRequest
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import to_toml
from torquer.theory.magneto_gyro.capture import Stage1Design
from torquer.theory.magneto_gyro.craft import greatest_tip_off
from torquer.theory.magneto_gyro.day import DayLoop, Range
from torquer.theory.magneto_gyro.stage_2_gains import Stage2Design
from torquer.theory.magneto_gyro.times import TimeToPoint
from torquer.theory.magneto_gyro.wheel_choice import BetterWheel
from torquer.theory.validity import VALID, Verdict

#: Parts of the flights by which times are stated.
_PARTS = {0.5: "half", 0.9: "90 %", 1.0: "last"}
_PER = "1/nu0"
#: Lines of text by the keys of the rows.
_GAINS = (
    "{name}: J = {inertia_kg_m2} kg m^2, lambda = {pitch_inertia}, h = {stiffness} ({stiffness} "
    "above 0, {from_2} from 2)",
    "field: A = {strength_t} nT, along the normal {normals}",
    "stage 1: brakes up to {greatest_tip_off_rad_s} deg/s; Floquet degree {stage_1/degree} per "
    "1/nu0",
    "turned by the satellite's own dipole: stage 1 by {stage_1/turned_rad} deg, stage 2 by "
    "{dipole_turns_rad} deg until it is found",
    "stage 2: Floquet degree {degree} per 1/nu0; by the frozen model {frozen_degree}; over a day "
    "{degree_over_a_day}",
)
_REACH = (
    "stable at inclinations {inclinations_deg}, at {altitude_km} km",
    "stable at altitudes {altitudes_km}, at {inclination_deg} deg with this wheel",
)
_BIAS = (
    "a bias of 1 nT along pitch is taken for a dipole of {dipole_of_1_nt_a_m2} A m^2, which is the "
    "least that can be distinguished from it"
)


def _angle_text(angle_rad: float) -> str:
    """An angle [deg] of linear theory: beyond 90 deg its number means nothing."""
    return f"{math.degrees(angle_rad):.2g}" if angle_rad <= 0.5 * math.pi else "more than 90"


@dataclass(frozen=True)
class GyroDesign:
    """What was designed for a case, and what it can do.

    `errors`: (roll, pitch, yaw) [deg] by their cause; `costs`: (degree, error [deg] in all) of this
    design and of others; `margins`: degrees over a day by what differs from what the law knows;
    `law`: its keys, as in a scenario; `scenario`: the one that flies with it, from the tip-off rate
    until the satellite points; `dipole_turns_rad`: by which angle the satellite's own dipole turns
    stage 2 until it is found; `flights` of the scenario, or None; `failure`: why they do not point,
    or None; `verdict`: whether the answer holds; `notes`: what the user should know.
    """

    case: GyroCase
    request: MagnetoGyroRequest
    first: Stage1Design
    second: Stage2Design
    frozen_degree: float
    day_degree: float
    errors: dict[str, np.ndarray]
    costs: tuple[tuple[float, float], ...]
    margins: dict[str, float]
    inclinations: Range
    altitudes: Range
    time: TimeToPoint
    better: BetterWheel | None
    law: dict
    scenario: Scenario
    dipole_turns_rad: float
    flights: PointingFlights | None = None
    failure: Failure | None = None
    verdict: Verdict = VALID
    notes: tuple[str, ...] = ()

    @property
    def loop(self) -> DayLoop:
        """The designed loop for a whole day."""
        return DayLoop(self.case.craft, self.second.gains, self.request.form)

    def rows(self) -> list[Row]:
        """A row for each number, but for those of `times` and `errors_table`."""
        return [*self._craft_rows(), *self._gain_rows(), *self._reach_rows()]

    def _craft_rows(self) -> list[Row]:
        craft, along = self.case.craft, self.case.along
        h, nano = craft.stiffness, 1e9 * along.strength_t
        ends = f"{along.normal:.3f} of it ({along.least:.3f} to {along.greatest:.3f})"
        alias = craft.bias_dipole(1e-9, along.mean_square_t2)
        return [
            Row("name", "satellite", self.case.scenario.name, text=self.case.scenario.name),
            Row("inertia_kg_m2", "J", craft.inertia, "kg m^2", f"{craft.inertia:.4g}"),
            Row("pitch_inertia", "lambda", craft.pitch_inertia, "", f"{craft.pitch_inertia:.3f}"),
            Row("stiffness", "h", h, "", f"{h:.3f}"),
            Row("least_wheel_n_m_s", value=craft.wheel_at(0.0)),
            Row("decoupling_wheel_n_m_s", value=craft.wheel_at(2.0)),
            Row("better_wheel", value=self.better and self.better._asdict()),
            Row("strength_t", "field", along.strength_t, "nT", f"{nano:.0f}"),
            Row("normals", "part along the normal", [*along.normals], "", ends),
            Row("dipole_of_1_nt_a_m2", "dipole taken for 1 nT", alias, "A m^2", f"{alias:.3g}"),
        ]

    def _gain_rows(self) -> list[Row]:
        first, braked = self.first, greatest_tip_off(self.first.filter_rate_rad_s)
        limit, frozen = f"{math.degrees(braked):.2f}", float(self.frozen_degree)
        degrees = {
            "degree": ("stage 2, degree", self.second.degree),
            "frozen_degree": ("by the frozen model", frozen),
            "degree_over_a_day": ("over a day", self.day_degree),
            **{f"margins/{name}": (name, degree) for name, degree in self.margins.items()},
        }
        return [
            Row("stage_1", value=first._asdict()),
            Row("tip_off_deg_s", value=self.case.tip_off_deg_s),
            Row("greatest_tip_off_rad_s", "stage 1 brakes", braked, "deg/s", limit),
            Row("stage_1/degree", "stage 1, degree", first.degree, _PER, f"{first.degree:.3f}"),
            *self._dipole_rows(),
            Row("weights", value=self.second.weights._asdict()),
            *(Row(key, *about, _PER, f"{about[1]:.3f}") for key, about in degrees.items()),
            Row("law", value=self.law),
        ]

    def _dipole_rows(self) -> list[Row]:
        """Angles by the satellite's own dipole."""
        angles = {
            "stage_1/turned_rad": ("stage 1, turned by the own dipole", self.first.turned_rad),
            "dipole_turns_rad": ("stage 2, until it is found", self.dipole_turns_rad),
        }
        return [
            Row(key, label, angle, "deg", _angle_text(angle))
            for key, (label, angle) in angles.items()
        ]

    def _reach_rows(self) -> list[Row]:
        costs = [{"degree": degree, "error_deg": error} for degree, error in self.costs]
        ends = {
            "inclinations_deg": ("stable inclinations", self.inclinations, "deg"),
            "altitudes_km": ("stable altitudes", self.altitudes, "km"),
        }
        return [
            *(
                Row(key, label, found._asdict(), text=_ends(found, unit))
                for key, (label, found, unit) in ends.items()
            ),
            Row("costs", value=costs),
        ]

    def times(self) -> list[list[Row]]:
        """Time to point for each limit of the error: by theory, and in flights."""
        return [self._time_row(limit) for limit in (POINTED_DEG, EXACT_DEG)]

    def _time_row(self, limit: float) -> list[Row]:
        period_s, theory_s = self._period_s, self.time.below(math.radians(limit))
        key, theory = f"below_{limit:g}_deg", f"{theory_s / period_s:.2f}"
        head = "time to point [orbits]"
        rows = [
            Row("", head, text=f"stays below {limit:g} deg"),
            Row(f"theory/{key}_s", "theory", theory_s, "", theory),
        ]
        if self.flights is None:
            return rows
        settled_s = self.flights.settled_s(limit)
        quantiles = {part: quantile(settled_s, part) for part in _PARTS}
        never = int(np.count_nonzero(np.isinf(settled_s)))
        runs = len(settled_s)
        return [
            *rows,
            *(
                Row(f"flights/{key}/settled_s/{part:g}", _PARTS[part], finite_or_none(time_s), "",
                    f"{time_s / period_s:.2f}" if math.isfinite(time_s) else "-")
                for part, time_s in quantiles.items()
            ),
            Row(f"flights/{key}/never", f"never (of {runs})", never, "", f"{never}"),
        ]  # fmt: skip

    @property
    def _period_s(self) -> float:
        return self.case.scenario.orbit.period_s

    def errors_table(self) -> list[list[Row]]:
        """Root mean squares of the angles by what causes them."""
        angles = ("roll", "pitch", "yaw")
        return [
            [
                Row("", "error, rms [deg]", text=cause),
                *(Row(x, x, value, "", f"{value:.3g}")
                  for x, value in zip(angles, error.tolist(), strict=True)),
            ]
            for cause, error in self.errors.items()
        ]  # fmt: skip

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        theory = {**self.time._asdict(), "stage_2_s": self.time.stage_2_s}
        times = as_data([row for line in self.times() for row in line])
        flights = times.get("flights")
        if flights is not None and self.flights is not None:
            flights = {"runs": len(self.flights.error_deg), **flights}
        return {
            **as_data(self.rows()),
            "errors_deg": {
                cause.text: [row.value for row in angles] for cause, *angles in self.errors_table()
            },
            "time_to_point": {"theory": theory | times["theory"], "flights": flights},
            "failure": self.failure and self.failure.data(),
            "verdict": self.verdict.data(),
            "notes": [*self.notes],
        }

    def lines(self) -> list[str]:
        """The answer as text."""
        case = self.case
        texts = {row.key: row.text for row in self.rows()} | {
            "from_2": f"{abs(case.craft.stiffness - 2.0):.3f}",
            "altitude_km": f"{case.altitude_km:.0f}",
            "inclination_deg": f"{case.inclination_deg:.4g}",
        }
        margins = [f"{name}: {texts[f'margins/{name}']}" for name in self.margins]
        return [
            *(line.format_map(texts) for line in _GAINS),
            *(f"over a day with {', '.join(part)}" for part in (margins[:4], margins[4:])),
            *(line.format_map(texts) for line in _REACH),
            *as_text(self.times(), 14, 24),
            self.time_in_words(),
            *self.verdict.lines(),
            *(self.failure.lines() if self.failure else ()),
            *as_text(self.errors_table(), 10, 20),
            *self._cost_lines(),
            _BIAS.format_map(texts),
            *(f"note: {note}" for note in self.notes),
            "",
            *to_toml({"control": {"law": self.law}}).splitlines(),
        ]

    def time_in_words(self) -> str:
        """The parts of the time to point."""
        parts = (self.time.braking_s, self.time.turning_s, self.time.switch_s)
        braking, turning, switch = (f"{x / self._period_s:.2f}" for x in parts)
        return (
            f"by theory {braking} orbits of braking from {self.case.tip_off_deg_s:.3g} deg/s, "
            f"{turning} of turning the wheel, {switch} of switching, then stage 2"
        )

    def _cost_lines(self) -> list[str]:
        if not any(error > 0.0 for _, error in self.costs):
            return []
        costs = ", ".join(f"{degree:.3f}: {error:.3g}" for degree, error in self.costs)
        return [f"error in all [deg] with a degree of {costs}"]

    def _repr_html_(self) -> str:
        shown = [
            [Row("", "", text=row.label), Row("", "value", text=f"{row.text} {row.unit}".strip())]
            for row in self.rows()
            if row.text
        ]
        return (
            as_html(shown)
            + as_html(self.times())
            + as_html(self.errors_table(), [*self.verdict.lines(), *self.notes])
        )


def _ends(found: Range, unit: str) -> str:
    if found.low is None and found.high is None:
        return "of any size tried"
    if found.low is None:
        return f"up to {found.high:.0f} {unit}"
    if found.high is None:
        return f"from {found.low:.0f} {unit}"
    return f"of {found.low:.0f} to {found.high:.0f} {unit}"
