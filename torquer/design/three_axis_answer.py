"""Laws that hold three axes by coils, side by side: stability, margins, errors, captures."""

import math
from dataclasses import asdict, dataclass

from torquer.base.rows import Row, as_data, as_html, as_text
from torquer.campaign.capture import Capture, flight
from torquer.design.failure import Failure
from torquer.design.three_axis_failure import REVOLUTIONS
from torquer.design.three_axis_trim import TrimAnswer
from torquer.scenario.resolution import told_of_steps
from torquer.scenario.spec import Scenario
from torquer.scenario.toml_text import to_toml
from torquer.theory.three_axis.gain_search import (
    SETTLED,
    WEIGHTS,
    Candidate,
    DesignTask,
    ThreeAxisDesign,
    error_text,
)
from torquer.theory.three_axis.response import PointingError, greatest_angle
from torquer.theory.three_axis.sampled import SOURCES
from torquer.theory.validity import LEAN, Doubt, Limit, Verdict

CAPTURED = Limit(
    "starts with any attitude that are not captured", most=0.0,
    why="degree and settling are those of small errors",
    of="degree and settling of a three-axis hold", shown="the flights of --capture-runs",
)  # fmt: skip


#: What the search of the second pair varies; ends of a range, by their sign.
_SEARCHED = ("rate_gain_n_m_s_per_t2", "angle_gain_n_m_per_t2 over that of the formula")
_TRIED = {-1: "the least tried", 1: "the greatest tried"}


@dataclass(frozen=True)
class ThreeAxisAnswer:
    """The design, its laws and the scenario's own by name, and what each captures, if flown.

    `within_deg`: steady error beyond which a law is unusable; `case_notes`: what is left out;
    `trim`: of the residual dipole, where this breaks a law; `failure`: why no law holds, or None;
    `failed`: the law that was flown to see why.
    """

    scenario: Scenario
    task: DesignTask
    design: ThreeAxisDesign
    candidates: dict[str, Candidate]
    captures: dict[str, Capture | None]
    within_deg: float
    case_notes: tuple[str, ...]
    trim: TrimAnswer | None
    failure: Failure | None = None
    failed: str | None = None

    def table(self) -> list[list[Row]]:
        """A line for each law."""
        return [self._row(name, each) for name, each in self.candidates.items()]

    def _row(self, name: str, each: Candidate) -> list[Row]:
        revolutions = each.settling_s * self.task.sampled.hold.rate_rad_s / (2.0 * math.pi)
        captured = self.captures.get(name)
        return [
            Row("", "", text=name),
            Row("law", value=_keys(each.law)),
            Row("degree_per_rad", "degree", each.degree, "1/rad", f"{each.degree:.4f}"),
            Row("continuous_degree_per_rad", value=each.continuous_degree),
            Row("averaged_degree_per_rad", value=each.averaged_degree),
            Row("settling_s", "settling", each.settling_s, "rev", f"{revolutions:.2f}"),
            *_margin_rows(each),
            *_error_rows(each),
            Row("verdict", value=self.verdict_on(name).data()),
            Row("notes", value=self._notes_on(name)),
            Row(
                "capture", value=captured and {**asdict(captured), "interval": [*captured.interval]}
            ),
        ]

    def verdict_on(self, name: str) -> Verdict:
        """On a law: doubtful, also if it is stable, with a greater steady error than is of use, and
        where starts beyond the linear range were flown and not captured."""
        each = self.candidates[name]
        own = Verdict((*each.verdict.doubts, *self._not_captured(name)))
        if not self._is_unusable(each):
            return own
        assert each.error is not None
        usable = Limit("steady error [deg]", most=self.within_deg, why="a run is not captured")
        words = (
            f"unusable: its steady error {_error_in_words(each.error)} exceeds the "
            f"{self.within_deg:g} deg within which a run counts as captured"
        )
        doubt = Doubt(usable, math.degrees(each.error.greatest_rad), words)
        return Verdict((doubt, *own.doubts))

    def _not_captured(self, name: str) -> tuple[Doubt, ...]:
        flown = self.captures.get(name)
        if flown is None or flown.captured == flown.runs:
            return ()
        missed = flown.runs - flown.captured
        words = (
            f"degree and settling are those of errors up to {self.task.linear_range_deg:g} deg: "
            f"{missed} of {flown.runs} starts with any attitude are not captured"
        )
        return (Doubt(CAPTURED, float(missed), words),)

    def _is_unusable(self, each: Candidate) -> bool:
        error = each.error
        return error is not None and math.degrees(error.greatest_rad) > self.within_deg

    def _notes_on(self, name: str) -> list[str]:
        """Of what to beware; what makes an error that is too great."""
        each, helps = self.candidates[name], self.trim is not None and name in self.trim.left_deg
        return [*(_shares(each.error, helps) if self._is_unusable(each) else ()), *each.notes]

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        task, hold, search = self.task, self.task.sampled.hold, self.design.search
        rows = zip(self.candidates, self.table(), strict=True)
        return {
            "name": self.scenario.name,
            "orbital_rate_rad_s": hold.rate_rad_s,
            "revolutions": hold.revolutions,
            "limit_a_m2": task.limit_a_m2,
            "linear_range_deg": task.linear_range_deg,
            "gain_margin": task.gain_margin,
            "settled_part": SETTLED,
            "strengths": dict(zip(("formula", "refined"), self.design.strengths, strict=True)),
            "gains_found": bool(search.value > 0.0),
            "grid_spacing": float(search.spacing.max()),
            "at_ends": self._ends(),
            "regulator_weight": self.design.weight,
            "regulator_weight_is": self._weight_is(),
            "candidates": {name: as_data(row) for name, row in rows},
            "notes": [*self.case_notes],
            "trim": self.trim and self.trim.data(),
            "failure": self.failure and self.failure.data(),
        }

    def lines(self) -> list[str]:
        """The answer as text."""
        return [self._headline(), *as_text(self.table()), *self.words(),
                *self.verdicts(), *(f"note: {note}" for note in self.notes())]  # fmt: skip

    def _repr_html_(self) -> str:
        said = [self._headline(), *self.words(), *self.verdicts(), *self.notes()]
        return as_html(self.table(), said)

    def notes(self) -> list[str]:
        """What is left out, and of what to beware with each law."""
        of_laws = (
            f"{name}: {note}" for name in self.candidates
            for note in self._notes_on(name)
        )  # fmt: skip
        of_steps = (
            f"{name}: {note}" for name, each in self.captures.items() if each is not None
            for note in told_of_steps(each.damping, each.lag_deg)
        )  # fmt: skip
        return [*self.case_notes, *of_steps, *of_laws]

    def verdicts(self) -> list[str]:
        """Whether each law is valid, or what is doubtful of it."""
        return [
            f"{name}: {line}" for name in self.candidates
            for line in self.verdict_on(name).lines()
        ]  # fmt: skip

    def _headline(self) -> str:
        hold, cycle = self.task.sampled.hold, self.task.sampled.cycle
        field = hold.orbit_environment.environment.field.kind
        off = f", coils off for {cycle.off_s:g} s" if cycle.off_s else ""
        minutes = 2.0 * math.pi / hold.rate_rad_s / 60.0
        return (
            f"{self.scenario.name}: three axes by coils, field {field} (repeats after "
            f"{hold.revolutions} rev of {minutes:.1f} min), dipole held for {cycle.hold_s:g} s"
            f"{off}, linear range {self.task.linear_range_deg:g} deg"
        )

    def words(self) -> list[str]:
        """The gains, what the search says of the second pair, and the captures."""
        lines = []
        for name in ("formula", "refined"):
            values = self.candidates[name].law.values()
            k, k_a = values["rate_gain"], values["angle_gain"]
            lines.append(
                f"{name}: rate_gain_n_m_s_per_t2 = {k:.6g}, angle_gain_n_m_per_t2 = {k_a:.6g}"
            )
        if self.design.search.value > 0.0:
            lines.append(
                "refined: no gains on the grids around it are better; the last grid has a spacing "
                f"of {100.0 * self.design.search.spacing.max():.2g} %"
            )
            lines += [
                f"refined: {what} is {tried}: beyond it the search does not look"
                for what, tried in self._ends().items()
            ]
        else:
            lines.append(
                "refined: no gains within the coils' limit are stable with a gain margin of "
                f"{self.task.gain_margin:g}; these grow most slowly"
            )
        if text := self._weight_is():
            weight = self.design.weight
            lines.append(f"regulator: its dipole weighs {weight:.2g} of the coils' limit, {text}")
        lines += self.trim.lines() if self.trim else []
        lines += [_capture(name, found) for name, found in self.captures.items()]
        return [*lines, *(self.failure.lines() if self.failure else ())]

    def _ends(self) -> dict[str, str]:
        """Where the second pair ends the range that was searched, by what does."""
        named = zip(_SEARCHED, self.design.search.ends, strict=True)
        return {what: _TRIED[end] for what, end in named if end}

    def _weight_is(self) -> str:
        """Where the regulator's weight ends those tried."""
        ends = {float(WEIGHTS.min()): _TRIED[-1], float(WEIGHTS.max()): _TRIED[1]}
        return ends.get(self.design.weight, "")

    def best(self) -> str:
        """The law flown with the trim if none holds; else of those of use the one with which most
        starts arrive, or the fastest."""

        def merit(name: str) -> tuple[bool, int, float]:
            each, flown = self.candidates[name], self.captures.get(name)
            is_of_use = each.error is not None and not self._is_unusable(each)
            return is_of_use, flown.captured if flown else 0, each.degree

        return self.failed or max(self.candidates, key=merit)

    def as_scenario(self) -> Scenario:
        """The satellite with the best law, and the trim beside it if there is one.

        It starts at rest in the orbital frame, at the edge of the linear range; ten revolutions.
        """
        name = self.best()
        law = self.candidates[name].law
        laws = {"hold": law, "trim": self.trim.design.spec.law()} if self.trim else law
        period_s = 2.0 * math.pi / self.task.sampled.hold.rate_rad_s
        held = flight(self.scenario, laws, REVOLUTIONS, period_s)
        away = {**held.initial.model_dump(mode="json", exclude_unset=True),
                "euler_deg": [0.0, 0.0, self.task.linear_range_deg]}  # fmt: skip
        about = f"Three axes held by coils, law {name}"
        return held.replace("initial", away).replace("description", about)

    def tables(self) -> dict[str, str]:
        """Each designed law by name, as the TOML table of a scenario."""
        laws = self.design.candidates.items()
        made = {name: to_toml({"control": {"law": _keys(each.law)}}) for name, each in laws}
        return made | ({"trim": self.trim.table()} if self.trim else {})


def _margin_rows(each: Candidate) -> list[Row]:
    found = each.margins
    if found is None or each.error is None:
        labels = {"gain margin": "", "delay": "s", "inertia": "%"}
        return [Row("margins"), *(Row("", x, unit=unit, text="-") for x, unit in labels.items())]
    gains = f"{found.least_gain:.2g}..{found.greatest_gain:.3g}"
    return [
        Row("margins/least_gain", "gain margin", found.least_gain, text=gains),
        Row("margins/greatest_gain", value=found.greatest_gain),
        Row("margins/delay_s", "delay", found.delay_s, "s", f"{found.delay_s:.0f}"),
        Row("margins/inertia", "inertia", found.inertia, "%", f"{100.0 * found.inertia:.0f}"),
    ]


def _error_rows(each: Candidate) -> list[Row]:
    found = each.error
    if found is None:
        labels = {"error": "deg", "noise": "deg rms"}
        return [Row("error"), *(Row("", x, unit=unit, text="-") for x, unit in labels.items())]
    greatest, rms, noise = map(
        math.degrees, (found.greatest_rad, found.rms_rad, found.noise_rms_rad)
    )
    holds = found.is_linear
    known = greatest if holds else None
    sources = {name: math.degrees(greatest_angle(x)) for name, x in found.by_source.items()}
    return [
        Row("error/greatest_deg", "error", known, "deg", error_text(found)),
        Row("error/rms_deg", value=rms if holds else None),
        Row("error/is_linear", value=holds),
        Row("error/noise_rms_deg", "noise", noise, "deg rms", f"{noise:.3g}"),
        Row("error/by_source_deg", value=sources if holds else None),
        Row("error/shares", value=_shares_of(found)),
        Row("error/greatest_dipole_a_m2", value=float(abs(found.dipoles_a_m2).max())),
    ]


def _error_in_words(found: PointingError) -> str:
    """The greatest error, as far as the linear theory can tell it."""
    if found.is_linear:
        return f"of {math.degrees(found.greatest_rad):.3g} deg"
    return f"lies beyond {math.degrees(LEAN.most):.2g} deg, where the linear theory ends, and"


def _shares_of(found: PointingError) -> dict[str, float]:
    """Part of each disturbance in the sum of their greatest errors."""
    each = {name: greatest_angle(turns) for name, turns in found.by_source.items()}
    total = sum(each.values())
    return {name: angle / total for name, angle in each.items()} if total > 0.0 else {}


def _shares(found: PointingError, trim_helps: bool) -> list[str]:
    """What makes an error, most first; a constant dipole needs another remedy than gains.

    `trim_helps`: what is left with the dipole taken off lies within the linear theory.
    """
    shares = sorted(_shares_of(found).items(), key=lambda one: -one[1])
    named = [f"{name} {100.0 * part:.0f} %" for name, part in shares if part >= 0.01]
    lines = [f"its error is made by {', '.join(named)}"] if named else []
    if shares and shares[0][0] == SOURCES[1] and not trim_helps:
        lines.append(
            "with the residual dipole taken off its error still lies beyond the linear theory: "
            "make the other causes less, too"
        )
    elif shares and shares[0][0] == SOURCES[1]:
        lines.append(
            "feedback of the attitude does not compensate a constant dipole: make the residual "
            "dipole less, or let the law dipole_trim estimate it and take it off"
        )
    return lines


def _capture(name: str, found: Capture | None) -> str:
    """The result in one line."""
    if found is None:
        return f"{name}: captures nothing"
    low, high = (100.0 * end for end in found.interval)
    return (
        f"{name}: captures {found.captured} of {found.runs} random initial attitudes "
        f"({low:.0f}..{high:.0f} % with 95 % confidence) to within {found.within_deg:.3g} deg "
        f"in {found.revolutions:g} rev"
    )


def _keys(law) -> dict:
    """A law's keys, as in a scenario file."""
    return law.spec.model_dump(mode="json")
