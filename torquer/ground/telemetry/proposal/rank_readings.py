"""Readings of stamps and of a magnetometer, ranked by how well the field along the orbit fits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from torquer.base.limits import RequestError
from torquer.ground.telemetry.modulus import environment_along
from torquer.ground.telemetry.orbit import load_orbit
from torquer.ground.telemetry.proposal.guess_columns import ColumnReading
from torquer.ground.telemetry.proposal.guess_time import UNSTATED_ZONE, TimeReading
from torquer.ground.telemetry.reading.quantities import make_session
from torquer.ground.telemetry.start import correct_readings, trim_squares

#: Offsets of zones [h] that are tried where stamps state none.
_ZONES_H = np.arange(-24, 29) / 2.0
#: Another reading or zone is better if its misfit is below this part of the first one's.
_CLEARLY = 0.6
#: Fits to rows drawn at random.
_DRAWS = 60
#: Rows that a fit needs.
_LEAST_ROWS = 12
#: Readings of the stamps that are tested.
_TIMES = 6
#: A misfit [nT] beyond which nothing fits.
_NO_FIT_NT = 2e4


class Reading(NamedTuple):
    """A reading of stamps and of the magnetometer; `misfit_nt`: of the strength along the orbit,
    None without one; `remark`: why there is none."""

    time: TimeReading
    field: ColumnReading
    misfit_nt: float | None = None
    remark: str = ""

    @property
    def text(self) -> str:
        """The reading in a line, with its score."""
        fits = self.remark
        if self.misfit_nt is not None:
            fits = f"{self.misfit_nt:.0f} nT" if self.misfit_nt < _NO_FIT_NT else "no fit"
        return f"{self.time.text}; {self.field.text}{f' ({fits})' if fits else ''}"


def rank(times: list[TimeReading], fields: list[ColumnReading], orbit, satellite) -> list[Reading]:
    """All pairs of readings, the best first: by the misfit if there is an orbit, then by names."""
    found = [Reading(time, field) for time in times[:_TIMES] for field in fields]
    if orbit is not None and fields[0].name == "b_measured":
        found = _all_tested(times, fields, orbit, satellite) or found
    return sorted(found, key=lambda each: _cost(each, found))


def _all_tested(times, fields, orbit, satellite) -> list[Reading]:
    """Pairs of readings, tested until there are enough within reach of the orbit."""
    near: list[Reading] = []
    far: list[Reading] = []
    count = 0
    for time in times:
        found = _tested(time, fields, orbit, satellite)
        is_near = found[0].misfit_nt is not None
        (near if is_near else far).extend(found)
        count += is_near
        if count == _TIMES:
            break
    return near or far


def _cost(reading: Reading, readings: list[Reading]) -> tuple:
    """What is less for better readings: misfits that are alike count as one."""
    known = [each.misfit_nt for each in readings if each.misfit_nt is not None]
    off = 0.0
    if known:
        least = max(min(known), 1.0)
        ratio = np.inf if reading.misfit_nt is None else reading.misfit_nt / least
        off = 0.0 if ratio < 1.0 / _CLEARLY else ratio
    return off, -(reading.time.score + reading.field.score)


def _tested(time: TimeReading, fields, orbit, satellite) -> list[Reading]:
    """The readings of one reading of the stamps, tested along the orbit."""
    rows = np.flatnonzero(~np.isnat(time.utc))
    rows = rows[np.argsort(time.utc[rows], kind="stable")]
    data = make_session(time.utc[rows], {})
    try:
        along, _ = load_orbit(orbit, time.middle, satellite)
        environment = environment_along(data, along)
        t_s = data["time"].values
        strength = _strength(environment, t_s)
    except RequestError as error:
        if "elements within" not in str(error):
            raise
        return [Reading(time, each, None, "elements too far away") for each in fields]
    except ValueError as error:
        return [Reading(time, each, None, str(error)[:80]) for each in fields]
    found = [Reading(time, each, _misfit(each.values[rows], strength)) for each in fields]
    if UNSTATED_ZONE not in time.guesses:
        return found
    return found + _in_zones(time, found, environment, t_s, rows)


def _strength(environment, t_s) -> np.ndarray:
    """Strength of the field along the orbit [n] T."""
    r, v = environment.state(t_s)
    return np.linalg.norm(environment.field(t_s, r, v), axis=1)


def _misfit(b: np.ndarray, strength: np.ndarray) -> float | None:
    """What bias and scale leave of the strength [nT], by the rows nearest to the fit."""
    known = np.isfinite(b).all(axis=1) & (np.abs(b).sum(axis=1) > 0.0)
    if known.sum() < _LEAST_ROWS:
        return None
    m, f = b[known], strength[known]
    off = np.abs(correct_readings(trim_squares(m, f, samples=_DRAWS), m) - f)
    return float(1.4826e9 * np.median(off))


def _in_zones(time: TimeReading, found, environment, t_s, rows) -> list[Reading]:
    """The best reading's stamps as those of another zone, if that fits clearly better."""
    best = min(found, key=lambda each: np.inf if each.misfit_nt is None else each.misfit_nt)
    if best.misfit_nt is None:
        return []
    b = best.field.values[rows]
    misfits = [_misfit(b, _strength(environment, t_s - 3600.0 * h)) or np.inf for h in _ZONES_H]
    least = int(np.argmin(misfits))
    hours = float(_ZONES_H[least])
    if hours == 0.0 or misfits[least] > _CLEARLY * best.misfit_nt:
        return []
    sign, minutes = "-" if hours < 0.0 else "+", round(abs(hours) * 60.0)
    zone = f"{sign}{minutes // 60:02d}:{minutes % 60:02d}"
    guesses = tuple(each for each in time.guesses if each != UNSTATED_ZONE)
    guess = f"its zone is {zone}, by the field along the orbit: the stamps state none"
    moved = time._replace(
        keys=time.keys | {"zone": zone},
        utc=time.utc - np.timedelta64(round(hours * 60.0), "m"),
        guesses=(*guesses, guess),
    )
    return [Reading(moved, best.field, misfits[least])]
