"""From scores to a verdict: a cause is named if it beats chance and its rivals, and fits.

Thresholds were chosen on 770 synthetic passes of known cause and held on 260 fresh ones.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from torquer.ground.telemetry.diagnosis.causes import CAUSES, TIMING
from torquer.ground.telemetry.diagnosis.evidence import Floor
from torquer.ground.telemetry.diagnosis.fit import WORST_NT
from torquer.ground.telemetry.diagnosis.plane import Plane

#: A cause is named if it is so many nats above 'as stated', and rivals are those within so many.
NAMED_NATS, RIVAL_NATS = 12.0, 6.0
#: A cause fits if it leaves so many times the floor and so much more [nT], and at most `WORST_NT`.
_FITS, _FITS_NT = 2.0, 30.0
#: The stated must be worse by this factor than what is named.
_WORSE = 1.08
#: Seconds along the orbit within which clock and track are alike.
_ALIKE_S = 100.0
#: Rows from which on it can be said that nothing fits.
_LEAST_ROWS = 20
#: Nats by which the noise tells a lag from a late clock.
_TOLD_NATS = 6.0
#: Causes that are listed for people.
LISTED = 4


class Ranked(NamedTuple):
    """A cause: the value that fits best, log evidence over 'as stated' [nats], residual [nT], and
    whether that is near the noise."""

    cause: str
    value: Any
    nats: float
    residual_nt: float
    fits: bool

    @property
    def text(self) -> str:
        """The cause in words, with its residual."""
        return f"{CAUSES[self.cause].say(self.value)}: {self.residual_nt:.0f} nT"


class Diagnosis(NamedTuple):
    """What explains the strength of the field.

    `verdict`: "stated", a cause of `causes.CAUSES`, "too short" where rivals cannot be told, or
    "nothing fits"; `rivals`: causes that are not excluded, the named one among them; `ranking`: all
    causes, best first; `floor_nt`: residual with a field that may be anything smooth; `bias_t` [3]
    T: of the sensor by the best cause; `plane`: of the second look where nothing fits.
    """

    verdict: str
    rivals: tuple[str, ...]
    ranking: tuple[Ranked, ...]
    floor_nt: float
    rows: int
    span_s: float
    bias_t: np.ndarray
    plane: Plane | None = None

    def of(self, cause: str) -> Ranked:
        """A cause of the ranking; KeyError if it was not tried."""
        return {each.cause: each for each in self.ranking}[cause]

    @property
    def named(self) -> Ranked | None:
        """The cause that is named; None for none."""
        is_cause = self.verdict in CAUSES and self.verdict != "stated"
        return self.of(self.verdict) if is_cause else None


def decide(ranking: tuple[Ranked, ...], none_nats: float, rows: int) -> tuple[str, tuple[str, ...]]:
    """Verdict and rivals by ranked causes, of which one is 'stated'.

    `none_nats`: log evidence of a field that is none of them, over 'as stated'; `rows`: used.
    """

    fitting = [each for each in ranking if each.fits]
    if not fitting:
        return "nothing fits" if rows >= _LEAST_ROWS else "too short", ()
    best, stated = fitting[0], next(each for each in ranking if each.cause == "stated")
    near = tuple(each.cause for each in fitting if each.nats > best.nats - RIVAL_NATS)
    leads = best.nats > NAMED_NATS and stated.residual_nt > _WORSE * best.residual_nt
    if best.cause == "stated" or not leads:
        return "stated" if stated.fits else "too short", near
    if best.cause in TIMING:
        near = _times(ranking, best, near)
    family = TIMING if best.cause in TIMING else (best.cause,)
    is_open = CAUSES[best.cause].is_place and none_nats > best.nats - RIVAL_NATS
    if is_open or set(near) - {*family, "stated"}:
        return "too short", near
    return best.cause, near


def _times(ranking, best: Ranked, near: tuple[str, ...]) -> tuple[str, ...]:
    """The rivals of a cause that moves the field in time: a lag only delays, and far along the
    orbit the Earth's turn tells the track from the clock."""
    there = {each.cause: each for each in ranking if each.cause in TIMING}
    alike = [each for each, one in there.items() if one.nats > best.nats - RIVAL_NATS]
    if best.cause != "track" or abs(best.value) < _ALIKE_S:
        alike += [each for each in there if each != "lag"]
        is_late = best.cause == "lag" or best.value < 0.0
        alike += ["lag"] if is_late and "lag" in there else []
    rest = [each for each in dict.fromkeys([*near, *alike]) if each != best.cause]
    return (best.cause, *rest)


def fits(cause: str, residual_nt: float, floor: Floor) -> bool:
    """Whether a residual is near what a free field leaves."""
    most = np.inf if cause == "units" else _FITS * floor.residual_nt + _FITS_NT
    return bool(residual_nt < min(most, WORST_NT))


def with_lag(found: Diagnosis, nats: float | None) -> Diagnosis:
    """The verdict after the noise of rows that follow one another has spoken for a lag [nats]."""
    if nats is None or found.verdict not in TIMING or "lag" not in found.rivals:
        return found
    if nats > _TOLD_NATS:
        return found._replace(verdict="lag", rivals=("lag",))
    return found
