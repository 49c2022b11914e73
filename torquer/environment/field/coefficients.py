"""Gauss coefficients of the field models that ship with the package, at any date they cover."""

import warnings
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

FOLDER = Path(__file__).parent.parent / "coefficients"
NANOTESLA = 1e-9


class Extrapolated(UserWarning):
    """A field model is used beyond its period of validity."""


class Epochs(NamedTuple):
    """A model as published: dates, and g and h at each, `[epoch, n, m]` in nT."""

    years: np.ndarray
    g: np.ndarray
    h: np.ndarray


def read_shc(path: Path) -> Epochs:
    """Coefficients in the IAGA's `.shc` form: n, m (negative for h), one column per epoch."""
    lines = [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]
    (_, degree, *_), years, *rows = lines
    g = np.zeros((len(years), int(degree) + 1, int(degree) + 1))
    h = np.zeros_like(g)
    for n, m, *values in rows:
        part = h if int(m) < 0 else g
        part[:, int(n), abs(int(m))] = [float(value) for value in values]
    return Epochs(np.array([float(year) for year in years]), g, h)


def read_cof(path: Path, valid_years: float = 5.0) -> Epochs:
    """Coefficients in NOAA's `.COF` form (n, m, g, h, dg/dt, dh/dt) as two epochs."""
    header, *rows = (line.split() for line in path.read_text().splitlines())
    rows = [[float(value) for value in row] for row in rows if len(row) == 6]
    degree = int(max(row[0] for row in rows))
    g, h = np.zeros((2, 2, degree + 1, degree + 1))
    for n, m, g_main, h_main, g_rate, h_rate in rows:
        g[:, int(n), int(m)] = g_main, g_main + valid_years * g_rate
        h[:, int(n), int(m)] = h_main, h_main + valid_years * h_rate
    first = float(header[0])
    return Epochs(np.array([first, first + valid_years]), g, h)


@cache
def published_epochs(model: str) -> Epochs:
    """The epochs of `igrf14` or `wmm2025`."""
    if model == "igrf14":
        return read_shc(FOLDER / "IGRF14.shc")
    return read_cof(FOLDER / "WMM2025.COF")


def max_degree(model: str) -> int:
    """Highest degree of a model."""
    return published_epochs(model).g.shape[1] - 1


def check_date(model: str, decimal_year: float, extrapolate: bool, when: str = "") -> None:
    """`ValueError` for a date outside the model's validity, or a warning where that is allowed.

    `when` names the date in the message.
    """
    first, *_, last = published_epochs(model).years
    if first <= decimal_year <= last:
        return
    received = f"{round(float(decimal_year), 6)}{when}"
    line = f"field model {model}: date must lie within {first}..{last}; received {received}"
    if not (extrapolate and np.isfinite(decimal_year)):
        raise ValueError(line)
    warnings.warn(f"{line}: extrapolated", Extrapolated, stacklevel=3)


def schmidt_coefficients(
    model: str, decimal_year: float, extrapolate: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """g and h `[n, m]` in tesla at a date, Schmidt quasi-normalised.

    Linear in time between the epochs; after the last main field by the secular variation,
    which both files give as (or are read into) a last epoch five years on.
    """
    check_date(model, decimal_year, extrapolate)
    years, g, h = published_epochs(model)
    k = int(pieces(model, decimal_year))
    part = (decimal_year - years[k]) / (years[k + 1] - years[k])
    mixed = [NANOTESLA * ((1.0 - part) * c[k] + part * c[k + 1]) for c in (g, h)]
    return mixed[0], mixed[1]


def pieces(model: str, decimal_years) -> np.ndarray:
    """Numbers of the epochs from which the coefficients run at these dates, linear to the next.

    At an epoch, its own; the first and the last piece extrapolate.
    """
    years = published_epochs(model).years
    return np.clip(np.searchsorted(years, decimal_years, side="right") - 1, 0, len(years) - 2)


def schmidt_rates(model: str, piece: int) -> tuple[np.ndarray, np.ndarray]:
    """dg/dt and dh/dt `[n, m]` in T/yr of a piece, to the last degree that changes."""
    years, g, h = published_epochs(model)
    span = years[piece + 1] - years[piece]
    rates = np.stack([NANOTESLA * (c[piece + 1] - c[piece]) / span for c in (g, h)])
    size = int(np.flatnonzero(rates.any(axis=(0, 2)))[-1]) + 1
    return rates[0, :size, :size], rates[1, :size, :size]
