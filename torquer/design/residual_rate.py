"""The rate that remains whatever the gain, and limits above it.

A residual dipole, or noise, keeps a satellite turning. A limit within that motion is crossed by
chance again and again: the time from which the rate stays below it depends on how long the flight
lasts, and a gain chosen by it on chance.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from torquer.campaign.statistics import quantile
from torquer.design.gain_flights import GainFlights, usable_flights

#: Factors between limits for which flights are counted, and how many there are.
_STEP, _LIMITS = 1.25, 16
#: A limit that tells gains apart is at least so many times the rate that remains.
CLEAR = 1.5
#: A limit up to this much above the greatest rate that remains lies within the motion.
_NEAR = 1.2
#: Part of the releases that must have been below the limit early, and that were above it again.
_EARLY, _AGAIN = 0.5, 0.25
#: Revolutions at the end over which the motion that remains is measured.
LAST_REVOLUTIONS = 2.0


class Residual(NamedTuple):
    """The rate that remains [deg/s] in the last two revolutions: its mean over time and releases,
    and the greatest of a release, which nine in ten do not exceed.
    """

    mean: float
    greatest: float


def limits_from(below_deg_s: float, tip_off_deg_s: float) -> list[float]:
    """Limits [deg/s] from one on, up to half of the rate after release."""
    above = (below_deg_s * _STEP**k for k in range(1, _LIMITS))
    return [below_deg_s, *(limit for limit in above if limit < 0.5 * tip_off_deg_s)]


def residual_of(each: GainFlights, below_deg_s: float, late_from_s: float) -> Residual | None:
    """The rate that remains with a gain if the limit lies within it, else None.

    Of the releases that were below the limit before `late_from_s`, at least a quarter must have
    been above it again, and their greatest rates after that must reach it.
    """
    early = each.first_s <= late_from_s
    if not early.any() or np.mean(each.settled_s[early] > each.first_s[early]) < _AGAIN:
        return None
    greatest = quantile(each.late_deg_s[early], 0.9)
    if below_deg_s > _NEAR * greatest:
        return None
    return Residual(float(each.mean_late_deg_s[early].mean()), greatest)


def common_residual(
    flights: Sequence[GainFlights], most: float, below_deg_s: float, late_from_s: float
) -> Residual | None:
    """The least motion of all gains up to `most`, if the limit lies within each; else None.

    Gains with which few releases came below the limit early say nothing.
    """
    found = [
        residual_of(each, below_deg_s, late_from_s)
        for each in usable_flights(flights, most)
        if np.mean(each.first_s <= late_from_s) >= _EARLY
    ]
    known = [each for each in found if each is not None]
    if not known or len(known) < len(found):
        return None
    return min(known, key=lambda each: each.greatest)


def clear_limit(residual: Residual, limits: Sequence[float]) -> float | None:
    """The least of some limits that is well above a motion that remains; None if none is."""
    return next((limit for limit in limits if limit >= CLEAR * residual.greatest), None)
