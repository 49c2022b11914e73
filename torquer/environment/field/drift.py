"""A field at points with a date each: the coefficients follow the time.

Between two epochs of the published coefficients they are linear in the decimal year, and so is
the field at a place: B = B(epoch) + (years since) dB/dt, exact, from two expansions. The
secular variation is smoother than the field (the last five years of IGRF-14 end at degree 8, not
13), so the second expansion costs half of the first.
"""

import functools
from datetime import datetime

import numpy as np

from torquer.base.time import decimal_year, decimal_years, new_years
from torquer.environment.field.coefficients import check_date, pieces, published_epochs
from torquer.environment.field.gauss import Gauss
from torquer.environment.field.tilted_dipole import TiltedDipole


def coefficients_name(model) -> str | None:
    """Name of the published coefficients of a model; None if it does not depend on the date."""
    if getattr(model, "held_at_year", None) is not None:
        return None
    if isinstance(model, Gauss):
        return model.kind
    if isinstance(model, TiltedDipole) and model.mu_e_t_km3 is None:
        return model.source
    return None


@functools.lru_cache(maxsize=64)
def _prepare(model, year: float) -> tuple:
    return model.prepare(year)


@functools.lru_cache(maxsize=64)
def linear_piece(model, number: int) -> tuple:
    """(Epoch, field at the epoch, its change per year) of a model between two epochs."""
    epoch = float(published_epochs(coefficients_name(model)).years[number])
    return epoch, model.prepare(epoch), model.prepare_rate(number)


def b_inertial_along(
    model, start: datetime, t_s, r_inertial, v_inertial, dcm_inertial_to_ecef
) -> np.ndarray:
    """Flux density [n, 3] T in J at seconds [n] after the start, each at its own date.

    The other arguments are those of the model's `b_inertial`. Dates are not checked: outside its
    validity a model is extrapolated linearly.
    """
    points = (r_inertial, v_inertial, dcm_inertial_to_ecef)
    source = coefficients_name(model)
    if hasattr(model, "prepare_along") and len(t_s):
        return model.b_inertial(model.prepare_along(start, t_s), *points)
    if source is None or len(t_s) == 0:
        return model.b_inertial(_prepare(model, decimal_year(start)), *points)
    years = decimal_years(start, t_s)
    numbers = pieces(source, years)
    if np.all(numbers == numbers[0]):
        return _within_piece(model, int(numbers[0]), years, *points)
    out = np.empty_like(r_inertial)
    for number in np.unique(numbers):
        rows = numbers == number
        out[rows] = _within_piece(model, int(number), years[rows], *(x[rows] for x in points))
    return out


def _within_piece(model, number: int, years, *points) -> np.ndarray:
    epoch, at_epoch, per_year = linear_piece(model, number)
    change = model.b_inertial(per_year, *points)
    change *= (years - epoch)[:, None]
    change += model.b_inertial(at_epoch, *points)
    return change


def check_span(model, start: datetime, *times_s: float) -> None:
    """`ValueError` (a warning if the model extrapolates) for a time outside its validity."""
    source = coefficients_name(model)
    if source is None:
        return
    for t_s in times_s:
        try:
            year = float(decimal_years(start, t_s))
        except OverflowError:  # beyond the calendar
            year = np.inf
        check_date(source, year, model.extrapolate, f" at t = {t_s:g} s" if t_s else "")


def bends_s(model, start: datetime, first_s: float, last_s: float) -> np.ndarray:
    """Times [s] between `first_s` and `last_s` at which the rate of change jumps.

    Each 1 January: at an epoch of the coefficients, which come first, by another rate per year;
    else because one of the two years has 366 days.
    """
    source = coefficients_name(model)
    if source is None:
        return np.empty(0)
    at_s, years = new_years(start, first_s, last_s)
    within = (at_s > first_s) & (at_s < last_s)
    at_s, common = at_s[within], ~np.isin(years[within], published_epochs(source).years)
    return at_s[np.argsort(common, kind="stable")]
