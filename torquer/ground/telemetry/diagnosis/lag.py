"""A sensor that filters or averages, told from a clock that is late.

To first order both delay |B| alike. But a filter acts on the noise, too: rows that follow one
another within its time have alike noise, which those of a late clock have not. So rows that follow
one another are looked at by themselves.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.signal import medfilt, savgol_coeffs, savgol_filter

from torquer.ground.telemetry.diagnosis.causes import Hypothesis, Place
from torquer.ground.telemetry.diagnosis.evidence import whiten, whitenings
from torquer.ground.telemetry.diagnosis.fit import Tried, fit

#: Times over which a sensor may filter or average [s], at most this part of the session.
_LAGS_S, _LAG_PART = (4.0, 7.0, 12.0, 20.0, 33.0, 55.0, 90.0), 0.125
#: Rows of a smoothing polynomial beyond three lags, and how far off its median a row is put right.
_MORE_ROWS, _GROSS = 5, 10.0
#: Stretches of rows that follow one another, rows of each, and the cadences that may lie between.
_STRETCHES, _LENGTH, _APART = 4, 60, 1.5
#: Parts of the delay that are tried as lags, and parts of white noise made after the filter.
_LAGS, _WHITE = (0.7, 0.85, 1.0, 1.2, 1.4), (0.003, 0.03, 0.1, 0.3)
#: A delay is looked at if it is so many cadences long: else all noise is alike.
_LEAST_CADENCES = 3.0
#: How well the delay is known [s], at least.
_KNOWN_S = 2.0


def lags(t_s, m, rows, strength) -> Iterator[Hypothesis]:
    """Readings at `rows` without the lag of an exponential filter or of a running mean.

    `t_s`, `m`: all rows that are looked at.
    """
    cadence, span = float(np.median(np.diff(t_s))), t_s[-1] - t_s[0]
    times = dict.fromkeys(max(each, cadence) for each in _LAGS_S)
    some = [each for each in times if each <= min(_LAG_PART * span, 120.0)]
    for lag_s in some:
        for kind in ("filters", "averages"):
            undone = undo(t_s, m, lag_s, kind)
            if undone is not None:
                value = (kind, lag_s if kind == "filters" else 2.0 * lag_s)
                readings, calmer = undone
                yield Hypothesis(
                    "lag", value, 0.5 / len(some), readings[rows], strength, jacobian=calmer
                )


def undo(
    t_s: np.ndarray, m: np.ndarray, lag_s: float, kind: str
) -> tuple[np.ndarray, float] | None:
    """Readings [n, 3] without the lag of an exponential filter ("filters") of time `lag_s`, or of a
    running mean over twice that ("averages"), and what that does to white noise: the logarithm of
    its factor, where it is made less. None for rows that are too few.

    By smoothed derivatives: the noise stays nearly what it was.
    """
    cadence = float(np.median(np.diff(t_s)))
    length = int(min(3.0 * lag_s / cadence + _MORE_ROWS, len(t_s) // 3 * 2 - 1)) | 1
    if length < _MORE_ROWS:
        return None
    middle = np.column_stack([medfilt(axis, 5) for axis in m.T])
    off = np.abs(m - middle)
    gross = off > _GROSS * np.maximum(np.median(off, axis=0), 1.0)
    calm = np.where(gross, middle, m)
    bend = lag_s**2 / 3.0 if kind == "averages" else 0.0
    first, second = (savgol_filter(calm, length, 3, deriv=k, delta=cadence, axis=0) for k in (1, 2))
    kernel = lag_s * savgol_coeffs(length, 3, deriv=1, delta=cadence)
    kernel += bend * savgol_coeffs(length, 3, deriv=2, delta=cadence)
    kernel[length // 2] += 1.0
    return m + lag_s * first + bend * second, min(0.0, float(np.log(np.linalg.norm(kernel))))


def tell(
    t_s: np.ndarray, m: np.ndarray, place: Place, delay_s: float, values: np.ndarray
) -> float | None:
    """How much more probable [nats] a lag is than a late clock, of a field late by `delay_s`.

    `t_s`, `m`: all usable rows [n], [n, 3] nT. `values`: parameters [9] of the fit that found the
    delay. None where the rows are too far apart to say.
    """
    rows = _stretches(t_s)
    cadence = float(np.median(np.diff(t_s)))
    if rows is None or delay_s < _LEAST_CADENCES * cadence:
        return None
    t, read = t_s[rows], m[rows]
    late = _late_clock(t, read, place, delay_s, values)
    lags = []
    for part in _LAGS:
        for kind in ("filters", "averages"):
            undone = undo(t_s, m, part * delay_s, kind)
            if undone is not None:
                lags.append(_lag(t, undone[0][rows], place, part * delay_s, kind, values))
    return float(np.logaddexp.reduce(lags) - np.log(len(lags)) - late) if lags else None


def _stretches(t_s: np.ndarray) -> np.ndarray | None:
    """Rows of up to four stretches that follow one another, evenly chosen."""
    cadence = float(np.median(np.diff(t_s)))
    breaks = np.flatnonzero(np.diff(t_s) > _APART * cadence) + 1
    runs = [run for run in np.split(np.arange(len(t_s)), breaks) if len(run) >= _LENGTH // 2]
    pieces = [run[k : k + _LENGTH] for run in runs for k in range(0, len(run), _LENGTH)]
    pieces = [piece for piece in pieces if len(piece) >= _LENGTH // 2]
    if not pieces:
        return None
    chosen = np.unique(np.linspace(0, len(pieces) - 1, _STRETCHES).astype(int))
    return np.concatenate([pieces[k] for k in chosen])


def _tried(m, strength, rate, width_s: float) -> Tried:
    return Tried(m[None], strength[None], rate[None, :, None], np.array([[width_s]]))


def _late_clock(t, m, place: Place, delay_s: float, values) -> float:
    strength, later = place.strength(t - delay_s), place.strength(t - delay_s + 2.0)
    tried = _tried(m, strength, 0.5 * (later - strength), max(_KNOWN_S, 0.2 * delay_s))
    return _marginal(tried, values, list(whitenings(t)))


def _lag(t, m, place: Place, lag_s: float, kind: str, values) -> float:
    strength, later = place.strength(t), place.strength(t + 2.0)
    tried = _tried(m, strength, 0.5 * (later - strength), max(_KNOWN_S, 0.05 * lag_s))
    return _marginal(tried, values, list(_filtered(t, m, lag_s, kind)))


def _marginal(tried: Tried, values, shapes) -> float:
    start = np.append(values[:9], 0.0)[None]
    parts = []
    for weight, whitening, determinant in shapes:
        found = fit(tried, 8, start, whitening)
        parts.append(weight + float(found.evidence[0]) - determinant)
    return float(np.logaddexp.reduce(parts))


def _filtered(t, m, lag_s: float, kind: str):
    """Shapes of noise that went through the filter, as |m| sees them: see `whitenings`."""
    apart = np.abs(t[:, None] - t[None, :])
    alike = (
        np.exp(-apart / lag_s)
        if kind == "filters"
        else np.maximum(0.0, 1.0 - apart / (2.0 * lag_s))
    )
    unit = m / np.linalg.norm(m, axis=1)[:, None]
    alike = alike * (unit @ unit.T)
    for white in _WHITE:
        yield -np.log(len(_WHITE)), *whiten((1.0 - white) * alike)
