"""The strength of the geomagnetic field along an orbit, compared with a magnetometer's.

The strength does not depend on the attitude, so it checks a magnetometer, its units, its clock and
the elements without knowing it. Along an orbit the field is taken from a spline over a grid of
20 s: 1e-3 nT from the model, and as fast for a million stamps as for a thousand.
"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np
import xarray as xr

from torquer.environment.along_orbit import Environment, OrbitEnvironment

#: Distance of the points of the grid [s], and the degree of the spline through them.
GRID_S, DEGREE = 20.0, 5
#: Seconds beyond the first and last stamp of a stretch: clocks may be wrong by so much.
MARGIN_S = 400.0
#: Offsets of zones [h]: all that are in use are multiples of a quarter of an hour.
ZONES_H = np.arange(-56, 57) / 4.0
#: Another zone is named if its residual is below this part of the stated one's.
_CLEARLY = 0.75
#: Rows that are enough for the scan of zones.
_ENOUGH = 600
#: What a unit was taken for, by the ratio of the measured strength to the model's.
_SLIPS = {
    1e-9: "tesla taken for nanotesla", 1e-6: "tesla taken for microtesla",
    1e-5: "gauss taken for nanotesla", 1e-3: "microtesla taken for nanotesla",
    1e-2: "gauss taken for microtesla", 1e2: "nanotesla taken for milligauss",
    1e-1: "microtesla taken for milligauss", 1e1: "milligauss taken for microtesla",
    1e3: "nanotesla taken for microtesla", 1e5: "nanotesla taken for gauss",
    1e6: "microtesla taken for tesla", 1e9: "nanotesla taken for tesla",
}  # fmt: skip


def environment_along(data: xr.Dataset, orbit) -> OrbitEnvironment:
    """The environment along an orbit, whose time 0 is the first row of a session."""
    return OrbitEnvironment(Environment(), orbit, session_start(data))


def session_start(data: xr.Dataset) -> datetime:
    """UTC of the first row of a session, to the microsecond."""
    if not data.sizes["time"]:
        raise ValueError("FILE: must hold rows; received none")
    return data["utc"].values[0].astype("datetime64[us]").item().replace(tzinfo=UTC)


def session_middle(data: xr.Dataset) -> datetime:
    """UTC of the middle row of a session: some rows of a clock that was not set do not move it."""
    session_start(data)
    stamp = data["utc"].values[data.sizes["time"] // 2]
    return stamp.astype("datetime64[us]").item().replace(tzinfo=UTC)


class FieldAlong:
    """The field along an orbit at the stamps of a session, by splines over stretches of stamps."""

    def __init__(self, environment: OrbitEnvironment, t_s: np.ndarray):
        self._first, self._splines = [], []
        for low, high in _stretches(t_s):
            count = int(np.ceil((high - low + 2.0 * MARGIN_S) / GRID_S)) + 1
            grid = low - MARGIN_S + GRID_S * np.arange(max(count, 2 * DEGREE))
            r, v = environment.state(grid)
            self._first.append(low)
            self._splines.append(_strength_spline(grid, environment.field(grid, r, v), DEGREE))

    def strength(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Strength [n] T of the field at times [n] s, and its rate of change [n] T/s.

        The times ascend and are at most `MARGIN_S` from the stamps.
        """
        ends = np.searchsorted(t_s, np.array(self._first[1:]) - MARGIN_S)
        pairs = list(zip(self._splines, np.split(t_s, ends), strict=True))
        value, rate = (
            np.concatenate([spline(part, nu=order) for spline, part in pairs]) for order in (0, 1)
        )
        return value, rate


def _strength_spline(t_s, b, degree: int):
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(t_s, np.linalg.norm(b, axis=1), degree)


def _stretches(t_s: np.ndarray) -> list[tuple[float, float]]:
    """First and last time of stretches between which there are long gaps."""
    cuts = np.flatnonzero(np.diff(t_s) > 4.0 * MARGIN_S)
    firsts, lasts = np.append(0, cuts + 1), np.append(cuts, len(t_s) - 1)
    return [(float(t_s[a]), float(t_s[b])) for a, b in zip(firsts, lasts, strict=True)]


class FieldGiven:
    """The field at positions that the telemetry itself holds, which belong to its stamps."""

    def __init__(self, environment: OrbitEnvironment, t_s: np.ndarray, position_j: np.ndarray):
        known = np.isfinite(position_j).all(axis=1)
        if np.sum(known) <= DEGREE:
            raise ValueError("position_j: must be given in more rows; received too few")
        r = np.ascontiguousarray(position_j[known])
        self._spline = _strength_spline(t_s[known], environment.field(t_s[known], r, r), 3)

    def strength(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Strength [n] T of the field at times [n] s, and its rate of change [n] T/s."""
        return self._spline(t_s), self._spline(t_s, nu=1)


class Zone(NamedTuple):
    """What the scan of zones found: residual [nT] by offset [h], the best, and the margin."""

    residual_nt: np.ndarray
    best_h: float
    best_nt: float
    stated_nt: float
    next_nt: float

    @property
    def is_wrong(self) -> bool:
        """Whether another zone fits better by a clear margin."""
        return self.best_h != 0.0 and self.best_nt < _CLEARLY * self.stated_nt


def zone_scan(environment: OrbitEnvironment, t_s: np.ndarray, b: np.ndarray) -> Zone:
    """Residual of |B| with the stamps moved by each offset of `ZONES_H`, bias, scale and
    non-orthogonality fitted.

    `next_nt`: the least residual an hour or more from the best.
    """
    good = np.flatnonzero(np.isfinite(b).all(axis=1) & (np.abs(b).sum(axis=1) > 0.0))
    rows = good[np.linspace(0, len(good) - 1, min(len(good), _ENOUGH)).astype(int)]
    at, m = t_s[rows], b[rows]
    times = (at[None, :] + 3600.0 * ZONES_H[:, None]).ravel()
    r, v = environment.state(times)
    model = np.linalg.norm(environment.field(times, r, v), axis=1).reshape(len(ZONES_H), -1)
    residual = np.array([_misfit(m, each) for each in model]) * 1e9
    best = int(np.argmin(residual))
    far = np.abs(ZONES_H - ZONES_H[best]) >= 1.0
    stated = float(residual[ZONES_H == 0.0][0])
    return Zone(
        residual, float(ZONES_H[best]), float(residual[best]), stated, float(residual[far].min())
    )


def _misfit(m: np.ndarray, strength: np.ndarray) -> float:
    """Robust residual [T] of |B| with bias, scale and non-orthogonality.

    Linear: the square of the strength is a quadric of the readings, fitted to the rows near which
    the trimmed fit of `torquer.ground.telemetry.start` passes.
    """
    from torquer.ground.telemetry.start import correct_readings, trim_squares

    off = np.abs(correct_readings(trim_squares(m, strength, samples=12), m) - strength)
    near = off < 4.0 * 1.4826 * np.median(off)
    x, f = m / np.median(strength), strength / np.median(strength)
    pairs = [x[:, i] * x[:, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    rows = np.column_stack([*pairs, x, np.ones(len(x))]) / f[:, None]
    found = np.linalg.lstsq(rows[near], f[near], rcond=1e-10)[0]
    # of F^2 / F, half of which is the error of F
    residual = 0.5 * np.median(strength) * (rows @ found - f)[near]
    return float(1.4826 * np.median(np.abs(residual)))


def unit_slip(strength_measured: np.ndarray, strength: np.ndarray) -> tuple[float, str]:
    """Median ratio of the measured strength to the model's, and the slip that it names ("": none).

    A slip is named where the ratio is within a factor of 2 of that of the slip.
    """
    with np.errstate(invalid="ignore"):
        ratio = float(np.nanmedian(strength_measured / strength))
    if not ratio > 0.0:
        return ratio, ""
    near = min(_SLIPS, key=lambda each: abs(np.log(ratio / each)))
    off = abs(np.log(ratio / near))
    return ratio, _SLIPS[near] if off < np.log(2.0) and off < abs(np.log(ratio)) else ""
