"""The diagnosis of a session's magnetometer: what of all that may be wrong explains |B|."""

from __future__ import annotations

import numpy as np

from torquer.ground.telemetry.diagnosis.causes import (
    CAUSES,
    NONE_OF_THESE,
    NOTHING,
    TIMING,
    Given,
    Hypothesis,
    Known,
    Place,
    hypotheses,
    units,
)
from torquer.ground.telemetry.diagnosis.evidence import Floor, Scores, find_floor, score
from torquer.ground.telemetry.diagnosis.fit import Tried
from torquer.ground.telemetry.diagnosis.lag import lags, tell
from torquer.ground.telemetry.diagnosis.plane import LEAST_REVOLUTIONS, find_plane
from torquer.ground.telemetry.diagnosis.rows import find_usable
from torquer.ground.telemetry.diagnosis.verdict import Diagnosis, Ranked, decide, fits, with_lag

#: Rows that are used at most, and at least.
_MOST_ROWS, _LEAST_ROWS = 240, 8
#: Of longer sessions so many stretches of so long [s] are used: rows stay near one another.
_STRETCHES, _STRETCH_S = 4, 5400.0
#: Rows that are looked at at most: each k-th of more.
_LOOKED_AT = 20_000
#: A step counts for at most so many cadences of a session's length.
_GAP = 4.0


def diagnose(
    t_s: np.ndarray, b: np.ndarray, place: Place | Given, known: Known = NOTHING
) -> Diagnosis | None:
    """What explains readings `b` [n, 3] T at times [n] s; None for too few rows.

    240 rows and some 150 hypotheses: 0.6 s as a rule, at most 7 s.
    """
    usable = np.flatnonzero(find_usable(t_s, b).kept)
    if len(usable) < _LEAST_ROWS:
        return None
    usable = usable[_stretches(t_s[usable])]
    t_all, m_all = t_s[usable], 1e9 * b[usable]
    rows = np.linspace(0, len(t_all) - 1, min(len(t_all), _MOST_ROWS)).astype(int)
    t, m = t_all[rows], m_all[rows]
    tried = hypotheses(t, m, place, known)
    strength = tried[0].strength
    tried += [*units(m, strength), *lags(t_all, m_all, rows, strength)]
    floor = find_floor(t, m, float(np.mean(strength)))
    kept = floor.kept
    scores = _score(t[kept], tried, kept)
    ranking = _rank(tried, scores, floor)
    none_nats = np.log(NONE_OF_THESE) + floor.evidence - scores.evidence[0]
    best = int(np.argmax(scores.evidence))
    found = Diagnosis(
        *decide(ranking, none_nats, int(kept.sum())),
        ranking,
        floor.residual_nt,
        int(kept.sum()),
        float(t[-1] - t[0]),
        1e-9 * scores.fit.values[best, :3],
    )
    if isinstance(place, Given):
        return found
    if found.verdict in TIMING:
        return with_lag(found, _tell(t_all, m_all, place, tried, scores))
    if found.verdict == "nothing fits" and found.span_s >= LEAST_REVOLUTIONS * place.period_s:
        return _look_again(found, t[kept], m[kept], place)
    return found


def _stretches(t_s: np.ndarray) -> np.ndarray:
    """Rows that are looked at: of a long session a few stretches, of many rows each k-th."""
    steps = np.diff(t_s)
    length = np.append(0.0, np.cumsum(np.minimum(steps, _GAP * np.median(steps))))
    rows = np.arange(len(t_s))
    if length[-1] > _STRETCHES * _STRETCH_S:
        firsts = np.linspace(0.0, length[-1] - _STRETCH_S, _STRETCHES)
        inside = [(length >= first) & (length <= first + _STRETCH_S) for first in firsts]
        rows = np.flatnonzero(np.any(inside, axis=0))
    return rows[:: -(-len(rows) // _LOOKED_AT)]


def _score(t, tried: list[Hypothesis], kept) -> Scores:
    most = max(len(each.columns) for each in tried)
    columns = np.zeros((len(tried), len(t), most))
    sigma = np.zeros((len(tried), most))
    for k, each in enumerate(tried):
        for j, column in enumerate(each.columns):
            columns[k, :, j], sigma[k, j] = column[kept], each.sigma[j]
    stacked = Tried(
        np.array([each.m[kept] for each in tried]),
        np.array([each.strength[kept] for each in tried]),
        columns,
        sigma,
    )
    prior = np.log([CAUSES[each.cause].prior * each.prior for each in tried])
    jacobian = len(t) * np.array([each.jacobian for each in tried])
    return score(t, stacked, prior, jacobian, np.array([each.cause for each in tried]))


def _rank(tried: list[Hypothesis], scores: Scores, floor: Floor) -> tuple[Ranked, ...]:
    """Causes, best first; as the value of a scan its most probable one."""
    causes = np.array([each.cause for each in tried])
    stated = scores.evidence[0]
    ranked = []
    for cause in dict.fromkeys(causes.tolist()):
        which = np.flatnonzero(causes == cause)
        best = which[np.argmax(scores.evidence[which])]
        nats = float(np.logaddexp.reduce(scores.evidence[which]) - stated)
        residual = float(scores.fit.sigma[best])
        value = _value(tried[best], scores.fit.values[best])
        ranked.append(Ranked(cause, value, nats, residual, fits(cause, residual, floor)))
    return tuple(sorted(ranked, key=lambda each: -each.nats))


def _value(best: Hypothesis, values: np.ndarray):
    """The value of a hypothesis, refined by its first column where that is a rate."""
    return best.value + float(values[9]) if best.cause in ("clock", "track") else best.value


def _tell(t, m, place: Place, tried: list[Hypothesis], scores: Scores) -> float | None:
    """What the noise says of a lag, at the delay of the best clock; see `lag.tell`."""
    clocks = [k for k, each in enumerate(tried) if each.cause == "clock"]
    if not clocks:
        return None
    best = max(clocks, key=lambda k: scores.evidence[k])
    values = scores.fit.values[best]
    return tell(t, m, place, -_value(tried[best], values), values)


def _look_again(found: Diagnosis, t, m, place: Place) -> Diagnosis:
    try:
        return found._replace(plane=find_plane(t, m, place, found.floor_nt))
    except ValueError:  # beyond what is known of the orbit: no second look
        return found
