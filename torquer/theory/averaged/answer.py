"""Averaged motion and gains of a law: what `torquer theory` answers, as text, data and HTML."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from torquer.base.rows import Row, as_data, as_html
from torquer.scenario.spec import Scenario
from torquer.theory.averaged import equations as text
from torquer.theory.averaged.asked import find_case, target_fraction
from torquer.theory.averaged.case import AveragedCase
from torquer.theory.averaged.motion import design_data, motion_data
from torquer.theory.averaged.requests import LawRequest


@dataclass(frozen=True)
class LawMotion:
    """Averaged motion of a satellite under a law.

    `found`: plain data, with units in the keys. `motions`: the slow motions behind it, by name.
    """

    case: AveragedCase
    found: dict
    motions: dict

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        return self.found

    def lines(self, equations: Sequence[str] = ()) -> list[str]:
        """Text; `equations`: instead of the plain ones."""
        case, found = self.case, self.found
        plain = (f"  {line}" for line in found["equations"])
        return [
            *_head(case, found),
            "",
            *(f"{row.label}{row.text}" for row in self._rows()),
            *self.verdict,
            "tends to:",
            *(f"  {each['description']}" for each in found["tends_to"]),
            *_sun_lines(found["sun"]),
            *_sampling_lines(case, found["sampling"]),
            "",
            f"equations, {text.SHARED}:",
            *(equations or plain),
            "first integrals (drift in units of l and radians over "
            f"{found['course_revolutions']:.3g} revolutions):",
            *map(_integral_line, found["first_integrals"]),
            *_note_lines(found["notes"]),
        ]

    @property
    def verdict(self) -> list[str]:
        """What true motions show, and whether the answer is valid or why it is doubtful."""
        return verdict_lines(self.found["verdict"])

    def _rows(self) -> list[Row]:
        """The small parameter, and how long the law takes."""
        found, times = self.found, self.found["revolutions"]
        return [
            Row("eps", f"eps = {text.SMALL[self.case.law]} = ", found["eps"], "",
                f"{found['eps']:.4g}"),
            Row("revolutions", f"{found['quantity']} to {100 * found['part']:g} %: ", times, "",
                _span(times)),
        ]  # fmt: skip

    def _repr_html_(self) -> str:
        """In notebooks: the key numbers, and below them where the motion tends and the notes."""
        rows = [row._replace(label=row.label.rstrip("=: ")) for row in self._rows()]
        ends = [f"tends to: {each['description']}" for each in self.found["tends_to"]]
        notes = [*_head(self.case, self.found), *self.verdict, *ends, *self.found["notes"]]
        return as_html([rows], notes)


def law_motion(
    law: str | None = None, asked: LawRequest | None = None, scenario: Scenario | None = None
) -> LawMotion:
    """Averaged motion under a law: small parameter, times, limit motions, first integrals.

        from torquer.theory import LawRequest, law_motion
        found = law_motion("bdot", LawRequest(inclination_deg=51.6, altitude_km=550.0,
                                              inertia=(1.0, 1.2, 1.5), gain=1e6))
        found.data()["revolutions"]["median"]

    Law, satellite and orbit are those of the scenario if one is given. Laws: bdot,
    nutation_damping, spin_up, reorientation, preliminary_1, preliminary_2, sdot. `ValueError`,
    with the key of the request, for a case that is not described, or twice.
    """
    asked = asked or LawRequest()
    case = find_case(law, asked, scenario, needs_gain=True)
    return LawMotion(case, *motion_data(case, target_fraction(case, asked.to), asked.revolutions))


@dataclass(frozen=True)
class LawGains:
    """Times that a law takes by its gain, and the gain for a given time.

    `found`: plain data, with units in the keys; a row for each gain.
    """

    case: AveragedCase
    found: dict
    rows: tuple[tuple[Row, ...], ...]

    def data(self) -> dict:
        """Plain data, with units in the keys."""
        return self.found | {"rows": [as_data(row) for row in self.rows]}

    def lines(self) -> list[str]:
        """Text: a line for each gain."""
        case, found = self.case, self.found
        head = f"{'gain ' + text.UNITS[case.law]:>22}{'eps':>10}"
        return [
            self._title(),
            head + "".join(f"{row.label:>9}" for row in self.rows[0][3:]),
            *map(_gain_line, self.rows),
            *_wanted_lines(case, found),
            *_sampling_lines(case, found["sampling"]),
            *_doubts_by_gain(found["rows"]),
            *_note_lines(found["notes"]),
        ]

    def _title(self) -> str:
        case, found = self.case, self.found
        return (
            f"{case.law}, {case.name}: revolutions of {case.period_s / 60:.1f} min until the "
            f"{found['quantity']} is {100 * found['part']:g} % (nutation {found['theta_deg']:.0f} "
            f"deg, {_direction(case, found['rho_deg'])})"
        )

    def _repr_html_(self) -> str:
        """In notebooks: a row for each gain."""
        return as_html(self.rows, [self._title(), *self.found["notes"]])


def law_gains(
    law: str | None = None, asked: LawRequest | None = None, scenario: Scenario | None = None
) -> LawGains:
    """Times that a law takes by its gain, and the gain for `revolutions`, if they are given.

        from torquer.theory import LawRequest, law_gains
        law_gains("bdot", LawRequest(inclination_deg=51.6, altitude_km=550.0,
                                     inertia=(1.0, 1.2, 1.5), revolutions=10.0))

    Otherwise as `law_motion`; a gain need not be given.
    """
    asked = asked or LawRequest()
    case = find_case(law, asked, scenario, needs_gain=False)
    found = design_data(case, target_fraction(case, asked.to), asked.revolutions)
    return LawGains(case, found, tuple(_gain_row(case, each) for each in found["rows"]))


def _gain_row(case: AveragedCase, each: dict) -> tuple[Row, ...]:
    labels = zip(("min", "median", "max"), each["revolutions"].items(), strict=True)
    return (
        Row("gain", "gain", each["gain"], text.UNITS[case.law], f"{each['gain']:.4g}"),
        Row("eps", "eps", each["eps"], "", f"{each['eps']:.3g}"),
        Row("verdict", value=each["verdict"]),
        *(Row(f"revolutions/{key}", label, x, "", _turns(x)) for label, (key, x) in labels),
        Row("", "flown", text=_flown_text(each["verdict"])),
    )


def _flown_text(verdict: dict) -> str:
    """Median of what was flown: "?" where the motions were too short to tell."""
    if not any(flight["ratio"] is not None for flight in verdict["flown"]):
        never = any(flight["flown"] is None for flight in verdict["flown"])
        return "?" if never else "0"
    return _turns(verdict["flown_revolutions"])


def _beyond(doubt: dict) -> float:
    """How far a doubt is beyond its bounds, as a factor; infinite for never."""
    value, least, most = doubt["value"], doubt["least"], doubt["most"]
    if value is None or value <= 0.0:
        return math.inf
    return max(value / most if most else 0.0, least / value if least else 0.0)


def _doubts_by_gain(rows: list[dict]) -> list[str]:
    """Each doubt once, with the gains that it is about."""
    found: dict[str, list[tuple[float, dict]]] = {}
    for row in rows:
        for doubt in row["verdict"]["doubts"]:
            found.setdefault(doubt["quantity"], []).append((row["gain"], doubt))
    lines = []
    for each in found.values():
        gains = ", ".join(f"{gain:.4g}" for gain, _ in each)
        worst = max((doubt for _, doubt in each), key=_beyond)
        which = "all gains" if len(each) == len(rows) else f"gain {gains}"
        lines.append(f"doubtful at {which}: {worst['text']}")
    return lines or ["valid at all gains"]


def _gain_line(row: tuple[Row, ...]) -> str:
    gain, eps, _, *times = row
    return f"{gain.text:>22}{eps.text:>10}" + "".join(f"{time.text:>9}" for time in times)


def _wanted_lines(case: AveragedCase, found: dict) -> list[str]:
    if not found["gain_for_it"]:
        return []
    gain = {name: "none" if x is None else f"{x:.4g}" for name, x in found["gain_for_it"].items()}
    return [
        f"{found['wanted_revolutions']:g} revolutions: gain {gain['greatest']} "
        f"{text.UNITS[case.law]} for the slowest direction, {gain['median']} for the median, "
        f"{gain['least']} for the fastest"
    ]


def verdict_lines(verdict: dict) -> list[str]:
    """A verdict of plain data in words: what was flown, and each doubt."""
    doubts = [f"doubtful: {each['text']}" for each in verdict["doubts"]]
    return [verdict["line"], *(doubts or ["valid"])]


#: What the head and the equations call by letters.
_LETTERS = (
    "A, C: moments of inertia across the axis and about it; L0, theta0: angular momentum at the "
    "start, and its angle to the axis"
)
_RHO = "rho0: its angle to the axis of the cone that the field draws along the orbit"
_EPS = (
    "eps: change of the momentum per radian of the orbit, as a part of it; the averages hold "
    "where it is small"
)


def _head(case: AveragedCase, found: dict) -> tuple[str, ...]:
    orbit, body = found["orbit"], found["satellite"]
    return (
        f"{case.law}, gain {case.gain:g} {text.UNITS[case.law]}: {case.name}, period "
        f"{case.period_s / 60:.1f} min, B0 {orbit['strength_nt']:.0f} nT",
        f"A {body['transverse_kg_m2']:.4g}, C {body['axial_kg_m2']:.4g} kg m^2, L0 "
        f"{body['momentum_n_m_s']:.4g} N m s, theta0 {body['theta_deg']:.1f} deg, "
        f"{_direction(case, body['rho_deg'])}",
        _LETTERS if case.rho is None else f"{_LETTERS}; {_RHO}",
        _EPS,
    )


def _direction(case: AveragedCase, rho_deg: float | None) -> str:
    return "any direction" if case.rho is None else f"rho0 {rho_deg:.1f} deg"


def _turns(value: float | None) -> str:
    return "never" if value is None else f"{value:.3g}"


def _span(times: dict) -> str:
    """Range and median in words."""
    least, median, greatest = map(_turns, times.values())
    if least == greatest:
        return least if least == "never" else f"{least} revolutions"
    return f"{least} to {greatest} revolutions by direction, median {median}"


def _integral_line(each: dict) -> str:
    value = "" if each["at_start"] is None else f" = {each['at_start']:.5g}"
    drift = "" if each["drift"] is None else f"; drift {each['drift']:.1g}"
    return f"  {each['formula']}{value}{drift}"


def _note_lines(notes: list[str]) -> list[str]:
    return [f"note: {note}" for note in notes]


def _sampling_lines(case: AveragedCase, found: dict | None) -> list[str]:
    """What a sampled law can damp, and its greatest gain, in words."""
    if found is None or case.sampling is None:
        return []
    what = "precession" if case.law == "nutation_damping" else "rotation"
    lines = [
        f"with {case.sampling.in_words} it damps {what} up to {found['limit_deg_s']:.3g} "
        f"deg/s; at the initial {found['rate_deg_s']:.3g} deg/s with "
        f"{100.0 * found['efficiency']:.3g} % of the ideal damping"
    ]
    if found["greatest_gain"] is not None:
        lines.append(
            "in a field of B0 slow motion is stable up to a gain of "
            f"{found['greatest_gain']:.3g} {text.UNITS[case.law]}"
        )
    return lines


def _sun_lines(found: dict | None) -> list[str]:
    """Where S-dot brings the momentum, in words."""
    if found is None:
        return []
    end = found["final_momentum"]
    side = "towards" if end > 0.0 else "away from"
    turns = f"after at most {found['revolutions_at_most']:.3g} revolutions"
    return [
        f"from {found['gamma_deg']:.1f} deg off the Sun the momentum turns {side} it, within "
        f"{found['captured_deg']:g} deg {turns}; final momentum {abs(end):.4g} L0"
    ]
