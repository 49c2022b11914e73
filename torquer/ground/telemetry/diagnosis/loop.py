"""Dipoles that were commanded from the readings themselves, whose noise they therefore carry.

A B-dot command is -k (m - m_before): fitted to the same readings, its noise makes a coupling of
-1/(2 k) that no coil has. Every block of time has it, so blocks held out do not see it. Instruments
do not help: the part of such a command that is no noise is nearly a rotation of the field, to which
|B| is blind (the vector error grows from 88 to 300 nT and more).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

#: Part of the dipoles' variance that readings and their rate explain, and the correlation of the
#: noise of both, from which on dipoles follow the readings. Measured: 0.50 and more against 0.03.
_FOLLOWS, _NOISE = 0.2, -0.15
#: Rows of a local parabola: its reach, and the nearest that it uses.
_REACH, _GAP = 6, 2
_LEAST_ROWS = 40


class Followed(NamedTuple):
    """How far dipoles follow the readings: part of their variance that these and their rate
    explain, and the correlation of the noise of both."""

    explained: float
    noise_correlation: float

    @property
    def follows(self) -> bool:
        """Whether readings and their rate explain the dipoles."""
        return self.explained > _FOLLOWS

    @property
    def is_loop(self) -> bool:
        """Whether the dipoles were made from these readings, or these feel them strongly."""
        return self.follows or self.noise_correlation < _NOISE

    @property
    def text(self) -> str:
        """Why no coupling of the coils can be had."""
        return (
            f"the dipoles follow the readings ({100.0 * self.explained:.0f} % of their variance, "
            f"correlation of the noise {self.noise_correlation:+.2f}), so |B| does not say what "
            "the coils do to the magnetometer: take rows with other commands"
        )


def follow(t_s: np.ndarray, m: np.ndarray, dipole: np.ndarray) -> Followed | None:
    """How far dipoles [n, 3] A m^2 follow readings [n, 3] T at times [n] s.

    None for rows that are too few, or dipoles that never change.
    """
    if len(t_s) < _LEAST_ROWS or not np.ptp(dipole, axis=0).any():
        return None
    columns = np.column_stack([m, np.gradient(m, t_s, axis=0), np.ones(len(m))])
    columns /= np.linalg.norm(columns, axis=0) + 1e-300
    left = dipole - columns @ np.linalg.lstsq(columns, dipole, rcond=1e-10)[0]
    chance = (len(m) - 1.0) / (len(m) - columns.shape[1])
    explained = 1.0 - chance * np.sum(left**2) / np.sum((dipole - dipole.mean(axis=0)) ** 2)
    noises = [_without_course(each) for each in (m, dipole)]
    some = [
        np.corrcoef(read, made)[0, 1]
        for read, made in zip(noises[0].T, noises[1].T, strict=True)
        if np.ptp(read) > 0.0 and np.ptp(made) > 0.0
    ]
    return Followed(float(explained), float(np.mean(some)) if some else 0.0)


def _without_course(values: np.ndarray) -> np.ndarray:
    """Rows less a local parabola through others, not through themselves or their neighbours."""
    steps = np.concatenate([np.arange(-_REACH, 1 - _GAP), np.arange(_GAP, _REACH + 1)])
    weight = np.linalg.pinv(np.vander(steps, 3, increasing=True))[0]
    kernel = np.zeros(2 * _REACH + 1)
    kernel[steps + _REACH] = weight
    course = np.column_stack([np.convolve(axis, kernel[::-1], "valid") for axis in values.T])
    return values[_REACH:-_REACH] - course
