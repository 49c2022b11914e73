"""Settling times of a campaign beside the first times: whether a limit tells members apart.

Both follow from the instants of the signals that a campaign keeps, at most 200 of a run, so the
first times are known to a part of a percent of the run's length at best.
"""

import numpy as np
import xarray as xr

from torquer.analysis.residual import find_residual
from torquer.analysis.series import first_at, times_above
from torquer.base.strict_json import finite_or_none
from torquer.campaign.contents import definition, member_blocks, series_of, unit_of_signal
from torquer.campaign.statistics import quantile
from torquer.simulation.results.dataset import flown_scenario


def settling(result: xr.Dataset, name: str) -> dict | None:
    """First times below the limit of an outcome that is a settling time; None for others.

    `first_median_s`: over all members, None if fewer than half are ever below; `again`: members
    above the limit again; `within_residual`: members in whose residual motion the limit lies, and
    `residual`: the median of its ends.
    """
    (_, what), series = definition(result, name), series_of(result, name)
    limit = what.get("settles_below")
    if limit is None or series is None:
        return None
    t_s = np.asarray(result[series]["time"].values, dtype=float)
    first_s, again, each, period_s = [np.zeros(0)], 0, [], _period_s(result)
    for rows in member_blocks(result):
        signal = result[series].isel(member=rows).transpose("time", "member").values.astype(float)
        below = signal < limit
        first_s.append(first_at(t_s, below))
        again += int(np.count_nonzero(times_above(below)))
        if period_s is not None:
            each += [find_residual(t_s, one, limit, period_s) for one in signal.T]
    known = np.array([residual for residual in each if residual is not None])
    return {
        "below": float(limit),
        "unit": unit_of_signal(result, name),
        "first_median_s": finite_or_none(quantile(np.concatenate(first_s), 0.5)),
        "again": again,
        "within_residual": len(known),
        "residual": np.median(known, axis=0).tolist() if len(known) else None,
    }


def _period_s(result: xr.Dataset) -> float | None:
    """The orbit's period; None where no orbit is known."""
    try:
        return flown_scenario(result).orbit.period_s
    except ValueError:  # of another version, or of a user's files that are gone
        return None


def settling_in_words(found: dict, members: int, unit: str) -> str:
    """The first times of a settling time, and whether the limit lies within what remains."""
    first = found["first_median_s"]
    words = f"median {'missing' if first is None else f'{first:.4g}'}"
    if found["again"]:
        words += f"; {found['again']} of {members} members are above it again"
    if found["within_residual"]:
        low, high = found["residual"]
        words += (
            f"; in {found['within_residual']} the limit lies within the residual motion, "
            f"{low:.3g}..{high:.3g}{' ' * bool(unit)}{unit}: there the settling time is chance"
        )
    return words
