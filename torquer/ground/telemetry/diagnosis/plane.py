"""Another node and phase of the stated orbit: where nothing fits, elements that are too old.

The drift of a node (5 deg a day) is no error along the track. Gradients by node, phase, height and
eccentricity are free columns of each start, so that few starts find the one minimum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from torquer.ground.telemetry.diagnosis.causes import Place
from torquer.ground.telemetry.diagnosis.fit import WORST_NT, Tried, fit

#: Nodes and phases that are tried, rows for that, and starts that are refined.
_NODES, _PHASES, _COARSE, _KEPT = 30, 30, 60, 12
#: Standard deviation of height, and of its parts once a revolution [km]; rounds of refinement.
_KM, _ROUNDS = 15.0, 5
#: It fits where it leaves so many times the floor and so much more [nT], and at most `WORST_NT`.
_FITS, _FITS_NT = 1.5, 10.0
#: Part of a revolution of rows below which a place is made to fit anything.
LEAST_REVOLUTIONS = 1.0


class Plane(NamedTuple):
    """The same orbit with its node turned to the east [deg] and its phase ahead [s]: the residual
    [nT] there, and whether that is what a free field leaves."""

    node_deg: float
    phase_s: float
    residual_nt: float
    fits: bool


def find_plane(t_s: np.ndarray, m: np.ndarray, place: Place, floor_nt: float) -> Plane:
    """The node and phase with which readings [n, 3] nT at times [n] s fit best."""
    coarse = np.linspace(0, len(t_s) - 1, min(len(t_s), _COARSE)).astype(int)
    period, width = place.period_s, np.array([np.pi / _NODES, 0.5 * place.period_s / _PHASES])
    grid = np.array(
        [(n, p) for n in np.arange(_NODES) * 2.0 * np.pi / _NODES
         for p in np.arange(_PHASES) * period / _PHASES]
    )  # fmt: skip
    spread, moved = _refine(t_s[coarse], m[coarse], place, grid, width)
    best = np.argsort(spread)[:_KEPT]
    tried = grid[best] + moved[best]
    for k in range(_ROUNDS):
        rows = coarse if k < _ROUNDS - 1 else slice(None)
        spread, moved = _refine(t_s[rows], m[rows], place, tried, width / 2.0**k)
        tried = tried + moved
    node, phase = tried[np.argmin(spread)]
    least = float(np.min(spread))
    return Plane(
        float(np.degrees((node + np.pi) % (2.0 * np.pi) - np.pi)),
        float((phase + 0.5 * period) % period - 0.5 * period),
        least,
        least < min(_FITS * floor_nt + _FITS_NT, WORST_NT),
    )


def _refine(t_s, m, place: Place, places, width) -> tuple[np.ndarray, np.ndarray]:
    """Spread of the residuals [k] nT at each node [rad] and phase [s], and what to add to these."""
    radius_km = _radius_km(place, t_s[:1])
    found_at = (_at(t_s, place, radius_km, *each) for each in places)
    strengths, columns = zip(*found_at, strict=True)
    count = len(places)
    tried = Tried(
        np.repeat(m[None], count, axis=0),
        np.array(strengths),
        np.array(columns),
        np.tile([*width, _KM, _KM, _KM], (count, 1)),
    )
    found = fit(tried, 12)
    spread = 1.4826 * np.median(np.abs(found.residual), axis=1)
    return spread, found.values[:, 9:11]


def _at(t_s, place: Place, radius_km: float, node: float, phase_s: float):
    """Strength [n] nT, and its derivatives [n, 5] by node, phase and height in km."""
    path = place.path(t_s, phase_s)
    here = place.strength_on(path, node)
    up = (place.strength_on(path, node, 1.001) - here) / (1e-3 * radius_km)
    turn = 2.0 * np.pi * t_s / place.period_s
    later = place.path(t_s, phase_s + 5.0)
    columns = [
        (place.strength_on(path, node + 0.01) - here) / 0.01,
        (place.strength_on(later, node) - here) / 5.0,
        up, up * np.cos(turn), up * np.sin(turn),
    ]  # fmt: skip
    return here, np.stack(columns, axis=1)


def _radius_km(place: Place, t_s) -> float:
    return 1e-3 * float(np.linalg.norm(place.environment.state(t_s)[0][0]))
