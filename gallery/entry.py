"""What an entry is: published ids, a function, the verdict that it must reach, and why.

A check compares one number with the source's: it agrees when the number lies in an interval that
means something, half a unit of the last printed digit or what 'about' allows. A number that came
out after a choice made in view of the printed one, or that depends on a start, a gain or a body
that the source does not print, is 'chosen', not 'agrees'; one that is held against a second
computation of ours, as the source prints none, is 'self-consistent'.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from decimal import Decimal
from enum import StrEnum

import numpy as np

from gallery.catalogue import ROW_OF, Row


class Verdict(StrEnum):
    """How a number, or an entry, compares with its source."""

    AGREES = "agrees"
    CHOSEN = "chosen"
    CONSISTENT = "self-consistent"
    DIFFERS = "differs"
    LOST = "value lost"


#: An entry's verdict is the first of these that one of its checks has.
_PRECEDENCE = (Verdict.DIFFERS, Verdict.CHOSEN, Verdict.AGREES, Verdict.CONSISTENT, Verdict.LOST)


class Grade(StrEnum):
    """What a difference says of its source, from the least to the gravest.

    ROUNDING: the last printed digit is off, and nothing depends on it. OPEN: the number depends on
    a choice that the print leaves open, and with those that we took it is another. REFUTED: it does
    not follow from what the source itself states.
    """

    ROUNDING = "rounding"
    OPEN = "left open"
    REFUTED = "refuted"


@dataclass(frozen=True)
class Check:
    """One number and the source's; `low..high` is where they agree.

    `printed` is the source's number or claim in its words, None if it is lost. `basis`: what the
    check is worth when the number lies within the limits, see `chosen` and `consistent`.
    `uncertainty`: how far rounding on another processor may move the number, where that is more
    than its fourth digit. `standard_error`: that of a number over starts, taken as drawn at
    random, else zero; it widens no limit. `fleeting`: the number changes from run to run (a
    clock), so that pages show the limits only. `grade`: what a difference would say of the source,
    where it is less than the entry's other differences say, see `graded`.
    """

    name: str
    printed: str | None
    measured: float
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    fleeting: bool = False
    basis: Verdict = Verdict.AGREES
    uncertainty: float = 0.0
    standard_error: float = 0.0
    grade: Grade | None = None

    @property
    def verdict(self) -> Verdict:
        """'value lost', 'differs', or the check's basis."""
        if self.printed is None:
            return Verdict.LOST
        return self.basis if self.low <= self.measured <= self.high else Verdict.DIFFERS


def half_unit(number: str) -> float:
    """Half a unit of the last digit of a number as printed: '2.7' -> 0.05."""
    return 0.5 * 10.0 ** Decimal(number).as_tuple().exponent


def near(name, number: str, measured, unit="", tolerance=None, printed=None) -> Check:
    """Check against a printed number, to half a unit of its last digit or a given tolerance."""
    away = half_unit(number) if tolerance is None else tolerance
    value = float(number)
    text = printed or f"{number} {unit}".rstrip()
    return Check(name, text, float(measured), value - away, value + away, unit)


def within(name, printed: str, measured, low=-math.inf, high=math.inf, unit="", fleeting=False):
    """Check against a printed claim, by limits that stand for it."""
    return Check(name, printed, float(measured), low, high, unit, fleeting)


def lost(name, measured, unit="") -> Check:
    """A computed number whose printed value is illegible."""
    return Check(name, None, float(measured), unit=unit)


def chosen(check: Check) -> Check:
    """The check of a number for which something was chosen in view of the printed one."""
    return replace(check, basis=Verdict.CHOSEN)


def consistent(check: Check) -> Check:
    """The check of a number against another computation of ours: the source prints none."""
    return replace(check, basis=Verdict.CONSISTENT)


def uncertain(check: Check, uncertainty: float) -> Check:
    """The check of an ill-conditioned number: `uncertainty` is what rounding makes of it."""
    return replace(check, uncertainty=float(uncertainty))


def sampled(check: Check, standard_error: float) -> Check:
    """The check of a number over many starts, with its standard error."""
    return replace(check, standard_error=float(standard_error))


def graded(check: Check, grade: Grade) -> Check:
    """The check of a number whose difference has a lesser grade than the entry."""
    return replace(check, grade=grade)


def share(name, printed: str, happened, low=-math.inf, high=math.inf) -> Check:
    """Check of the share of starts in which something `happened`."""
    return sampled(within(name, printed, np.mean(happened), low, high), share_error(happened))


def share_error(happened) -> float:
    """Binomial standard error of a share; zero where none or all of the starts count."""
    part = float(np.mean(happened))
    return math.sqrt(part * (1.0 - part) / len(happened))


def ratio_of_shares(name, printed: str, one, other, low=-math.inf, high=math.inf) -> Check:
    """Check of the share of starts in which `one` happened, over that of `other`, independent."""
    ratio = np.mean(one) / np.mean(other)
    error = math.hypot(*(share_error(each) / np.mean(each) for each in (one, other)))
    return sampled(within(name, printed, ratio, low, high), ratio * error)


def percent(happened) -> str:
    """A share in words, '68 ± 5 %': with its standard error, where it has one."""
    error = 100.0 * share_error(happened)
    digits = 0 if error >= 2.0 else 1
    text = f"{100.0 * np.mean(happened):.{digits}f}"
    return f"{text} ± {error:.{digits}f} %" if error else f"{100.0 * np.mean(happened):.0f} %"


@dataclass(frozen=True)
class Answer:
    """What an entry's function returns; `figures`: matplotlib figures by name, '' for the only."""

    checks: tuple[Check, ...]
    figures: dict
    note: str = ""

    @property
    def fleeting(self) -> bool:
        """Whether the figures, as a number of the checks, change from run to run."""
        return any(check.fleeting for check in self.checks)

    @property
    def verdict(self) -> Verdict:
        """Differs if any check does, else chosen if any is, and so on; lost if there is none."""
        found = {check.verdict for check in self.checks} | {Verdict.LOST}
        return next(verdict for verdict in _PRECEDENCE if verdict in found)


@dataclass(frozen=True)
class Entry:
    """Published ids that one function computes; `declared` is the verdict that it must reach.

    `reason`: why it differs, what was chosen or lost; given unless it agrees. `grade`: the gravest
    of its differences, given if it differs. `slow`: a second and a half or more with nothing
    compiled, or a matter of the clock.
    """

    ids: tuple[str, ...]
    compute: Callable[[], Answer]
    declared: Verdict = Verdict.AGREES
    reason: str = ""
    slow: bool = False
    grade: Grade | None = None

    def __post_init__(self):
        unknown = [id_ for id_ in self.ids if id_ not in ROW_OF]
        if unknown or not self.ids:
            received = ", ".join(unknown) or "none"
            raise ValueError(f"entry: ids must be of the catalogue; received {received}")
        if (self.declared is Verdict.AGREES) == bool(self.reason):
            what = "empty" if self.declared is Verdict.AGREES else "given"
            raise ValueError(
                f"entry {self.id}: reason must be {what} where the verdict is '{self.declared}'; "
                f"received {self.reason!r}"
            )
        if (self.declared is Verdict.DIFFERS) != (self.grade is not None):
            what = "given" if self.declared is Verdict.DIFFERS else "left out"
            raise ValueError(
                f"entry {self.id}: grade must be {what} where the verdict is '{self.declared}'; "
                f"received {self.grade or 'none'}"
            )

    @property
    def id(self) -> str:
        """The first id: name of the entry's pictures."""
        return self.ids[0]

    @property
    def rows(self) -> list[Row]:
        """Rows of the catalogue that the entry serves."""
        return list({ROW_OF[id_]: None for id_ in self.ids})


@dataclass(frozen=True)
class Outcome:
    """An entry and what it answered; `pictures`: paths, as they were written."""

    entry: Entry
    answer: Answer
    pictures: tuple = ()

    @property
    def as_declared(self) -> bool:
        """Whether the verdict, and the grade of a difference, are the declared ones."""
        return (self.answer.verdict, self.grade) == (self.entry.declared, self.entry.grade)

    @property
    def grade(self) -> Grade | None:
        """The gravest grade of what differs; none where nothing does."""
        found = {self.grade_of(check) for check in self.answer.checks}
        return next((grade for grade in reversed(Grade) if grade in found), None)

    def grade_of(self, check: Check) -> Grade | None:
        """The grade of a check that differs, the entry's unless it has its own; else none."""
        return (check.grade or self.entry.grade) if check.verdict is Verdict.DIFFERS else None

    def as_data(self) -> dict:
        """Plain data, for JSON."""
        return {
            "id": self.entry.id,
            "ids": list(self.entry.ids),
            "title": "; ".join(row.content for row in self.entry.rows),
            "expected": "; ".join(row.expected for row in self.entry.rows if row.expected),
            "verdict": str(self.answer.verdict),
            "declared": str(self.entry.declared),
            "grade": None if self.grade is None else str(self.grade),
            "reason": self.entry.reason,
            "checks": [_check_data(c, self.grade_of(c)) for c in self.answer.checks],
            "note": self.answer.note,
            "pictures": [str(path) for path in self.pictures],
        }


def in_words(verdict: str, grade: str | None) -> str:
    """A verdict with its grade, 'differs (refuted)'."""
    return f"{verdict} ({grade})" if grade else str(verdict)


def _check_data(check: Check, grade: Grade | None) -> dict:
    limits = [x if math.isfinite(x) else None for x in (check.low, check.high)]
    drawn: dict[str, object] = {"grade": str(grade)} if grade else {}
    if check.standard_error:
        drawn = {"standard_error": check.standard_error} | drawn
    return {
        "name": check.name,
        "expected": check.printed,
        "measured": check.measured if math.isfinite(check.measured) else None,
        "unit": check.unit,
        "tolerance": limits,
        "verdict": str(check.verdict),
        "uncertainty": check.uncertainty,
        "fleeting": check.fleeting,
    } | drawn
