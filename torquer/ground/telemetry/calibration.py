"""Calibration of a magnetometer without the attitude: the strength of its reading is the field's.

The reading m becomes A (m - bias - C dipole - k (T - T0)), with A lower triangular: factors
1 + scale on its diagonal, non-orthogonality below it. Its strength is fitted to the model's at
stamps that may be shifted. Levenberg and Marquardt's method on Tukey's cost, which does not feel
gross outliers at all, from a trimmed start (`telemetry.start`). Least squares, Huber's
cost and Student's t break down at 1 to 20 % of outliers.

A clock that is wrong and a satellite that is ahead of its elements look the same in |B|: one shift
is fitted for both.
"""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.signal import lfilter

from torquer.ground.telemetry.start import trim_squares
from torquer.ground.telemetry.undetermined import unknown_directions

#: Beyond this part of outliers there is no answer.
MOST_OUTLIERS = 0.3
#: Tukey's constant: 95 % of the efficiency of least squares for normal errors.
TUKEY = 4.685
#: The shift [s] that is looked for at most.
MOST_SHIFT_S = 300.0
#: Rows of the first fit; the last steps use all.
_ROWS = 20_000
_LEAST_SIGMA_T = 1e-11
#: Usual bias of a magnetometer on board [T].
_USUAL_BIAS_T = 15e-6
#: Rows that are worked on at once, and those with which models are compared.
_PIECE, _COMPARED = 8192, 4000
#: Rows whose autocorrelation is taken, from the first on.
_COUNTED = 200_000
#: Rows up to which the correlation is found by restricted likelihood; the decays by the row and
#: the correlated parts that are tried.
_FEW = 200
_DECAYS = (0.2, 0.4, 0.55, 0.65, 0.72, 0.78, 0.83, 0.87, 0.9, 0.93, 0.95, 0.97, 0.985)
_PARTS = (0.25, 0.5, 0.75, 1.0)
#: Residuals beyond this part of the field are no calibration.
_FOLLOWS = 0.1


class Group(NamedTuple):
    """Parameters that are fitted together: names, and their usual size in SI."""

    names: tuple[str, ...]
    size: float


GROUPS = {
    "bias": Group(("bias_x", "bias_y", "bias_z"), 1e-5),
    "scale": Group(("scale_x", "scale_y", "scale_z"), 0.05),
    "non_orthogonality": Group(("skew_yx", "skew_zx", "skew_zy"), 0.05),
    "shift": Group(("shift",), 60.0),
    "coils": Group(tuple(f"coil_{a}{c}" for a in "xyz" for c in "xyz"), 1e-5),
    "temperature": Group(tuple(f"drift_{a}" for a in "xyz"), 1e-7),
    "matrix": Group(tuple(f"matrix_{a}{c}" for a in "xyz" for c in "xyz"), 0.05),
}
#: Models from small to large; those whose data are not there are left out.
MODELS: tuple[tuple[str, ...], ...] = (
    ("bias",),
    ("bias", "scale"),
    ("bias", "scale", "non_orthogonality"),
    ("bias", "scale", "non_orthogonality", "shift"),
    ("bias", "scale", "non_orthogonality", "shift", "coils"),
    ("bias", "scale", "non_orthogonality", "shift", "temperature"),
    ("bias", "scale", "non_orthogonality", "shift", "coils", "temperature"),
)
FULL = MODELS[3]


class TooManyOutliers(ValueError):
    """More outliers than any answer can be trusted with."""


class Rows(NamedTuple):
    """Rows of a session with which to calibrate, [n] each; `field` is their `FieldAlong`."""

    t_s: np.ndarray
    m: np.ndarray
    dipole: np.ndarray
    warmth: np.ndarray
    field: Any

    def take(self, rows) -> Rows:
        """Some of the rows."""
        return Rows(self.t_s[rows], self.m[rows], self.dipole[rows], self.warmth[rows], self.field)


def complete_rows(data: xr.Dataset, field) -> tuple[Rows, np.ndarray, float]:
    """Rows of a session without missing numbers, which they are, and the mean temperature [K]."""
    if "b_measured" not in data:
        raise ValueError("FILE: must hold b_measured; received none")
    m = data["b_measured"].values
    good = np.isfinite(m).all(axis=1)
    dipole, warmth, mean = np.zeros_like(m), np.zeros(len(m)), 0.0
    if "dipole_body" in data:
        dipole = data["dipole_body"].values
        good &= np.isfinite(dipole).all(axis=1)
    if "temperature" in data:
        good &= np.isfinite(data["temperature"].values)
        mean = float(np.mean(data["temperature"].values[good])) if good.any() else 0.0
        warmth = data["temperature"].values - mean
    kept = np.flatnonzero(good)
    rows = Rows(data["time"].values, m, dipole, warmth, field).take(kept)
    return rows, kept, mean


class Calibration(NamedTuple):
    """What was found: parameters by name (SI), their covariance, residuals of the rows used [T]."""

    groups: tuple[str, ...]
    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    sigma: float
    residual: np.ndarray
    weight: np.ndarray
    correlation: float
    undetermined: tuple[str, ...]
    mean_temperature_k: float = 0.0

    @property
    def outliers(self) -> float:
        """Part of the rows that have no weight."""
        return float(np.mean(self.weight == 0.0))

    @property
    def rms(self) -> float:
        """Root mean square of the residuals of all other rows [T]."""
        return float(np.sqrt(np.mean(self.residual[self.weight > 0.0] ** 2)))

    @property
    def sigmas(self) -> dict[str, float]:
        """Standard deviations by name."""
        sigmas = np.sqrt(np.diag(self.covariance)).tolist()
        return dict(zip(self.names, sigmas, strict=True))

    def of(self, name: str) -> float:
        """A parameter; 0 if it was not fitted."""
        return float(self.values[self.names.index(name)]) if name in self.names else 0.0

    @property
    def bias(self) -> np.ndarray:
        """Bias [3] T."""
        return np.array([self.of(name) for name in GROUPS["bias"].names])

    @property
    def matrix(self) -> np.ndarray:
        """Matrix A [3, 3] of scale and non-orthogonality, or of a known attitude."""
        if "matrix" in self.groups:
            given = np.array([self.of(name) for name in GROUPS["matrix"].names])
            return np.eye(3) + given.reshape(3, 3)
        return _matrix({name: self.of(name) for group in GROUPS.values() for name in group.names})

    def apply(self, data: xr.Dataset) -> np.ndarray:
        """Corrected readings [n, 3] T of a session."""
        x = data["b_measured"].values - self.bias
        if "coils" in self.groups:
            coupling = np.array([self.of(name) for name in GROUPS["coils"].names]).reshape(3, 3)
            x = x - data["dipole_body"].values @ coupling.T
        if "temperature" in self.groups:
            drift = np.array([self.of(name) for name in GROUPS["temperature"].names])
            x = x - np.outer(data["temperature"].values - self.mean_temperature_k, drift)
        return x @ self.matrix.T


def _names(groups) -> tuple[str, ...]:
    return tuple(name for group in groups for name in GROUPS[group].names)


def _sizes(groups) -> np.ndarray:
    return np.concatenate([[GROUPS[g].size] * len(GROUPS[g].names) for g in groups])


def _matrix(p: dict[str, float]) -> np.ndarray:
    return np.array(
        [
            [1.0 + p["scale_x"], 0.0, 0.0],
            [p["skew_yx"], 1.0 + p["scale_y"], 0.0],
            [p["skew_zx"], p["skew_zy"], 1.0 + p["scale_z"]],
        ]
    )


def _model(groups, values, rows: Rows, strength, slope, at_s: float):
    """Residuals [n] T and their derivatives [n, p] with respect to the parameters in usual sizes.

    `strength`, `slope`: of the field at the stamps shifted by `at_s`. In pieces that a processor's
    cache holds: half the time for a million rows.
    """
    residual, slopes = np.empty(len(rows.t_s)), np.empty((len(rows.t_s), len(values)))
    for first in range(0, len(residual), _PIECE):
        piece = slice(first, first + _PIECE)
        residual[piece], slopes[piece] = _model_piece(
            groups, values, rows.take(piece), strength[piece], slope[piece], at_s
        )
    return residual, slopes


def _model_piece(groups, values, rows: Rows, strength, slope, at_s: float):
    p = dict.fromkeys(_names(GROUPS), 0.0) | dict(zip(_names(groups), values, strict=True))
    bias = np.array([p["bias_x"], p["bias_y"], p["bias_z"]])
    x = rows.m - bias
    if "coils" in groups:
        x = x - rows.dipole @ np.reshape([p[n] for n in GROUPS["coils"].names], (3, 3)).T
    if "temperature" in groups:
        x = x - rows.warmth[:, None] * [p[n] for n in GROUPS["temperature"].names]
    a = _matrix(p)
    y = x @ a.T
    length = np.sqrt(np.einsum("ij,ij->i", y, y))
    n = y / np.maximum(length, 1e-30)[:, None]
    residual = length - strength - slope * (p["shift"] - at_s)
    pulled = -(n @ a)
    parts = {
        "bias": lambda: pulled,
        "scale": lambda: n * x,
        "non_orthogonality": lambda: np.stack(
            [n[:, 1] * x[:, 0], n[:, 2] * x[:, 0], n[:, 2] * x[:, 1]], axis=1
        ),
        "shift": lambda: -slope[:, None],
        "coils": lambda: (pulled[:, :, None] * rows.dipole[:, None, :]).reshape(len(x), 9),
        "temperature": lambda: pulled * rows.warmth[:, None],
    }
    slopes = np.concatenate([parts[g]() for g in groups], axis=1)
    return residual, slopes * _sizes(groups)


def tukey(residual, sigma):
    """Tukey's weights, and twice his cost in units of sigma^2."""
    z = np.minimum((residual / (TUKEY * sigma)) ** 2, 1.0)
    return (1.0 - z) ** 2, float(np.sum(1.0 - (1.0 - z) ** 3)) * TUKEY**2 / 3.0


def _spread(residual, least: float = 0.0) -> float:
    return max(1.4826 * float(np.median(np.abs(residual))), _LEAST_SIGMA_T, least)


def _shift(groups, values) -> float:
    return float(values[_names(groups).index("shift")]) if "shift" in groups else 0.0


def _levenberg(groups, values, rows: Rows, steps: int = 60, frozen: bool = False):
    """Parameters at the least of Tukey's cost, and the sigma of the residuals.

    `frozen`: the field is extrapolated from the first shift, not looked up again.
    """
    sizes, damping = _sizes(groups), 1e-3
    at_s = _shift(groups, values)
    strength, slope = rows.field.strength(rows.t_s + at_s)
    residual, j = _model(groups, values, rows, strength, slope, at_s)
    sigma = _spread(residual)
    settled = 0
    for _ in range(steps):
        weight, cost = tukey(residual, sigma)
        normal = (j * weight[:, None]).T @ j
        pull = j.T @ (weight * residual)
        scale = np.diag(normal) + 1e-12 * np.trace(normal)
        step = -np.linalg.lstsq(normal + np.diag(damping * scale), pull, rcond=1e-14)[0]
        new = values + sizes * step
        if "shift" in groups:
            k = _names(groups).index("shift")
            new[k] = np.clip(new[k], -MOST_SHIFT_S, MOST_SHIFT_S)
        if not frozen and "shift" in groups:
            at_s = _shift(groups, new)
            strength, slope = rows.field.strength(rows.t_s + at_s)
        tried, j_tried = _model(groups, new, rows, strength, slope, at_s)
        if tukey(tried, sigma)[1] > cost * (1.0 + 1e-12):
            damping = min(10.0 * damping, 1e8)
            if damping > 1e6:
                break
            continue
        small = float(np.max(np.abs(j @ step))) < 1e-4 * sigma
        values, residual, j, damping = new, tried, j_tried, max(0.2 * damping, 1e-12)
        # the scale follows the rows that count; it settles within a few rounds
        inner = residual[np.abs(residual) < TUKEY * sigma]
        now = _spread(inner) if len(inner) > 0.5 * len(residual) else _spread(residual)
        settled = settled + 1 if small and abs(now - sigma) < 1e-3 * sigma else 0
        sigma = now
        if settled:
            break
    return values, sigma, residual, j


def calibrate(
    data: xr.Dataset, field, groups: tuple[str, ...] = FULL, near: np.ndarray | None = None
) -> Calibration:
    """Calibrate the magnetometer of a session with a given model (names of `GROUPS`).

    `field`: `FieldAlong` or `FieldGiven` of the session; `near`: a bias [3] T to begin at, besides
    that of the trimmed start. `TooManyOutliers` above 30 % of them.
    """
    rows, _, mean = complete_rows(data, field)
    return fit_calibration(rows, groups, near)._replace(mean_temperature_k=mean)


def fit_calibration(
    rows: Rows, groups: tuple[str, ...], near: np.ndarray | None = None
) -> Calibration:
    """The calibration of rows; `TooManyOutliers` where there is none to be trusted."""
    few = rows
    if len(rows.t_s) > _ROWS:
        few = rows.take(np.linspace(0, len(rows.t_s) - 1, _ROWS).astype(int))
    values, sigma, residual, j = _levenberg(groups, _start(few, groups), few)
    if near is not None:
        begun = values.copy()
        begun[:3] = near
        other = _levenberg(groups, begun, few)
        if _improbable(*other[:3]) < _improbable(values, sigma, residual):
            values, sigma, residual, j = other
    if few is not rows:
        values, sigma, residual, j = _levenberg(groups, values, rows, 1, frozen=True)
    weight, _ = tukey(residual, sigma)
    outliers = float(np.mean(weight == 0.0))
    if outliers > MOST_OUTLIERS:
        raise TooManyOutliers(
            f"b_measured: must have at most {100 * MOST_OUTLIERS:.0f} % outliers to be calibrated; "
            f"received {100 * outliers:.0f} % (residuals beyond {TUKEY:g} sigma of "
            f"{1e9 * sigma:.0f} nT)"
        )
    usual = float(np.median(np.linalg.norm(rows.m, axis=1)))
    if sigma > _FOLLOWS * usual:
        raise TooManyOutliers(
            f"b_measured: must follow the strength of the field within {100 * _FOLLOWS:.0f} % to "
            f"be calibrated; received residuals of {1e9 * sigma:.0f} nT"
        )
    covariance, correlation = covariance_of(residual, j, sigma)
    sizes = _sizes(groups)
    return Calibration(
        groups,
        _names(groups),
        values,
        covariance * np.outer(sizes, sizes),
        sigma,
        residual,
        weight,
        correlation,
        unknown_directions(_names(groups), covariance),
    )


def _improbable(values, sigma, residual) -> float:
    """How improbable a fit is [nats]: of readings that turn little a far bias fits as well."""
    size = float(np.sum((values[:3] / _USUAL_BIAS_T) ** 2))
    return len(residual) * np.log(sigma) + 0.5 * (tukey(residual, sigma)[1] + size)


def _start(rows: Rows, groups) -> np.ndarray:
    strength, _ = rows.field.strength(rows.t_s)
    some = np.linspace(0, len(rows.t_s) - 1, min(len(rows.t_s), 2000)).astype(int)
    found = trim_squares(rows.m[some], strength[some])
    bias = dict(zip(GROUPS["bias"].names, found.bias, strict=True))
    scale = dict.fromkeys(GROUPS["scale"].names, found.factor - 1.0)
    values = np.array([(bias | scale).get(name, 0.0) for name in _names(groups)])
    if "shift" not in groups:
        return values
    # without a shift first: from a start far off it could run away
    rest = tuple(g for g in groups if g in ("bias", "scale", "non_orthogonality"))
    inner, *_ = _levenberg(rest, values[: len(_names(rest))], rows, 15)
    values[: len(inner)] = inner
    return values


def covariance_of(residual, j, sigma) -> tuple[np.ndarray, float]:
    """Covariance in usual sizes (a sandwich), and the correlation of neighbouring residuals.

    The filling allows for residuals that are correlated over time: a white part and one whose
    correlation decays exponentially, by the row. Of few rows these are found by restricted
    likelihood, as fitting hides much of their correlation; of many by their autocorrelation.
    """
    z = np.minimum((residual / (TUKEY * sigma)) ** 2, 1.0)
    pushed = residual * (1.0 - z) ** 2
    bread = (j * ((1.0 - z) * (1.0 - 5.0 * z))[:, None]).T @ j
    bread += 1e-8 * sigma**2 * np.eye(j.shape[1])  # 1e4 usual sizes: what no data determine
    g = j * (z < 1.0)[:, None]
    outer = np.linalg.pinv(bread, hermitian=True)
    kept = np.flatnonzero(z < 1.0)
    if j.shape[1] < len(kept) <= _FEW:
        return outer @ _likely(pushed[kept], g[kept], kept) @ outer, _first_correlation(pushed)
    count, white = int(np.sum(z < 1.0)), g.T @ g
    used, first, filling = float(j.shape[1]), 0.0, white
    for _ in range(2):  # fitting takes more away from correlated residuals: how much, from both
        part, decay, first = _autocorrelation(pushed, used)
        if part > 0.0:
            run = lfilter([1.0], [1.0, -decay], g, axis=0)
            both = run.T @ g
            filling = (1.0 - part) * white + part * (both + both.T - white)
        used = min(float(np.trace(outer @ filling)), 0.5 * count)
    variance = float(np.sum(pushed**2)) / max(count - used, 1.0)
    return variance * outer @ filling @ outer, first


def _likely(u, g, place) -> np.ndarray:
    """Covariance [p, p] of `g` [n, p] times the errors of which `u` [n] at rows `place` is left.

    `g`: derivatives of the fit that left them. Over all shapes of the correlation the mean by their
    restricted likelihood: an hour does not say which it is.
    """
    from scipy.linalg import solve_triangular

    apart, freedoms = np.abs(np.subtract.outer(place, place)), len(u) - g.shape[1]
    costs, found = [], []
    for decay, part in ((0.0, 0.0), *product(_DECAYS, _PARTS)):
        shape = part * decay**apart
        np.fill_diagonal(shape, 1.0)
        root = np.linalg.cholesky(shape)
        white = solve_triangular(root, np.column_stack([g, u]), lower=True)
        # the last row of R is what of the residuals no parameter can explain
        r = np.maximum(np.abs(np.diag(np.linalg.qr(white, mode="r"))), 1e-300)
        lost = np.sum(np.log(np.diag(root))) + np.sum(np.log(r[:-1]))
        costs.append(lost + freedoms * np.log(r[-1]))
        found.append(r[-1] ** 2 / freedoms * (g.T @ shape @ g))
    weight = np.exp(np.min(costs) - costs)
    weight[1:] /= len(costs) - 1  # white beforehand as likely as correlated
    return np.tensordot(weight / weight.sum(), found, 1)


def _first_correlation(u) -> float:
    """Correlation of neighbouring residuals."""
    power = float(u @ u)
    return float(u[1:] @ u[:-1]) / power if power > 0.0 else 0.0


def _autocorrelation(u, used: float) -> tuple[float, float, float]:
    """Correlated part, decay by the row, correlation at one row; (0, 0, .) of white residuals."""
    u = u[:_COUNTED]
    count = len(u)
    lags = min(30, count // 4)
    power = float(u @ u)
    if lags < 3 or power == 0.0:
        return 0.0, 0.0, 0.0
    rho = np.array([u[k:] @ u[:-k] for k in range(1, lags + 1)]) / power
    first = float(rho[0])
    # what fitting takes away from the correlation of residuals, by the unknowns used
    rho = rho + used / count
    noise = 1.0 / np.sqrt(count)
    if rho[0] < 2.0 * noise and abs(np.sum(rho[:5])) < 2.0 * noise * np.sqrt(5.0):
        return 0.0, 0.0, first
    used = max(2, int(np.argmax(rho < 2.0 * noise)) if np.any(rho < 2.0 * noise) else lags)
    k = np.arange(1, used + 1)
    decays = np.linspace(0.02, 0.995, 196)
    shapes = decays[:, None] ** k
    parts = np.clip((shapes @ rho[:used]) / np.sum(shapes**2, axis=1), 0.0, 1.0)
    misfit = np.sum((rho[:used] - parts[:, None] * shapes) ** 2, axis=1)
    best = int(np.argmin(misfit))
    return float(parts[best]), float(decays[best]), first


class Choice(NamedTuple):
    """A model that was tried: rms [T] of the rows fitted, and of blocks of time held out."""

    groups: tuple[str, ...]
    fitted: float
    held_out: float


def choose(
    data: xr.Dataset, field, blocks: int = 6, models=MODELS, near: np.ndarray | None = None
) -> tuple[Calibration, tuple[Choice, ...]]:
    """Calibration by the smallest model that predicts blocks held out as well as the best does.

    'As well': within one standard error of the difference over the blocks, of errors in units of
    the reading, as a scale that shrinks readings shrinks their noise, too. Outliers of the largest
    model's fit are left out. Models whose data are missing or constant are not tried, those that
    the rows do not determine are not taken.
    """
    every, _, mean_k = complete_rows(data, field)
    rows = every
    if len(rows.t_s) > _COMPARED:
        rows = every.take(np.linspace(0, len(rows.t_s) - 1, _COMPARED).astype(int))
    tried = [model for model in models if _can_fit(model, rows, blocks)]
    whole = [fit_calibration(rows, model, near) for model in tried]
    good = np.flatnonzero(whole[-1].weight > 0.0)
    rows = rows.take(good)
    place = np.minimum((np.arange(len(good)) * blocks) // len(good), blocks - 1)
    errors = np.zeros((len(tried), blocks))
    for k, (model, first) in enumerate(zip(tried, whole, strict=True)):
        for block in range(blocks):
            rest, *_ = _levenberg(model, first.values.copy(), rows.take(place != block))
            held = rows.take(place == block)
            at_s = _shift(model, rest)
            strength, slope = held.field.strength(held.t_s + at_s)
            residual, _ = _model(model, rest, held, strength, slope, at_s)
            errors[k, block] = np.mean((residual / _gain(model, rest)) ** 2)
    mean = errors.mean(axis=1)
    # what the rows do not determine fits them by chance: only the smallest may be so
    mean[1:][[bool(each.undetermined) for each in whole[1:]]] = np.inf
    best = int(np.argmin(mean))
    error = np.std(errors - errors[best], axis=1, ddof=1) / np.sqrt(blocks)
    held_out = np.sqrt(errors.mean(axis=1))
    chosen = int(np.flatnonzero(mean - mean[best] <= error)[0])
    choices = tuple(
        Choice(model, each.rms, float(m))
        for model, each, m in zip(tried, whole, held_out, strict=True)
    )
    found = whole[chosen]
    if len(every.t_s) > _COMPARED:
        found = fit_calibration(every, tried[chosen], near)
    # a bias alone takes up the scale that the rows do not determine
    open_ = (*found.undetermined, *(whole[1].undetermined if chosen == 0 and whole[1:] else ()))
    open_ = tuple(dict.fromkeys(open_))
    return found._replace(mean_temperature_k=mean_k, undetermined=open_), choices


def _gain(groups, values) -> float:
    """The factor by which a correction makes readings longer, as a mean of all directions."""
    p = dict.fromkeys(_names(GROUPS), 0.0) | dict(zip(_names(groups), values, strict=True))
    return float(np.cbrt(abs(np.linalg.det(_matrix(p))))) or 1e-3


def _can_fit(model, rows: Rows, blocks: int) -> bool:
    if len(rows.t_s) * (blocks - 1) // blocks < 2 * len(_names(model)):
        return False
    varied = {
        "coils": np.ptp(rows.dipole, axis=0).min(),
        "temperature": np.ptp(rows.warmth),
    }
    return all(varied.get(group, 1.0) > 0.0 for group in model)


def split_shift(
    shift_s: float, sigma_s: float, clock_sigma_s: float, along_track_sigma_m: float, speed: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Clock offset (value, sigma) [s] and along-track error (value, sigma) [m] of one shift.

    |B| knows their sum alone: what is stated of each beforehand splits it. `speed` [m/s].
    """
    clock, along = clock_sigma_s**2, (along_track_sigma_m / speed) ** 2
    total = clock + along + sigma_s**2
    pairs = []
    for own, unit in ((clock, 1.0), (along, speed)):
        pairs.append((unit * shift_s * own / total, unit * np.sqrt(own - own**2 / total)))
    return pairs[0], pairs[1]
